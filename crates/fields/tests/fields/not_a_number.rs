//! What is not a number shows in the jets, and nowhere else.

use metriplectic_fields::{ChartPoint, MatrixField, Real, Scalar, ScalarField, differential};
use nalgebra::{Matrix3, Vector2, Vector3, vector};
use num_dual::{Dual64, DualNum};

use crate::spaces::Plain;

/// `|x|`, behind door 1.
struct Norm;

impl ScalarField<Plain<3>> for Norm {
    fn at<D: Scalar>(&self, x: &Vector3<D>) -> D {
        x.dot(x).sqrt()
    }
}

/// `|x|`, behind door 2.
fn norm(x: &Vector3<Real>) -> Real {
    x.norm()
}

/// So steep at zero that the curvature overflows, where value and slope do not.
fn steep(x: &Vector2<Real>) -> Real {
    ((x.x + x.y) * 1e160).exp()
}

#[test]
fn a_field_that_is_nan_has_no_finite_jet() {
    let nan = |_: &Vector3<Real>| Real::from(f64::NAN);
    let x = vector![1.0, 2.0, 3.0];
    let value: f64 = ScalarField::<Plain<3>>::at(&nan, &x);
    assert!(value.is_nan());
    assert!(!ScalarField::<Plain<3>>::jet1(&nan, &x).is_finite());
    assert!(!ScalarField::<Plain<3>>::jet2(&nan, &x).is_finite());
}

#[test]
fn a_single_bad_derivative_shows_whichever_it_is() {
    let x = vector![1.0, 2.0, 3.0];
    for bad in 0..3 {
        // The derivative of a square root at zero is infinite.
        let f = move |p: &Vector3<Real>| (p[bad] - x[bad]).sqrt() + p.sum();
        let jet = ScalarField::<Plain<3>>::jet1(&f, &x);
        assert!(jet.value.is_finite(), "direction {bad}: {}", jet.value);
        assert!(!jet.is_finite(), "direction {bad}: {}", jet.df);
        assert!(!ScalarField::<Plain<3>>::jet2(&f, &x).is_finite());
    }
}

#[test]
fn a_bad_curvature_shows_in_jet2_only() {
    let x = vector![0.0, 0.0];
    assert!(ScalarField::<Plain<2>>::jet1(&steep, &x).is_finite());
    let jet = ScalarField::<Plain<2>>::jet2(&steep, &x);
    assert!(jet.value.is_finite() && !jet.hf[(0, 0)].is_finite() && !jet.is_finite());
}

#[test]
fn a_curvature_that_is_nan_shows_among_finite_ones() {
    // Only the mixed derivative is not a number.
    let f = |p: &Vector3<Real>| p.norm_squared();
    let spoiled = move |p: &Vector3<Real>| {
        let value = f(p);
        let mixed = p.x.eps1 * p.y.eps2;
        Real { eps1eps2: if mixed == 0.0 { value.eps1eps2 } else { f64::NAN }, ..value }
    };
    let x = vector![1.0, 2.0, 3.0];
    assert!(ScalarField::<Plain<3>>::jet2(&f, &x).is_finite());
    let jet = ScalarField::<Plain<3>>::jet2(&spoiled, &x);
    assert!(jet.hf[(0, 1)].is_nan() && jet.hf[(2, 2)].is_finite() && !jet.is_finite());
}

#[test]
fn the_norm_at_zero_has_a_value_and_no_derivative() {
    fn at_zero(f: &impl ScalarField<Plain<3>>) {
        let zero = vector![0.0, 0.0, 0.0];
        assert_eq!(f.at::<f64>(&zero).to_bits(), 0);
        let jet = f.jet1(&zero);
        assert!(jet.value == 0.0 && !jet.df.iter().any(|slope| slope.is_finite()));
        assert!(!jet.is_finite() && !f.jet2(&zero).is_finite());
        let df: Vector3<f64> = differential(f, &ChartPoint::centre(&zero));
        assert!(!df.iter().any(|slope| slope.is_finite()));
    }
    at_zero(&norm);
    at_zero(&Norm);
}

#[test]
fn a_first_derivative_does_not_suffer_from_a_bad_second_one() {
    let x = vector![0.0, 0.0];
    let df = differential::<Plain<2>, f64>(&steep, &ChartPoint::centre(&x));
    assert_eq!(df, ScalarField::<Plain<2>>::jet1(&steep, &x).df);
    let lifted: Dual64 =
        ScalarField::<Plain<2>>::at(&steep, &vector![Dual64::new(0.0, 1.0), Dual64::new(0.0, 2.0)]);
    assert_eq!((lifted.re, lifted.eps), (1.0, 3e160));
}

#[test]
fn a_matrix_that_is_nan_shows() {
    let a = |x: &Vector3<Real>| Matrix3::from_diagonal_element(x.x.ln());
    let jet = MatrixField::<Plain<3>>::covariant_jet(&a, &vector![-1.0, 0.0, 0.0]);
    assert!(jet.value[(0, 0)].is_nan());
    let value: Matrix3<f64> = MatrixField::<Plain<3>>::at(&a, &vector![-1.0, 0.0, 0.0]);
    assert!(value[(1, 1)].is_nan() && value[(0, 1)] == 0.0);
}
