//! Implicit methods in plain numbers, compiled with this library: one instance for each number of variables.
//!
//! Each step is that of the same text as in the types of a system, and has its bits.

use metriplectic_equations::Model;
use metriplectic_manifolds::WeylMidpoint;

use crate::collocation::{Gauss, Radau};
use crate::midpoint::Scheme;
use crate::numbers::Modelled;
use crate::step::in_plain::MethodInTypes;
use crate::step::{Implicit, PlainMethod};

/// Calls `f` with a method of a model on a vector space with the canonical metric; `None` for a size without an instance.
pub(crate) fn with_method<T>(
    method: Implicit,
    model: &dyn Model,
    f: impl FnOnce(&dyn PlainMethod) -> T,
) -> Option<T> {
    macro_rules! of_size {
        ($($n:literal)*) => {
            match model.sizes().directions {
                $($n => with_method_of::<$n, T>(method, &Modelled::new(model), f),)*
                _ => None,
            }
        };
    }
    of_size!(1 2 3 4)
}

fn with_method_of<const N: usize, T>(
    method: Implicit,
    flow: &Modelled<'_, N>,
    f: impl FnOnce(&dyn PlainMethod) -> T,
) -> Option<T> {
    macro_rules! of_stages {
        ($name:ident, $found:ident: $($stages:literal)*) => {
            match $found {
                $($stages => f(&MethodInTypes { method: $name::<$stages>, flow }),)*
                _ => return None,
            }
        };
    }
    Some(match method {
        Implicit::Midpoint { newton, splits } => {
            let method = Scheme { newton, splits, ..Scheme::new(WeylMidpoint) };
            f(&MethodInTypes { method, flow })
        }
        Implicit::Gauss { stages } => of_stages!(Gauss, stages: 1 2 3 4),
        Implicit::Radau { stages } => of_stages!(Radau, stages: 2 3 4),
    })
}

#[cfg(test)]
mod tests {
    use metriplectic_dynamics::bracket::Nambu;
    use metriplectic_dynamics::{Metriplectic, Symplectic, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::{Euclidean, LieDual, Manifold as _, WeylMidpoint};
    use nalgebra::{Vector2, Vector3, vector};
    use num_dual::DualNum as _;

    use super::*;
    use crate::step::Inlined;
    use crate::{Method as _, Schedule, Span, Watch as _};

    /// Asserts that the instances of the library take the steps that a method takes in the types of a system.
    fn agree<Y: Metriplectic>(
        name: &str,
        system: &Y,
        x0: &metriplectic_dynamics::system::Point<Y>,
        h: f64,
    ) {
        let schedules: [Schedule; 2] = [
            Span::steps(h, 40).into(),
            Span::until(20.0 * h).tolerance(1e-6).output_every(3.0 * h),
        ];
        for schedule in schedules {
            macro_rules! agree {
                ($($method:expr),*) => {$(
                    let of = |run: Result<crate::Trajectory<Y::Manifold>, _>| {
                        let run = run.unwrap_or_else(|error: crate::RunError<_>| panic!("{name}: {error}"));
                        let bits = |state: &crate::State<Y::Manifold>| {
                            let mut numbers = vec![state.time, state.energy, state.entropy];
                            numbers.extend(Y::Manifold::entries(&state.point));
                            numbers.into_iter().map(f64::to_bits).collect::<Vec<_>>()
                        };
                        let states: Vec<_> = run.states().iter().map(bits).collect();
                        (states, run.certificate().to_string())
                    };
                    let compiled = of($method.run(system, x0.clone(), schedule.clone()));
                    let inlined = of(Inlined($method).run(system, x0.clone(), schedule.clone()));
                    assert!(compiled.0 == inlined.0 && compiled.0.len() > 1, "{name}");
                    assert_eq!(compiled.1, inlined.1, "{name}");
                )*};
            }
            agree!(WeylMidpoint, Gauss::<1>, Gauss::<4>, Radau::<2>, Radau::<3>);
        }
    }

    #[test]
    fn the_instances_of_the_library_have_the_bits_of_the_types_of_a_system() {
        let body = System::on(LieDual::so3())
            .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.z * 1.5)
            .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
            .build()
            .unwrap();
        agree("a body with friction", &body, &vector![0.4, -1.0, 0.3], 0.1);
        let swirl = |xi: &Vector3<Real>| Vector3::new(-xi.y, xi.x, 0.0.into()) * (xi.x * 0.8);
        let pushed = System::on(LieDual::so3())
            .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y * 0.25 + p.z * p.z * 0.2)
            .force(swirl)
            .build()
            .unwrap();
        agree("a body with a force", &pushed, &vector![0.9, 0.4, -0.7], 0.1);
        // A bracket that is made of the entropy.
        let nambu = System::on(Euclidean::<3>)
            .bracket(Nambu::default())
            .energy(|x: &Vector3<Real>| x.x.cos() + x.y * x.y + x.z * x.z * 0.5)
            .entropy(|x: &Vector3<Real>| (x.x * x.x + x.y * x.y * 2.0 + x.z * x.z) * 0.5)
            .build()
            .unwrap();
        agree("a bracket of Nambu", &nambu, &vector![0.5, 0.7, -0.2], 0.05);
        // No entropy.
        let pendulum = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 - x.x.cos())
            .build()
            .unwrap();
        agree("a pendulum", &pendulum, &vector![2.0, 0.0], 0.1);
    }
}
