//! Stiff friction that is damped: what a Radau method loses of the energy becomes heat.
//!
//! Radau's weights are algebraically stable: on a step that is long for friction the method loses energy where the
//! energy is convex, and gains entropy where the entropy is concave. To correct the covectors for both would undo the
//! damping (see the [module](super)). So the covector of the energy stays `dH`, and the stages get a velocity that
//! returns what was lost,
//!
//! ```math
//! v_i = \tilde\Pi_i\, dH + \tilde K_i\, w_{S,i} + \rho\, u_i, \qquad
//! u_i = \frac{♯n_i}{\langle dH, ♯n_i\rangle}, \qquad h\rho = -\delta_H ,
//! ```
//!
//! with `n_i` the part of `dS` that is orthogonal to the covectors of the further invariants. Then `ΔH = 0` and
//!
//! ```math
//! \Delta S = h \sum_i b_i \tilde K_i(w_{S,i}, w_{S,i}) + \max(N, 0), \qquad
//! N = \delta_S + h\rho \sum_i b_i \langle dS, u_i\rangle ,
//! ```
//!
//! if the covector of the entropy is corrected where `N < 0`, by `a_S = N/(D - h\rho \sum_i b_i \langle ♭v_i, u_i\rangle)`.
//! Near an equilibrium `dS = β dH`, and `N = δ_S − β δ_H` is the gain of `S − βH`, which has a maximum there: it is not
//! negative, and nothing is corrected.

use metriplectic_dynamics::orthogonal::Orthogonal;
use metriplectic_dynamics::velocity::Covectors;
use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{ChartPoint, Column, Vector};
use metriplectic_manifolds::{InnerProduct, Manifold, Riemannian};

use super::covectors::{StageCovectors, StagePoints, Stages};
use super::tableau::{STAGES, Tableau};
use crate::midpoint::Dim;

/// What is added to the stages.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heat<V> {
    /// The velocities `ρ u_i`.
    pub(super) velocity: Stages<V>,
    /// The gain of the entropy beside the production of friction.
    pub(super) surplus: f64,
}

/// The fraction of its terms that is left of `⟨dH, ♯n⟩` where heat has a direction.
const DIRECTED: f64 = 1e-3;

/// The vector `♯n` at a point; `None` where it does not change the energy.
fn direction<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
    w: &Covectors<Dim<Y>, Vector<Y::Manifold>>,
) -> Option<Vector<Y::Manifold>> {
    let g = system.metric().at(&ChartPoint::<Y::Manifold>::centre(x)).ok()?;
    let mut normals = Orthogonal::<Dim<Y>>::default();
    for (_, l) in w.invariants.as_ref().iter().flatten() {
        normals.push(&g, l);
    }
    let sharp = g.sharp(&normals.project_covector(0, &w.entropy));
    let warmed = w.energy.dot(&sharp);
    let terms = Y::Manifold::pairing_size(&w.energy, &sharp);
    let is_directed = warmed.abs() >= DIRECTED * terms && terms > 0.0 && warmed.is_finite();
    is_directed.then(|| sharp * warmed.recip())
}

/// Whether heat has a direction at a point.
pub(super) fn is_directed<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
    w: &Covectors<Dim<Y>, Vector<Y::Manifold>>,
) -> bool {
    direction(system, x, w).is_some()
}

/// Adds heat to the stages, and corrects the covectors of the entropy; `None` where heat has no direction.
pub(super) fn add<Y: Metriplectic>(
    system: &Y,
    (tableau, h): (&Tableau, f64),
    stages: &StagePoints<Y::Manifold>,
    w: &mut Covectors<Dim<Y>, StageCovectors<Vector<Y::Manifold>>>,
    at: impl Fn(
        &Covectors<Dim<Y>, StageCovectors<Vector<Y::Manifold>>>,
        usize,
    ) -> Covectors<Dim<Y>, Vector<Y::Manifold>>,
) -> Option<Heat<Vector<Y::Manifold>>> {
    let rho = -w.energy.left / h;
    let mut velocity = [Vector::<Y::Manifold>::zero(); STAGES];
    let (mut gain, mut along) = (w.entropy.left, 0.0);
    for i in 0..tableau.stages {
        let u = direction(system, &stages.x[i], &at(w, i))?;
        velocity[i] = u * rho;
        let weight = h * tableau.weights[i];
        gain += weight * w.entropy.w[i].dot(&velocity[i]);
        along += weight * stages.flat(i).dot(&velocity[i]);
    }
    let square = stages.square() - along;
    if gain < 0.0 && square != 0.0 {
        for i in 0..tableau.stages {
            w.entropy.w[i] += stages.flat(i) * (gain / square);
        }
    }
    Some(Heat { velocity, surplus: gain.max(0.0) })
}
