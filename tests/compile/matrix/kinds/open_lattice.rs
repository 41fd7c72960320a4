{
    // A ring of rigid bodies that rub on each other; one has a torque, and one is in air.
    let ring = Lattice::on(Graph::ring(4), LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .bond_onsager(|bond| {
            let [u, v] = bond.w;
            [Onsager { rate: 0.1, b: [u.cross(v), v.cross(u)] }]
        })
        .build()?
        .opened()
        .work("torque", [0], |t, _, p: &Vector3<f64>| p.cross(&vector![0.0, 0.5 * t.sin(), 0.0]))
        .bath("air", 1.0, [1], |_, _: &SiteState<'_, LieDual<3>>| {
            [Onsager { rate: 0.1, b: vector![0.0, 1.0, 0.0] }]
        });
    let points = ring.lattice().points(|site| vector![0.4 + 0.1 * site as f64, -1.0, 0.3]);
    let start = ring.start(points);
    (ring, start)
}
