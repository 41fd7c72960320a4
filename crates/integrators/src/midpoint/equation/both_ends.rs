//! The equation of a step linearised from both of its ends, with one evaluation of what they share.
//!
//! A step from `x` to `x'` and the step of the opposite size from `x'` to `x` have one base, opposite displacements and the same
//! discrete gradients. So the second derivatives of the fields, the metric and the tensors are evaluated once.

use metriplectic_dynamics::Metriplectic;
use metriplectic_dynamics::orthogonal::WithJacobian;
use metriplectic_dynamics::system::Point;
use metriplectic_dynamics::velocity::{Covectors, velocity_jet};
use metriplectic_fields::{
    ChartPoint, Column as _, Dimension, Matrix, ScalarField, Square as _, Vector,
};
use metriplectic_manifolds::{
    InnerProduct, MetricAt, MetricError, MetricSlopes, Retraction, StepPathJet,
};

use super::providers::Along;
use super::{CovectorsOf, Law, Provider, Residual, Terms, equation};
use crate::discrete_gradient::DiscreteGradient;
use crate::round_off::stable_gradient::{Segment, underflows};
use crate::step::{CountOf, Dim, both};

/// Components with their derivatives along the unknowns of a step from either end.
#[derive(Clone, Copy, Debug)]
pub(super) struct FromBothEnds<N: Dimension> {
    value: N::Vector<f64>,
    slopes: [N::Matrix<f64>; 2],
    /// Says whether the path is so short that differences of values lose digits. It is `None` for a differential, which has no defect.
    is_short: Option<bool>,
}

/// The derivatives of the velocity along each covector, and whether differences of its field lose digits; `None` for a differential, which
/// has no defect.
pub(crate) type AlongCovectors<Y> =
    Covectors<CountOf<Y>, (Matrix<<Y as Metriplectic>::Manifold>, Option<bool>)>;

/// The equation of a step linearised from both ends.
pub(crate) struct BothEnds<Y: Metriplectic> {
    /// The Jacobians `∂R/∂u` of the step, and of that of the opposite size.
    pub(crate) jacobians: [Matrix<Y::Manifold>; 2],
    /// The differentials of the energy at both ends.
    pub(crate) energy: [Vector<Y::Manifold>; 2],
    /// `♭d/G(d, d)`, along which a discrete gradient corrects its mean.
    pub(crate) correction: Vector<Y::Manifold>,
    /// The derivatives along covectors, if they were asked for.
    pub(crate) along: Option<AlongCovectors<Y>>,
}

/// The provider of covectors and velocities along the two paths of a step.
struct Pair<'a, 'b, Y: Metriplectic, R, W, G> {
    along: &'a Along<'a, 'b, Y, R, W, G>,
    ends: [&'a Point<Y>; 2],
    paths: [&'a StepPathJet<Y::Manifold>; 2],
    metric: &'a MetricAt<'a, Y::Manifold, Y::Metric>,
    slopes: Option<&'a MetricSlopes<Y::Manifold>>,
    energy: [Vector<Y::Manifold>; 2],
    asks_covectors: bool,
    along_covectors: Option<AlongCovectors<Y>>,
}

impl<Y, R, W, G> Provider for Pair<'_, '_, Y, R, W, G>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
    G: InnerProduct<Vector<Y::Manifold>>,
{
    type System = Y;
    type Components = FromBothEnds<Dim<Y>>;

    #[inline]
    fn discrete(&mut self, law: Law, f: &impl ScalarField<Y::Manifold>) -> FromBothEnds<Dim<Y>> {
        let (Along { step, g, .. }, [there, back]) = (self.along, self.paths);
        let (mean, [du, dv]) = step.gradient.mean_jets(f, self.ends, self.paths);
        let [start, end] = both(self.ends, |x| f.jet1(x));
        let points = [&there.z, self.ends[1]];
        let w = self.along.stable_gradient(f, &mean, points, [start.value, end.value]);
        let at = (*g, self.slopes);
        let slopes = [
            w.slope_above_round_off(at, there, (&du, &end.df)),
            w.reversed().slope_above_round_off(at, back, (&dv, &start.df)),
        ];
        if law == Law::Energy {
            self.energy = [start.df, end.df];
        }
        FromBothEnds { value: w.covector(0.0, *g, &there.d), slopes, is_short: Some(w.is_short()) }
    }

    fn differential(&self, f: &impl ScalarField<Y::Manifold>) -> FromBothEnds<Dim<Y>> {
        let jet = f.jet2(&self.paths[0].z);
        let slopes = self.paths.map(|path| jet.hf * path.dz);
        FromBothEnds { value: jet.df, slopes, is_short: None }
    }

    #[inline]
    fn displacement_less(&self, h: f64, v: FromBothEnds<Dim<Y>>) -> FromBothEnds<Dim<Y>> {
        let [there, back] = self.paths;
        let slopes = [there.dd - v.slopes[0] * h, back.dd + v.slopes[1] * h];
        FromBothEnds { value: there.d - v.value * h, slopes, is_short: None }
    }

    #[inline]
    fn velocity(
        &mut self,
        system: &Y,
        w: &CovectorsOf<Self>,
    ) -> Result<(FromBothEnds<Dim<Y>>, f64), MetricError> {
        let [there, back] = both([0, 1], |k| {
            let w = with_slopes::<Y>(w, |_, w| w.slopes[k]);
            velocity_jet(system, self.metric, &self.paths[k].dz, &w)
        });
        let (there, back) = (there?, back?);
        if self.asks_covectors {
            self.along_covectors = Some(along_covectors(system, self.metric, w)?);
        }
        let slopes = [there.velocity.slope, back.velocity.slope];
        let value = there.velocity.value;
        Ok((FromBothEnds { value, slopes, is_short: None }, there.production))
    }
}

/// The covectors with derivatives that depend on the number of the field: 0 is the energy, 1 the entropy.
#[inline]
fn with_slopes<Y: Metriplectic>(
    w: &Covectors<CountOf<Y>, FromBothEnds<Dim<Y>>>,
    slope: impl Fn(usize, &FromBothEnds<Dim<Y>>) -> Matrix<Y::Manifold>,
) -> Covectors<CountOf<Y>, WithJacobian<Dim<Y>>> {
    let of =
        |k: usize, w: &FromBothEnds<Dim<Y>>| WithJacobian { value: w.value, slope: slope(k, w) };
    let listed = w.invariants.as_ref();
    Covectors {
        energy: of(0, &w.energy),
        entropy: of(1, &w.entropy),
        invariants: CountOf::<Y>::array(|k| {
            listed[k].as_ref().map(|(kind, w)| (*kind, of(k + 2, w)))
        }),
    }
}

/// The derivatives of the velocity along each covector, at a fixed point.
fn along_covectors<Y: Metriplectic>(
    system: &Y,
    metric: &MetricAt<'_, Y::Manifold, Y::Metric>,
    w: &Covectors<CountOf<Y>, FromBothEnds<Dim<Y>>>,
) -> Result<AlongCovectors<Y>, MetricError> {
    let (zero, one) = (Matrix::<Y::Manifold>::zeros(), Matrix::<Y::Manifold>::one());
    let mut failure = None;
    let mut along = |field: usize, is_short: Option<bool>| {
        let w = with_slopes::<Y>(w, |k, _| if k == field { one } else { zero });
        match velocity_jet(system, metric, &zero, &w) {
            Ok(jet) => (jet.velocity.slope, is_short),
            Err(error) => {
                failure = Some(error);
                (zero, is_short)
            }
        }
    };
    let listed = w.invariants.as_ref();
    let along = Covectors {
        energy: along(0, w.energy.is_short),
        entropy: along(1, w.entropy.is_short),
        invariants: CountOf::<Y>::array(|k| {
            listed[k].as_ref().map(|(kind, w)| (*kind, along(k + 2, w.is_short)))
        }),
    };
    failure.map_or(Ok(along), Err)
}

impl<Y, R, W> Residual<'_, Y, R, W>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    /// The equation linearised from both ends, along the path of the unknown `u` to `end` and the path back, which has the base
    /// of the first and the opposite displacement; with the derivatives along covectors if they are asked for.
    pub(crate) fn both_ends(
        &self,
        (u, end): (&Vector<Y::Manifold>, &Point<Y>),
        paths: [&StepPathJet<Y::Manifold>; 2],
        asks_covectors: bool,
    ) -> Option<BothEnds<Y>> {
        let [path, _] = paths;
        let z = ChartPoint::<Y::Manifold>::centre(&path.z);
        let g = self.system.metric_at(&z);
        let slopes = g.slopes().ok()?.as_ref();
        let inner = g.inner().ok()?;
        let along = Along::new(self, u, inner, Segment::new(&path.d, end));
        let zero = Vector::<Y::Manifold>::zero();
        let mut pair = Pair {
            along: &along,
            ends: [self.x, end],
            paths,
            metric: &g,
            slopes,
            energy: [zero; 2],
            asks_covectors,
            along_covectors: None,
        };
        let Terms { residual, .. } = equation(self.system, self.h, &mut pair).ok()?;
        let flat = inner.flat(&path.d);
        let square = flat.dot(&path.d);
        let correction = if underflows(square) { zero } else { flat * square.recip() };
        let (jacobians, energy, along) = (residual.slopes, pair.energy, pair.along_covectors);
        let usable = jacobians.iter().all(|jacobian| jacobian.magnitude().is_finite());
        usable.then_some(BothEnds { jacobians, energy, correction, along })
    }
}
