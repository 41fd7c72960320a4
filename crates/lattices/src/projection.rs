//! A state moved onto its laws.
//!
//! A correction has the direction
//!
//! ```math
//! u_i = \omega_i \sum_a c_a\, s^2\, dF_a(x_i), \qquad \omega_i = |e_i|^2,
//! ```
//!
//! with the sizes `s` of the entries, which cancel the units, and an estimate `e` of the local error of the step in
//! units of them. So a step moves nothing that it has not moved before, and the correction needs only the Gram
//! matrix `Σ_i ω_i ⟨s dF_a, s dF_b⟩` of the laws, a sum over the sites. Where this matrix is singular, because the error
//! has fewer freedoms than there are laws, all `ω_i` are 1.

use std::ops::Range;

use metriplectic_fields::{Column, Space};
use metriplectic_integrators::Vector as _;
use metriplectic_integrators::explicit::{Combination, Projected, ProjectionError, Target};
use metriplectic_manifolds::Manifold;

use crate::blocks::{self, Room, combine};
use crate::flow::LatticeJets;
use crate::gram::{Gram, Law, Normals};
use crate::lattice::{AtSites, Lattice, Total, dimension};
use crate::model::{Model, PointOf, VectorOf};
use crate::parallel;
use crate::points::Points;
use crate::vector::{SiteVector, larger};

/// The most corrections.
const CORRECTIONS: usize = 8;
/// The residual, in units of its round-off, below which no correction is begun. Sums have digits beyond their
/// terms, so that a correction takes a residual far below.
const SMALL: f64 = 0.125;
/// The residual with which a corrected state is accepted.
const ENOUGH: f64 = 0.5;
/// The residual of an entropy from which on the round-off of the other laws, which moves it too, is corrected.
const OFF: f64 = 0.8;
/// Residuals, in units of round-off, with which a state is accepted that no correction improves.
const STAGNATED: f64 = 2.0;
/// Residuals with which a state is accepted where no entropy is asked for.
const CONSERVED: f64 = 64.0;

/// The laws up to which loops over sites keep their numbers in registers.
const FEW: usize = 4;

/// How many laws there are: energy, further sums, entropy.
const fn laws<P: Model>() -> usize {
    1 + P::SUMS + if P::ENTROPY { 1 } else { 0 }
}

/// A place for the differentials of the laws at a site.
#[inline]
fn few_or_many<'a, P: Model>(
    few: &'a mut [VectorOf<P>; FEW],
    many: &'a mut Vec<VectorOf<P>>,
) -> &'a mut [VectorOf<P>] {
    if laws::<P>() <= FEW {
        &mut few[..laws::<P>()]
    } else {
        many.resize(laws::<P>(), VectorOf::<P>::zero());
        many
    }
}

pub(crate) struct Projection<'a, P: Model> {
    pub(crate) lattice: &'a Lattice<P>,
    pub(crate) target: &'a Target<'a, Lattice<P>>,
}

/// The factor and the terms of an error.
type Error<'a> = (f64, Vec<(f64, &'a [f64])>);

/// The weights `ω_i` of the sites.
struct Weights<'a, V> {
    error: Option<Error<'a>>,
    /// The reciprocal of the size of each entry.
    units: V,
}

impl<V: Column<f64>> Weights<'_, V> {
    /// The errors of some sites in a row, if the sites have weights.
    #[inline]
    fn errors<'r>(&self, sites: Range<usize>, room: &'r mut Room<f64>) -> &'r [V::Row] {
        let Some((factor, terms)) = &self.error else { return &[] };
        let numbers = room.items(sites.len() * V::LEN);
        combine(numbers, sites.start * V::LEN, *factor, terms);
        V::rows(numbers)
    }

    #[inline]
    fn of(&self, error: Option<&V::Row>) -> f64 {
        let Some(error) = error else { return 1.0 };
        let (e, mut sum) = (V::of_row(error), 0.0);
        for k in 0..V::LEN {
            let ratio = e[k] * self.units[k];
            sum += ratio * ratio;
        }
        sum
    }
}

type Jets<P> = LatticeJets<VectorOf<P>>;
type State<P> = Points<<P as Model>::Manifold>;

impl<P: Model> Projection<'_, P> {
    pub(crate) fn from(&self, mut y: State<P>) -> Result<Projected<Lattice<P>>, ProjectionError> {
        let with_entropy = self.target.with_entropy;
        let mut moved = 0.0;
        let mut best: Option<Best<P>> = None;
        let mut before = f64::INFINITY;
        let mut known: Option<(Gram, Weights<'_, VectorOf<P>>)> = None;
        for corrections in 0..=CORRECTIONS {
            let jets = self.lattice.jets(&y);
            if !jets.is_finite() {
                return Err(ProjectionError::Outside);
            }
            // A correction is small, and leaves the Gram matrix as it was.
            let (gram, weights) = match known.take() {
                Some(known) if corrections == 1 => known,
                _ => self.products(&y, &jets)?,
            };
            let normals = Normals::new(&gram, &self.laws(&jets), P::ENTROPY);
            let excess = normals.excess(with_entropy)?;
            let off = if with_entropy { normals.off() / OFF } else { 0.0 };
            let enough = if corrections == 0 { SMALL } else { ENOUGH };
            if excess <= enough && off <= 1.0 {
                return Ok(self.projected(normals.entropy(), y, jets));
            }
            let worst = excess.max(off);
            if before <= worst {
                // No correction improves it.
                return self.stagnated(best);
            }
            before = worst;
            let coefficients = normals.correction(with_entropy);
            let next = self.corrected(&y, &jets, &coefficients, &weights);
            if with_entropy && self.is_blurred(next.length, &normals, &jets) {
                return Err(ProjectionError::NoEntropy);
            }
            moved += next.length;
            let units = || self.lattice.same(&jets.totals.sizes);
            let is_far = self.target.limit.is_some_and(|limit| limit.is_below(moved, &units()));
            if !moved.is_finite() || is_far {
                return Err(ProjectionError::Far);
            }
            if worst <= CONSERVED {
                if next.length <= f64::EPSILON {
                    return Ok(self.projected(normals.entropy(), y, jets));
                }
                best = Some(Best { excess: worst, x: y, entropy: normals.entropy() });
            }
            y = next.points.ok_or(ProjectionError::Outside)?;
            known = Some((gram, weights));
        }
        self.stagnated(best)
    }

    /// Returns whether the round-off of the entropy is as long as the errors that are allowed, where a correction of this length takes back
    /// a residual of it: a state moved onto an entropy has an error then which no smaller step makes smaller.
    fn is_blurred(&self, length: f64, normals: &Normals, jets: &Jets<P>) -> bool {
        let (Some(allowed), excess) = (self.target.units, normals.entropy_excess()) else {
            return false;
        };
        // A longer correction of such a residual is too far.
        if !(excess > 0.0 && excess <= CONSERVED) {
            return false;
        }
        let sizes = self.lattice.same(&jets.totals.sizes);
        let in_units = |[error, size]: [f64; 2]| if error == 0.0 { 0.0 } else { error / size };
        SiteVector::is_norm_below([allowed, &sizes], in_units, length / excess)
    }

    /// Decides on the best state, if no correction improves it. Its differentials are evaluated anew, so that
    /// corrections need not keep them.
    #[cold]
    fn stagnated(&self, best: Option<Best<P>>) -> Result<Projected<Lattice<P>>, ProjectionError> {
        let with_entropy = self.target.with_entropy;
        let failed = if with_entropy { ProjectionError::NoEntropy } else { ProjectionError::Far };
        let most = if with_entropy { STAGNATED } else { CONSERVED };
        let Best { x, entropy, .. } = best.filter(|best| best.excess <= most).ok_or(failed)?;
        let jets = self.lattice.jets(&x);
        Ok(self.projected(entropy, x, jets))
    }

    fn projected(
        &self,
        [residual, entropy_round_off]: [f64; 2],
        x: State<P>,
        gradients: Jets<P>,
    ) -> Projected<Lattice<P>> {
        let entropy = self.target.laws.entropy - residual;
        Projected { x, gradients, entropy, entropy_round_off }
    }

    /// The products of the differentials of the laws, and the weights of the sites in them.
    fn products(
        &self,
        y: &State<P>,
        jets: &Jets<P>,
    ) -> Result<(Gram, Weights<'_, VectorOf<P>>), ProjectionError> {
        if let Some(error) = self.error() {
            // A common factor of the weights cancels.
            let sizes = &jets.totals.sizes;
            let reciprocal = |k: usize| if sizes[k] > 0.0 { sizes[k].recip() } else { 0.0 };
            let units = VectorOf::<P>::from_index(reciprocal);
            let weights = Weights { error: Some(error), units };
            let gram = self.gram(y, jets, &weights);
            let normals = Normals::new(&gram, &self.laws(jets), P::ENTROPY);
            if gram.is_finite() && !normals.leaves_out(self.target.with_entropy) {
                return Ok((gram, weights));
            }
        }
        let weights = Weights { error: None, units: VectorOf::<P>::zero() };
        let gram = self.gram(y, jets, &weights);
        if gram.is_finite() { Ok((gram, weights)) } else { Err(ProjectionError::Outside) }
    }

    /// The factor and the terms of the error. One that is the same at all sites weighs none of them more.
    fn error(&self) -> Option<Error<'_>> {
        let Combination { factor, terms } = self.target.error?;
        Some((factor, SiteVector::terms(terms.len(), |j| terms[j])?))
    }

    /// The target, the value and the sizes of each law.
    fn laws(&self, jets: &Jets<P>) -> Vec<Law> {
        let target = self.target.laws;
        // A residual without digits is none.
        let below = |total: &Total, target: f64| {
            let residual = total.sum.below(target);
            if residual.abs() <= f64::MIN_POSITIVE / f64::EPSILON { 0.0 } else { residual }
        };
        let law = |target: f64, total: &Total| Law {
            residual: below(total, target),
            size: target.abs() + total.size,
        };
        let sums = jets.totals.sums.iter().zip(&target.invariants);
        std::iter::once(law(target.energy, &jets.totals.energy))
            .chain(sums.map(|(sum, &target)| law(target, sum)))
            .chain(P::ENTROPY.then(|| law(target.entropy, &jets.totals.entropy)))
            .collect()
    }

    /// The differentials of the laws at a site: energy, further sums, entropy.
    #[inline]
    fn covectors(&self, y: &[PointOf<P>], all: AtSites<'_, P>, site: usize, w: &mut [VectorOf<P>]) {
        let [energy, entropy] = all.at(site);
        w[0] = energy;
        for k in 0..P::SUMS {
            w[1 + k] = self.lattice.parts.sum(k, site, &y[site]).df;
        }
        if P::ENTROPY {
            w[1 + P::SUMS] = entropy;
        }
    }

    fn gram(&self, y: &State<P>, jets: &Jets<P>, weights: &Weights<'_, VectorOf<P>>) -> Gram {
        let laws = laws::<P>();
        let (y, all) = (&**y, jets.all.reader::<P>());
        let sizes = &jets.totals.sizes;
        let parts = parallel::map(self.lattice.sites(), |sites| {
            let mut gram = Gram::new(laws);
            let (mut few, mut many) = ([VectorOf::<P>::zero(); FEW], Vec::new());
            let w = few_or_many::<P>(&mut few, &mut many);
            // Numbers of their own stay in registers.
            let (mut slopes, mut products) = ([0.0; FEW], [0.0; FEW * FEW]);
            let mut room = Room::of(dimension::<P>(), 0.0);
            for block in blocks::blocks(sites, dimension::<P>()) {
                let errors = weights.errors(block.clone(), &mut room);
                for (k, site) in block.enumerate() {
                    self.covectors(y, all, site, w);
                    let at = (weights.of(errors.get(k)), P::Manifold::scales(&y[site]));
                    if laws <= FEW {
                        let products = &mut products[..laws * laws];
                        add_site(w, at, sizes, (&mut slopes[..laws], products));
                    } else {
                        add_site(w, at, sizes, (&mut gram.slopes, &mut gram.products));
                    }
                }
            }
            if laws <= FEW {
                gram.slopes.copy_from_slice(&slopes[..laws]);
                gram.products.copy_from_slice(&products[..laws * laws]);
            }
            gram
        });
        let gram = self.lattice.layout.sum(parts, |a, b| a.plus(&b));
        gram.unwrap_or_else(|| Gram::new(laws))
    }

    /// Moves the points by a combination of the differentials.
    fn corrected(
        &self,
        y: &State<P>,
        jets: &Jets<P>,
        coefficients: &[f64],
        weights: &Weights<'_, VectorOf<P>>,
    ) -> Corrected<P> {
        let sizes = &jets.totals.sizes;
        let manifold = self.lattice.parts.manifold();
        let mut points = y.like();
        let (y, all) = (&**y, jets.all.reader::<P>());
        let parts = parallel::fill(&mut points, 1, |sites, out| {
            let (mut few, mut many) = ([VectorOf::<P>::zero(); FEW], Vec::new());
            let w = few_or_many::<P>(&mut few, &mut many);
            let (mut length, mut inside) = (0.0, true);
            let (first, mut room) = (sites.start, Room::of(dimension::<P>(), 0.0));
            for block in blocks::blocks(sites, dimension::<P>()) {
                let errors = weights.errors(block.clone(), &mut room);
                let out = &mut out[block.start - first..block.end - first];
                for ((k, site), out) in block.enumerate().zip(out) {
                    let weight = weights.of(errors.get(k));
                    if weight == 0.0 {
                        out.clone_from(&y[site]);
                        continue;
                    }
                    self.covectors(y, all, site, w);
                    let mut u = VectorOf::<P>::zero();
                    for (w, &c) in w.iter().zip(coefficients) {
                        u += *w * c;
                    }
                    let mut square = 0.0;
                    for k in 0..dimension::<P>() {
                        let ratio = u[k] * sizes[k] * weight;
                        square += ratio * ratio;
                        u[k] = ratio * sizes[k];
                    }
                    length = larger(length, square);
                    *out = P::Manifold::chart(&y[site], &u);
                    inside &= manifold.is_inside(out);
                }
            }
            (length, inside)
        });
        let inside = parts.iter().all(|&(_, inside)| inside);
        let largest = parts.iter().fold(0.0, |most, &(length, _)| larger(most, length));
        let length = (largest / dimension::<P>() as f64).sqrt();
        Corrected { points: inside.then_some(points), length }
    }
}

/// Adds the slopes of the laws at a site, and the products of their differentials with a weight. The differentials are in units
/// of the sizes afterwards.
#[inline(always)]
fn add_site<V: Column<f64>>(
    w: &mut [V],
    (weight, scales): (f64, V),
    sizes: &V,
    (slopes, products): (&mut [f64], &mut [f64]),
) {
    let laws = w.len();
    for (slope, w) in slopes.iter_mut().zip(&*w) {
        *slope += w.abs().dot(&scales);
    }
    if weight > 0.0 {
        for w in &mut *w {
            for k in 0..V::LEN {
                w[k] *= sizes[k];
            }
        }
        for a in 0..laws {
            for b in 0..=a {
                products[a * laws + b] += weight * w[a].dot(&w[b]);
            }
        }
    }
}

/// A state near the laws.
struct Best<P: Model> {
    /// Its largest residual, in units of round-off.
    excess: f64,
    x: State<P>,
    /// The residual of its entropy, and the round-off of it.
    entropy: [f64; 2],
}

/// A state that was moved.
struct Corrected<P: Model> {
    /// The points; `None` if one is outside of its domain.
    points: Option<State<P>>,
    /// The longest displacement of a site, in units of the sizes of the entries.
    length: f64,
}
