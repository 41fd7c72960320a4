//! The laws of further invariants and of symmetries.

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, Real, ScalarField, Space, Square, Vector,
};

use super::balance::{self, Balance, TOLERANCE, worse};
use super::dissipation;
use super::findings::Findings;
use super::place::{Place, jet, unusable};
use super::sampling;
use super::table::{Table, components, pairs};
use crate::bracket::Bracket;
use crate::dissipation::Dissipation;
use crate::invariants::{Action, Invariants, Kind, Visitor};
use crate::metriplectic::{Dim, Metriplectic, Point};
use crate::model_error::ModelError;

/// Checks that each further invariant has finite derivatives, is conserved by the bracket as its kind says, and
/// is conserved by the dissipation.
pub(super) fn examine<Y: Metriplectic + ?Sized>(
    place: &Place<'_, Y>,
    findings: &mut Findings<'_>,
) -> Result<(), ModelError> {
    let mut examined = Invariance { place, findings, dj: None, failed: Ok(()) };
    place.system.invariants().each(&mut examined);
    examined.failed
}

/// Examines the invariants, one after the other.
struct Invariance<'a, 'b, 'c, Y: Metriplectic + ?Sized> {
    place: &'a Place<'b, Y>,
    findings: &'a mut Findings<'c>,
    /// The differential of the invariant visited last.
    dj: Option<Vector<Y::Manifold>>,
    failed: Result<(), ModelError>,
}

impl<Y: Metriplectic + ?Sized> Visitor<Y::Manifold> for Invariance<'_, '_, '_, Y> {
    fn visit(&mut self, kind: Kind, f: &impl ScalarField<Y::Manifold>) {
        let outcome = self.conserved(kind, f);
        self.failed = std::mem::replace(&mut self.failed, Ok(())).and(outcome);
    }

    fn acts(&mut self, action: &Action<'_, Y::Manifold>) {
        let outcome = self.symmetric(action);
        self.failed = std::mem::replace(&mut self.failed, Ok(())).and(outcome);
    }
}

impl<Y: Metriplectic + ?Sized> Invariance<'_, '_, '_, Y> {
    fn conserved(
        &mut self,
        kind: Kind,
        f: &impl ScalarField<Y::Manifold>,
    ) -> Result<(), ModelError> {
        let &Place { system, x, units, ref energy, ref entropy } = self.place;
        let findings = &mut *self.findings;
        let dl = jet(f, "invariant", x)?.df;
        self.dj = Some(dl);
        let centre = ChartPoint::<Y::Manifold>::centre(x);
        let g = system.metric_at(&centre);
        let args = system.bracket_args(&g, &entropy.df);
        let tensor = system.bracket().tensor(&args).map_err(unusable::<Y::Manifold>(x))?;
        let (tensor, sizes, entries) = (Table::of(&tensor), components(units), components(&dl));
        match kind {
            Kind::Casimir => {
                let size = balance::product(&tensor, &entries, &sizes);
                findings
                    .note("Π dC = 0", size, |point, size| ModelError::NotCasimir { point, size });
            }
            Kind::Momentum => {
                let size = balance::form(&tensor, &entries, &components(&energy.df), &sizes);
                let error = |point, size| ModelError::NotMomentum { point, size };
                findings.note("⟨dJ, Π dH⟩ = 0", size, error);
            }
        }
        if system.bracket().is_forced() {
            let force = system.bracket().linearise_force(&args, &energy.df);
            let force = force.map_err(unusable::<Y::Manifold>(x))?;
            let size = balance::pairing(&entries, &components(&force.value), &sizes);
            let error = |point, size| ModelError::ForceChangesInvariant { point, size };
            findings.note("⟨dL, force⟩ = 0", size, error);
        }
        let k = system.dissipation();
        if !k.is_none() && !k.adapts() {
            let tensor = k.tensor(&g, &energy.df);
            let tensor = tensor.map_err(unusable::<Y::Manifold>(x))?;
            let size = dissipation::annihilated(self.place, &Table::of(&tensor), &dl);
            let error = |point, size| ModelError::InvariantNotKept { point, size };
            findings.note("K dL = 0", size, error);
        }
        Ok(())
    }

    /// Checks that the action preserves the bracket and the energy, and moves points along `Π dJ`.
    fn symmetric(&mut self, action: &Action<'_, Y::Manifold>) -> Result<(), ModelError> {
        let &Place { system, x, units, ref energy, ref entropy } = self.place;
        let (findings, n) = (&mut *self.findings, Dim::<Y>::LEN);
        let moved = |t: Real, q: &Vector<Y::Manifold, Real>| action(t, &Y::Manifold::chart(x, q));
        let still = Vector::<Y::Manifold, Real>::zero();
        let along = moved(Real::new(0.0, 1.0, 0.0, 0.0), &still);
        let at_rest = Y::Manifold::coordinates(x, &along);
        let generator = Vector::<Y::Manifold>::from_index(|i| at_rest[i].eps1);
        // The parameter has a unit of its own: a length, an angle.
        let rate = (0..n).map(|i| (generator[i] / units[i]).abs()).fold(0.0, f64::max);
        let far = Real::from(if rate > 0.0 { FAR / rate } else { FAR });

        let y = Y::Manifold::real(&moved(far, &still));
        let there = system.energy().jet2(&y);
        let change: Balance = [there.value, -energy.value].into_iter().collect();
        let size = sampling::terms(energy, units) + sampling::terms(&there, units);
        let size = change.sum().abs() / (size + ROUNDED * change.terms());
        let size = if change.sum() == 0.0 { 0.0 } else { size };
        let error = |point, size| ModelError::EnergyNotSymmetric { point, size };
        findings.note("H∘Φ = H", size, error);

        // T Π(x) Tᵀ = Π(Φ(x)) with the derivative T of the map.
        let tangent = jacobian_of::<Y>(&y, &|q| moved(far, q));
        let tensor = |x: &Point<Y>, ds: &Vector<Y::Manifold>| {
            let centre = ChartPoint::<Y::Manifold>::centre(x);
            let g = system.metric_at(&centre);
            let tensor = system.bracket().tensor(&system.bracket_args(&g, ds));
            tensor.map_err(unusable::<Y::Manifold>(x))
        };
        let here = Table::of(&tensor(x, &entropy.df)?);
        let there = Table::of(&tensor(&y, &system.entropy().jet1(&y).df)?);
        let sizes = components(units);
        let size = push_forward(&Table::of(&tangent), &here, &there, &sizes);
        let error = |point, size| ModelError::ActionNotPoisson { point, size };
        findings.note("Φ is Poisson", size, error);

        let Some(dj) = &self.dj else { return Ok(()) };
        let (generator, at_rest) =
            (components(&generator), (0..n).map(|i| at_rest[i].re).collect::<Vec<_>>());
        let moved = at_rest.iter().zip(&sizes).map(|(q, unit)| (q / unit).abs());
        let size = moved.fold(flow_of(&here, &components(dj), &generator, &sizes), worse);
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

/// A map from the coordinates of a chart to points.
type ChartMap<'a, M> = dyn Fn(&Vector<M, Real>) -> <M as Space>::Point<Real> + 'a;

/// The derivative of a map from the chart at some point to the chart at `y`.
fn jacobian_of<Y: Metriplectic + ?Sized>(
    y: &Point<Y>,
    map: &ChartMap<'_, Y::Manifold>,
) -> Matrix<Y::Manifold> {
    Matrix::<Y::Manifold>::from_columns(|k| {
        let seed = |i| Real::new(0.0, if i == k { 1.0 } else { 0.0 }, 0.0, 0.0);
        let moved =
            Y::Manifold::coordinates(y, &map(&Vector::<Y::Manifold, Real>::from_index(seed)));
        Vector::<Y::Manifold>::from_index(|i| moved[i].eps1)
    })
}
