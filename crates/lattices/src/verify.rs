//! The laws of a lattice, verified at a start in `O(N)`.
//!
//! All points and values are looked at once, and the friction of all sites and bonds. The other laws of the closures are
//! tried at up to 64 sites and bonds, with their true neighbours, at a state near the start: moved along the velocity and
//! at random, so that no force and no velocity vanishes by the symmetry of the start. The friction is tried there too.

mod gathered;

use metriplectic_fields::{Column, Space, Vector};
use metriplectic_integrators::{Flow as _, StageFlow as _, Vector as _};
use metriplectic_manifolds::Manifold;

use crate::error::{LatticeError, Place, Tried};
use crate::friction::Term;
use crate::gather::Gather as _;
use crate::lattice::{Differentials, Lattice, Total, differentials_at, dimension};
use crate::model::{Model, PairManifold, PointOf, VectorOf};
use crate::parallel;
use crate::points::Points;
use crate::random::{At, Random, Use};
use crate::report::{LatticeLaw, LatticeReport, Laws, RATES};

/// Sites, and bonds, at which closures are tried.
const SAMPLES: usize = 64;
/// The displacement of the state at which they are, relative to the sizes of the entries.
pub(crate) const MOVED: f64 = 1e-2;
/// The ratio of a distance to the one that is tried before it.
pub(crate) const NEARER: f64 = 1e-2;
/// The rest of terms that should cancel, relative to them.
const CANCELS: f64 = 1e-9;
/// The step of a difference quotient, relative to the sizes of the entries, and its error.
const STEP: f64 = 1e-5;
const QUOTIENT: f64 = 1e-4;
/// A longer step, over which a wrong derivative differs from the quotient by as much as over the first, to this fraction.
const FAR_STEP: f64 = 1e-3;
const SAME: f64 = 0.1;

/// Up to [`SAMPLES`] numbers below `count`, with the first and the last one.
pub(crate) fn samples(count: usize) -> impl Iterator<Item = usize> + Clone {
    let most = SAMPLES.min(count);
    (0..most).map(move |k| match k {
        _ if most == count => k,
        0 => 0,
        1 => count - 1,
        _ => golden(k, count),
    })
}

/// A number below `count`. Strides of the golden ratio meet no period of a regular lattice.
pub(crate) fn golden(k: usize, count: usize) -> usize {
    let turn = (k as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    usize::try_from((u128::from(turn) * count as u128) >> 64).unwrap_or(0)
}

impl<P: Model> Lattice<P> {
    /// Verifies the lattice at a state: the points, all values, and the laws at sampled sites and bonds. Every run
    /// verifies its start.
    ///
    /// # Errors
    ///
    /// The first [`LatticeError`], with its site or bond.
    pub fn verify(&self, x: &Points<P::Manifold>) -> Result<(), LatticeError> {
        self.judge(x, MOVED, &mut Laws::first())
    }

    /// Lists every law that [`verify`](Self::verify) tries, with the site or the bond where it is worst. Read it when a new
    /// lattice misbehaves.
    pub fn report(&self, x: &Points<P::Manifold>) -> LatticeReport {
        let (verdict, mut laws) = (self.verify(x), Laws::all());
        // A state without points or values ends it, and is in the verdict.
        let _ = self.judge(x, MOVED, &mut laws);
        let size = [self.sites(), self.layout.bonds().len()];
        let tried = size.map(|count| samples(count).count());
        LatticeReport { laws: laws.into_list(), size, tried, verdict }
    }

    /// Verifies the lattice at a state, and returns it with this certificate. A run of it, from any start, looks at the
    /// points, at all values, at the friction and at `Π dS = 0` there, and at no states and derivatives around it. Use it
    /// for a study of many runs.
    ///
    /// ```
    /// use metriplectic_fields::Real;
    /// use metriplectic_integrators::{DormandPrince5, Method, Span};
    /// use metriplectic_lattices::{Graph, Lattice, Onsager};
    /// use metriplectic_manifolds::Euclidean;
    /// use nalgebra::{ComplexField, Vector1, vector};
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let rod = Lattice::on(Graph::chain(5), Euclidean::<1>)
    ///     .energy(|u: &Vector1<Real>| u.x)
    ///     .entropy(|u: &Vector1<Real>| u.x.ln())
    ///     .bond_onsager(|bond| {
    ///         let [u, v] = bond.x;
    ///         [Onsager { rate: u.x * v.x, b: [vector![1.0], vector![-1.0]] }]
    ///     })
    ///     .build()?;
    /// let start = rod.points(|_| vector![1.0]);
    /// println!("{}", rod.report(&start)); // … verdict: the lattice keeps its laws
    /// let rod = rod.verified(&start)?;
    /// let hot = rod.points(|site| vector![if site == 0 { 2.0 } else { 1.0 }]);
    /// let run = DormandPrince5.run(&rod, hot, Span::steps(0.1, 10))?;
    /// assert!(run.certificate().verified_before);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// The errors of [`verify`](Self::verify).
    pub fn verified(self, x: &Points<P::Manifold>) -> Result<Self, LatticeError> {
        self.verify(x)?;
        Ok(self.with_certificate())
    }

    /// Judges the points and all values at a state, and the laws there and near it.
    ///
    /// # Errors
    ///
    /// The first [`LatticeError`]; if `laws` are listed, that of a point or a value.
    pub(crate) fn judge(
        &self,
        x: &Points<P::Manifold>,
        radius: f64,
        laws: &mut Laws,
    ) -> Result<(), LatticeError> {
        self.verify_points(x)?;
        self.verify_values(x)?;
        self.judge_friction_around(x, radius, laws)?;
        let (y, tried) = self.near(x, &self.sizes(x), radius);
        let (sizes, random) = (Sizes::Same(self.largest_sizes(&y)), Random::new(Use::Start));
        let trial = Trial { lattice: self, y: &y, sizes, tried, random, mean: [0.0; 2] }.all(laws);
        trial.map_err(|law| self.located(law, &y))
    }

    /// Verifies the start of a run of a [verified](Self::verified) lattice: the points, all values, and the laws at this
    /// state alone.
    ///
    /// # Errors
    ///
    /// The first [`LatticeError`].
    pub(crate) fn verify_start_alone(&self, x: &Points<P::Manifold>) -> Result<(), LatticeError> {
        self.verify_points(x)?;
        self.verify_values(x)?;
        let judge = |y: &_, tried| {
            self.judge_friction(y, tried, &mut Laws::first())?;
            self.verify_casimir(y, tried)
        };
        match judge(x, Tried::Start) {
            Err(found @ LatticeError::Broken { .. }) => {
                // At an equilibrium Π dH and b may be all round-off. Friction that is wrong in a small region is right at a
                // state beyond it.
                let (sizes, mut is_sound) = (self.own_sizes(x), false);
                for fraction in [MOVED, NEARER * MOVED] {
                    if let Some(y) = self.moved_near(fraction, x, &sizes) {
                        is_sound = judge(&y, Tried::Near { fraction }).is_ok();
                        if !is_sound {
                            break;
                        }
                    }
                }
                if is_sound { self.verify_rates(x, Tried::Start) } else { Err(found) }
            }
            verdict => verdict,
        }
    }

    /// Looks for points that are not on their manifold.
    fn verify_points(&self, x: &Points<P::Manifold>) -> Result<(), LatticeError> {
        let (found, expected) = (x.len(), self.sites());
        if found != expected {
            return Err(LatticeError::Points { found, expected });
        }
        let wrong = parallel::map(self.sites(), |sites| {
            let check = |site| self.parts.manifold().check(&x[site]).err().map(|e| (site, e));
            sites.filter_map(check).next()
        });
        match wrong.into_iter().flatten().next() {
            Some((site, cause)) => Err(LatticeError::Start { place: Place::Site(site), cause }),
            None => Ok(()),
        }
    }

    /// Verifies the friction of all sites and bonds at a start, and at a state near it.
    fn judge_friction_around(
        &self,
        x: &Points<P::Manifold>,
        radius: f64,
        laws: &mut Laws,
    ) -> Result<(), LatticeError> {
        let [mut here, mut there] = [laws.fresh(), laws.fresh()];
        let at_start = self.judge_friction(x, Tried::Start, &mut here);
        // Small entries beside large ones keep their signs here, as rates of friction may need.
        let (y, tried) = self.near(x, &self.own_sizes(x), radius);
        let nearby = self.judge_friction(&y, tried, &mut there);
        if nearby.is_ok() && there.hold() {
            // At an equilibrium b may be all round-off, and every b was tried nearby.
            here.forgive_all_but(RATES);
        }
        laws.merge(here);
        laws.merge(there);
        match at_start {
            Err(LatticeError::Broken { .. }) if nearby.is_ok() => {
                self.verify_rates(x, Tried::Start)
            }
            verdict => verdict.and(nearby),
        }
    }

    /// Verifies the terms of the friction at a state, in `O(N)`.
    fn judge_friction(
        &self,
        x: &Points<P::Manifold>,
        tried: Tried,
        laws: &mut Laws,
    ) -> Result<(), LatticeError> {
        let (all, _) = self.differentials::<false>(x);
        let verdict = self.each_term(x, &all, laws, |term, laws| {
            term.negative_rate(tried, laws)?;
            term.keeps_energy(tried, laws)
        });
        verdict.map_err(|law| self.located(law, x))
    }

    /// Verifies the rates of the friction at a state.
    fn verify_rates(&self, x: &Points<P::Manifold>, tried: Tried) -> Result<(), LatticeError> {
        let (all, _) = self.differentials::<false>(x);
        let check = |term: &Term, laws: &mut Laws| term.negative_rate(tried, laws);
        let verdict = self.each_term(x, &all, &mut Laws::first(), check);
        verdict.map_err(|law| self.located(law, x))
    }

    /// An error with the entries of the state at its place.
    #[cold]
    pub(crate) fn located(&self, law: LatticeError, x: &Points<P::Manifold>) -> LatticeError {
        let entries = |place: Place| match place {
            Place::Site(site) => P::Manifold::entries(&x[site]),
            Place::Bond { sites, .. } => {
                sites.iter().flat_map(|&site| P::Manifold::entries(&x[site])).collect()
            }
            Place::Total => Vec::new(),
        };
        match law {
            LatticeError::Broken { law, place, tried, size, remedy, .. } => {
                LatticeError::Broken { law, place, tried, size, remedy, entries: entries(place) }
            }
            LatticeError::NegativeRate { place, tried, rate, .. } => {
                LatticeError::NegativeRate { place, tried, rate, entries: entries(place) }
            }
            other => other,
        }
    }

    pub(crate) fn place_of(&self, bond: usize) -> Place {
        let sites = self.layout.bonds()[bond].map(|site| site as usize);
        Place::Bond { bond: self.layout.number(bond), sites }
    }

    /// A site with a value or a derivative that is no number.
    pub(crate) fn not_finite(&self, x: &Points<P::Manifold>) -> Option<usize> {
        match self.verify_values(x) {
            Err(LatticeError::NotFinite { place: Place::Site(site), .. }) => Some(site),
            Err(LatticeError::NotFinite { place: Place::Bond { sites, .. }, .. }) => Some(sites[0]),
            _ => None,
        }
    }

    /// Looks for values and derivatives that are no numbers.
    fn verify_values(&self, x: &Points<P::Manifold>) -> Result<(), LatticeError> {
        let not_finite = |what, place| Err(LatticeError::NotFinite { what, place });
        let at = |site: usize| {
            let point = &x[site];
            if !self.parts.energy(site, point).is_finite() {
                return not_finite("energy", Place::Site(site));
            }
            if P::ENTROPY && !self.parts.entropy(site, point).is_finite() {
                return not_finite("entropy", Place::Site(site));
            }
            let sum = |k| self.parts.sum(k, site, point).is_finite();
            if !(0..P::SUMS).all(sum) {
                return not_finite("conserved sum", Place::Site(site));
            }
            Ok(())
        };
        let on = |bond: usize| {
            let pair = self.pair(x, bond);
            if self.parts.bond_energy(bond, &pair).is_finite() {
                Ok(())
            } else {
                not_finite("energy", self.place_of(bond))
            }
        };
        parallel::map(self.sites(), |mut sites| sites.try_for_each(at))
            .into_iter()
            .collect::<Result<(), _>>()?;
        if P::BOND_ENERGY {
            parallel::map(self.layout.bonds().len(), |mut bonds| bonds.try_for_each(on))
                .into_iter()
                .collect::<Result<(), _>>()?;
        }
        self.verify_gathered("energy", &self.parts.gathers().energy, x)?;
        self.verify_gathered("entropy", &self.parts.gathers().entropy, x)?;
        let (all, _) = self.differentials::<false>(x);
        if self.motion_along::<true>(x, &all).is_some() {
            return Ok(());
        }
        // A term of the velocity is no number: where is it?
        let at = (&**x, all.reader::<P>());
        for site in 0..self.sites() {
            let [w, s] = at.1.at(site);
            let mut sum = self.parts.reversible(&x[site], &w, &s);
            self.site_terms(site, at, |_, term| sum += term.b * term.rate);
            if !sum.is_finite() {
                return not_finite("velocity", Place::Site(site));
            }
        }
        for bond in 0..self.layout.bonds().len() {
            let mut sum = VectorOf::<P>::zero();
            self.bond_terms(bond, at, |_, term| sum += (term.b[0] + term.b[1]) * term.rate);
            if !sum.is_finite() {
                return not_finite("friction", self.place_of(bond));
            }
        }
        not_finite("velocity", Place::Total)
    }

    fn pair(&self, x: &Points<P::Manifold>, bond: usize) -> (PointOf<P>, PointOf<P>) {
        self.layout.bonds()[bond].map(|site| x[site as usize].clone()).into()
    }

    /// The size of each entry at its own site, or the largest one on the lattice where it is zero.
    pub(crate) fn own_sizes(&self, x: &Points<P::Manifold>) -> crate::SiteVector {
        let largest = self.largest_sizes(x);
        self.vector_of(|site| {
            let own = P::Manifold::scales(&x[site]);
            VectorOf::<P>::from_index(|k| if own[k] > 0.0 { own[k] } else { largest[k] })
        })
    }

    /// A random number between −1 and 1 for each entry of a state.
    pub(crate) fn irregular(&self, of: Use, like: &crate::SiteVector) -> crate::SiteVector {
        let (random, first) = (Random::new(of), self.layout.first_site() * dimension::<P>());
        like.with(|i| random.of_entry(first + i))
    }

    /// Moves a state by a little along its velocity and at random, each entry by a fraction `radius` of its size. Returns the
    /// state without a change if it has no neighbour with finite values.
    pub(crate) fn near(
        &self,
        x: &Points<P::Manifold>,
        sizes: &crate::SiteVector,
        radius: f64,
    ) -> (Points<P::Manifold>, Tried) {
        for fraction in [radius, NEARER * radius, NEARER * NEARER * radius] {
            if let Some(y) = self.moved_near(fraction, x, sizes) {
                return (y, Tried::Near { fraction });
            }
        }
        (x.clone(), Tried::Start)
    }

    /// Moves a state as [`near`](Self::near) does, each entry by this fraction of its size; `None` if there are no values.
    pub(crate) fn moved_near(
        &self,
        fraction: f64,
        x: &Points<P::Manifold>,
        sizes: &crate::SiteVector,
    ) -> Option<Points<P::Manifold>> {
        let (v, _) = self.motion(x)?;
        let sized = crate::SiteVector::zip([&v, sizes], |[v, s]| if s > 0.0 { v } else { 0.0 });
        let speed = sized.relative_to(sizes);
        drop(sized);
        let time = if speed > 0.0 { speed.recip() } else { 0.0 };
        let noise = self.irregular(Use::Near, &v);
        let d = crate::SiteVector::zip([&v, &noise, sizes], |[v, noise, size]| {
            fraction * (time * v + noise * size)
        });
        self.stage(x, &d).filter(|y| self.motion(y).is_some())
    }
}

/// The sizes of entries over which differences are taken.
#[derive(Clone, Copy)]
pub(crate) enum Sizes<V> {
    /// Sizes that all sites share.
    Same(V),
    /// The size of each entry at its own site, or the given one where it is zero.
    Own(V),
}

/// A state at which laws are tried.
pub(crate) struct Trial<'a, P: Model> {
    pub(crate) lattice: &'a Lattice<P>,
    pub(crate) y: &'a Points<P::Manifold>,
    /// The sizes of the entries along which derivatives are tried.
    pub(crate) sizes: Sizes<VectorOf<P>>,
    pub(crate) tried: Tried,
    pub(crate) random: Random,
    /// The sizes `|h|` and `|s|` of a site in the mean.
    pub(crate) mean: [f64; 2],
}

impl<P: Model> Trial<'_, P> {
    fn all(&mut self, laws: &mut Laws) -> Result<(), LatticeError> {
        let Self { lattice, y, .. } = *self;
        let (all, totals) = lattice.differentials::<true>(y);
        let count = lattice.sites() as f64;
        self.mean = [totals.energy.size / count, totals.entropy.size / count];
        for site in samples(lattice.sites()) {
            self.site(site, &differentials_at::<P>(&all, site), laws)?;
        }
        let mut found = laws.fresh();
        let mut verdict = self.all_derivatives(&all, &mut found);
        if verdict.is_err() || !found.hold() {
            // The difference of a small entry is not small if it is a fraction of the largest one.
            let sizes = Sizes::Own(lattice.largest_sizes(y));
            let (trial, mut again) =
                (Trial { sizes, random: Random::new(Use::Own), ..*self }, laws.fresh());
            if trial.all_derivatives(&all, &mut again).is_ok() && again.hold() {
                (verdict, found) = (Ok(()), again);
            }
        }
        laws.merge(found);
        verdict?;
        self.conserved(&all, laws)
    }

    /// The derivatives of the functions of sites and bonds, and of the totals.
    fn all_derivatives(&self, all: &Differentials, laws: &mut Laws) -> Result<(), LatticeError> {
        let [sites, bonds] = [self.lattice.sites(), self.lattice.layout.bonds().len()];
        self.derivatives_of((samples(sites), samples(bonds)), laws)?;
        self.total_derivatives(all, laws)
    }

    /// The derivatives of the functions of these sites and bonds.
    pub(crate) fn derivatives_of(
        &self,
        (sites, bonds): (impl Iterator<Item = usize> + Clone, impl Iterator<Item = usize> + Clone),
        laws: &mut Laws,
    ) -> Result<(), LatticeError> {
        let lattice = self.lattice;
        for site in sites.clone() {
            self.derivatives(site, laws)?;
        }
        if P::BOND_ENERGY {
            for bond in bonds.clone() {
                self.bond_derivative(bond, laws)?;
            }
        }
        let gathers = lattice.parts.gathers();
        let places = (sites.clone(), bonds.clone());
        self.gathered_derivatives(ENERGY, &gathers.energy, places, laws)?;
        self.gathered_derivatives(ENTROPY, &gathers.entropy, (sites, bonds), laws)
    }

    /// The sizes of the entries at a site.
    fn sizes_at(&self, site: usize) -> VectorOf<P> {
        match &self.sizes {
            Sizes::Same(sizes) => *sizes,
            Sizes::Own(largest) => {
                let own = P::Manifold::scales(&self.y[site]);
                VectorOf::<P>::from_index(|k| if own[k] > 0.0 { own[k] } else { largest[k] })
            }
        }
    }

    /// The bracket of a site.
    fn site(
        &self,
        site: usize,
        [w, s]: &[VectorOf<P>; 2],
        laws: &mut Laws,
    ) -> Result<(), LatticeError> {
        let (parts, x, place) = (&self.lattice.parts, &self.y[site], Place::Site(site));
        let tried = self.tried;
        let mut cancels = |law, rest_and_terms, remedy| {
            cancels((law, remedy), (place, tried), rest_and_terms, laws)
        };
        let mut next = self.random.at(At::Covector(self.lattice.layout.first_site() + site));
        let mut varied = || VectorOf::<P>::from_index(|k| w[k] * (1.0 + next()));
        for _ in 0..2 {
            let alpha = varied();
            let v = parts.reversible(x, &alpha, s);
            cancels("Π = −Πᵀ", [alpha.dot(&v), alpha.abs().dot(&v.abs())], "")?;
        }
        // Along the velocity, and along what Π makes of any other differential.
        let alpha = varied();
        for covector in [w, &alpha] {
            let v = parts.reversible(x, covector, s);
            cancels("Π dS = 0", [s.dot(&v), s.abs().dot(&v.abs())], casimir_remedy::<P>())?;
        }
        Ok(())
    }

    /// The derivatives of the functions of a site.
    fn derivatives(&self, site: usize, laws: &mut Laws) -> Result<(), LatticeError> {
        let (parts, x) = (&self.lattice.parts, &self.y[site]);
        let u = self.along(site);
        let moved = |t: f64| P::Manifold::chart(x, &(u * t));
        let (place, tried) = (Place::Site(site), self.tried);
        let energy = parts.energy(site, x);
        let size = energy.value.abs().max(self.mean[0]);
        let slope = Slope::of(&energy.df, &u);
        let at = (place, tried);
        quotient(ENERGY, at, (size, slope), &|t| parts.values(site, &moved(t))[0], laws)?;
        if P::ENTROPY {
            let entropy = parts.entropy(site, x);
            let size = entropy.value.abs().max(self.mean[1]);
            let slope = Slope::of(&entropy.df, &u);
            quotient(ENTROPY, at, (size, slope), &|t| parts.values(site, &moved(t))[1], laws)?;
        }
        for k in 0..P::SUMS {
            let sum = parts.sum(k, site, x);
            let slope = Slope::of(&sum.df, &u);
            let value = |t| parts.sum(k, site, &moved(t)).value;
            quotient(SUM, at, (sum.value, slope), &value, laws)?;
        }
        Ok(())
    }

    /// A random direction at a site.
    fn along(&self, site: usize) -> VectorOf<P> {
        let place = At::Site(self.lattice.layout.first_site() + site);
        self.random.vector(place, &self.sizes_at(site))
    }

    /// A random direction of the sites of a bond.
    fn random_along(&self, bond: usize) -> Vector<PairManifold<P>> {
        let (n, ends) = (dimension::<P>(), self.lattice.layout.bonds()[bond]);
        let sizes = ends.map(|site| self.sizes_at(site as usize));
        let place = At::Bond(self.lattice.layout.number(bond));
        self.random.vector(place, &Column::from_index(|k| sizes[k / n][k % n]))
    }

    fn bond_derivative(&self, bond: usize, laws: &mut Laws) -> Result<(), LatticeError> {
        let lattice = self.lattice;
        let x = lattice.pair(self.y, bond);
        let u = self.random_along(bond);
        let value =
            |t: f64| lattice.parts.bond_value(bond, &PairManifold::<P>::chart(&x, &(u * t)));
        let jet = lattice.parts.bond_energy(bond, &x);
        let (size, at) = (jet.value.abs().max(self.mean[0]), (lattice.place_of(bond), self.tried));
        quotient(ENERGY, at, (size, Slope::of(&jet.df, &u)), &value, laws)
    }

    /// The derivative of the totals along one random direction.
    fn total_derivatives(&self, all: &Differentials, laws: &mut Laws) -> Result<(), LatticeError> {
        let Self { lattice, y, .. } = *self;
        let u: Vec<VectorOf<P>> = (0..lattice.sites()).map(|site| self.along(site)).collect();
        let moved = |t: f64| {
            let d = lattice.vector_of(|site| u[site] * t);
            lattice.moved(y, &d)
        };
        let [[h1, s1], [h0, s0]] = [moved(STEP), moved(-STEP)].map(|x| lattice.totals(&x));
        let at = (Place::Total, self.tried);
        let mut slopes = [Slope::default(); 2];
        for (site, u) in u.iter().enumerate() {
            for (slope, df) in slopes.iter_mut().zip(differentials_at::<P>(all, site)) {
                let next = Slope::of(&df, u);
                *slope = Slope { sum: slope.sum + next.sum, terms: slope.terms + next.terms };
            }
        }
        let between = |ends: [Total; 2]| move |t: f64| ends[usize::from(t < 0.0)].sum.value();
        quotient(ENERGY, at, (h0.size, slopes[0]), &between([h1, h0]), laws)?;
        if !P::ENTROPY {
            return Ok(());
        }
        quotient(ENTROPY, at, (s0.size, slopes[1]), &between([s1, s0]), laws)
    }

    /// The rates of the conserved sums.
    fn conserved(&self, all: &Differentials, laws: &mut Laws) -> Result<(), LatticeError> {
        let Self { lattice, y, .. } = *self;
        let Some((v, _)) = lattice.motion_along::<true>(y, all) else { return Ok(()) };
        for index in 0..P::SUMS {
            let mut rate = Slope::default();
            for site in 0..lattice.sites() {
                let df = lattice.parts.sum(index, site, &y[site]).df;
                let next = Slope::of(&df, &v.reader().at(site));
                rate = Slope { sum: rate.sum + next.sum, terms: rate.terms + next.terms };
            }
            let is_broken = rate.sum.abs() > CANCELS * rate.terms;
            // 0/0 = 0: a sum that nothing changes is kept.
            let size = if rate.sum == 0.0 { 0.0 } else { rate.sum.abs() / rate.terms };
            let found = || LatticeLaw::new("⟨dL, x'⟩ = 0", [size, CANCELS], Place::Total);
            laws.note(found, !is_broken, || LatticeError::NotConserved { index, size })?;
        }
        Ok(())
    }
}

/// The functions whose derivatives are compared with their values, and the laws of these.
const ENERGY: (&str, &str) = ("energy", "⟨dH, u⟩ = ΔH");
const ENTROPY: (&str, &str) = ("entropy", "⟨dS, u⟩ = ΔS");
const SUM: (&str, &str) = ("conserved sum", "⟨dL, u⟩ = ΔL");

const CASIMIR: &str = "; the entropy of a site must be a Casimir of its bracket";
const GATHERED_CASIMIR: &str = "; the entropy of a site and what it gathers must not depend on what the bracket moves; \
     gather such a density in the energy, by `.gather(..)`, and take the entropy of each site as a variable";

/// The remedy where `Π dS = 0` is broken.
pub(crate) const fn casimir_remedy<P: Model>() -> &'static str {
    if P::EntropyGather::PRESENT { GATHERED_CASIMIR } else { CASIMIR }
}

/// Compares what is left of terms with their sizes. Products of numbers below 10⁻¹⁵⁴ have lost their digits, and are zero.
///
/// A state that a run has reached is less regular than a start, and what is left of terms may be ten times larger.
///
/// # Errors
///
/// [`LatticeError::Broken`].
pub(crate) fn cancels(
    (law, remedy): (&'static str, &'static str),
    (place, tried): (Place, Tried),
    [rest, terms]: [f64; 2],
    laws: &mut Laws,
) -> Result<(), LatticeError> {
    let bound = if tried == Tried::Reached { 10.0 * CANCELS } else { CANCELS };
    // Terms that are no number cancel nothing.
    let has_digits = terms >= f64::MIN_POSITIVE / f64::EPSILON || terms.is_nan();
    let holds = rest.abs() <= bound * terms || !has_digits;
    let size = || if has_digits { rest.abs() / terms } else { 0.0 };
    let found = || LatticeLaw::new(law, [size(), bound], place);
    laws.note(found, holds, || LatticeError::Broken {
        law,
        place,
        tried,
        size: size(),
        entries: Vec::new(),
        remedy,
    })
}

/// A derivative along a direction, and the sizes of its terms.
#[derive(Clone, Copy, Default)]
struct Slope {
    sum: f64,
    terms: f64,
}

impl Slope {
    fn of<V: Column<f64>>(df: &V, u: &V) -> Self {
        Self { sum: df.dot(u), terms: df.abs().dot(&u.abs()) }
    }
}

/// Compares a derivative with the change of the values along a direction.
///
/// A state that a run has reached may be one where values are the round-off of larger terms, as between sites at rest. Such
/// differences are no derivative of anything: over another distance they have another quotient.
fn quotient(
    (what, law): (&'static str, &'static str),
    (place, tried): (Place, Tried),
    (size, slope): (f64, Slope),
    value: &dyn Fn(f64) -> f64,
    laws: &mut Laws,
) -> Result<(), LatticeError> {
    let over = |step: f64| [value(step), value(-step)];
    let [after, before] = over(STEP);
    let quotient = (after - before) / (2.0 * STEP);
    let round_off = 16.0 * f64::EPSILON * size.abs().max(after.abs()) / STEP;
    // The quotient is as large as the terms unless it is round-off, or a derivative is missing.
    let terms = slope.terms.max(quotient.abs());
    let off = (quotient - slope.sum).abs();
    let mut holds = off <= QUOTIENT * terms + round_off || !quotient.is_finite();
    if !holds && tried == Tried::Reached {
        let [after, before] = over(FAR_STEP);
        let [near, far] = [quotient, (after - before) / (2.0 * FAR_STEP)].map(|q| q - slope.sum);
        // A jump of the derivative on the way is no wrong one.
        holds = (near - far).abs() > SAME * near.abs() || !far.is_finite();
    }
    let found = || {
        // 0/0 = 0, and a value nearby that is not finite decides nothing.
        let decides = off > 0.0 && quotient.is_finite();
        let sizes = [off, QUOTIENT * terms + round_off].map(|size| size / terms);
        LatticeLaw::new(law, if decides { sizes } else { [0.0, QUOTIENT] }, place)
    };
    let derivative = slope.sum;
    laws.note(found, holds, || LatticeError::WrongDerivative { what, place, derivative, quotient })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_that_are_no_number_cancel_nothing() {
        let holds = |rest_and_terms| {
            let at = (Place::Total, Tried::Start);
            cancels(("Π dS = 0", ""), at, rest_and_terms, &mut Laws::first()).is_ok()
        };
        assert!(holds([1e-12, 1.0]) && holds([0.0, 0.0]));
        assert!(!holds([1e-6, 1.0]) && !holds([f64::NAN, 1.0]) && !holds([0.0, f64::NAN]));
    }
}
