//! The Taylor lift of a closure gives what the generic door gives, to round-off.

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, MatrixField, Scalar, ScalarField, Space, Vector,
    differential, hessian, jacobian,
};
use nalgebra::{SMatrix, matrix, vector};
use num_dual::{
    Derivative, Dual, Dual2_64, Dual2SVec64, Dual64, DualSVec64, HyperDual64, HyperDualSVec64,
};
use proptest::prelude::*;

use crate::spaces::{Plain, TestSpace, on_every_space};
use crate::subject::{ByHand, closure, matrix_closure, size};

/// The doors may differ by this many ε times [`size`].
const ROUND_OFF: f64 = 16.0;

/// A scalar with all its parts in a row, the real one first.
trait Parts: Scalar {
    /// The scalar with the real part `re`, and dual parts in the order in which `next` gives them.
    fn build(re: f64, next: &mut impl FnMut() -> f64) -> Self;

    /// Its parts.
    fn parts(&self) -> Vec<f64>;
}

impl Parts for f64 {
    fn build(re: Self, _: &mut impl FnMut() -> Self) -> Self {
        re
    }

    fn parts(&self) -> Vec<Self> {
        vec![*self]
    }
}

impl Parts for Dual64 {
    fn build(re: f64, next: &mut impl FnMut() -> f64) -> Self {
        Self::new(re, next())
    }

    fn parts(&self) -> Vec<f64> {
        vec![self.re, self.eps]
    }
}

impl Parts for Dual<Dual64> {
    fn build(re: f64, next: &mut impl FnMut() -> f64) -> Self {
        Self::new(Dual64::build(re, next), Dual64::new(next(), next()))
    }

    fn parts(&self) -> Vec<f64> {
        [self.re.parts(), self.eps.parts()].concat()
    }
}

impl Parts for Dual2_64 {
    fn build(re: f64, next: &mut impl FnMut() -> f64) -> Self {
        Self::new(re, next(), next())
    }

    fn parts(&self) -> Vec<f64> {
        vec![self.re, self.v1, self.v2]
    }
}

impl Parts for HyperDual64 {
    fn build(re: f64, next: &mut impl FnMut() -> f64) -> Self {
        Self::new(re, next(), next(), next())
    }

    fn parts(&self) -> Vec<f64> {
        vec![self.re, self.eps1, self.eps2, self.eps1eps2]
    }
}

impl Parts for DualSVec64<3> {
    fn build(re: f64, next: &mut impl FnMut() -> f64) -> Self {
        Self::new(re, some(next))
    }

    fn parts(&self) -> Vec<f64> {
        [vec![self.re], entries(self.eps)].concat()
    }
}

impl Parts for Dual2SVec64<3> {
    fn build(re: f64, next: &mut impl FnMut() -> f64) -> Self {
        let a = SMatrix::<f64, 3, 3>::from_fn(|_, _| next());
        Self::new(re, some(next), Derivative::some((a + a.transpose()) * 0.5))
    }

    fn parts(&self) -> Vec<f64> {
        [vec![self.re], entries(self.v1), entries(self.v2)].concat()
    }
}

impl Parts for HyperDualSVec64<2, 3> {
    fn build(re: f64, next: &mut impl FnMut() -> f64) -> Self {
        Self::new(re, some(next), some(next), some(next))
    }

    fn parts(&self) -> Vec<f64> {
        [vec![self.re], entries(self.eps1), entries(self.eps2), entries(self.eps1eps2)].concat()
    }
}

type Block<const R: usize, const C: usize> =
    Derivative<f64, nalgebra::Const<R>, nalgebra::Const<C>>;

fn some<const R: usize, const C: usize>(next: &mut impl FnMut() -> f64) -> Block<R, C> {
    Derivative::some(SMatrix::from_fn(|_, _| next()))
}

fn entries<const R: usize, const C: usize>(block: Block<R, C>) -> Vec<f64> {
    block.0.unwrap_or_else(SMatrix::zeros).as_slice().to_vec()
}

/// A point to expand about, and the parts of a displacement from it.
#[derive(Clone, Debug)]
struct Sample {
    point: [f64; 6],
    parts: Vec<f64>,
}

impl Sample {
    /// Six coordinates with the 13 parts of the largest scalar.
    const PARTS: usize = 6 * 13;

    fn any() -> impl Strategy<Value = Self> {
        let parts = prop::collection::vec(-1.0..1.0, Self::PARTS);
        (prop::array::uniform6(-1.5..1.5), parts).prop_map(|(point, parts)| Self { point, parts })
    }

    /// Coordinates whose real parts are at most 0.3, and whose dual parts are at most 1.
    fn displacement<M: Space, D: Parts>(&self) -> Vector<M, D> {
        let mut parts = self.parts.iter().copied().cycle();
        let mut next = || parts.next().unwrap_or_default();
        Vector::<M, D>::from_index(|_| D::build(0.3 * next(), &mut next))
    }
}

/// The doors agree on `what`, part by part.
fn agree(what: &str, closure: &[f64], by_hand: &[f64], size: f64) -> Result<(), TestCaseError> {
    prop_assert_eq!(closure.len(), by_hand.len());
    for (k, (left, right)) in closure.iter().zip(by_hand).enumerate() {
        let error = (left - right).abs();
        prop_assert!(
            error <= ROUND_OFF * f64::EPSILON * size,
            "{what}: part {k} is {left:e} by the closure and {right:e} by hand, {:.1} ε apart",
            error / (f64::EPSILON * size)
        );
    }
    Ok(())
}

fn column<M: Space>(v: &Vector<M>) -> Vec<f64> {
    (0..M::Dim::LEN).map(|i| v[i]).collect()
}

fn square<M: Space, D: Parts>(a: &Matrix<M, D>) -> Vec<f64> {
    let n = M::Dim::LEN;
    (0..n * n).flat_map(|k| a[(k / n, k % n)].parts()).collect()
}

fn jets_agree<M: TestSpace>(sample: &Sample) -> Result<(), TestCaseError> {
    let x = M::point(&sample.point);
    let size = size::<M>(&x);
    let (left, right) = (closure::<M>(), ByHand);
    let (a, b) = (ScalarField::<M>::jet1(&left, &x), ScalarField::<M>::jet1(&right, &x));
    agree("the value of jet1", &[a.value], &[b.value], size)?;
    agree("df of jet1", &column::<M>(&a.df), &column::<M>(&b.df), size)?;
    let (a, b) = (ScalarField::<M>::jet2(&left, &x), ScalarField::<M>::jet2(&right, &x));
    agree("the value of jet2", &[a.value], &[b.value], size)?;
    agree("df of jet2", &column::<M>(&a.df), &column::<M>(&b.df), size)?;
    agree("Hf of jet2", &square::<M, f64>(&a.hf), &square::<M, f64>(&b.hf), size)
}

fn values_agree<M: TestSpace, D: Parts>(sample: &Sample) -> Result<(), TestCaseError> {
    let x = M::chart(&M::point(&sample.point), &sample.displacement::<M, D>());
    let left: D = ScalarField::<M>::at(&closure::<M>(), &x);
    let right: D = ScalarField::<M>::at(&ByHand, &x);
    agree(std::any::type_name::<D>(), &left.parts(), &right.parts(), size::<M>(&M::real(&x)))
}

fn derivatives_agree<M: TestSpace>(sample: &Sample) -> Result<(), TestCaseError> {
    let x = ChartPoint::<M> { base: M::point(&sample.point), q: sample.displacement::<M, f64>() };
    let size = size::<M>(&x.point());
    let (left, right) = (closure::<M>(), ByHand);
    let (a, b) = (differential(&left, &x), differential(&right, &x));
    agree("differential", &column::<M>(&a), &column::<M>(&b), size)?;
    let (a, b) = (hessian(&left, &x), hessian(&right, &x));
    agree("hessian", &square::<M, f64>(&a), &square::<M, f64>(&b), size)?;
    let (a, b) = (slope_of_gradient(&left, &x), slope_of_gradient(&right, &x));
    agree("jacobian", &square::<M, f64>(&a), &square::<M, f64>(&b), size * size)
}

/// The Jacobian of `f df`, which is `f Hf + df ⊗ df`.
fn slope_of_gradient<M: TestSpace>(f: &impl ScalarField<M>, x: &ChartPoint<M>) -> Matrix<M> {
    jacobian::<M, f64>(
        |q| {
            let at = ChartPoint::<M, Dual64> { base: x.base.clone(), q: *q };
            differential(f, &at) * f.at(&at.point())
        },
        &x.q,
    )
}

fn matrix_jets_agree<M: TestSpace>(sample: &Sample) -> Result<(), TestCaseError> {
    let x = M::point(&sample.point);
    let size = MATRIX * size::<M>(&x);
    let a = MatrixField::<M>::covariant_jet(&matrix_closure::<M>(), &x);
    let b = MatrixField::<M>::covariant_jet(&ByHand, &x);
    agree("the matrix", &square::<M, f64>(&a.value), &square::<M, f64>(&b.value), size)?;
    for k in 0..M::Dim::LEN {
        let (a, b) = (square::<M, f64>(&a.slopes[k]), square::<M, f64>(&b.slopes[k]));
        agree("a slope of the matrix", &a, &b, size)?;
    }
    Ok(())
}

fn matrices_agree<M: TestSpace, D: Parts>(sample: &Sample) -> Result<(), TestCaseError> {
    let x = M::chart(&M::point(&sample.point), &sample.displacement::<M, D>());
    let left: Matrix<M, D> = MatrixField::<M>::at(&matrix_closure::<M>(), &x);
    let right: Matrix<M, D> = MatrixField::<M>::at(&ByHand, &x);
    let size = MATRIX * size::<M>(&M::real(&x));
    agree(std::any::type_name::<D>(), &square::<M, D>(&left), &square::<M, D>(&right), size)
}

/// The largest factor that an entry of the matrix puts on a summand.
const MATRIX: f64 = 6.0;

/// Both doors, for a function and a matrix, at the scalar `D` on every space.
fn doors_agree_at<D: Parts>(sample: &Sample) -> Result<(), TestCaseError> {
    fn on<M: TestSpace, D: Parts>(sample: &Sample) -> Result<(), TestCaseError> {
        values_agree::<M, D>(sample)?;
        matrices_agree::<M, D>(sample)
    }
    on_every_space!(on::<D>(sample));
    Ok(())
}

/// Derivatives at the displaced point `φ_x(q)`, read off one hyper-dual evaluation each.
fn derivatives_are_parts<M: TestSpace>(sample: &Sample) -> Result<(), TestCaseError> {
    let x = ChartPoint::<M> { base: M::point(&sample.point), q: sample.displacement::<M, f64>() };
    let size = size::<M>(&x.point());
    let (df, hf) = (differential(&ByHand, &x), hessian(&ByHand, &x));
    for i in 0..M::Dim::LEN {
        for j in 0..M::Dim::LEN {
            let q = Vector::<M, HyperDual64>::from_index(|k| {
                let part = |direction| f64::from(u8::from(k == direction));
                HyperDual64::new(x.q[k], part(i), part(j), 0.0)
            });
            let f = ScalarField::<M>::at(&ByHand, &M::chart(&x.base, &q));
            agree("the differential", &[df[i], df[j]], &[f.eps1, f.eps2], size)?;
            agree("the Hessian", &[hf[(i, j)]], &[f.eps1eps2], size)?;
        }
    }
    Ok(())
}

/// The slopes of a matrix, one direction of the chart after the other.
fn slopes_are_parts<M: TestSpace>(sample: &Sample) -> Result<(), TestCaseError> {
    let x = M::point(&sample.point);
    let size = MATRIX * size::<M>(&x);
    let jet = MatrixField::<M>::covariant_jet(&matrix_closure::<M>(), &x);
    for k in 0..M::Dim::LEN {
        let q = Vector::<M, Dual64>::basis(k) * Dual64::new(0.0, 1.0);
        let a = MatrixField::<M>::at(&ByHand, &M::chart(&x, &q));
        for i in 0..M::Dim::LEN {
            for j in 0..M::Dim::LEN {
                let (re, eps) = (jet.value[(i, j)], jet.slopes[k][(i, j)]);
                agree("a matrix along the chart", &[re, eps], &a[(i, j)].parts(), size)?;
            }
        }
    }
    Ok(())
}

#[test]
fn a_jacobian_has_a_row_for_each_component() {
    // Fᵢ = (i + 1) Σⱼ (j + 2) qⱼ² has ∂Fᵢ/∂qⱼ = 2 (i + 1)(j + 2) qⱼ.
    let slope = jacobian::<Plain<3>, f64>(
        |q| {
            let sum = q[0] * q[0] * 2.0 + q[1] * q[1] * 3.0 + q[2] * q[2] * 4.0;
            vector![sum, sum * 2.0, sum * 3.0]
        },
        &vector![1.0, 10.0, 100.0],
    );
    let expected = matrix![4.0, 60.0, 800.0; 8.0, 120.0, 1600.0; 12.0, 180.0, 2400.0];
    assert_eq!(slope, expected);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn value_gradient_and_hessian_of_both_doors_agree(sample in Sample::any()) {
        on_every_space!(jets_agree(&sample));
    }

    #[test]
    fn nested_derivatives_of_both_doors_agree(sample in Sample::any()) {
        on_every_space!(derivatives_agree(&sample));
    }

    #[test]
    fn matrix_and_slopes_of_both_doors_agree(sample in Sample::any()) {
        on_every_space!(matrix_jets_agree(&sample));
    }

    #[test]
    fn both_doors_agree_at_order_0(sample in Sample::any()) {
        doors_agree_at::<f64>(&sample)?;
    }

    #[test]
    fn both_doors_agree_at_order_1(sample in Sample::any()) {
        doors_agree_at::<Dual64>(&sample)?;
        doors_agree_at::<DualSVec64<3>>(&sample)?;
    }

    #[test]
    fn both_doors_agree_at_order_2(sample in Sample::any()) {
        doors_agree_at::<Dual2_64>(&sample)?;
        doors_agree_at::<HyperDual64>(&sample)?;
        doors_agree_at::<Dual<Dual64>>(&sample)?;
        doors_agree_at::<Dual2SVec64<3>>(&sample)?;
        doors_agree_at::<HyperDualSVec64<2, 3>>(&sample)?;
    }

    #[test]
    fn differential_and_hessian_are_taken_in_the_chart_they_are_given(sample in Sample::any()) {
        on_every_space!(derivatives_are_parts(&sample));
    }

    #[test]
    fn slopes_of_a_matrix_are_its_derivatives_along_the_chart(sample in Sample::any()) {
        on_every_space!(slopes_are_parts(&sample));
    }
}
