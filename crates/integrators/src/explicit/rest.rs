//! States at rest in their own motion.
//!
//! With the rates `k` at the displacement `d` along the velocity `v`, the motion changes its velocity at the rate
//!
//! ```math
//! \rho = \min_{\pm} \frac{|k(\pm d) - v|}{|d|} ,
//! ```
//!
//! and would come to rest, or turn back, after a displacement of about `v/ρ`. A state is at rest if this is hardly
//! anything in each entry. A short step alone shows nothing: any state hardly moves in it.

use super::flow::StageFlow;
use super::stage::stage;
use crate::step::{StepStart, Vector};

/// A displacement, relative to the size of its entry, that hardly moves a state.
/// A factor of four fails `explicit/rest.rs::hardly_moved_is_a_millionth_of_an_entry_or_a_thousandth_of_its_error`.
const HARDLY: f64 = 1e-6;
/// A displacement, relative to the error that is allowed, that hardly moves a state.
/// A factor of four fails `explicit/rest.rs::hardly_moved_is_a_millionth_of_an_entry_or_a_thousandth_of_its_error`.
const HARDLY_ALLOWED: f64 = 1e-3;
/// The size of a step, relative to the time `1/ρ` of the motion, that is short.
/// A factor of four fails `explicit/rest.rs::hardly_moved_is_a_millionth_of_an_entry_or_a_thousandth_of_its_error`.
const SHORT: f64 = 1e-2;

/// The sizes of the entries at the start of a step: at least the error that is allowed.
pub(super) fn sizes<F: StageFlow>(flow: &F, start: &StepStart<'_, F>) -> F::Vector {
    let sizes = flow.sizes(start.x);
    match &start.allowed {
        Some(allowed) => Vector::zip([&sizes, allowed], |[size, allowed]| size.max(allowed)),
        None => sizes,
    }
}

/// The displacements that hardly move a state.
fn hardly<F: StageFlow>(flow: &F, start: &StepStart<'_, F>) -> F::Vector {
    let hardly = flow.sizes(start.x).map(|size| HARDLY * size);
    match &start.allowed {
        Some(allowed) => Vector::zip([&hardly, allowed], |[hardly, allowed]| {
            hardly.max(HARDLY_ALLOWED * allowed)
        }),
        None => hardly,
    }
}

/// Returns whether a displacement hardly moves a state.
pub(super) fn is_hardly<F: StageFlow>(flow: &F, start: &StepStart<'_, F>, d: &F::Vector) -> bool {
    let hardly = hardly(flow, start);
    (0..d.len()).all(|i| d.get(i).abs() <= hardly.get(i))
}

/// The rate `ρ` at which the motion changes this velocity at the start of a step; `None` outside of the domain.
fn own_rate<F: StageFlow>(flow: &F, start: &StepStart<'_, F>, velocity: &F::Vector) -> Option<f64> {
    let sizes = sizes(flow, start);
    let time = f64::EPSILON.sqrt() / velocity.relative_to(&sizes);
    // On one of both sides of a jump the rates change as they do without it.
    let rate = |time: f64| {
        let there = stage(flow, start.x, &velocity.map(|v| time * v))?.velocity;
        let change = Vector::zip([&there, velocity], |[there, v]| there - v);
        Some(change.relative_to(&sizes) / f64::EPSILON.sqrt())
    };
    let ahead = f64::INFINITY.min(rate(time)?);
    Some(ahead.min(rate(-time)?))
}

/// Returns whether the state at the start of a step, with this velocity, is at rest in its own motion.
#[cold]
pub(super) fn is_reached<F: StageFlow>(
    flow: &F,
    start: &StepStart<'_, F>,
    velocity: &F::Vector,
) -> bool {
    // An entry without a size that moves is not at rest.
    if velocity.relative_to(&sizes(flow, start)) == 0.0 {
        return true;
    }
    let hardly = hardly(flow, start);
    own_rate(flow, start, velocity).is_some_and(|rate| {
        (0..velocity.len()).all(|i| velocity.get(i).abs() <= rate * hardly.get(i))
    })
}

/// Returns whether a step of size `h` is short in the motion near a state at rest. At a distance `δ` from it, the
/// entropy changes by `δ²` times the error `(ρh)^{p+1}` of the step, which is below round-off. So a fall of the
/// entropy is round-off too, whatever production is left.
#[cold]
pub(super) fn is_short<F: StageFlow>(
    flow: &F,
    start: &StepStart<'_, F>,
    velocity: &F::Vector,
    h: f64,
) -> bool {
    own_rate(flow, start, velocity).is_some_and(|rate| rate * h.abs() <= SHORT)
}

#[cfg(test)]
mod tests {
    use metriplectic_dynamics::{Symplectic, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Vector2, vector};

    use super::*;
    use crate::step::{Components, Flow as _};

    #[test]
    fn hardly_moved_is_a_millionth_of_an_entry_or_a_thousandth_of_its_error() {
        let system = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.norm_squared() * 1.5)
            .build()
            .unwrap();
        let x = vector![1.0, 1.0];
        let start = StepStart::first(&system, &x);
        let moved =
            |start: &StepStart<'_, _>, d| is_hardly(&system, start, &Components(vector![d, d]));
        assert!(moved(&start, 5e-7) && !moved(&start, 2e-6));
        let allowed = Some(Components(vector![0.1, 0.1]));
        let start = StepStart { allowed, ..start };
        assert!(moved(&start, 5e-5) && !moved(&start, 2e-4));
        // The motion has the rate 3.
        let v = system.rates(&x, &Components(vector![0.0, 0.0])).unwrap();
        let short = |h| is_short(&system, &start, &v, h);
        assert!(short(1e-3) && short(-1e-3) && !short(1e-2));
    }
}
