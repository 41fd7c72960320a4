//! The further invariants at the end of a step in which a projection has faded out.
//!
//! Where the differential of a Casimir depends on that of the entropy, its projection fades out of `Π̃`, because a
//! discrete gradient does not resolve the direction of the rest. A step then changes the Casimir by up to `10⁻⁴h²`, and
//! the entropy may rise above the largest value that the Casimir allows. So the end is moved onto the energy and the
//! further invariants of the run by Newton's method along their differentials, and along that of the entropy as
//! long as it is below that of the start. The start has these laws, so there is such a state. Near the largest
//! entropy that the invariants allow, its differential is a combination of theirs, and each correction leaves a quarter
//! of the fall.

use metriplectic_dynamics::orthogonal::Orthogonal;
use metriplectic_dynamics::velocity::differentials;
use metriplectic_dynamics::{Invariants, Metriplectic, system::Point};
use metriplectic_fields::{ChartPoint, Column, Space as _, Vector};
use metriplectic_manifolds::{InnerProduct, Manifold, Riemannian};

use crate::round_off::bound::{ROUNDED, of_a_law};
use crate::step::{Dim, Flow as _, Laws, Numbers, Start};

/// The largest distance by which an end is moved, relative to the step.
/// A factor of four fails `tests/dependent_invariants.rs::a_casimir_of_so5_stays_where_the_entropy_depends_on_it`.
pub(crate) const NEAR: f64 = 1e-2;

/// The most corrections: a fall of the entropy by `10⁻⁴` is round-off after 20.
/// A factor of four fails `tests/dependent_invariants.rs::a_casimir_of_so5_stays_where_the_entropy_depends_on_it`.
pub(crate) const CORRECTIONS: usize = 32;

/// The fraction of the round-off of a law that an invariant may be off by before an end is moved.
/// A factor of four fails `tests/dependent_invariants.rs::a_casimir_of_so5_stays_where_the_entropy_depends_on_it`.
pub(crate) const KEPT: f64 = 0.5;

/// The fraction of this by which the invariants may differ from the wanted ones. The entropy depends on them, and has
/// to hold to its own round-off.
/// A factor of four fails `tests/dependent_invariants.rs::a_casimir_of_so5_stays_where_the_entropy_depends_on_it`.
pub(crate) const EXACT: f64 = 0.03;

/// A state and the laws there.
type Restored<Y> = (Point<Y>, Laws<Numbers<Y>>);

/// The end of a step with the further invariants of the run; `None` if they are kept to round-off, or no state nearby
/// has them.
#[inline]
pub(super) fn restored<Y: Metriplectic>(
    start: &Start<'_, Y>,
    end: &Point<Y>,
    values: &Laws<Numbers<Y>>,
    exact: bool,
) -> Option<Restored<Y>> {
    let off = |k: usize| {
        let value = start.values.invariants[k];
        let error = values.invariants[k] - value + start.accumulated_error.invariants[k];
        error.abs() > KEPT * of_a_law(value.abs())
    };
    if !(0..Y::Invariants::COUNT).any(off) {
        return None;
    }
    let floor = exact.then_some(start.values.entropy);
    Wanted::at(start, end, floor).of(end, *values)
}

/// The laws that the end of a step should have.
struct Wanted<'a, Y: Metriplectic> {
    system: &'a Y,
    laws: Laws<Numbers<Y>>,
    /// The further invariants of the run.
    reference: Numbers<Y>,
    /// The entropy that the end has at least.
    floor: Option<f64>,
    /// The round-off of the laws.
    round_off: Laws<Numbers<Y>>,
    /// The size of each coordinate, and of the step in these units.
    units: Vector<Y::Manifold>,
    length: f64,
}

impl<'a, Y: Metriplectic> Wanted<'a, Y> {
    #[cold]
    fn at(start: &Start<'a, Y>, end: &Point<Y>, floor: Option<f64>) -> Self {
        let system = start.system;
        let (mut laws, mut round_off) = (start.values, system.term_sizes(end));
        laws.energy -= start.accumulated_error.energy;
        round_off.energy = of_a_law(round_off.energy);
        // Half of the round-off of an increment.
        round_off.entropy *= 0.5 * ROUNDED;
        let mut reference = laws.invariants;
        for k in 0..Y::Invariants::COUNT {
            let (error, allowed) =
                (start.accumulated_error.invariants[k], KEPT * of_a_law(round_off.invariants[k]));
            round_off.invariants[k] = allowed;
            reference[k] -= error;
            // The entropy of the start may need the round-off of the invariants there.
            laws.invariants[k] = reference[k] + error.clamp(-allowed, allowed);
        }
        let d = Y::Manifold::coordinates(start.x, end);
        let units = Y::Manifold::scales(start.x) + d.abs();
        let length = relative::<Y>(&d, &units);
        Self { system, laws, reference, floor, round_off, units, length }
    }

    /// The state near the end of a step that has the laws.
    #[cold]
    #[inline(never)]
    fn of(&self, end: &Point<Y>, mut there: Laws<Numbers<Y>>) -> Option<Restored<Y>> {
        if self.has_invariants(&there, &self.reference, 1.0) {
            return None;
        }
        let mut y = end.clone();
        for _ in 0..CORRECTIONS {
            y = Y::Manifold::chart(&y, &self.correction(&y, &there)?);
            there = self.system.laws(&y);
            let moved = relative::<Y>(&Y::Manifold::coordinates(end, &y), &self.units);
            if moved > NEAR * self.length || moved.is_nan() {
                return None;
            }
            let balanced = (there.energy - self.laws.energy).abs() <= self.round_off.energy;
            if balanced
                && self.has_invariants(&there, &self.laws.invariants, EXACT)
                && self.fall(there.entropy) <= self.round_off.entropy
            {
                return Some((y, there));
            }
        }
        None
    }

    /// Returns whether the further invariants differ from the `wanted` ones by at most this fraction of their round-off.
    fn has_invariants(&self, there: &Laws<Numbers<Y>>, wanted: &Numbers<Y>, fraction: f64) -> bool {
        let near = |k: usize| {
            let allowed = fraction * self.round_off.invariants[k];
            (there.invariants[k] - wanted[k]).abs() <= allowed
        };
        (0..Y::Invariants::COUNT).all(near)
    }

    /// By how much the entropy is below the least one.
    fn fall(&self, entropy: f64) -> f64 {
        self.floor.map_or(0.0, |floor| (floor - entropy).max(0.0))
    }

    /// The shortest displacement that has the missing parts of the laws, one law after the other.
    fn correction(&self, y: &Point<Y>, there: &Laws<Numbers<Y>>) -> Option<Vector<Y::Manifold>> {
        let at = ChartPoint::<Y::Manifold>::centre(y);
        let (w, g) = (differentials(self.system, &at), self.system.metric().at(&at).ok()?);
        let mut normals = Orthogonal::<Dim<Y>>::default();
        let mut d = Vector::<Y::Manifold>::zero();
        let mut add = |dl: &Vector<Y::Manifold>, missing: f64| {
            let sharp = g.sharp(&normals.project_covector(0, dl));
            let known = normals.len();
            normals.push(&g, dl);
            if normals.len() > known {
                d += sharp * ((missing - dl.dot(&d)) / dl.dot(&sharp));
            }
        };
        add(&w.energy, self.laws.energy - there.energy);
        for (k, (_, dl)) in w.invariants.as_ref().iter().flatten().enumerate() {
            add(dl, self.laws.invariants[k] - there.invariants[k]);
        }
        let fall = self.fall(there.entropy);
        if fall > 0.0 {
            add(&w.entropy, fall);
        }
        Some(d)
    }
}

/// The size of a displacement in these units.
fn relative<Y: Metriplectic>(d: &Vector<Y::Manifold>, units: &Vector<Y::Manifold>) -> f64 {
    (0..Vector::<Y::Manifold>::LEN).fold(0.0, |most, i| {
        let size = (d[i] / units[i]).abs();
        if size > most || size.is_nan() { size } else { most }
    })
}
