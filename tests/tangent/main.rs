//! Tangents of runs, and families: `T` against differences of runs with the same steps, the laws of `T`, and the same bits.

mod adjoint;
mod collocated;
mod explicit;
mod families;
mod fits;
mod jumps;
mod parts;
mod refined;
mod schemes;
mod table;
#[path = "../models/tables.rs"]
mod tables;

use metriplectic::dynamics::{Parametrised, Point};
use metriplectic::fields::{Column as _, Dimension as _, Space, Vector};
use metriplectic::prelude::*;
use nalgebra::DMatrix;

/// Bodies with three moments of inertia and a friction.
pub(crate) fn body() -> impl Parametrised<
    4,
    System: Differentiable<
        Manifold = LieDual<3>,
        Wide: Metriplectic<Manifold = Product<LieDual<3>, Euclidean<4>>>,
    >,
> {
    Family::on(LieDual::so3())
        .parameters(["I1", "I2", "I3", "friction"])
        .energy(|p: &Vector3<Real>, t: &Vector4<Real>| {
            (p.x * p.x / t.x + p.y * p.y / t.y + p.z * p.z / t.z) * 0.5
        })
        .entropy(|p: &Vector3<Real>, t: &Vector4<Real>| (p.norm_squared() * 0.5).exp() * t.w)
        .build()
        .expect("it is a family")
}

/// The dimension of a space.
pub(crate) fn dim<M: Space>() -> usize {
    M::Dim::LEN
}

/// The derivative of a map along the chart at a point, in the frame at its value, by differences of order 6 in `e`
/// (Richardson).
pub(crate) fn differences<M: Manifold, N: Manifold>(
    x: &M::Point<f64>,
    e: f64,
    f: impl Fn(&M::Point<f64>) -> N::Point<f64>,
) -> DMatrix<f64> {
    let y = f(x);
    let mut j = DMatrix::zeros(dim::<N>(), dim::<M>());
    for k in 0..dim::<M>() {
        let at = |s: f64| {
            let q = Vector::<M>::from_index(|i| if i == k { s } else { 0.0 });
            N::coordinates(&y, &f(&M::chart(x, &q)))
        };
        let slope = |e: f64| (at(e) - at(-e)) * (0.5 / e);
        let (a, b, c) = (slope(e), slope(0.5 * e), slope(0.25 * e));
        for i in 0..dim::<N>() {
            let (r, s) = ((4.0 * b[i] - a[i]) / 3.0, (4.0 * c[i] - b[i]) / 3.0);
            j[(i, k)] = (16.0 * s - r) / 15.0;
        }
    }
    j
}

/// The largest difference relative to the largest entry.
pub(crate) fn off(a: &DMatrix<f64>, b: &DMatrix<f64>) -> f64 {
    (a - b).amax() / b.amax()
}

/// Compares the tangent of a run with differences of runs, and the states with those of the plain run, bit for bit; returns the
/// error and that of the first law of tangents.
pub(crate) fn compared<D, M>(system: &D, method: M, x0: &Point<D>, span: &Span, e: f64) -> [f64; 2]
where
    D: Differentiable,
    M: Copy + Stepper<D> + metriplectic::integrators::LinearisedAlong<D>,
{
    let plain = method.run(system, x0.clone(), *span).expect("it runs");
    let run = method.tangent(system, x0.clone(), *span).expect("it has a tangent");
    assert_eq!(plain.states().len(), run.states().len());
    for (a, b) in plain.states().iter().zip(run.states()) {
        assert!(
            a.point == b.point && a.time.to_bits() == b.time.to_bits(),
            "the tangent changed the run"
        );
    }
    assert_eq!(plain.certificate(), run.certificate());
    let differences = differences::<D::Manifold, D::Manifold>(x0, e, |x| {
        method.run(system, x.clone(), *span).expect("it runs").last().point.clone()
    });
    [off(&run.last().along_start(), &differences), run.sensitivity().energy]
}
