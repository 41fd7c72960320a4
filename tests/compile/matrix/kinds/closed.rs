{
    // A rigid body with friction, on so(3)*.
    let system = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()?;
    (system, vector![0.4, -1.0, 0.3])
}
