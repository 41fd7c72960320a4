//! The problems that orders and energies are measured on: every manifold, bracket and kind of metric,
//! none of them linear or separable.
//!
//! A problem is visited by a [`Study`], because each is of a type of its own. The functions that visit all
//! of them are marked `#[inline]`: their code is large, and is made where it is called, not here.

mod list;
mod measured;

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{ChartPoint, Column as _, Space as _, Vector};
use metriplectic_manifolds::{Manifold, Retraction};

pub use list::{each, each_with};
pub use measured::{Comparison, LargeSteps, Orders, SecondLaws, Strides};

/// A system with a start, and names for tables.
#[derive(Clone, Debug)]
pub struct Problem<Y: Metriplectic> {
    /// The name of the model.
    pub name: &'static str,
    /// Where it lives, as a formula.
    pub manifold: &'static str,
    /// The metric in words.
    pub metric: &'static str,
    /// The system.
    pub system: Y,
    /// Its start.
    pub start: Point<Y>,
    /// A start at rest: without momenta where it has any, otherwise without a velocity.
    pub rest: Point<Y>,
    /// The time over which errors are measured.
    pub time: f64,
    /// Where a step may be long, and its size: points, by their coordinates in the chart at the start,
    /// and for each retraction one at least from which a step spans two radians.
    pub strides: Vec<(Vector<Y::Manifold>, f64)>,
}

/// Constants that are added to the energy and the entropy of a problem.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Constants {
    /// The constant of the energy.
    pub energy: f64,
    /// The constant of the entropy.
    pub entropy: f64,
}

impl<Y: Metriplectic> Problem<Y> {
    /// The distance of a point from another one, by their entries.
    pub fn distance(x: &Point<Y>, y: &Point<Y>) -> f64 {
        let (x, y) = (Y::Manifold::entries(x), Y::Manifold::entries(y));
        x.iter().zip(y).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    }
}

/// The unit of energy of every problem: its entries and the terms of its `H` are of this size, and `H`, a sum
/// of terms of both signs, may be nearly zero. So an error is relative to `|H|`, or to this where it is larger.
const UNIT_OF_ENERGY: f64 = 1.0;

/// An error of the energy relative to the size of the energy.
fn relative(error: f64, energy: f64) -> f64 {
    error.abs() / energy.abs().max(UNIT_OF_ENERGY)
}

/// A study of every problem with each of the retractions that its manifold has.
pub trait Study {
    /// Called once for each problem and retraction; `order` is what theory says.
    fn visit<Y, R>(
        &mut self,
        problem: &Problem<Y>,
        scheme: &'static str,
        retraction: R,
        order: f64,
    ) where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric> + Copy;
}

/// The flow of the velocity `Π dH + K dS` over `time`, by another method: the classical Runge-Kutta method of order 4 in a
/// chart around each step's start (Munthe-Kaas 1998), with steps so small that what is left is
/// round-off; `None` if it leaves the domain.
pub fn flow<Y: Metriplectic>(system: &Y, start: &Point<Y>, time: f64) -> Option<Point<Y>> {
    const STEPS: u32 = 2000;
    let h = time / f64::from(STEPS);
    let velocity = |x: &Point<Y>, q: Vector<Y::Manifold>| {
        system.velocity(&ChartPoint { base: x.clone(), q }).ok()
    };
    (0..STEPS).try_fold(start.clone(), |x, _| {
        let a = velocity(&x, Vector::<Y::Manifold>::zero())?;
        let b = velocity(&x, a * (0.5 * h))?;
        let c = velocity(&x, b * (0.5 * h))?;
        let d = velocity(&x, c * h)?;
        let q = (a + (b + c) * 2.0 + d) * (h / 6.0);
        q.is_finite().then(|| Y::Manifold::chart(&x, &q))
    })
}
