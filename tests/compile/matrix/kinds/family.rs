{
    // A rigid body with friction, at a value of its parameter.
    let family = Family::on(LieDual::so3())
        .parameters(["a"])
        .energy(|p: &Vector3<Real>, t: &Vector1<Real>| {
            p.x * p.x * t.x * 0.5 + p.y * p.y + p.z * p.z * 1.5
        })
        .entropy(|p: &Vector3<Real>, _: &Vector1<Real>| p.norm_squared() * 0.5)
        .build()?;
    (family.at(vector![1.0]), vector![0.4, -1.0, 0.3])
}
