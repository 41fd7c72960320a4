//! The derivatives of runs of open systems, of what is booked too.

use metriplectic_dynamics::Metriplectic;
use metriplectic_dynamics::exchange::{Entries as _, Exchange};
use metriplectic_equations::Equations;
use metriplectic_fields::{Column as _, Jet1, Real, ScalarField, Space, Vector};
use nalgebra::{DMatrix, DVector};

use super::columns::LawRows;
use super::differentiated::Differentiated;
use super::frames::between;
use super::smooth::{SmoothFlow, matrix, numbers};
use super::state::TangentState;
use crate::open::{Clock, OpenEquations, OpenSpace, OpenState, OpenSystem, StateOf};
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

/// Gives the flow `$flow` around points, with states `$moving` that carry derivatives, the questions of derivatives, and its runs derivatives
/// by differences of steps. The flow of its points has answers to these questions at each time.
#[doc(hidden)]
#[macro_export]
macro_rules! smooth_open_flow {
    ([$($generics:tt)*] $flow:ty, moving: $moving:ty) => {
        impl<$($generics)*> $crate::tangent::SmoothFlow for $flow {
            type Moving = $moving;

            fn directions(&self) -> usize {
                // The clock, the work of the time, and what ports and baths book.
                $crate::tangent::SmoothFlow::directions(&$crate::open::OpenFlow::at(self, 0.0))
                    + 1
                    + $crate::open::OpenFlow::empty(self).entry_sizes().len()
            }

            fn clock(&self) -> Option<usize> {
                Some($crate::tangent::SmoothFlow::directions(&$crate::open::OpenFlow::at(self, 0.0)))
            }

            fn power_of_time(&self, x: &$crate::Element<Self>) -> Option<(usize, f64)> {
                let work = $crate::tangent::SmoothFlow::clock(self)? + 1;
                let power = || $crate::open::OpenFlow::power(self, x.time, &x.x);
                $crate::open::OpenFlow::has_clock(self).then(|| (work, power()))
            }

            /// The differentials of the balance `H − W − Q` and of `S + Σ S_b`. The clock moves neither: the frozen work is booked.
            fn law_rows(
                &self,
                x: &$crate::Element<Self>,
            ) -> $crate::tangent::LawRows<nalgebra::DVector<f64>> {
                let points = $crate::open::OpenFlow::at(self, x.time);
                let n = $crate::tangent::SmoothFlow::directions(&points);
                let all = $crate::tangent::SmoothFlow::directions(self);
                let rows = $crate::tangent::SmoothFlow::law_rows(&points, &x.x);
                let mut rows = rows.map(|row| row.clone().resize_vertically(all, 0.0));
                let ledger = $crate::open::OpenFlow::empty(self);
                for booked in n + 1..all {
                    let entry = |i: usize| if i == booked { 1.0 } else { 0.0 };
                    let entries: Vec<f64> = (n + 1..all).map(entry).collect();
                    let none = $crate::Laws { energy: 0.0, entropy: 0.0, invariants: [(); 0] };
                    let laws = ledger.with_entries(&entries).balanced(none);
                    rows.set(booked, laws.energy, laws.entropy);
                }
                rows
            }

            fn turn(
                &self,
                from: &$crate::Element<Self>,
                to: &$crate::Element<Self>,
            ) -> Option<nalgebra::DMatrix<f64>> {
                let points = $crate::open::OpenFlow::at(self, to.time);
                let turn = $crate::tangent::SmoothFlow::turn(&points, &from.x, &to.x)?;
                let all = $crate::tangent::SmoothFlow::directions(self);
                let mut whole = nalgebra::DMatrix::identity(all, all);
                whole.view_mut((0, 0), turn.shape()).copy_from(&turn);
                Some(whole)
            }

            fn differential(
                &self,
                f: &dyn Fn(&$moving) -> metriplectic_fields::Real,
                x: &$crate::Element<Self>,
            ) -> (f64, nalgebra::DVector<f64>) {
                let points = $crate::open::OpenFlow::at(self, x.time);
                let (value, df) = $crate::tangent::SmoothFlow::differential(&points, f, &x.x);
                (value, df.resize_vertically($crate::tangent::SmoothFlow::directions(self), 0.0))
            }

            fn moving(&self, x: &$crate::Element<Self>, v: &nalgebra::DVector<f64>) -> $moving {
                let points = $crate::open::OpenFlow::at(self, x.time);
                let n = $crate::tangent::SmoothFlow::directions(&points);
                $crate::tangent::SmoothFlow::moving(&points, &x.x, &v.rows(0, n).into_owned())
            }

            fn coordinates(&self, y: &$crate::Element<Self>, there: &$moving) -> Vec<[f64; 2]> {
                let points = $crate::open::OpenFlow::at(self, y.time);
                $crate::tangent::SmoothFlow::coordinates(&points, &y.x, there)
            }
        }

        /// By differences of steps.
        impl<$($generics)*, M: $crate::Stepper<$flow>> $crate::tangent::Differentiated<M> for $flow {
            type MovingWide = $moving;

            fn moved_along(
                &self,
                x: &$crate::Element<Self>,
                v: &nalgebra::DVector<f64>,
            ) -> $moving {
                $crate::tangent::SmoothFlow::moving(self, x, v)
            }

            fn coordinates_around(
                &self,
                y: &$crate::Element<Self>,
                there: &$moving,
            ) -> Vec<[f64; 2]> {
                $crate::tangent::SmoothFlow::coordinates(self, y, there)
            }
        }
    };
}

crate::smooth_open_flow! { [S: Equations] OpenEquations<S>, moving: Vec<Real> }
