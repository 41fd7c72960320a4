{
    // Oscillators that answer the questions of a system by themselves, and whose number is read.
    #[derive(Clone)]
    struct Oscillators(usize);
    impl Equations for Oscillators {
        fn sizes(&self) -> Sizes {
            Sizes { entries: 2 * self.0, directions: 2 * self.0, laws: 2 }
        }
        fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
            values[ENERGY] = x.iter().map(|x| 0.5 * x * x).sum();
            values[ENTROPY] = 0.0;
        }
        fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
            self.values(t, x, values);
            w.fill(0.0);
            w[..x.len()].copy_from_slice(x);
        }
        fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
            let (q, p) = x.split_at(self.0);
            v[..self.0].copy_from_slice(p);
            (0..self.0).for_each(|i| v[self.0 + i] = -q[i]);
            Some(0.0)
        }
    }
    let count: usize = "3".parse()?;
    (FromEquations(Oscillators(count)), Entries::from(vec![0.1; 2 * count]))
}
