//! The builder of a [`System`].

use std::fmt;

use metriplectic_fields::{Form, Real, ScalarField, Velocity};
use metriplectic_manifolds::{Canonical, Manifold, Riemannian};

use crate::bracket::{Bracket, NaturalBracket};
use crate::dissipation::{
    Choice, Dissipation, FieldDissipation, Given, NoDissipation, OnsagerDissipation,
};
use crate::exchange::Contact;
use crate::invariants::{Casimir, Invariants, Momentum, Symmetry};
use crate::metriplectic::SecondLaw;
use crate::system::{BuildError, Context, Fields, NoEntropy, System, Tensors};

/// Stands for the energy that a builder has not been given yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoEnergy;

/// The system that a builder makes, with the dissipation that its choice `K` has come to.
pub type Built<M, G, B, K, H, S, L> = System<M, G, B, <K as Choice>::Dissipation, H, S, L>;

/// The surroundings of a system in the making: none, `()`, or what makes an open system of it when it is built.
pub trait Surroundings {
    /// The type that is built from the system `Y`.
    type Built<Y>;

    /// Puts the surroundings around a system.
    fn around<Y>(self, system: Y) -> Self::Built<Y>;

    /// Returns whether they may move the system and change its entropy, without a bracket and a dissipation.
    fn is_open(&self) -> bool {
        true
    }
}

impl Surroundings for () {
    type Built<Y> = Y;

    fn around<Y>(self, system: Y) -> Y {
        system
    }

    fn is_open(&self) -> bool {
        false
    }
}

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
        let (metric, bracket) = (Canonical, manifold.natural_bracket());
        SystemBuilder {
            tensors: Tensors { manifold, metric, bracket, dissipation: NoDissipation },
            fields: Fields { energy: NoEnergy, entropy: NoEntropy, invariants: () },
            has_entropy: false,
            second_law: SecondLaw::NoEntropy,
            surroundings: (),
        }
    }
}

/// A system in the making: each method replaces one part.
#[derive(Clone)]
#[must_use = "a builder does nothing until `build` is called"]
pub struct SystemBuilder<M, G, B, K, H, S, L = (), P = ()> {
    tensors: Tensors<M, G, B, K>,
    fields: Fields<H, S, L>,
    has_entropy: bool,
    second_law: SecondLaw,
    surroundings: P,
}

// By hand, because closures have no `Debug`.
impl<M: fmt::Debug, G, B, K, H, S, L, P> fmt::Debug for SystemBuilder<M, G, B, K, H, S, L, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SystemBuilder")
            .field("manifold", &self.tensors.manifold)
            .field("second_law", &self.second_law)
            .finish_non_exhaustive()
    }
}

impl<M, G, B, K, H, S, L, P> SystemBuilder<M, G, B, K, H, S, L, P> {
    /// Replaces tensors.
    fn with_tensors<E, C, D>(
        self,
        replace: impl FnOnce(Tensors<M, G, B, K>) -> Tensors<M, E, C, D>,
    ) -> SystemBuilder<M, E, C, D, H, S, L, P> {
        let Self { tensors, fields, has_entropy, second_law, surroundings } = self;
        SystemBuilder { tensors: replace(tensors), fields, has_entropy, second_law, surroundings }
    }

    /// Replaces the metric by one that is still to be checked, when the system is built.
    pub(crate) fn any_metric<F>(self, metric: F) -> SystemBuilder<M, F, B, K, H, S, L, P> {
        self.with_tensors(|Tensors { manifold, bracket, dissipation, .. }| Tensors {
            manifold,
            metric,
            bracket,
            dissipation,
        })
    }

    /// Replaces scalar fields.
    fn with_fields<E, F, I>(
        self,
        replace: impl FnOnce(Fields<H, S, L>) -> Fields<E, F, I>,
    ) -> SystemBuilder<M, G, B, K, E, F, I, P> {
        let Self { tensors, fields, has_entropy, second_law, surroundings } = self;
        SystemBuilder { tensors, fields: replace(fields), has_entropy, second_law, surroundings }
    }

    /// Replaces the choice of the dissipation.
    pub(crate) fn choose<F>(
        self,
        choose: impl FnOnce(K) -> F,
    ) -> SystemBuilder<M, G, B, F, H, S, L, P> {
        self.with_tensors(|Tensors { manifold, metric, bracket, dissipation }| Tensors {
            manifold,
            metric,
            bracket,
            dissipation: choose(dissipation),
        })
    }

    /// Replaces the surroundings, which make an open system of it.
    pub fn surrounded<Q>(
        self,
        replace: impl FnOnce(P) -> Q,
    ) -> SystemBuilder<M, G, B, K, H, S, L, Q> {
        let Self { tensors, fields, has_entropy, second_law, surroundings } = self;
        let surroundings = replace(surroundings);
        SystemBuilder { tensors, fields, has_entropy, second_law, surroundings }
    }

    /// Appends an invariant to the list.
    fn with_invariant<T>(self, last: T) -> SystemBuilder<M, G, B, K, H, S, (L, T), P> {
        self.with_fields(|Fields { energy, entropy, invariants }| Fields {
            energy,
            entropy,
            invariants: (invariants, last),
        })
    }
}

impl<M: Manifold, G, B, K, H, S, L, P> SystemBuilder<M, G, B, K, H, S, L, P> {
    /// Sets the energy `H`: a closure `|x| -> Real` or any other [`ScalarField`].
    pub fn energy<F: ScalarField<M>>(self, energy: F) -> SystemBuilder<M, G, B, K, F, S, L, P> {
        self.with_fields(|Fields { entropy, invariants, .. }| Fields {
            energy,
            entropy,
            invariants,
        })
    }

    /// Sets the entropy `S`: a closure `|x| -> Real` or any other [`ScalarField`]. It must be a Casimir
    /// of the bracket unless [`second_law`](Self::second_law) says otherwise. The dissipation of the metric
    /// ([`MetricDissipation`](crate::MetricDissipation)) produces it unless a
    /// [`dissipation`](Self::dissipation) or a force is given, before or after. With
    /// [`NoDissipation`] nothing does, and it is a constant of the motion.
    pub fn entropy<F: ScalarField<M>>(
        self,
        entropy: F,
    ) -> SystemBuilder<M, G, B, K::WithEntropy, H, F, L, P>
    where
        K: Choice,
    {
        let second_law = match self.second_law {
            SecondLaw::NoEntropy => SecondLaw::Exact,
            chosen => chosen,
        };
        let produced = self.choose(K::with_entropy);
        let with_entropy = produced.with_fields(|Fields { energy, invariants, .. }| Fields {
            energy,
            entropy,
            invariants,
        });
        SystemBuilder { has_entropy: true, second_law, ..with_entropy }
    }

    /// Sets the dissipation that produces the entropy, in place of that of the metric: any
    /// [`Dissipation`], such as those of the table in [`dissipation`](crate::dissipation). Closures are shorter by
    /// [`field_dissipation`](Self::field_dissipation) and [`onsager`](Self::onsager).
    pub fn dissipation<F>(self, dissipation: F) -> SystemBuilder<M, G, B, Given<F>, H, S, L, P> {
        self.choose(|_| Given(dissipation))
    }

    /// Sets the dissipation by a closure `|x, w| -> K` of the point and of the covector that `K` annihilates: that of
    /// [`FieldDissipation`]. [`Family`](crate::Family) has this word too, with the parameters as a third argument.
    pub fn field_dissipation<F>(
        self,
        dissipation: F,
    ) -> SystemBuilder<M, G, B, Given<FieldDissipation<F>>, H, S, L, P>
    where
        F: Fn(&M::Point<Real>, &Velocity<M, Real>) -> Form<M, Real>,
    {
        self.dissipation(FieldDissipation(dissipation))
    }

    /// Sets the dissipation by a closure `|x, w| -> [Contact; R]` that returns its terms of rank one: that of
    /// [`OnsagerDissipation`]. On a lattice the words are `bond_onsager` and `site_onsager`.
    pub fn onsager<F, const R: usize>(
        self,
        terms: F,
    ) -> SystemBuilder<M, G, B, Given<OnsagerDissipation<F>>, H, S, L, P>
    where
        F: Fn(&M::Point<Real>, &Velocity<M, Real>) -> [Contact<Velocity<M, Real>>; R],
    {
        self.dissipation(OnsagerDissipation(terms))
    }

    /// Sets the Riemannian metric: [`Metric::constant`](metriplectic_manifolds::Metric::constant) or
    /// [`Metric::field`](metriplectic_manifolds::Metric::field).
    pub fn metric<F: Riemannian<M>>(self, metric: F) -> SystemBuilder<M, F, B, K, H, S, L, P> {
        self.with_tensors(|Tensors { manifold, bracket, dissipation, .. }| Tensors {
            manifold,
            metric,
            bracket,
            dissipation,
        })
    }

    /// Sets the Poisson tensor: [`LiePoisson`](crate::LiePoisson), [`Zero`](crate::Zero),
    /// [`Poisson::constant`](crate::Poisson::constant), [`Poisson::field`](crate::Poisson::field),
    /// [`Symplectic`](crate::Symplectic), [`AreaForm`](type@crate::AreaForm) or [`Nambu`](crate::Nambu);
    /// on a product a pair of them, one for each factor. A skew tensor that is not Poisson is
    /// [`AlmostPoisson::field`](crate::AlmostPoisson::field).
    pub fn bracket<F>(self, bracket: F) -> SystemBuilder<M, G, F, K, H, S, L, P> {
        self.with_tensors(|Tensors { manifold, metric, dissipation, .. }| Tensors {
            manifold,
            metric,
            bracket,
            dissipation,
        })
    }

    /// Appends a further Casimir `C` of the bracket, `Π dC = 0`, which each step conserves to round-off: a
    /// closure `|x| -> Real` or any other [`ScalarField`].
    ///
    /// The dissipation of the metric is projected off its differential; another dissipation must satisfy
    /// `K dC = 0` by itself.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn casimir<F: ScalarField<M>>(
        self,
        casimir: F,
    ) -> SystemBuilder<M, G, B, K, H, S, (L, Casimir<F>), P> {
        self.with_invariant(Casimir(casimir))
    }

    /// Appends a momentum `J`, conserved because the energy is symmetric, `⟨dJ, Π dH⟩ = 0`. Each step
    /// conserves it to round-off. It is a closure `|x| -> Real` or any other [`ScalarField`].
    ///
    /// The dissipation of the metric is projected off its differential; another dissipation must satisfy
    /// `K dJ = 0` by itself.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn momentum<F: ScalarField<M>>(
        self,
        momentum: F,
    ) -> SystemBuilder<M, G, B, K, H, S, (L, Momentum<F>), P> {
        self.with_invariant(Momentum(momentum))
    }

    /// Appends a one-parameter group of symmetries, a closure `|t, x| -> Φ_t(x)` with `Φ_0(x) = x`, and
    /// its momentum map `J`, with `Π dJ = dΦ_t/dt` at `t = 0`. Each step conserves `J` as a
    /// [`momentum`](Self::momentum). Verification checks at sampled points that `Φ_t` preserves the
    /// bracket and the energy, and belongs to `J`.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn symmetry<A, F>(
        self,
        action: A,
        momentum: F,
    ) -> SystemBuilder<M, G, B, K, H, S, (L, Symmetry<A, F>), P>
    where
        A: Fn(Real, &M::Point<Real>) -> M::Point<Real>,
        F: ScalarField<M>,
    {
        self.with_invariant(Symmetry { action, momentum })
    }

    /// Chooses the scheme that treats the entropy. [`SecondLaw::Published`] allows an entropy that is not a
    /// Casimir.
    pub fn second_law(self, second_law: SecondLaw) -> Self {
        Self { second_law, ..self }
    }

    /// Checks the structure and finishes the system. Every run checks the laws that need a point, by
    /// [`Verify::check_start`](crate::Verify::check_start).
    ///
    /// # Errors
    ///
    /// [`BuildError`] if the parts do not make a system.
    // The bounds stand on the method, so that a part that does not fit is explained as such.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn build(self) -> Result<P::Built<Built<M, G, B, K, H, S, L>>, BuildError>
    where
        P: Surroundings,
        G: Riemannian<M>,
        B: Bracket<M, G>,
        K: Choice<Dissipation: Dissipation<M, G>>,
        H: ScalarField<M>,
        S: ScalarField<M>,
        L: Invariants<M>,
    {
        let (system, surroundings) = self.finish()?;
        Ok(surroundings.around(system))
    }

    /// Finishes the system without its surroundings.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub(crate) fn finish(self) -> Result<(Built<M, G, B, K, H, S, L>, P), BuildError>
    where
        P: Surroundings,
        G: Riemannian<M>,
        B: Bracket<M, G>,
        K: Choice<Dissipation: Dissipation<M, G>>,
        L: Invariants<M>,
    {
        let SystemBuilder { tensors, fields, has_entropy, second_law, surroundings } =
            self.choose(K::chosen);
        let is_open = surroundings.is_open();
        let system = System::new(tensors, fields, second_law, Context { has_entropy, is_open })?;
        Ok((system, surroundings))
    }
}
