//! A lattice as a flow.

use metriplectic_dynamics::SecondLaw;
use metriplectic_dynamics::invariants::Kind;
use metriplectic_equations::Evaluated;
use metriplectic_fields::{Column, Space};
use metriplectic_integrators::explicit::{Combination, Projected, ProjectionError, Target};
use metriplectic_integrators::open::surrounded::against_simpson;
use metriplectic_integrators::{
    Entries, Flow, FlowError, Laws, Listed, Recheck, StageFlow, StateSpace as _, Vector as _,
};
use metriplectic_manifolds::{Manifold, PointError};

use crate::gather::Gather;
use crate::lattice::{Differentials, Lattice, Total, Totals, differentials_at, dimension};
use crate::model::{Model, VectorOf};
use crate::parallel;
use crate::points::{Points, Sites};
use crate::projection::Projection;
use crate::vector::{SiteVector, larger};

/// The differentials of the laws at a state, with their totals.
#[derive(Clone, Debug)]
pub struct LatticeJets<V> {
    pub(crate) all: Differentials,
    pub(crate) totals: Totals<V>,
}

impl<P: Model> Lattice<P> {
    pub(crate) fn jets(&self, x: &Points<P::Manifold>) -> LatticeJets<VectorOf<P>> {
        let (all, totals) = self.differentials::<true>(x);
        LatticeJets { all, totals }
    }

    /// The size of the terms of the entropy: the one of [`Flow::term_sizes`], in one loop over the sites where it gathers
    /// nothing.
    fn entropy_size(&self, x: &Points<P::Manifold>) -> f64 {
        if P::EntropyGather::PRESENT {
            return self.term_sizes(x).entropy;
        }
        if !P::ENTROPY {
            return 0.0;
        }
        let parts = parallel::map(self.sites(), |sites| {
            let mut sums = vec![0.0; 2];
            for site in sites {
                let entropy = self.parts.entropy(site, &x[site]);
                sums[0] += entropy.value.abs();
                sums[1] += entropy.df.abs().dot(&P::Manifold::scales(&x[site]));
            }
            sums
        });
        let sizes = self.layout.sum(parts, |a, b| vec![a[0] + b[0], a[1] + b[1]]);
        sizes.map_or(0.0, |sizes| sizes[0] + sizes[1])
    }

    /// Verifies the start of a run, at this state alone if the laws were verified before.
    pub(crate) fn examine_start(
        &self,
        x0: &Points<P::Manifold>,
        verified: bool,
    ) -> Result<(), FlowError> {
        let verdict = if verified { self.verify_start_alone(x0) } else { self.verify(x0) };
        x0.clear_others();
        self.clear();
        verdict.map_err(FlowError::new)
    }

    /// Makes a vector with these numbers at each site.
    pub(crate) fn same(&self, numbers: &VectorOf<P>) -> SiteVector {
        let numbers = (0..dimension::<P>()).map(|k| numbers[k]).collect();
        SiteVector::same(self.sites(), numbers, &self.vectors)
    }
}

impl<V> LatticeJets<V> {
    pub(crate) fn is_finite(&self) -> bool {
        let Totals { energy, entropy, sums, .. } = &self.totals;
        let all = [energy, entropy].into_iter().chain(sums);
        all.into_iter().all(|total| total.sum.value().is_finite())
    }

    pub(crate) fn laws(&self) -> Laws<Vec<f64>> {
        let [energy, entropy] =
            [&self.totals.energy, &self.totals.entropy].map(|total| total.sum.value());
        Laws { energy, entropy, invariants: values(&self.totals.sums) }
    }
}

fn values(sums: &[Total]) -> Vec<f64> {
    sums.iter().map(|total| total.sum.value()).collect()
}

impl<P: Model> Flow for Lattice<P> {
    type Space = Sites<P::Manifold>;
    type Numbers = Vec<f64>;
    type Vector = SiteVector;

    fn laws(&self, x: &Points<P::Manifold>) -> Laws<Vec<f64>> {
        self.jets(x).laws()
    }

    fn term_sizes(&self, x: &Points<P::Manifold>) -> Laws<Vec<f64>> {
        let jets = self.jets(x);
        let partial = parallel::map(self.sites(), |sites| {
            let mut sums = vec![0.0; 2 + P::SUMS];
            for site in sites {
                let scales = P::Manifold::scales(&x[site]);
                let differentials = differentials_at::<P>(&jets.all, site);
                let further = (0..P::SUMS).map(|k| self.parts.sum(k, site, &x[site]).df);
                for (sum, df) in sums.iter_mut().zip(differentials.into_iter().chain(further)) {
                    *sum += df.abs().dot(&scales);
                }
            }
            sums
        });
        let slopes = self.layout.sum(partial, |mut sums: Vec<f64>, more| {
            sums.iter_mut().zip(more).for_each(|(sum, part)| *sum += part);
            sums
        });
        let slopes = |k: usize| slopes.as_ref().map_or(0.0, |sums| sums[k]);
        Laws {
            energy: jets.totals.energy.size + slopes(0),
            entropy: jets.totals.entropy.size + slopes(1),
            invariants: (0..P::SUMS).map(|k| jets.totals.sums[k].size + slopes(2 + k)).collect(),
        }
    }

    /// The round-off of the terms of the entropy, without the terms of the other laws.
    fn entropy_round_off(&self, ends: [&Points<P::Manifold>; 2]) -> f64 {
        let sizes = ends.map(|x| self.entropy_size(x));
        4.0 * f64::EPSILON * sizes[0].max(sizes[1]) + f64::MIN_POSITIVE / f64::EPSILON
    }

    fn rates(&self, x: &Points<P::Manifold>, d: &SiteVector) -> Option<SiteVector> {
        let y = self.stage(x, d)?;
        let (v, _) = self.motion(&y)?;
        Some(self.stage_rates(x, (d, &y), &v))
    }

    /// The largest size of each entry on the lattice, at all sites: a site that is at rest is no more exact than its
    /// neighbours.
    fn sizes(&self, x: &Points<P::Manifold>) -> SiteVector {
        self.same(&self.largest_sizes(x))
    }

    fn moved(&self, x: &Points<P::Manifold>, d: &SiteVector) -> Points<P::Manifold> {
        let end = |x: &_, q: &_| Some(P::Manifold::stage(x, q));
        self.moved_by(x, d.reader(), end).unwrap_or_else(|| x.clone())
    }

    fn displacement(&self, x: &Points<P::Manifold>, y: &Points<P::Manifold>) -> Option<SiteVector> {
        let q = self.stage_coordinates(x, y);
        let near = parallel::map(self.sites(), |mut sites| {
            sites.all(|site| {
                let q: VectorOf<P> = q.reader().at(site);
                q.is_finite() && P::Manifold::is_stage(&q)
            })
        });
        near.into_iter().all(|near| near).then_some(q)
    }

    fn production(&self, x: &Points<P::Manifold>) -> Option<f64> {
        Some(self.motion(x)?.1)
    }

    fn onto(
        &self,
        y: &Points<P::Manifold>,
        laws: &Laws<Vec<f64>>,
        entropy: Option<f64>,
    ) -> Option<Points<P::Manifold>> {
        let laws = Laws { entropy: entropy.unwrap_or(laws.entropy), ..laws.clone() };
        let (error, _) = self.motion(y)?;
        let with_entropy = entropy.is_some();
        let error = Some(Combination { factor: 1.0, terms: &[(1.0, &error)] });
        let target = Target { laws: &laws, with_entropy, limit: None, units: None, error };
        self.project(y.clone(), &target).ok().map(|end| end.x)
    }

    fn element(&self, entries: &[f64]) -> Result<Points<P::Manifold>, PointError> {
        let (found, expected) = (entries.len(), self.sites());
        // All points of a manifold have as many entries as its first.
        let mut length = 0;
        P::Manifold::assemble(&mut || {
            length += 1;
            0.0
        });
        if found != expected * length {
            return Err(PointError::Length { found, expected: expected * length });
        }
        let points = entries.chunks_exact(length.max(1));
        let points: Result<Vec<_>, _> =
            points.map(|entries| self.parts.manifold().from_entries(entries)).collect();
        Ok(Points::from(points?))
    }

    fn entropy_law(&self) -> SecondLaw {
        if P::ENTROPY { SecondLaw::Exact } else { SecondLaw::NoEntropy }
    }

    fn evaluated(&self, x: &Points<P::Manifold>) -> Vec<Evaluated> {
        let mut fields = Vec::new();
        let bond = self
            .layout
            .bonds()
            .first()
            .map(|ends| ends.map(|site| x[site as usize].clone()).into());
        if let Some(site) = x.first() {
            self.parts
                .evaluations(site, bond.as_ref(), &mut |name, from| fields.push((name, from)));
        }
        Evaluated::list(fields)
    }

    fn kinds(&self) -> Vec<Kind> {
        vec![Kind::Momentum; P::SUMS]
    }

    fn examine(&self, x0: &Points<P::Manifold>) -> Result<(), FlowError> {
        self.examine_start(x0, self.verified)
    }

    fn is_verified(&self) -> bool {
        self.verified
    }

    fn rechecks(&self, _: Recheck) -> bool {
        true
    }

    fn reexamine(&self, x: &Points<P::Manifold>, occasion: Recheck) -> Result<(), FlowError> {
        if let Recheck::OnTheWay { step } = occasion {
            return self.recheck_on_the_way(x, step).map_err(FlowError::new);
        }
        let checked = self.recheck_all(x).map_err(FlowError::new);
        x.clear_others();
        self.clear();
        checked
    }

    fn site_outside(&self, x: &Points<P::Manifold>, d: &SiteVector) -> Option<usize> {
        let (manifold, d) = (self.parts.manifold(), d.reader());
        let y = self.moved_by(x, d, |x, q| Some(P::Manifold::stage(x, q)))?;
        let outside =
            |site: usize| !P::Manifold::is_stage(&d.at(site)) || !manifold.is_inside(&y[site]);
        (0..self.sites()).find(|&site| outside(site)).or_else(|| self.not_finite(&y))
    }

    fn defect(&self, x: &Points<P::Manifold>) -> f64 {
        let of = |sites: std::ops::Range<usize>| {
            let defects = x[sites].iter().map(|x| self.parts.manifold().defect(x));
            defects.fold(0.0, larger)
        };
        parallel::map(self.sites(), of).into_iter().fold(0.0, larger)
    }

    fn velocity_terms(
        &self,
        x: &Points<P::Manifold>,
        v: &SiteVector,
        sizes: &SiteVector,
    ) -> Option<SiteVector> {
        let terms = self.terms(x, v, sizes);
        // The arrays of the search for these sizes would stay for the whole run.
        self.clear();
        terms
    }

    fn local_error(
        &self,
        x: &Points<P::Manifold>,
        end: &Points<P::Manifold>,
        h: f64,
    ) -> Option<SiteVector> {
        against_simpson(self, x, end, h)
    }
}

/// The points with these entries, site by site.
pub(crate) fn listed<M: Manifold>(entries: &[f64]) -> Points<M> {
    let mut entries = entries.iter().peekable();
    let mut points = Vec::new();
    while entries.peek().is_some() {
        let mut next = || *entries.next().expect("a state has all entries of its last point");
        points.push(M::assemble(&mut next));
    }
    Points::from(points)
}

impl<P: Model> Listed for Lattice<P> {
    type Layout = ();

    fn layout(&self) -> &() {
        &()
    }

    fn read((): &(), entries: &[f64]) -> Points<P::Manifold> {
        listed(entries)
    }

    fn write(x: &Points<P::Manifold>) -> Entries {
        Sites::<P::Manifold>::numbers(x).into()
    }
}

impl<P: Model> StageFlow for Lattice<P> {
    type Gradients = LatticeJets<VectorOf<P>>;

    const WEIGHS_ERRORS: bool = true;

    fn gradients(&self, x: &Points<P::Manifold>) -> Option<Self::Gradients> {
        let jets = self.jets(x);
        jets.is_finite().then_some(jets)
    }

    fn values(&self, gradients: &Self::Gradients) -> Laws<Vec<f64>> {
        gradients.laws()
    }

    fn entropy_round_off_of(&self, gradients: &Self::Gradients) -> Option<f64> {
        let Totals { entropy, entropy_slope, .. } = &gradients.totals;
        let size = entropy.size + entropy_slope;
        (!P::EntropyGather::PRESENT)
            .then_some(4.0 * f64::EPSILON * size + f64::MIN_POSITIVE / f64::EPSILON)
    }

    fn velocity(
        &self,
        x: &Points<P::Manifold>,
        gradients: &Self::Gradients,
    ) -> Option<(SiteVector, f64)> {
        self.motion_along::<true>(x, &gradients.all)
    }

    fn motion(&self, x: &Points<P::Manifold>) -> Option<(SiteVector, f64)> {
        let (all, _) = self.differentials::<false>(x);
        self.motion_along::<true>(x, &all)
    }

    fn stage(&self, x: &Points<P::Manifold>, q: &SiteVector) -> Option<Points<P::Manifold>> {
        let manifold = self.parts.manifold();
        self.moved_by(x, q.reader(), |x, q| {
            let y = P::Manifold::is_stage(q).then(|| P::Manifold::stage(x, q))?;
            manifold.is_inside(&y).then_some(y)
        })
    }

    fn stage_along<'a>(
        &self,
        x: &Points<P::Manifold>,
        (h, count): (f64, usize),
        term: impl Fn(usize) -> (f64, &'a SiteVector),
        coordinates: Option<&mut SiteVector>,
    ) -> Option<(SiteVector, f64)> {
        let keep = coordinates.is_some() || !P::Manifold::RATES_ARE_VELOCITIES;
        let (y, q) = match SiteVector::terms(count, &term) {
            Some(terms) => self.stage_at(x, h, &terms, keep)?,
            None => {
                let q = SiteVector::combination(h, count, term);
                (self.stage(x, &q)?, Some(q))
            }
        };
        let (v, production) = self.motion(&y)?;
        let Some(q) = q else { return Some((v, production)) };
        let rates = self.stage_rates(x, (&q, &y), &v);
        if let Some(coordinates) = coordinates {
            *coordinates = q;
        }
        Some((rates, production))
    }

    fn stage_rates(
        &self,
        x: &Points<P::Manifold>,
        (q, y): (&SiteVector, &Points<P::Manifold>),
        v: &SiteVector,
    ) -> SiteVector {
        if P::Manifold::RATES_ARE_VELOCITIES {
            return v.clone();
        }
        let [q, v] = [q.reader(), v.reader()];
        self.vector_of(|site| {
            P::Manifold::stage_rates(&x[site], (&q.at(site), &y[site]), &v.at(site))
        })
    }

    fn stage_coordinates(&self, x: &Points<P::Manifold>, y: &Points<P::Manifold>) -> SiteVector {
        self.vector_of(|site| P::Manifold::stage_coordinates(&x[site], &y[site]))
    }

    fn stage_rounding(
        &self,
        x: &Points<P::Manifold>,
        (q, y): (&SiteVector, &Points<P::Manifold>),
    ) -> SiteVector {
        let (x, q, y) = (&**x, q.reader(), &**y);
        self.vector_of(|site| {
            let reached = P::Manifold::stage_coordinates(&x[site], &y[site]);
            let q: VectorOf<P> = q.at(site);
            q - reached
        })
    }

    fn project(
        &self,
        y: Points<P::Manifold>,
        target: &Target<'_, Self>,
    ) -> Result<Projected<Self>, ProjectionError> {
        Projection { lattice: self, target }.from(y)
    }
}
