//! Methods in plain numbers, compiled with this library: one instance for each number of directions and entries.
//!
//! Each step is that of the same text as in the types of a system, and has its bits.

use metriplectic_equations::{Equations, Sizes};

use crate::explicit::{ExplicitRungeKutta, Tableau};
use crate::implicit::{Collocation, InLists, Midpoint};
use crate::numbers::{Answered, FromEquations, OfLength};
use crate::step::compiled::{explicit_lengths, implicit_lengths};
use crate::step::in_plain::MethodInTypes;
use crate::step::{Compiled, PlainMethod, Written};

/// Calls `f` with a method of a system; `None` for a size without an instance.
pub(crate) fn with_method<T>(
    method: Compiled,
    flow: &Answered<'_>,
    f: impl FnOnce(&dyn PlainMethod) -> T,
) -> Option<T> {
    let system = flow.numbers.0;
    let Sizes { entries, directions, .. } = system.sizes();
    if let Some(method) = explicit(method) {
        macro_rules! of_lengths {
            ($(($n:literal, $e:literal))*) => {
                match (directions, entries) {
                    $(($n, $e) => {
                        let flow = &OfLength::<$n, $e>::new(flow);
                        f(&MethodInTypes { method, flow })
                    })*
                    _ => return None,
                }
            };
        }
        return Some(explicit_lengths!(of_lengths));
    }
    macro_rules! of_length {
        ($($n:literal)*) => {
            match directions {
                $($n => Some(implicit(method, &OfLength::<$n, $n>::new(flow), f)?),)*
                _ => None,
            }
        };
    }
    implicit_lengths!(of_length)
}

/// Calls `f` with a method of a system of one's own; `None` for one that is not of this library.
pub(crate) fn with_own<T>(
    method: Compiled,
    flow: &FromEquations<&dyn Equations>,
    f: impl FnOnce(&dyn PlainMethod) -> T,
) -> Option<T> {
    match explicit(method) {
        Some(method) => Some(f(&MethodInTypes { method, flow })),
        None => implicit(method, flow, f),
    }
}

/// Returns the method, if it is explicit.
pub(crate) fn explicit(method: Compiled) -> Option<ExplicitRungeKutta> {
    let Compiled::Explicit(tableau) = method else { return None };
    tableau.downcast_ref::<Tableau>().map(ExplicitRungeKutta::new)
}

/// Calls `f` with an implicit method of a model on a vector space.
fn implicit<F: InLists + Written, T>(
    method: Compiled,
    flow: &F,
    f: impl FnOnce(&dyn PlainMethod) -> T,
) -> Option<T> {
    Some(match method {
        Compiled::Explicit(_) => return None,
        Compiled::Midpoint { name, line, newton, splits } => {
            let line = Some(line);
            f(&MethodInTypes { method: Midpoint { name, line, newton, splits }, flow })
        }
        Compiled::Gauss { stages } => {
            f(&MethodInTypes { method: Collocation::gauss(stages)?, flow })
        }
        Compiled::Radau { stages } => {
            f(&MethodInTypes { method: Collocation::radau(stages)?, flow })
        }
    })
}

#[cfg(test)]
mod tests {
    use metriplectic_dynamics::bracket::{AreaForm, Nambu, Zero};
    use metriplectic_dynamics::{Metriplectic, Symplectic, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::{
        Chart, ChartMidpoint, Euclidean, Exponential, LieDual, Manifold, Product, Rotations,
        Sphere, WeylMidpoint,
    };
    use nalgebra::{Matrix3, SVector, Vector1, Vector2, Vector3, Vector4, Vector6, vector};
    use num_dual::DualNum as _;

    use super::*;
    use crate::step::Inlined;
    use crate::{
        DormandPrince5, DormandPrince8, Gauss, MeanValue, Method, Radau, RunError,
        RungeKuttaChebyshev, Schedule, Scheme, Span, Tableau, Trajectory, Watch as _,
    };

    /// Lists all that came out of a run, with its bits: the states, and the certificate or the error.
    fn outcome<M: Manifold>(run: Result<Trajectory<M>, RunError<M>>) -> (Vec<Vec<u64>>, String) {
        let (run, said) = match run {
            Ok(run) => {
                let said = run.certificate().to_string();
                (run, said)
            }
            Err(RunError::Step { cause, trajectory }) => (*trajectory, cause.to_string()),
            Err(error) => panic!("{error}"),
        };
        let bits = |state: &crate::State<M>| {
            let mut numbers = vec![state.time, state.energy, state.entropy];
            numbers.extend(M::entries(&state.point));
            numbers.into_iter().map(f64::to_bits).collect()
        };
        (run.states().iter().map(bits).collect(), said)
    }

    /// Asserts that the instances of the library take the steps that a method takes in the types of a system, and returns what the
    /// runs of a fixed size said.
    fn agree<Y: Metriplectic>(
        name: &str,
        system: &Y,
        x0: &metriplectic_dynamics::system::Point<Y>,
        h: f64,
        method: impl Method<Y> + Copy,
    ) -> String {
        let schedules: [Schedule; 2] = [
            Span::steps(h, 40).into(),
            Span::until(20.0 * h).tolerance(1e-6).output_every(3.0 * h),
        ];
        let [said, _] = schedules.map(|schedule| {
            let compiled = outcome(method.run(system, x0.clone(), schedule.clone()));
            let inlined = outcome(Inlined(method).run(system, x0.clone(), schedule));
            assert!(compiled.0 == inlined.0 && !compiled.0.is_empty(), "{name}");
            assert_eq!(compiled.1, inlined.1, "{name}");
            compiled.1
        });
        said
    }

    /// Asserts it for implicit methods.
    fn implicit_agree<Y: Metriplectic>(
        name: &str,
        system: &Y,
        x0: &metriplectic_dynamics::system::Point<Y>,
        h: f64,
    ) {
        assert!(<Y as Written>::HAS_IMPLICIT, "{name}");
        agree(name, system, x0, h, WeylMidpoint);
        agree(name, system, x0, h, Exponential);
        agree(name, system, x0, h, Scheme::new(ChartMidpoint).gradient(MeanValue));
        agree(name, system, x0, h, Gauss::<1>);
        agree(name, system, x0, h, Gauss::<4>);
        agree(name, system, x0, h, Radau::<2>);
        agree(name, system, x0, h, Radau::<3>);
    }

    /// Kutta's method of order 3 (1901).
    const KUTTA: Tableau = Tableau::new(
        "Kutta3",
        3,
        &[&[(0, 0.5)], &[(0, -1.0), (1, 2.0)]],
        &[(0, 1.0 / 6.0), (1, 2.0 / 3.0), (2, 1.0 / 6.0)],
    );

    /// Asserts it for explicit methods, and returns what the one of order 8 said.
    fn explicit_agree<Y: Metriplectic>(
        name: &str,
        system: &Y,
        x0: &metriplectic_dynamics::system::Point<Y>,
        h: f64,
    ) -> String {
        assert!(<Y as Written>::HAS_EXPLICIT, "{name}");
        agree(name, system, x0, h, DormandPrince5);
        agree(name, system, x0, h, RungeKuttaChebyshev);
        agree(name, system, x0, h, ExplicitRungeKutta::new(&KUTTA));
        agree(name, system, x0, h, DormandPrince8)
    }

    #[test]
    fn the_instances_of_the_library_have_the_bits_of_the_types_of_a_system() {
        let body = System::on(LieDual::so3())
            .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.z * 1.5)
            .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
            .build()
            .unwrap();
        implicit_agree("a body with friction", &body, &vector![0.4, -1.0, 0.3], 0.1);
        let swirl = |xi: &Vector3<Real>| Vector3::new(-xi.y, xi.x, 0.0.into()) * (xi.x * 0.8);
        let pushed = System::on(LieDual::so3())
            .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y * 0.25 + p.z * p.z * 0.2)
            .force(swirl)
            .build()
            .unwrap();
        implicit_agree("a body with a force", &pushed, &vector![0.9, 0.4, -0.7], 0.1);
        // A bracket that is made of the entropy.
        let nambu = System::on(Euclidean::<3>)
            .bracket(Nambu::default())
            .energy(|x: &Vector3<Real>| x.x.cos() + x.y * x.y + x.z * x.z * 0.5)
            .entropy(|x: &Vector3<Real>| (x.x * x.x + x.y * x.y * 2.0 + x.z * x.z) * 0.5)
            .build()
            .unwrap();
        implicit_agree("a bracket of Nambu", &nambu, &vector![0.5, 0.7, -0.2], 0.05);
        // No entropy.
        let pendulum = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 - x.x.cos())
            .build()
            .unwrap();
        implicit_agree("a pendulum", &pendulum, &vector![2.0, 0.0], 0.1);
    }

    #[test]
    fn explicit_instances_have_the_bits_of_the_types_of_a_system() {
        let body = System::on(LieDual::so3())
            .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.z * 1.5)
            .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
            .build()
            .unwrap();
        explicit_agree("a body with friction", &body, &vector![0.4, -1.0, 0.3], 0.1);
        // To rest, where changes of the entropy are round-off.
        explicit_agree("the same for a long time", &body, &vector![0.4, -1.0, 0.3], 3.0);
        let pendulum = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 - x.x.cos())
            .build()
            .unwrap();
        explicit_agree("a pendulum", &pendulum, &vector![2.0, 0.0], 0.1);
        let two = System::on(Euclidean::<4>)
            .bracket(Symplectic)
            .energy(|x: &Vector4<Real>| {
                x.norm_squared() * 0.5 + x.x * x.x * x.y - x.y.powi(3) / 3.0
            })
            .build()
            .unwrap();
        explicit_agree("two degrees of freedom", &two, &vector![0.1, 0.2, 0.3, -0.1], 0.1);
        let three = System::on(Euclidean::<6>)
            .bracket(Symplectic)
            .energy(|x: &Vector6<Real>| {
                x.fixed_rows::<3>(3).norm_squared() * 0.5
                    - x.fixed_rows::<3>(0).norm_squared().sqrt().recip()
            })
            .build()
            .unwrap();
        let orbit: SVector<f64, 6> = vector![1.0, 0.0, 0.1, 0.0, 1.1, 0.2];
        explicit_agree("an orbit", &three, &orbit, 0.1);
        let sphere = System::on(Sphere::<2>::round())
            .energy(|x: &Vector3<Real>| x.x * x.x * 0.5 + x.y * x.y * 0.25 + x.x.powi(3) * 0.1)
            .entropy(|x: &Vector3<Real>| x.z + x.x * x.y * 0.3)
            .build()
            .unwrap();
        explicit_agree("a sphere", &sphere, &vector![0.48, 0.36, -0.8], 0.1);
        let spin = System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
            .bracket((AreaForm, Zero))
            .energy(|(n, s): &(Vector3<Real>, Vector1<Real>)| {
                n.x * n.x * 0.5 + n.y * n.y * 0.25 - n.z * 0.4 + s.x.exp()
            })
            .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
            .build()
            .unwrap();
        explicit_agree("a spin", &spin, &(vector![0.6, 0.0, 0.8], vector![0.2]), 0.1);
        let frame = System::on(Rotations::bi_invariant())
            .energy(|r: &Matrix3<Real>| r[(0, 1)] * 0.5 + r[(2, 2)] * r[(2, 2)])
            .entropy(|r: &Matrix3<Real>| r[(0, 0)] + r[(1, 2)] * 0.3)
            .build()
            .unwrap();
        explicit_agree("a frame", &frame, &Matrix3::identity(), 0.1);
        let satellite = System::on(Product(Rotations::bi_invariant(), Euclidean::<3>))
            .bracket(Symplectic)
            .energy(|(r, p): &(Matrix3<Real>, Vector3<Real>)| {
                p.x * p.x * 0.5 + p.y * p.y * 0.25 + p.z * p.z * 0.2 + r[(2, 2)] * 0.3
            })
            .build()
            .unwrap();
        explicit_agree("a top", &satellite, &(Matrix3::identity(), vector![0.9, 0.4, -0.7]), 0.1);
        // It runs out of its domain.
        let half_plane = System::on(Chart::<2>::new(|q| q.y > 0.0))
            .bracket(Symplectic)
            .energy(|q: &Vector2<Real>| q.x + q.y * q.y * 0.1)
            .build()
            .unwrap();
        let said = explicit_agree("a half plane", &half_plane, &vector![0.0, 1.0], 0.1);
        assert!(said.contains("leaves the domain"), "{said}");
    }
}
