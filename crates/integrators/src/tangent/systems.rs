//! Systems of any kind that depend on parameters, and their derivatives along them.

use std::fmt;
use std::ops::Deref;

use metriplectic_dynamics::ModelError;
use metriplectic_fields::Real;
use nalgebra::{DMatrix, DVector, SVector};

use super::beside::{self, Parameters};
use super::columns::{Carried, LawRows, Moved};
use super::differentiated::Differentiated;
use super::error::Unlinearised;
use super::exact::ExactSteps;
use super::explicit::NEAR;
use super::part::Part;
use super::smooth::SmoothFlow;
use crate::round_off::bound::SUMMED;
use crate::step::{Element, Flow, HasFlow, Stepper, Vector as _};

/// Systems of any kind with named parameters: with ports, baths and noise, lattices, systems of your own.
///
/// A [member](Self::at) has [tangents](crate::Tangents) and [adjoints](crate::Adjoints) along its start and its parameters. They are exact for a
/// [model](metriplectic_equations::Model) in plain numbers on a vector space, along its start and, if it
/// [knows as many](metriplectic_equations::Model::parameters), along the parameters, whose derivatives are compared with values at the start
/// of the run. Others are differences of steps beside each step, to some ten digits. Those of a
/// [`Family`](metriplectic_dynamics::Family) are exact.
///
/// ```
/// use metriplectic_dynamics::{Symplectic, System};
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{DormandPrince8, Method as _, OpenBuilder as _, Span, Systems, Tangents as _};
/// use metriplectic_manifolds::Euclidean;
/// use nalgebra::{Vector1, Vector2, vector};
/// use num_dual::DualNum as _;
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // A mass on a spring that is pushed: how does the work depend on the stiffness?
/// let pushed = Systems::new(["stiffness"], |t: &Vector1<f64>| {
///     let stiffness = t.x;
///     System::on(Euclidean::<2>)
///         .bracket(Symplectic)
///         .energy(move |x: &Vector2<Real>| (x.x * x.x * stiffness + x.y * x.y) * 0.5)
///         .work("push", |t: Real, _: &Vector2<Real>| vector![Real::from(0.0), t.sin()])
///         .build()
/// });
/// let system = pushed.at(vector![2.0])?;
/// let start = system.start(vector![1.0, 0.0]);
/// let run = DormandPrince8.tangent(&system, start, Span::until(5.0).tolerance(1e-9))?;
/// println!("∂x/∂k = {}", run.last().along("stiffness").unwrap());
/// let work = run.last().work_along("push").unwrap();
/// println!("∂W/∂k = {}", work[work.len() - 1]);
/// let plain = DormandPrince8.run(&system, system.start(vector![1.0, 0.0]), Span::steps(0.1, 50))?;
/// # assert!(work[work.len() - 1].abs() > 0.01 && plain.certificate().keeps_energy());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Systems<B, const P: usize> {
    names: [&'static str; P],
    build: B,
}

impl<B, const P: usize> Systems<B, P> {
    /// Systems with these parameters: `build` makes the system at values of them.
    pub const fn new(names: [&'static str; P], build: B) -> Self {
        Self { names, build }
    }

    /// The names of the parameters.
    pub const fn names(&self) -> &[&'static str; P] {
        &self.names
    }

    /// Builds the system at values of the parameters.
    ///
    /// # Errors
    ///
    /// The error of the closure.
    pub fn build<S, E>(&self, theta: &SVector<f64, P>) -> Result<S, E>
    where
        B: Fn(&SVector<f64, P>) -> Result<S, E>,
    {
        (self.build)(theta)
    }

    /// Builds the system at values of the parameters, whose runs have derivatives along them.
    ///
    /// A tangent by differences builds systems at parameters some 10⁻⁵ of their sizes away. What a closure of the schedule captures, as that of a
    /// jump, stays as it is: write there what depends on parameters by [`differentiable`](crate::Jumping::differentiable), whose
    /// maps take the state and the parameters.
    ///
    /// # Errors
    ///
    /// The error of the closure.
    pub fn at<S, E>(&self, theta: SVector<f64, P>) -> Result<SystemAt<'_, S>, E>
    where
        B: Fn(&SVector<f64, P>) -> Result<S, E>,
    {
        let system = (self.build)(&theta)?;
        Ok(SystemAt::new(&self.names, theta, system, |theta| (self.build)(theta).map_err(drop)))
    }
}

/// The system beside one, by what its parameters are displaced.
type SystemBeside<'a, S> = Box<dyn Fn(&[f64]) -> Result<S, ()> + 'a>;

/// A system of any kind at values of parameters; made by [`Systems::at`]. Runs and tangents take it as they take the system.
pub struct SystemAt<'a, S> {
    system: S,
    names: &'a [&'static str],
    values: Vec<f64>,
    beside: SystemBeside<'a, S>,
}

impl<'a, S> SystemAt<'a, S> {
    /// The system at these parameters, with the closure that builds those beside it.
    pub(super) fn new<const P: usize>(
        names: &'a [&'static str; P],
        theta: SVector<f64, P>,
        system: S,
        build: impl Fn(&SVector<f64, P>) -> Result<S, ()> + 'a,
    ) -> Self {
        let beside = move |by: &[f64]| build(&(theta + SVector::from_column_slice(by)));
        Self { system, names, values: theta.as_slice().to_vec(), beside: Box::new(beside) }
    }

    /// Builds the system at values of parameters whose number is known when the program runs, as [`Systems::at`] does.
    ///
    /// # Errors
    ///
    /// The error of the closure.
    ///
    /// # Panics
    ///
    /// If there is not one name for each value.
    pub fn listed<E>(
        names: &'a [&'static str],
        values: &[f64],
        build: impl Fn(&[f64]) -> Result<S, E> + 'a,
    ) -> Result<Self, E> {
        assert_eq!(names.len(), values.len(), "a name is expected for each parameter");
        let (system, values) = (build(values)?, values.to_vec());
        let theta = values.clone();
        let beside = move |by: &[f64]| {
            let theta: Vec<f64> = theta.iter().zip(by).map(|(value, by)| value + by).collect();
            build(&theta).map_err(drop)
        };
        Ok(Self { system, names, values, beside: Box::new(beside) })
    }

    /// Returns the system without its parameters.
    pub fn into_system(self) -> S {
        self.system
    }
}

impl<S> Deref for SystemAt<'_, S> {
    type Target = S;

    fn deref(&self) -> &S {
        &self.system
    }
}

impl<S> fmt::Debug for SystemAt<'_, S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SystemAt")
            .field("names", &self.names)
            .field("values", &self.values)
            .finish_non_exhaustive()
    }
}

impl<S: SmoothFlow> Parameters<S> for SystemAt<'_, S> {
    fn values(&self) -> &[f64] {
        &self.values
    }

    fn displaced(&self, by: &[f64]) -> Result<S, Unlinearised> {
        (self.beside)(by).map_err(|()| Unlinearised::NoSystem)
    }

    fn known_rows(&self, x: &Element<S>) -> Option<LawRows<DVector<f64>>> {
        self.known().map(|exact| exact.rows(x, self.values.len()))
    }
}

impl<S> SystemAt<'_, S> {
    /// Refuses parameters without a size.
    fn sized(&self) -> Result<(), Unlinearised> {
        let zero = self.values.iter().position(|value| value.abs() == 0.0 || value.is_nan());
        zero.map_or(Ok(()), |k| Err(Unlinearised::ZeroParameter { name: self.names[k] }))
    }
}

impl<S: SmoothFlow> SystemAt<'_, S> {
    /// The exact derivatives of steps, if they are known along all parameters.
    fn known(&self) -> Option<&dyn ExactSteps<S>> {
        let exact = self.system.exact_steps();
        exact.filter(|exact| exact.known_parameters() == self.values.len())
    }

    /// The exact derivatives of the steps of a method along their start, and whether they are known along all parameters.
    fn exact<M: Stepper<S>>(&self, method: &M) -> Option<(&dyn ExactSteps<S>, bool)> {
        let exact = self.system.exact_steps().filter(|exact| exact.has_steps(method.compiled()))?;
        Some((exact, self.known().is_some()))
    }

    /// The derivatives of a step along the parameters alone, a column for each, by differences of steps; and those of the laws at its
    /// start in all directions.
    fn along_parameters<M: Stepper<S>>(
        &self,
        method: &M,
        step: &Part<S>,
    ) -> Result<(DMatrix<f64>, LawRows<DVector<f64>>), Unlinearised> {
        self.sized()?;
        let (n, count) = (self.system.directions(), self.values.len());
        let here = beside::law_rows(&self.system, self, &step.x)?;
        let mut t = DMatrix::zeros(n + count, count);
        t.view_mut((n, 0), (count, count)).fill_with_identity();
        let laws = here.map(|row| row.rows(n, count).into_owned());
        let carried = Carried { t, laws };
        let moved = beside::propagate((&self.system, method, self), step, &carried)?;
        Ok((moved.carried.t.rows(0, n).into_owned(), here))
    }

    /// The derivatives at the end of a step: exact ones along its start, and differences of steps along the parameters.
    fn carry<M: Stepper<S>>(
        &self,
        exact: &dyn ExactSteps<S>,
        method: &M,
        step: &Part<S>,
        carried: &Carried,
    ) -> Result<Moved, Unlinearised> {
        let (n, count) = (self.system.directions(), self.values.len());
        let (along, here) = self.along_parameters(method, step)?;
        let [start, parameters] =
            [(0, n), (n, count)].map(|(at, len)| carried.t.rows(at, len).into_owned());
        // A column is the sum of one along the start and of one along the parameters, and so is the derivative of each law.
        let own =
            |row: &DVector<f64>, here: &DVector<f64>| row - parameters.tr_mul(&here.rows(n, count));
        let LawRows { energy, invariants, .. } = &carried.laws;
        let invariants = invariants.iter().zip(&here.invariants).map(|(row, here)| own(row, here));
        let entropy = start.tr_mul(&here.entropy.rows(0, n));
        let laws = LawRows::new(own(energy, &here.energy), entropy, invariants.collect());
        let alone = Carried { t: start, laws };
        let Moved { carried: moved, along_h } = exact.carry(method.compiled(), step, &alone)?;
        let mut next = carried.clone();
        next.t.rows_mut(0, n).copy_from(&(moved.t + along * parameters));
        Ok(Moved { carried: next, along_h })
    }
}

impl<S: Flow> HasFlow for SystemAt<'_, S> {
    type Flow = S;

    fn as_flow(&self) -> &S {
        &self.system
    }
}

/// Exact as far as the system knows the derivatives of its steps, and by differences of steps beyond.
impl<S: SmoothFlow, M: Stepper<S>> Differentiated<M> for SystemAt<'_, S> {
    type MovingWide = (S::Moving, Vec<Real>);

    fn names(&self) -> &[&'static str] {
        self.names
    }

    fn takes_steps_beside(&self, method: &M) -> bool {
        !self.exact(method).is_some_and(|(_, all)| all)
    }

    fn check_parameters(&self, x: &Element<S>) -> Result<(), ModelError> {
        let displaced = |by: &[f64]| self.displaced(by).ok();
        self.known().map_or(Ok(()), |exact| exact.check_parameters(x, &self.values, &displaced))
    }

    fn wide_rows(&self, x: &Element<S>) -> LawRows<DVector<f64>> {
        let unknown = |row: &DVector<f64>| {
            row.clone().resize_vertically(row.len() + self.values.len(), f64::NAN)
        };
        let known = beside::law_rows(&self.system, self, x);
        known.unwrap_or_else(|_| self.system.law_rows(x).map(unknown))
    }

    fn units(&self, x: &Element<S>) -> DVector<f64> {
        let sizes = self.system.sizes(x).to_list();
        let values = self.values.iter().map(|value| value.abs());
        DVector::from_vec(sizes.into_iter().chain(values).collect())
    }

    fn propagate(
        &self,
        method: &M,
        step: &Part<S>,
        carried: &Carried,
    ) -> Result<Moved, Unlinearised> {
        match self.exact(method) {
            Some((exact, true)) => return exact.carry(method.compiled(), step, carried),
            Some((exact, false)) => return self.carry(exact, method, step, carried),
            None => self.sized()?,
        }
        beside::propagate((&self.system, method, self), step, carried)
    }

    fn pull_back(
        &self,
        method: &M,
        step: &Part<S>,
        costate: &DVector<f64>,
    ) -> Result<DVector<f64>, Unlinearised> {
        match self.exact(method) {
            Some((exact, true)) => return exact.pull(method.compiled(), step, costate),
            Some((exact, false)) => {
                let (n, count) = (self.system.directions(), self.values.len());
                let (along, _) = self.along_parameters(method, step)?;
                let row = costate.rows(0, n).into_owned();
                let start = exact.pull(method.compiled(), step, &row)?;
                let along = along.tr_mul(&row) + costate.rows(n, count);
                return Ok(DVector::from_iterator(n + count, start.iter().chain(&along).copied()));
            }
            None => self.sized()?,
        }
        beside::pull_back((&self.system, method, self), step, costate)
    }

    fn check_corner(
        &self,
        sides: [&Element<S>; 2],
        sizes: Option<&S::Vector>,
        h: f64,
    ) -> Result<(), Unlinearised> {
        let zero = self.system.sizes(sides[0]).zero();
        let numbers = |flow: &S, x: &Element<S>| {
            let mut numbers = vec![flow.laws(x).energy];
            numbers.extend(flow.rates(x, &zero).map_or_else(Vec::new, |rates| rates.to_list()));
            numbers
        };
        let [before, behind] = sides.map(|x| numbers(&self.system, x));
        let jumps: Vec<f64> = before.iter().zip(&behind).map(|(a, b)| (b - a).abs()).collect();
        // A jump within the round-off of the energy, or one that moves an entry by none of its size, has no derivative to lose.
        let is_sized = |i: usize| match i.checked_sub(1) {
            None => jumps[i] > SUMMED * self.system.term_sizes(sides[0]).energy,
            Some(k) => {
                let size = sizes.filter(|sizes| k < sizes.len()).map(|sizes| sizes.get(k));
                let moves = size.is_none_or(|size| jumps[i] * h.abs() > NEAR * size);
                moves && jumps[i] > NEAR * before[i].abs().max(behind[i].abs())
            }
        };
        for (k, name) in self.names.iter().enumerate() {
            let at = |x: &Element<S>, e: f64| {
                let mut by = vec![0.0; self.values.len()];
                by[k] = e;
                Ok::<_, Unlinearised>(numbers(&self.displaced(&by)?, x))
            };
            let e = beside::displacement(self.values[k]);
            for x in sides {
                let [a, b, c, d] = [at(x, e)?, at(x, -e)?, at(x, 2.0 * e)?, at(x, -2.0 * e)?];
                // The difference of a smooth function doubles, and that of one that jumps stays.
                let is_off = |i: usize| {
                    2.0 * ((c[i] - d[i]) - 2.0 * (a[i] - b[i])).abs() > jumps[i] && is_sized(i)
                };
                if (0..jumps.len()).any(is_off) {
                    return Err(Unlinearised::MovingCorner { name });
                }
            }
        }
        Ok(())
    }

    fn second_law_error(
        &self,
        method: &M,
        step: &Part<S>,
        column: [&DVector<f64>; 2],
    ) -> Option<f64> {
        let (exact, _) = self.exact(method).filter(|(_, all)| *all)?;
        exact.entropy_error(method.compiled(), step, column)
    }

    fn moved_along(&self, x: &Element<S>, v: &DVector<f64>) -> Self::MovingWide {
        let n = self.system.directions();
        let parameter = |(k, value): (usize, &f64)| Real::new(*value, v[n + k], 0.0, 0.0);
        let parameters = self.values.iter().enumerate().map(parameter).collect();
        (self.system.moving(x, &v.rows(0, n).into_owned()), parameters)
    }

    fn coordinates_around(&self, y: &Element<S>, (there, _): &Self::MovingWide) -> Vec<[f64; 2]> {
        self.system.coordinates(y, there)
    }

    fn velocity_at(&self, x: &Element<S>) -> Option<DVector<f64>> {
        let zero = self.system.sizes(x).zero();
        let rates = DVector::from_vec(self.system.rates(x, &zero)?.to_list());
        Some(rates.resize_vertically(self.system.directions() + self.values.len(), 0.0))
    }
}
