//! The same problems from closures, by this library's default scheme.

use std::cell::Cell;

use metriplectic::dynamics::system::Point;
use metriplectic::prelude::*;

use crate::{Gas, INERTIA, RelaxingBody, SpinningTop, WEIGHTS};

/// What a run gives: its certificate, where it ended, the time it took and the evaluations of the
/// closure of `H`.
#[derive(Clone, Debug)]
pub struct Ran<const N: usize> {
    /// Where it ended.
    pub end: [f64; N],
    /// What it kept.
    pub certificate: Certificate,
    /// Calls of the closure of `H`, those of the check of the model and of the certificate included.
    pub calls: u64,
}

/// A problem that runs from closures.
pub trait Ours<const N: usize>: crate::Problem<N> {
    /// A run of `steps` steps of size `h`.
    ///
    /// # Errors
    ///
    /// The library's.
    fn run(&self, h: f64, steps: usize) -> Result<Ran<N>, String>;
}

fn ran<Y: Metriplectic, const N: usize>(
    system: &Y,
    start: Point<Y>,
    (h, steps): (f64, usize),
    calls: &Cell<u64>,
) -> Result<Ran<N>, String>
where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let span = Span::steps(h, steps).at_most(2);
    let run = WeylMidpoint.run(system, start, span).map_err(|error| error.to_string())?;
    let entries = Y::Manifold::entries(&run.last().point);
    let end = std::array::from_fn(|i| entries[i]);
    Ok(Ran { end, certificate: run.certificate().clone(), calls: calls.get() })
}

impl Ours<3> for RelaxingBody {
    fn run(&self, h: f64, steps: usize) -> Result<Ran<3>, String> {
        let calls = Cell::new(0);
        let inertia = Vector3::from(INERTIA);
        let energy = |p: &Vector3<Real>| {
            calls.set(calls.get() + 1);
            p.component_mul(p).component_div(&inertia.cast()).sum() * 0.5
        };
        let body = System::on(LieDual::so3())
            .energy(energy)
            .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
            .build()
            .map_err(|error| error.to_string())?;
        ran(&body, crate::Problem::start(self).into(), (h, steps), &calls)
    }
}

impl Ours<3> for SpinningTop {
    fn run(&self, h: f64, steps: usize) -> Result<Ran<3>, String> {
        let calls = Cell::new(0);
        let energy = |x: &Vector3<Real>| -> Real {
            calls.set(calls.get() + 1);
            let term = |i: usize| (x[i].powi(2) + x[i].powi(3) * (2.0 / 3.0)) * (0.5 * WEIGHTS[i]);
            (0..3).map(term).sum()
        };
        let top = System::on(Sphere::<2>::round())
            .bracket(AreaForm)
            .energy(energy)
            .build()
            .map_err(|error| error.to_string())?;
        ran(&top, crate::Problem::start(self).into(), (h, steps), &calls)
    }
}

impl Ours<4> for Gas {
    fn run(&self, h: f64, steps: usize) -> Result<Ran<4>, String> {
        let calls = Cell::new(0);
        let alpha = self.alpha;
        let wall = |x: &Vector4<Real>| {
            let [left, right] = [x.z / x.x, x.w / (-x.x + 2.0)].map(|d| d * (2.0 / 3.0));
            let push = Vector4::new(1.0.into(), 0.0.into(), -left, right);
            push * Vector4::y().transpose() - Vector4::y() * push.transpose()
        };
        let leak = move |_: &Vector4<Real>, w: &Vector4<Real>| {
            let b = Vector4::new(0.0.into(), 0.0.into(), w.w, -w.z);
            b * b.transpose() * Real::from(alpha)
        };
        let energy = |x: &Vector4<Real>| {
            calls.set(calls.get() + 1);
            x.y.powi(2) * 0.5 + x.z + x.w
        };
        let containers = System::on(Euclidean::<4>)
            .bracket(Poisson::field(wall))
            .dissipation(FieldDissipation(leak))
            .energy(energy)
            .entropy(|x: &Vector4<Real>| (x.x * (-x.x + 2.0)).ln() + (x.z * x.w).ln() * 1.5)
            .build()
            .map_err(|error| error.to_string())?;
        ran(&containers, crate::Problem::start(self).into(), (h, steps), &calls)
    }
}
