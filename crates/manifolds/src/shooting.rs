//! The logarithm of a metric with numerical geodesics, by shooting.

use std::cell::Cell;

use metriplectic_fields::newton::{self, Cause, Limits, Problem, Progress};
use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, MatrixField, Space, Square, Vector,
};

use crate::metric_error::{MetricError, finite};
use crate::{Manifold, Riemannian, StepPathJet};

/// Geodesics that a logarithm may follow.
const SHOTS: u32 = 500;
/// The limits of Newton's method for one end. At first no correction is halved, because there are better
/// aims to try.
const EAGER: Limits = Limits { iterations: 16, halvings: 0 };
const PATIENT: Limits = Limits { iterations: 16, halvings: 6 };
/// Stages of the continuation of a logarithm, until it is given up.
const STAGES: [u32; 3] = [4, 16, 64];

/// The logarithm by shooting: Newton's method for `exp_x(v) = y`, aimed along the straight line of the
/// chart. If it does not get there, the line is relaxed to a short path, which aims again; and then the
/// end is moved from `x` to `y` in stages, each shot aimed by the one before.
pub(crate) fn log<M: Manifold, G: Riemannian<M>>(
    metric: &G,
    #[cfg_attr(
        not(all(feature = "argmin", not(all(target_arch = "wasm32", target_os = "unknown")))),
        allow(unused_variables, reason = "it relaxes paths")
    )]
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    y: &M::Point<f64>,
) -> Result<Vector<M>, MetricError> {
    let shots = Cell::new(0);
    let hit = |y: &M::Point<f64>, aim: &Vector<M>, limits| {
        let target = Target { metric, x, y, size: M::coordinates(x, y).magnitude(), shots: &shots };
        newton::solve(&target, target.shoot(aim)?, limits)
    };
    let straight = line::<M>(x, y)?;
    let aim = straight * stretch(metric, x, &straight);
    let mut last = hit(y, &aim, EAGER);
    #[cfg(all(feature = "argmin", not(all(target_arch = "wasm32", target_os = "unknown"))))]
    if last.is_err()
        && let Some(aim) = crate::path::aim(field, x, &straight)
    {
        last = hit(y, &aim, PATIENT).or(last);
    }
    for stages in STAGES {
        if last.is_ok() || shots.get() >= SHOTS {
            break;
        }
        let mut v = straight * f64::from(stages).recip();
        last = (1..=stages).try_fold(v, |_, stage| {
            let target = M::chart(x, &(straight * (f64::from(stage) / f64::from(stages))));
            let grown = f64::from(stage) / f64::from((stage - 1).max(1));
            v = hit(&target, &(v * grown), PATIENT)?;
            Ok(v)
        });
    }
    last
}

/// The straight line of the chart from `x` to `y`, if there is one and no other.
///
/// # Errors
///
/// [`MetricError::NotFinite`] if a point is not, and [`MetricError::OutOfChart`] at the edge of the
/// chart, of which [`is_near`](Space::is_near) accepts the half: beyond it a line of other coordinates
/// leads to the same point, as at half a turn on SO(3), and aims at another geodesic.
fn line<M: Manifold>(x: &M::Point<f64>, y: &M::Point<f64>) -> Result<Vector<M>, MetricError> {
    for entry in M::entries(x).into_iter().chain(M::entries(y)) {
        finite("an entry of a point", entry)?;
    }
    let straight = M::coordinates(x, y);
    // Half of it, and the rounding of half a turn.
    if straight.is_finite() && M::is_near(&(straight * (0.5 + f64::EPSILON))) {
        Ok(straight)
    } else {
        Err(MetricError::OutOfChart { distance: straight.magnitude() })
    }
}

/// The length of the straight line of the chart, over that of its velocity at the start: where the
/// metric changes much along the line, an aim with the length of the line is the better one.
fn stretch<M: Space, G: Riemannian<M>>(metric: &G, x: &M::Point<f64>, line: &Vector<M>) -> f64 {
    const PIECES: u32 = 16;
    let speed = |t: f64| {
        let at = ChartPoint::<M> { base: x.clone(), q: *line * t };
        let g: Matrix<M> = metric.matrix(&at);
        line.dot(&(g * *line)).sqrt()
    };
    let middles = (0..PIECES).map(|k| speed((f64::from(k) + 0.5) / f64::from(PIECES)));
    let stretch = middles.sum::<f64>() / (f64::from(PIECES) * speed(0.0));
    if stretch.is_finite() && stretch > 0.0 { stretch } else { 1.0 }
}

/// The equation `exp_x(v) = y`, to be solved for `v` to the rounding of the coordinates of the chart.
struct Target<'a, M: Manifold, G> {
    metric: &'a G,
    x: &'a M::Point<f64>,
    y: &'a M::Point<f64>,
    /// The distance of the two points in the chart.
    size: f64,
    /// Geodesics followed so far.
    shots: &'a Cell<u32>,
}

/// A geodesic from `x`: where it ends relative to `y`, and the derivative of the end.
struct Shot<M: Space> {
    v: Vector<M>,
    error: Vector<M>,
    slope: Matrix<M>,
}

impl<M: Manifold, G: Riemannian<M>> Target<'_, M, G> {
    fn shoot(&self, v: &Vector<M>) -> Result<Shot<M>, MetricError> {
        self.shots.set(self.shots.get() + 1);
        if self.shots.get() > SHOTS {
            return Err(self.missed_by(self.size));
        }
        let StepPathJet { end, dend, .. } = self.metric.weyl_jet(self.x, v)?;
        Ok(Shot { v: *v, error: M::coordinates(&end, self.y), slope: dend })
    }

    /// The size of the coordinates, which round-off is relative to.
    fn rounded(&self) -> f64 {
        let scales = M::scales(self.x);
        self.size + (0..M::Dim::LEN).map(|i| scales[i]).fold(0.0, f64::max)
    }

    const fn missed_by(&self, missed_by: f64) -> MetricError {
        MetricError::NoLogarithm { distance: self.size, missed_by }
    }
}

impl<M: Manifold, G: Riemannian<M>> Problem for Target<'_, M, G> {
    type Iterate = Shot<M>;
    type Correction = Vector<M>;
    type Root = Vector<M>;
    type Error = MetricError;

    fn correct(
        &self,
        Shot { v, error, slope }: &Shot<M>,
    ) -> Result<Progress<Vector<M>, Vector<M>>, MetricError> {
        if error.magnitude() <= 4.0 * f64::EPSILON * self.rounded() {
            return Ok(Progress::Root(*v));
        }
        let correction = slope.solve(error).ok_or_else(|| self.missed_by(error.magnitude()))?;
        // A correction longer than the vector itself is not to be believed.
        let length = (v.magnitude() / correction.magnitude()).min(1.0);
        Ok(Progress::Correction(correction, length))
    }

    fn advance(&self, here: &Shot<M>, correction: &Vector<M>, length: f64) -> Option<Shot<M>> {
        let next = self.shoot(&(here.v + *correction * length)).ok()?;
        (next.error.magnitude() < here.error.magnitude()).then_some(next)
    }

    fn stop(
        &self,
        Shot { v, error, .. }: Shot<M>,
        cause: Cause,
        _: usize,
    ) -> Result<Vector<M>, MetricError> {
        // The geodesic itself is good to 1e-13: stagnation there is the end.
        let solved = cause == Cause::Stagnation && error.magnitude() <= 1e-12 * self.rounded();
        if solved { Ok(v) } else { Err(self.missed_by(error.magnitude())) }
    }
}
