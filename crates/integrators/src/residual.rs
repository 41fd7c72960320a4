//! The implicit equation of one step.

use std::cell::{Cell, OnceCell};

use metriplectic_dynamics::orthogonal::{Moving, Orthogonal};
use metriplectic_dynamics::velocity::{
    Covectors, Gradient, VelocityJet, differentials, irreversible, reversible, velocity_jet,
};
use metriplectic_dynamics::{Metriplectic, SecondLaw, system::Point};
use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, Scalar, ScalarField, Space, Square, Vector, differential,
};
use metriplectic_manifolds::{
    Arc, ArcJet, Canonical, InnerProduct, Manifold, MetricError, Nodes, Retraction, Riemannian,
};

use crate::discrete_gradient::{Chord, DiscreteGradient, Segment};
use crate::root_finder::{Equation, Linearised, Root};

/// The equation of one step (Bloch, Farré Puiggalí, Martín de Diego 2024, §4.4), as a function of
/// the initial displacement `u ∈ T_xM` of the arc:
///
/// ```math
/// F(u) = d - h \bigl( \tilde\Pi\, w_H + \tilde K_{w_H} w_S \bigr) = 0 ,
/// ```
///
/// with `(z, d) = R_h⁻¹(x, x')` the base point and displacement of the arc, and `w_H` a discrete
/// gradient of `H` along it. Both tensors kill `w_H`, so a root keeps `H`. In the scheme as published
/// `w_S` is `dS(z)` and `Π̃ = Π(z)`; in the exact one `w_S` is a discrete gradient of `S`, which `Π̃`
/// kills, so that `ΔS = h K̃(w_S, w_S) ≥ 0` ([`velocity`](metriplectic_dynamics::velocity)). No logarithm is
/// taken: the arc is shot from `x`.
#[derive(Debug)]
pub struct Residual<'a, Y: Metriplectic, R, W> {
    system: &'a Y,
    retraction: &'a R,
    gradient: &'a W,
    x: &'a Point<Y>,
    h: f64,
    energy: f64,
    entropy: f64,
    recall: Recall<Y>,
    entropy_slope: Cell<f64>,
    dissipates: Cell<bool>,
    sizes: Cell<Option<Sizes>>,
}

/// The sizes of the terms of an equation, by which its round-off is judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sizes {
    /// Of the terms that the velocity is summed of.
    pub(crate) terms: f64,
    /// Of the derivative of the velocity along `w_H`.
    pub(crate) gain: f64,
}

impl Sizes {
    /// The round-off of the equation of a step of size `h` and length `length`: the terms of `Πw` and
    /// `K dS` are rounded, and so are `w`, by `noise`, and `d`.
    #[inline]
    fn floor(&self, h: f64, length: f64, noise: f64) -> f64 {
        let h = h.abs();
        f64::EPSILON * (4.0 * h * self.terms + length) + h * self.gain * noise
    }
}

/// What earlier steps have left over of the energy, the entropy and the further invariants, and this step
/// takes back.
#[derive(Clone, Copy, Debug)]
pub struct Recall<Y: Metriplectic> {
    /// Of the energy.
    pub energy: f64,
    /// Of the entropy, as long as nothing is dissipated.
    pub entropy: f64,
    /// Of each further invariant.
    pub invariants: Numbers<Y>,
}

/// A number for each further invariant of a system.
pub type Numbers<Y> = <<<Y as Metriplectic>::Manifold as Space>::Dim as Dimension>::Array<f64>;

impl<Y: Metriplectic> Recall<Y> {
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

/// The dimension of the manifold of a system.
pub(crate) type Dim<Y> = <<Y as Metriplectic>::Manifold as Space>::Dim;

/// The residual with its Jacobian, and the discrete gradient `w_H` in it.
struct Jet<M: Space> {
    at: Linearised<M>,
    w: Vector<M>,
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
        Self::recalling(system, (retraction, gradient), (x, values), h, Recall::nothing())
    }

    /// The same for a point with known energy and entropy, and errors of earlier steps to take back.
    #[inline]
    pub(crate) fn recalling(
        system: &'a Y,
        (retraction, gradient): (&'a R, &'a W),
        (x, [energy, entropy]): (&'a Point<Y>, [f64; 2]),
        h: f64,
        recall: Recall<Y>,
    ) -> Self {
        let (entropy_slope, dissipates) = (Cell::new(f64::INFINITY), Cell::new(true));
        let sizes = Cell::new(None);
        Self {
            system,
            retraction,
            gradient,
            x,
            h,
            energy,
            entropy,
            recall,
            entropy_slope,
            dissipates,
            sizes,
        }
    }

    /// The same with the sizes of an equation near by, so that the Jacobian need not be formed.
    #[inline]
    pub(crate) fn with_sizes(self, sizes: Option<Sizes>) -> Self {
        self.sizes.set(sizes);
        self
    }

    /// The equation of a step of a share of the size, which takes nothing back.
    pub(crate) fn of_share(&self, share: f64) -> Self {
        let parts = (self.retraction, self.gradient);
        let start = (self.x, [self.energy, self.entropy]);
        Self::recalling(self.system, parts, start, self.h * share, Recall::nothing())
    }

    /// The sizes that round-off is judged by, if they are known.
    pub(crate) const fn sizes(&self) -> Option<Sizes> {
        self.sizes.get()
    }

    /// The residual by its definition, at any scalar.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the arc cannot be followed.
    pub fn at<D: Scalar>(
        &self,
        u: &Vector<Y::Manifold, D>,
    ) -> Result<Vector<Y::Manifold, D>, MetricError> {
        let metric = self.system.metric();
        let arc = self.retraction.arc(metric, self.x, u)?;
        let g = metric.at(&arc.z)?;
        let mut defined = Defined { gradient: self.gradient, g: &g, x: self.x, arc: &arc };
        let entropy = if self.is_exact() {
            defined.of(self.system.entropy())
        } else {
            differential(self.system.entropy(), &arc.z)
        };
        let laws = [defined.of(self.system.energy()), entropy];
        let w = Covectors::new(laws, self.system.invariants(), &mut defined);
        let velocity =
            reversible(self.system, &arc.z, &w)? + irreversible(self.system, &arc.z, &w)?;
        Ok(arc.d - velocity * D::from(self.h))
    }

    /// Whether the entropy has a discrete gradient.
    fn is_exact(&self) -> bool {
        self.system.second_law() == SecondLaw::Exact
    }

    /// `|w_S|` at the point evaluated last.
    pub(crate) fn entropy_slope(&self) -> f64 {
        self.entropy_slope.get().sqrt()
    }

    /// Whether `K̃ w_S` was not zero at the point evaluated last.
    pub(crate) const fn dissipates(&self) -> bool {
        self.dissipates.get()
    }

    /// The error `e = H(x') − H(x) + recall` of the energy at the end of an arc.
    #[inline]
    fn imbalance(&self, end: &Point<Y>) -> f64 {
        self.system.energy_at(end) - self.energy + self.recall.energy
    }

    /// One more correction for a root with the end `x'` at which the energy is not kept to round-off:
    /// the corrected root, and its end.
    ///
    /// Both brackets kill `w`, so `⟨w, F(u)⟩ = e` for every `u`. Once `h|Π|` is large the sum
    /// `d − h(Πw + K dS)` has lost digits of this number that the difference `H(x') − H(x)` has. So
    /// the last correction is that of the residual whose part along `w` is exact,
    /// `F + (e − ⟨w, F⟩) w/|w|²`, as long as this changes `F` within its round-off and reduces `e`.
    ///
    /// Where the end is nearer to the edge of a domain than the displacement has digits, no `u` has the
    /// right energy, and a numerical geodesic has an error of its own: there the end itself is moved, within
    /// the accuracy of geodesics.
    #[inline]
    pub(crate) fn last_correction(
        &self,
        root: &Root<Y::Manifold>,
        end: &Point<Y>,
    ) -> Option<LastCorrection<Y::Manifold>> {
        // A floor near the rounding of the entries of x' needs no correction.
        let accuracy = self.system.metric().accuracy().max(root.floor);
        let coarse = accuracy > 8.0 * f64::EPSILON * Y::Manifold::magnitude(self.x);
        let e = if coarse { self.imbalance(end) } else { 0.0 };
        if self.is_balanced(e) { None } else { self.correct(&root.u, end, e) }
    }

    /// Whether the ends of geodesics are good to a few roundings.
    fn has_closed_geodesics(&self) -> bool {
        self.system.metric().accuracy() <= 4.0 * f64::EPSILON
    }

    /// Whether an error of the energy is its round-off.
    #[inline]
    fn is_balanced(&self, e: f64) -> bool {
        e.abs() <= 4.0 * f64::EPSILON * self.energy.abs()
    }

    /// The last correction, for an error `e` of the energy.
    #[cold]
    fn correct(
        &self,
        u: &Vector<Y::Manifold>,
        end: &Point<Y>,
        e: f64,
    ) -> Option<LastCorrection<Y::Manifold>> {
        let balanced = if self.has_closed_geodesics() { self.balance(u, e) } else { None };
        let (u, at) = balanced.as_ref().map_or((u, end), |(u, end)| (u, end));
        if let Some(end) = self.settle(u, at) {
            return Some(LastCorrection { u: *u, end, moved: true });
        }
        balanced.map(|(u, end)| LastCorrection { u, end, moved: false })
    }

    /// The end `x'` moved onto the level of the energy, within the accuracy of geodesics: by the shortest
    /// way within a rounding, and along the levels of the entropy and the further invariants beyond it.
    fn settle(&self, u: &Vector<Y::Manifold>, end: &Point<Y>) -> Option<Point<Y>> {
        let e = self.imbalance(end);
        if self.is_balanced(e) {
            return None;
        }
        let w = differentials(self.system, &ChartPoint::<Y::Manifold>::centre(end));
        let mut kept = Orthogonal::<Dim<Y>>::default();
        let rounded = self.has_closed_geodesics();
        if self.is_exact() && !rounded {
            kept.push(&Canonical, &w.entropy);
        }
        for (_, l) in w.invariants.as_ref().iter().flatten().filter(|_| !rounded) {
            kept.push(&Canonical, l);
        }
        let across = kept.off_covector(0, &w.energy);
        let off = across * (-e / across.dot(&w.energy));
        let inaccuracy =
            self.system.metric().accuracy() * (Y::Manifold::magnitude(self.x) + u.magnitude());
        let settled = Y::Manifold::chart(end, &off);
        let better = self.imbalance(&settled).abs() < e.abs();
        (off.magnitude() <= inaccuracy && better).then_some(settled)
    }

    /// The root with the energy corrected by its error `e`.
    fn balance(&self, u: &Vector<Y::Manifold>, e: f64) -> Option<(Vector<Y::Manifold>, Point<Y>)> {
        let Jet { at, w } = self.jet(u)?;
        let lost = w * ((e - w.dot(&at.residual)) / w.dot(&w));
        let u = *u - at.jacobian.solve(&(at.residual + lost))?;
        let end = self.retraction.end(self.system.metric(), self.x, &u).ok()?;
        let better = self.imbalance(&end).abs() < e.abs();
        (lost.magnitude() <= at.floor && better).then_some((u, end))
    }

    /// The residual, safe against round-off, and that of `w_H`.
    #[inline]
    fn evaluate(&self, u: &Vector<Y::Manifold>) -> Option<(Vector<Y::Manifold>, f64)> {
        let (system, metric) = (self.system, self.system.metric());
        let arc = self.retraction.real_arc(metric, self.x, u).ok()?;
        let g = metric.at(&arc.z).ok()?;
        let along = Along::new(self, u, &g, Segment::new(&arc.d, &arc.end));
        let (energy, noise) = along.value(system.energy(), (self.energy, self.recall.energy), &arc);
        let entropy = if self.is_exact() {
            let (w, _) = along.value(system.entropy(), (self.entropy, self.recall.entropy), &arc);
            self.entropy_slope.set(w.dot(&w));
            w
        } else {
            system.entropy().jet1(&arc.z.base).df
        };
        let mut values = Values { along: &along, arc: &arc, seen: 0 };
        let w = Covectors::new([energy, entropy], system.invariants(), &mut values);
        let friction = irreversible(system, &arc.z, &w).ok()?;
        self.dissipates.set((0..Dim::<Y>::LEN).any(|i| friction[i].abs() > 0.0));
        let velocity = reversible(system, &arc.z, &w).ok()? + friction;
        let residual = arc.d - velocity * self.h;
        residual.is_finite().then_some((residual, noise))
    }

    /// The residual with its Jacobian, and `w_H`, from the jets `(f, df, Hf)` of the fields: no nested
    /// dual number is formed.
    #[inline]
    fn jet(&self, u: &Vector<Y::Manifold>) -> Option<Jet<Y::Manifold>> {
        let (system, metric, h) = (self.system, self.system.metric(), self.h);
        let arc = self.retraction.arc_jet(metric, self.x, u).ok()?;
        let g = metric.at(&ChartPoint::<Y::Manifold>::centre(&arc.z)).ok()?;
        let slopes = metric.slopes(&arc.z);
        let segment = Segment::new(&arc.d, &arc.end);
        let (along, slopes) = (Along::new(self, u, &g, segment), slopes.as_ref());
        let start = (self.energy, self.recall.energy);
        let (energy, chord, steepness) = along.jet(system.energy(), start, &arc, slopes);
        let entropy = if self.is_exact() {
            along.jet(system.entropy(), (self.entropy, self.recall.entropy), &arc, slopes).0
        } else {
            let jet = system.entropy().jet2(&arc.z);
            Moving { value: jet.df, slope: jet.hf * arc.dz }
        };
        let mut jets = Jets { along: &along, arc: &arc, slopes, seen: 0 };
        let w = Covectors::new([energy, entropy], system.invariants(), &mut jets);
        let VelocityJet { velocity, terms, gain, irreversible } =
            velocity_jet(system, &arc.z, &arc.dz, &w).ok()?;
        self.dissipates.set(irreversible > 0.0);

        let residual = arc.d - velocity.value * h;
        let jacobian = arc.dd - velocity.slope * h;
        let (length, sizes) = (along.segment.length, Sizes { terms, gain });
        // Near the edge of a domain dH is far steeper at x' than at z, and the rounding of d counts there.
        let noise = chord.noise(length) + f64::EPSILON * steepness;
        let floor = sizes.floor(h, length, noise);
        self.sizes.set(Some(sizes));
        let usable = residual.is_finite() && jacobian.magnitude().is_finite();
        usable.then_some(Jet { at: Linearised { residual, jacobian, floor }, w: energy.value })
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
        self.evaluate(u).map(|(residual, _)| residual)
    }

    #[inline]
    fn value_and_floor(&self, u: &Vector<Y::Manifold>) -> Option<(Vector<Y::Manifold>, f64)> {
        let sizes = self.sizes.get()?;
        let (residual, noise) = self.evaluate(u)?;
        Some((residual, sizes.floor(self.h, u.magnitude(), noise)))
    }

    #[inline]
    fn linearise(&self, u: &Vector<Y::Manifold>) -> Option<Linearised<Y::Manifold>> {
        self.jet(u).map(|jet| jet.at)
    }
}

/// Discrete gradients along one arc by their definition.
struct Defined<'a, M: Manifold, D: Scalar, G, W> {
    gradient: &'a W,
    g: &'a G,
    x: &'a M::Point<f64>,
    arc: &'a Arc<M, D>,
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
        self.gradient.covector(f, self.g, (self.x, f.at(self.x)), self.arc)
    }
}

/// One arc at real points, along which fields get discrete gradients that are safe against
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

    /// The data of the discrete gradient of `f` on the arc with the base `z` and the end `x'`, from its
    /// values at `x` and `x'`.
    #[inline]
    fn chord(
        &self,
        f: &impl ScalarField<Y::Manifold>,
        mean: &Vector<Y::Manifold>,
        [z, end]: [&Point<Y>; 2],
        values: [f64; 2],
    ) -> Chord<Y::Manifold> {
        let base = || self.step.gradient.slope_at_base(f, z, self.segment.d, mean);
        let nodes = || {
            let Residual { system, retraction, x, .. } = self.step;
            // The same arc has been followed to its end, so the alternative is not reached.
            retraction.along(system.metric(), x, self.u).unwrap_or_else(|_| Nodes {
                ends: [*x, end].map(Y::Manifold::constant),
                middle: None,
            })
        };
        let nodes = || self.nodes.get_or_init(nodes);
        Chord::new(f, mean, &self.segment, values, base, nodes)
    }

    /// The discrete gradient of `f`, with `⟨w, d⟩ = f(x') − start + recall`, and its round-off.
    #[inline]
    fn value(
        &self,
        f: &impl ScalarField<Y::Manifold>,
        (start, recall): (f64, f64),
        arc: &Arc<Y::Manifold>,
    ) -> (Vector<Y::Manifold>, f64) {
        let mean = self.step.gradient.real_mean(f, self.step.x, arc);
        let values = [start, f.at(&arc.end)];
        let chord = self.chord(f, &mean, [&arc.z.base, &arc.end], values);
        (chord.covector(recall, self.g, &arc.d), chord.noise(self.segment.length))
    }

    /// The same with its derivatives, and the size of `dF(x')`.
    #[inline]
    fn jet(
        &self,
        f: &impl ScalarField<Y::Manifold>,
        (start, recall): (f64, f64),
        arc: &ArcJet<Y::Manifold>,
        slopes: Option<&Slopes<Y::Manifold>>,
    ) -> (Moving<Dim<Y>>, Chord<Y::Manifold>, f64) {
        let (mean, dmean) = self.step.gradient.mean_jet(f, self.step.x, arc);
        let end = f.jet1(&arc.end);
        let chord = self.chord(f, &mean, [&arc.z, &arc.end], [start, end.value]);
        let value = chord.covector(recall, self.g, &arc.d);
        let slope = chord.slope(recall, (self.g, slopes), arc, &dmean, &end.df);
        (Moving { value, slope }, chord, end.df.magnitude())
    }
}

/// The derivatives of a metric along the chart.
type Slopes<M> = <<M as Space>::Dim as Dimension>::Array<Matrix<M>>;

/// The discrete gradients of the further invariants, one after the other.
struct Values<'a, Y: Metriplectic, R, W, G> {
    along: &'a Along<'a, Y, R, W, G>,
    arc: &'a Arc<Y::Manifold>,
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
        let Residual { x, recall, .. } = self.along.step;
        let recall = recall.invariants[self.seen];
        self.seen += 1;
        self.along.value(f, (f.at(x), recall), self.arc).0
    }
}

/// The same with their derivatives.
struct Jets<'a, Y: Metriplectic, R, W, G> {
    along: &'a Along<'a, Y, R, W, G>,
    arc: &'a ArcJet<Y::Manifold>,
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
    type Covector = Moving<Dim<Y>>;

    fn of(&mut self, f: &impl ScalarField<Y::Manifold>) -> Moving<Dim<Y>> {
        let Residual { x, recall, .. } = self.along.step;
        let recall = recall.invariants[self.seen];
        self.seen += 1;
        self.along.jet(f, (f.at(x), recall), self.arc, self.slopes).0
    }
}
