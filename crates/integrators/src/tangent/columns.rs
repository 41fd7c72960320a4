//! The derivatives that a run carries along.

use metriplectic_dynamics::velocity::{Covectors, Gradient};
use metriplectic_dynamics::{Invariants, Metriplectic, system::Point};
use metriplectic_fields::{
    Column as _, Dimension as _, Jet1, Matrix, ScalarField, Space, Square as _, Vector,
};

use crate::step::{CountOf, Dim};

/// The derivatives of the values onto which explicit methods move a state, along the start and the parameters.
#[derive(Clone, Debug)]
pub(crate) struct Laws<V> {
    pub(crate) energy: V,
    pub(crate) invariants: Vec<V>,
    /// The entropy at the start, and what was produced since.
    pub(crate) entropy: V,
    /// Whether the method says what was produced.
    pub(crate) entropy_is_known: bool,
}

/// The tangent `T = ∂x/∂(x₀, θ)` of a run at one of its states, in the frames of the charts at both ends.
///
/// Column `j` is the derivative along direction `j` of the wide system: first those of the start, then the parameters.
#[derive(Debug)]
pub struct Columns<Y: Metriplectic> {
    pub(crate) t: Matrix<Y::Manifold>,
    pub(crate) laws: Laws<Vector<Y::Manifold>>,
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
        let laws = Laws {
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

/// The row `dFᵀ T` and, column by column, the size `Σ_i |∂_iF T_ij|` of its terms.
pub(crate) fn row<Y: Metriplectic>(
    df: &Vector<Y::Manifold>,
    t: &Matrix<Y::Manifold>,
) -> [Vector<Y::Manifold>; 2] {
    let sizes = Vector::<Y::Manifold>::from_index(|j| {
        (0..Dim::<Y>::LEN).fold(0.0, |sum, i| sum + (df[i] * t[(i, j)]).abs())
    });
    [t.transpose_times(df), sizes]
}
