//! The covectors of a law at the stages, with one scalar correction for all of them.
//!
//! With `D = h Σ b_i G(v_i, v_i)`,
//!
//! ```math
//! w_i = dF(X_i) + \frac{\delta}{D}\, ♭v_i, \qquad
//! \delta = F(x') - F(x) - h \sum_i b_i \langle dF(X_i), v_i\rangle ,
//! ```
//!
//! so `h Σ b_i ⟨w_i, v_i⟩ = F(x') − F(x)` for every `F`, every chart and every step size.
//!
//! `δ` is `O(h^{2s+1}|v|³)` for Gauss nodes, and the difference of two values loses it in round-off as a step gets
//! short. On the polynomial `u` of the step it is also the difference of two rules for one integral,
//! `h Σ_m ω_m ⟨dF(u), u'⟩(τ_m) − h Σ b_i ⟨dF(X_i), v_i⟩`, with two nodes more, whose error is relative to its own
//! terms. The two are averaged: by the size of the change, as in a [`StableGradient`](crate::StableGradient), and by
//! the error of the integral. Relative to the change `c`, `δ` is `O(h^{2s})` and this error is `O(h^{2s+4})`, so
//! it is estimated by `|δ| (|δ|/c)^{2/s}`. Where `δ` changes its sign this is too small; the solver compares the laws
//! at the end, and takes the difference alone if they are off.

use metriplectic_dynamics::Metriplectic;
use metriplectic_dynamics::velocity::{Covectors, Gradient};
use metriplectic_fields::{
    Column, Dimension, Jet1, Real, ScalarField, Space, Vector, power_of_two,
};
use metriplectic_manifolds::{InnerProduct, Manifold, Riemannian};

use super::chart::StepChart;
use super::tableau::{STAGES, Tableau};
use crate::round_off::bound::NO_DIGITS;
use crate::round_off::stable_gradient::short;
use crate::step::CountOf;

/// A vector for each stage.
pub(crate) type Stages<V> = [V; STAGES];

/// The stages of a step: points, velocities in the frames there, and their covectors.
#[derive(Debug)]
pub(super) struct StagePoints<M: Space> {
    /// The points `X_i`; those beyond the last stage repeat the middle.
    pub(super) x: Stages<M::Point<f64>>,
    /// Their coordinates in the chart of the step.
    pub(super) q: Stages<Vector<M>>,
    /// The velocities `v_i`.
    pub(super) v: Stages<Vector<M>>,
    /// The covectors `♭v_i/υ` with the unit `υ`.
    flat: Stages<Vector<M>>,
    /// A power of two near the largest velocity.
    unit: f64,
    /// `D/υ²`.
    square: f64,
}

/// A law at the stages of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct StageCovectors<V> {
    /// The covectors `w_i`.
    pub(super) w: Stages<V>,
    /// The value `F(x')`, less what time alone has changed of it at the stages.
    pub(super) end: f64,
    /// The size of the terms of `F`, to which its round-off is relative.
    pub(super) size: f64,
    /// The largest change of the law at a stage.
    pub(super) excursion: f64,
    /// The round-off of the covectors, the largest over the stages.
    pub(super) noise: V,
    /// The number `δ` with what is taken back of errors; zero if it is corrected.
    pub(super) left: f64,
    /// The round-off of `δ`.
    pub(super) left_round_off: f64,
}

/// The covectors of all laws at the stages.
pub(super) type StageCovectorsOf<Y> =
    Covectors<CountOf<Y>, StageCovectors<Vector<<Y as Metriplectic>::Manifold>>>;

/// The covectors at one stage.
pub(super) fn at_stage<Y: Metriplectic>(
    w: &StageCovectorsOf<Y>,
    i: usize,
) -> Covectors<CountOf<Y>, Vector<Y::Manifold>> {
    Covectors {
        energy: w.energy.w[i],
        entropy: w.entropy.w[i],
        invariants: CountOf::<Y>::array(|a| w.invariants[a].map(|(kind, l)| (kind, l.w[i]))),
    }
}

/// The start of a law: its value, and what is taken back of its error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LawStart {
    pub(crate) value: f64,
    pub(crate) drift: f64,
}

/// How the covectors of a law are corrected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Correction {
    /// Not at all: they are differentials.
    None,
    /// Not here: they are differentials, and `δ` is known.
    Later,
    /// So that the law has no error.
    Here,
    /// So that the law has no error, if it would be more than it should; what it is less is left.
    Raised,
}

/// The polynomial of a step, in the chart at its middle.
#[derive(Debug)]
pub(super) struct StepPolynomial<'a, M: Space> {
    pub(super) tableau: &'static Tableau,
    pub(super) chart: &'a StepChart<M>,
    /// The displacements `h k_i`.
    pub(super) k: Stages<Vector<M>>,
    pub(super) h: f64,
    /// The [unit of rates](unit_of_rates).
    pub(super) unit: f64,
}

impl<M: Space> StepPolynomial<'_, M> {
    /// The combination `Σ_j c_j h k_j`.
    #[inline]
    pub(super) fn combined(&self, coefficients: &[f64; STAGES]) -> Vector<M> {
        combined(self.tableau.stages, coefficients, &self.k)
    }
}

/// A power of two near `1/h`, by which rates are divided before they are multiplied by a covector: a power may be too large or too
/// small for a number where the work in the step is not.
#[inline]
pub(crate) fn unit_of_rates(h: f64) -> f64 {
    power_of_two(h.recip().abs())
}

/// `Σ_{j<s} c_j v_j`.
#[inline]
pub(crate) fn combined<V: Column<f64>>(
    stages: usize,
    coefficients: &[f64; STAGES],
    vectors: &Stages<V>,
) -> V {
    let mut sum = vectors[0] * coefficients[0];
    for j in 1..stages {
        sum += vectors[j] * coefficients[j];
    }
    sum
}

impl<M: Manifold> StagePoints<M> {
    /// The stages of a polynomial; `None` where there is no metric.
    #[inline]
    pub(super) fn of<G: Riemannian<M>>(
        metric: &G,
        polynomial: &StepPolynomial<'_, M>,
        is_inside: impl Fn(&M::Point<f64>) -> bool,
    ) -> Option<Self> {
        let StepPolynomial { tableau, chart, k, h, .. } = polynomial;
        let zero = Vector::<M>::zero();
        let mut stages = Self {
            x: std::array::from_fn(|_| chart.z.clone()),
            q: [zero; STAGES],
            v: [zero; STAGES],
            flat: [zero; STAGES],
            unit: 1.0,
            square: 0.0,
        };
        let mut largest = 0.0_f64;
        for i in 0..tableau.stages {
            let centred = std::array::from_fn(|j| tableau.matrix[i][j] - 0.5 * tableau.weights[j]);
            let q = polynomial.combined(&centred);
            let x = M::chart(&chart.z, &q);
            if !is_inside(&x) {
                return None;
            }
            stages.v[i] = super::chart::in_chart_at::<M>(&x, &chart.z, &q, &k[i]) * h.recip();
            (stages.x[i], stages.q[i]) = (x, q);
            largest = largest.max(stages.v[i].magnitude());
        }
        if !largest.is_finite() {
            return None;
        }
        stages.unit = power_of_two(largest);
        for i in 0..tableau.stages {
            let v = Vector::<M>::from_index(|c| stages.v[i][c] / stages.unit);
            let at = metriplectic_fields::ChartPoint::<M>::centre(&stages.x[i]);
            stages.flat[i] = metric.at(&at).ok()?.flat(&v);
            stages.square += h * tableau.weights[i] * stages.flat[i].dot(&v);
        }
        Some(stages)
    }
}

impl<M: Manifold> StagePoints<M> {
    /// The covector `♭v_i`.
    pub(super) fn flat(&self, i: usize) -> Vector<M> {
        self.flat[i] * self.unit
    }

    /// The number `D`.
    pub(super) const fn square(&self) -> f64 {
        self.square * self.unit * self.unit
    }
}

/// A law along a step: a field, or one that depends on time.
pub(super) trait Law<M: Space> {
    /// The value at the end, for its value at the start.
    fn end(&self, start: f64, end: &M::Point<f64>) -> f64;

    /// The size of what the value at the end is summed of, beside both values.
    fn size(&self, end: &M::Point<f64>) -> f64;

    /// The value and the differential at a stage.
    fn jet1(&self, stage: usize, x: &M::Point<f64>) -> Jet1<M>;

    /// Returns its change by time alone in the whole step at its rate at a stage, and the size of the terms of this rate, if it
    /// depends on time.
    fn rate(&self, stage: usize, x: &M::Point<f64>) -> Option<[f64; 2]>;

    /// Its derivative along the polynomial of the step at a fraction of it, where the point is `x`.
    fn slope(&self, node: f64, x: &M::Point<Real>) -> f64;
}

/// A field.
struct Constant<'a, F>(&'a F);

impl<M: Space, F: ScalarField<M>> Law<M> for Constant<'_, F> {
    #[inline]
    fn end(&self, _: f64, end: &M::Point<f64>) -> f64 {
        self.0.at(end)
    }

    #[inline]
    fn size(&self, _: &M::Point<f64>) -> f64 {
        0.0
    }

    #[inline]
    fn jet1(&self, _: usize, x: &M::Point<f64>) -> Jet1<M> {
        self.0.jet1(x)
    }

    #[inline]
    fn rate(&self, _: usize, _: &M::Point<f64>) -> Option<[f64; 2]> {
        None
    }

    #[inline]
    fn slope(&self, _: f64, x: &M::Point<Real>) -> f64 {
        self.0.at_real(x).eps1
    }
}

/// Computes the covectors of one field after the other.
pub(super) struct AlongStages<'a, M: Space> {
    pub(super) stages: &'a StagePoints<M>,
    pub(super) polynomial: &'a StepPolynomial<'a, M>,
    /// The sizes of the entries at the end.
    pub(super) scales: Vector<M>,
}

impl<M: Manifold> AlongStages<'_, M> {
    /// The covectors of a field.
    #[inline]
    pub(super) fn of(
        &self,
        f: &impl ScalarField<M>,
        start: LawStart,
        correction: Correction,
    ) -> StageCovectors<Vector<M>> {
        self.of_law(&Constant(f), start, correction)
    }

    /// The covectors of a law.
    #[inline]
    pub(super) fn of_law(
        &self,
        f: &impl Law<M>,
        start: LawStart,
        correction: Correction,
    ) -> StageCovectors<Vector<M>> {
        let (Self { stages, polynomial, scales }, zero) = (self, Vector::<M>::zero());
        let &StepPolynomial { tableau, chart, h, unit, .. } = *polynomial;
        let (s, end) = (tableau.stages, f.end(start.value, &chart.end));
        let (in_unit, [step, size_of_step]) = (unit.recip(), [h * unit, h.abs() * unit]);
        let mut w = [zero; STAGES];
        let (mut slope, mut change, mut excursion) = (0.0, 0.0, 0.0_f64);
        let (mut by_time, mut rates) = (0.0, 0.0);
        let mut size = start.value.abs() + end.abs() + f.size(&chart.end);
        for i in 0..s {
            let jet = f.jet1(i, &stages.x[i]);
            excursion = excursion.max((jet.value - start.value).abs());
            w[i] = jet.df;
            let v = stages.v[i] * in_unit;
            slope += tableau.weights[i] * step * w[i].dot(&v);
            change += tableau.weights[i] * size_of_step * M::pairing_size(&w[i], &v);
            size += tableau.weights[i] * w[i].abs().dot(scales);
            if let Some([rate, terms]) = f.rate(i, &stages.x[i]) {
                slope += tableau.weights[i] * rate;
                by_time += tableau.weights[i] * rate;
                change += tableau.weights[i] * rate.abs();
                rates += tableau.weights[i] * terms;
            }
        }
        let none = StageCovectors {
            w,
            end: end - by_time,
            size,
            excursion,
            noise: zero,
            left: 0.0,
            left_round_off: 0.0,
        };
        if correction == Correction::None {
            return none;
        }
        let rounding = f64::EPSILON * size;
        let mut delta = (end - start.value) - slope;
        let mut noise = rounding;
        let fraction = short(change, size);
        if fraction > 0.0 {
            let integral = self.integral(f) - slope;
            let weight = fraction * trust(integral, [change, rounding], s);
            delta += weight * (integral - delta);
            noise *= 1.0 - weight;
        }
        // Both have the rates of time as terms.
        noise += f64::EPSILON * rates;
        // A change without digits is none.
        if delta.abs() <= NO_DIGITS {
            delta = 0.0;
        }
        delta += start.drift;
        let squares = stages.square * stages.unit;
        let left_round_off = noise + f64::EPSILON * change;
        let later = StageCovectors { left: delta, left_round_off, ..none };
        let is_later = correction == Correction::Later;
        if squares == 0.0 {
            return if is_later || correction == Correction::Raised { later } else { none };
        }
        let blur = (noise / squares).abs();
        let mut noise = zero;
        for i in 0..s {
            noise = Vector::<M>::from_index(|c| {
                let here = blur * stages.flat[i][c].abs() + f64::EPSILON * w[i][c].abs();
                here.max(noise[c])
            });
        }
        if is_later || (correction == Correction::Raised && delta < 0.0) {
            return StageCovectors { noise, ..later };
        }
        for i in 0..s {
            w[i] += stages.flat[i] * (delta / squares);
        }
        StageCovectors { w, noise, ..none }
    }

    /// The change of a field along the polynomial of the step, as an integral.
    #[inline]
    fn integral(&self, f: &impl Law<M>) -> f64 {
        let StepPolynomial { tableau, chart, .. } = self.polynomial;
        tableau.points().iter().fold(0.0, |sum, point| {
            let q = self.polynomial.combined(&point.position);
            let v = self.polynomial.combined(&point.velocity);
            let moved = Vector::<M, Real>::from_index(|i| Real::new(q[i], v[i], 0.0, 0.0));
            sum + point.weight * f.slope(point.node, &M::chart(&chart.z, &moved))
        })
    }
}

/// How far an integral that gives the number `δ` of a change is trusted, against a difference with the error `rounding`.
pub(crate) fn trust(delta: f64, [change, rounding]: [f64; 2], stages: usize) -> f64 {
    // Without terms there is no error.
    let error = if change > 0.0 {
        delta.abs() * (delta / change).abs().powf(2.0 / stages as f64)
    } else {
        0.0
    };
    if error > 0.0 { (1.0 + (error / rounding).powi(2)).recip() } else { 1.0 }
}

/// Calls a function for each of the further invariants in turn.
pub(super) struct OfInvariants<'a, 'b, M: Space, F> {
    pub(super) along: &'a AlongStages<'b, M>,
    pub(super) start: F,
    pub(super) seen: usize,
}

impl<M: Manifold, F: Fn(usize) -> LawStart> Gradient<M> for OfInvariants<'_, '_, M, F> {
    type Covector = StageCovectors<Vector<M>>;

    #[inline]
    fn of(&mut self, f: &impl ScalarField<M>) -> StageCovectors<Vector<M>> {
        self.seen += 1;
        self.along.of(f, (self.start)(self.seen - 1), Correction::Here)
    }
}

/// Whether every component of every vector is finite.
pub(super) fn all_finite<N: Dimension>(vectors: &[N::Vector<f64>]) -> bool {
    vectors.iter().all(Column::is_finite)
}
