//! The laws of a model are looked at again on the way of a run.

use metriplectic_dynamics::ModelError;
use metriplectic_equations::Equations;
use metriplectic_equations::judge::Judge;

use crate::step::Recheck;

/// The time that a system without a clock is asked at.
pub(crate) const NO_CLOCK: f64 = 0.0;

/// Looks at the laws of a system at a state that a run has reached.
///
/// # Errors
///
/// The first law that is broken.
pub(crate) fn recheck(
    system: &dyn Equations,
    x: &[f64],
    occasion: Recheck,
) -> Result<(), ModelError> {
    let judge = Judge::of(system, NO_CLOCK);
    match occasion {
        Recheck::OnTheWay { step } => {
            judge.check_state(x).and_then(|()| judge.look_at_derivatives(x, step))
        }
        Recheck::End => judge.check_state(x).and_then(|()| judge.check_derivatives(x)),
        Recheck::Failure { h } => judge.check_around(x, &ahead(system, x, h)),
    }
}

/// The fractions of a step that fails at which its model is looked at.
/// A factor of four fails `system/recheck.rs::a_model_is_looked_at_from_an_eighth_of_a_step_to_its_end`.
const AHEAD: [f64; 4] = [0.125, 0.25, 0.5, 1.0];

/// States along the velocity at `x`, on the way of a step of size `h`; those beyond the edge of the chart are left out.
#[cold]
fn ahead(system: &dyn Equations, x: &[f64], h: f64) -> Vec<Vec<f64>> {
    let mut v = vec![0.0; system.sizes().directions];
    let is_known = system.velocity(NO_CLOCK, x, &mut v).is_some();
    if !is_known || v.iter().any(|v| !v.is_finite()) {
        return Vec::new();
    }
    let mut sizes = v.clone();
    system.scales(x, &mut sizes);
    let along = |theta: &f64| {
        let q: Vec<f64> = v.iter().map(|v| v * (theta * h)).collect();
        let (mut y, mut back) = (vec![0.0; x.len()], q.clone());
        system.chart(x, &q, &mut y);
        let is_near = system.coordinates(x, &y, &mut back);
        // Beyond the edge a chart may come back to states that are near.
        let mut pairs = back.iter().zip(&q).zip(&sizes);
        let comes_back = pairs.all(|((back, q), size)| (back - q).abs() <= 1e-6 * (q.abs() + size));
        (is_near && comes_back).then_some(y)
    };
    AHEAD.iter().filter_map(along).collect()
}

#[cfg(test)]
mod tests {
    use metriplectic_dynamics::bracket::AreaForm;
    use metriplectic_dynamics::{InNumbers, Symplectic, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::{Euclidean, Sphere};
    use nalgebra::{Vector2, Vector3};

    use super::*;

    #[test]
    fn a_model_is_looked_at_from_an_eighth_of_a_step_to_its_end() {
        let system = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
            .build()
            .unwrap();
        let along: Vec<f64> =
            ahead(&InNumbers(&system), &[1.0, 0.0], 0.4).iter().map(|y| -y[1]).collect();
        let expected = [0.05, 0.1, 0.2, 0.4];
        assert_eq!(along.len(), 4);
        assert!(along.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{along:?}");
    }

    #[test]
    fn a_step_around_a_sphere_leads_to_no_state_ahead() {
        // A rotation about an axis, by 6.2 in the step: its end is near the start again, and its middle is beyond the edge.
        let system = System::on(Sphere::<2>::round())
            .bracket(AreaForm)
            .energy(|x: &Vector3<Real>| x.z)
            .build()
            .unwrap();
        let states = ahead(&InNumbers(&system), &[1.0, 0.0, 0.0], 6.2);
        assert_eq!(states.len(), 2, "{states:?}");
    }
}
