use super::*;
use metriplectic_fields::{Matrix, Square as _};
use metriplectic_manifolds::Euclidean;
use nalgebra::{Matrix1, Matrix2, Vector1, Vector2, vector};

/// Round-off of the terms alone.
fn rounding<M: Space>(terms: Vector<M>) -> Rounding<M> {
    let zero = Vector::<M>::zero();
    Rounding { terms, sensitivity: Matrix::<M>::zeros(), covector: zero, argument: zero }
}

/// `x² + y² = 4`, `xy = 1`.
struct CircleAndHyperbola;

impl Equation<Euclidean<2>> for CircleAndHyperbola {
    type Evidence = ();

    fn evaluate(&self, u: &Vector2<f64>) -> Option<Evaluated<Euclidean<2>, ()>> {
        self.linearise(u).map(|at| Evaluated { residual: at.residual, evidence: () })
    }

    fn linearise(&self, u: &Vector2<f64>) -> Option<Linearised<Euclidean<2>, ()>> {
        Some(Linearised {
            residual: vector![u.norm_squared() - 4.0, u.x * u.y - 1.0],
            jacobian: Matrix2::new(2.0 * u.x, 2.0 * u.y, u.y, u.x),
            rounding: rounding(Vector2::repeat(8.0 * f64::EPSILON)),
            stiffness: Stiffness::default(),
            evidence: (),
        })
    }
}

#[test]
fn convergence_is_quadratic_with_a_jacobian_for_each_correction() {
    let fresh = Newton { reuse: 0.0, ..Newton::default() };
    let root = fresh.solve(&CircleAndHyperbola, &vector![2.0, 0.4]).unwrap();
    // x² = 2 + √3 in closed form.
    assert!((root.u.x - (2.0 + 3.0_f64.sqrt()).sqrt()).abs() < 1e-15);
    assert!(root.iterations <= 5, "{} iterations", root.iterations);
}

/// `ln u = 1`, defined for `u > 0` only.
struct Logarithm;

impl Equation<Euclidean<1>> for Logarithm {
    type Evidence = ();

    fn evaluate(&self, u: &Vector1<f64>) -> Option<Evaluated<Euclidean<1>, ()>> {
        self.linearise(u).map(|at| Evaluated { residual: at.residual, evidence: () })
    }

    fn linearise(&self, u: &Vector1<f64>) -> Option<Linearised<Euclidean<1>, ()>> {
        let residual = vector![u.x.ln() - 1.0];
        let jacobian = Matrix1::new(u.x.recip());
        let rounding = rounding(Vector1::new(4.0 * f64::EPSILON));
        let (stiffness, evidence) = (Stiffness::default(), ());
        (u.x > 0.0).then_some(Linearised { residual, jacobian, rounding, stiffness, evidence })
    }
}

#[test]
fn damping_backs_off_from_the_edge_of_the_domain() {
    // The undamped correction from u = 20 lands at 20 − 20 (ln 20 − 1) = −19.9.
    let root = Newton::default().solve(&Logarithm, &vector![20.0]).unwrap();
    assert!((root.u.x - 1.0_f64.exp()).abs() < 1e-14);
}

/// `u² + 1 = 0` has no real root.
struct NoRealRoot;

impl Equation<Euclidean<1>> for NoRealRoot {
    type Evidence = ();

    fn evaluate(&self, u: &Vector1<f64>) -> Option<Evaluated<Euclidean<1>, ()>> {
        self.linearise(u).map(|at| Evaluated { residual: at.residual, evidence: () })
    }

    fn linearise(&self, u: &Vector1<f64>) -> Option<Linearised<Euclidean<1>, ()>> {
        Some(Linearised {
            residual: vector![u.x * u.x + 1.0],
            jacobian: Matrix1::new(2.0 * u.x),
            rounding: rounding(Vector1::new(f64::EPSILON)),
            stiffness: Stiffness::default(),
            evidence: (),
        })
    }
}

#[test]
fn a_missing_root_is_an_error_with_the_best_point() {
    let failure = Newton::default().solve(&NoRealRoot, &vector![3.0]).unwrap_err();
    assert!(failure.residual >= 1.0 && failure.residual < 10.0);
    let undefined = Newton::default().solve(&Logarithm, &vector![-1.0]).unwrap_err();
    assert!(undefined.residual.is_infinite());
}
