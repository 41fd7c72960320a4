use super::*;
use metriplectic_fields::{Matrix, Square};
use metriplectic_manifolds::Euclidean;
use nalgebra::{Matrix1, Matrix2, Matrix3, Vector1, Vector2, Vector3, vector};

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

/// `q = 5·10¹¹ p`, `p = −1.4·10⁻⁴`, whose Jacobian at `q = 0` has round-off in place of a zero.
struct RoundOffInTheJacobian;

impl Equation<Euclidean<2>> for RoundOffInTheJacobian {
    type Evidence = ();

    fn evaluate(&self, u: &Vector2<f64>) -> Option<Evaluated<Euclidean<2>, ()>> {
        let residual = vector![u.x - 5e11 * u.y, u.y + 1.4e-4];
        Some(Evaluated { residual, evidence: () })
    }

    fn linearise(&self, u: &Vector2<f64>) -> Option<Linearised<Euclidean<2>, ()>> {
        let round_off = if u.x == 0.0 { 7e-5 } else { 0.0 };
        Some(Linearised {
            residual: self.value(u)?,
            jacobian: Matrix2::new(1.0, -5e11, round_off, 1.0),
            rounding: Rounding { argument: vector![2e-6, 0.0], ..rounding(vector![1e-6, 1e-20]) },
            stiffness: Stiffness::default(),
            evidence: (),
        })
    }
}

/// The first correction solves the first equation in full, from which the next contraction would seem to be 10⁻¹².
#[test]
fn a_correction_as_large_as_the_solution_is_checked() {
    let root = Newton::default().solve(&RoundOffInTheJacobian, &vector![0.0, -1.4e-4]).unwrap();
    let off = root.u.component_div(&vector![-7e7, -1.4e-4]) - Vector2::repeat(1.0);
    assert!(off.amax() < 1e-12, "{}", root.u);
}

#[test]
fn a_tenth_of_each_component_may_go_unchecked() {
    let (u, round_off) = (vector![1.0, -1e-6], vector![1e-16, 1e-9]);
    assert!(is_small(&vector![-0.09, 1e-7], &u, &round_off));
    assert!(!is_small(&vector![-0.11, 1e-7], &u, &round_off));
    assert!(!is_small(&vector![-0.09, 1.1e-7], &u, &round_off));
}

#[test]
fn an_inverse_that_is_off_by_a_hundredth_is_none() {
    let mut near = [0; 2];
    for k in 0..4000_u32 {
        let entry = |i: u32| (f64::from(9 * k + i) * 0.618_033_988_749_894_9).fract() - 0.5;
        let vectors = [0, 3, 6].map(|i| vector![entry(i), entry(i + 1), entry(i + 2)]);
        let small = 10_f64.powf(-13.0 - 3.0 * f64::from(k % 100) / 100.0);
        let jacobian = vectors[0] * vectors[1].transpose()
            + vectors[1] * vectors[2].transpose()
            + Matrix3::identity() * small;
        let Some(inverse) = Square::inverse(&jacobian) else { continue };
        let product = inverse * jacobian;
        let off = (0..3).map(|i| (product[(i, i)] - 1.0).abs()).fold(0.0, f64::max);
        let at = Linearised::<Euclidean<3>, ()> {
            residual: Vector3::zeros(),
            jacobian,
            rounding: rounding(Vector3::zeros()),
            stiffness: Stiffness::default(),
            evidence: (),
        };
        let found = Inverse::of(&at, 1.0);
        near[0] += u32::from((0.003..0.009).contains(&off));
        near[1] += u32::from((0.011..0.035).contains(&off));
        // At the bound itself the order of the sum decides.
        if !(0.009..0.011).contains(&off) {
            assert_eq!(found.is_some(), off < 0.01, "{off:e}");
        }
    }
    assert!(near[0] > 10 && near[1] > 10, "{near:?}");
}
