//! Questions of derivatives of a run to a flow.

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{Column as _, Dimension as _, Jet1, Real, ScalarField, Space, Vector};
use nalgebra::{DMatrix, DVector};

use super::columns::{LawRows, jets};
use super::exact::ExactSteps;
use super::frames::between;
use crate::noise::{Fluctuating, Noisy};
use crate::step::{Dim, Element, Flow, HasFlow};

/// A flow whose laws have differentials, and whose states may carry derivatives.
///
/// Vectors and covectors have a number for each direction of a [vector](Flow::Vector) of the flow, with those of a ledger beside them:
/// the clock, the work of the time in the energy, and the entries of ports and baths.
pub trait SmoothFlow: Flow + Sized {
    /// A state whose entries carry derivatives, of the closures of a loss.
    type Moving: 'static;

    /// Returns the number of directions.
    fn directions(&self) -> usize;

    /// Returns the direction that is the time; `None` if the states of the flow have no clock.
    fn clock(&self) -> Option<usize> {
        None
    }

    /// Computes the power `∂_t H` of the time in the energy at a state, with the direction of its work; `None` if the energy does not
    /// depend on time.
    fn power_of_time(&self, x: &Element<Self>) -> Option<(usize, f64)> {
        let _ = x;
        None
    }

    /// Computes the differentials of the laws at a state, as [`Flow::laws`] has them.
    fn law_rows(&self, x: &Element<Self>) -> LawRows<DVector<f64>>;

    /// Computes the displacement from a state to another one, as [`Flow::displacement`] does.
    fn between(&self, x: &Element<Self>, y: &Element<Self>) -> Option<Self::Vector> {
        self.displacement(x, y)
    }

    /// Computes the matrix from the frame at a state to that at another one, which differs from it by round-off; `None` if they are
    /// the same.
    fn turn(&self, from: &Element<Self>, to: &Element<Self>) -> Option<DMatrix<f64>>;

    /// Computes the value and the differential of a function of the state.
    fn differential(
        &self,
        f: &dyn Fn(&Self::Moving) -> Real,
        x: &Element<Self>,
    ) -> (f64, DVector<f64>);

    /// Moves a state along a vector: the first derivative of its entries.
    fn moving(&self, x: &Element<Self>, v: &DVector<f64>) -> Self::Moving;

    /// Computes the coordinates of a moving state around `y`, with their first derivative. A ledger has none.
    fn coordinates(&self, y: &Element<Self>, there: &Self::Moving) -> Vec<[f64; 2]>;

    /// Returns the exact derivatives of steps, if the flow knows some.
    fn exact_steps(&self) -> Option<&dyn ExactSteps<Self>> {
        None
    }
}

/// The flow of a system.
pub type FlowOf<D> = <D as HasFlow>::Flow;

/// The space of its states.
pub type SpaceOf<D> = <FlowOf<D> as Flow>::Space;

/// A vector of it.
pub(super) type VectorOf<D> = <FlowOf<D> as Flow>::Vector;

/// The numbers of a column.
pub(super) fn numbers<V: metriplectic_fields::Column<f64>>(v: &V) -> DVector<f64> {
    DVector::from_fn(V::LEN, |i, _| v[i])
}

/// The matrix with the same entries.
pub(super) fn matrix<M: Space>(a: &metriplectic_fields::Matrix<M>) -> DMatrix<f64> {
    let n = M::Dim::LEN;
    DMatrix::from_fn(n, n, |i, j| a[(i, j)])
}

impl<Y: Metriplectic> SmoothFlow for Y {
    type Moving = <Y::Manifold as Space>::Point<Real>;

    fn directions(&self) -> usize {
        Dim::<Y>::LEN
    }

    fn law_rows(&self, x: &Point<Y>) -> LawRows<DVector<f64>> {
        let jets = jets(self, x);
        let listed = jets.invariants.as_ref().iter().flatten();
        let invariants = listed.map(|(_, jet)| numbers(&jet.df)).collect();
        LawRows::new(numbers(&jets.energy.df), numbers(&jets.entropy.df), invariants)
    }

    fn turn(&self, from: &Point<Y>, to: &Point<Y>) -> Option<DMatrix<f64>> {
        between::<Y::Manifold>(from, to).map(|turn| matrix::<Y::Manifold>(&turn))
    }

    fn differential(&self, f: &dyn Fn(&Self::Moving) -> Real, x: &Point<Y>) -> (f64, DVector<f64>) {
        let field = |x: &Self::Moving| f(x);
        let Jet1 { value, df } = ScalarField::<Y::Manifold>::jet1(&field, x);
        (value, numbers(&df))
    }

    fn moving(&self, x: &Point<Y>, v: &DVector<f64>) -> Self::Moving {
        let q = |i: usize| Real::new(0.0, v[i], 0.0, 0.0);
        Y::Manifold::chart(x, &Vector::<Y::Manifold, Real>::from_index(q))
    }

    fn coordinates(&self, y: &Point<Y>, there: &Self::Moving) -> Vec<[f64; 2]> {
        let q = Y::Manifold::coordinates(y, there);
        (0..Dim::<Y>::LEN).map(|i| [q[i].re, q[i].eps1]).collect()
    }
}

/// A system with noise has the laws and the states of the system without.
impl<F: Fluctuating<U> + SmoothFlow, U> SmoothFlow for Noisy<F, U> {
    type Moving = F::Moving;

    fn directions(&self) -> usize {
        self.flow().directions()
    }

    fn clock(&self) -> Option<usize> {
        self.flow().clock()
    }

    fn power_of_time(&self, x: &Element<F>) -> Option<(usize, f64)> {
        self.flow().power_of_time(x)
    }

    fn law_rows(&self, x: &Element<F>) -> LawRows<DVector<f64>> {
        self.flow().law_rows(x)
    }

    /// No state lies between the ends of a step with noise, but there is a displacement.
    fn between(&self, x: &Element<F>, y: &Element<F>) -> Option<F::Vector> {
        self.flow().displacement(x, y)
    }

    fn turn(&self, from: &Element<F>, to: &Element<F>) -> Option<DMatrix<f64>> {
        self.flow().turn(from, to)
    }

    fn differential(&self, f: &dyn Fn(&F::Moving) -> Real, x: &Element<F>) -> (f64, DVector<f64>) {
        self.flow().differential(f, x)
    }

    fn moving(&self, x: &Element<F>, v: &DVector<f64>) -> F::Moving {
        self.flow().moving(x, v)
    }

    fn coordinates(&self, y: &Element<F>, there: &F::Moving) -> Vec<[f64; 2]> {
        self.flow().coordinates(y, there)
    }
}
