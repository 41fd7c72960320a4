//! The laws of the bracket.

use metriplectic_fields::{ChartPoint, Column, Dimension, Jet2, Matrix, Space, Square, Vector};
use metriplectic_manifolds::MetricError;
use num_dual::Dual64;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use super::balance::{self, Balance, ROUNDING, Violation, asymmetry, largest, worse};
use super::findings::Findings;
use super::place::{Place, unusable};
use super::table::{Table, components};
use crate::bracket::{Bracket, BracketArgs};
use crate::metriplectic::{Metriplectic, Point, SecondLaw};
use crate::model_error::ModelError;

/// A Poisson tensor at one point, and the largest violations of its laws relative to the terms that should
/// cancel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BracketDefects<M: Space> {
    pub(crate) tensor: Matrix<M>,
    pub(crate) skewness: Violation,
    pub(crate) jacobi: Violation,
    /// Whether the derivatives of the tensor are finite.
    pub(crate) is_finite: bool,
}

/// The largest dimension at which the Jacobi identity is checked for all triples of axes. Above it, where there are
/// too many of them, random covectors take the place of the axes.
const ALL_TRIPLES: usize = 12;

/// The triples of random covectors at one point.
const TRIPLES: usize = 4;

/// Evaluates skewness and the Jacobi identity `Π^{il}∂_lΠ^{jk} + cyclic` at `x`, in chart coordinates of the
/// sizes `units`, for the `entropy` there. The terms may all be round-off. So their sizes include the `rounding` of
/// the largest terms elsewhere, and of a generic product `Π^{il} Π^{jk} / ℓ_l`.
pub(crate) fn bracket_defects<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
    entropy: &Jet2<Y::Manifold>,
    units: &Vector<Y::Manifold>,
    rounding: f64,
) -> Result<BracketDefects<Y::Manifold>, MetricError> {
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let g = system.metric_at(&centre);
    let tensor = system.bracket().tensor(&system.bracket_args(&g, &entropy.df))?;
    let (table, sizes) = (Table::of(&tensor), components(units));
    let at = At { system, x, entropy, units: &sizes, rounding, tensor: &tensor, table: &table };
    let large = <Y::Manifold as Space>::Dim::LEN > ALL_TRIPLES;
    let Jacobi { violation, is_finite } =
        if large { at.jacobi_of_covectors()? } else { at.jacobi_of_axes()? };
    let skewness = asymmetry(&table, -1.0, &sizes, rounding);
    Ok(BracketDefects { tensor, skewness, jacobi: violation, is_finite })
}

/// The Jacobi identity at a point.
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
struct At<'a, Y: Metriplectic + ?Sized> {
    system: &'a Y,
    x: &'a Point<Y>,
    entropy: &'a Jet2<Y::Manifold>,
    units: &'a [f64],
    rounding: f64,
    tensor: &'a Matrix<Y::Manifold>,
    table: &'a Table,
}

impl<Y: Metriplectic + ?Sized> At<'_, Y> {
    /// Evaluates `of` with the bracket at the point `φ_x(εv)`.
    fn moved<T>(
        &self,
        v: &Vector<Y::Manifold>,
        of: impl FnOnce(&BracketArgs<'_, Y::Manifold, Y::Metric, Dual64>) -> T,
    ) -> T {
        let q = Vector::<Y::Manifold, Dual64>::from_index(|i| Dual64::new(0.0, v[i]));
        let moved = ChartPoint { base: self.x.clone(), q };
        let slope = self.entropy.hf * *v;
        let ds = Vector::<Y::Manifold, Dual64>::from_index(|i| {
            Dual64::new(self.entropy.df[i], slope[i])
        });
        let g = self.system.metric_at(&moved);
        of(&self.system.bracket_args(&g, &ds))
    }

    /// The sum `Σ_l Π^{il}∂_lΠ^{jk} + cyclic` for all triples of axes, term by term.
    fn jacobi_of_axes(&self) -> Result<Jacobi, MetricError> {
        let n = <Y::Manifold as Space>::Dim::LEN;
        let mut slopes = Vec::with_capacity(n);
        for l in 0..n {
            let along = Vector::<Y::Manifold>::basis(l);
            let dual = self.moved(&along, |args| self.system.bracket().tensor(args))?;
            slopes.push(Table::of(&Matrix::<Y::Manifold>::from_entries(|i, j| dual[(i, j)].eps)));
        }
        Ok(Jacobi::of_axes(self.table, &slopes, self.units, self.rounding))
    }

    /// The sum for random covectors, `⟨β, ∂_{Πα}Π γ⟩ + cyclic`, which is the sum of three derivatives.
    fn jacobi_of_covectors(&self) -> Result<Jacobi, MetricError> {
        let &Self { system, units, rounding, tensor, table, .. } = self;
        let n = <Y::Manifold as Space>::Dim::LEN;
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let mut covector =
            || Vector::<Y::Manifold>::from_index(|i| rng.random_range(-1.0..1.0) / units[i]);
        let top = largest(table, units);
        let (mut violation, mut is_finite) = (Violation::default(), true);
        for _ in 0..TRIPLES {
            let w = [covector(), covector(), covector()];
            let mut balance = Balance::default();
            for k in 0..3 {
                let [alpha, beta, gamma] = [0, 1, 2].map(|i| &w[(k + i) % 3]);
                let gamma = Vector::<Y::Manifold, Dual64>::embed(gamma);
                let moved =
                    self.moved(&(*tensor * *alpha), |args| system.bracket().apply(args, &gamma))?;
                // Each row is a term, because a derivative may be a rounding of large rows.
                balance.extend((0..n).map(|i| beta[i] * moved[i].eps));
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
pub(super) fn examine<Y: Metriplectic + ?Sized>(
    place: &Place<'_, Y>,
    findings: &mut Findings<'_>,
) -> Result<(), ModelError> {
    let &Place { system, x, units, ref entropy, .. } = place;
    let defects = bracket_defects(system, x, entropy, units, ROUNDING);
    let defects = defects.map_err(unusable::<Y::Manifold>(x))?;
    if !defects.is_finite {
        let point = findings.point.clone();
        return Err(ModelError::DerivativeNotFinite { field: "bracket", point });
    }
    let size = defects.skewness.relative();
    findings.note("Πᵀ = −Π", size, |point, size| ModelError::BracketNotSkew { point, size });
    let size = defects.jacobi.relative();
    if system.bracket().is_poisson() {
        let error = |point, size| ModelError::NoJacobiIdentity { point, size };
        findings.note("Jacobi identity", size, error);
    } else {
        findings.record("Jacobi identity", size, f64::INFINITY);
    }
    if system.second_law() == SecondLaw::Exact {
        let tensor = Table::of(&defects.tensor);
        let size = balance::product(&tensor, &components(&entropy.df), &components(units));
        findings
            .note("Π dS = 0", size, |point, size| ModelError::EntropyNotCasimir { point, size });
    }
    Ok(())
}
