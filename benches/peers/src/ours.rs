//! The same problems from closures, by this library's methods.
//!
//! The closures are written in components, `p.x * p.x * 0.05`: so the compiler removes the parts of the dual
//! numbers that are zero. A quotient of vectors of dual numbers, or their outer product, costs ten times more.

use std::cell::Cell;
use std::time::Instant;

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
    /// Evaluations of the closure of `H`, those of the certificate included.
    pub calls: u64,
    /// The seconds of the run, without the check of the model.
    pub seconds: f64,
}

/// By which method, and how accurately.
#[derive(Clone, Copy, Debug)]
pub enum How {
    /// The method of order 2, in so many steps of this size.
    Midpoint {
        /// The size.
        h: f64,
        /// How many.
        steps: usize,
    },
    /// The method of order 5, to this time with this tolerance.
    Five(f64, f64),
    /// The method of order 8.
    Eight(f64, f64),
    /// The reversible methods with two, three and four stages.
    Gauss2(f64, f64),
    /// Of order 6.
    Gauss3(f64, f64),
    /// Of order 8.
    Gauss4(f64, f64),
}

/// A problem that runs from closures.
pub trait Ours<const N: usize>: crate::Problem<N> {
    /// A run.
    ///
    /// # Errors
    ///
    /// The library's.
    fn run(&self, how: How) -> Result<Ran<N>, String>;
}

pub(crate) fn ran<Y: Metriplectic, const N: usize>(
    system: &Y,
    start: Point<Y>,
    how: How,
    calls: &Cell<u64>,
) -> Result<Ran<N>, String>
where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    // As for the others: the right-hand side is known to be right before the clock starts.
    let system = &system.verified(&start).map_err(|error| error.to_string())?;
    calls.set(0);
    let clock = Instant::now();
    let span = |(time, tolerance)| Span::until(time).tolerance(tolerance).at_most(2);
    let run = match how {
        How::Midpoint { h, steps } => {
            WeylMidpoint.run(system, start, Span::steps(h, steps).at_most(2))
        }
        How::Five(time, tolerance) => DormandPrince5.run(system, start, span((time, tolerance))),
        How::Eight(time, tolerance) => DormandPrince8.run(system, start, span((time, tolerance))),
        How::Gauss2(time, tolerance) => Gauss::<2>.run(system, start, span((time, tolerance))),
        How::Gauss3(time, tolerance) => Gauss::<3>.run(system, start, span((time, tolerance))),
        How::Gauss4(time, tolerance) => Gauss::<4>.run(system, start, span((time, tolerance))),
    };
    let run = run.map_err(|error| error.to_string())?;
    let seconds = clock.elapsed().as_secs_f64();
    let entries = Y::Manifold::entries(&run.last().point);
    let end = std::array::from_fn(|i| entries[i]);
    Ok(Ran { end, certificate: run.certificate().clone(), calls: calls.get(), seconds })
}

impl Ours<3> for RelaxingBody {
    fn run(&self, how: How) -> Result<Ran<3>, String> {
        let calls = Cell::new(0);
        let [a, b, c] = INERTIA.map(|moment| 0.5 / moment);
        let energy = |p: &Vector3<Real>| {
            calls.set(calls.get() + 1);
            p.x * p.x * a + p.y * p.y * b + p.z * p.z * c
        };
        let body = System::on(LieDual::so3())
            .energy(energy)
            .entropy(|p: &Vector3<Real>| (p.x * p.x + p.y * p.y + p.z * p.z) * 0.5)
            .build()
            .map_err(|error| error.to_string())?;
        ran(&body, crate::Problem::start(self).into(), how, &calls)
    }
}

impl Ours<3> for SpinningTop {
    fn run(&self, how: How) -> Result<Ran<3>, String> {
        let calls = Cell::new(0);
        let energy = |x: &Vector3<Real>| -> Real {
            calls.set(calls.get() + 1);
            let term = |x: Real, weight: f64| x * x * (x * (2.0 / 3.0) + 1.0) * (0.5 * weight);
            let [a, b, c] = WEIGHTS;
            term(x.x, a) + term(x.y, b) + term(x.z, c)
        };
        let top = System::on(Sphere::<2>::round())
            .bracket(AreaForm)
            .energy(energy)
            .build()
            .map_err(|error| error.to_string())?;
        ran(&top, crate::Problem::start(self).into(), how, &calls)
    }
}

impl Ours<4> for Gas {
    fn run(&self, how: How) -> Result<Ran<4>, String> {
        let calls = Cell::new(0);
        let alpha = self.alpha;
        let wall = |x: &Vector4<Real>| {
            let [left, right] = [x.z / x.x, x.w / (-x.x + 2.0)].map(|d| d * (2.0 / 3.0));
            let (o, one) = (Real::from(0.0), Real::from(1.0));
            Matrix4::new(o, one, o, o, -one, o, left, -right, o, -left, o, o, o, right, o, o)
        };
        let leak = move |_: &Vector4<Real>, w: &Vector4<Real>| {
            let o = Real::from(0.0);
            let (one, both, two) = (w.w * w.w * alpha, w.z * w.w * -alpha, w.z * w.z * alpha);
            Matrix4::new(o, o, o, o, o, o, o, o, o, o, one, both, o, o, both, two)
        };
        let energy = |x: &Vector4<Real>| {
            calls.set(calls.get() + 1);
            x.y * x.y * 0.5 + x.z + x.w
        };
        let containers = System::on(Euclidean::<4>)
            .bracket(Poisson::field(wall))
            .dissipation(FieldDissipation(leak))
            .energy(energy)
            .entropy(|x: &Vector4<Real>| (x.x * (-x.x + 2.0)).ln() + (x.z * x.w).ln() * 1.5)
            .build()
            .map_err(|error| error.to_string())?;
        ran(&containers, crate::Problem::start(self).into(), how, &calls)
    }
}
