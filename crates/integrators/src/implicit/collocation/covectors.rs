//! The covectors of the laws at the stages, with one scalar correction of each for all of them. As in [`crate::collocation`],
//! whose formulas it has.

use metriplectic_equations::{ENERGY, ENTROPY};
use metriplectic_fields::power_of_two;

use super::chart::StepChart;
use super::clock::Timed;
use crate::collocation::Stages;
use crate::collocation::covectors::{Correction, LawStart};
use crate::collocation::tableau::{Numbers, STAGES, Tableau};
use crate::collocation::trust;
use crate::implicit::algebra::{add, dot, is_finite, magnitude, sum_of_terms};
use crate::implicit::metric::{Metric, Units};
use crate::implicit::parts::{OfLaws, Parts};
use crate::numbers::Lengths;
use crate::round_off::bound::NO_DIGITS;
use crate::round_off::stable_gradient::short;
use crate::step::{Laws, Vector};

/// A vector for each stage, which is zero beyond the last one.
#[inline]
pub(super) fn each_stage<L: Lengths>(
    parts: &Parts<'_, L>,
    stages: usize,
    mut f: impl FnMut(usize) -> L::Vector,
) -> Stages<L::Vector> {
    std::array::from_fn(|i| if i < stages { f(i) } else { parts.zero() })
}

/// A zero for each stage.
#[inline]
pub(super) fn zeros<L: Lengths>(parts: &Parts<'_, L>) -> Stages<L::Vector> {
    std::array::from_fn(|_| parts.zero())
}

/// `h Σ_{j<s} c_j v_j`.
#[inline]
pub(super) fn combined<V: Vector>(
    h: f64,
    stages: usize,
    coefficients: &Numbers,
    vectors: &Stages<V>,
) -> V {
    V::combination(h, stages, |j| (coefficients[j], &vectors[j]))
}

/// Whether every component of every vector is finite.
pub(super) fn all_finite<L: Lengths>(vectors: &[L::Vector]) -> bool {
    vectors.iter().all(is_finite)
}

/// The number of a law.
#[inline]
pub(super) fn of_law<L: Lengths>(laws: &Laws<L::Invariants>, law: usize) -> f64 {
    match law {
        ENERGY => laws.energy,
        ENTROPY => laws.entropy,
        _ => laws.invariants.as_ref()[law - ENTROPY - 1],
    }
}

impl<V> OfLaws<V> {
    /// The member of a law, to be changed.
    #[inline]
    fn of_mut(&mut self, law: usize) -> &mut V {
        match law {
            ENERGY => &mut self.energy,
            ENTROPY => &mut self.entropy,
            _ => &mut self.invariants[law - ENTROPY - 1],
        }
    }
}

/// The polynomial of a step, around its middle.
pub(super) struct StepPolynomial<'a, L: Lengths> {
    pub(super) parts: &'a Parts<'a, L>,
    pub(super) tableau: &'static Tableau,
    pub(super) chart: &'a StepChart<L>,
    /// The displacements `h k_i`.
    pub(super) k: Stages<L::Vector>,
    pub(super) h: f64,
    /// The [unit of rates](crate::collocation::covectors::unit_of_rates).
    pub(super) unit: f64,
}

impl<L: Lengths> StepPolynomial<'_, L> {
    /// The combination `Σ_j c_j h k_j`.
    #[inline]
    fn combined(&self, coefficients: &Numbers) -> L::Vector {
        combined(1.0, self.tableau.stages, coefficients, &self.k)
    }
}

/// The displacements `h k_i` of the stages of a step of size `h` from `x`, in the chart at its middle.
#[inline]
pub(super) fn displacements<L: Lengths>(
    tableau: &Tableau,
    (parts, x, h): (&Parts<'_, L>, &L::State, f64),
    chart: &StepChart<L>,
    k: &Stages<L::Vector>,
) -> Stages<L::Vector> {
    each_stage(parts, tableau.stages, |i| {
        let Some(shift) = chart.shift() else { return k[i].map(|k| k * h) };
        let k = chart.to_middle(parts, x, &k[i]);
        parts.vector(|c| shift[c] + k[c] * h)
    })
}

/// The stages of a step: points, velocities in the frames there, and metrics.
pub(super) struct StagePoints<L: Lengths> {
    /// The points `X_i`; those beyond the last stage repeat the middle.
    pub(super) x: Stages<L::State>,
    /// The displacements to them from the middle.
    pub(super) q: Stages<L::Vector>,
    /// The velocities `v_i`.
    pub(super) v: Stages<L::Vector>,
    /// The metrics.
    metrics: Stages<Metric<L>>,
    /// The covectors `♭v_i/υ` with the unit `υ`.
    flat: Stages<L::Vector>,
    /// A power of two near the largest velocity.
    unit: f64,
    /// `D/υ²`.
    square: f64,
}

impl<L: Lengths> StagePoints<L> {
    /// The stages of a polynomial; `None` where a velocity is not finite, or there is no metric.
    #[inline]
    pub(super) fn of(polynomial: &StepPolynomial<'_, L>) -> Option<Self> {
        let StepPolynomial { parts, tableau, chart, k, h, .. } = polynomial;
        let (s, weights) = (tableau.stages, &tableau.weights);
        let q = each_stage(parts, s, |i| {
            let centred = std::array::from_fn(|j| tableau.matrix[i][j] - 0.5 * weights[j]);
            polynomial.combined(&centred)
        });
        let x: Stages<L::State> =
            std::array::from_fn(
                |i| {
                    if i < s { parts.moved(&chart.z, &q[i]) } else { chart.z.clone() }
                },
            );
        if !parts.is_flat() && x[..s].iter().any(|x| parts.is_outside(x)) {
            return None;
        }
        let rate = h.recip();
        let v = each_stage(parts, s, |i| {
            let scaled = |k: &L::Vector| k.map(|k| k * rate);
            if parts.is_flat() {
                return scaled(&k[i]);
            }
            scaled(&parts.velocity_at(&x[i], (&chart.z, &q[i]), &k[i]))
        });
        let largest = v[..s].iter().map(magnitude).fold(0.0, f64::max);
        if !largest.is_finite() {
            return None;
        }
        let unit = power_of_two(largest);
        let mut metrics = [const { Metric::CANONICAL }; STAGES];
        for i in 0..s {
            metrics[i] = parts.metric(&x[i])?;
        }
        let in_unit = each_stage(parts, s, |i| v[i].map(|v| v / unit));
        let flat = each_stage(parts, s, |i| metrics[i].units().flat(&in_unit[i]));
        let square = (0..s).fold(0.0, |sum, i| sum + h * weights[i] * dot(&flat[i], &in_unit[i]));
        Some(Self { x, q, v, metrics, flat, unit, square })
    }

    /// A stage with the units of its metric.
    pub(super) fn at(&self, i: usize) -> (&L::State, Units<'_, L>) {
        (&self.x[i], self.metrics[i].units())
    }

    /// The covector `♭v_i`.
    pub(super) fn flat(&self, i: usize) -> L::Vector {
        self.flat[i].map(|v| v * self.unit)
    }

    /// The number `D`.
    pub(super) const fn square(&self) -> f64 {
        self.square * self.unit * self.unit
    }
}

/// The covectors of all laws at the stages.
pub(super) struct StageCovectors<L: Lengths> {
    /// The covectors `w_i` of each stage.
    pub(super) w: Stages<OfLaws<L::Vector>>,
    /// The laws along the step.
    pub(super) laws: OfLaws<LawOfStages<L::Vector>>,
    /// The largest change of the energy at a stage.
    pub(super) excursion: f64,
}

/// A law at the stages of a step, beside its covectors.
pub(super) struct LawOfStages<V> {
    /// The value `F(x')`.
    pub(super) end: f64,
    /// The size of the terms of `F`, to which its round-off is relative.
    pub(super) size: f64,
    /// The round-off of the covectors, the largest over the stages.
    pub(super) noise: V,
    /// The number `δ` with what is taken back of errors; zero if it is corrected.
    pub(super) left: f64,
    /// The round-off of `δ`.
    pub(super) left_round_off: f64,
}

impl<L: Lengths> StageCovectors<L> {
    /// The covectors of laws with these starts, corrected in these ways; of an energy that depends on time, if it does.
    #[inline]
    pub(super) fn of(
        stages: &StagePoints<L>,
        polynomial: &StepPolynomial<'_, L>,
        timed: Option<Timed<'_, L>>,
        start: impl Fn(usize) -> LawStart,
        correction: impl Fn(usize) -> Correction,
    ) -> Self {
        let StepPolynomial { parts, tableau, chart, .. } = polynomial;
        let mut energies = [0.0; STAGES];
        let mut w = std::array::from_fn(|i| {
            if i >= tableau.stages {
                return OfLaws { energy: parts.zero(), entropy: parts.zero(), invariants: vec![] };
            }
            parts.each_law(|law| {
                let parts = match &timed {
                    Some(timed) if law == ENERGY => &timed.in_time[i],
                    _ => parts,
                };
                let (value, df) = parts.jet(law, &stages.x[i]);
                if law == ENERGY {
                    energies[i] = value;
                }
                df
            })
        });
        let before = start(ENERGY).value;
        let energies = energies[..tableau.stages].iter();
        let excursion = energies.map(|energy| (energy - before).abs()).fold(0.0, f64::max);
        let along = AlongStages { stages, polynomial, timed, scales: parts.scales(&chart.end) };
        let laws = parts.each_law(|law| along.of(law, start(law), correction(law), &mut w));
        Self { w, laws, excursion }
    }
}

/// Corrects the covectors of one law after the other.
struct AlongStages<'a, L: Lengths> {
    stages: &'a StagePoints<L>,
    polynomial: &'a StepPolynomial<'a, L>,
    /// The energy, if it depends on time.
    timed: Option<Timed<'a, L>>,
    /// The sizes of the entries at the end.
    scales: L::Vector,
}

impl<L: Lengths> AlongStages<'_, L> {
    /// A law whose differentials at the stages are given, and become its covectors.
    #[inline]
    fn of(
        &self,
        law: usize,
        start: LawStart,
        correction: Correction,
        w: &mut Stages<OfLaws<L::Vector>>,
    ) -> LawOfStages<L::Vector> {
        let Self { stages, polynomial, scales, .. } = self;
        let &StepPolynomial { parts, tableau, chart, h, unit, .. } = *polynomial;
        let timed = self.timed.as_ref().filter(|_| law == ENERGY);
        let [end, terms] = match timed {
            Some(timed) => {
                let [change, terms] = timed.change(&chart.end);
                [start.value + change, terms]
            }
            None => [parts.value(law, &chart.end), 0.0],
        };
        let s = tableau.stages;
        let (in_unit, [step, size_of_step]) = (unit.recip(), [h * unit, h.abs() * unit]);
        let (mut slope, mut change) = (0.0, 0.0);
        let (mut by_time, mut rates) = (0.0, 0.0);
        let mut size = start.value.abs() + end.abs() + terms;
        for i in 0..s {
            let (w, v) = (&*w[i].of_mut(law), stages.v[i].map(|v| v * in_unit));
            slope += tableau.weights[i] * step * dot(w, &v);
            change += tableau.weights[i] * size_of_step * parts.pairing_size(w, &v);
            size += tableau.weights[i] * sum_of_terms(w, scales);
            if let Some(timed) = timed {
                let [rate, terms] = timed.rate(tableau.nodes[i], &stages.x[i]);
                slope += tableau.weights[i] * rate;
                by_time += tableau.weights[i] * rate;
                change += tableau.weights[i] * rate.abs();
                rates += tableau.weights[i] * terms;
            }
        }
        let none = LawOfStages {
            end: end - by_time,
            size,
            noise: parts.zero(),
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
            let integral = self.integral(law) - slope;
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
        let is_later = correction == Correction::Later
            || correction == Correction::Raised && (delta < 0.0 || squares == 0.0);
        let none =
            if is_later { LawOfStages { left: delta, left_round_off, ..none } } else { none };
        if squares == 0.0 {
            return none;
        }
        let blur = (noise / squares).abs();
        let mut noise = none.noise;
        for i in 0..s {
            let (w, flat) = (&*w[i].of_mut(law), &stages.flat[i]);
            for c in 0..parts.n() {
                let here = blur * flat[c].abs() + f64::EPSILON * w[c].abs();
                noise[c] = here.max(noise[c]);
            }
        }
        if !is_later {
            for i in 0..s {
                add(w[i].of_mut(law), delta / squares, &stages.flat[i]);
            }
        }
        LawOfStages { noise, ..none }
    }

    /// The change of a law along the polynomial of the step, as an integral.
    #[inline]
    fn integral(&self, law: usize) -> f64 {
        let StepPolynomial { parts, tableau, chart, .. } = self.polynomial;
        let timed = self.timed.as_ref().filter(|_| law == ENERGY);
        tableau.points().iter().fold(0.0, |sum, point| {
            let q = self.polynomial.combined(&point.position);
            let v = self.polynomial.combined(&point.velocity);
            let x = parts.moved(&chart.z, &q);
            let v = if parts.is_flat() { v } else { parts.velocity_at(&x, (&chart.z, &q), &v) };
            let slope = match timed {
                Some(timed) => timed.slope(point.node, &x, &v) + timed.rate(point.node, &x)[0],
                None => parts.along(law, &x, &v)[0],
            };
            sum + point.weight * slope
        })
    }
}
