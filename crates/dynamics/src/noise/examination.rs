//! Conditions of the law of noise on a model, at a start and around it.
//!
//! A condition may hold at the start by a symmetry, or because an entry is zero. So it is judged at points around it too, in
//! units that do not vanish.

use metriplectic_equations::judge::{
    Derivatives, Mismatch, OF_SOLUTIONS, RADIUS, Row, coordinate_scales, draw,
};
use metriplectic_fields::{ChartPoint, Column, Dimension as _, Real, ScalarField, Space, Vector};
use metriplectic_manifolds::in_numbers::point;
use metriplectic_manifolds::{Manifold, MetricError};
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

use super::drift::{Place, TermVisitor};
use super::system::Jets;
use super::terms::NoiseTerm;
use crate::in_numbers::InNumbers;
use crate::metriplectic::{Dim, Metriplectic, Point};
use crate::velocity::differentials;

/// The points around a start at which noise is judged.
const POINTS: usize = 8;

/// A seed, so that a model is refused in the same way each time.
const SEED: u64 = 0x4e6f_6973_654c_6177;

/// A start and points around it at which a model has values, with the sizes of the coordinates.
#[derive(Clone, Debug)]
pub struct Around<M: Space> {
    /// The points; the first is the start.
    pub points: Vec<M::Point<f64>>,
    /// The sizes of the coordinates, all of them positive.
    pub units: Vector<M>,
}

impl<M: Manifold> Around<M> {
    /// Draws points around a start.
    pub fn of<Y: Metriplectic<Manifold = M> + ?Sized>(system: &Y, x0: &Point<Y>) -> Self {
        let (system, entries) = (InNumbers(system), M::entries(x0));
        let sizes = coordinate_scales(&system, 0.0, &entries);
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let mut points = vec![x0.clone()];
        let drawn =
            (0..POINTS).filter_map(|_| draw((&system, 0.0, &entries), &sizes, RADIUS, &mut rng));
        points.extend(drawn.map(|x| point::<M>(&x)));
        Self { points, units: Column::from_index(|i| sizes.units[i]) }
    }

    /// A direction that moves each coordinate by a part of its size.
    fn direction(&self) -> Vector<M> {
        Vector::<M>::from_index(|i| (1.0 + i as f64).sin() * self.units[i])
    }

    /// Returns what is found at more than half of the points: a derivative that is lost is lost in a region, and not where the
    /// values have a kink.
    fn at_most_points<E>(&self, find: impl Fn(&M::Point<f64>) -> Option<E>) -> Option<E> {
        let mut found: Vec<E> = self.points.iter().filter_map(find).collect();
        if 2 * found.len() > self.points.len() { found.pop() } else { None }
    }

    /// Compares the derivative of `ln μ` with its values. Returns both where they differ.
    pub fn lost_in_measure(&self, measure: &impl ScalarField<M>) -> Option<[f64; 2]> {
        let u = self.direction();
        self.at_most_points(|x| {
            let df = Row::from_slice(&[measure.jet1(x).df.dot(&u)]);
            let units = Row::from_slice(&[1.0]);
            let derivatives = Derivatives { scale: 1.0, df, units, rounding: OF_SOLUTIONS };
            let compared = derivatives.compare(&|t, values| {
                values.push(measure.at::<f64>(&M::chart(x, &(u * t))));
                Some(())
            });
            compared.map(|Mismatch { derivative, quotient }| [derivative, quotient])
        })
    }

    /// Compares the derivatives of terms along the state, with those of the covectors that they are made of, with their
    /// values. Returns a derivative and a quotient that differ. The kinetic drift is made of these derivatives.
    pub fn lost_in_terms<Y>(
        &self,
        system: &Y,
        each: impl Fn(&Place<M>, &mut TermVisitor<'_, M>) -> Result<(), MetricError>,
    ) -> Option<[f64; 2]>
    where
        Y: Metriplectic<Manifold = M> + ?Sized,
    {
        let (n, u) = (Dim::<Y>::LEN, self.direction());
        let entries = |place: &Place<M>, part: fn(Real) -> f64| {
            let mut entries = Vec::new();
            let looked_at = each(place, &mut |_, NoiseTerm { rate, b }| {
                entries.push(part(rate));
                (0..n).for_each(|i| entries.push(part(b[i])));
            });
            looked_at.ok().map(|()| entries)
        };
        self.at_most_points(|x| {
            let place = Jets::at(system, x).along(x, &u);
            let values = entries(&place, |a| a.re)?;
            let df = entries(&place, |a| a.eps1)?;
            // A rate in units of itself, and a vector in units of the coordinates.
            let units = values.chunks(n + 1).flat_map(|term| {
                let b = &term[1..];
                let size = (0..n).map(|i| (b[i] / self.units[i]).abs()).fold(0.0, f64::max);
                let or_one = |unit: f64| if unit > 0.0 { unit } else { 1.0 };
                let rate = or_one(term[0].abs());
                std::iter::once(rate).chain((0..n).map(move |i| or_one(size * self.units[i])))
            });
            let (df, units) = (df.into(), units.collect());
            let derivatives = Derivatives { scale: 1.0, df, units, rounding: OF_SOLUTIONS };
            let compared = derivatives.compare(&|t, values| {
                let at = ChartPoint { base: x.clone(), q: u * t };
                values.extend(entries(&place_at(system, &at), |a| a.re)?);
                Some(())
            });
            compared.map(|Mismatch { derivative, quotient }| [derivative, quotient])
        })
    }
}

/// A place without derivatives, anywhere in a chart.
pub(super) fn place_at<Y: Metriplectic + ?Sized>(
    system: &Y,
    at: &ChartPoint<Y::Manifold>,
) -> Place<Y::Manifold> {
    let w = differentials(system, at);
    let real = |v: &Vector<Y::Manifold>| Vector::<Y::Manifold, Real>::embed(v);
    let listed = w.invariants.as_ref().iter().flatten();
    Place {
        x: ChartPoint { base: at.base.clone(), q: real(&at.q) },
        w: real(&w.energy),
        s: real(&w.entropy),
        invariants: listed.map(|(_, l)| real(l)).collect(),
    }
}
