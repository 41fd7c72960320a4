//! A metriplectic system: manifold, metric, bracket, dissipation, energy and entropy.

use std::fmt;

use metriplectic_fields::{
    ChartPoint, Dimension, Matrix, Real, Scalar, ScalarField, Space, Vector,
};
use metriplectic_manifolds::{Canonical, Manifold, MetricError, Riemannian};

use crate::bracket::BracketArgs;
use crate::dissipation::{Choice, Given};
use crate::invariants::{Casimir, Invariants, Momentum, Symmetry};
use crate::velocity;
use crate::verify;
use crate::{Bracket, Dissipation, ModelError, NaturalBracket, NoDissipation, Report, Verified};

/// What an integrator asks of a system `x' = Π dH + K dS`; [`System`] is the one to build.
pub trait Metriplectic {
    /// Where the state lives.
    type Manifold: Manifold;
    /// The Riemannian metric.
    type Metric: Riemannian<Self::Manifold>;
    /// The Poisson tensor `Π`.
    type Bracket: Bracket<Self::Manifold, Self::Metric>;
    /// The dissipation `K`.
    type Dissipation: Dissipation<Self::Manifold, Self::Metric>;
    /// The energy `H`.
    type Energy: ScalarField<Self::Manifold>;
    /// The entropy `S`.
    type Entropy: ScalarField<Self::Manifold>;
    /// The further invariants `L_a`.
    type Invariants: Invariants<Self::Manifold>;

    /// Where the state lives.
    fn manifold(&self) -> &Self::Manifold;
    /// The Riemannian metric.
    fn metric(&self) -> &Self::Metric;
    /// The Poisson tensor `Π`.
    fn bracket(&self) -> &Self::Bracket;
    /// The dissipation `K`.
    fn dissipation(&self) -> &Self::Dissipation;
    /// The energy `H`.
    fn energy(&self) -> &Self::Energy;
    /// The entropy `S`.
    fn entropy(&self) -> &Self::Entropy;
    /// The further invariants `L_a`.
    fn invariants(&self) -> &Self::Invariants;
    /// Which scheme the entropy is treated by, and what that promises.
    fn second_law(&self) -> SecondLaw;

    /// The energy `H(x)`.
    #[inline]
    fn energy_at(&self, x: &Point<Self>) -> f64 {
        self.energy().at(x)
    }

    /// The entropy `S(x)`; 0 without an entropy.
    #[inline]
    fn entropy_at(&self, x: &Point<Self>) -> f64 {
        self.entropy().at(x)
    }

    /// Where the bracket is evaluated: the point `x` with the covector `s` of the entropy there.
    #[inline]
    fn bracket_args<'a, D: Scalar>(
        &'a self,
        x: &'a ChartPoint<Self::Manifold, D>,
        s: &'a Vector<Self::Manifold, D>,
    ) -> BracketArgs<'a, Self::Manifold, Self::Metric, D> {
        BracketArgs { space: self.manifold(), metric: self.metric(), x, s }
    }

    /// The velocity `Π dH + K dS`, by the definition and at any scalar. Further invariants are
    /// annihilated by `K`.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric cannot be used at `x`.
    fn velocity<D: Scalar>(
        &self,
        x: &ChartPoint<Self::Manifold, D>,
    ) -> Result<Vector<Self::Manifold, D>, MetricError> {
        let w = velocity::differentials(self, x);
        let reversible = self.bracket().apply(&self.bracket_args(x, &w.entropy), &w.energy)?;
        Ok(reversible + velocity::irreversible(self, x, &w)?)
    }

    /// Checks the laws of the model at `x0` and at 16 points around it, each coordinate within `radius` times
    /// its [size](Manifold::scales) there. A run does this first, with a radius of 0.1.
    ///
    /// # Errors
    ///
    /// [`ModelError`] that names the law, the point and the size of the violation.
    fn verify(&self, x0: &Point<Self>, radius: f64) -> Result<(), ModelError> {
        verify::report(self, x0, radius).verdict
    }

    /// The residual of every law of the model around `x0`: the page to read when a new model
    /// misbehaves.
    fn report(&self, x0: &Point<Self>) -> Report {
        verify::report(self, x0, verify::RADIUS)
    }

    /// The system with the certificate that its model was verified around `x0`: runs of it from any start
    /// verify no more than that start. For a study of many runs.
    ///
    /// # Errors
    ///
    /// Those of [`verify`](Self::verify).
    fn verified(&self, x0: &Point<Self>) -> Result<Verified<'_, Self>, ModelError> {
        Verified::around(self, x0)
    }

    /// What a run checks before its first step: everything that [`verify`](Self::verify) does, unless the
    /// system is [`Verified`].
    ///
    /// # Errors
    ///
    /// Those of [`verify`](Self::verify).
    fn check_start(&self, x0: &Point<Self>) -> Result<(), ModelError> {
        self.verify(x0, verify::RADIUS)
    }
}

/// A state of the system `Y`.
pub type Point<Y> = <<Y as Metriplectic>::Manifold as Space>::Point<f64>;

/// What a system promises about its entropy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum SecondLaw {
    /// There is no entropy: the system is Hamiltonian.
    #[default]
    NoEntropy,
    /// Both laws exactly, in each step: `ΔS = h K(w_S, w_S) ≥ 0` with a discrete gradient `w_S` of the
    /// entropy, which takes the place of `dS` and is annihilated by the bracket. `S` must be a Casimir,
    /// `Π dS = 0`, and verification refuses the model otherwise: there is no such scheme then.
    ///
    /// A force `𝓕` adds `h ⟨𝓕(w_H), [w_H, w_S]⟩` to `ΔS`, and verification refuses one that makes this
    /// negative, at the sampled points or on a step from them.
    Exact,
    /// The scheme as published (Bloch, Farré Puiggalí, Martín de Diego 2024, §4.4), with `dS(z)` at
    /// the base point and `Π(z)` as it is. The first law holds exactly; `ΔS ≥ −O(h³)`, of either sign,
    /// is not promised, and the certificate says so. `S` need not be a Casimir.
    Published,
}

/// Stands for the energy that a builder has not been given yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoEnergy;

/// The entropy of a system that has none, `S = 0`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoEntropy;

#[diagnostic::do_not_recommend]
impl<M: Space> ScalarField<M> for NoEntropy {
    #[inline]
    fn at<D: Scalar>(&self, _: &M::Point<D>) -> D {
        D::zero()
    }
}

/// A metriplectic system on the manifold `M` with metric `G`, bracket `B`, dissipation `K`, energy
/// `H`, entropy `S` and further invariants `L`; built by [`System::on`].
#[derive(Clone)]
pub struct System<M, G, B, K, H, S, L = ()> {
    parts: SystemBuilder<M, G, B, K, H, S, L>,
}

/// The system that a builder makes, with the dissipation that its choice `K` has come to.
pub type Built<M, G, B, K, H, S, L> = System<M, G, B, <K as Choice>::Dissipation, H, S, L>;

impl System<(), (), (), (), (), ()> {
    /// Starts a system on a manifold, with the manifold's canonical metric and its natural bracket
    /// (Lie-Poisson on the dual of a Lie algebra, none elsewhere).
    ///
    /// ```
    /// use metriplectic_dynamics::System;
    /// use metriplectic_fields::Real;
    /// use metriplectic_manifolds::LieDual;
    /// use nalgebra::Vector3;
    ///
    /// let inertia = Vector3::new(10.0, 5.0, 1.0);
    /// let body = System::on(LieDual::so3())
    ///     .energy(move |p: &Vector3<Real>| p.component_mul(p).component_div(&inertia.cast()).sum() * 0.5)
    ///     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
    ///     .build();
    /// assert!(body.is_ok());
    /// ```
    pub fn on<M: NaturalBracket>(
        manifold: M,
    ) -> SystemBuilder<M, Canonical, M::Bracket, NoDissipation, NoEnergy, NoEntropy> {
        SystemBuilder {
            bracket: manifold.natural_bracket(),
            manifold,
            metric: Canonical,
            dissipation: NoDissipation,
            energy: NoEnergy,
            entropy: NoEntropy,
            invariants: (),
            has_entropy: false,
            second_law: SecondLaw::NoEntropy,
        }
    }
}

/// A system in the making: each method replaces one part.
#[derive(Clone)]
#[must_use = "a builder does nothing until `build` is called"]
pub struct SystemBuilder<M, G, B, K, H, S, L = ()> {
    manifold: M,
    metric: G,
    bracket: B,
    dissipation: K,
    energy: H,
    entropy: S,
    invariants: L,
    has_entropy: bool,
    second_law: SecondLaw,
}

// By hand, because closures have no `Debug`.
impl<M: fmt::Debug, G, B, K, H, S, L> fmt::Debug for System<M, G, B, K, H, S, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let SystemBuilder { manifold, second_law, .. } = &self.parts;
        f.debug_struct("System")
            .field("manifold", manifold)
            .field("second_law", second_law)
            .finish_non_exhaustive()
    }
}

impl<M: fmt::Debug, G, B, K, H, S, L> fmt::Debug for SystemBuilder<M, G, B, K, H, S, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SystemBuilder")
            .field("manifold", &self.manifold)
            .field("second_law", &self.second_law)
            .finish_non_exhaustive()
    }
}

impl<M: Manifold, G, B, K, H, S, L> SystemBuilder<M, G, B, K, H, S, L> {
    /// The energy `H`: a closure `|x| -> Real` or any other [`ScalarField`].
    pub fn energy<F: ScalarField<M>>(self, energy: F) -> SystemBuilder<M, G, B, K, F, S, L> {
        let Self {
            manifold,
            metric,
            bracket,
            dissipation,
            entropy,
            invariants,
            has_entropy,
            second_law,
            ..
        } = self;
        SystemBuilder {
            manifold,
            metric,
            bracket,
            dissipation,
            energy,
            entropy,
            invariants,
            has_entropy,
            second_law,
        }
    }

    /// The entropy `S`: a closure `|x| -> Real` or any other [`ScalarField`]. It must be a Casimir
    /// of the bracket unless [`second_law`](Self::second_law) says otherwise, and it is produced by
    /// the dissipation of the metric ([`MetricDissipation`](crate::MetricDissipation)) unless a
    /// [`dissipation`](Self::dissipation) or a force is given, before or after.
    pub fn entropy<F: ScalarField<M>>(
        self,
        entropy: F,
    ) -> SystemBuilder<M, G, B, K::WithEntropy, H, F, L>
    where
        K: Choice,
    {
        let Self { manifold, metric, bracket, dissipation, energy, invariants, second_law, .. } =
            self;
        let second_law = match second_law {
            SecondLaw::NoEntropy => SecondLaw::Exact,
            chosen => chosen,
        };
        let dissipation = dissipation.with_entropy();
        SystemBuilder {
            manifold,
            metric,
            bracket,
            dissipation,
            energy,
            entropy,
            invariants,
            has_entropy: true,
            second_law,
        }
    }

    /// What produces the entropy, in place of the dissipation of the metric: any
    /// [`Dissipation`], such as those of the table in [`dissipation`](crate::dissipation).
    pub fn dissipation<F>(self, dissipation: F) -> SystemBuilder<M, G, B, Given<F>, H, S, L> {
        self.choose(|_| Given(dissipation))
    }

    /// The same with another choice of the dissipation.
    pub(crate) fn choose<F>(
        self,
        choose: impl FnOnce(K) -> F,
    ) -> SystemBuilder<M, G, B, F, H, S, L> {
        let Self {
            manifold,
            metric,
            bracket,
            dissipation,
            energy,
            entropy,
            invariants,
            has_entropy,
            second_law,
        } = self;
        let dissipation = choose(dissipation);
        SystemBuilder {
            manifold,
            metric,
            bracket,
            dissipation,
            energy,
            entropy,
            invariants,
            has_entropy,
            second_law,
        }
    }

    /// The Riemannian metric: [`Metric::constant`](metriplectic_manifolds::Metric::constant) or
    /// [`Metric::field`](metriplectic_manifolds::Metric::field).
    pub fn metric<F: Riemannian<M>>(self, metric: F) -> SystemBuilder<M, F, B, K, H, S, L> {
        let Self {
            manifold,
            bracket,
            dissipation,
            energy,
            entropy,
            invariants,
            has_entropy,
            second_law,
            ..
        } = self;
        SystemBuilder {
            manifold,
            metric,
            bracket,
            dissipation,
            energy,
            entropy,
            invariants,
            has_entropy,
            second_law,
        }
    }

    /// The Poisson tensor: [`LiePoisson`](crate::LiePoisson), [`Zero`](crate::Zero),
    /// [`Poisson::constant`](crate::Poisson::constant), [`Poisson::field`](crate::Poisson::field),
    /// [`Symplectic`](crate::Symplectic), [`AreaForm`](type@crate::AreaForm) or [`Nambu`](crate::Nambu);
    /// on a product a pair of them, one for each factor. A skew tensor that is not Poisson is
    /// [`AlmostPoisson::field`](crate::AlmostPoisson::field).
    pub fn bracket<F>(self, bracket: F) -> SystemBuilder<M, G, F, K, H, S, L> {
        let Self {
            manifold,
            metric,
            dissipation,
            energy,
            entropy,
            invariants,
            has_entropy,
            second_law,
            ..
        } = self;
        SystemBuilder {
            manifold,
            metric,
            bracket,
            dissipation,
            energy,
            entropy,
            invariants,
            has_entropy,
            second_law,
        }
    }

    /// A further Casimir `C` of the bracket, `Π dC = 0`, which each step keeps to round-off: a closure
    /// `|x| -> Real` or any other [`ScalarField`].
    ///
    /// The dissipation of the metric is projected off its differential; another one must satisfy
    /// `K dC = 0` of its own.
    pub fn casimir<F: ScalarField<M>>(
        self,
        casimir: F,
    ) -> SystemBuilder<M, G, B, K, H, S, (L, Casimir<F>)> {
        self.with_invariant(Casimir(casimir))
    }

    /// A momentum `J`, conserved because the energy is symmetric, `⟨dJ, Π dH⟩ = 0`, which each step
    /// keeps to round-off: a closure `|x| -> Real` or any other [`ScalarField`].
    ///
    /// The dissipation of the metric is projected off its differential; another one must satisfy
    /// `K dJ = 0` of its own.
    pub fn momentum<F: ScalarField<M>>(
        self,
        momentum: F,
    ) -> SystemBuilder<M, G, B, K, H, S, (L, Momentum<F>)> {
        self.with_invariant(Momentum(momentum))
    }

    /// A one-parameter group of symmetries, as a closure `|t, x| -> Φ_t(x)` with `Φ_0(x) = x`, and
    /// its momentum map `J`, with `Π dJ = dΦ_t/dt` at `t = 0`. `J` is kept as a
    /// [`momentum`](Self::momentum); verification checks at sampled points that `Φ_t` preserves the
    /// bracket and the energy, and belongs to `J`.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn symmetry<A, F>(
        self,
        action: A,
        momentum: F,
    ) -> SystemBuilder<M, G, B, K, H, S, (L, Symmetry<A, F>)>
    where
        A: Fn(Real, &M::Point<Real>) -> M::Point<Real>,
        F: ScalarField<M>,
    {
        self.with_invariant(Symmetry { action, momentum })
    }

    fn with_invariant<T>(self, one: T) -> SystemBuilder<M, G, B, K, H, S, (L, T)> {
        let Self {
            manifold,
            metric,
            bracket,
            dissipation,
            energy,
            entropy,
            invariants,
            has_entropy,
            second_law,
        } = self;
        let invariants = (invariants, one);
        SystemBuilder {
            manifold,
            metric,
            bracket,
            dissipation,
            energy,
            entropy,
            invariants,
            has_entropy,
            second_law,
        }
    }

    /// Which scheme the entropy is treated by; [`SecondLaw::Published`] allows one that is not a
    /// Casimir.
    pub fn second_law(mut self, second_law: SecondLaw) -> Self {
        self.second_law = second_law;
        self
    }
}

impl<M: Manifold, G, B, K, H, S, L> SystemBuilder<M, G, B, K, H, S, L> {
    /// Checks the structure and finishes the system. The laws that need a point are checked by
    /// [`Metriplectic::verify`], which every run calls.
    ///
    /// # Errors
    ///
    /// [`BuildError`] if the parts do not make a system.
    // The bounds stand on the method, so that a part that does not fit is explained as such.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn build(self) -> Result<Built<M, G, B, K, H, S, L>, BuildError>
    where
        G: Riemannian<M>,
        B: Bracket<M, G>,
        K: Choice<Dissipation: Dissipation<M, G>>,
        H: ScalarField<M>,
        S: ScalarField<M>,
        L: Invariants<M>,
    {
        let Self {
            manifold,
            metric,
            bracket,
            dissipation,
            energy,
            entropy,
            invariants,
            has_entropy,
            second_law,
        } = self;
        let dissipation = dissipation.chosen();
        let dissipates = !Dissipation::<M, G>::is_none(&dissipation);
        if !dissipates && Bracket::<M, G>::is_zero(&bracket) {
            return Err(BuildError::NothingMoves);
        }
        let changes = dissipates || Bracket::<M, G>::is_forced(&bracket);
        let promises = second_law != SecondLaw::NoEntropy;
        if promises != (has_entropy && changes) || dissipates && !has_entropy {
            return Err(BuildError::SecondLawWithoutEntropy);
        }
        if L::COUNT >= M::Dim::LEN {
            return Err(BuildError::TooManyInvariants { count: L::COUNT, dimension: M::Dim::LEN });
        }
        let parts = SystemBuilder {
            manifold,
            metric,
            bracket,
            dissipation,
            energy,
            entropy,
            invariants,
            has_entropy,
            second_law,
        };
        Ok(System { parts })
    }
}

impl<M, G, B, K, H, S, L> Metriplectic for System<M, G, B, K, H, S, L>
where
    M: Manifold,
    G: Riemannian<M>,
    B: Bracket<M, G>,
    K: Dissipation<M, G>,
    H: ScalarField<M>,
    S: ScalarField<M>,
    L: Invariants<M>,
{
    type Manifold = M;
    type Metric = G;
    type Bracket = B;
    type Dissipation = K;
    type Energy = H;
    type Entropy = S;
    type Invariants = L;

    #[inline]
    fn manifold(&self) -> &M {
        &self.parts.manifold
    }

    #[inline]
    fn metric(&self) -> &G {
        &self.parts.metric
    }

    #[inline]
    fn bracket(&self) -> &B {
        &self.parts.bracket
    }

    #[inline]
    fn dissipation(&self) -> &K {
        &self.parts.dissipation
    }

    #[inline]
    fn energy(&self) -> &H {
        &self.parts.energy
    }

    #[inline]
    fn entropy(&self) -> &S {
        &self.parts.entropy
    }

    #[inline]
    fn invariants(&self) -> &L {
        &self.parts.invariants
    }

    #[inline]
    fn second_law(&self) -> SecondLaw {
        self.parts.second_law
    }
}

/// Parts that do not make a system.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// Neither a bracket nor an entropy.
    #[error("nothing moves: the bracket is zero and there is no entropy; give one of the two")]
    NothingMoves,
    /// A promise about an entropy that is not there, or an entropy without one.
    #[error("the second law speaks of an entropy, and this system has none; give `.entropy(..)`")]
    SecondLawWithoutEntropy,
    /// As many invariants as there are dimensions.
    #[error(
        "{count} further invariants leave nothing to move in {dimension} dimensions; list only \
         independent ones"
    )]
    TooManyInvariants {
        /// How many there are.
        count: usize,
        /// The dimension of the manifold.
        dimension: usize,
    },
}

/// The matrix of a metric, for reports.
pub(crate) fn metric_matrix<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
) -> Matrix<Y::Manifold> {
    system.metric().matrix(&ChartPoint::<Y::Manifold>::centre(x))
}
