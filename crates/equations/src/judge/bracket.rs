//! The laws of the bracket.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use super::at::{At, Jet2, Place};
use super::balance::{self, Balance, ROUNDING, Violation, asymmetry, largest, worse};
use super::findings::Findings;
use super::table::{Row, Table, zeros};
use crate::{Covectors, ENERGY, MetricError, ModelError, Part, SecondLaw};

/// A Poisson tensor at one state, and the largest violations of its laws relative to the terms that should
/// cancel.
#[derive(Clone, Debug)]
pub struct BracketDefects {
    /// The largest absolute value of an entry of the tensor.
    pub size: f64,
    pub(crate) tensor: Table,
    /// The violation of `Πᵀ = −Π`.
    pub skewness: Violation,
    /// The violation of the Jacobi identity.
    pub jacobi: Violation,
    /// Whether the derivatives of the tensor are finite.
    pub(crate) is_finite: bool,
}

/// The largest dimension at which the Jacobi identity is checked for all triples of axes. Above it, where there are
/// too many of them, random covectors take the place of the axes.
const ALL_TRIPLES: usize = 12;

/// The triples of random covectors at one state.
const TRIPLES: usize = 4;

/// Evaluates skewness and the Jacobi identity `Π^{il}∂_lΠ^{jk} + cyclic` at a state, in chart coordinates of the
/// sizes `units`, for the `entropy` there. The terms may all be round-off. So their sizes include the `rounding` of
/// the largest terms elsewhere, and of a generic product `Π^{il} Π^{jk} / ℓ_l`.
pub(crate) fn bracket_defects(
    at: At<'_>,
    entropy: &Jet2,
    units: &[f64],
    rounding: f64,
) -> Result<BracketDefects, MetricError> {
    // A bracket does not depend on the covector of the energy.
    let (_, energy) = at.jet(ENERGY);
    let w = Covectors { energy: &energy, entropy: &entropy.df };
    let tensor = at.tensor(Part::Reversible, w)?;
    let here = Here { at, entropy, units, rounding, tensor: &tensor };
    let large = at.n() > ALL_TRIPLES;
    let Jacobi { violation, is_finite } =
        if large { here.jacobi_of_covectors()? } else { here.jacobi_of_axes()? };
    let skewness = asymmetry(&tensor, -1.0, units, rounding);
    let by_differences = at.model.has_derivatives_by_differences();
    let terms = violation.terms * if by_differences { OF_DIFFERENCES } else { 1.0 };
    let jacobi = Violation { terms, ..violation };
    Ok(BracketDefects { size: tensor.max_abs(), tensor, skewness, jacobi, is_finite })
}

/// The round-off of derivatives by differences, in units of that of derivatives of closures.
const OF_DIFFERENCES: f64 = 1e4;

/// The Jacobi identity at a state.
struct Jacobi {
    violation: Violation,
    /// Whether the derivatives of the tensor are finite.
    is_finite: bool,
}

impl Jacobi {
    /// Judges the cyclic sums of all triples of axes from the tensor and its derivatives along each axis.
    fn of_axes(tensor: &Table, slopes: &[Table], units: &[f64], rounding: f64) -> Self {
        let n = tensor.len();
        let top = largest(tensor, units);
        let steepest = (0..n).map(|l| largest(&slopes[l], units) * units[l]);
        let top = top * steepest.fold(top, worse);
        let term =
            |a: usize, b: usize, c: usize| (0..n).map(move |l| tensor[(a, l)] * slopes[l][(b, c)]);
        // The cyclic sum of a skew tensor is totally skew, and that of a constant one is zero.
        let mut violation = Violation::default();
        let constant = slopes.iter().all(|slope| slope.max_abs() == 0.0);
        for k in 0..if constant { 0 } else { n } {
            for j in 0..k {
                for i in 0..j {
                    let terms = term(i, j, k).chain(term(j, k, i)).chain(term(k, i, j));
                    let size = rounding * top * units[i] * units[j] * units[k];
                    violation = violation.or_worse(terms.collect::<Balance>().beside(size));
                }
            }
        }
        Self { violation, is_finite: slopes.iter().all(|slope| slope.max_abs().is_finite()) }
    }
}

/// Where the Jacobi identity is evaluated.
struct Here<'a> {
    at: At<'a>,
    entropy: &'a Jet2,
    units: &'a [f64],
    rounding: f64,
    tensor: &'a Table,
}

impl Here<'_> {
    /// The sum `Σ_l Π^{il}∂_lΠ^{jk} + cyclic` for all triples of axes, term by term.
    fn jacobi_of_axes(&self) -> Result<Jacobi, MetricError> {
        let &Self { at, entropy, .. } = self;
        let n = at.n();
        let mut slopes = Vec::with_capacity(n);
        for l in 0..n {
            let mut along = zeros(n);
            along[l] = 1.0;
            let ds = entropy.hf.times(&along);
            let mut slope = Table::zeros(n);
            let along = [&along[..], &ds];
            at.model.bracket_slope(at.t, at.x, along, &entropy.df, slope.entries_mut())?;
            slopes.push(slope);
        }
        Ok(Jacobi::of_axes(self.tensor, &slopes, self.units, self.rounding))
    }

    /// The sum for random covectors, `⟨β, ∂_{Πα}Π γ⟩ + cyclic`, which is the sum of three derivatives.
    fn jacobi_of_covectors(&self) -> Result<Jacobi, MetricError> {
        let &Self { at, entropy, units, rounding, tensor } = self;
        let n = at.n();
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let mut covector =
            || units.iter().map(|unit| rng.random_range(-1.0..1.0) / unit).collect::<Row>();
        let top = largest(tensor, units);
        let (mut violation, mut is_finite) = (Violation::default(), true);
        for _ in 0..TRIPLES {
            let w = [covector(), covector(), covector()];
            let mut balance = Balance::default();
            for k in 0..3 {
                let [alpha, beta, gamma] = [0, 1, 2].map(|i| &w[(k + i) % 3]);
                let along = tensor.times(alpha);
                let ds = entropy.hf.times(&along);
                let (along, mut slope) = ([&along[..], &ds], zeros(n));
                let of = (&entropy.df[..], &gamma[..]);
                at.model.bracket_slope_of(at.t, at.x, along, of.0, of.1, &mut slope)?;
                // Each row is a term, because a derivative may be a rounding of large rows.
                balance.extend((0..n).map(|i| beta[i] * slope[i]));
            }
            is_finite &= balance.sum().is_finite();
            violation = violation.or_worse(balance.beside(rounding * top * top));
        }
        Ok(Jacobi { violation, is_finite })
    }
}

/// A seed, so that a model fails in the same way each time.
const SEED: u64 = 0x4a61_636f_6269_2121;

/// Checks that `Π` is skew, satisfies the Jacobi identity, and has `S` as a Casimir.
pub(super) fn examine(place: &Place<'_>, findings: &mut Findings<'_>) -> Result<(), ModelError> {
    let &Place { at, units, ref entropy, .. } = place;
    let defects = bracket_defects(at, entropy, units, ROUNDING);
    let defects = defects.map_err(|source| at.unusable(source))?;
    if !defects.is_finite {
        let point = findings.point.clone();
        return Err(ModelError::DerivativeNotFinite { field: "bracket", point });
    }
    let size = defects.skewness.relative();
    findings.note("Πᵀ = −Π", size, |point, size| ModelError::BracketNotSkew { point, size });
    let size = defects.jacobi.relative();
    if at.model.is_poisson() {
        let error = |point, size| ModelError::NoJacobiIdentity { point, size };
        findings.note("Jacobi identity", size, error);
    } else {
        findings.record("Jacobi identity", size, f64::INFINITY);
    }
    if at.model.second_law() == SecondLaw::Exact {
        let size = balance::product(&defects.tensor, &entropy.df, units);
        findings
            .note("Π dS = 0", size, |point, size| ModelError::EntropyNotCasimir { point, size });
    }
    Ok(())
}
