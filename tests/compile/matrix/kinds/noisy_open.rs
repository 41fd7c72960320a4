{
    // A rigid body with friction, a torque and air, with their thermal noise.
    let system = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .work("torque", |t: Real, p: &Vector3<Real>| {
            p.cross(&vector![Real::from(0.0), t.sin() * 0.5, Real::from(0.0)])
        })
        .bath("air", Bath::at(1.0).isotropic(0.1))
        .noise(Boltzmann(0.1))
        .build()?;
    let start = system.flow().start(vector![0.4, -1.0, 0.3]);
    (system, start)
}
