//! The operator of a step.

use metriplectic::integrators::noise::Numbers;
use metriplectic::integrators::{Element, Flow, StepStart, Stepper};
use metriplectic_studies::{Claim, Guarantee};
use nalgebra::{DMatrix, DVector};

/// The numbers of one outcome, the same in each step.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    pub(crate) xi: Vec<f64>,
    pub(crate) backward: bool,
}

impl Numbers for Outcome {
    fn number(&self, _: u64, term: usize) -> f64 {
        self.xi[term]
    }

    fn is_backward(&self, _: u64) -> bool {
        self.backward
    }

    fn name(&self) -> String {
        "one outcome".to_owned()
    }
}

/// All outcomes of three-point noise, with their probabilities.
pub(crate) fn outcomes(terms: usize) -> Vec<(f64, Outcome)> {
    let points = [(-3.0_f64.sqrt(), 1.0 / 6.0), (0.0, 2.0 / 3.0), (3.0_f64.sqrt(), 1.0 / 6.0)];
    let mut all = vec![(1.0, Vec::new())];
    for _ in 0..terms {
        all = all
            .into_iter()
            .flat_map(|(q, xi)| {
                points.map(|(x, p)| (q * p, xi.iter().copied().chain([x]).collect::<Vec<_>>()))
            })
            .collect();
    }
    let both = all.into_iter().flat_map(|(q, xi)| {
        [false, true].map(|backward| (0.5 * q, Outcome { xi: xi.clone(), backward }))
    });
    both.collect()
}

/// One step of a method from a state.
pub(crate) fn step<F: Flow, M: Stepper<F>>(
    flow: &F,
    method: &M,
    x: &Element<F>,
    h: f64,
) -> Element<F> {
    let start = StepStart::first(flow, x);
    let taken = method.step(&start, h, &mut M::Memory::default());
    taken.unwrap_or_else(|error| panic!("a step fails: {error}")).x
}

/// A finite basis of functions of the states `X`, with a quadrature by which their coefficients are found.
pub(crate) trait Basis<X> {
    fn nodes(&self) -> &[X];
    /// The values of all functions at a state.
    fn at(&self, x: &X) -> DVector<f64>;
    /// The matrix that takes values at the nodes to coefficients.
    fn projection(&self) -> &DMatrix<f64>;
}

/// The operator of a step on coefficients: those of the mean after a step.
pub(crate) fn operator<X>(
    basis: &impl Basis<X>,
    outcomes: &[(f64, Outcome)],
    step: impl Fn(&X, &Outcome) -> X,
) -> DMatrix<f64> {
    let nodes = basis.nodes();
    let functions = basis.projection().nrows();
    let mut values = DMatrix::<f64>::zeros(nodes.len(), functions);
    for (i, x) in nodes.iter().enumerate() {
        for (q, outcome) in outcomes {
            let row = basis.at(&step(x, outcome)).transpose() * *q;
            let mut here = values.row_mut(i);
            here += row;
        }
    }
    basis.projection() * values
}

/// The mean of a function, by its coefficients, under the law that the operator does not change.
pub(crate) fn mean<X>(basis: &impl Basis<X>, operator: &DMatrix<f64>, f: &DVector<f64>) -> f64 {
    let mut power = operator.clone();
    for _ in 0..16 {
        power = &power * &power;
    }
    let one = coefficients(basis, |_| 1.0);
    let at = basis.at(&basis.nodes()[0]).transpose();
    (&at * &power * f)[0] / (&at * &power * one)[0]
}

/// The mean of a function after steps from a state.
pub(crate) fn after<X>(
    basis: &impl Basis<X>,
    operator: &DMatrix<f64>,
    steps: u32,
    x: &X,
    f: &DVector<f64>,
) -> f64 {
    let mut g = f.clone();
    for _ in 0..steps {
        g = operator * g;
    }
    basis.at(x).dot(&g)
}

/// The coefficients of a function.
pub(crate) fn coefficients<X>(basis: &impl Basis<X>, f: impl Fn(&X) -> f64) -> DVector<f64> {
    basis.projection() * DVector::from_iterator(basis.nodes().len(), basis.nodes().iter().map(f))
}

/// The slope of the logarithm of errors over that of step sizes, by least squares.
pub(crate) fn order(errors: &[(f64, f64)]) -> f64 {
    let logs: Vec<_> = errors.iter().map(|(h, error)| (h.ln(), error.abs().ln())).collect();
    let n = logs.len() as f64;
    let [mx, my] =
        [logs.iter().map(|l| l.0).sum::<f64>() / n, logs.iter().map(|l| l.1).sum::<f64>() / n];
    let above: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    above / logs.iter().map(|(x, _)| (x - mx).powi(2)).sum::<f64>()
}

/// Asserts that orders are within 0.1 of an integer, and records them.
#[track_caller]
pub(crate) fn assert_orders(problem: &str, method: &str, found: &[f64], expected: u32) {
    let all: Vec<_> = found.iter().map(|order| format!("{order:.2}")).collect();
    let all = all.join(", ");
    let meets = |order: &f64| (order - f64::from(expected)).abs() < 0.1;
    assert!(found.iter().all(meets), "{problem}, {method}: {all}");
    Claim::new(Guarantee::Noise, problem, method)
        .against("the exact law, by operators without samples")
        .record(all, format!("{expected} ± 0.1"));
}
