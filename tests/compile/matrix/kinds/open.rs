{
    // A rigid body with friction whose energy depends on time, with a torque and in air. The torque is normal to the gradient
    // of the entropy, as that of a port has to be.
    let system = System::on(LieDual::so3())
        .energy_in_time(|t: Real, p: &Vector3<Real>| {
            p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5 + p.x * t.sin()
        })
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .work("torque", |t: Real, p: &Vector3<Real>| {
            p.cross(&vector![Real::from(0.0), t.sin() * 0.5, Real::from(0.0)])
        })
        .bath("air", Bath::at(1.0).isotropic(0.1))
        .build()?;
    let start = system.start(vector![0.4, -1.0, 0.3]);
    (system, start)
}
