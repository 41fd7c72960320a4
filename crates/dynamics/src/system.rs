//! A metriplectic system, as its seven parts.

use std::fmt;

use metriplectic_fields::{Dimension, ErasedField, Scalar, ScalarField, Space};
use metriplectic_manifolds::{Manifold, Riemannian};

use crate::bracket::Bracket;
use crate::dissipation::Dissipation;
use crate::invariants::Invariants;
use crate::verification::Begun;

pub use crate::metriplectic::{Metriplectic, Point, SecondLaw};

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

/// The largest dimension of a system.
const MOST_VARIABLES: usize = 256;

/// The tensors of a system, and the manifold that they live on.
#[derive(Clone)]
pub(crate) struct Tensors<M, G, B, K> {
    pub(crate) manifold: M,
    pub(crate) metric: G,
    pub(crate) bracket: B,
    pub(crate) dissipation: K,
}

/// The scalar fields of a system.
#[derive(Clone)]
pub(crate) struct Fields<H, S, L> {
    pub(crate) energy: H,
    pub(crate) entropy: S,
    pub(crate) invariants: L,
}

/// The settings of a builder beside the parts.
#[derive(Clone, Copy)]
pub(crate) struct Context {
    pub(crate) has_entropy: bool,
    /// Whether something outside may move the system and change its entropy.
    pub(crate) is_open: bool,
}

/// A metriplectic system on the manifold `M` with metric `G`, bracket `B`, dissipation `K`, energy
/// `H`, entropy `S` and further invariants `L`; built by [`System::on`].
#[derive(Clone)]
pub struct System<M, G, B, K, H, S, L = ()> {
    tensors: Tensors<M, G, B, K>,
    fields: Fields<H, S, L>,
    second_law: SecondLaw,
    begun: Begun,
}

// By hand, because closures have no `Debug`.
impl<M: fmt::Debug, G, B, K, H, S, L> fmt::Debug for System<M, G, B, K, H, S, L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("System")
            .field("manifold", &self.tensors.manifold)
            .field("second_law", &self.second_law)
            .finish_non_exhaustive()
    }
}

impl<M, G, B, K, H, S, L> System<M, G, B, K, H, S, L>
where
    M: Manifold,
    G: Riemannian<M>,
    B: Bracket<M, G>,
    K: Dissipation<M, G>,
    L: Invariants<M>,
{
    /// Puts the parts together, and checks that something moves, that the second law concerns an entropy that
    /// changes, and that the invariants leave directions to move in.
    pub(crate) fn new(
        tensors: Tensors<M, G, B, K>,
        fields: Fields<H, S, L>,
        second_law: SecondLaw,
        Context { has_entropy, is_open }: Context,
    ) -> Result<Self, BuildError> {
        const {
            assert!(
                M::Dim::LEN <= MOST_VARIABLES,
                "a system has at most 256 variables, because the tensors of a larger one do not fit into memory that \
                 is known to the compiler: write it as a lattice of sites and bonds, or as a flow of your own"
            );
        }
        let dissipates = !tensors.dissipation.is_none();
        if !dissipates && !is_open && tensors.bracket.is_zero() {
            return Err(BuildError::NothingMoves);
        }
        let changes = dissipates || is_open || tensors.bracket.is_forced();
        let promises = second_law != SecondLaw::NoEntropy;
        let needs_entropy = promises || dissipates;
        if needs_entropy && !has_entropy || has_entropy && changes && !promises {
            return Err(BuildError::SecondLawWithoutEntropy);
        }
        if L::COUNT >= M::Dim::LEN {
            return Err(BuildError::TooManyInvariants { count: L::COUNT, dimension: M::Dim::LEN });
        }
        Ok(Self { tensors, fields, second_law, begun: Begun::default() })
    }
}

impl<M: Space, G, B, K, H, S, L> System<M, G, B, K, H, S, L> {
    /// Moves energy and entropy behind pointers, so that systems with other closures have the same type.
    ///
    /// A `Vec` then holds several models, and a struct names the type of its system. Closures keep the bits of a run. Each of
    /// their evaluations is a call through a pointer; [`ErasedField`] has the price. Metric, bracket, dissipation and
    /// further invariants keep their types.
    ///
    /// ```
    /// use metriplectic_dynamics::{BuildError, System, VectorField};
    /// use metriplectic_fields::{ChartPoint, Real};
    /// use metriplectic_manifolds::LieDual;
    /// use nalgebra::{Vector3, vector};
    ///
    /// let round = System::on(LieDual::so3())
    ///     .energy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
    ///     .entropy(|p: &Vector3<Real>| p.norm_squared())
    ///     .build()?;
    /// let long = System::on(LieDual::so3())
    ///     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z)
    ///     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
    ///     .build()?;
    /// let bodies = vec![round.erased(), long.erased()];
    /// let x = ChartPoint::<LieDual<3>>::centre(&vector![1.0, 2.0, 3.0]);
    /// let speeds: Vec<f64> = bodies.iter().map(|body| body.velocity(&x).unwrap().norm()).collect();
    /// assert!(speeds[0] < 1e-15 && speeds[1] > 1.0);
    /// # Ok::<(), BuildError>(())
    /// ```
    pub fn erased(self) -> System<M, G, B, K, ErasedField<M>, ErasedField<M>, L>
    where
        H: ScalarField<M> + Send + Sync + 'static,
        S: ScalarField<M> + Send + Sync + 'static,
    {
        self.map_fields(ErasedField::new, ErasedField::new)
    }
}

/// A system whose energy and entropy can be moved behind pointers, as [`System::erased`] does: a member of a family, an open
/// system, one with noise too. Ports, baths and all other parts keep their types. A system in plain numbers is moved as a whole.
pub trait Erase: Sized {
    /// This system with energy and entropy behind pointers.
    type Erased;

    /// Moves energy and entropy behind pointers.
    fn erased(self) -> Self::Erased;
}

impl<M, G, B, K, H, S, L> Erase for System<M, G, B, K, H, S, L>
where
    M: Space,
    H: ScalarField<M> + Send + Sync + 'static,
    S: ScalarField<M> + Send + Sync + 'static,
{
    type Erased = System<M, G, B, K, ErasedField<M>, ErasedField<M>, L>;

    fn erased(self) -> Self::Erased {
        Self::erased(self)
    }
}

impl<M, G, B, K, H, S, L> System<M, G, B, K, H, S, L> {
    /// Replaces energy and entropy by other forms of the same functions.
    #[doc(hidden)]
    pub fn map_fields<E, F>(
        self,
        energy: impl FnOnce(H) -> E,
        entropy: impl FnOnce(S) -> F,
    ) -> System<M, G, B, K, E, F, L> {
        let Self { tensors, fields, second_law, .. } = self;
        let Fields { energy: h, entropy: s, invariants } = fields;
        let fields = Fields { energy: energy(h), entropy: entropy(s), invariants };
        System { tensors, fields, second_law, begun: Begun::default() }
    }

    /// Puts parts together that belong to a system which has been checked.
    pub(crate) fn frozen(
        manifold: M,
        (metric, bracket, dissipation): (G, B, K),
        (energy, entropy, invariants): (H, S, L),
        second_law: SecondLaw,
    ) -> Self {
        let tensors = Tensors { manifold, metric, bracket, dissipation };
        let fields = Fields { energy, entropy, invariants };
        Self { tensors, fields, second_law, begun: Begun::default() }
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
        &self.tensors.manifold
    }

    #[inline]
    fn metric(&self) -> &G {
        &self.tensors.metric
    }

    #[inline]
    fn bracket(&self) -> &B {
        &self.tensors.bracket
    }

    #[inline]
    fn dissipation(&self) -> &K {
        &self.tensors.dissipation
    }

    #[inline]
    fn energy(&self) -> &H {
        &self.fields.energy
    }

    #[inline]
    fn entropy(&self) -> &S {
        &self.fields.entropy
    }

    #[inline]
    fn invariants(&self) -> &L {
        &self.fields.invariants
    }

    #[inline]
    fn second_law(&self) -> SecondLaw {
        self.second_law
    }

    fn begun(&self) -> Option<&Begun> {
        Some(&self.begun)
    }
}

/// Parts that do not make a system.
#[derive(Clone, Copy, PartialEq, Eq, thiserror::Error)]
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

metriplectic_equations::debug_is_the_sentence!(BuildError);
