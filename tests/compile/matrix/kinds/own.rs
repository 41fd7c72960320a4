{
    // Oscillators in a number that is known at run time.
    #[derive(Clone, Debug, PartialEq)]
    struct Oscillators {
        count: usize,
    }
    #[derive(Clone, Debug, PartialEq)]
    struct Phase;
    impl StateSpace for Phase {
        type Element = Vec<f64>;
        fn numbers(x: &Vec<f64>) -> Vec<f64> {
            x.clone()
        }
    }
    impl Flow for Oscillators {
        type Space = Phase;
        type Numbers = [f64; 0];
        type Vector = Vec<f64>;
        fn laws(&self, x: &Element<Self>) -> Laws<[f64; 0]> {
            let energy = x.iter().map(|x| 0.5 * x * x).sum();
            Laws { energy, entropy: 0.0, invariants: [] }
        }
        fn term_sizes(&self, x: &Element<Self>) -> Laws<[f64; 0]> {
            let laws = self.laws(x);
            Laws { energy: 3.0 * laws.energy, ..laws }
        }
        fn rates(&self, x: &Element<Self>, d: &Vec<f64>) -> Option<Vec<f64>> {
            let y = self.moved(x, d);
            let n = self.count;
            Some(y[n..].iter().copied().chain(y[..n].iter().map(|q| -q)).collect())
        }
        fn sizes(&self, x: &Element<Self>) -> Vec<f64> {
            x.iter().map(|x| x.abs()).collect()
        }
        fn moved(&self, x: &Element<Self>, d: &Vec<f64>) -> Vec<f64> {
            x.iter().zip(d).map(|(x, d)| x + d).collect()
        }
        fn element(&self, entries: &[f64]) -> Result<Vec<f64>, PointError> {
            Ok(entries.to_vec())
        }
    }
    (Oscillators { count: 3 }, vec![0.1, 0.2, 0.3, 0.0, 0.0, 0.0])
}
