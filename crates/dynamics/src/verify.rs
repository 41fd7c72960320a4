//! The laws of a model, checked at sampled points.
//!
//! A model has a domain (a logarithm, a square root), and is only judged where it lives: away from
//! the start, a sample whose *value* is not finite is passed over. A value that is finite while a
//! derivative is not is an error wherever it happens; it is how `x.norm()` at zero shows itself.

use std::fmt;

use metriplectic_fields::{
    ChartPoint, Column, Jet2, Matrix, Real, ScalarField, Space, Square, Vector,
};
use metriplectic_manifolds::{Manifold, MetricError, PointError, Riemannian};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use crate::invariants::{Action, Invariants, Kind, Visitor};
use crate::laws::bracket_defects;
use crate::system::{Metriplectic, Point, SecondLaw, metric_matrix};
use crate::velocity::independence;
use crate::{Bracket, Dissipation};

/// Points sampled around the start, beside the start itself.
const SAMPLES: usize = 16;

/// A seed, so that a model fails in the same way each time.
const SEED: u64 = 0x4745_4e45_5249_4321;

/// The violation of a law that is taken for round-off, relative to the terms that cancel. Models
/// are written with transcendental functions of their own, so this is far above `ε` and far below
/// any mistake.
const TOLERANCE: f64 = 1e-10;

/// The radius in which a run samples its model: a tenth of the size of the start.
pub(crate) fn default_radius<M: Manifold>(x0: &M::Point<f64>) -> f64 {
    0.1 * M::magnitude(x0).max(0.1)
}

/// A law of the model, with its largest violation among the samples.
#[derive(Clone, Debug, PartialEq)]
pub struct LawResidual {
    /// The law as a formula.
    pub law: &'static str,
    /// The violation, relative to the terms that should cancel.
    pub size: f64,
    /// The violation that is taken for round-off.
    pub allowed: f64,
    /// The entries of the point where it is largest.
    pub point: Vec<f64>,
}

impl LawResidual {
    /// Whether the law holds at every sample.
    pub fn holds(&self) -> bool {
        self.size <= self.allowed
    }
}

/// The residual of every law of a model, and the first error if there is one; see
/// [`Metriplectic::report`].
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// The laws, in the order in which they are checked.
    pub laws: Vec<LawResidual>,
    /// Points at which the model was judged.
    pub judged: usize,
    /// Points passed over, because a value was not finite there.
    pub passed_over: usize,
    /// What [`Metriplectic::verify`] says.
    pub verdict: Result<(), ModelError>,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "model judged at {} points ({} passed over)", self.judged, self.passed_over)?;
        for residual in &self.laws {
            let mark = if residual.holds() { "ok    " } else { "BROKEN" };
            writeln!(
                f,
                "  {mark}  {:<22} {:9.2e}  (allowed {:.0e})",
                residual.law, residual.size, residual.allowed
            )?;
        }
        match &self.verdict {
            Ok(()) => write!(f, "verdict: the model keeps its laws"),
            Err(error) => write!(f, "verdict: {error}"),
        }
    }
}

pub(crate) fn verify<Y: Metriplectic + ?Sized>(
    system: &Y,
    x0: &Point<Y>,
    radius: f64,
) -> Result<(), ModelError> {
    report(system, x0, radius).verdict
}

pub(crate) fn report<Y: Metriplectic + ?Sized>(system: &Y, x0: &Point<Y>, radius: f64) -> Report {
    let mut report = Report { laws: Vec::new(), judged: 0, passed_over: 0, verdict: Ok(()) };
    report.verdict = examine(system, x0, radius, &mut report);
    report
}

/// Examines the start and the samples around it, and notes every law in the report.
fn examine<Y: Metriplectic + ?Sized>(
    system: &Y,
    x0: &Point<Y>,
    radius: f64,
    report: &mut Report,
) -> Result<(), ModelError> {
    system.manifold().check(x0)?;
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    if let Some(unfit) = value_not_finite(system, x0) {
        return Err(unfit);
    }
    let mut independent = vec![0.0_f64; Y::Invariants::COUNT];
    let mut widen = |x: &Point<Y>| {
        let shares = independence(system, &ChartPoint::centre(x)).unwrap_or_default();
        independent.iter_mut().zip(shares).for_each(|(most, share)| *most = most.max(share));
    };
    widen(x0);
    let mut first = examine_at(system, x0, &mut rng, report);
    for _ in 0..SAMPLES {
        let q = Vector::<Y::Manifold>::from_index(|_| radius * rng.random_range(-1.0..1.0));
        let x = Y::Manifold::chart(x0, &q);
        // Beyond an open chart's edge, where its defect is infinite, or a field's, there is no model to judge.
        let outside = !system.manifold().defect(&x).is_finite();
        if outside || value_not_finite(system, &x).is_some() {
            report.passed_over += 1;
        } else {
            widen(&x);
            first = first.and(examine_at(system, &x, &mut rng, report));
        }
    }
    first?;
    match independent.iter().position(|share| *share < DEPENDENT) {
        Some(index) => Err(ModelError::DependentInvariant { index, share: independent[index] }),
        None => Ok(()),
    }
}

/// The share of an invariant's differential that is independent of the other fields' somewhere near
/// the start, below which it is taken for a function of them.
const DEPENDENT: f64 = 1e-8;

/// A field whose value at `x` is not a finite number.
fn value_not_finite<Y: Metriplectic + ?Sized>(system: &Y, x: &Point<Y>) -> Option<ModelError> {
    let at = ChartPoint::<Y::Manifold>::centre(x);
    let ds = system.entropy().jet1(x).df;
    let bracket = system.bracket().tensor(&system.site(&at, &ds));
    let dh = system.energy().jet1(x).df;
    let dissipation = system.dissipation().tensor(system.metric(), &at, &dh);
    let values = [
        ("energy", system.energy().at::<f64>(x)),
        ("entropy", system.entropy().at::<f64>(x)),
        ("metric", metric_matrix(system, x).max_abs()),
        // A metric that cannot be used is reported as such, not as a bracket without a value.
        ("bracket", bracket.map_or(0.0, |tensor| tensor.max_abs())),
        // A derivative of the energy that is not finite is reported as such.
        (
            "dissipation",
            dissipation.map_or(0.0, |k| if dh.is_finite() { k.max_abs() } else { 0.0 }),
        ),
    ];
    let (field, value) = values.into_iter().find(|(_, value)| !value.is_finite())?;
    Some(ModelError::ValueNotFinite { field, value, point: Y::Manifold::entries(x) })
}

/// Judges the model at one point where its values are finite.
fn examine_at<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
    rng: &mut ChaCha8Rng,
    report: &mut Report,
) -> Result<(), ModelError> {
    report.judged += 1;
    let mut findings =
        Findings { point: Y::Manifold::entries(x), laws: &mut report.laws, first: None };
    let energy = jet(system.energy(), "energy", x)?;
    let entropy = jet(system.entropy(), "entropy", x)?;
    examine_metric(system, x)?;
    examine_bracket(system, x, &entropy, &mut findings)?;
    examine_dissipation(system, x, &energy, &entropy, rng, &mut findings)?;
    examine_invariants(system, x, &energy, &entropy, &mut findings)?;
    findings.first.map_or(Ok(()), Err)
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
    let point = || Y::Manifold::entries(x);
    let metric = system.metric();
    if let Some(slopes) = metric.slopes(x)
        && !slopes.as_ref().iter().all(|slope| slope.max_abs().is_finite())
    {
        return Err(ModelError::DerivativeNotFinite { field: "metric", point: point() });
    }
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let at = metric.at(&centre).and_then(|_| metric.exp(&centre, &Vector::<Y::Manifold>::zero()));
    at.map(|_| ()).map_err(|source| ModelError::Metric { source, point: point() })
}

/// `Π` is skew, satisfies the Jacobi identity, and has `S` as a Casimir.
fn examine_bracket<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
    entropy: &Jet2<Y::Manifold>,
    findings: &mut Findings<'_>,
) -> Result<(), ModelError> {
    let metric = |source| ModelError::Metric { source, point: Y::Manifold::entries(x) };
    let defects = bracket_defects(system, x).map_err(metric)?;
    if !defects.jacobi.is_finite() {
        return Err(ModelError::DerivativeNotFinite {
            field: "bracket",
            point: findings.point.clone(),
        });
    }
    let size = relative(defects.skewness, defects.size);
    findings.note("Πᵀ = −Π", size, |point| ModelError::BracketNotSkew { point, size });
    // The terms may all be round-off: then a generic product Π ∂Π sets their scale.
    let size = relative(defects.jacobi, defects.jacobi_size + defects.size);
    findings.note("Jacobi identity", size, |point| ModelError::NoJacobiIdentity { point, size });

    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let here = system.site(&centre, &entropy.df);
    let velocity = system.bracket().apply(&here, &entropy.df).map_err(metric)?;
    let size = relative(velocity.magnitude(), defects.size * entropy.df.magnitude());
    if system.second_law() == SecondLaw::Exact {
        findings.note("Π dS = 0", size, |point| ModelError::EntropyNotCasimir { point, size });
    }
    Ok(())
}

/// How far from `dH`, relative to it, another covector is that `K` has to kill.
const NEARBY: f64 = 1e-2;

/// `K` is symmetric and positive semidefinite, and kills `dH`, and whatever else it is told to kill.
fn examine_dissipation<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
    energy: &Jet2<Y::Manifold>,
    entropy: &Jet2<Y::Manifold>,
    rng: &mut ChaCha8Rng,
    findings: &mut Findings<'_>,
) -> Result<(), ModelError> {
    if system.dissipation().is_none() {
        return Ok(());
    }
    let metric = |source| ModelError::Metric { source, point: Y::Manifold::entries(x) };
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let (k, g) = (system.dissipation(), system.metric());
    let jet = k.linearise(g, x, &energy.df, &entropy.df).map_err(metric)?;
    if !(jet.along_z.max_abs() + jet.along_w.max_abs()).is_finite() {
        return Err(ModelError::DerivativeNotFinite {
            field: "dissipation",
            point: findings.point.clone(),
        });
    }
    let tensor = k.tensor(g, &centre, &energy.df).map_err(metric)?;
    let scale = tensor.max_abs();
    let transposed = Matrix::<Y::Manifold>::from_entries(|i, j| tensor[(j, i)]);
    let size = relative((tensor - transposed).max_abs(), scale);
    findings.note("Kᵀ = K", size, |point| ModelError::DissipationNotSymmetric { point, size });

    let covector = Vector::<Y::Manifold>::from_index(|_| rng.random_range(-1.0..1.0));
    let negative = [entropy.df, covector].iter().fold(0.0_f64, |worst, alpha| {
        let form = alpha.dot(&(tensor * *alpha));
        worst.max(relative((-form).max(0.0), scale * alpha.magnitude().powi(2)))
    });
    findings.note("K ⪰ 0", negative, |point| ModelError::DissipationNotPositive {
        point,
        size: negative,
    });

    let killed = tensor * energy.df;
    let size = relative(killed.magnitude(), scale * energy.df.magnitude());
    findings.note("K dH = 0", size, |point| ModelError::EnergyNotKept { point, size });
    // A step gives K a discrete gradient of H, which is near dH and not dH.
    let w = energy.df + covector * (NEARBY * energy.df.magnitude());
    let tensor = k.tensor(g, &centre, &w).map_err(metric)?;
    if tensor.max_abs().is_finite() {
        let size = relative((tensor * w).magnitude(), tensor.max_abs() * w.magnitude());
        findings.note("K_w w = 0", size, |point| ModelError::CovectorNotKilled { point, size });
    }
    Ok(())
}

/// Each further invariant has finite derivatives, is conserved for the reason it is listed for, and
/// the dissipation leaves it alone.
fn examine_invariants<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
    energy: &Jet2<Y::Manifold>,
    entropy: &Jet2<Y::Manifold>,
    findings: &mut Findings<'_>,
) -> Result<(), ModelError> {
    let mut examined =
        Invariance { system, x, energy, entropy, findings, dj: None, failed: Ok(()) };
    system.invariants().each(&mut examined);
    examined.failed
}

/// Examines the invariants, one after the other.
struct Invariance<'a, 'b, Y: Metriplectic + ?Sized> {
    system: &'a Y,
    x: &'a Point<Y>,
    energy: &'a Jet2<Y::Manifold>,
    entropy: &'a Jet2<Y::Manifold>,
    findings: &'a mut Findings<'b>,
    /// The differential of the one visited last.
    dj: Option<Vector<Y::Manifold>>,
    failed: Result<(), ModelError>,
}

impl<Y: Metriplectic + ?Sized> Visitor<Y::Manifold> for Invariance<'_, '_, Y> {
    fn visit(&mut self, kind: Kind, f: &impl ScalarField<Y::Manifold>) {
        let outcome = self.conserved(kind, f);
        self.failed = std::mem::replace(&mut self.failed, Ok(())).and(outcome);
    }

    fn acts(&mut self, action: &Action<'_, Y::Manifold>) {
        let outcome = self.symmetric(action);
        self.failed = std::mem::replace(&mut self.failed, Ok(())).and(outcome);
    }
}

impl<Y: Metriplectic + ?Sized> Invariance<'_, '_, Y> {
    fn conserved(
        &mut self,
        kind: Kind,
        f: &impl ScalarField<Y::Manifold>,
    ) -> Result<(), ModelError> {
        let Self { system, x, energy, entropy, findings, .. } = self;
        let metric = |source| ModelError::Metric { source, point: Y::Manifold::entries(x) };
        let dl = jet(f, "invariant", x)?.df;
        self.dj = Some(dl);
        let centre = ChartPoint::<Y::Manifold>::centre(x);
        let site = system.site(&centre, &entropy.df);
        let tensor = system.bracket().tensor(&site).map_err(metric)?;
        let scale = tensor.max_abs() * dl.magnitude();
        match kind {
            Kind::Casimir => {
                let size = relative((tensor * dl).magnitude(), scale);
                findings.note("Π dC = 0", size, |point| ModelError::NotCasimir { point, size });
            }
            Kind::Momentum => {
                let rate = dl.dot(&(tensor * energy.df)).abs();
                let size = relative(rate, scale * energy.df.magnitude());
                findings.note("⟨dJ, Π dH⟩ = 0", size, |point| ModelError::NotMomentum {
                    point,
                    size,
                });
            }
        }
        let k = system.dissipation();
        if !k.is_none() && !k.adapts() {
            let tensor = k.tensor(system.metric(), &centre, &energy.df).map_err(metric)?;
            let size = relative((tensor * dl).magnitude(), tensor.max_abs() * dl.magnitude());
            findings.note("K dL = 0", size, |point| ModelError::InvariantNotKept { point, size });
        }
        Ok(())
    }

    /// The action preserves the bracket and the energy, and moves points along `Π dJ`.
    fn symmetric(&mut self, action: &Action<'_, Y::Manifold>) -> Result<(), ModelError> {
        let Self { system, x, energy, entropy, findings, dj, .. } = self;
        let metric = |source| ModelError::Metric { source, point: Y::Manifold::entries(x) };
        let moved = |t: Real, q: &Vector<Y::Manifold, Real>| action(t, &Y::Manifold::chart(x, q));
        let still = Vector::<Y::Manifold, Real>::zero();
        let y = Y::Manifold::real(&moved(FAR.into(), &still));
        let size = (system.energy_at(&y) - energy.value).abs() / energy.value.abs().max(1.0);
        findings.note("H∘Φ = H", size, |point| ModelError::EnergyNotSymmetric { point, size });

        // T Π(x) Tᵀ = Π(Φ(x)) with the derivative T of the map.
        let tangent = jacobian_of::<Y>(&y, &|q| moved(FAR.into(), q));
        let tensor = |x: &Point<Y>, ds: &Vector<Y::Manifold>| {
            let centre = ChartPoint::<Y::Manifold>::centre(x);
            system.bracket().tensor(&system.site(&centre, ds)).map_err(metric)
        };
        let (here, there) = (tensor(x, &entropy.df)?, tensor(&y, &system.entropy().jet1(&y).df)?);
        let transposed = Matrix::<Y::Manifold>::from_entries(|i, j| tangent[(j, i)]);
        let off = (tangent * here * transposed - there).max_abs();
        let size = relative(off, there.max_abs() + here.max_abs());
        findings.note("Φ is Poisson", size, |point| ModelError::ActionNotPoisson { point, size });

        let Some(dj) = dj else { return Ok(()) };
        let along = moved(Real::new(0.0, 1.0, 0.0, 0.0), &still);
        let at_rest = Y::Manifold::coordinates(x, &along);
        let generator = Vector::<Y::Manifold>::from_index(|i| at_rest[i].eps1);
        let field = here * *dj;
        let start = Vector::<Y::Manifold>::from_index(|i| at_rest[i].re).magnitude();
        let off = (field - generator).magnitude() + start;
        let size = relative(off, field.magnitude() + generator.magnitude());
        findings.note("Π dJ = Φ'", size, |point| ModelError::ActionNotOfMomentum { point, size });
        Ok(())
    }
}

/// How far along an action a symmetry is tried.
const FAR: f64 = 0.7;

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

/// `size / scale`, where a law about nothing holds.
fn relative(size: f64, scale: f64) -> f64 {
    if size == 0.0 { 0.0 } else { size / scale.max(f64::MIN_POSITIVE) }
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
        let here = LawResidual { law, size, allowed: TOLERANCE, point: self.point.clone() };
        if !here.holds() && self.first.is_none() {
            self.first = Some(error(self.point.clone()));
        }
        match self.laws.iter_mut().find(|residual| residual.law == law) {
            None => self.laws.push(here),
            Some(known) if size > known.size || size.is_nan() => *known = here,
            Some(_) => {}
        }
    }
}

/// A model that breaks one of its laws. `size` is relative to the terms that should cancel.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The start is not a point of the manifold.
    #[error("the start: {0}")]
    Start(#[from] PointError),
    /// A value at the start is not a finite number.
    #[error("the {field} is {value} at {point:?}; start where the model is defined")]
    ValueNotFinite {
        /// Which part of the model.
        field: &'static str,
        /// Its value there.
        value: f64,
        /// The entries of the point.
        point: Vec<f64>,
    },
    /// A value is finite, but a derivative is not.
    #[error(
        "the {field} has a finite value but a derivative that is not finite at {point:?}; a square \
         root or a norm at zero does this: write `norm_squared()`, or keep the start away from it"
    )]
    DerivativeNotFinite {
        /// Which part of the model.
        field: &'static str,
        /// The entries of the point.
        point: Vec<f64>,
    },
    /// The metric cannot be used.
    #[error("at {point:?}: {source}")]
    Metric {
        /// What is wrong with it.
        source: MetricError,
        /// The entries of the point.
        point: Vec<f64>,
    },
    /// `Π` is not skew.
    #[error(
        "the bracket is not skew at {point:?}: Π + Πᵀ is {size:.1e} of Π; energy would not be kept"
    )]
    BracketNotSkew {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// `Π` breaks the Jacobi identity.
    #[error("the bracket breaks the Jacobi identity at {point:?} by {size:.1e} of its terms")]
    NoJacobiIdentity {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// `Π dS ≠ 0`.
    #[error(
        "the entropy is not a Casimir of the bracket at {point:?}: Π dS is {size:.1e} of |Π||dS|; \
         use a Casimir, give S a factor of its own, or ask for `SecondLaw::Published`"
    )]
    EntropyNotCasimir {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// A function listed as a Casimir is none.
    #[error(
        "an invariant listed as a Casimir is not one at {point:?}: Π dC is {size:.1e} of |Π||dC|; if it \
         is conserved because the energy is symmetric, list it by `.momentum(..)`"
    )]
    NotCasimir {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// A function listed as a momentum is not conserved.
    #[error(
        "an invariant listed as a momentum is not conserved at {point:?}: ⟨dJ, Π dH⟩ is {size:.1e} of \
         |dJ||Π||dH|"
    )]
    NotMomentum {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// The dissipation changes a further invariant.
    #[error(
        "the dissipation changes an invariant at {point:?}: K dL is {size:.1e} of |K||dL|; use a \
         dissipation that kills it, or that of the metric, which is projected"
    )]
    InvariantNotKept {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// A further invariant is a function of the other fields.
    #[error(
        "invariant {index} depends on the other fields around the start: only {share:.1e} of its \
         differential is independent of theirs; leave it out of the list"
    )]
    DependentInvariant {
        /// Which one, in the order of the list, counted from 0.
        index: usize,
        /// The share of its differential that is independent.
        share: f64,
    },
    /// An action changes the energy.
    #[error(
        "the action is no symmetry of the energy at {point:?}: it changes by {size:.1e} of itself"
    )]
    EnergyNotSymmetric {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// An action changes the bracket.
    #[error(
        "the action does not preserve the bracket at {point:?}: it changes Π by {size:.1e} of it, so \
         it is no Poisson map"
    )]
    ActionNotPoisson {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// An action and its momentum map do not belong together.
    #[error(
        "the action does not belong to its momentum map at {point:?}: dΦ_t/dt at t = 0 and Π dJ \
         differ by {size:.1e} of their size; check the sign, and that Φ_0(x) = x"
    )]
    ActionNotOfMomentum {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// `K` is not symmetric.
    #[error("the dissipation is not symmetric at {point:?}: K − Kᵀ is {size:.1e} of K")]
    DissipationNotSymmetric {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// `K` is not positive semidefinite.
    #[error(
        "the dissipation destroys entropy at {point:?}: K has the negative value {size:.1e} of |K|"
    )]
    DissipationNotPositive {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// `K dH ≠ 0`.
    #[error(
        "the dissipation does not keep the energy at {point:?}: K dH is {size:.1e} of |K||dH|; build \
         K from the covector w that it is told to kill, or ask for `ProjectedDissipation`"
    )]
    EnergyNotKept {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// `K_w w ≠ 0` for a covector near `dH`.
    #[error(
        "the dissipation kills dH at {point:?}, but not the covector w near it that it is told to \
         kill: K_w w is {size:.1e} of |K||w|; build K from w and not from dH(x), or ask for \
         `ProjectedDissipation`"
    )]
    CovectorNotKilled {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
}

/// The sentence of the `Display` form, which is what a `main` that returns the error prints.
impl fmt::Debug for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}
