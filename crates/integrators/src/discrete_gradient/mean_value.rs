//! The mean value discrete gradient, or averaged vector field.

use metriplectic_fields::{
    ChartPoint, Column, Matrix, Scalar, ScalarField, Square, Vector, differential,
};
use metriplectic_manifolds::{Manifold, StepPath, StepPathJet};
use num_dual::Dual64;

use super::{DiscreteGradient, GAUSS, GradientKind, segment};

/// The mean value discrete gradient (Harten, Lax, van Leer 1983; McLachlan, Quispel, Robidoux 1999;
/// on manifolds Celledoni, Eidnes, Owren, Ringholm 2019), along the segment `q(s)` from `x` to `x'` in
/// the chart `φ_z` at the base point:
///
/// ```math
/// \bar w = \int_0^1 d(F \circ \varphi_z)(q(s))\, ds .
/// ```
///
/// The integral is the Gauss-Legendre rule of order 8, exact for polynomials `F` of degree 8 on a flat
/// space; its defect is taken by the correction of Gonzalez, so that the mean value law holds to
/// round-off for any `F`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeanValue;

impl DiscreteGradient for MeanValue {
    const KIND: Option<GradientKind> = Some(GradientKind::MeanValue);

    fn mean<M: Manifold, D: Scalar>(
        &self,
        f: &impl ScalarField<M>,
        x: &M::Point<f64>,
        path: &StepPath<M, D>,
    ) -> Vector<M, D> {
        let (start, end) = segment(x, path);
        GAUSS.iter().fold(Vector::<M, D>::zero(), |mean, &(s, weight)| {
            let q = start * D::from(1.0 - s) + end * D::from(s);
            let at = ChartPoint { base: path.z.base.clone(), q };
            mean + differential(f, &at) * D::from(weight)
        })
    }

    fn real_mean<M: Manifold>(
        &self,
        f: &impl ScalarField<M>,
        x: &M::Point<f64>,
        path: &StepPath<M>,
    ) -> Vector<M> {
        let (start, end) = segment(x, path);
        GAUSS.iter().fold(Vector::<M>::zero(), |mean, &(s, weight)| {
            let q = start * (1.0 - s) + end * s;
            mean + f.differential_at(&path.z.base, &q) * weight
        })
    }

    fn mean_jet<M: Manifold>(
        &self,
        f: &impl ScalarField<M>,
        x: &M::Point<f64>,
        path: &StepPathJet<M>,
    ) -> (Vector<M>, Matrix<M>) {
        let start: Vector<M> = M::coordinates(&path.z, x);
        let end: Vector<M> = M::coordinates(&path.z, &path.end);
        let dend = Matrix::<M>::from_columns(|k| {
            let q = Vector::<M, Dual64>::from_index(|i| Dual64::new(0.0, path.dend[(i, k)]));
            let moved = M::coordinates(&path.z, &M::chart(&path.end, &q));
            Vector::<M>::from_index(|i| moved[i].eps)
        });
        let (mut mean, mut slope) = (Vector::<M>::zero(), Matrix::<M>::zeros());
        for &(s, weight) in &GAUSS {
            let q = start * (1.0 - s) + end * s;
            mean += f.differential_at(&path.z, &q) * weight;
            slope += f.hessian_at(&path.z, &q) * (weight * s);
        }
        (mean, slope * dend)
    }
}
