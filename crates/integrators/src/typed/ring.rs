//! A system of any number of variables, for the tests of methods of many.

/// Oscillators in a ring with one entropy each, which takes up their heat.
macro_rules! ring {
    ($sites:literal, $n:literal) => {{
        let mut bracket = SMatrix::<f64, $n, $n>::zeros();
        for i in 0..$sites {
            (bracket[(i, $sites + i)], bracket[($sites + i, i)]) = (1.0, -1.0);
        }
        System::on(Euclidean::<$n>)
            .bracket(Poisson::constant(bracket).expect("it is skew"))
            .energy(|x: &SVector<Real, $n>| {
                let mut energy = Real::from(0.0);
                for i in 0..$sites {
                    let (q, p, s) = (x[i], x[$sites + i], x[2 * $sites + i]);
                    let bond = x[(i + 1) % $sites] - q;
                    energy += p * p * 0.5 + q * q * 0.5 + bond * bond * bond * bond * 0.25;
                    energy += s + s * s * 0.5;
                }
                energy
            })
            .entropy(|x: &SVector<Real, $n>| x.fixed_rows::<$sites>(2 * $sites).sum())
            .build()
            .expect("it is a system")
    }};
}
