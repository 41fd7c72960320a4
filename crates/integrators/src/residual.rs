//! The implicit equation of one step.

use std::cell::{Cell, OnceCell};

use metriplectic_dynamics::orthogonal::{Orthogonal, WithJacobian};
use metriplectic_dynamics::velocity::{
    Covectors, Gradient, VelocityJet, differentials, irreversible, reversible, velocity_jet,
};
use metriplectic_dynamics::{Metriplectic, SecondLaw, system::Point};
use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, Scalar, ScalarField, Space, Square, Vector, differential,
};
use metriplectic_manifolds::{
    InnerProduct, Manifold, MetricError, Nodes, Retraction, Riemannian, StepPath, StepPathJet,
};

use crate::discrete_gradient::{DiscreteGradient, Segment, StableGradient};

use crate::root_finder::{Equation, Linearised, Root, Rounding};
use crate::trajectory::entropy_round_off;

/// The equation of one step (Bloch, Farré Puiggalí, Martín de Diego 2024, §4.4), as a function of
/// the initial displacement `u ∈ T_xM` of the path:
///
/// ```math
/// F(u) = d - h \bigl( \tilde\Pi\, w_H + \tilde K_{w_H} w_S \bigr) = 0 ,
/// ```
///
/// with `(z, d) = R_h⁻¹(x, x')` the base point and displacement of the path, and `w_H` a discrete
/// gradient of `H` along it. Both tensors annihilate `w_H`, so a root keeps `H`. In the scheme as published
/// `w_S` is `dS(z)` and `Π̃ = Π(z)`; in the exact one `w_S` is a discrete gradient of `S`, which `Π̃`
/// annihilates, so that `ΔS = h K̃(w_S, w_S) ≥ 0` ([`velocity`](metriplectic_dynamics::velocity)). No logarithm is
/// taken: the path is shot from `x`.
#[derive(Debug)]
pub struct Residual<'a, Y: Metriplectic, R, W> {
    system: &'a Y,
    retraction: &'a R,
    gradient: &'a W,
    x: &'a Point<Y>,
    h: f64,
    energy: f64,
    entropy: f64,
    drift_correction: DriftCorrection<Y>,
    entropy_slope: Cell<f64>,
    dissipates: Cell<bool>,
    friction: Cell<Option<f64>>,
    rotation: Cell<f64>,
}

/// What earlier steps have left over of the energy, the entropy and the further invariants, and this step
/// takes back.
#[derive(Clone, Copy, Debug)]
pub struct DriftCorrection<Y: Metriplectic> {
    /// Of the energy.
    pub energy: f64,
    /// Of the entropy, as long as nothing is dissipated.
    pub entropy: f64,
    /// Of each further invariant.
    pub invariants: Numbers<Y>,
}

/// A number for each further invariant of a system.
pub type Numbers<Y> = <<<Y as Metriplectic>::Manifold as Space>::Dim as Dimension>::Array<f64>;

impl<Y: Metriplectic> DriftCorrection<Y> {
    /// Nothing is taken back, as in the definition of the scheme.
    pub fn nothing() -> Self {
        Self { energy: 0.0, entropy: 0.0, invariants: Dim::<Y>::array(|_| 0.0) }
    }
}

/// A root corrected for its energy.
pub(crate) struct LastCorrection<M: Manifold> {
    pub(crate) u: Vector<M>,
    pub(crate) end: M::Point<f64>,
    /// Whether the end is no longer that of `u`.
    pub(crate) moved: bool,
}

/// A few roundings, relative to the size of what is rounded.
const ROUNDED: f64 = 4.0 * f64::EPSILON;

/// The dimension of the manifold of a system.
pub(crate) type Dim<Y> = <<Y as Metriplectic>::Manifold as Space>::Dim;

/// The residual with its Jacobian, and what is in it: the discrete gradients `w_H` and `w_S`, the displacement,
/// and the growth of the entropy by friction, `h⟨w_S, K̃ w_S⟩`.
struct Jet<M: Space> {
    at: Linearised<M>,
    energy: Vector<M>,
    entropy: Vector<M>,
    d: Vector<M>,
    growth: f64,
}

/// The inner product in which `sizes` are units: `G(u, v) = Σ u_i v_i / s_i²`. The shortest way to a level of
/// a function is then the one that changes each component by a like fraction of its size.
#[derive(Clone, Copy)]
struct InUnits<V>(V);

impl<V: Column<f64>> InnerProduct<V> for InUnits<V> {
    fn flat(&self, v: &V) -> V {
        V::from_index(|i| v[i] / self.0[i] / self.0[i])
    }

    fn orthonormal(&self, alpha: &V) -> V {
        V::from_index(|i| alpha[i] * self.0[i])
    }

    fn from_orthonormal(&self, a: &V) -> V {
        V::from_index(|i| a[i] * self.0[i])
    }
}

/// The size `|F| + Σ_i |∂_iF x_i|` of the terms of a field at a point, to which the round-off of its value
/// is relative.
pub(crate) fn size_of_terms<M: Manifold>(f: &impl ScalarField<M>, x: &M::Point<f64>) -> f64 {
    let jet = f.jet1(x);
    jet.value.abs() + jet.df.abs().dot(&M::scales(x))
}

impl<'a, Y, R, W> Residual<'a, Y, R, W>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    /// The equation of a step of size `h` from `x`.
    pub fn new(
        system: &'a Y,
        (retraction, gradient): (&'a R, &'a W),
        x: &'a Point<Y>,
        h: f64,
    ) -> Self {
        let values = [system.energy_at(x), system.entropy_at(x)];
        Self::with_drift_correction(
            system,
            (retraction, gradient),
            (x, values),
            h,
            DriftCorrection::nothing(),
        )
    }

    /// The same for a point with known energy and entropy, and errors of earlier steps to take back.
    #[inline]
    pub(crate) fn with_drift_correction(
        system: &'a Y,
        (retraction, gradient): (&'a R, &'a W),
        (x, [energy, entropy]): (&'a Point<Y>, [f64; 2]),
        h: f64,
        drift_correction: DriftCorrection<Y>,
    ) -> Self {
        let (entropy_slope, dissipates) = (Cell::new(f64::INFINITY), Cell::new(true));
        let (friction, rotation) = (Cell::new(None), Cell::new(0.0));
        Self {
            system,
            retraction,
            gradient,
            x,
            h,
            energy,
            entropy,
            drift_correction,
            entropy_slope,
            dissipates,
            friction,
            rotation,
        }
    }

    /// The rate of the reversible motion in a step, where the Jacobian was formed last.
    pub(crate) const fn rotation(&self) -> f64 {
        self.rotation.get()
    }

    /// The equation of a step of a fraction of the size, which takes nothing back.
    pub(crate) fn of_fraction(&self, fraction: f64) -> Self {
        let parts = (self.retraction, self.gradient);
        let start = (self.x, [self.energy, self.entropy]);
        Self::with_drift_correction(
            self.system,
            parts,
            start,
            self.h * fraction,
            DriftCorrection::nothing(),
        )
    }

    /// The rate `h|K'|` of the friction in a step, where the Jacobian was formed last; `None` if it never
    /// was. The midpoint rule multiplies a deviation that decays at the rate `λ` by
    /// `(1 − hλ/2)/(1 + hλ/2)`, which tends to −1.
    pub(crate) const fn friction(&self) -> Option<f64> {
        self.friction.get()
    }

    /// The residual by its definition, at any scalar.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the path cannot be followed.
    pub fn at<D: Scalar>(
        &self,
        u: &Vector<Y::Manifold, D>,
    ) -> Result<Vector<Y::Manifold, D>, MetricError> {
        let metric = self.system.metric();
        let path = self.retraction.step_path(metric, self.x, u)?;
        let g = metric.at(&path.z)?;
        let mut defined = Defined { gradient: self.gradient, g: &g, x: self.x, path: &path };
        let entropy = if self.is_exact() {
            defined.of(self.system.entropy())
        } else {
            differential(self.system.entropy(), &path.z)
        };
        let laws = [defined.of(self.system.energy()), entropy];
        let w = Covectors::new(laws, self.system.invariants(), &mut defined);
        let velocity =
            reversible(self.system, &path.z, &w)? + irreversible(self.system, &path.z, &w)?;
        Ok(path.d - velocity * D::from(self.h))
    }

    /// Whether the entropy has a discrete gradient.
    fn is_exact(&self) -> bool {
        self.system.second_law() == SecondLaw::Exact
    }

    /// `|w_S|` at the point evaluated last.
    pub(crate) fn entropy_slope(&self) -> f64 {
        self.entropy_slope.get().sqrt()
    }

    /// Whether the entropy production `⟨w_S, K̃ w_S⟩` is more than the square of its round-off: a million
    /// steps of it change the entropy by more than a rounding.
    fn is_dissipation(&self, production: f64) -> bool {
        self.h.abs() * production > 1e-6 * f64::EPSILON * self.entropy.abs()
    }

    /// Whether anything was dissipated at the point evaluated last.
    pub(crate) const fn dissipates(&self) -> bool {
        self.dissipates.get()
    }

    /// The error `e = H(x') − H(x) + drift_correction` of the energy at the end of a path, where it is `energy`.
    #[inline]
    fn imbalance(&self, energy: f64) -> f64 {
        energy - self.energy + self.drift_correction.energy
    }

    /// The same at a point.
    fn imbalance_at(&self, end: &Point<Y>) -> f64 {
        self.imbalance(self.system.energy_at(end))
    }

    /// One more correction for a root with the end `x'` at which the energy is not kept to round-off:
    /// the corrected root, and its end.
    ///
    /// Both brackets annihilate `w`, so `⟨w, F(u)⟩ = e` for every `u`. Once `h|Π|` is large the sum
    /// `d − h(Πw + K dS)` has lost digits of this number that the difference `H(x') − H(x)` has. So
    /// the last correction is that of the residual whose part along `w` is exact,
    /// `F + (e − ⟨w, F⟩) ♯w/⟨w, ♯w⟩`, with `♯` in units of the round-off of each component, as long as this
    /// changes `F` within its round-off and reduces `e`.
    ///
    /// Where the end is nearer to the edge of a domain than the displacement has digits, no `u` has the
    /// right energy, and a numerical geodesic has an error of its own: there the end itself is moved, within
    /// the accuracy of geodesics.
    #[inline]
    pub(crate) fn last_correction(
        &self,
        root: &Root<Y::Manifold>,
        end: &Point<Y>,
        [energy, entropy]: [f64; 2],
    ) -> Option<LastCorrection<Y::Manifold>> {
        let e = self.imbalance(energy);
        let corrected = if self.is_balanced(e) { None } else { self.correct(root, end, e) };
        let falls = entropy - self.entropy < -ROUNDED * self.entropy.abs();
        if corrected.is_none() && falls && self.is_exact() {
            return self.correct_entropy(root, end, e);
        }
        corrected
    }

    /// One more correction for a root at whose end the entropy has fallen by nearly its round-off, if it then
    /// falls by less.
    #[cold]
    fn correct_entropy(
        &self,
        Root { u, .. }: &Root<Y::Manifold>,
        end: &Point<Y>,
        e: f64,
    ) -> Option<LastCorrection<Y::Manifold>> {
        let entropy = self.system.entropy_at(end);
        if self.entropy - entropy <= 0.5 * entropy_round_off(self.system, [self.x, end]) {
            return None;
        }
        let (u, end) =
            self.corrected(u, e, Some(entropy - self.entropy + self.drift_correction.entropy))?;
        let better = self.system.entropy_at(&end) > entropy;
        let balanced = self.imbalance_at(&end).abs() <= e.abs().max(ROUNDED * self.energy.abs());
        (better && balanced).then_some(LastCorrection { u, end, moved: false })
    }

    /// Whether the ends of geodesics are good to a few roundings.
    fn has_closed_geodesics(&self) -> bool {
        self.system.metric().accuracy() <= ROUNDED
    }

    /// Whether an error of the energy is within a few roundings of its value.
    #[inline]
    fn is_balanced(&self, e: f64) -> bool {
        e.abs() <= ROUNDED * self.energy.abs()
    }

    /// The last correction, for an error `e` of the energy.
    #[cold]
    fn correct(
        &self,
        Root { u, floor, .. }: &Root<Y::Manifold>,
        end: &Point<Y>,
        e: f64,
    ) -> Option<LastCorrection<Y::Manifold>> {
        // Where the round-off of the equation is near that of the entries of x', an error within the
        // roundings of the energy's terms needs no correction.
        let coarse = *floor > 2.0 * ROUNDED * Y::Manifold::magnitude(self.x);
        if self.has_closed_geodesics()
            && !coarse
            && e.abs() <= ROUNDED * size_of_terms::<Y::Manifold>(self.system.energy(), end)
        {
            return None;
        }
        let closed = self.has_closed_geodesics();
        if !closed && let Some(end) = self.settle(u, end) {
            return Some(LastCorrection { u: *u, end, moved: true });
        }
        let balanced = self.balance(u, e);
        let (u, at) = balanced.as_ref().map_or((u, end), |(u, end)| (u, end));
        if (closed || balanced.is_some())
            && let Some(end) = self.settle(u, at)
        {
            return Some(LastCorrection { u: *u, end, moved: true });
        }
        balanced.map(|(u, end)| LastCorrection { u, end, moved: false })
    }

    /// The end `x'` moved onto the level of the energy, within the accuracy of geodesics: by the shortest
    /// way within a rounding; beyond it along the levels of the entropy and the further invariants, or of the
    /// entropy alone where the differential of the energy hardly differs from theirs.
    fn settle(&self, u: &Vector<Y::Manifold>, end: &Point<Y>) -> Option<Point<Y>> {
        let e = self.imbalance_at(end);
        if self.is_balanced(e) {
            return None;
        }
        // The entries of x' = x + u are rounded in units of x and of u, however small they are.
        let sizes = Y::Manifold::scales(self.x) + u.abs();
        let g = InUnits(sizes);
        let w = differentials(self.system, &ChartPoint::<Y::Manifold>::centre(end));
        let limit = self.system.metric().accuracy() * (Dim::<Y>::LEN as f64).sqrt();
        let moved = |kept: &Orthogonal<Dim<Y>>| {
            let across = g.sharp(&kept.project_covector(0, &w.energy));
            let off = across * (-e / across.dot(&w.energy));
            let within = (0..Dim::<Y>::LEN).all(|i| off[i].abs() <= limit * sizes[i]);
            let settled = Y::Manifold::chart(end, &off);
            let better = self.imbalance_at(&settled).abs() < e.abs();
            (within && better).then_some(settled)
        };
        let mut kept = Orthogonal::<Dim<Y>>::default();
        if self.has_closed_geodesics() {
            return moved(&kept);
        }
        if self.is_exact() {
            kept.push(&g, &w.entropy);
        }
        let entropy = kept;
        for (_, l) in w.invariants.as_ref().iter().flatten() {
            kept.push(&g, l);
        }
        moved(&kept).or_else(|| moved(&entropy))
    }

    /// The root with the energy corrected by its error `e`, if that makes it smaller.
    fn balance(&self, u: &Vector<Y::Manifold>, e: f64) -> Option<(Vector<Y::Manifold>, Point<Y>)> {
        let (u, end) = self.corrected(u, e, None)?;
        (self.imbalance_at(&end).abs() < e.abs()).then_some((u, end))
    }

    /// A root after one more correction, in whose residual the part along `w_H` is the error `e` of the energy,
    /// and the one along `w_S` belongs to the `change` of the entropy, if this is given.
    fn corrected(
        &self,
        u: &Vector<Y::Manifold>,
        e: f64,
        change: Option<f64>,
    ) -> Option<(Vector<Y::Manifold>, Point<Y>)> {
        let Jet { at, energy, entropy, d, growth } = self.jet(u)?;
        let rounding = at.rounding.bounds(&at.jacobian) + d.abs() * f64::EPSILON;
        // Each component takes its part in units of its own round-off, and of what is left of it.
        let bounds = rounding + at.residual.abs();
        let g = InUnits(bounds);
        let mut exact = at.residual;
        let mut across = Orthogonal::<Dim<Y>>::default();
        let parts = [Some((energy, e)), change.map(|change| (entropy, change - growth))];
        for (w, part) in parts.into_iter().flatten() {
            let sharp = g.sharp(&across.project_covector(0, &w));
            across.push(&g, &w);
            exact += sharp * ((part - w.dot(&exact)) / sharp.dot(&w));
        }
        let u = *u - at.jacobian.solve(&exact)?;
        let end = self.retraction.end(self.system.metric(), self.x, &u).ok()?;
        let lost = exact - at.residual;
        let within = (0..Dim::<Y>::LEN).all(|i| lost[i].abs() <= bounds[i]);
        within.then_some((u, end))
    }

    /// The residual, safe against round-off.
    #[inline]
    fn evaluate(&self, u: &Vector<Y::Manifold>) -> Option<Vector<Y::Manifold>> {
        let (system, metric) = (self.system, self.system.metric());
        let path = self.retraction.real_step_path(metric, self.x, u).ok()?;
        let g = metric.at(&path.z).ok()?;
        let along = Along::new(self, u, &g, Segment::new(&path.d, &path.end));
        let energy =
            along.value(system.energy(), (self.energy, self.drift_correction.energy), &path);
        let entropy = if self.is_exact() {
            let w =
                along.value(system.entropy(), (self.entropy, self.drift_correction.entropy), &path);
            self.entropy_slope.set(w.dot(&w));
            w
        } else {
            system.entropy().jet1(&path.z.base).df
        };
        let mut values = Values { along: &along, path: &path, seen: 0 };
        let w = Covectors::new([energy, entropy], system.invariants(), &mut values);
        let friction = irreversible(system, &path.z, &w).ok()?;
        self.dissipates.set(self.is_dissipation(w.entropy.dot(&friction)));
        let velocity = reversible(system, &path.z, &w).ok()? + friction;
        let residual = path.d - velocity * self.h;
        residual.is_finite().then_some(residual)
    }

    /// The residual with its Jacobian, and `w_H`, from the jets `(f, df, Hf)` of the fields: no nested
    /// dual number is formed.
    #[inline]
    fn jet(&self, u: &Vector<Y::Manifold>) -> Option<Jet<Y::Manifold>> {
        let (system, metric, h) = (self.system, self.system.metric(), self.h);
        let path = self.retraction.step_path_jet(metric, self.x, u).ok()?;
        let g = metric.at(&ChartPoint::<Y::Manifold>::centre(&path.z)).ok()?;
        let slopes = metric.slopes(&path.z);
        let segment = Segment::new(&path.d, &path.end);
        let (along, slopes) = (Along::new(self, u, &g, segment), slopes.as_ref());
        let start = (self.energy, self.drift_correction.energy);
        let (energy, chord, steepness) = along.jet(system.energy(), start, &path, slopes);
        let entropy = if self.is_exact() {
            along
                .jet(system.entropy(), (self.entropy, self.drift_correction.entropy), &path, slopes)
                .0
        } else {
            let jet = system.entropy().jet2(&path.z);
            WithJacobian { value: jet.df, slope: jet.hf * path.dz }
        };
        let mut jets = Jets { along: &along, path: &path, slopes, seen: 0 };
        let w = Covectors::new([energy, entropy], system.invariants(), &mut jets);
        let VelocityJet { velocity, terms, gain, production, friction, rotation } =
            velocity_jet(system, &path.z, &path.dz, &w).ok()?;
        self.dissipates.set(self.is_dissipation(production));
        // Half of a displacement reaches z.
        self.friction.set(Some(2.0 * h.abs() * friction));
        self.rotation.set(2.0 * h.abs() * rotation);

        let residual = path.d - velocity.value * h;
        let jacobian = path.dd - velocity.slope * h;
        // Near the edge of a domain dH is far steeper at x' than at z, and the rounding of d counts there.
        let noise = chord.noise(&g, &path.d) + steepness * f64::EPSILON;
        let rounding = Rounding {
            // What underflows is no larger than the least normal number.
            terms: Vector::<Y::Manifold>::from_index(|i| {
                ROUNDED * h.abs() * terms[i] + f64::MIN_POSITIVE * (1.0 + h.abs())
            }),
            gain: gain * h,
            noise,
            argument: (Y::Manifold::scales(self.x) + path.d.abs()) * f64::EPSILON,
        };
        let usable = residual.is_finite() && jacobian.magnitude().is_finite();
        let at = Linearised { residual, jacobian, rounding };
        usable.then_some(Jet {
            at,
            energy: energy.value,
            entropy: entropy.value,
            d: path.d,
            growth: h * production,
        })
    }
}

impl<Y, R, W> Equation<Y::Manifold> for Residual<'_, Y, R, W>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    /// The residual, safe against round-off.
    #[inline]
    fn value(&self, u: &Vector<Y::Manifold>) -> Option<Vector<Y::Manifold>> {
        self.evaluate(u)
    }

    #[inline]
    fn linearise(&self, u: &Vector<Y::Manifold>) -> Option<Linearised<Y::Manifold>> {
        self.jet(u).map(|jet| jet.at)
    }
}

/// Discrete gradients along one path by their definition.
struct Defined<'a, M: Manifold, D: Scalar, G, W> {
    gradient: &'a W,
    g: &'a G,
    x: &'a M::Point<f64>,
    path: &'a StepPath<M, D>,
}

impl<M, D, G, W> Gradient<M> for Defined<'_, M, D, G, W>
where
    M: Manifold,
    D: Scalar,
    G: InnerProduct<Vector<M, D>>,
    W: DiscreteGradient,
{
    type Covector = Vector<M, D>;

    fn of(&mut self, f: &impl ScalarField<M>) -> Vector<M, D> {
        self.gradient.covector(f, self.g, (self.x, f.at(self.x)), self.path)
    }
}

/// One path at real points, along which fields get discrete gradients that are safe against
/// round-off.
struct Along<'a, Y: Metriplectic, R, W, G> {
    step: &'a Residual<'a, Y, R, W>,
    u: &'a Vector<Y::Manifold>,
    g: &'a G,
    segment: Segment<'a, Y::Manifold>,
    nodes: OnceCell<Nodes<Y::Manifold>>,
}

impl<'a, Y, R, W, G> Along<'a, Y, R, W, G>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
    G: InnerProduct<Vector<Y::Manifold>>,
{
    const fn new(
        step: &'a Residual<'a, Y, R, W>,
        u: &'a Vector<Y::Manifold>,
        g: &'a G,
        segment: Segment<'a, Y::Manifold>,
    ) -> Self {
        Self { step, u, g, segment, nodes: OnceCell::new() }
    }

    /// The data of the discrete gradient of `f` on the path with the base `z` and the end `x'`, from its
    /// values at `x` and `x'`.
    #[inline]
    fn chord(
        &self,
        f: &impl ScalarField<Y::Manifold>,
        mean: &Vector<Y::Manifold>,
        [z, end]: [&Point<Y>; 2],
        values: [f64; 2],
    ) -> StableGradient<Y::Manifold> {
        let base = || self.step.gradient.slope_at_base(f, z, self.segment.d, mean);
        let nodes = || {
            let Residual { system, retraction, x, .. } = self.step;
            // The same path has been followed to its end, so the alternative is not reached.
            retraction.along(system.metric(), x, self.u).unwrap_or_else(|_| Nodes {
                ends: [*x, end].map(Y::Manifold::constant),
                middle: None,
            })
        };
        let nodes = || self.nodes.get_or_init(nodes);
        StableGradient::new(f, mean, &self.segment, values, base, nodes)
    }

    /// The discrete gradient of `f`, with `⟨w, d⟩ = f(x') − start + drift_correction`.
    #[inline]
    fn value(
        &self,
        f: &impl ScalarField<Y::Manifold>,
        (start, drift_correction): (f64, f64),
        path: &StepPath<Y::Manifold>,
    ) -> Vector<Y::Manifold> {
        let mean = self.step.gradient.real_mean(f, self.step.x, path);
        let values = [start, f.at(&path.end)];
        let chord = self.chord(f, &mean, [&path.z.base, &path.end], values);
        chord.covector(drift_correction, self.g, &path.d)
    }

    /// The same with its derivatives, and the absolute components of `dF(x')`.
    #[inline]
    fn jet(
        &self,
        f: &impl ScalarField<Y::Manifold>,
        (start, drift_correction): (f64, f64),
        path: &StepPathJet<Y::Manifold>,
        slopes: Option<&Slopes<Y::Manifold>>,
    ) -> CovectorJet<Y::Manifold> {
        let (mean, dmean) = self.step.gradient.mean_jet(f, self.step.x, path);
        let end = f.jet1(&path.end);
        let chord = self.chord(f, &mean, [&path.z, &path.end], [start, end.value]);
        let value = chord.covector(drift_correction, self.g, &path.d);
        let slope = chord.slope(drift_correction, (self.g, slopes), path, &dmean, &end.df);
        (WithJacobian { value, slope }, chord, end.df.abs())
    }
}

/// A discrete gradient with its derivatives, its data, and the absolute components of `dF(x')`.
type CovectorJet<M> = (WithJacobian<<M as Space>::Dim>, StableGradient<M>, Vector<M>);

/// The derivatives of a metric along the chart.
type Slopes<M> = <<M as Space>::Dim as Dimension>::Array<Matrix<M>>;

/// The discrete gradients of the further invariants, one after the other.
struct Values<'a, Y: Metriplectic, R, W, G> {
    along: &'a Along<'a, Y, R, W, G>,
    path: &'a StepPath<Y::Manifold>,
    seen: usize,
}

impl<Y, R, W, G> Gradient<Y::Manifold> for Values<'_, Y, R, W, G>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
    G: InnerProduct<Vector<Y::Manifold>>,
{
    type Covector = Vector<Y::Manifold>;

    fn of(&mut self, f: &impl ScalarField<Y::Manifold>) -> Vector<Y::Manifold> {
        let Residual { x, drift_correction, .. } = self.along.step;
        let drift_correction = drift_correction.invariants[self.seen];
        self.seen += 1;
        self.along.value(f, (f.at(x), drift_correction), self.path)
    }
}

/// The same with their derivatives.
struct Jets<'a, Y: Metriplectic, R, W, G> {
    along: &'a Along<'a, Y, R, W, G>,
    path: &'a StepPathJet<Y::Manifold>,
    slopes: Option<&'a Slopes<Y::Manifold>>,
    seen: usize,
}

impl<Y, R, W, G> Gradient<Y::Manifold> for Jets<'_, Y, R, W, G>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
    G: InnerProduct<Vector<Y::Manifold>>,
{
    type Covector = WithJacobian<Dim<Y>>;

    fn of(&mut self, f: &impl ScalarField<Y::Manifold>) -> WithJacobian<Dim<Y>> {
        let Residual { x, drift_correction, .. } = self.along.step;
        let drift_correction = drift_correction.invariants[self.seen];
        self.seen += 1;
        self.along.jet(f, (f.at(x), drift_correction), self.path, self.slopes).0
    }
}
