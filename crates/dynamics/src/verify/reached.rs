//! The laws of a model at one state that a run has reached.
//!
//! A model that keeps its laws around the start may break them elsewhere: behind a branch, or where a fit has no data.
//! So a run asks for them on its way. A first pass compares each law with its own terms. It evaluates each part of the
//! model once, forms no Hessian and allocates nothing.
//!
//! A run chooses its states, and ends at equilibria, where a differential may be all round-off. So a law that seems
//! broken is judged again. The round-off of a differential `F_i` is then `ε Σ_j |F_ij| ℓ_j` in units `ℓ` of the
//! coordinates. A law must also be broken at each of a few states at a distance of `10⁻⁶ ℓ`: at this
//! distance from an equilibrium the differentials have ten digits, and a model is wrong in a region.
//!
//! Derivatives are compared with values along two directions: a generic one that moves every entry, and one axis,
//! another one at each state. Where a difference of values is far from the differential, all axes are judged as at the
//! start.

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, ScalarField, Space, Square, Vector,
};
use metriplectic_manifolds::{Manifold, Riemannian};
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

use super::domain::value_not_finite;
use super::fields::compare_scalars;
use super::place::{At, Place, unusable};
use super::sampling::CoordinateScales;
use super::table::Table;
use super::{RADIUS, SAMPLES, dissipation, sums};
use crate::bracket::Bracket;
use crate::dissipation::Dissipation;
use crate::invariants::{Invariants, Kind, Visitor};
use crate::metriplectic::{Dim, Metriplectic, Point, SecondLaw};
use crate::model_error::ModelError;

/// The distance of the states at which a broken law must be broken too, relative to the size of each coordinate.
const NEAR: f64 = 1e-6;

/// The number of these states.
const NEIGHBOURS: usize = 4;

/// A seed, so that a model fails in the same way each time.
const SEED: u64 = 0x5265_6163_6865_6421;

/// Checks the laws at a state, and again around it where one seems broken.
pub(super) fn examine<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
) -> Result<(), ModelError> {
    let first = Reached { system, x, precise: None }.judge();
    if first.is_ok() { Ok(()) } else { again(system, x) }
}

/// Judges a state with the round-off of its differentials, and then states near it.
#[cold]
#[inline(never)]
fn again<Y: Metriplectic + ?Sized>(system: &Y, x: &Point<Y>) -> Result<(), ModelError> {
    let sizes = CoordinateScales::at(system, x);
    if !sizes.units.is_finite() {
        return Reached { system, x, precise: None }.values();
    }
    let judge = |x: &Point<Y>| Reached { system, x, precise: Some(&sizes.units) }.judge();
    let Err(found) = judge(x) else { return Ok(()) };
    if all_around(system, x, &sizes, |y| judge(y).is_err()) { Err(found) } else { Ok(()) }
}

/// Compares the derivatives of the scalar fields with their values at a state, and around it where one seems wrong.
pub(super) fn compare<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
) -> Result<(), ModelError> {
    let sizes = CoordinateScales::at(system, x);
    let judge = |x: &Point<Y>| {
        let (energy, entropy) = (system.energy().jet2(x), system.entropy().jet2(x));
        if !(sizes.units.is_finite() && energy.is_finite() && entropy.is_finite()) {
            return Ok(());
        }
        let place = Place { system, x, units: &sizes.units, energy, entropy };
        (0..Dim::<Y>::LEN).try_for_each(|axis| compare_scalars(&place, axis))
    };
    let Err(found) = judge(x) else { return Ok(()) };
    if all_around(system, x, &sizes, |y| judge(y).is_err()) { Err(found) } else { Ok(()) }
}

/// The displacements, relative to the sizes of the entries, over which a first look takes differences.
const ACROSS: [f64; 2] = [1e-4, 1e-7];

/// The part of a difference, relative to its terms, that is worth a closer look.
const CONTRADICTS: f64 = 1e-4;

/// The round-off of a difference of values, relative to them.
const ROUNDED: f64 = 64.0 * f64::EPSILON;

/// Compares the derivatives of the scalar fields with their values along two directions, and along each axis if they
/// contradict each other. `turn` chooses the directions.
pub(super) fn look<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
    turn: usize,
) -> Result<(), ModelError> {
    let scales = Y::Manifold::scales(x);
    // The fractional parts of the multiples of the golden ratio, between ½ and 1, with either sign.
    let generic = Vector::<Y::Manifold>::from_index(|i| {
        let turns = ((turn * Dim::<Y>::LEN + i) as f64 * GOLDEN).fract() - 0.5;
        scales[i] * (turns + 0.5_f64.copysign(turns))
    });
    let axis = turn % Dim::<Y>::LEN;
    let along = Vector::<Y::Manifold>::basis(axis) * scales[axis];
    let mut look = Look { x, directions: [&generic, &along], contradicts: false };
    look.visit(Kind::Casimir, system.energy());
    look.visit(Kind::Casimir, system.entropy());
    if Y::Invariants::COUNT > 0 {
        system.invariants().each(&mut look);
    }
    if look.contradicts { compare(system, x) } else { Ok(()) }
}

/// The golden ratio without its whole part.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// A first look at the derivatives of fields along directions.
struct Look<'a, M: Manifold> {
    x: &'a M::Point<f64>,
    directions: [&'a Vector<M>; 2],
    contradicts: bool,
}

impl<M: Manifold> Visitor<M> for Look<'_, M> {
    fn visit(&mut self, _: Kind, f: &impl ScalarField<M>) {
        if self.contradicts {
            return;
        }
        let df = f.jet1(self.x).df;
        let contradicts = |d: &Vector<M>, size: f64| {
            let [ahead, behind] = [size, -size].map(|t| f.at::<f64>(&M::chart(self.x, &(*d * t))));
            let (slope, terms) = (df.dot(d) * size, df.abs().dot(&d.abs()) * size);
            let rest = (0.5 * (ahead - behind) - slope).abs();
            // A difference that is not a number says nothing.
            rest > CONTRADICTS * terms + ROUNDED * (ahead.abs() + behind.abs()) && rest.is_finite()
        };
        self.contradicts = self
            .directions
            .into_iter()
            .any(|d| ACROSS.into_iter().all(|size| contradicts(d, size)));
    }
}

/// Looks for a broken law at a state from which a step fails, at samples around it, and at the states `ahead`.
pub(super) fn around<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
    ahead: &[Point<Y>],
) -> Result<(), ModelError> {
    let judge = |x: &Point<Y>| examine(system, x).and_then(|()| compare(system, x));
    judge(x)?;
    let has_values = |y: &Point<Y>| {
        system.manifold().defect(y).is_finite() && value_not_finite(system, y).is_none()
    };
    ahead.iter().filter(|y| has_values(y)).try_for_each(judge)?;
    let sizes = CoordinateScales::at(system, x);
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    (0..SAMPLES).try_for_each(|_| {
        let drawn = sizes.draw(x, RADIUS, &mut rng, &mut 0, has_values);
        drawn.map_or(Ok(()), |(y, _)| judge(&y))
    })
}

/// Returns whether the model is `broken` at each of a few states near `x`.
fn all_around<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
    sizes: &CoordinateScales<Y::Manifold>,
    broken: impl Fn(&Point<Y>) -> bool,
) -> bool {
    let inside = |y: &Point<Y>| {
        system.manifold().defect(y).is_finite()
            && system.energy_at(y).is_finite()
            && system.entropy_at(y).is_finite()
    };
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    (0..NEIGHBOURS).all(|_| {
        let drawn = sizes.draw(x, NEAR, &mut rng, &mut 0, inside);
        drawn.is_some_and(|(y, _)| broken(&y))
    })
}

/// A state that a run has reached.
struct Reached<'a, Y: Metriplectic + ?Sized> {
    system: &'a Y,
    x: &'a Point<Y>,
    /// The sizes of the coordinates, where the round-off of differentials counts.
    precise: Option<&'a Vector<Y::Manifold>>,
}

/// A differential and the size of its round-off.
#[derive(Clone, Copy)]
struct Covector<M: Space> {
    value: Vector<M>,
    rounding: Vector<M>,
}

impl<Y: Metriplectic + ?Sized> Reached<'_, Y> {
    fn point(&self) -> Vec<f64> {
        Y::Manifold::entries(self.x)
    }

    /// The differential of a field, which must be finite.
    fn differential(
        &self,
        field: &'static str,
        f: &impl ScalarField<Y::Manifold>,
    ) -> Result<Covector<Y::Manifold>, ModelError> {
        let jet = f.jet1(self.x);
        if !jet.value.is_finite() {
            return Err(ModelError::ValueNotFinite {
                field,
                value: jet.value,
                point: self.point(),
            });
        }
        if !jet.df.is_finite() {
            return Err(ModelError::DerivativeNotFinite { field, point: self.point() });
        }
        let zero = Vector::<Y::Manifold>::zero();
        let rounding = self.precise.map_or(zero, |units| f.jet2(self.x).hf.abs() * units.abs());
        let rounding = if rounding.is_finite() { rounding } else { zero };
        Ok(Covector { value: jet.df, rounding })
    }

    /// The differentials of energy and entropy, which must be finite.
    fn differentials(&self) -> Result<[Covector<Y::Manifold>; 2], ModelError> {
        let energy = self.differential("energy", self.system.energy())?;
        Ok([energy, self.differential("entropy", self.system.entropy())?])
    }

    /// Returns whether the differentials are finite, where nothing else can be judged.
    fn values(&self) -> Result<(), ModelError> {
        self.differentials().map(|_| ())
    }

    fn finite(&self, field: &'static str, value: f64) -> Result<(), ModelError> {
        if value.is_finite() {
            Ok(())
        } else {
            Err(ModelError::ValueNotFinite { field, value, point: self.point() })
        }
    }

    fn law(&self, size: f64, error: fn(Vec<f64>, f64) -> ModelError) -> Result<(), ModelError> {
        // A sum that is not a number has terms that overflow, and says nothing.
        if size > sums::TOLERANCE && size.is_finite() {
            Err(error(self.point(), size))
        } else {
            Ok(())
        }
    }

    /// The largest relative size of a row of `K α`, beside the round-off of `K` where it counts.
    fn annihilated(
        &self,
        k: &Matrix<Y::Manifold>,
        alpha: &Covector<Y::Manifold>,
        units: &Vector<Y::Manifold>,
    ) -> f64 {
        let size = sums::product(k, [&alpha.value, &alpha.rounding], units);
        match self.precise {
            Some(units) if size > sums::TOLERANCE => {
                let at = At { system: self.system, x: self.x, units };
                dissipation::beside_round_off(at, &Table::of(k), &alpha.value).min(size)
            }
            _ => size,
        }
    }

    /// Judges every law.
    fn judge(&self) -> Result<(), ModelError> {
        let &Self { system, x, .. } = self;
        let [energy, entropy] = self.differentials()?;
        let units = self.precise.copied().unwrap_or_else(|| sums::positive(Y::Manifold::scales(x)));
        let metric = unusable::<Y::Manifold>(x);
        let centre = ChartPoint::<Y::Manifold>::centre(x);
        system.metric().at(&centre).map_err(&metric)?;
        let g = system.metric_at(&centre);
        let (bracket, args) = (system.bracket(), system.bracket_args(&g, &entropy.value));
        let exact = system.second_law() == SecondLaw::Exact;
        let mut pi = Matrix::<Y::Manifold>::zeros();
        if !bracket.is_zero() {
            pi = bracket.tensor(&args).map_err(&metric)?;
            self.finite("bracket", pi.max_abs())?;
            self.law(sums::asymmetry(&pi, -1.0, &units), |point, size| {
                ModelError::BracketNotSkew { point, size }
            })?;
            if exact {
                let size = sums::product(&pi, [&entropy.value, &entropy.rounding], &units);
                self.law(size, |point, size| ModelError::EntropyNotCasimir { point, size })?;
            }
        }
        let mut force = Vector::<Y::Manifold>::zero();
        if bracket.is_forced() {
            force = bracket.force(&args, &energy.value).map_err(&metric)?;
            self.finite("force", force.magnitude())?;
            let size = sums::pairing([&energy.value, &energy.rounding], &force, &units).abs();
            self.law(size, |point, size| ModelError::ForceDoesWork { point, size })?;
            if exact {
                let rate = sums::pairing([&entropy.value, &entropy.rounding], &force, &units);
                self.law(-rate, |point, size| ModelError::ForceDestroysEntropy { point, size })?;
            }
        }
        let mut friction = None;
        let dissipation = system.dissipation();
        if !dissipation.is_none() {
            let k = dissipation.tensor(&g, &energy.value).map_err(&metric)?;
            self.finite("dissipation", k.max_abs())?;
            self.law(sums::asymmetry(&k, 1.0, &units), |point, size| {
                ModelError::DissipationNotSymmetric { point, size }
            })?;
            self.law(sums::indefiniteness(&k, &units), |point, size| {
                ModelError::DissipationNotPositive { point, size }
            })?;
            let size = self.annihilated(&k, &energy, &units);
            self.law(size, |point, size| ModelError::EnergyNotKept { point, size })?;
            friction = (!dissipation.adapts()).then_some(k);
        }
        if Y::Invariants::COUNT == 0 {
            return Ok(());
        }
        let mut each = Each { at: self, units, energy, pi, force, friction, outcome: Ok(()) };
        system.invariants().each(&mut each);
        each.outcome
    }
}

/// The tensors at a state, which conserve each further invariant.
struct Each<'a, 'b, Y: Metriplectic + ?Sized> {
    at: &'a Reached<'b, Y>,
    units: Vector<Y::Manifold>,
    energy: Covector<Y::Manifold>,
    pi: Matrix<Y::Manifold>,
    force: Vector<Y::Manifold>,
    /// The dissipation, if it must conserve them by itself.
    friction: Option<Matrix<Y::Manifold>>,
    outcome: Result<(), ModelError>,
}

impl<Y: Metriplectic + ?Sized> Visitor<Y::Manifold> for Each<'_, '_, Y> {
    fn visit(&mut self, kind: Kind, f: &impl ScalarField<Y::Manifold>) {
        if self.outcome.is_ok() {
            self.outcome = self.conserved(kind, f);
        }
    }
}

impl<Y: Metriplectic + ?Sized> Each<'_, '_, Y> {
    fn conserved(&self, kind: Kind, f: &impl ScalarField<Y::Manifold>) -> Result<(), ModelError> {
        let Self { at, units, energy, pi, force, friction, .. } = self;
        let dl = at.differential("invariant", f)?;
        let l = [&dl.value, &dl.rounding];
        match kind {
            Kind::Casimir => at.law(sums::product(pi, l, units), |point, size| {
                ModelError::NotCasimir { point, size }
            }),
            Kind::Momentum => {
                let h = [&energy.value, &energy.rounding];
                at.law(sums::form(pi, [l, h], units), |point, size| ModelError::NotMomentum {
                    point,
                    size,
                })
            }
        }?;
        at.law(sums::pairing(l, force, units).abs(), |point, size| {
            ModelError::ForceChangesInvariant { point, size }
        })?;
        friction.as_ref().map_or(Ok(()), |k| {
            at.law(at.annihilated(k, &dl, units), |point, size| ModelError::InvariantNotKept {
                point,
                size,
            })
        })
    }
}
