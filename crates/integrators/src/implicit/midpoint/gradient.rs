//! Discrete gradients along straight lines, safe against round-off: those of [`crate::discrete_gradient`] and the
//! [`StableGradient`](crate::StableGradient), whose formulas they are, of a law in plain numbers.

use crate::discrete_gradient::GAUSS;
use crate::implicit::algebra::{Matrix, add, dot, magnitude, sum_of_terms, vector};
use crate::implicit::orthogonal::scaled;
use crate::implicit::parts::Parts;
use crate::numbers::{Lengths, List};
use crate::round_off::bound::SUMMED;
use crate::round_off::stable_gradient::{but_round_off, integral, short, trust, underflows};
use crate::step::GradientKind;
use metriplectic_fields::power_of_two;

/// The straight line of a step from `x`, with the displacement `d`.
pub(super) struct Line<'a, L: Lengths> {
    pub(super) x: &'a L::State,
    /// The base point `z = x + c d`.
    pub(super) z: L::State,
    pub(super) c: f64,
    pub(super) d: &'a L::Vector,
    pub(super) end: L::State,
    /// The sizes of the entries of the end.
    pub(super) scales: L::Vector,
}

impl<'a, L: Lengths> Line<'a, L> {
    pub(super) fn new(parts: &Parts<'_, L>, x: &'a L::State, c: f64, d: &'a L::Vector) -> Self {
        let z = parts.moved(x, &parts.vector(|i| d[i] * c));
        let end = parts.moved(x, d);
        let scales = parts.scales(&end);
        Self { x, z, c, d, end, scales }
    }
}

/// A mean covector, with its derivatives along the displacement.
struct Mean<L: Lengths> {
    value: L::Vector,
    slope: Option<Matrix<L>>,
}

/// Which point of a line moves with the displacement.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Moves {
    Start,
    End,
}

/// One law along a line.
pub(super) struct LawAlong<'a, L: Lengths> {
    pub(super) parts: &'a Parts<'a, L>,
    pub(super) law: usize,
    pub(super) line: &'a Line<'a, L>,
}

impl<L: Lengths> LawAlong<'_, L> {
    /// The mean covector `w̄` of a kind of discrete gradient, with its derivatives if they are asked for.
    fn mean(&self, kind: GradientKind, with_slope: bool) -> Mean<L> {
        let &Self { parts, law, line } = self;
        match kind {
            GradientKind::Gonzalez if with_slope => {
                let second = parts.second(law, &line.z);
                Mean { value: second.df, slope: Some(scaled(&second.hf, line.c)) }
            }
            GradientKind::Gonzalez => Mean { value: parts.jet(law, &line.z).1, slope: None },
            GradientKind::MeanValue => self.mean_value(with_slope),
            GradientKind::ItohAbe => self.increments([line.x, &line.end], with_slope, Moves::End),
            GradientKind::SymmetricItohAbe => {
                let Mean { mut value, slope } =
                    self.increments([line.x, &line.end], with_slope, Moves::End);
                let back = self.increments([&line.end, line.x], with_slope, Moves::Start);
                add(&mut value, 1.0, &back.value);
                value.numbers_mut().iter_mut().for_each(|w| *w *= 0.5);
                let slope = slope.zip(back.slope).map(|(mut slope, back)| {
                    slope.add(1.0, &back);
                    scaled(&slope, 0.5)
                });
                Mean { value, slope }
            }
        }
    }

    /// `∫₀¹ dF(x + sd) ds`.
    fn mean_value(&self, with_slope: bool) -> Mean<L> {
        let &Self { parts, law, line } = self;
        let [start, end] = [line.x, &line.end].map(|y| parts.between(&line.z, y));
        let (mut value, mut slope) = (parts.zero(), with_slope.then(|| parts.zeros()));
        for (s, weight) in GAUSS {
            let q = parts.vector(|i| start[i] * (1.0 - s) + end[i] * s);
            let at = parts.moved(&line.z, &q);
            if let Some(slope) = &mut slope {
                let second = parts.second(law, &at);
                add(&mut value, weight, &second.df);
                slope.add(weight * s, &second.hf);
            } else {
                add(&mut value, weight, &parts.jet(law, &at).1);
            }
        }
        Mean { value, slope }
    }

    /// The quotients of Itoh and Abe from one point to another.
    fn increments(&self, [start, end]: [&L::State; 2], with_slope: bool, moves: Moves) -> Mean<L> {
        let &Self { parts, law, .. } = self;
        let n = parts.n();
        let axis = |k: usize| parts.vector(|i| if i == k { 1.0 } else { 0.0 });
        let size_of_state = magnitude(&self.line.z);
        let (mut value, mut slope) = (parts.zero(), with_slope.then(|| parts.zeros()));
        let mut corner = start.clone();
        // At each corner the value, and the differential if it is asked for.
        let at = |corner: &L::State| {
            if with_slope {
                let (value, df) = parts.jet(law, corner);
                (value, Some(df))
            } else {
                (parts.value(law, corner), None)
            }
        };
        let mut before = at(&corner);
        for i in 0..n {
            let (from, to) = (start.numbers()[i], end.numbers()[i]);
            let (step, e) = (to - from, axis(i));
            corner.numbers_mut()[i] = from + step * 0.5;
            let [middle, _] = parts.along(law, &corner, &e);
            corner.numbers_mut()[i] = to;
            let after = at(&corner);
            let size = before.0.abs() + after.0.abs() + size_of_state * middle.abs();
            let share = short(middle * step, size);
            let (mut mean, mut quotient) = (0.0, 0.0);
            if share < 1.0 {
                quotient = (after.0 - before.0) / step;
                mean += quotient * (1.0 - share);
            }
            let mut edge = corner.clone();
            if share > 0.0 {
                for (s, weight) in GAUSS {
                    edge.numbers_mut()[i] = from + step * s;
                    mean += parts.along(law, &edge, &e)[0] * (weight * share);
                }
            }
            value[i] = mean;
            if let (Some(slope), Some(dafter), Some(dbefore)) = (&mut slope, &after.1, &before.1) {
                // Entries that have moved before this one are those of the end, the others those of the start.
                let others = if moves == Moves::End { 0..i } else { i + 1..n };
                for k in others {
                    if share < 1.0 {
                        slope[(i, k)] += (1.0 - share) * ((dafter[k] - dbefore[k]) / step);
                    }
                    if share > 0.0 {
                        let f = axis(k);
                        for (s, weight) in GAUSS {
                            edge.numbers_mut()[i] = from + step * s;
                            slope[(i, k)] += share * weight * parts.mixed(law, &edge, [&e, &f]);
                        }
                    }
                }
                if share < 1.0 {
                    let own = match moves {
                        Moves::End => (dafter[i] - quotient) / step,
                        Moves::Start => (quotient - dbefore[i]) / step,
                    };
                    slope[(i, i)] += (1.0 - share) * own;
                }
                if share > 0.0 {
                    for (s, weight) in GAUSS {
                        edge.numbers_mut()[i] = from + step * s;
                        let fraction = if moves == Moves::End { s } else { 1.0 - s };
                        let [_, second] = parts.along(law, &edge, &e);
                        slope[(i, i)] += share * weight * fraction * second;
                    }
                }
            }
            before = after;
        }
        Mean { value, slope }
    }

    /// The discrete gradient with `⟨w, d⟩ = F(x') − F(x)`, from the values at both ends.
    pub(super) fn stable(
        &self,
        kind: GradientKind,
        [start, end]: [f64; 2],
        with_slope: bool,
    ) -> Stable<L> {
        let &Self { parts, law, line } = self;
        let Mean { value: mean, slope: dmean } = self.mean(kind, with_slope);
        let (d, slope) = (line.d, dot(&mean, line.d));
        let change = sum_of_terms(&mean, d);
        let mut size = start.abs() + end.abs();
        for i in 0..parts.n() {
            size += mean[i].abs() * line.scales[i];
        }
        let rounding = f64::EPSILON * size;
        let difference = (end - start) - slope;
        // Far from round-off, and most often, the difference is all.
        let fraction = short(change, size);
        let (mut defect, mut noise) = (difference, rounding);
        if fraction > 0.0 {
            let middle = if (line.c - 0.5).abs() > 0.0 {
                let middle = parts.moved(line.x, &parts.vector(|i| d[i] * 0.5));
                parts.along(law, &middle, d)[0]
            } else if kind == GradientKind::Gonzalez {
                slope
            } else {
                dot(&parts.jet(law, &line.z).1, d)
            };
            let ends = [line.x, &line.end].map(|y| parts.along(law, y, d));
            let (better, weight) = integral(ends, middle, slope, rounding);
            defect += fraction * weight * (better - difference);
            noise *= 1.0 - fraction * weight;
        }
        Stable { mean, dmean, defect, change, rounding, noise }
    }
}

/// The data of a discrete gradient, as in [`StableGradient`](crate::StableGradient).
pub(super) struct Stable<L: Lengths> {
    mean: L::Vector,
    dmean: Option<Matrix<L>>,
    defect: f64,
    change: f64,
    rounding: f64,
    noise: f64,
}

impl<L: Lengths> Stable<L> {
    /// The covector `w` with `⟨w, d⟩ = F(x') − F(x) + drift_correction`.
    #[inline]
    pub(super) fn covector(&self, drift_correction: f64, d: &L::Vector) -> L::Vector {
        let square = dot(d, d);
        let mut w = self.mean.clone();
        if underflows(square) {
            add(&mut w, 1.0, &along_short(self.defect + drift_correction, d));
        } else {
            add(&mut w, (self.defect + drift_correction) / square, d);
        }
        w
    }

    /// The round-off of each component of the covector, beside that of its mean.
    pub(super) fn noise(&self, d: &L::Vector) -> L::Vector {
        let square = dot(d, d);
        if underflows(square) {
            // The defect has underflowed.
            let noise = self.noise + f64::EPSILON * f64::MIN_POSITIVE * 16.0;
            let w: L::Vector = along_short(noise, d);
            return vector(w.numbers().len(), |i| w[i].abs());
        }
        let noise = self.noise / square;
        vector(d.numbers().len(), |i| d[i].abs() * noise)
    }

    /// The derivative of the covector along the displacement, from the differential at `x'`. It is the Jacobian of Newton's
    /// method: the derivative of the defect counts as far as it is above round-off.
    pub(super) fn slope(
        self,
        drift_correction: f64,
        d: &L::Vector,
        df_end: &L::Vector,
    ) -> Matrix<L> {
        let trust = trust(self.change, self.rounding);
        let defect = self.defect + drift_correction;
        self.corrected(defect, d, df_end, |row, _| row * trust)
    }

    /// The derivative of the covector as in [`slope`](Self::slope), for the derivative of a step: numbers that are divided by its length,
    /// the defect and its derivatives, are zero where they are round-off. They are of second order in this length.
    pub(super) fn slope_above_round_off(self, d: &L::Vector, df_end: &L::Vector) -> Matrix<L> {
        // The defect is an integral and a part of a difference, whose round-off is rounded once more where the integral replaces it.
        let size = SUMMED * (self.change.abs() + self.rounding) + self.noise;
        let defect = if self.defect.abs() <= size { 0.0 } else { self.defect };
        self.corrected(defect, d, df_end, |row, terms| but_round_off(row, terms()))
    }

    /// The derivative of `w̄ + d δ/⟨d, d⟩`, from the defect `δ` and a function of its derivatives and of the sizes of their terms.
    #[inline]
    fn corrected(
        self,
        defect: f64,
        d: &L::Vector,
        df_end: &L::Vector,
        above: impl Fn(f64, &dyn Fn() -> f64) -> f64,
    ) -> Matrix<L> {
        let Self { mean, dmean, .. } = self;
        let mut slope = dmean.expect("the derivatives were asked for");
        let square = dot(d, d);
        if underflows(square) {
            return slope;
        }
        let n = d.numbers().len();
        let (bent, sizes) = (slope.transpose_times(d), &slope);
        let c = defect / square;
        let reciprocal = square.recip();
        let along: L::Vector = vector(n, |i| {
            let bent_terms = || (0..n).map(|k| (sizes[(k, i)] * d[k]).abs()).sum::<f64>();
            let terms = || bent_terms() + df_end[i].abs() + mean[i].abs();
            let row = above(df_end[i] - mean[i] - bent[i], &terms);
            (row - d[i] * (2.0 * c)) * reciprocal
        });
        slope.add_outer(1.0, d, &along);
        slope.add(c, &Matrix::scaled_one(n, 1.0));
        slope
    }
}

/// `d defect/⟨d, d⟩` on a path so short that its squared length leaves the range of numbers, in units of a power of two near that
/// length; zero on a path without length.
#[cold]
fn along_short<V: List>(defect: f64, d: &V) -> V {
    let (n, unit) = (d.numbers().len(), power_of_two(magnitude(d)));
    let flat: V = vector(n, |i| d.numbers()[i] / unit);
    let square = dot(&flat, d) / unit;
    let factor = if square > 0.0 { defect / unit / square } else { 0.0 };
    vector(n, |i| flat.numbers()[i] * factor)
}
