//! The same problem by each of the solvers, with the path of its accepted steps.

use std::cell::Cell;

use differential_equations::{
    methods::ExplicitRungeKutta,
    ode::{ODE, OrdinaryNumericalMethod, solve_ode},
    solout::DefaultSolout,
    status::Status,
};
use diffsol::{NalgebraMat, OdeBuilder, OdeSolverMethod, OdeSolverStopReason};
use ode_solvers_nalgebra::allocator::Allocator;
use ode_solvers_nalgebra::{DefaultAllocator, Dim, OVector, SVector};

use crate::Problem;

/// The states after all accepted steps, the start first, and the right-hand sides evaluated.
pub type Path<const N: usize> = Result<(Vec<[f64; N]>, u64), String>;

/// A solver with a tolerance.
pub type Solver<P, const N: usize> = fn(&P, time: f64, tolerance: f64) -> Path<N>;

/// A right-hand side that counts its evaluations.
struct Counted<'a, P> {
    problem: &'a P,
    count: &'a Cell<u64>,
}

impl<P> Counted<'_, P> {
    fn velocity<const N: usize>(&self, x: &[f64; N]) -> [f64; N]
    where
        P: Problem<N>,
    {
        self.count.set(self.count.get() + 1);
        self.problem.velocity(x)
    }
}

impl<P: Problem<N>, const N: usize> ode_solvers::System<f64, SVector<f64, N>> for Counted<'_, P> {
    fn system(&self, _: f64, x: &SVector<f64, N>, v: &mut SVector<f64, N>) {
        *v = self.velocity(&x.data.0[0]).into();
    }
}

impl<P: Problem<N>, const N: usize> ODE<f64, [f64; N]> for Counted<'_, P> {
    fn diff(&self, _: f64, x: &[f64; N], v: &mut [f64; N]) {
        *v = self.velocity(x);
    }
}

/// DOP853 of the crate `ode_solvers` from `start` at time 0; both tolerances alike, no dense output.
pub fn dop853<D: Dim, F>(
    system: F,
    start: OVector<f64, D>,
    time: f64,
    tolerance: f64,
) -> ode_solvers::Dop853<f64, OVector<f64, D>, F>
where
    F: ode_solvers::System<f64, OVector<f64, D>>,
    DefaultAllocator: Allocator<D>,
{
    // Safety factor, β, the bounds of the step's change, and the stiffness test are the defaults.
    ode_solvers::Dop853::from_param(
        system,
        0.0,
        time,
        0.0,
        start,
        tolerance,
        tolerance,
        0.9,
        0.0,
        0.333,
        6.0,
        time,
        0.0,
        u32::MAX,
        1000,
        ode_solvers::dop_shared::OutputType::Sparse,
    )
}

/// The same for a problem, with its path.
pub fn ode_solvers<P: Problem<N>, const N: usize>(
    problem: &P,
    time: f64,
    tolerance: f64,
) -> Path<N> {
    let count = Cell::new(0);
    let system = Counted { problem, count: &count };
    let mut solver = dop853(system, SVector::from(problem.start()), time, tolerance);
    solver.integrate().map_err(|error| error.to_string())?;
    Ok((solver.y_out().iter().map(|x| x.data.0[0]).collect(), count.get()))
}

/// DOP853 of the crate `differential-equations`, whose steps always prepare dense output.
pub fn differential_equations<P: Problem<N>, const N: usize>(
    problem: &P,
    time: f64,
    tolerance: f64,
) -> Path<N> {
    let count = Cell::new(0);
    let mut solver = ExplicitRungeKutta::dop853().rtol(tolerance).atol(tolerance);
    solver = solver.max_steps(usize::MAX);
    let system = Counted { problem, count: &count };
    let start = problem.start();
    let run = solve_ode(&mut solver, &system, 0.0, time, &start, &mut DefaultSolout::new());
    let run = run.map_err(|error| format!("{error:?}"))?;
    Ok((run.y, count.get()))
}

/// The same, with every accepted step projected onto the energy of the start, and onto the sphere
/// where there is one (Hairer, Lubich, Wanner 2006, §IV.4). The step size goes on from step to step;
/// the right-hand side at the projected point is one evaluation more.
pub fn projected<P: Problem<N>, const N: usize>(problem: &P, time: f64, tolerance: f64) -> Path<N> {
    let count = Cell::new(0);
    let mut solver = ExplicitRungeKutta::dop853().rtol(tolerance).atol(tolerance);
    solver = solver.max_steps(usize::MAX);
    let system = Counted { problem, count: &count };
    let start = problem.start();
    let energy = problem.energy(&start);
    let failed = |error: differential_equations::error::Error<f64, [f64; N]>| format!("{error:?}");
    solver.init(&system, 0.0, time, &start).map_err(failed)?;
    solver.set_status(Status::Solving);
    let mut path = vec![start];
    while time - solver.t() > 1e-12 * time {
        let whole = solver.h();
        let last = time - solver.t();
        if whole > last {
            solver.set_h(last);
        }
        solver.step(&system).map_err(failed)?;
        if matches!(solver.status(), Status::RejectedStep) {
            continue;
        }
        let x = project(problem, energy, *solver.y());
        let (now, h) = (solver.t(), solver.h());
        path.push(x);
        if time - now > 1e-12 * time {
            solver.h0 = h.min(time - now);
            solver.init(&system, now, time, &x).map_err(failed)?;
            solver.set_status(Status::Solving);
        }
    }
    Ok((path, count.get()))
}

/// Newton's method along `dH`, and along the radius on the sphere: to round-off, in one or two
/// corrections.
fn project<P: Problem<N>, const N: usize>(problem: &P, energy: f64, mut x: [f64; N]) -> [f64; N] {
    for _ in 0..4 {
        let off = problem.energy(&x) - energy;
        let slope = problem.gradient(&x);
        let dot = |a: &[f64; N], b: &[f64; N]| (0..N).map(|i| a[i] * b[i]).sum::<f64>();
        let radius = if problem.on_sphere() { 0.5 * (dot(&x, &x) - 1.0) } else { 0.0 };
        let small = 2.0 * f64::EPSILON;
        if off.abs() <= small * energy.abs() && radius.abs() <= small {
            break;
        }
        // Least changes with ⟨dH, δ⟩ = −off and ⟨x, δ⟩ = −radius.
        let (a, b) = (dot(&slope, &slope), dot(&slope, &x));
        let (s, t) = if problem.on_sphere() {
            let c = dot(&x, &x);
            let determinant = a * c - b * b;
            ((off * c - radius * b) / determinant, (radius * a - off * b) / determinant)
        } else {
            (off / a, 0.0)
        };
        x = std::array::from_fn(|i| x[i] - s * slope[i] - t * x[i]);
    }
    x
}

/// The method of Tsitouras, order 5(4), of the crate `diffsol`, on vectors of nalgebra.
pub fn diffsol<P: Problem<N>, const N: usize>(problem: &P, time: f64, tolerance: f64) -> Path<N> {
    let count = Cell::new(0);
    let system = Counted { problem, count: &count };
    let start = problem.start();
    let built = OdeBuilder::<NalgebraMat<f64>>::new()
        .rtol(tolerance)
        .atol([tolerance])
        .rhs(|x: &[f64], _: &[f64], _: f64, v: &mut [f64]| {
            let x: &[f64; N] = x.try_into().expect("as many entries as the start");
            v.copy_from_slice(&system.velocity(x));
        })
        .init(move |_: &[f64], _: f64, x: &mut [f64]| x.copy_from_slice(&start), N)
        .build()
        .map_err(|error| error.to_string())?;
    let mut solver = built.tsit45().map_err(|error| error.to_string())?;
    solver.set_stop_time(time).map_err(|error| error.to_string())?;
    let mut path = vec![start];
    loop {
        let reason = solver.step().map_err(|error| error.to_string())?;
        let y = solver.state().y;
        path.push(std::array::from_fn(|i| y[i]));
        if matches!(reason, OdeSolverStopReason::TstopReached) {
            return Ok((path, count.get()));
        }
    }
}
