//! Faults of noise.

use metriplectic_dynamics::ModelError;

/// Why a system has no noise of this kind, or a method cannot sample it. It is in
/// [`RunError::Flow`](crate::RunError::Flow), [`RunError::Method`](crate::RunError::Method) or
/// [`StepError::Method`](crate::StepError::Method), and can be downcast from it.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoiseError {
    /// Boltzmann's constant is not a positive number.
    #[error(
        "Boltzmann's constant is {k_b}, and it must be positive; leave `.noise(..)` out for a system without noise"
    )]
    BoltzmannNotPositive {
        /// The constant.
        k_b: f64,
    },
    /// The reversible motion changes the volume `μ`, so `exp(S/k_B) μ` would not be its law.
    #[error(
        "div_μ(Π dH) = {divergence:.1e} at the start of the run or near it, where its terms add up to {size:.1e}: the reversible \
         motion changes the volume, and exp(S/k_B) would not be the law; give the measure that it keeps by \
         `Boltzmann(k_B).measure(|x| ..)`, with ln μ relative to the volume of the canonical metric"
    )]
    NotUnimodular {
        /// `div_μ(Π dH)`.
        divergence: f64,
        /// The sizes of its terms.
        size: f64,
    },
    /// The terms of the dissipation do not add up to it.
    #[error(
        "the terms of the dissipation differ from it by {off:.1e}, of {size:.1e}, in units of the entries; its metric is \
         not that of the space around, so give the manifold `Manifold::leg`, or write the friction as `OnsagerDissipation`"
    )]
    TermsDiffer {
        /// The largest entry of `Σ ρ b bᵀ − K`.
        off: f64,
        /// The largest entry of `K`.
        size: f64,
    },
    /// The terms of a bath do not add up to its friction.
    #[error(
        "the terms of bath {bath}, counted from 0, give another velocity than its friction: they differ by {off:.1e}, of \
         {size:.1e}, in units of the entries; its metric is not that of the space around, so give the manifold \
         `Manifold::leg`, or write the friction as contacts, `.friction(|t, x, w| [Contact {{ rate, along }}])`"
    )]
    BathTermsDiffer {
        /// The number of the bath among the baths.
        bath: usize,
        /// The largest entry of `Σ ρ b ⟨b, A⟩ − R A`.
        off: f64,
        /// The largest entry of `R A`.
        size: f64,
    },
    /// Terms are said to have no kinetic drift, and have one.
    #[error(
        "the terms are said to have no kinetic drift, and have one of {off:.1e} beside a friction of {size:.1e}, in units of the \
         entries; return `false` from `NoiseTerms::is_closed`, or correct the fields of the `NoiseFrame`"
    )]
    DriftNotZero {
        /// The largest entry of `Σ c b`.
        off: f64,
        /// The largest entry of the friction.
        size: f64,
    },
    /// A derivative of which the kinetic drift is made is not that of the values.
    #[error(
        "the derivative of {what} is {derivative:.6e} around the start, but its values give {quotient:.6e}, and the kinetic drift \
         would be wrong; calculate with `Real` throughout: `x.re` and `Real::from(..)` are constants to it"
    )]
    LostDerivative {
        /// The terms of the friction, those of the baths, or `ln μ`.
        what: &'static str,
        /// The derivative by dual numbers.
        derivative: f64,
        /// The difference quotient of the values.
        quotient: f64,
    },
    /// The entropy is no Casimir of the bracket.
    #[error(
        "noise needs an entropy that the bracket keeps, `Π dS = 0`, and this system has `SecondLaw::Published` or no \
         entropy; exp(S/k_B) would not be its law"
    )]
    NoiseAndPublished,
    /// A system of your own lists other terms of its friction than it says.
    #[error(
        "the friction lists {found} terms where `FrictionTerms::term_count` says {expected}, or a direction beyond the {directions} that there \
         are, which are counted from 0"
    )]
    BadTerms {
        /// How many terms are listed.
        found: usize,
        /// How many there are to be.
        expected: usize,
        /// The number of directions.
        directions: usize,
    },
    /// A system of your own has another number of baths than its noise knows of.
    #[error(
        "the system has {found} baths, and its noise knows the contacts of {expected}: give `with_noise` a number of contacts for each bath, \
         after the last bath was added"
    )]
    OtherBaths {
        /// How many baths there are.
        found: usize,
        /// Of how many baths the numbers of contacts are known.
        expected: usize,
    },
    /// A bath of a system of your own lists another number of contacts than its noise knows of.
    #[error(
        "the friction of bath {bath}, counted from 0, lists {found} contacts at the start of the run or near it, where `with_noise` says \
         {expected}: each has a random number, so list as many at every state, with the rate zero where there is none"
    )]
    OtherContacts {
        /// The number of the bath among the baths.
        bath: usize,
        /// How many contacts are listed.
        found: usize,
        /// How many there are to be.
        expected: usize,
    },
    /// The terms of the friction of a system of your own are not those of its motion.
    #[error(
        "the terms of `FrictionTerms` break {law} by {off:.1e}, of {size:.1e}: the noise would be that of another friction"
    )]
    TermsOff {
        /// The law.
        law: &'static str,
        /// By how much.
        off: f64,
        /// The size of the terms.
        size: f64,
    },
    /// A system of your own with noise does not live on a vector space.
    #[error(
        "the noise of a system of your own is that on a vector space: answer `Equations::is_vector_space` if its charts are translations, or \
         write it by `System::on(..)`"
    )]
    NotAVectorSpace,
    /// A bath has noise, and further invariants are listed, which it would not keep.
    #[error(
        "the noise of a bath does not keep the further invariants that are listed; leave them out of the list"
    )]
    InvariantsInABath,
    /// A lattice has energies of bonds, or gathers over them.
    #[error(
        "the kinetic drift of a lattice with friction of its own is known where its energy and its entropy are sums over sites, and that of \
         baths where nothing is gathered; this one has energies of bonds, or gathers over them"
    )]
    BondsHaveEnergies,
    /// Steps follow a tolerance.
    #[error(
        "noise needs steps of one size, and these follow a tolerance: a step that is rejected and drawn again would change \
         the law; take `Span::steps`"
    )]
    NeedsFixedSteps,
    /// A state inside a step, or an excursion, is asked for of numbers that do not have it, or in a step that a corner cuts.
    #[error(
        "this step of noise has no state inside it, where an output or an event was asked for: numbers of your own need \
         `Numbers::between` and `Numbers::uniform`, three-point numbers know no excursions (`Watched::bridged`), and a step that a corner \
         cuts has its ends alone; ask at the ends of steps"
    )]
    HasNoBetween,
    /// The method that is wrapped has an order below 2.
    #[error(
        "`NinomiyaVictoir` of weak order 2 wraps a method of order {order}; take one of order 2 or more, or `RandomFlow`"
    )]
    OrderTooLow {
        /// Its order.
        order: u32,
    },
    /// The method damps, and adds entropy beside that of the friction.
    #[error(
        "the method damps, and adds entropy beside that of the friction, to which no noise belongs; take `Gauss`, an \
         explicit method or the midpoint scheme in place of `Radau`"
    )]
    NoiseWithRadau,
    /// Friction is faster than a step.
    #[error(
        "friction is not resolved: h|K'| exceeds 1 on {steps} of {of} steps, and is {rate:.1e} on the last one; the law is off \
         by its square; take steps below {below:.1e}"
    )]
    FrictionUnresolved {
        /// `h|K'|`.
        rate: f64,
        /// A step size that resolves it.
        below: f64,
        /// On how many steps it exceeds 1.
        steps: u64,
        /// The steps that were taken.
        of: u64,
    },
    /// A step was beyond the edge of stability of an explicit method, and was taken in parts.
    #[error(
        "the step is beyond the edge of stability of the explicit method, so friction is not resolved; take smaller steps"
    )]
    StabilityUnresolved,
    /// A noise field leads out of its domain, even in small parts.
    #[error(
        "noise term {term} leads out of the domain, even in {parts} parts of a step: it is to move the state by \
         {reach:.1e} of its size; take smaller steps, and let the friction vanish at the edge of the domain"
    )]
    Unresolved {
        /// The first term of the flow.
        term: usize,
        /// How many parts were tried.
        parts: u32,
        /// `√(2 k_B h ρ) |b ξ|` in units of the entries.
        reach: f64,
    },
    /// The kinetic drift leads out of its domain, or has no value.
    #[error(
        "the kinetic drift `k_B Σ c_r b_r` has no value, or leads out of the domain; take smaller steps"
    )]
    DriftUnresolved,
}

metriplectic_equations::debug_is_the_sentence!(NoiseError);

/// Why a system with noise is not verified.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoisyError<E: std::error::Error + 'static = ModelError> {
    /// A model that breaks one of its laws.
    #[error(transparent)]
    Model(E),
    /// Noise whose law is not `exp(S/k_B) μ`.
    #[error(transparent)]
    Noise(#[from] NoiseError),
}

metriplectic_equations::debug_is_the_sentence!([E: std::error::Error + 'static] NoisyError<E>);

impl From<ModelError> for NoisyError {
    fn from(law: ModelError) -> Self {
        Self::Model(law)
    }
}
