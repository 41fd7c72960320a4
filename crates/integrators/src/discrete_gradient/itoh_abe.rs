//! The coordinate increment discrete gradient, and its symmetric mean.

use metriplectic_fields::{Column, Scalar, ScalarField, Vector};
use metriplectic_manifolds::{Manifold, StepPath};

use super::{DiscreteGradient, GAUSS, GradientKind, partial, segment};
use crate::round_off::stable_gradient::short;

/// The coordinate increment discrete gradient (Itoh and Abe 1988) in the chart at the base point: with
/// the corners `q⁰ = φ_z⁻¹(x), q¹, …, qⁿ = φ_z⁻¹(x')` that change one coordinate after the other,
///
/// ```math
/// \bar w_i = \frac{F(q^i) - F(q^{i-1})}{q^i_i - q^{i-1}_i} .
/// ```
///
/// Where an increment is short, and the quotient of small differences has lost its digits, it is the
/// same number as an integral, `∫₀¹ ∂_iF ds` along the edge, by the Gauss-Legendre rule of order 8;
/// the two are joined smoothly. Schemes with it have order 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ItohAbe;

/// The mean of [`ItohAbe`] from `x` to `x'` and from `x'` to `x`. Schemes with it have order 2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SymmetricItohAbe;

impl DiscreteGradient for ItohAbe {
    const KIND: Option<GradientKind> = Some(GradientKind::ItohAbe);

    fn mean<M: Manifold, D: Scalar>(
        &self,
        f: &impl ScalarField<M>,
        x: &M::Point<f64>,
        path: &StepPath<M, D>,
    ) -> Vector<M, D> {
        let (start, end) = segment(x, path);
        increments::<M, D>(f, &path.z.base, &start, &end)
    }
}

impl DiscreteGradient for SymmetricItohAbe {
    const KIND: Option<GradientKind> = Some(GradientKind::SymmetricItohAbe);

    fn mean<M: Manifold, D: Scalar>(
        &self,
        f: &impl ScalarField<M>,
        x: &M::Point<f64>,
        path: &StepPath<M, D>,
    ) -> Vector<M, D> {
        let (start, end) = segment(x, path);
        let there = increments::<M, D>(f, &path.z.base, &start, &end);
        let back = increments::<M, D>(f, &path.z.base, &end, &start);
        (there + back) * D::from(0.5)
    }
}

/// The quotients from `start` to `end` in the chart at `z`.
fn increments<M: Manifold, D: Scalar>(
    f: &impl ScalarField<M>,
    z: &M::Point<f64>,
    start: &Vector<M, D>,
    end: &Vector<M, D>,
) -> Vector<M, D> {
    let mut corner = *start;
    let mut before = f.at(&M::chart(z, &corner));
    Vector::<M, D>::from_index(|i| {
        let (from, step) = (corner[i], end[i] - start[i]);
        let middle = from + step * 0.5;
        corner[i] = middle;
        let slope = partial(f, z, &corner, i);
        corner[i] = end[i];
        let after = f.at(&M::chart(z, &corner));
        let size = before.re().abs() + after.re().abs() + M::magnitude(z) * slope.re().abs();
        let integral_share = short(slope.re() * step.re(), size);
        let mut mean = D::zero();
        if integral_share < 1.0 {
            mean += (after - before) / step * (1.0 - integral_share);
        }
        if integral_share > 0.0 {
            let mut edge = corner;
            for (s, weight) in GAUSS {
                edge[i] = from + step * s;
                mean += partial(f, z, &edge, i) * (weight * integral_share);
            }
        }
        before = after;
        mean
    })
}
