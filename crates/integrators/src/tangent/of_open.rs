//! The derivatives of runs of open systems, of what is booked too.

use metriplectic_dynamics::Metriplectic;
use metriplectic_dynamics::exchange::{Entries as _, Exchange};
use metriplectic_fields::{Column as _, Jet1, Real, ScalarField, Space, Vector};
use nalgebra::{DMatrix, DVector};

use super::columns::LawRows;
use super::differentiated::Differentiated;
use super::frames::between;
use super::smooth::{SmoothFlow, matrix, numbers};
use super::state::TangentState;
use crate::open::{Clock, OpenSpace, OpenState, OpenSystem, StateOf};
use crate::step::{Flow, Laws, StateSpace, Stepper, Vector as _};

impl<Y, C, X> SmoothFlow for OpenSystem<Y, C, X>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    type Moving = <Y::Manifold as Space>::Point<Real>;

    fn directions(&self) -> usize {
        // The clock, the work of the time, and what ports and baths book.
        Vector::<Y::Manifold>::LEN + 2 + X::Entries::LEN
    }

    fn clock(&self) -> Option<usize> {
        Some(Vector::<Y::Manifold>::LEN)
    }

    fn power_of_time(&self, x: &StateOf<Y>) -> Option<(usize, f64)> {
        C::RUNS.then(|| (Vector::<Y::Manifold>::LEN + 1, self.power(x.time, &x.x)))
    }

    /// The differentials of the balance `H − W − Q` and of `S + Σ S_b`. The clock moves neither: the frozen work is booked.
    fn law_rows(&self, x: &StateOf<Y>) -> LawRows<DVector<f64>> {
        let w = self.covectors(x.time, &x.x);
        let (n, all) = (Vector::<Y::Manifold>::LEN, self.directions());
        let whole = |df: &Vector<Y::Manifold>| numbers(df).resize_vertically(all, 0.0);
        let (mut energy, mut entropy) = (whole(&w.energy), whole(&w.entropy));
        let zero = self.sizes(x).zero();
        for i in n + 1..all {
            let entry = zero.with(|k| if k == i { 1.0 } else { 0.0 });
            let none = Laws { energy: 0.0, entropy: 0.0, invariants: [(); 0] };
            let booked = self.moved(&self.start(x.x.clone()), &entry).ledger.balanced(none);
            (energy[i], entropy[i]) = (booked.energy, booked.entropy);
        }
        let listed = w.invariants.as_ref().iter().flatten();
        LawRows::new(energy, entropy, listed.map(|(_, df)| whole(df)).collect())
    }

    fn turn(&self, from: &StateOf<Y>, to: &StateOf<Y>) -> Option<DMatrix<f64>> {
        let turn = matrix::<Y::Manifold>(&between::<Y::Manifold>(&from.x, &to.x)?);
        let mut whole = DMatrix::identity(self.directions(), self.directions());
        whole.view_mut((0, 0), turn.shape()).copy_from(&turn);
        Some(whole)
    }

    fn differential(
        &self,
        f: &dyn Fn(&Self::Moving) -> Real,
        x: &StateOf<Y>,
    ) -> (f64, DVector<f64>) {
        let field = |x: &Self::Moving| f(x);
        let Jet1 { value, df } = ScalarField::<Y::Manifold>::jet1(&field, &x.x);
        (value, numbers(&df).resize_vertically(self.directions(), 0.0))
    }

    fn moving(&self, x: &StateOf<Y>, v: &DVector<f64>) -> Self::Moving {
        let q = |i: usize| Real::new(0.0, v[i], 0.0, 0.0);
        Y::Manifold::chart(&x.x, &Vector::<Y::Manifold, Real>::from_index(q))
    }

    fn coordinates(&self, y: &StateOf<Y>, there: &Self::Moving) -> Vec<[f64; 2]> {
        let q = Y::Manifold::coordinates(&y.x, there);
        (0..Vector::<Y::Manifold>::LEN).map(|i| [q[i].re, q[i].eps1]).collect()
    }
}

/// By differences of steps.
impl<Y, C, X, M> Differentiated<M> for OpenSystem<Y, C, X>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
    M: Stepper<Self>,
{
    type MovingWide = <Self as SmoothFlow>::Moving;

    fn moved_along(&self, x: &StateOf<Y>, v: &DVector<f64>) -> Self::MovingWide {
        self.moving(x, v)
    }

    fn coordinates_around(&self, y: &StateOf<Y>, there: &Self::MovingWide) -> Vec<[f64; 2]> {
        SmoothFlow::coordinates(self, y, there)
    }
}

/// The rows of the ledger: the derivatives of what was booked along the start. Columns are those of
/// [`matrix`](TangentState::matrix): the directions of the point, the clock, what was booked before, and the parameters.
impl<P, F: Flow<Space: StateSpace<Element = OpenState<P>>>> TangentState<F> {
    /// The rows of ports and baths are the last ones of a state, before those of parameters.
    fn booked_along(&self, place: usize) -> DVector<f64> {
        let [n, _] = self.lengths();
        self.carried.t.row(n - self.point.ledger.count() + place).transpose()
    }

    /// The derivative of the work of a port; `None` if no port has this name.
    pub fn work_along(&self, port: &str) -> Option<DVector<f64>> {
        let [work, ..] = self.point.ledger.places(port);
        work.map(|place| self.booked_along(place))
    }

    /// The derivative of the heat of a bath; `None` if no bath has this name.
    pub fn heat_along(&self, bath: &str) -> Option<DVector<f64>> {
        let [_, heat, _] = self.point.ledger.places(bath);
        heat.map(|place| self.booked_along(place))
    }

    /// The derivative of the entropy that a bath has gained; `None` if no bath has this name.
    pub fn bath_entropy_along(&self, bath: &str) -> Option<DVector<f64>> {
        let [.., entropy] = self.point.ledger.places(bath);
        entropy.map(|place| self.booked_along(place))
    }
}

impl<M: StateSpace, F: Flow<Space = OpenSpace<M>>> TangentState<F> {
    /// The derivative of the work `W_t` of the time in the energy. The column of the clock is that of a start whose clock moves at a fixed
    /// point, where `∂_t H` is work already, and so at the end: it is `dW_t/dt₀ + ∂_t H(x₀) − ∂_t H(x)`.
    pub fn parameter_work_along(&self) -> DVector<f64> {
        self.booked_along(0)
    }
}
