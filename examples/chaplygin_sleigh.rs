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
use metriplectic_studies::{Gallery, Options, Order, Panel, Panels, Report, print};

const MASS: f64 = 1.0;
const AHEAD: f64 = 0.5;
const INERTIA: f64 = 0.75 + MASS * AHEAD * AHEAD;
type Place = SVector<Real, 5>;
type Sleigh = State<Euclidean<5>>;

/// The velocity along the blade and the angular velocity at time `t`, with `V = 1` and `t₀ = 10`.
fn exact(t: f64) -> Vector2<f64> {
    let tau = MASS * AHEAD / INERTIA * (t - 10.0);
    Vector2::new(tau.tanh(), (MASS / INERTIA).sqrt() / tau.cosh())
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(200), options.step_size_or(0.1));
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
    let sizes = [1.0, 0.5, 0.25, 0.125].map(|part| part * h);
    let runs = (0..4).map(|k| WeylMidpoint.run(&sleigh, start, Span::steps(sizes[k], count << k)));
    let runs = runs.collect::<Result<Vec<_>, _>>()?;
    let velocities = |s: &Sleigh| vector![s.point[3] / MASS, s.point[4] / INERTIA];
    let error = |s: &Sleigh| (velocities(s) - exact(s.time)).norm();
    let errors = [0, 1, 2, 3].map(|k: usize| runs[k].iter().map(error).fold(0.0, f64::max));
    let (run, order) = (&runs[0], Order::fit(&sizes, &errors)?);

    let (path, certificate) = (Gallery::open()?.path("chaplygin_sleigh.svg"), run.certificate());
    let points = |value: &dyn Fn(&Sleigh) -> (f64, f64)| run.iter().map(value).collect::<Vec<_>>();
    let beside = |title: &str, i: usize| {
        let closed = points(&|s| (s.time, exact(s.time)[i]));
        let scheme = points(&|s| (s.time, velocities(s)[i]));
        Panel::new(title, "t").line("closed form", closed).line("scheme", scheme)
    };
    let trace = points(&|s| (s.point[0], s.point[1]));
    let energy = points(&|s| (s.time, s.energy - certificate.initial_energy));
    Panels::new(format!("The Chaplygin sleigh turns round, h = {h}"))
        .panel(Panel::new("trace of the blade", "x").vertical("y").line("", trace).equal())
        .panel(beside("velocity v along the blade", 0))
        .panel(beside("angular velocity ω", 1))
        .panel(Panel::new("energy H − H₀", "t").line("", energy).level(0.0))
        .save(&path)?;

    if options.json {
        Report::new(certificate, run.last())?.with("order", order.slope).print()?;
    } else {
        print(format_args!("{}\n{certificate}", sleigh.report(&start)))?;
        print(format_args!("errors:      {errors:.6?}\norder:       {order}"))?;
        print(format_args!("figure:      {}", path.display()))?;
    }
    Ok(())
}
