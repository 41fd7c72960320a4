//! The spectral radius of the equation of motion, by the power method (Sommeijer, Shampine, Verwer 1997, §3).

use super::flow::StageFlow;
use super::stage::stage;
use crate::step::{Element, Vector};

/// Steps after which the spectral radius is found anew.
/// A factor of four fails `explicit/spectrum.rs::the_radius_is_that_of_the_motion_and_somewhat_more`.
const PATIENCE: u32 = 25;
/// The most iterations of the power method.
/// A factor of four fails `explicit/spectrum.rs::the_power_method_ends_where_the_radius_no_longer_changes`.
const ITERATIONS: u32 = 50;
/// The relative change of the estimate at which they end.
/// A factor of four fails `explicit/spectrum.rs::the_power_method_ends_where_the_radius_no_longer_changes`.
const CHANGE: f64 = 0.01;
/// The ratio of the radius that is used to the estimate, which may be too small.
/// A factor of four fails `explicit/spectrum.rs::the_radius_is_that_of_the_motion_and_somewhat_more`.
const SAFETY: f64 = 1.2;

/// The spectral radius of the equation of motion, and a direction in which it is attained.
#[derive(Clone, Debug)]
pub(super) struct Spectrum<V> {
    pub(super) radius: f64,
    /// Steps since it was found.
    pub(super) age: u32,
    /// `None` after it was read from a checkpoint.
    pub(super) direction: Option<V>,
    /// The direction as it was read.
    pub(super) read: Vec<f64>,
}

impl<V: Vector> Spectrum<V> {
    /// The direction that was read, as a vector of the length of `like`.
    fn as_read(&self, like: &V) -> V {
        like.with(|i| <[f64]>::get(&self.read, i).copied().unwrap_or(0.0))
    }

    /// The site with the largest part of the direction.
    pub(super) fn stiffest_site(&self, sizes: &V) -> Option<usize> {
        match &self.direction {
            Some(direction) => direction.largest_site(sizes),
            None => self.as_read(sizes).largest_site(sizes),
        }
    }
}

/// The spectral radius at a state with this velocity; `None` if it cannot be found.
pub(super) fn spectrum<F: StageFlow>(
    flow: &F,
    x: &Element<F>,
    velocity: &F::Vector,
    known: Option<Spectrum<F::Vector>>,
) -> Option<Spectrum<F::Vector>> {
    let mut direction = match known {
        Some(known) if known.age < PATIENCE => {
            return Some(Spectrum { age: known.age + 1, ..known });
        }
        Some(Spectrum { direction: Some(direction), .. }) => direction,
        Some(known) => known.as_read(velocity),
        None => irregular(&flow.sizes(x)),
    };
    let sizes = flow.sizes(x);
    let small = f64::EPSILON.sqrt();
    let (mut radius, mut turning, mut converged) = (0.0, 0.0, false);
    for _ in 0..ITERATIONS {
        let length = direction.relative_to(&sizes);
        if !(length > 0.0 && length.is_finite()) {
            break;
        }
        let factor = small / length;
        let q = direction.map(|d| factor * d);
        let k = stage(flow, x, &q)?.velocity;
        direction = Vector::zip([&k, velocity], |[k, velocity]| k - velocity);
        let found = direction.relative_to(&sizes) / small;
        converged = (found - radius).abs() <= CHANGE * found;
        // A pair of complex eigenvalues stretches a direction and shortens it in turn.
        let both = if radius > 0.0 { (radius * found).sqrt() } else { found };
        (turning, radius) = (both, found);
        if converged {
            break;
        }
    }
    let radius = SAFETY * if converged { radius } else { turning };
    radius.is_finite().then_some(Spectrum {
        radius,
        age: 0,
        direction: Some(direction),
        read: Vec::new(),
    })
}

/// A direction with a part along each other one: entries of both signs, without a pattern (Weyl 1916).
fn irregular<V: Vector>(sizes: &V) -> V {
    sizes.with(|i| {
        let turn = (i as f64 * 0.618_033_988_749_894_9).fract();
        sizes.get(i) * (2.0 * (turn * turn * 1e4).fract() - 1.0)
    })
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use metriplectic_dynamics::{Symplectic, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Vector2, Vector4, vector};

    use super::*;
    use crate::step::{Components, Flow as _};

    #[test]
    fn the_radius_is_that_of_the_motion_and_somewhat_more() {
        let of = |field: fn(&Vector2<Real>) -> Real| {
            System::on(Euclidean::<2>).bracket(Symplectic).energy(field).build().unwrap()
        };
        let (saddle, oscillator) = (of(|x| x.x * x.y * 3.0), of(|x| x.norm_squared() * 1.5));
        let zero = Components(vector![0.0, 0.0]);
        for x in [vector![1.0, 0.5], vector![1e-3, 1.0], vector![1.0, 1e-6]] {
            for system in [&saddle, &oscillator] {
                let v = system.rates(&x, &zero).unwrap();
                let radius = spectrum(system, &x, &v, None).unwrap().radius;
                assert!((3.1..4.5).contains(&radius), "{radius} for 3 at {x}");
            }
        }
        let (system, x) = (&saddle, vector![1.0, 0.5]);
        let v = system.rates(&x, &zero).unwrap();
        let mut known = spectrum(system, &x, &v, None);
        // It is kept for some steps.
        let mut steps = 0;
        while known.as_ref().is_some_and(|known| known.age == steps) && steps < 1000 {
            known = spectrum(system, &x, &v, known);
            steps += 1;
        }
        assert!((10..60).contains(&steps), "{steps} steps");
    }

    #[test]
    fn the_power_method_ends_where_the_radius_no_longer_changes() {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        fn counted(value: Real) -> Real {
            COUNT.fetch_add(1, Ordering::Relaxed);
            value
        }
        type Field = fn(&Vector4<Real>) -> Real;
        let iterations = |field: Field| {
            let system = System::on(Euclidean::<4>).bracket(Symplectic).energy(field);
            let (system, x) = (system.build().unwrap(), vector![1.0, 0.5, 0.7, 0.9]);
            let zero = Components(vector![0.0, 0.0, 0.0, 0.0]);
            let v = system.rates(&x, &zero).unwrap();
            let evaluations = |work: &dyn Fn()| {
                COUNT.store(0, Ordering::Relaxed);
                work();
                COUNT.load(Ordering::Relaxed)
            };
            let one = evaluations(&|| assert!(stage(&system, &x, &zero).is_some()));
            evaluations(&|| assert!(spectrum(&system, &x, &v, None).is_some())) / one
        };
        // Eigenvalues ±3 and ±2.4, of which the smaller ones fade like 0.8ᵏ.
        let saddles = iterations(|x| counted(x.x * x.z * 2.4 + x.y * x.w * 3.0));
        // ±3i and sizes that differ: the ratio goes up and down.
        let turns = iterations(|x| counted(x.x * x.x * 1.5 + x.z * x.z * 6.0 + x.y * x.w * 0.1));
        println!("{saddles} and {turns} iterations");
        assert!((5..9).contains(&saddles) && (40..60).contains(&turns), "{saddles}, {turns}");
    }
}
