//! The laws of a model, checked at the start and at sampled points around it.
//!
//! Nothing here has a scale. A point is sampled within a tenth of the size of each coordinate, and a law
//! is judged row by row relative to the terms that should cancel in it (the module `balance`), so that a
//! model in other units gets the same verdict with the same residuals.
//!
//! A model has a domain (a logarithm, a square root), and is only judged where it lives: a sample at which
//! a *value* is not finite is drawn again, nearer to the start. A value that is finite while a derivative
//! is not is an error wherever it happens; it is how `x.norm()` at zero shows itself.

pub(crate) mod balance;
mod derivatives;
mod fields;
mod force;
mod invariants;
pub(crate) mod sampling;

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Jet2, ScalarField, Space, Square, Vector, differential_at,
};
use metriplectic_manifolds::{InnerProduct, Manifold, MetricError, Riemannian};
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

use self::balance::{Balance, ROUNDING, TOLERANCE};
use self::sampling::Sizes;
use crate::invariants::Invariants;
use crate::laws::bracket_defects;
use crate::report::{LawResidual, Report};
use crate::system::{Metriplectic, Point, SecondLaw, metric_matrix};
use crate::velocity::independence;
use crate::{Bracket, Dissipation, ModelError};

/// Points sampled around the start, beside the start itself.
const SAMPLES: usize = 16;

/// The least number of points at which a model has to have values, out of 17.
const ENOUGH: usize = 12;

/// A seed, so that a model fails in the same way each time.
const SEED: u64 = 0x4745_4e45_5249_4321;

/// How far from the start a run samples its model, relative to the size of each coordinate.
pub(crate) const RADIUS: f64 = 0.1;

pub(crate) fn report<Y: Metriplectic + ?Sized>(system: &Y, x0: &Point<Y>, radius: f64) -> Report {
    let mut report = Report::new();
    report.verdict = examine(system, x0, radius, &mut report);
    report
}

/// Judges the model at one point alone, where its values have to be finite.
pub(crate) fn at_one_point<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
) -> Result<(), ModelError> {
    system.manifold().check(x)?;
    value_not_finite(system, x).map_or(Ok(()), Err)?;
    let mut report = Report::new();
    Examination::around(system, x, RADIUS).at(x, std::iter::empty(), &mut report)
}

/// Examines the start and the samples around it, and notes every law in the report.
fn examine<Y: Metriplectic + ?Sized>(
    system: &Y,
    x0: &Point<Y>,
    radius: f64,
    report: &mut Report,
) -> Result<(), ModelError> {
    system.manifold().check(x0)?;
    value_not_finite(system, x0).map_or(Ok(()), Err)?;
    has_digits(system.energy(), "energy", x0)?;
    has_digits(system.entropy(), "entropy", x0)?;
    let mut independent = vec![0.0_f64; Y::Invariants::COUNT];
    let mut widen = |x: &Point<Y>| {
        let fractions = independence(system, &ChartPoint::centre(x)).unwrap_or_default();
        independent
            .iter_mut()
            .zip(fractions)
            .for_each(|(most, fraction)| *most = most.max(fraction));
    };
    let mut examination = Examination::around(system, x0, radius);
    let n = Dim::<Y>::LEN;
    widen(x0);
    let mut first = examination.at(x0, 0..n, report);
    for sample in 0..SAMPLES {
        let Some(x) = examination.sample(x0, report) else { continue };
        widen(&x);
        // Over the samples each axis comes up at least twice.
        let each = n.div_ceil(SAMPLES / 2);
        let axes = (sample * each..(sample + 1) * each).map(|axis| axis % n);
        first = first.and(examination.at(&x, axes, report));
    }
    first?;
    if report.judged < ENOUGH {
        let (judged, wanted) = (report.judged, SAMPLES + 1);
        return Err(ModelError::TooFewPoints { judged, wanted, point: Y::Manifold::entries(x0) });
    }
    match independent.iter().position(|fraction| *fraction < DEPENDENT) {
        Some(index) => Err(ModelError::DependentInvariant { index, fraction: independent[index] }),
        None => Ok(()),
    }
}

/// The fraction of an invariant's differential that is independent of the other fields' somewhere near
/// the start, below which it is taken for a function of them.
const DEPENDENT: f64 = 1e-8;

/// The dimension of the manifold of a system.
type Dim<Y> = <<Y as Metriplectic>::Manifold as Space>::Dim;

/// A field whose value at `x` is not a finite number.
fn value_not_finite<Y: Metriplectic + ?Sized>(system: &Y, x: &Point<Y>) -> Option<ModelError> {
    let at = ChartPoint::<Y::Manifold>::centre(x);
    let ds = system.entropy().jet1(x).df;
    let bracket = system.bracket().tensor(&system.bracket_args(&at, &ds));
    let dh = system.energy().jet1(x).df;
    let force = system.bracket().force(&system.bracket_args(&at, &ds), &dh);
    let dissipation = system.dissipation().tensor(system.metric(), &at, &dh);
    let values = [
        ("energy", system.energy().at::<f64>(x)),
        ("entropy", system.entropy().at::<f64>(x)),
        ("metric", metric_matrix(system, x).max_abs()),
        // A metric that cannot be used is reported as such, not as a bracket without a value.
        ("bracket", bracket.map_or(0.0, |tensor| tensor.max_abs())),
        // A derivative of the energy that is not finite is reported as such.
        ("force", force.map_or(0.0, |f| if dh.is_finite() { f.magnitude() } else { 0.0 })),
        (
            "dissipation",
            dissipation.map_or(0.0, |k| if dh.is_finite() { k.max_abs() } else { 0.0 }),
        ),
    ];
    let (field, value) = values.into_iter().find(|(_, value)| !value.is_finite())?;
    Some(ModelError::ValueNotFinite { field, value, point: Y::Manifold::entries(x) })
}

/// The terms of a field at the start are zero, or their last digits are numbers.
fn has_digits<M: Manifold>(
    f: &impl ScalarField<M>,
    field: &'static str,
    x0: &M::Point<f64>,
) -> Result<(), ModelError> {
    let jet = f.jet1(x0);
    let size = jet.value.abs() + jet.df.abs().dot(&M::scales(x0));
    if size > 0.0 && size * f64::EPSILON < f64::MIN_POSITIVE {
        return Err(ModelError::Underflow { field, size, point: M::entries(x0) });
    }
    Ok(())
}

/// An examination of a model around a start.
struct Examination<'a, Y: Metriplectic + ?Sized> {
    system: &'a Y,
    /// The sizes of the coordinates at the start.
    sizes: Sizes<Y::Manifold>,
    /// How far points are drawn from it, relative to these.
    radius: f64,
    rng: ChaCha8Rng,
}

impl<'a, Y: Metriplectic + ?Sized> Examination<'a, Y> {
    fn around(system: &'a Y, x0: &Point<Y>, radius: f64) -> Self {
        let rng = ChaCha8Rng::seed_from_u64(SEED);
        Self { system, sizes: Sizes::at(system, x0), radius, rng }
    }

    /// A point around the start at which the model has values.
    fn sample(&mut self, x0: &Point<Y>, report: &mut Report) -> Option<Point<Y>> {
        let Self { system, sizes, radius, rng } = self;
        // Beyond an open chart's edge, where its defect is infinite, or a field's, there is no model to judge.
        let inside = |x: &Point<Y>| {
            system.manifold().defect(x).is_finite() && value_not_finite(*system, x).is_none()
        };
        let (x, _) = sizes.draw(x0, *radius, rng, &mut report.passed_over, inside)?;
        Some(x)
    }

    /// Judges the model at a point: its derivatives along the `axes`, and every law.
    fn at(
        &mut self,
        x: &Point<Y>,
        axes: impl Iterator<Item = usize> + Clone,
        report: &mut Report,
    ) -> Result<(), ModelError> {
        report.judged += 1;
        let system = self.system;
        let energy = jet(system.energy(), "energy", x)?;
        let entropy = jet(system.entropy(), "entropy", x)?;
        examine_metric(system, x)?;
        let w = self.discrete_gradient(x, &energy);
        let place = Place { system, x, units: &self.sizes.units, energy, entropy };
        // A lost derivative breaks other laws too, and is their cause.
        let compared = axes.clone().try_for_each(|axis| fields::compare(&place, axis));
        let mut findings =
            Findings { point: Y::Manifold::entries(x), laws: &mut report.laws, first: None };
        examine_bracket(&place, &mut findings)?;
        force::examine(&place, w.as_ref(), &mut findings)?;
        examine_dissipation(&place, w.as_ref(), &mut findings)?;
        invariants::examine(&place, &mut findings)?;
        compared?;
        findings.first.map_or(Ok(()), Err)?;
        axes.clone().try_for_each(|axis| fields::compare_dissipation(&place, axis))
    }

    /// A discrete gradient of the energy between `x` and a point near it, in the chart at `x`: the mean of
    /// the two differentials with Gonzalez' correction,
    ///
    /// ```math
    /// w = \bar w + \frac{H(y) - H(x) - \langle \bar w, d \rangle}{G(d, d)}\, ♭d, \qquad
    /// \bar w = \tfrac12 (dH(x) + dH(y)), \qquad y = \varphi_x(d) .
    /// ```
    ///
    /// It differs from `dH(x)` unless `H` is linear, of which every discrete gradient is `dH`. `None` if the
    /// energy has no value nearby.
    fn discrete_gradient(
        &mut self,
        x: &Point<Y>,
        energy: &Jet2<Y::Manifold>,
    ) -> Option<Vector<Y::Manifold>> {
        let Self { system, sizes, radius, rng } = self;
        let inside = |y: &Point<Y>| {
            system.manifold().defect(y).is_finite() && system.energy_at(y).is_finite()
        };
        let (y, d) = sizes.draw(x, *radius, rng, &mut 0, inside)?;
        let mean = (energy.df + differential_at(system.energy(), x, &d)) * 0.5;
        let end = system.energy_at(&y);
        let along: Balance = (0..Dim::<Y>::LEN).map(|i| -mean[i] * d[i]).collect();
        let defect = end - energy.value + along.sum();
        // The correction of a linear energy is the rounding of its values.
        let rounding = 64.0 * f64::EPSILON * (end.abs() + energy.value.abs() + along.terms());
        if defect.abs() <= rounding {
            return Some(mean);
        }
        let flat = system.metric().at(&ChartPoint::centre(x)).ok()?.flat(&d);
        let w = mean + flat * (defect / flat.dot(&d));
        Some(if w.is_finite() { w } else { mean })
    }
}

/// A point at which laws are judged, with the differentials of the two fields there.
struct Place<'a, Y: Metriplectic + ?Sized> {
    system: &'a Y,
    x: &'a Point<Y>,
    /// The sizes of the coordinates.
    units: &'a Vector<Y::Manifold>,
    energy: Jet2<Y::Manifold>,
    entropy: Jet2<Y::Manifold>,
}

/// The error of a metric that cannot be used at `x`.
fn unusable<M: Manifold>(x: &M::Point<f64>) -> impl Fn(MetricError) -> ModelError + '_ {
    |source| ModelError::Metric { source, point: M::entries(x) }
}

/// Value, differential and Hessian, all finite.
fn jet<M: Manifold>(
    f: &impl ScalarField<M>,
    field: &'static str,
    x: &M::Point<f64>,
) -> Result<Jet2<M>, ModelError> {
    let jet = f.jet2(x);
    if jet.is_finite() {
        Ok(jet)
    } else {
        Err(ModelError::DerivativeNotFinite { field, point: M::entries(x) })
    }
}

/// The metric can be factored, differentiated, and followed along a geodesic.
fn examine_metric<Y: Metriplectic + ?Sized>(system: &Y, x: &Point<Y>) -> Result<(), ModelError> {
    let metric = system.metric();
    if let Some(slopes) = metric.slopes(x)
        && !slopes.as_ref().iter().all(|slope| slope.max_abs().is_finite())
    {
        let point = Y::Manifold::entries(x);
        return Err(ModelError::DerivativeNotFinite { field: "metric", point });
    }
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let at = metric.at(&centre).and_then(|_| metric.exp(&centre, &Vector::<Y::Manifold>::zero()));
    at.map(|_| ()).map_err(unusable::<Y::Manifold>(x))
}

/// `Π` is skew, satisfies the Jacobi identity, and has `S` as a Casimir.
fn examine_bracket<Y: Metriplectic + ?Sized>(
    place: &Place<'_, Y>,
    findings: &mut Findings<'_>,
) -> Result<(), ModelError> {
    let &Place { system, x, units, ref entropy, .. } = place;
    let defects = bracket_defects(system, x, units, ROUNDING);
    let defects = defects.map_err(unusable::<Y::Manifold>(x))?;
    if !defects.is_finite {
        let point = findings.point.clone();
        return Err(ModelError::DerivativeNotFinite { field: "bracket", point });
    }
    let size = defects.skewness.relative();
    findings.note("Πᵀ = −Π", size, |point| ModelError::BracketNotSkew { point, size });
    let size = defects.jacobi.relative();
    if system.bracket().is_poisson() {
        findings
            .note("Jacobi identity", size, |point| ModelError::NoJacobiIdentity { point, size });
    } else {
        findings.record("Jacobi identity", size, f64::INFINITY);
    }
    if system.second_law() == SecondLaw::Exact {
        let size = balance::product::<Y::Manifold>(&defects.tensor, &entropy.df, units);
        findings.note("Π dS = 0", size, |point| ModelError::EntropyNotCasimir { point, size });
    }
    Ok(())
}

/// `K` is symmetric and positive semidefinite, and annihilates `dH`, and the discrete gradient `w` in its
/// place.
fn examine_dissipation<Y: Metriplectic + ?Sized>(
    place: &Place<'_, Y>,
    w: Option<&Vector<Y::Manifold>>,
    findings: &mut Findings<'_>,
) -> Result<(), ModelError> {
    let &Place { system, x, units, ref energy, ref entropy } = place;
    if system.dissipation().is_none() {
        return Ok(());
    }
    let metric = unusable::<Y::Manifold>(x);
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let (k, g) = (system.dissipation(), system.metric());
    let jet = k.linearise(g, x, &energy.df, &entropy.df).map_err(&metric)?;
    if !(jet.along_z.max_abs() + jet.along_w.max_abs()).is_finite() {
        let point = findings.point.clone();
        return Err(ModelError::DerivativeNotFinite { field: "dissipation", point });
    }
    let tensor = k.tensor(g, &centre, &energy.df).map_err(&metric)?;
    let size = balance::asymmetry::<Y::Manifold>(&tensor, 1.0, units, ROUNDING).relative();
    findings.note("Kᵀ = K", size, |point| ModelError::DissipationNotSymmetric { point, size });
    let size = balance::indefiniteness::<Y::Manifold>(&tensor, units);
    findings.note("K ⪰ 0", size, |point| ModelError::DissipationNotPositive { point, size });
    let size = balance::product::<Y::Manifold>(&tensor, &energy.df, units);
    findings.note("K dH = 0", size, |point| ModelError::EnergyNotKept { point, size });
    if let Some(w) = w {
        let tensor = k.tensor(g, &centre, w).map_err(&metric)?;
        if tensor.max_abs().is_finite() {
            let size = balance::product::<Y::Manifold>(&tensor, w, units);
            findings.note("K_w w = 0", size, |point| ModelError::CovectorNotAnnihilated {
                point,
                size,
            });
        }
    }
    Ok(())
}

/// What is found at one point: the laws' residuals and the first error.
struct Findings<'a> {
    point: Vec<f64>,
    laws: &'a mut Vec<LawResidual>,
    first: Option<ModelError>,
}

impl Findings<'_> {
    /// Notes the violation of a law here, and keeps the worst of all points.
    fn note(&mut self, law: &'static str, size: f64, error: impl FnOnce(Vec<f64>) -> ModelError) {
        if !self.record(law, size, TOLERANCE) && self.first.is_none() {
            let point = self.point.clone();
            // All values of the model are finite here, so it is their products that are not.
            self.first = Some(if size.is_finite() {
                error(point)
            } else {
                ModelError::Overflow { law, point }
            });
        }
    }

    /// Records the violation of a law here among the worst of all points, and returns whether it is
    /// allowed.
    fn record(&mut self, law: &'static str, size: f64, allowed: f64) -> bool {
        let known = self.laws.iter_mut().find(|residual| residual.law == law);
        if known.as_ref().is_none_or(|known| size > known.size || size.is_nan()) {
            let here = LawResidual { law, size, allowed, point: self.point.clone() };
            match known {
                None => self.laws.push(here),
                Some(known) => *known = here,
            }
        }
        size <= allowed
    }
}
