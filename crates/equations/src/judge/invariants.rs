//! The laws of further invariants and of symmetries.

use super::at::Place;
use super::balance::{self, Balance, TOLERANCE, worse};
use super::dissipation;
use super::findings::Findings;
use super::sampling;
use super::table::{Row, Table, pairs, zeros};
use crate::{Covectors, ENERGY, ENTROPY, Kind, ModelError, Part};

/// Checks that each further invariant has finite derivatives, is conserved by the bracket as its kind says, and
/// is conserved by the dissipation.
pub(super) fn examine(place: &Place<'_>, findings: &mut Findings<'_>) -> Result<(), ModelError> {
    let mut failed = Ok(());
    for law in place.at.invariants() {
        let mut examined = Invariance { place, findings: &mut *findings, law };
        let outcome = examined.conserved().and_then(|dj| examined.symmetric(&dj));
        failed = failed.and(outcome);
    }
    failed
}

/// Examines one invariant.
struct Invariance<'a, 'b, 'c> {
    place: &'a Place<'b>,
    findings: &'a mut Findings<'c>,
    /// Its number among the laws.
    law: usize,
}

impl Invariance<'_, '_, '_> {
    /// Its number among the further invariants.
    const fn index(&self) -> usize {
        self.law - ENTROPY - 1
    }

    /// Checks that it is conserved, and returns its differential.
    fn conserved(&mut self) -> Result<Row, ModelError> {
        let &Place { at, units, ref energy, .. } = self.place;
        let dl = at.finite_jet2(self.law)?.df;
        let kind = at.model.kind(self.index());
        let findings = &mut *self.findings;
        let here = self.place.differentials();
        let tensor = |part| at.tensor(part, here).map_err(|source| at.unusable(source));
        let bracket = tensor(Part::Reversible)?;
        match kind {
            Kind::Casimir => {
                let size = balance::product(&bracket, &dl, units);
                findings
                    .note("Π dC = 0", size, |point, size| ModelError::NotCasimir { point, size });
            }
            Kind::Momentum => {
                let size = balance::form(&bracket, &dl, &energy.df, units);
                let error = |point, size| ModelError::NotMomentum { point, size };
                findings.note("⟨dJ, Π dH⟩ = 0", size, error);
            }
        }
        if !at.model.is_zero(Part::Gyroscopic) {
            let force = at.linearise(Part::Gyroscopic, here, &energy.df);
            let force = force.map_err(|source| at.unusable(source))?;
            let size = balance::pairing(&dl, &force.value, units);
            let error = |point, size| ModelError::ForceChangesInvariant { point, size };
            findings.note("⟨dL, force⟩ = 0", size, error);
        }
        if !at.model.is_zero(Part::Irreversible) && !at.model.adapts() {
            let size = dissipation::annihilated(self.place, &tensor(Part::Irreversible)?, &dl);
            let error = |point, size| ModelError::InvariantNotKept { point, size };
            findings.note("K dL = 0", size, error);
        }
        Ok(dl)
    }

    /// Checks that the action of a symmetry preserves the bracket and the energy, and moves states along `Π dJ`.
    fn symmetric(&mut self, dj: &[f64]) -> Result<(), ModelError> {
        let (index, &Place { at, units, ref energy, .. }) = (self.index(), self.place);
        let n = units.len();
        let (mut generator, mut at_rest) = (zeros(n), zeros(n));
        if !at.model.generator(index, at.x, &mut generator, &mut at_rest) {
            return Ok(());
        }
        let findings = &mut *self.findings;
        // The parameter has a unit of its own: a length, an angle.
        let moves = generator.iter().zip(units).map(|(v, unit)| (v / unit).abs());
        let rate = moves.fold(0.0, f64::max);
        let far = if rate > 0.0 { FAR / rate } else { FAR };
        let (mut y, mut tangent) = (zeros(at.x.len()), Table::zeros(n));
        at.model.action(index, at.x, far, &mut y, tangent.entries_mut());

        let moved = at.moved_to(&y);
        let there = moved.jet2(ENERGY);
        let change: Balance = [there.value, -energy.value].into_iter().collect();
        let size = sampling::terms(energy, units) + sampling::terms(&there, units);
        let size = change.sum().abs() / (size + ROUNDED * change.terms());
        let size = if change.sum() == 0.0 { 0.0 } else { size };
        let error = |point, size| ModelError::EnergyNotSymmetric { point, size };
        findings.note("H∘Φ = H", size, error);

        // T Π(x) Tᵀ = Π(Φ(x)) with the derivative T of the map.
        let here = at.tensor(Part::Reversible, self.place.differentials());
        let here = here.map_err(|source| at.unusable(source))?;
        let (_, entropy) = moved.jet(ENTROPY);
        let w = Covectors { energy: &there.df, entropy: &entropy };
        let there = moved.tensor(Part::Reversible, w).map_err(|source| moved.unusable(source))?;
        let size = push_forward(&tangent, &here, &there, units);
        let error = |point, size| ModelError::ActionNotPoisson { point, size };
        findings.note("Φ is Poisson", size, error);

        let moved = at_rest.iter().zip(units).map(|(q, unit)| (q / unit).abs());
        let size = moved.fold(flow_of(&here, dj, &generator, units), worse);
        let error = |point, size| ModelError::ActionNotOfMomentum { point, size };
        findings.note("Π dJ = Φ'", size, error);
        Ok(())
    }
}

/// The largest relative difference of `T Π(x) Tᵀ`, pushed from `here`, and the tensor `there`.
fn push_forward(tangent: &Table, here: &Table, there: &Table, units: &[f64]) -> f64 {
    let n = units.len();
    let top = balance::largest(here, units).max(balance::largest(there, units));
    let violation = |(i, j): (usize, usize)| {
        let pushed = pairs(n).map(|(k, l)| tangent[(i, k)] * here[(k, l)] * tangent[(j, l)]);
        let balance: Balance = pushed.chain([-there[(i, j)]]).collect();
        balance.relative(top * units[i] * units[j])
    };
    pairs(n).map(violation).fold(0.0, worse)
}

/// The largest relative difference of a row of `Π dJ` and the generator of an action.
fn flow_of(tensor: &Table, dj: &[f64], generator: &[f64], units: &[f64]) -> f64 {
    let n = units.len();
    let largest = pairs(n).map(|(i, j)| (tensor[(i, j)] * dj[j] / units[i]).abs());
    let largest = largest.fold(0.0, f64::max);
    let violation = |i: usize| {
        let terms = (0..n).map(|j| tensor[(i, j)] * dj[j]);
        let balance: Balance = terms.chain([-generator[i]]).collect();
        balance.relative(units[i] * largest)
    };
    (0..n).map(violation).fold(0.0, worse)
}

/// How far along its action a symmetry is tested, relative to the sizes of the coordinates.
const FAR: f64 = 0.7;

/// The rounding of the values of an energy, in units of the tolerance.
const ROUNDED: f64 = 64.0 * f64::EPSILON / TOLERANCE;
