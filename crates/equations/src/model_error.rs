//! The laws that a model violates, with the numbers.

use std::sync::Arc;

use crate::{MetricError, PointError};

/// A model that breaks one of its laws. `size` is relative to the terms that should cancel.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The start is not a point of the manifold.
    #[error("the start: {0}")]
    Start(#[from] PointError),
    /// A value at the start is not a finite number.
    #[error("the {field} is {value} at {point:?}; start where the model is defined")]
    ValueNotFinite {
        /// Which part of the model.
        field: &'static str,
        /// Its value there.
        value: f64,
        /// The entries of the point.
        point: Vec<f64>,
    },
    /// A value is finite, but a derivative is not.
    #[error(
        "the {field} has a finite value but a derivative that is not finite at {point:?}; a square \
         root or a norm at zero does this: write `norm_squared()`, or keep the start away from it"
    )]
    DerivativeNotFinite {
        /// Which part of the model.
        field: &'static str,
        /// The entries of the point.
        point: Vec<f64>,
    },
    /// A derivative is not that of the values.
    #[error(
        "the {field} has the derivative {derivative:.6e} along direction {axis} of the chart at {point:?}, \
         but its values change at the rate {quotient:.6e}: the closure loses a derivative, as `x.re` and \
         `Real::from(f64)` do; compute with `Real` from the arguments to the result, and use `.re` only to \
         choose a branch"
    )]
    WrongDerivative {
        /// Which part of the model.
        field: &'static str,
        /// The direction of the chart, counted from 0: the entry, on a vector space.
        axis: usize,
        /// The entries of the point.
        point: Vec<f64>,
        /// The derivative by dual numbers.
        derivative: f64,
        /// The difference quotient of the values.
        quotient: f64,
    },
    /// A derivative along a parameter is not that of the values.
    #[error(
        "the {field} has the derivative {derivative:.6e} along parameter {parameter}, counted from 0, at {point:?}, but its values \
         change at the rate {quotient:.6e}: correct `Model::law_along_parameter` and `Model::part_along_parameter`; where the parameters \
         of the systems are not those of the model, return 0 from `Model::parameters`"
    )]
    WrongAlongParameter {
        /// Which part of the model.
        field: &'static str,
        /// The parameter, counted from 0.
        parameter: usize,
        /// The entries of the point.
        point: Vec<f64>,
        /// The derivative that the model answers.
        derivative: f64,
        /// The difference quotient of the values.
        quotient: f64,
    },
    /// The model has values at too few points around the start.
    #[error(
        "the model was judged at {judged} of {wanted} points around {point:?}, because it has no values at \
         the others, however near they are; start inside its domain"
    )]
    TooFewPoints {
        /// Points at which every part of the model has a value.
        judged: usize,
        /// Points asked for, with the start.
        wanted: usize,
        /// The entries of the start.
        point: Vec<f64>,
    },
    /// The values are finite, but products of them overflow.
    #[error(
        "the terms of the law {law} overflow at {point:?}: products of the values are beyond 10³⁰⁸; write \
         the model in larger units"
    )]
    Overflow {
        /// The law whose terms are too large.
        law: &'static str,
        /// The entries of the point.
        point: Vec<f64>,
    },
    /// The values are so small that their last digits underflow.
    #[error(
        "the {field} has terms of size {size:.1e} at {point:?}: their last digits are below 10⁻³⁰⁸ and are lost; \
         write the model in smaller units"
    )]
    Underflow {
        /// Which field.
        field: &'static str,
        /// The size `|F| + Σ_i |∂_iF x_i|` of its terms.
        size: f64,
        /// The entries of the start.
        point: Vec<f64>,
    },
    /// `⟨w, f⟩ ≠ 0` for `dH` or a covector near it.
    #[error(
        "the force does work at {point:?}: ⟨w, force⟩ is {size:.1e} of its terms for w = dH or a covector \
         near it; build the force so that the covector it is given annihilates it"
    )]
    ForceDoesWork {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// A force under which the entropy falls.
    #[error(
        "the force destroys entropy at {point:?}, or on a step from there: ⟨dS, force⟩ is negative by \
         {size:.1e} of its terms; ask for `SecondLaw::Published`, which does not promise the second law, or \
         leave the entropy out"
    )]
    ForceDestroysEntropy {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// A force changes a further invariant.
    #[error(
        "the force changes an invariant at {point:?}: ⟨dL, force⟩ is {size:.1e} of its terms; leave the \
         invariant out of the list"
    )]
    ForceChangesInvariant {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// The metric cannot be used.
    #[error("at {point:?}: {source}")]
    Metric {
        /// The error of the metric.
        source: MetricError,
        /// The entries of the point.
        point: Vec<f64>,
    },
    /// `Π` is not skew.
    #[error(
        "the bracket is not skew at {point:?}: Π + Πᵀ is {size:.1e} of its entries; energy would not be kept"
    )]
    BracketNotSkew {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// `Π` breaks the Jacobi identity.
    #[error(
        "the bracket breaks the Jacobi identity at {point:?} by {size:.1e} of its terms; a skew tensor that \
         need not be Poisson, as in a nonholonomic system, is `AlmostPoisson::field(..)`"
    )]
    NoJacobiIdentity {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// `Π dS ≠ 0`.
    #[error(
        "the entropy is not a Casimir of the bracket at {point:?}: Π dS is {size:.1e} of its terms; \
         use a Casimir, give S a factor of its own, or ask for `SecondLaw::Published`"
    )]
    EntropyNotCasimir {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// A function listed as a Casimir is none.
    #[error(
        "an invariant listed as a Casimir is not one at {point:?}: Π dC is {size:.1e} of its terms; if it \
         is conserved because the energy is symmetric, list it by `.momentum(..)`"
    )]
    NotCasimir {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// A function listed as a momentum is not conserved.
    #[error(
        "an invariant listed as a momentum is not conserved at {point:?}: ⟨dJ, Π dH⟩ is {size:.1e} of \
         its terms"
    )]
    NotMomentum {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// The dissipation changes a further invariant.
    #[error(
        "the dissipation changes an invariant at {point:?}: K dL is {size:.1e} of its terms; use a \
         dissipation that annihilates it, or that of the metric, which is projected"
    )]
    InvariantNotKept {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// A further invariant is a function of the other fields.
    #[error(
        "invariant {index} depends on the other fields around the start: only {fraction:.1e} of its \
         differential is independent of theirs; leave it out of the list"
    )]
    DependentInvariant {
        /// Which one, in the order of the list, counted from 0.
        index: usize,
        /// The fraction of its differential that is independent.
        fraction: f64,
    },
    /// An action changes the energy.
    #[error(
        "the action is no symmetry of the energy at {point:?}: it changes by {size:.1e} of itself"
    )]
    EnergyNotSymmetric {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// An action changes the bracket.
    #[error(
        "the action does not preserve the bracket at {point:?}: it changes Π by {size:.1e} of it, so \
         it is no Poisson map"
    )]
    ActionNotPoisson {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// An action and its momentum map do not belong together.
    #[error(
        "the action does not belong to its momentum map at {point:?}: dΦ_t/dt at t = 0 and Π dJ \
         differ by {size:.1e} of their size; check the sign, and that Φ_0(x) = x"
    )]
    ActionNotOfMomentum {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// `K` is not symmetric.
    #[error("the dissipation is not symmetric at {point:?}: K − Kᵀ is {size:.1e} of K")]
    DissipationNotSymmetric {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// `K` is not positive semidefinite.
    #[error(
        "the dissipation destroys entropy at {point:?}: scaled to a diagonal of ones, K has the pivot \
         −{size:.1e}; a semidefinite K has K_ii ≥ 0 and K_ij² ≤ K_ii K_jj"
    )]
    DissipationNotPositive {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// `K dH ≠ 0`.
    #[error(
        "the dissipation does not keep the energy at {point:?}: K dH is {size:.1e} of its terms; build \
         K from the covector w that it is told to annihilate, or ask for `ProjectedDissipation`"
    )]
    EnergyNotKept {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// A port carries entropy, `⟨dS, F⟩ ≠ 0`.
    #[error(
        "the port `{port}` carries entropy at t = {time}, {point:?}: ⟨dS, F⟩ is {size:.1e} of its terms; what carries entropy \
         is a bath, or take the entropy as a variable that the port does not move"
    )]
    WorkCarriesEntropy {
        /// The name of the port.
        port: Arc<str>,
        /// The time.
        time: f64,
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// The friction of a bath is negative.
    #[error(
        "the friction of the bath `{bath}` has the rate {rate} at t = {time}; a rate must not be negative"
    )]
    FrictionNotPositive {
        /// The name of the bath.
        bath: Arc<str>,
        /// The least rate.
        rate: f64,
        /// The time.
        time: f64,
    },
    /// The temperature of a bath is negative or no number.
    #[error(
        "the bath `{bath}` has the temperature {temperature} at t = {time}; it must be a positive number, or zero for a \
         friction that takes energy alone"
    )]
    BathNotPositive {
        /// The name of the bath.
        bath: Arc<str>,
        /// The temperature.
        temperature: f64,
        /// The time.
        time: f64,
    },
    /// A port or a bath changes a further invariant.
    #[error(
        "`{part}` changes invariant {index} at t = {time}, {point:?}: ⟨dL, velocity⟩ is {size:.1e} of its terms; leave the \
         invariant out of the list"
    )]
    PortBreaksInvariant {
        /// The name of the port or the bath.
        part: Arc<str>,
        /// Which invariant, in the order of the list, counted from 0.
        index: usize,
        /// The time.
        time: f64,
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// The velocity of a port or a bath is not a number.
    #[error(
        "the velocity of `{part}` is not finite at t = {time}, {point:?}; start where it is defined"
    )]
    ExchangeNotFinite {
        /// The name of the port or the bath.
        part: Arc<str>,
        /// The time.
        time: f64,
        /// The entries of the point.
        point: Vec<f64>,
    },
    /// The derivative of the energy along time is not that of its values.
    #[error(
        "the energy has the derivative {derivative:.6e} along time at t = {time}, {point:?}, but its values change at the rate \
         {quotient:.6e}: the closure loses the derivative of `t`, as `t.re` does; compute with `t` as a `Real`. In a system of your own correct \
         `Equations::power`"
    )]
    LostTimeDerivative {
        /// The time.
        time: f64,
        /// The entries of the point.
        point: Vec<f64>,
        /// The derivative by dual numbers.
        derivative: f64,
        /// The difference quotient of the values.
        quotient: f64,
    },
    /// The energy of a system of your own depends on time, and the system is closed or does not say so.
    #[error(
        "the energy depends on time: open the system by `.opened()`, which books the work of the time, and answer \
         `Equations::energy_depends_on_time` and `Equations::power`; a closed run asks at the time 0 alone"
    )]
    EnergyInTime,
    /// A contact of a bath acts on a direction that does not exist.
    #[error(
        "a contact of the bath `{bath}` acts on the direction {direction} of {directions}, which are counted from 0"
    )]
    ContactOutside {
        /// The name of the bath.
        bath: Arc<str>,
        /// The direction.
        direction: usize,
        /// How many there are.
        directions: usize,
    },
    /// A system of your own says sizes that cannot be.
    #[error(
        "a system with {entries} entries, {directions} directions and {laws} laws cannot be: it has at least one direction, no more of \
         them than entries, and two laws, the energy and the entropy"
    )]
    BadSizes {
        /// The numbers of a state.
        entries: usize,
        /// The directions of its chart.
        directions: usize,
        /// The laws.
        laws: usize,
    },
    /// The velocity of a system of your own changes its energy.
    #[error(
        "the velocity changes the energy at {point:?}: ⟨dH, x'⟩ is {size:.1e} of its terms; compare the differentials and the \
         velocity with H"
    )]
    MotionChangesEnergy {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// The velocity of a system of your own changes a further invariant.
    #[error(
        "the velocity changes a further invariant at {point:?}: ⟨dL, x'⟩ is {size:.1e} of its terms; a law of a system is \
         conserved by its velocity"
    )]
    MotionChangesInvariant {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// The production that a system of your own returns is not the growth of its entropy.
    #[error(
        "the production of entropy is not ⟨dS, x'⟩ at {point:?}: it is off by {size:.1e} of its terms; return from `velocity` what \
         the friction adds to S"
    )]
    ProductionOff {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// The entropy of a system of your own falls.
    #[error(
        "the entropy falls at {point:?}: the production is negative by {size:.1e} of its terms; friction must not be negative"
    )]
    ProductionNegative {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
    /// `K_w w ≠ 0` for a discrete gradient `w` of the energy.
    #[error(
        "the dissipation annihilates dH at {point:?}, but not the discrete gradient w of the energy that a \
         step gives it in the place of dH: K_w w is {size:.1e} of its terms; build K from w and not from \
         dH(x), or ask for `ProjectedDissipation`"
    )]
    CovectorNotAnnihilated {
        /// The entries of the point.
        point: Vec<f64>,
        /// The relative size of the violation.
        size: f64,
    },
}

crate::debug_is_the_sentence!(ModelError);
