//! The systems whose runs by a method have derivatives.

use metriplectic_dynamics::{Differentiable, Metriplectic, ModelError, VectorField as _};
use metriplectic_fields::{
    ChartPoint, Column as _, Dimension as _, Matrix, Real, Space, Square as _, Vector,
};
use metriplectic_manifolds::Manifold;
use nalgebra::DVector;

use super::along::LinearisedAlong;
use super::beside::{self, NoParameters};
use super::columns::{Carried, Columns, LawRows, Moved};
use super::error::Unlinearised;
use super::linearised::{Linearised, Propagated};
use super::part::{Part, Wide};
use super::smooth::{FlowOf, SmoothFlow, matrix, numbers};
use crate::noise::{Fluctuating, Noisy};
use crate::step::{Compiled, Dim, Element, Flow, HasFlow, Stepper, Vector as _};

/// A system whose runs by the method `M` have derivatives along their start and along parameters.
///
/// The parameters are further directions behind those of a state, and nothing moves them. Vectors and covectors have a number for each
/// of all directions.
///
/// The derivatives of a step are exact for systems in types and, as far as its own derivatives are, for a
/// [model](metriplectic_equations::Model) on a vector space, along its start and along the parameters that it knows. For any other kind of system they are formed by differences of steps beside
/// it, as in the defaults here: with the same size, the same random numbers and the same branch of the method, to some ten digits.
///
/// Laws: those of [`Linearised`].
#[diagnostic::on_unimplemented(
    message = "the steps of `{M}` on `{Self}` have no tangent",
    note = "a `Scheme` has one on a system in types if its retraction and its discrete gradient are symmetric (`SelfAdjoint`): not \
            `Exponential`, and not `ItohAbe`",
    note = "`DormandPrince5`, `DormandPrince8`, `RungeKuttaChebyshev`, `ExplicitRungeKutta`, `Gauss` and `Radau` have one on every space of \
            this library (`MovingBase`)"
)]
pub trait Differentiated<M: Stepper<<Self as HasFlow>::Flow>>: HasFlow<Flow: SmoothFlow> {
    /// A state and parameters whose entries carry derivatives, of the closures of a jump.
    type MovingWide: 'static;

    /// Returns the names of the parameters.
    fn names(&self) -> &[&'static str] {
        &[]
    }

    /// Does work in a room with the temporary numbers of steps with derivatives.
    fn wide_room(&self, work: &mut dyn FnMut()) {
        self.as_flow().room(work);
    }

    /// Returns whether the derivatives of steps are formed by differences of steps beside them.
    fn takes_steps_beside(&self, method: &M) -> bool {
        let _ = method;
        true
    }

    /// Computes the differentials of the laws at a state, in all directions.
    fn wide_rows(&self, x: &Element<FlowOf<Self>>) -> LawRows<DVector<f64>> {
        self.as_flow().law_rows(x)
    }

    /// Compares what the system knows of its derivatives along parameters with its values, at the start of a run.
    ///
    /// # Errors
    ///
    /// [`ModelError`] with the derivative that is not that of the values.
    fn check_parameters(&self, x: &Element<FlowOf<Self>>) -> Result<(), ModelError> {
        let _ = x;
        Ok(())
    }

    /// Computes the size of each direction.
    fn units(&self, x: &Element<FlowOf<Self>>) -> DVector<f64> {
        DVector::from_vec(self.as_flow().sizes(x).to_list())
    }

    /// Returns whether a step from a state at rest has a derivative.
    fn is_smooth_at_rest(&self, method: &M) -> bool {
        matches!(method.compiled(), Some(Compiled::Midpoint { .. } | Compiled::Gauss { .. }))
    }

    /// Computes the derivatives at the end of a step from those at its start.
    ///
    /// # Errors
    ///
    /// [`Unlinearised`] if the step has no derivative.
    fn propagate(
        &self,
        method: &M,
        step: &Part<FlowOf<Self>>,
        carried: &Carried,
    ) -> Result<Moved, Unlinearised> {
        beside::propagate((self.as_flow(), method, &NoParameters), step, carried)
    }

    /// Computes the derivative of a loss along the start of a step and the parameters from that along its end.
    ///
    /// # Errors
    ///
    /// [`Unlinearised`] if the step has no derivative.
    fn pull_back(
        &self,
        method: &M,
        step: &Part<FlowOf<Self>>,
        costate: &DVector<f64>,
    ) -> Result<DVector<f64>, Unlinearised> {
        beside::pull_back((self.as_flow(), method, &NoParameters), step, costate)
    }

    /// Refuses a corner, at which the clock of a state is set, if its time depends on a parameter: a velocity beside the system has the law
    /// of the other side. The sizes are those of the entries in the run, and steps have the size `h` there.
    ///
    /// # Errors
    ///
    /// [`Unlinearised::MovingCorner`].
    fn check_corner(
        &self,
        sides: [&Element<FlowOf<Self>>; 2],
        sizes: Option<&<FlowOf<Self> as Flow>::Vector>,
        h: f64,
    ) -> Result<(), Unlinearised> {
        let _ = (sides, sizes, h);
        Ok(())
    }

    /// Computes the error of the second law of tangents in a step, for a column at its start and at its end; `None` if it is not known.
    fn second_law_error(
        &self,
        method: &M,
        step: &Part<FlowOf<Self>>,
        column: [&DVector<f64>; 2],
    ) -> Option<f64> {
        let _ = (method, step, column);
        None
    }

    /// Moves a state and the parameters along a vector: the first derivative of their entries.
    fn moved_along(&self, x: &Element<FlowOf<Self>>, v: &DVector<f64>) -> Self::MovingWide;

    /// Computes the coordinates of a moving state with parameters around `y`, with their first derivative.
    fn coordinates_around(
        &self,
        y: &Element<FlowOf<Self>>,
        there: &Self::MovingWide,
    ) -> Vec<[f64; 2]>;

    /// Computes the velocity in all directions at a state; `None` where it has no value.
    fn velocity_at(&self, x: &Element<FlowOf<Self>>) -> Option<DVector<f64>> {
        let flow = self.as_flow();
        let zero = flow.sizes(x).map(|_| 0.0);
        Some(DVector::from_vec(flow.rates(x, &zero)?.to_list()))
    }
}

/// The manifold of a system with its parameters.
type Whole<D> = <Wide<D> as Metriplectic>::Manifold;

/// The column with these numbers.
fn column<V: metriplectic_fields::Column<f64>>(numbers: &DVector<f64>) -> V {
    V::from_index(|i| numbers[i])
}

impl<D, M> Differentiated<M> for D
where
    D: Differentiable,
    M: LinearisedAlong<D> + Stepper<D>,
{
    type MovingWide = <Whole<D> as Space>::Point<Real>;

    fn names(&self) -> &[&'static str] {
        self.parameters()
    }

    fn wide_room(&self, work: &mut dyn FnMut()) {
        self.wide().room(work);
    }

    fn takes_steps_beside(&self, _: &M) -> bool {
        false
    }

    fn wide_rows(&self, x: &Element<D>) -> LawRows<DVector<f64>> {
        self.wide().law_rows(&self.widened(x))
    }

    fn units(&self, x: &Element<D>) -> DVector<f64> {
        numbers(&<Whole<D> as Manifold>::scales(&self.widened(x)))
    }

    fn is_smooth_at_rest(&self, _: &M) -> bool {
        <M as Linearised<Wide<D>>>::SMOOTH_AT_REST
    }

    fn propagate(
        &self,
        method: &M,
        step: &Part<D>,
        carried: &Carried,
    ) -> Result<Moved, Unlinearised> {
        let t = Matrix::<Whole<D>>::from_columns(|j| {
            Vector::<Whole<D>>::from_index(|i| carried.t[(i, j)])
        });
        let columns = Columns { t, laws: carried.laws.map(column) };
        let Propagated { columns, along_h } = method.propagate_along(self, step, &columns)?;
        let t = matrix::<Whole<D>>(&columns.t);
        let along_h = DVector::from_fn(Dim::<D>::LEN, |i, _| along_h[i]);
        Ok(Moved { carried: Carried { t, laws: columns.laws.map(numbers) }, along_h })
    }

    fn pull_back(
        &self,
        method: &M,
        step: &Part<D>,
        costate: &DVector<f64>,
    ) -> Result<DVector<f64>, Unlinearised> {
        method.pull_back_along(self, step, &column(costate)).map(|row| numbers(&row))
    }

    fn second_law_error(
        &self,
        method: &M,
        step: &Part<D>,
        [before, after]: [&DVector<f64>; 2],
    ) -> Option<f64> {
        let [before, after] = [column(before), column(after)];
        step.with(self, |piece| method.entropy_law(self.wide(), piece, [&before, &after]))
    }

    fn moved_along(&self, x: &Element<D>, v: &DVector<f64>) -> Self::MovingWide {
        self.wide().moving(&self.widened(x), v)
    }

    fn coordinates_around(&self, y: &Element<D>, there: &Self::MovingWide) -> Vec<[f64; 2]> {
        SmoothFlow::coordinates(self.wide(), &self.widened(y), there)
    }

    fn velocity_at(&self, x: &Element<D>) -> Option<DVector<f64>> {
        let v = self.wide().velocity(&ChartPoint::centre(&self.widened(x))).ok()?;
        Some(numbers::<Vector<Whole<D>>>(&v))
    }
}

/// By differences of steps with the same random numbers.
impl<F, U, M> Differentiated<M> for Noisy<F, U>
where
    F: Fluctuating<U> + SmoothFlow,
    M: Stepper<Self>,
{
    type MovingWide = F::Moving;

    fn moved_along(&self, x: &Element<F>, v: &DVector<f64>) -> F::Moving {
        self.moving(x, v)
    }

    fn coordinates_around(&self, y: &Element<F>, there: &F::Moving) -> Vec<[f64; 2]> {
        SmoothFlow::coordinates(self, y, there)
    }
}
