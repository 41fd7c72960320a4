//! A dissipation from a closure of the point and the covector to be annihilated.

use std::fmt;

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Factors, Form, Matrix, Real, Scalar, Square, Vector, Velocity,
};
use metriplectic_manifolds::{Manifold, MetricAt, MetricError, Riemannian, out_of_chart};

use super::{Dissipation, DissipationJet};

/// The dissipation of a closure `|x, w| -> K` of the point and of the covector to be annihilated, used
/// without change:
///
/// ```math
/// K_w(x)\, \alpha = K(x, w)\, \alpha .
/// ```
///
/// `w` is `dH` in the equations of motion and a discrete gradient of `H` in a step. So the closure
/// builds `K` from its argument `w`, and never from `dH(x)`. Verification checks at sampled points, for `dH`
/// and for discrete gradients of `H`, that `K` is symmetric and positive semidefinite and that
/// `K(x, w) w = 0`. For a matrix that does not depend on `w`, use
/// [`ProjectedDissipation`](super::ProjectedDissipation).
///
/// `w` and `K` are written in the terms dual to the
/// [`velocity`](metriplectic_fields::Space::embed) of the space: on a vector space in components,
/// on SO(3) as body covectors, and on a sphere in the space around, where `w` is tangent and the part of `K`
/// across the sphere has no effect.
///
/// Like every closure it is written over [`Real`], and lifted to every scalar of derivative order
/// ≤ 2. For scalars of any order, implement [`Dissipation`] for a type.
///
/// ```
/// use metriplectic_dynamics::{FieldDissipation, System};
/// use metriplectic_fields::Real;
/// use metriplectic_manifolds::Euclidean;
/// use nalgebra::{Matrix3, Vector3};
/// // The damped oscillator x = (q, p, s): K = (γ/w_s) b bᵀ with b = (0, w_s, −w_p) annihilates w.
/// let friction = |_: &Vector3<Real>, w: &Vector3<Real>| -> Matrix3<Real> {
///     let b = Vector3::new(0.0.into(), w.z, -w.y);
///     b * b.transpose() * (w.z.recip() * 0.01)
/// };
/// # use num_dual::DualNum;
/// let system = System::on(Euclidean::<3>)
///     .energy(|x: &Vector3<Real>| (x.x * x.x + x.y * x.y) * 0.5 + x.z)
///     .entropy(|x: &Vector3<Real>| x.z)
///     .dissipation(FieldDissipation(friction))
///     .build();
/// assert!(system.is_ok());
/// ```
#[derive(Clone, Copy)]
pub struct FieldDissipation<F>(pub F);

impl<F> fmt::Debug for FieldDissipation<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FieldDissipation").finish_non_exhaustive()
    }
}

impl<M, G, F> Dissipation<M, G> for FieldDissipation<F>
where
    M: Manifold,
    G: Riemannian<M>,
    F: Fn(&M::Point<Real>, &Velocity<M, Real>) -> Form<M, Real>,
{
    fn apply<D: Scalar>(
        &self,
        g: &MetricAt<'_, M, G, D>,
        w: &Vector<M, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        let x = g.x;
        let tensor = if const { D::NDERIV == 0 } {
            let real = ChartPoint::<M> { base: x.base.clone(), q: x.q.real() };
            let tensor = self.real_tensor(&real, &w.real());
            tensor.map(|k| Matrix::<M, D>::from_entries(|i, j| D::from(k[(i, j)])))
        } else {
            lift::<M, D>(x, w, |x, w| self.tensor_at(x, w))
        };
        Ok(tensor.ok_or_else(|| out_of_chart(x))? * *alpha)
    }

    fn tensor(&self, g: &MetricAt<'_, M, G>, w: &Vector<M>) -> Result<Matrix<M>, MetricError> {
        self.real_tensor(g.x, w).ok_or_else(|| out_of_chart(g.x))
    }

    fn linearise(
        &self,
        g: &MetricAt<'_, M, G>,
        w: &Vector<M>,
        alpha: &Vector<M>,
    ) -> Result<DissipationJet<M>, MetricError> {
        let (zero, x) = (Matrix::<M>::zeros(), g.x);
        let mut jet = DissipationJet::<M> {
            value: Vector::<M>::zero(),
            along_z: zero,
            along_w: zero,
            tensor: zero,
        };
        let n = M::Dim::LEN;
        for k in 0..n {
            let (x, w) = seeded::<M, f64>(x, w, k, n + k);
            let tensor = self.tensor_at(&x, &w).ok_or_else(|| out_of_chart(&x))?;
            for i in 0..n {
                let row = |part: fn(&Real) -> f64| {
                    (0..n).fold(0.0, |sum, j| sum + part(&tensor[(i, j)]) * alpha[j])
                };
                jet.along_z[(i, k)] = row(|entry| entry.eps1);
                jet.along_w[(i, k)] = row(|entry| entry.eps2);
            }
            if k == 0 {
                jet.tensor = Matrix::<M>::from_entries(|i, j| tensor[(i, j)].re);
                jet.value = jet.tensor * *alpha;
            }
        }
        Ok(jet)
    }
}

impl<F> FieldDissipation<F> {
    /// The matrix in the frame of the chart, at the scalar of closures.
    fn tensor_at<M: Manifold>(
        &self,
        x: &ChartPoint<M, Real>,
        w: &Vector<M, Real>,
    ) -> Option<Matrix<M, Real>>
    where
        F: Fn(&M::Point<Real>, &Velocity<M, Real>) -> Form<M, Real>,
    {
        let still = |a: &Real| [a.re, a.eps1, a.eps2, a.eps1eps2].iter().all(|part| *part == 0.0);
        M::contravariant(x, &(self.0)(&x.point(), &along_velocities(x, w, still)?))
    }

    /// Evaluates the closure at `f64`, where the frame has no derivatives to carry.
    fn real_tensor<M: Manifold>(&self, x: &ChartPoint<M>, w: &Vector<M>) -> Option<Matrix<M>>
    where
        F: Fn(&M::Point<Real>, &Velocity<M, Real>) -> Form<M, Real>,
    {
        let w = along_velocities(x, w, |a| *a == 0.0)?;
        let tensor = (self.0)(&M::constant(&x.point()), &Velocity::<M, Real>::embed(&w));
        M::contravariant(x, &Form::<M>::from_entries(|i, j| tensor[(i, j)].re))
    }
}

/// The covector `θ (θᵀθ)⁻¹ w` on velocities that is `w` on the frame `θ` of the chart, and zero
/// across the manifold. `is_zero` compares all parts of a number.
///
/// Where `θ` is the identity, as on every vector space, this is `w` itself. The LU decomposition of the
/// identity in dual numbers would take longer than all the rest of the velocity.
#[inline]
pub(crate) fn along_velocities<M: Manifold, D: Scalar>(
    x: &ChartPoint<M, D>,
    w: &Vector<M, D>,
    is_zero: impl Fn(&D) -> bool,
) -> Option<Velocity<M, D>> {
    let n = M::Dim::LEN;
    let theta = M::Dim::array(|k| M::embed(x, &Vector::<M, D>::basis(k)));
    let one = |i: usize, k: usize| if i == k { D::one() } else { D::zero() };
    let is_identity = Velocity::<M, D>::LEN == n
        && (0..n).all(|k| (0..n).all(|i| is_zero(&(theta[k][i] - one(i, k)))));
    if is_identity {
        return w.is_finite().then(|| Velocity::<M, D>::from_index(|i| w[i]));
    }
    let gram = Matrix::<M, D>::from_entries(|i, j| theta[i].dot(&theta[j]));
    let weights = gram.factor()?.solve(w)?;
    let mut sum = Velocity::<M, D>::zero();
    for k in 0..n {
        sum += theta[k] * weights[k];
    }
    Some(sum)
}

/// The real parts of a chart point and a covector, with `ε₁` and `ε₂` in the directions `i` and `j`:
/// those of the chart, then those of the covector; an index beyond both seeds nothing.
fn seeded<M: Manifold, D: Scalar>(
    x: &ChartPoint<M, D>,
    w: &Vector<M, D>,
    i: usize,
    j: usize,
) -> (ChartPoint<M, Real>, Vector<M, Real>) {
    let seed = |value: D, k: usize| {
        let part = |direction| if k == direction { 1.0 } else { 0.0 };
        Real::new(value.re(), part(i), part(j), 0.0)
    };
    let q = Vector::<M, Real>::from_index(|k| seed(x.q[k], k));
    let w = Vector::<M, Real>::from_index(|k| seed(w[k], M::Dim::LEN + k));
    (ChartPoint { base: x.base.clone(), q }, w)
}

/// The matrix `k(x, w)` at any scalar of order ≤ 2, by its Taylor expansion about the real parts, as
/// for the [closures](mod@metriplectic_fields::closure) of one point.
fn lift<M: Manifold, D: Scalar>(
    x: &ChartPoint<M, D>,
    w: &Vector<M, D>,
    k: impl Fn(&ChartPoint<M, Real>, &Vector<M, Real>) -> Option<Matrix<M, Real>>,
) -> Option<Matrix<M, D>> {
    const {
        assert!(
            D::NDERIV <= 2,
            "a closure has derivatives up to order 2, and this scalar asks for more: write the \
             dissipation as a type of your own with the generic method `apply`"
        );
    }
    let n = M::Dim::LEN;
    let at = |i, j| {
        let (x, w) = seeded::<M, D>(x, w, i, j);
        k(&x, &w)
    };
    let d = |i: usize| {
        let value = if i < n { x.q[i] } else { w[i - n] };
        value - value.re()
    };
    let value = |i: usize, re: f64| D::from(if i == 0 { re } else { 0.0 });
    let mut sum = Matrix::<M, D>::zeros();
    let mut add = |i: usize, j: usize, part: &dyn Fn(&Real) -> D| {
        let a = at(i, j)?;
        sum += Matrix::<M, D>::from_entries(|row, column| part(&a[(row, column)]));
        Some(())
    };
    match D::NDERIV {
        0 => add(2 * n, 2 * n, &|a| D::from(a.re))?,
        1 => {
            for i in 0..n {
                add(i, n + i, &|a| d(i) * a.eps1 + d(n + i) * a.eps2 + value(i, a.re))?;
            }
        }
        _ => {
            for i in 0..2 * n {
                add(i, i, &|a| d(i) * a.eps1 + d(i) * d(i) * (a.eps1eps2 * 0.5) + value(i, a.re))?;
                for j in i + 1..2 * n {
                    add(i, j, &|a| d(i) * d(j) * a.eps1eps2)?;
                }
            }
        }
    }
    Some(sum)
}
