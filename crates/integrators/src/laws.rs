//! What discrete gradients and steps promise, and the functions that check it.

use metriplectic_dynamics::{Metriplectic, SecondLaw, system::Point};
use metriplectic_fields::{
    BrokenLaw, ChartPoint, Column, ScalarField, Space, Vector, differential,
};
use metriplectic_manifolds::{Arc, Manifold, Retraction, Riemannian};

use crate::discrete_gradient::{DiscreteGradient, along as along_arc};
use crate::residual::Recall;
use crate::step::{Memory, Scheme, Start};
use crate::trajectory::entropy_round_off;

/// Checks a discrete gradient of `f` on the arc of `u` from `x`:
///
/// 1. mean value: `⟨w, d⟩ = F(x') − F(x)`; 2. consistency: `w → dF(z)` like `|d|²` on arcs that
///    shrink; 3. the covector that is safe against round-off agrees with the definition as far as
///    the definition has digits.
///
/// # Errors
///
/// The first law that is broken.
pub fn discrete_gradient<M, G, R, W>(
    gradient: &W,
    f: &impl ScalarField<M>,
    metric: &G,
    retraction: &R,
    x: &M::Point<f64>,
    u: &Vector<M>,
) -> Result<(), BrokenLaw>
where
    M: Manifold,
    G: Riemannian<M>,
    R: Retraction<M, G>,
    W: DiscreteGradient,
{
    let missing = |law| move |_| BrokenLaw { law, size: f64::NAN, bound: 0.0 };
    let start: f64 = f.at(x);
    let along = |u: &Vector<M>| -> Result<_, BrokenLaw> {
        let arc: Arc<M> = retraction.arc(metric, x, u).map_err(missing("the arc exists"))?;
        let g = metric.at(&arc.z).map_err(missing("the metric exists"))?;
        let w = gradient.covector(f, &g, (x, start), &arc);
        let df = differential(f, &ChartPoint::centre(&arc.z.point()));
        let end: f64 = f.at(&arc.end);
        let safe = along_arc(gradient, f, metric, retraction, (x, u))
            .map_err(missing("the arc exists"))?;
        Ok((arc, w, safe, df, end))
    };
    let (arc, w, safe, df, end) = along(u)?;
    let size = start.abs() + end.abs() + df.magnitude() * (M::magnitude(&arc.end) + 1.0);
    let bound = 64.0 * f64::EPSILON * size;
    let off = (w.dot(&arc.d) - (end - start)).abs();
    BrokenLaw::unless("⟨w, d⟩ = F(x') − F(x)", off, bound)?;
    let off = (w - safe).magnitude();
    BrokenLaw::unless("the safe covector is the defined one", off, bound / arc.d.magnitude())?;

    // On an arc a hundred times shorter the deviation is 10⁴ times smaller; a first-order one
    // would be a hundred times smaller only.
    let deviation = |t: f64| along(&(*u * t)).map(|(_, _, safe, df, _)| (safe - df).magnitude());
    let long = deviation(1.0)?.max(4.0 * deviation(0.5)?).max(16.0 * deviation(0.25)?);
    let allowed = 1e-4 * (10.0 * long + df.magnitude()) + 1e2 * bound / arc.d.magnitude();
    BrokenLaw::unless("w − dF(z) falls like |d|²", deviation(1e-2)?, allowed)
}

/// Checks one step of size `h` from `x`:
///
/// 1. the energy is kept to `50 ε max(|H|, 1)`; 2. with [`SecondLaw::Exact`] and `h > 0` the entropy
///    does not fall by more than its round-off `4ε (max(|S|, 1) + |dS||x|)`.
///
/// # Errors
///
/// The first law that is broken; a step that cannot be taken breaks the law that it exists.
pub fn step<Y, R, W>(
    scheme: &Scheme<R, W>,
    system: &Y,
    x: &Point<Y>,
    h: f64,
) -> Result<(), BrokenLaw>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    let end = one(scheme, system, x, h)?;
    let energy = system.energy_at(x);
    let bound = 50.0 * f64::EPSILON * energy.abs().max(1.0);
    BrokenLaw::unless("a step keeps the energy", (system.energy_at(&end) - energy).abs(), bound)?;
    if system.second_law() == SecondLaw::Exact && h > 0.0 {
        let entropy = system.entropy_at(x);
        let bound = entropy_round_off(system, x, entropy);
        let fall = entropy - system.entropy_at(&end);
        BrokenLaw::unless("a step does not lower the entropy", fall, bound)?;
    }
    Ok(())
}

/// Checks that a scheme is symmetric in time: a step of `h` and one of `−h` lead back to `x`, as
/// with a symmetric retraction and the discrete gradient of its midpoint. `h` must be so small that
/// the step is solved whole.
///
/// # Errors
///
/// The law if it is broken, or a step that cannot be taken.
pub fn symmetric_step<Y, R, W>(
    scheme: &Scheme<R, W>,
    system: &Y,
    x: &Point<Y>,
    h: f64,
) -> Result<(), BrokenLaw>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    let back = one(scheme, system, &one(scheme, system, x, h)?, -h)?;
    let off = Y::Manifold::coordinates(x, &back).magnitude();
    let bound = 1e-13 * Y::Manifold::magnitude(x).max(1.0);
    BrokenLaw::unless("steps of h and −h lead back", off, bound)
}

/// A single step, with nothing remembered.
fn one<Y, R, W>(
    scheme: &Scheme<R, W>,
    system: &Y,
    x: &Point<Y>,
    h: f64,
) -> Result<Point<Y>, BrokenLaw>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    let left_over = Recall::nothing();
    let [energy, entropy] = [system.energy_at(x), system.entropy_at(x)];
    let invariants = left_over.invariants;
    let start = Start { x, time: 0.0, h, energy, entropy, invariants, left_over };
    let missing = |_| BrokenLaw { law: "the step exists", size: f64::NAN, bound: 0.0 };
    scheme.step(system, &start, &mut Memory::new()).map(|(end, _)| end).map_err(missing)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Gonzalez, MeanValue, SymmetricItohAbe};
    use metriplectic_dynamics::System;
    use metriplectic_fields::Real;
    use metriplectic_manifolds::{Canonical, Exponential, LieDual, WeylMidpoint};
    use nalgebra::{Vector3, vector};
    use num_dual::DualNum;
    use proptest::prelude::*;

    fn top(p: &Vector3<Real>) -> Real {
        p.x.powi(2) + p.y.powi(3) * 0.3 + (p.z * p.x).sin() * 0.2 + 2.0
    }

    proptest! {
        #[test]
        fn the_discrete_gradient_keeps_its_laws(
            x in prop::array::uniform3(-1.0..1.0), u in prop::array::uniform3(-0.5..0.5),
        ) {
            let (x, u) = (Vector3::from(x), Vector3::from(u));
            prop_assume!(u.norm() > 0.05);
            let (g, weyl, x, u) = (&Canonical, &WeylMidpoint, &x, &u);
            discrete_gradient::<LieDual<3>, _, _, _>(&Gonzalez, &top, g, weyl, x, u)?;
            discrete_gradient::<LieDual<3>, _, _, _>(&MeanValue, &top, g, weyl, x, u)?;
            discrete_gradient::<LieDual<3>, _, _, _>(&SymmetricItohAbe, &top, g, weyl, x, u)?;
        }

        #[test]
        fn a_midpoint_step_is_symmetric_and_keeps_the_energy(
            x in prop::array::uniform3(-1.0..1.0),
        ) {
            let body = System::on(LieDual::so3())
                .energy(top)
                .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
                .build()
                .unwrap();
            let (scheme, x) = (Scheme::new(WeylMidpoint), Vector3::from(x));
            step(&scheme, &body, &x, 0.02)?;
            symmetric_step(&scheme, &body, &x, 0.02)?;
        }
    }

    #[test]
    fn a_step_based_at_its_start_is_not_symmetric() {
        let body = System::on(LieDual::so3()).energy(top).build().unwrap();
        let x = vector![0.3, -0.7, 0.5];
        let broken = symmetric_step(&Scheme::new(Exponential), &body, &x, 0.1).unwrap_err();
        assert_eq!(broken.law, "steps of h and −h lead back");
    }
}
