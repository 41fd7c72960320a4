//! The derivatives that a run carries along.

use metriplectic_dynamics::velocity::{Covectors, Gradient};
use metriplectic_dynamics::{Invariants, Metriplectic, system::Point};
use metriplectic_fields::{Jet1, Matrix, ScalarField, Space, Square as _, Vector};

use nalgebra::{DMatrix, DVector};

use crate::step::CountOf;

/// The derivatives of the values onto which explicit methods move a state, along the start and the parameters.
#[derive(Clone, Debug)]
pub struct LawRows<V> {
    pub(crate) energy: V,
    pub(crate) invariants: Vec<V>,
    /// The entropy at the start, and what was produced since.
    pub(crate) entropy: V,
    /// Whether the method says what was produced.
    pub(crate) entropy_is_known: bool,
}

/// The derivatives that a run carries along, in plain numbers: the tangent `T = ∂x/∂(x₀, θ)` at one of its states, in the frames of the
/// charts at both ends, and those of its laws.
///
/// Column `j` is the derivative along direction `j`: first those of the start, then the parameters. The rows of the parameters are
/// those of the identity.
#[derive(Clone, Debug)]
pub struct Carried {
    pub(crate) t: DMatrix<f64>,
    pub(crate) laws: LawRows<DVector<f64>>,
}

/// A step with its derivatives.
#[derive(Clone, Debug)]
pub struct Moved {
    /// The derivatives at the end of the step.
    pub(crate) carried: Carried,
    /// The derivative `∂x'/∂h` of the end along the size of the step, in the directions of the state.
    pub(crate) along_h: DVector<f64>,
}

impl<V> LawRows<V> {
    /// The rows of the energy, the entropy and the further invariants.
    pub const fn new(energy: V, entropy: V, invariants: Vec<V>) -> Self {
        Self { energy, invariants, entropy, entropy_is_known: false }
    }

    /// A function of each row.
    #[must_use]
    pub fn map<W>(&self, f: impl Fn(&V) -> W) -> LawRows<W> {
        let Self { energy, invariants, entropy, entropy_is_known } = self;
        let invariants = invariants.iter().map(&f).collect();
        let (energy, entropy) = (f(energy), f(entropy));
        LawRows { energy, invariants, entropy, entropy_is_known: *entropy_is_known }
    }
}

impl LawRows<DVector<f64>> {
    /// Sets the derivatives of the energy and of the entropy in a direction.
    pub fn set(&mut self, direction: usize, energy: f64, entropy: f64) {
        (self.energy[direction], self.entropy[direction]) = (energy, entropy);
    }
}

impl Carried {
    /// Makes the tangent at the start of a run, `T = 1`, from the differentials of its laws there.
    pub(crate) fn start(laws: LawRows<DVector<f64>>) -> Self {
        let n = laws.energy.len();
        Self { t: DMatrix::identity(n, n), laws }
    }
}

/// The row `dFᵀ T` and, column by column, the size `Σ_i |∂_iF T_ij|` of its terms.
pub(crate) fn row(df: &DVector<f64>, t: &DMatrix<f64>) -> [DVector<f64>; 2] {
    let size = |j: usize| (0..t.nrows()).map(|i| (df[i] * t[(i, j)]).abs()).sum();
    let sizes = DVector::from_fn(t.ncols(), |j, _| size(j));
    [t.tr_mul(df), sizes]
}

/// The columns of a [`Carried`] tangent, as a system takes them in its types.
#[derive(Debug)]
pub struct Columns<Y: Metriplectic> {
    pub(crate) t: Matrix<Y::Manifold>,
    pub(crate) laws: LawRows<Vector<Y::Manifold>>,
}

impl<Y: Metriplectic> Clone for Columns<Y> {
    fn clone(&self) -> Self {
        Self { t: self.t, laws: self.laws.clone() }
    }
}

/// The differentials of all fields at a point.
struct First<'a, M: Space>(&'a M::Point<f64>);

impl<M: Space> Gradient<M> for First<'_, M> {
    type Covector = Jet1<M>;

    fn of(&mut self, f: &impl ScalarField<M>) -> Jet1<M> {
        f.jet1(self.0)
    }
}

/// The values and differentials of all fields of a system at a point.
pub(crate) fn jets<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
) -> Covectors<CountOf<Y>, Jet1<Y::Manifold>> {
    let mut first = First::<Y::Manifold>(x);
    let laws = [first.of(system.energy()), first.of(system.entropy())];
    Covectors::new(laws, system.invariants(), &mut first)
}

impl<Y: Metriplectic> Columns<Y> {
    /// Makes the tangent at the start of a run, `T = 1`.
    pub(crate) fn start(system: &Y, x0: &Point<Y>) -> Self {
        let jets = jets(system, x0);
        let listed = jets.invariants.as_ref().iter().flatten();
        let laws = LawRows {
            energy: jets.energy.df,
            invariants: listed.take(Y::Invariants::COUNT).map(|(_, jet)| jet.df).collect(),
            entropy: jets.entropy.df,
            entropy_is_known: false,
        };
        Self { t: Matrix::<Y::Manifold>::one(), laws }
    }

    /// The tangent after a step with the derivative `J`.
    pub(crate) fn after(&self, j: &Matrix<Y::Manifold>) -> Self {
        Self { t: *j * self.t, laws: self.laws.clone() }
    }

    /// The tangent matrix.
    pub const fn matrix(&self) -> &Matrix<Y::Manifold> {
        &self.t
    }
}
