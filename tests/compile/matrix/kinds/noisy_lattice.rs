{
    // A ring of bodies that conduct heat, with the energy `u` and the entropy `ln u` of each, with their thermal noise.
    let ring = Lattice::on(Graph::ring(4), Euclidean::<1>)
        .energy(|u: &Vector1<Real>| u.x)
        .entropy(|u: &Vector1<Real>| u.x.ln())
        .bond_onsager(|bond| {
            let [u, v] = bond.x.map(|u| u.x);
            [Onsager { rate: 0.1 * u * v, b: [vector![bond.w[1].x], vector![-bond.w[0].x]] }]
        })
        .build()?
        .with_noise(Boltzmann(0.01));
    let start = ring.flow().points(|site| vector![1.0 + 0.1 * site as f64]);
    (ring, start)
}
