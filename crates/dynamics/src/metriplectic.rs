//! The parts of a metriplectic system: manifold, metric, bracket, dissipation, energy, entropy, invariants.

use metriplectic_equations::{Evaluated, Evaluation, Kind};
use metriplectic_fields::{ChartPoint, Scalar, ScalarField, Space, Vector};
use metriplectic_manifolds::{Manifold, MetricAt, Riemannian};

use crate::bracket::{Bracket, BracketArgs};
use crate::dissipation::Dissipation;
use crate::invariants::{Invariants, Visitor};
use crate::vector_field::VectorField;
use crate::verification::{Begun, Verify};

/// The parts of a system `x' = Π dH + K dS`, which an integrator asks for. [`System`](crate::System) is the
/// one to build.
///
/// The parts determine the [`VectorField`] of the system and how to [`Verify`] its model. Both are implemented
/// for every type that has the parts, and both are supertraits, so that generic code needs one bound.
pub trait Metriplectic:
    VectorField<<Self as Metriplectic>::Manifold> + Verify<<Self as Metriplectic>::Manifold>
{
    /// The space of states.
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

    /// Returns the space of states.
    fn manifold(&self) -> &Self::Manifold;
    /// Returns the Riemannian metric.
    fn metric(&self) -> &Self::Metric;
    /// Returns the Poisson tensor `Π`.
    fn bracket(&self) -> &Self::Bracket;
    /// Returns the dissipation `K`.
    fn dissipation(&self) -> &Self::Dissipation;
    /// Returns the energy `H`.
    fn energy(&self) -> &Self::Energy;
    /// Returns the entropy `S`.
    fn entropy(&self) -> &Self::Entropy;
    /// Returns the further invariants `L_a`.
    fn invariants(&self) -> &Self::Invariants;
    /// Returns which scheme treats the entropy, and what this scheme promises.
    fn second_law(&self) -> SecondLaw;

    /// Returns whether the model has been verified. [`Verify::check_start`] then checks the start alone.
    #[inline]
    fn is_verified(&self) -> bool {
        false
    }

    /// Returns where a system notes that its laws have been verified for a run, if it does.
    #[doc(hidden)]
    fn begun(&self) -> Option<&Begun> {
        None
    }

    /// Evaluates the energy `H(x)`.
    #[inline]
    fn energy_at(&self, x: &Point<Self>) -> f64 {
        self.energy().at(x)
    }

    /// Evaluates the entropy `S(x)`; 0 without an entropy.
    #[inline]
    fn entropy_at(&self, x: &Point<Self>) -> f64 {
        self.entropy().at(x)
    }

    /// Returns the metric at `x`, which is evaluated when it is first used there.
    #[inline]
    fn metric_at<'a, D: Scalar>(
        &'a self,
        x: &'a ChartPoint<Self::Manifold, D>,
    ) -> MetricAt<'a, Self::Manifold, Self::Metric, D> {
        MetricAt::new(self.metric(), x)
    }

    /// Returns the arguments of the bracket: the metric `g` at a point, and the covector `s` of the entropy there.
    #[inline]
    fn bracket_args<'a, D: Scalar>(
        &'a self,
        g: &'a MetricAt<'a, Self::Manifold, Self::Metric, D>,
        s: &'a Vector<Self::Manifold, D>,
    ) -> BracketArgs<'a, Self::Manifold, Self::Metric, D> {
        BracketArgs { space: self.manifold(), g, s }
    }
}

/// Lists the fields of a system that are evaluated from a recording, and why the others are not.
#[must_use]
pub fn evaluated<Y: Metriplectic + ?Sized>(system: &Y, x: &Point<Y>) -> Vec<Evaluated> {
    struct OfFields<'a, M: Space>(&'a M::Point<f64>, Vec<(&'static str, Evaluation)>);
    impl<M: Space> OfFields<'_, M> {
        fn add<F: ScalarField<M>>(&mut self, name: &'static str, f: &F) {
            if !F::IS_CONSTANT {
                self.1.push((name, f.evaluation(self.0)));
            }
        }
    }
    impl<M: Space> Visitor<M> for OfFields<'_, M> {
        fn visit(&mut self, kind: Kind, f: &impl ScalarField<M>) {
            self.add(kind.name(), f);
        }
    }
    let mut fields = OfFields::<Y::Manifold>(x, Vec::new());
    fields.add("energy", system.energy());
    if system.second_law() != SecondLaw::NoEntropy {
        fields.add("entropy", system.entropy());
    }
    system.invariants().each(&mut fields);
    let tensors = [("metric", Y::Metric::IS_RECORDED), ("Poisson tensor", Y::Bracket::IS_RECORDED)];
    let tapes = tensors.into_iter().filter(|(_, is_recorded)| *is_recorded);
    fields.1.extend(tapes.map(|(name, _)| (name, Evaluation::Tape)));
    Evaluated::list(fields.1)
}

/// Takes parts of another system, in an implementation of [`Metriplectic`] for a type that replaces the
/// other parts.
///
/// ```
/// use metriplectic_dynamics::{Metriplectic, SecondLaw, parts_of};
///
/// /// A system with the published scheme.
/// struct Published<Y>(Y);
///
/// impl<Y: Metriplectic> Metriplectic for Published<Y> {
///     parts_of!(self.0: Y {
///         manifold: Manifold, metric: Metric, bracket: Bracket, dissipation: Dissipation,
///         energy: Energy, entropy: Entropy, invariants: Invariants,
///     });
///
///     fn second_law(&self) -> SecondLaw {
///         SecondLaw::Published
///     }
/// }
/// ```
#[macro_export]
macro_rules! parts_of {
    ($this:ident.$system:tt: $other:ty { $($part:ident: $kind:ident),+ $(,)? }) => {$(
        type $kind = <$other as $crate::Metriplectic>::$kind;

        #[inline]
        fn $part(&$this) -> &Self::$kind {
            $this.$system.$part()
        }
    )+};
}

/// A state of the system `Y`.
pub type Point<Y> = <<Y as Metriplectic>::Manifold as Space>::Point<f64>;

/// The dimension of the manifold of the system `Y`.
pub(crate) type Dim<Y> = <<Y as Metriplectic>::Manifold as Space>::Dim;

/// The number of further invariants of the system `Y`, for lists with one value each.
pub type CountOf<Y> =
    <<Y as Metriplectic>::Invariants as Invariants<<Y as Metriplectic>::Manifold>>::Count;

pub use metriplectic_equations::SecondLaw;
