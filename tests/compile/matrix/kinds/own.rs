{
    // Oscillators that answer the questions of a system by themselves, and whose number is read. The first one rubs on a body with the
    // energy and the entropy `u`.
    #[derive(Clone)]
    struct Oscillators {
        count: usize,
        drive: f64,
    }
    impl Equations for Oscillators {
        fn sizes(&self) -> Sizes {
            Sizes { entries: 2 * self.count + 1, directions: 2 * self.count + 1, laws: 2 }
        }
        fn values(&self, t: f64, x: &[f64], values: &mut [f64]) {
            let (u, qp) = x.split_last().unwrap();
            let squares: f64 = qp.iter().map(|x| 0.5 * x * x).sum();
            values[ENERGY] = squares + u + self.drive * t.sin() * x[0];
            values[ENTROPY] = *u;
        }
        fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
            self.values(t, x, values);
            w.fill(0.0);
            let n = x.len();
            w[..n - 1].copy_from_slice(&x[..n - 1]);
            w[0] += self.drive * t.sin();
            (w[n - 1], w[2 * n - 1]) = (1.0, 1.0);
        }
        fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
            let (q, p) = x.split_at(self.count);
            let production = 0.1 * p[0] * p[0];
            v[..self.count].copy_from_slice(&p[..self.count]);
            (0..self.count).for_each(|i| v[self.count + i] = -q[i]);
            v[self.count] -= self.drive * t.sin() + 0.1 * p[0];
            v[2 * self.count] = production;
            Some(production)
        }
        fn second_law(&self) -> SecondLaw {
            SecondLaw::Exact
        }
        fn energy_depends_on_time(&self) -> bool {
            self.drive != 0.0
        }
        fn power(&self, t: f64, x: &[f64]) -> f64 {
            self.drive * t.cos() * x[0]
        }
        fn is_vector_space(&self) -> bool {
            true
        }
    }
    impl FrictionTerms for Oscillators {
        fn term_count(&self) -> usize {
            1
        }
        fn terms(&self, _: f64, x: &[f64], w: Covectors<'_>, term: &mut Terms<'_>) {
            let (p, u) = (self.count, 2 * self.count);
            term(0.1, &[(p, -w.energy[u]), (u, w.energy[p])]);
        }
    }
    let count: usize = "3".parse()?;
    let system = Oscillators { count, drive: 0.0 };
    (FromEquations(system), Entries::from(vec![0.1; 2 * count + 1]))
}
