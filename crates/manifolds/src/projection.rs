//! The symmetric projection retraction of the spheres.

use metriplectic_fields::{ChartPoint, Column, Scalar, Space, dot};
use nalgebra::{SMatrix, SVector};
use num_dual::Dual;

use crate::metric::{MetricError, stretched};
use crate::metric_error::{finite_column, within};
use crate::sphere::{angle, components, frame, normalised, spread};
use crate::{Nodes, PointPair, Retraction, Riemannian, Sphere, StepPath, StepPathJet, Tangent};

/// The symmetric projection retraction of Sⁿ, for any metric:
///
/// ```math
/// R_h(v_z) = \Bigl(\frac{z - hv/2}{|z - hv/2|},\ \frac{z + hv/2}{|z + hv/2|}\Bigr), \qquad
/// z = \frac{x + x'}{|x + x'|}, \quad d = \frac{2 (x' - x)}{|x + x'|} .
/// ```
///
/// It is rational but for one root, has order 2, and conserves the energy exactly like every other retraction
/// (Absil, Mahony, Sepulchre 2008, §4.1.2, for the projection; symmetrised about `z`). It differs from
/// [`WeylMidpoint`](crate::WeylMidpoint) in the length only: `|d| = 2 tan(θ/2)` for points at the angle
/// `θ`, which grows without bound at the antipode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Projection;

/// The path from `x` whose displacement is `U` at `x` and `d` at `z`, by the rotation in the plane of the
/// two: with `s = |U|²/4`, `z = (x + U/2)/√(1+s)`, `d = (U − 2s x)/√(1+s)` and
/// `x' = ((1 − s) x + U)/(1 + s)`.
struct Ambient<D: Scalar, const A: usize> {
    z: SVector<D, A>,
    d: SVector<D, A>,
    end: SVector<D, A>,
}

impl<D: Scalar, const A: usize> Ambient<D, A> {
    fn new(x: &SVector<f64, A>, u: &SVector<D, A>) -> Self {
        let x = SVector::<D, A>::from_fn(|i, _| D::from(x[i]));
        let s = dot(u, u) * 0.25;
        let scale = (s + 1.0).sqrt().recip();
        Self {
            z: (x + u * D::from(0.5)) * scale,
            d: (u - x * (s * 2.0)) * scale,
            end: (x * (-s + 1.0) + u) * (s + 1.0).recip(),
        }
    }
}

/// The path at real points with `E = E(x)`, `s` and `c = 1/√(1+s)`, for its derivatives along `u`.
///
/// With `δU = E`, `δs = u/2` and `δc = −½c³δs`, and without the parts along `z` and `x'` that the frames there
/// leave out: `∂z = ½c E`, `∂d = c E − (c x + ¼c² d) uᵀ` and `∂x' = (E − ½x uᵀ)/(1 + s)`.
struct Parts<const A: usize, const N: usize> {
    e: SMatrix<f64, A, N>,
    ambient: Ambient<f64, A>,
    s: f64,
    c: f64,
}

impl<const A: usize, const N: usize> Parts<A, N> {
    #[inline]
    fn new(x: &SVector<f64, A>, u: &SVector<f64, N>) -> Self {
        let (e, s) = (frame::<A, N>(x), 0.25 * u.norm_squared());
        Self { e, ambient: Ambient::new(x, &(e * u)), s, c: (1.0 + s).sqrt().recip() }
    }
}

macro_rules! projection {
    ($n:literal in $a:literal) => {
        impl<G: Riemannian<Sphere<$n>>> Retraction<Sphere<$n>, G> for Projection {
            fn step_path<D: Scalar>(
                &self,
                _: &G,
                x: &SVector<f64, $a>,
                u: &SVector<D, $n>,
            ) -> Result<StepPath<Sphere<$n>, D>, MetricError> {
                let ambient = Ambient::new(x, &spread(&frame::<$a, $n>(x), u));
                // The chart at the base reads its velocity by one more dual number.
                let base = Column::real(&normalised(&ambient.z));
                let q = Sphere::<$n>::coordinates(&base, &ambient.z.zip_map(&ambient.d, Dual::new));
                let z = ChartPoint { base, q: q.map(|q| q.re) };
                Ok(StepPath { z, d: q.map(|q| q.eps), end: normalised(&ambient.end) })
            }

            #[inline]
            fn real_step_path(
                &self,
                _: &G,
                x: &SVector<f64, $a>,
                u: &SVector<f64, $n>,
            ) -> Result<StepPath<Sphere<$n>>, MetricError> {
                let ambient = Ambient::new(x, &(frame::<$a, $n>(x) * u));
                let z = normalised(&ambient.z);
                let d = frame::<$a, $n>(&z).tr_mul(&ambient.d);
                Ok(StepPath { z: ChartPoint::centre(&z), d, end: normalised(&ambient.end) })
            }

            fn end(
                &self,
                _: &G,
                x: &SVector<f64, $a>,
                u: &SVector<f64, $n>,
            ) -> Result<SVector<f64, $a>, MetricError> {
                Ok(normalised(&Ambient::new(x, &spread(&frame::<$a, $n>(x), u)).end))
            }

            fn along(
                &self,
                _: &G,
                x: &SVector<f64, $a>,
                u: &SVector<f64, $n>,
            ) -> Result<Nodes<Sphere<$n>>, MetricError> {
                let e = frame::<$a, $n>(x);
                Nodes::of(|t| {
                    let u = spread(&e, &stretched::<Sphere<$n>>(u, t));
                    Ok(normalised(&Ambient::new(x, &u).end))
                })
            }

            #[inline]
            fn step_path_jet(
                &self,
                _: &G,
                x: &SVector<f64, $a>,
                u: &SVector<f64, $n>,
            ) -> Result<StepPathJet<Sphere<$n>>, MetricError> {
                let Parts { e, ambient, s, c } = Parts::<$a, $n>::new(x, u);
                let (z, end) = (normalised(&ambient.z), normalised(&ambient.end));
                let (at_z, at_end) = (frame::<$a, $n>(&z), frame::<$a, $n>(&end));
                let (turn, along_x) = (at_z.tr_mul(&e), at_z.tr_mul(x));
                let d = at_z.tr_mul(&ambient.d);
                let lean = along_x * c + d * (0.25 * c * c);
                Ok(StepPathJet {
                    z,
                    dz: turn * (0.5 * c),
                    d,
                    dd: turn * c - lean * u.transpose(),
                    end,
                    dend: (at_end.tr_mul(&e) - at_end.tr_mul(x) * (u * 0.5).transpose())
                        / (1.0 + s),
                })
            }

            fn pair(
                &self,
                _: &G,
                tangent: &Tangent<Sphere<$n>>,
            ) -> Result<PointPair<Sphere<$n>>, MetricError> {
                let half = frame::<$a, $n>(&tangent.base) * tangent.vector * 0.5;
                Ok((normalised(&(tangent.base - half)), normalised(&(tangent.base + half))))
            }

            fn inverse(
                &self,
                _: &G,
                x: &SVector<f64, $a>,
                y: &SVector<f64, $a>,
            ) -> Result<Tangent<Sphere<$n>>, MetricError> {
                within(std::f64::consts::PI, angle(x, y))?;
                let sum = x + y;
                let base = normalised(&sum);
                let d = (y - x) * (2.0 / sum.norm());
                let vector = components(&frame::<$a, $n>(&base), &d);
                Ok(Tangent { base, vector: finite_column("the displacement", vector)? })
            }
        }
    };
}

projection!(1 in 2);
projection!(2 in 3);
projection!(3 in 4);
projection!(4 in 5);
projection!(5 in 6);
projection!(6 in 7);
projection!(7 in 8);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Canonical, Manifold, laws};
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand::rngs::ChaCha8Rng;

    macro_rules! keeps_the_laws {
        ($name:ident, $n:literal) => {
            proptest! {
                #[test]
                fn $name(seed in any::<u64>(), u in prop::array::uniform::<_, $n>(-1.0..1.0)) {
                    let sphere = Sphere::<$n>::round();
                    let x = sphere.random(&mut ChaCha8Rng::seed_from_u64(seed));
                    let u = SVector::<f64, $n>::from(u) * 2.0;
                    laws::retraction::<Sphere<$n>, _, _>(&Projection, &Canonical, &x, &u)?;
                    let y: SVector<f64, { $n + 1 }> = Sphere::<$n>::chart(&x, &(u * 0.5));
                    laws::symmetric_retraction::<Sphere<$n>, _, _>(
                        &Projection, &Canonical, &x, &y,
                    )?;
                }
            }
        };
    }
    keeps_the_laws!(the_projection_of_the_circle_keeps_the_laws, 1);
    keeps_the_laws!(the_projection_of_the_sphere_keeps_the_laws, 2);
    keeps_the_laws!(the_projection_of_the_three_sphere_keeps_the_laws, 3);
    keeps_the_laws!(the_projection_of_the_four_sphere_keeps_the_laws, 4);
    keeps_the_laws!(the_projection_of_the_five_sphere_keeps_the_laws, 5);
    keeps_the_laws!(the_projection_of_the_six_sphere_keeps_the_laws, 6);
    keeps_the_laws!(the_projection_of_the_seven_sphere_keeps_the_laws, 7);
}
