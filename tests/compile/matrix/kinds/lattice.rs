{
    // A ring of rigid bodies that rub on each other.
    let lattice = Lattice::on(Graph::ring(4), LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .bond_onsager(|bond| {
            let [u, v] = bond.w;
            [Onsager { rate: 0.1, b: [u.cross(v), v.cross(u)] }]
        })
        .build()?;
    let start = lattice.points(|site| vector![0.4 + 0.1 * site as f64, -1.0, 0.3]);
    (lattice, start)
}
