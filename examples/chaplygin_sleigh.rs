//! The Chaplygin sleigh: a skew bracket that is not Poisson, beside its closed form.
//!
//! A sleigh glides on a blade that does not slip sideways. Its centre of mass is ahead of the blade by `a`. The
//! state is the place `(x, y)` of the blade, its direction `θ`, and the momenta along the blade and about it
//! (Chaplygin 1911; Bloch 2003, §1.7). With `H = ½p_v²/m + ½p_ω²/J`, `J = I + ma²`, and
//!
//! ```text
//! {x, p_v} = cos θ,   {y, p_v} = sin θ,   {θ, p_ω} = 1,   {p_v, p_ω} = m a p_ω/J
//! ```
//!
//! `m v' = m a ω²` and `J ω' = −m a v ω`. It breaks the Jacobi identity, as nonholonomic brackets do, and its
//! skewness alone conserves `H`. In closed form `v = V tanh kτ`, `ω = V√(m/J) sech kτ`, `k = m a V/J`,
//! `τ = t − t₀`: pushed backwards, the sleigh turns round.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Order, Panel, Panels};

const MASS: f64 = 1.0;
const AHEAD: f64 = 0.5;
const INERTIA: f64 = 0.75 + MASS * AHEAD * AHEAD;
type Place = SVector<Real, 5>;
type Sleigh = State<Euclidean<5>>;

fn main() -> Result<(), Box<dyn Error>> {
    let bracket = |x: &Place| {
        let ((sin, cos), turn) = (x[2].sin_cos(), x[4] * (MASS * AHEAD / INERTIA));
        let mut pi = SMatrix::<Real, 5, 5>::zeros();
        for (i, j, value) in [(0, 3, cos), (1, 3, sin), (2, 4, 1.0.into()), (3, 4, turn)] {
            (pi[(i, j)], pi[(j, i)]) = (value, -value);
        }
        pi
    };
    let sleigh = System::on(Euclidean::<5>)
        .bracket(AlmostPoisson::field(bracket))
        .energy(|x: &Place| (x[3] * x[3] / MASS + x[4] * x[4] / INERTIA) * 0.5)
        .build()?;
    let start = vector![0.0, 0.0, 0.0, MASS * exact(0.0).x, INERTIA * exact(0.0).y];

    let about = "The Chaplygin sleigh: a skew bracket that is not Poisson, and its closed form.";
    let example = Example::new(about, 200, 0.1);
    let sizes = [1.0, 0.5, 0.25, 0.125].map(|part| part * example.step_size);
    let run = |k: usize| example.run(&sleigh, start, Span::steps(sizes[k], example.steps << k));
    let runs = (0..4).map(run).collect::<Result<Vec<_>, _>>()?;

    let velocities = |s: &Sleigh| vector![s.point[3] / MASS, s.point[4] / INERTIA];
    let error = |s: &Sleigh| (velocities(s) - exact(s.time)).norm();
    let errors = [0, 1, 2, 3].map(|k: usize| runs[k].states.iter().map(error).fold(0.0, f64::max));
    let (run, order) = (&runs[0], Order::fit(&sizes, &errors)?);
    let beside = |quantity: &str, i: usize| {
        let closed = run.series(|s| exact(s.time)[i]);
        let scheme = run.series(|s| velocities(s)[i]);
        Panel::new(quantity, "t").line("closed form", closed).line("scheme", scheme)
    };
    let trace: Vec<_> = run.states.iter().map(|s| (s.point[0], s.point[1])).collect();
    let title = format!("The Chaplygin sleigh turns round, h = {}", example.step_size);
    let figure = Panels::new(title)
        .panel(Panel::new("y", "x").title("trace of the blade").line("", trace).equal())
        .panel(beside("velocity v along the blade", 0))
        .panel(beside("angular velocity ω", 1))
        .panel(run.energy_error());
    example
        .report(run)
        .text(format_args!("{}\nerrors:      {errors:.6?}", sleigh.report(&start)))
        .with("order", order.slope)
        .figure(figure)
        .print()
}

/// The velocity along the blade and the angular velocity at time `t`, with `V = 1` and `t₀ = 10`.
fn exact(t: f64) -> Vector2<f64> {
    let tau = MASS * AHEAD / INERTIA * (t - 10.0);
    Vector2::new(tau.tanh(), (MASS / INERTIA).sqrt() / tau.cosh())
}
