//! The laws of a scalar field hold for both doors, and each of them can be broken.

use metriplectic_fields::laws::scalar_field;
use metriplectic_fields::{BrokenLaw, Column, Jet1, Jet2, Real, Scalar, ScalarField, Vector};
use nalgebra::{Matrix2, Vector2, vector};
use num_dual::DualNum;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use crate::spaces::{Plain, TestSpace, on_every_space};
use crate::subject::{ByHand, closure};

/// A point and a direction.
#[derive(Clone, Debug)]
struct Sample {
    point: [f64; 6],
    direction: [f64; 6],
}

impl Sample {
    fn any() -> impl Strategy<Value = Self> {
        let point = prop::array::uniform6(-1.5..1.5);
        let direction = prop::array::uniform6(-0.4..0.4);
        (point, direction).prop_map(|(point, direction)| Self { point, direction })
    }
}

fn laws_hold<M: TestSpace>(sample: &Sample) -> Result<(), TestCaseError> {
    let x = M::point(&sample.point);
    let v = Vector::<M>::from_index(|i| sample.direction[i]);
    let checked = [scalar_field::<M>(&closure::<M>(), &x, &v), scalar_field::<M>(&ByHand, &x, &v)];
    prop_assert_eq!(checked, [Ok(()), Ok(())]);
    Ok(())
}

proptest! {
    // An order is asymptotic, and at one point in ten million it is not measured to be what it is:
    // the points are random, but the same ones each time.
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(1996),
        ..ProptestConfig::default()
    })]

    #[test]
    fn both_doors_obey_the_laws(sample in Sample::any()) {
        on_every_space!(laws_hold(&sample));
    }
}

/// The function that the wrong fields below get wrong.
fn wave<D: Scalar>(x: &Vector2<D>) -> D {
    (x.x * 0.5).exp() * x.y.sin()
}

/// What the laws say about a field at one point, in one direction.
fn verdict(f: &impl ScalarField<Plain<2>>) -> Result<(), &'static str> {
    scalar_field(f, &vector![0.7, -0.4], &vector![0.6, 0.8]).map_err(|broken| broken.law)
}

#[test]
fn the_right_field_obeys_the_laws() {
    assert_eq!(verdict(&|x: &Vector2<Real>| wave(x)), Ok(()));
}

/// Another function at real points than at dual ones.
struct OtherAtReals;

impl ScalarField<Plain<2>> for OtherAtReals {
    fn at<D: Scalar>(&self, x: &Vector2<D>) -> D {
        if D::NDERIV == 0 { wave(x) + 1e-9 } else { wave(x) }
    }
}

#[test]
fn a_field_that_is_another_one_at_real_points_breaks_the_value_of_jet2() {
    assert_eq!(verdict(&OtherAtReals), Err("jet2 has the value of the field"));
}

/// A faster `jet1` with a wrong value.
struct WrongValueInJet1;

impl ScalarField<Plain<2>> for WrongValueInJet1 {
    fn at<D: Scalar>(&self, x: &Vector2<D>) -> D {
        wave(x)
    }

    fn jet1(&self, x: &Vector2<f64>) -> Jet1<Plain<2>> {
        let Jet2 { value, df, .. } = self.jet2(x);
        Jet1 { value: value + 1e-9, df }
    }
}

#[test]
fn a_faster_jet1_with_a_wrong_value_breaks_its_law() {
    assert_eq!(verdict(&WrongValueInJet1), Err("jet1 has the value of the field"));
}

/// A faster `jet1` with a wrong slope.
struct WrongSlopeInJet1;

impl ScalarField<Plain<2>> for WrongSlopeInJet1 {
    fn at<D: Scalar>(&self, x: &Vector2<D>) -> D {
        wave(x)
    }

    fn jet1(&self, x: &Vector2<f64>) -> Jet1<Plain<2>> {
        let Jet2 { value, df, .. } = self.jet2(x);
        Jet1 { value, df: df + vector![0.0, 1e-9] }
    }
}

#[test]
fn a_faster_jet1_with_a_wrong_slope_breaks_its_law() {
    assert_eq!(verdict(&WrongSlopeInJet1), Err("jet1 and jet2 agree on df"));
}

/// Faster derivatives off the centre that are those of the centre.
struct AtTheCentre {
    differential: bool,
}

impl ScalarField<Plain<2>> for AtTheCentre {
    fn at<D: Scalar>(&self, x: &Vector2<D>) -> D {
        wave(x)
    }

    fn differential_at(&self, x: &Vector2<f64>, q: &Vector2<f64>) -> Vector2<f64> {
        let at = if self.differential { *x } else { x + q };
        ScalarField::<Plain<2>>::jet1(self, &at).df
    }

    fn hessian_at(&self, x: &Vector2<f64>, _: &Vector2<f64>) -> Matrix2<f64> {
        ScalarField::<Plain<2>>::jet2(self, x).hf
    }
}

#[test]
fn faster_derivatives_of_the_centre_break_the_law_off_it() {
    let broken = |differential| verdict(&AtTheCentre { differential });
    assert_eq!(broken(true), Err("differential_at is the differential"));
    assert_eq!(broken(false), Err("hessian_at is the Hessian"));
}

/// A faster answer at the scalar of closures that drops the mixed part.
struct NoMixedPart;

impl ScalarField<Plain<2>> for NoMixedPart {
    fn at<D: Scalar>(&self, x: &Vector2<D>) -> D {
        wave(x)
    }

    fn at_real(&self, x: &Vector2<Real>) -> Real {
        let f = wave(x);
        Real::new(f.re, f.eps1, f.eps2, 0.0)
    }
}

#[test]
fn a_faster_answer_without_second_derivatives_breaks_the_hessian() {
    assert_eq!(verdict(&NoMixedPart), Err("the Hessian is the derivative of df"));
}

/// One branch goes through the real part and loses the derivative.
struct DropsTheDualPart;

impl ScalarField<Plain<2>> for DropsTheDualPart {
    fn at<D: Scalar>(&self, x: &Vector2<D>) -> D {
        let y = if x.y.re() < 0.0 { D::from(x.y.re()) } else { x.y };
        wave(&vector![x.x, y])
    }
}

#[test]
fn a_branch_that_drops_the_dual_part_breaks_the_differential() {
    assert_eq!(verdict(&DropsTheDualPart), Err("df is the derivative of the field"));
    // … and where the other branch is taken, all is well.
    let x = vector![0.7, 0.4];
    assert_eq!(scalar_field(&DropsTheDualPart, &x, &vector![0.6, 0.8]), Ok(()));
}

/// A slope that is off by a hundredth of what it should be: the curvature hides it at large `t`.
struct SlightlyWrongSlope;

impl ScalarField<Plain<2>> for SlightlyWrongSlope {
    fn at<D: Scalar>(&self, x: &Vector2<D>) -> D {
        wave(x) + (x.y - x.y.re()) * 0.01
    }
}

#[test]
fn a_slightly_wrong_slope_breaks_the_differential() {
    assert_eq!(verdict(&SlightlyWrongSlope), Err("df is the derivative of the field"));
}

/// The right value and slopes, from a first-order expansion that knows no curvature.
struct NoCurvature;

impl ScalarField<Plain<2>> for NoCurvature {
    fn at<D: Scalar>(&self, x: &Vector2<D>) -> D {
        let real: Vector2<f64> = Column::real(x);
        let jet = ScalarField::<Plain<2>>::jet1(&|x: &Vector2<Real>| wave(x), &real);
        (x.x - real.x) * jet.df.x + (x.y - real.y) * jet.df.y + jet.value
    }
}

#[test]
fn a_field_without_curvature_breaks_the_second_derivative() {
    assert_eq!(verdict(&NoCurvature), Err("Hf is the second derivative"));
}

#[test]
fn a_field_that_is_not_a_number_breaks_the_laws() {
    assert!(verdict(&|_: &Vector2<Real>| Real::from(f64::NAN)).is_err());
}

#[test]
fn a_broken_law_says_what_is_off_and_by_how_much() {
    let broken = BrokenLaw::unless("Π is skew", 0.25, 1e-14).unwrap_err();
    assert_eq!(broken.to_string(), "law broken: Π is skew: 2.500e-1, where 1.0e-14 is allowed");
    assert_eq!(BrokenLaw::unless("Π is skew", 1e-15, 1e-14), Ok(()));
    assert!(BrokenLaw::unless("Π is skew", f64::NAN, 1e-14).is_err());
}

/// Points where a remainder of the Taylor expansion happens to cross zero within the measured
/// range: there the ratio of two remainders says nothing about the order.
#[test]
fn a_remainder_that_crosses_zero_breaks_no_law() {
    for k in 0..400 {
        // f(t) = t³ + a t² + t about 0: the remainder a t² + t³ vanishes at t = −a.
        let a = -2.0_f64.powf(-12.5 + 9.0 * f64::from(k) / 400.0);
        let f = move |x: &Vector2<Real>| x.x.powi(3) + x.x.powi(2) * a + x.x;
        assert_eq!(scalar_field::<Plain<2>>(&f, &vector![0.0, 0.0], &vector![1.0, 0.0]), Ok(()));
        let g = move |x: &Vector2<Real>| x.x.powi(4) + x.x.powi(3) * a + x.x;
        assert_eq!(scalar_field::<Plain<2>>(&g, &vector![0.0, 0.0], &vector![1.0, 0.0]), Ok(()));
    }
}
