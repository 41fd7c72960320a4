//! Discrete gradients along the path of a step, safe against round-off: those of [`crate::discrete_gradient`] and the
//! [`StableGradient`](crate::StableGradient), whose formulas they are, of a law in plain numbers.

use std::cell::OnceCell;
use std::ops::Range;

use metriplectic_equations::Path;
use smallvec::SmallVec;

use crate::discrete_gradient::GAUSS;
use crate::implicit::algebra::{FEW, Matrix, add, dot, magnitude, vector};
use crate::implicit::metric::{Metric, MetricAlong, Units};
use crate::implicit::orthogonal::scaled;
use crate::implicit::parts::{Apart, CurvedPath, Parts, Second};
use crate::implicit::velocity::Turn;
use crate::numbers::{Lengths, List};
use crate::round_off::bound::SUMMED;
use crate::round_off::stable_gradient::{but_round_off, integral, short, trust, underflows};
use crate::step::GradientKind;
use metriplectic_fields::power_of_two;

/// The path of a step from `x`, a straight line on a vector space.
pub(super) struct Line<'a, L: Lengths> {
    pub(super) x: &'a L::State,
    /// The unknown of the step.
    pub(super) u: &'a L::Vector,
    pub(super) path: Path,
    /// The base point `z`.
    pub(super) z: L::State,
    pub(super) end: L::State,
    /// The sizes of the entries of the end.
    pub(super) scales: L::Vector,
    curve: Option<Box<Curve<L>>>,
}

/// The numbers of a path beside those of a straight line.
struct Curve<L: Lengths> {
    /// The displacement `d` at `z`.
    d: L::Vector,
    /// The covector `♭d`.
    flat: L::Vector,
    metric: Metric<L>,
    /// The derivatives of `z`, `d` and `x'` along the unknown, if they were asked for.
    slopes: Option<[Matrix<L>; 3]>,
    /// The derivatives of all laws along the curve, at both ends and in its middle; `None` inside where it cannot be followed. They are
    /// evaluated once, where one law asks for them.
    nodes: OnceCell<Option<Nodes>>,
}

/// The first and the second derivatives of all laws at some point of a curve.
type OfCurve = SmallVec<[[f64; 2]; 2]>;

/// The derivatives of all laws at both ends of a curve, and in its middle if the base is not there.
struct Nodes {
    ends: [OfCurve; 2],
    middle: Option<OfCurve>,
}

impl<'a, L: Lengths> Line<'a, L> {
    /// The path of a displacement, with derivatives if they are asked for; `None` where it cannot be followed.
    #[inline]
    pub(super) fn new(
        parts: &Parts<'_, L>,
        x: &'a L::State,
        path: Path,
        u: &'a L::Vector,
        with_slopes: bool,
    ) -> Option<Self> {
        if !parts.is_flat() {
            return Self::curved(parts, x, path, u, with_slopes);
        }
        let c = path.base();
        let z = parts.moved(x, &parts.vector(|i| u[i] * c));
        let end = parts.moved(x, u);
        let scales = parts.scales(&end);
        Some(Self { x, u, path, z, end, scales, curve: None })
    }

    #[inline(never)]
    fn curved(
        parts: &Parts<'_, L>,
        x: &'a L::State,
        path: Path,
        u: &'a L::Vector,
        with_slopes: bool,
    ) -> Option<Self> {
        let CurvedPath { z, d, end, slopes } = parts.curved_path(path, x, u, with_slopes)?;
        let metric = parts.metric(&z)?;
        let flat = metric.units().flat(&d);
        let scales = parts.scales(&end);
        let nodes = OnceCell::new();
        let curve = Some(Box::new(Curve { d, flat, metric, slopes, nodes }));
        Some(Self { x, u, path, z, end, scales, curve })
    }

    /// The place of the base, as a fraction of the way.
    const fn c(&self) -> f64 {
        self.path.base()
    }

    /// The displacement `d` at `z`.
    #[inline]
    pub(super) fn d(&self) -> &L::Vector {
        self.curve.as_ref().map_or(self.u, |curve| &curve.d)
    }

    /// The covector `♭d`.
    #[inline]
    fn flat(&self) -> &L::Vector {
        self.curve.as_ref().map_or(self.u, |curve| &curve.flat)
    }

    /// The units of the metric at `z`.
    #[inline]
    pub(super) fn units(&self) -> Units<'_, L> {
        self.curve.as_ref().map_or(Units::Canonical, |curve| curve.metric.units())
    }

    /// The metric at `z` with its derivatives along the unknown, which were asked for; `None` for the canonical one.
    #[inline]
    pub(super) fn moving_metric(&self, parts: &Parts<'_, L>) -> Option<MetricAlong<'_, L>> {
        let (curve, [dz, ..]) = (self.curve.as_ref()?, self.slopes()?);
        MetricAlong::of(&curve.metric, parts.model(), (&self.z, dz))
    }

    /// The derivatives of `z`, `d` and `x'`, which were asked for; `None` on a straight line.
    #[inline]
    pub(super) fn slopes(&self) -> Option<&[Matrix<L>; 3]> {
        self.curve.as_ref().map(|curve| curve.slopes.as_ref().expect("they were asked for"))
    }

    /// The derivatives of all laws along the curve.
    fn nodes(&self, parts: &Parts<'_, L>) -> Option<Nodes> {
        let at = |t: f64| parts.along_curve((self.path, self.x, self.u), t);
        let middle = if self.path == Path::Exponential { Some(at(0.5)?) } else { None };
        Some(Nodes { ends: [at(0.0)?, at(1.0)?], middle })
    }

    /// The derivative of the base point.
    #[inline]
    pub(super) fn dz(&self) -> Turn<'_, L> {
        self.slopes().map_or(Turn::Scaled(self.c()), |[dz, ..]| Turn::By(dz))
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
                Mean { value: second.df, slope: Some(line.dz().after(second.hf)) }
            }
            GradientKind::Gonzalez => Mean { value: parts.jet(law, &line.z).1, slope: None },
            GradientKind::MeanValue => self.mean_value(with_slope),
            GradientKind::ItohAbe => self.increments(Moves::End, with_slope),
            GradientKind::SymmetricItohAbe => {
                let Mean { mut value, slope } = self.increments(Moves::End, with_slope);
                let back = self.increments(Moves::Start, with_slope);
                add(&mut value, 1.0, &back.value);
                value.numbers_mut().iter_mut().for_each(|w| *w *= 0.5);
                let slope = slope.zip(back.slope).map(|(mut slope, back)| {
                    slope.add(1.0, &back);
                    scaled(slope, 0.5)
                });
                Mean { value, slope }
            }
        }
    }

    /// The derivatives along the unknown of a function of the coordinates of the end in the chart at `z`, which stays where it is.
    fn of_end(&self, slope: Matrix<L>) -> Matrix<L> {
        let &Self { parts, line, .. } = self;
        let Some([_, _, dend]) = line.slopes() else { return slope };
        let nothing = parts.zero();
        let seen = |v: &L::Vector| parts.velocity_at(&line.z, (&line.end, &nothing), v);
        slope.product(&dend.map_columns(seen))
    }

    /// `∫₀¹ dF(φ_z(q(s))) ds` along the segment from `x` to `x'` in the chart at `z`.
    fn mean_value(&self, with_slope: bool) -> Mean<L> {
        let &Self { parts, line, .. } = self;
        let [start, end] = [line.x, &line.end].map(|y| parts.between(&line.z, y));
        let (mut value, mut slope) = (parts.zero(), with_slope.then(|| parts.zeros()));
        for (s, weight) in GAUSS {
            let q = parts.vector(|i| start[i] * (1.0 - s) + end[i] * s);
            let (df, hf) = self.within(&q, with_slope);
            add(&mut value, weight, &df);
            if let (Some(slope), Some(hf)) = (&mut slope, hf) {
                slope.add(weight * s, &hf);
            }
        }
        Mean { value, slope: slope.map(|slope| self.of_end(slope)) }
    }

    /// The differential of the law at `φ_z(q)` in the chart at `z`, and its Hessian if it is asked for.
    fn within(&self, q: &L::Vector, with_slope: bool) -> (L::Vector, Option<Matrix<L>>) {
        let &Self { parts, law, line } = self;
        if line.curve.is_some() {
            let hf = with_slope.then(|| parts.hessian_at(law, &line.z, q));
            return (parts.differential_at(law, &line.z, q), hf);
        }
        let at = parts.moved(&line.z, q);
        if with_slope {
            let Second { df, hf } = parts.second(law, &at);
            (df, Some(hf))
        } else {
            (parts.jet(law, &at).1, None)
        }
    }

    /// The coordinates of a point of the path: its entries on a vector space, those of the chart at `z` elsewhere.
    fn coordinates(&self, y: &L::State) -> L::Vector {
        if self.line.curve.is_some() {
            return self.parts.between(&self.line.z, y);
        }
        self.parts.vector(|i| y.numbers()[i])
    }

    /// The state with these coordinates.
    fn state(&self, q: &L::Vector) -> L::State {
        if self.line.curve.is_some() {
            return self.parts.moved(&self.line.z, q);
        }
        vector(self.parts.n(), |i| q[i])
    }

    /// The derivative of the law along a coordinate, and those along it and each of `others` if they are asked for.
    fn partial(&self, q: &L::Vector, i: usize) -> f64 {
        let &Self { parts, law, line } = self;
        if line.curve.is_some() {
            return parts.differential_at(law, &line.z, q)[i];
        }
        parts.along(law, &self.state(q), &axis(parts, i))[0]
    }

    /// The quotients of Itoh and Abe from the start to the end of the path, or back: one of its ends moves with the unknown.
    fn increments(&self, moves: Moves, with_slope: bool) -> Mean<L> {
        let &Self { parts, law, line } = self;
        let is_curved = line.curve.is_some();
        let n = parts.n();
        let [start, end] = match moves {
            Moves::End => [line.x, &line.end],
            Moves::Start => [&line.end, line.x],
        };
        let [start, end] = [start, end].map(|y| self.coordinates(y));
        let size_of_state = magnitude(&line.z);
        let (mut value, mut slope) = (parts.zero(), with_slope.then(|| parts.zeros()));
        let mut corner = start.clone();
        // At each corner the value, and the differential if it is asked for.
        let at = |corner: &L::Vector| {
            let y = self.state(corner);
            if with_slope && is_curved {
                let df = parts.differential_at(law, &line.z, corner);
                (parts.value(law, &y), Some(df))
            } else if with_slope {
                let (value, df) = parts.jet(law, &y);
                (value, Some(df))
            } else {
                (parts.value(law, &y), None)
            }
        };
        let mut before = at(&corner);
        for i in 0..n {
            let (from, to) = (start[i], end[i]);
            let step = to - from;
            corner[i] = from + step * 0.5;
            let middle = self.partial(&corner, i);
            corner[i] = to;
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
                    edge[i] = from + step * s;
                    mean += self.partial(&edge, i) * (weight * share);
                }
            }
            value[i] = mean;
            if let (Some(slope), Some(dafter), Some(dbefore)) = (&mut slope, &after.1, &before.1) {
                // Entries that have moved before this one are those of the end, the others those of the start.
                let others = if moves == Moves::End { 0..i } else { i + 1..n };
                let quotients = |k: usize| (1.0 - share) * ((dafter[k] - dbefore[k]) / step);
                if share < 1.0 {
                    others.clone().for_each(|k| slope[(i, k)] += quotients(k));
                    let own = match moves {
                        Moves::End => (dafter[i] - quotient) / step,
                        Moves::Start => (quotient - dbefore[i]) / step,
                    };
                    slope[(i, i)] += (1.0 - share) * own;
                }
                if share > 0.0 {
                    for (s, weight) in GAUSS {
                        edge[i] = from + step * s;
                        let fraction = if moves == Moves::End { s } else { 1.0 - s };
                        let bend = self.bends(&edge, i, others.clone());
                        for (k, bend) in others.clone().zip(&bend[1..]) {
                            slope[(i, k)] += share * weight * bend;
                        }
                        slope[(i, i)] += share * weight * fraction * bend[0];
                    }
                }
            }
            before = after;
        }
        Mean { value, slope: slope.map(|slope| self.of_end(slope)) }
    }

    /// The second derivatives of the law along the coordinate `i`, and along it and each of the `others`.
    fn bends(&self, q: &L::Vector, i: usize, others: Range<usize>) -> SmallVec<[f64; 8]> {
        let &Self { parts, law, line } = self;
        if line.curve.is_some() {
            let hf = parts.hessian_at(law, &line.z, q);
            return std::iter::once(i).chain(others).map(|k| hf[(i, k)]).collect();
        }
        let (y, e) = (self.state(q), axis(parts, i));
        let own = parts.along(law, &y, &e)[1];
        let mixed = others.map(|k| parts.mixed(law, &y, [&e, &axis(parts, k)]));
        std::iter::once(own).chain(mixed).collect()
    }

    /// The discrete gradient with `⟨w, d⟩ = F(x') − F(x)`, from the values at both ends; `None` where the path cannot be followed.
    pub(super) fn stable(
        &self,
        kind: GradientKind,
        [start, end]: [f64; 2],
        with_slope: bool,
    ) -> Option<Stable<L>> {
        let &Self { parts, line, .. } = self;
        let Mean { value: mean, slope: dmean } = self.mean(kind, with_slope);
        let (d, slope) = (line.d(), dot(&mean, line.d()));
        let change = parts.pairing_size(&mean, d);
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
            let (ends, middle) = self.nodes(kind, slope)?;
            let (better, weight) = integral(ends, middle, slope, rounding);
            defect += fraction * weight * (better - difference);
            noise *= 1.0 - fraction * weight;
        }
        Some(Stable { mean, dmean, defect, change, rounding, noise })
    }

    /// The discrete gradient of the derivative of a law along a parameter, on a vector space: of its defect what is above round-off.
    pub(super) fn above_round_off(&self, kind: GradientKind) -> L::Vector {
        let &Self { parts, law, line } = self;
        let (mut w, d) = (self.mean(kind, false).value, line.d());
        let [start, end] = [line.x, &line.end].map(|y| parts.value(law, y));
        let defect = but_round_off(end - start - dot(&w, d), end.abs() + start.abs());
        let square = dot(d, d);
        if underflows(square) {
            add(&mut w, 1.0, &along_short(defect, line));
        } else {
            add(&mut w, defect / square, d);
        }
        w
    }

    /// The first and the second derivative of the law at both ends of the path, and the first in its middle.
    fn nodes(&self, kind: GradientKind, slope: f64) -> Option<([[f64; 2]; 2], f64)> {
        let &Self { parts, law, line } = self;
        let (x, d) = (line.x, line.d());
        let nodes = match &line.curve {
            Some(curve) => Some(curve.nodes.get_or_init(|| line.nodes(parts)).as_ref()?),
            None => None,
        };
        let is_middle = (line.c() - 0.5).abs() <= 0.0;
        let middle = if is_middle && kind == GradientKind::Gonzalez {
            slope
        } else if is_middle {
            dot(&parts.jet(law, &line.z).1, d)
        } else if let Some(nodes) = nodes {
            nodes.middle.as_ref()?[law][0]
        } else {
            parts.along(law, &parts.moved(x, &parts.vector(|i| d[i] * 0.5)), d)[0]
        };
        let ends = match nodes {
            Some(nodes) => [nodes.ends[0][law], nodes.ends[1][law]],
            None => [x, &line.end].map(|y| parts.along(law, y, d)),
        };
        Some((ends, middle))
    }
}

/// The vector along a coordinate.
fn axis<L: Lengths>(parts: &Parts<'_, L>, k: usize) -> L::Vector {
    parts.vector(|i| if i == k { 1.0 } else { 0.0 })
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
    pub(super) fn covector(&self, drift_correction: f64, line: &Line<'_, L>) -> L::Vector {
        let (flat, square) = (line.flat(), dot(line.flat(), line.d()));
        let mut w = self.mean.clone();
        if underflows(square) {
            add(&mut w, 1.0, &along_short(self.defect + drift_correction, line));
        } else {
            add(&mut w, (self.defect + drift_correction) / square, flat);
        }
        w
    }

    /// The round-off of each component of the covector, beside that of its mean.
    pub(super) fn noise(&self, line: &Line<'_, L>) -> L::Vector {
        let (flat, square) = (line.flat(), dot(line.flat(), line.d()));
        let n = flat.numbers().len();
        if underflows(square) {
            // The defect has underflowed.
            let noise = self.noise + f64::EPSILON * f64::MIN_POSITIVE * 16.0;
            let w = along_short(noise, line);
            return vector(n, |i| w[i].abs());
        }
        let noise = self.noise / square;
        vector(n, |i| flat[i].abs() * noise)
    }

    /// The derivative of the covector along the displacement, from the differential at `x'`. It is the Jacobian of Newton's
    /// method: the derivative of the defect counts as far as it is above round-off.
    pub(super) fn slope(
        self,
        drift_correction: f64,
        along: &MovingLine<'_, L>,
        df_end: &L::Vector,
    ) -> Slope<L> {
        let trust = trust(self.change, self.rounding);
        let defect = self.defect + drift_correction;
        self.corrected(defect, along, df_end, |row, _| row * trust)
    }

    /// The derivative of the covector as in [`slope`](Self::slope), for the derivative of a step: numbers that are divided by its length,
    /// the defect and its derivatives, are zero where they are round-off. They are of second order in this length.
    pub(super) fn slope_above_round_off(
        self,
        along: &MovingLine<'_, L>,
        df_end: &L::Vector,
    ) -> Slope<L> {
        // The defect is an integral and a part of a difference, whose round-off is rounded once more where the integral replaces it.
        let size = SUMMED * (self.change.abs() + self.rounding) + self.noise;
        let defect = if self.defect.abs() <= size { 0.0 } else { self.defect };
        self.corrected(defect, along, df_end, |row, terms| but_round_off(row, terms()))
    }

    /// The derivative of `w̄ + ♭d δ/G(d, d)`, from the defect `δ` and a function of its derivatives and of the sizes of their terms.
    #[inline]
    fn corrected(
        self,
        defect: f64,
        &MovingLine { line, metric }: &MovingLine<'_, L>,
        df_end: &L::Vector,
        above: impl Fn(f64, &dyn Fn() -> f64) -> f64,
    ) -> Slope<L> {
        let Self { mean, dmean, .. } = self;
        let mut slope = dmean.expect("the derivatives were asked for");
        let (d, flat) = (line.d(), line.flat());
        let square = dot(flat, d);
        if underflows(square) {
            return Slope { matrix: slope, apart: None };
        }
        let n = d.numbers().len();
        let (bent, sizes) = (slope.transpose_times(d), &slope);
        let c = defect / square;
        let reciprocal = square.recip();
        let bent_terms = |i: usize| (0..n).map(|k| (sizes[(k, i)] * d[k]).abs()).sum::<f64>();
        let Some([_, dd, dend]) = line.slopes() else {
            let along: L::Vector = vector(n, |i| {
                let terms = || bent_terms(i) + df_end[i].abs() + mean[i].abs();
                let row = above(df_end[i] - mean[i] - bent[i], &terms);
                (row - d[i] * (2.0 * c)) * reciprocal
            });
            if n > FEW {
                (0..n).for_each(|i| slope[(i, i)] += c);
                let base = slope.clone();
                slope.add_outer(1.0, d, &along);
                let apart = Apart { base, column: d.clone(), row: along };
                return Slope { matrix: slope, apart: Some(Box::new(apart)) };
            }
            slope.add_outer(1.0, d, &along);
            slope.add(c, &Matrix::scaled_one(n, 1.0));
            return Slope { matrix: slope, apart: None };
        };
        // ∂g along z, in ♭d and in G(d, d).
        let of_metric = metric.map(|metric| metric.of_flat(d));
        let (of_end, of_mean) = (dend.transpose_times(df_end), dd.transpose_times(&mean));
        let stretched = dd.transpose_times(flat);
        let of_flat = of_metric.as_ref().map(|dg| dg.transpose_times(d));
        let along: L::Vector = vector(n, |i| {
            let sum = |a: &Matrix<L>, v: &L::Vector| {
                (0..n).map(|k| (a[(k, i)] * v[k]).abs()).sum::<f64>()
            };
            let terms = || bent_terms(i) + sum(dend, df_end) + sum(dd, &mean);
            let row = above(of_end[i] - of_mean[i] - bent[i], &terms);
            let turned = of_flat.as_ref().map_or(0.0, |of_flat| of_flat[i]);
            (row - (stretched[i] * 2.0 + turned) * c) * reciprocal
        });
        slope.add_outer(1.0, flat, &along);
        if let Some(of_metric) = &of_metric {
            slope.add(c, of_metric);
        }
        slope.add(c, &dd.map_columns(|column| line.units().flat(column)));
        Slope { matrix: slope, apart: None }
    }
}

/// The derivative of a discrete gradient along the displacement, with its summands if they are known apart.
pub(super) struct Slope<L: Lengths> {
    pub(super) matrix: Matrix<L>,
    pub(super) apart: Option<Box<Apart<L>>>,
}

/// A path with its derivatives, and the metric at its base with those along the unknown, if it is not the canonical one.
pub(super) struct MovingLine<'a, L: Lengths> {
    pub(super) line: &'a Line<'a, L>,
    pub(super) metric: Option<&'a MetricAlong<'a, L>>,
}

/// `♭d defect/G(d, d)` on a path so short that its squared length leaves the range of numbers, in units of a power of two near that
/// length; zero on a path without length.
#[cold]
fn along_short<L: Lengths>(defect: f64, line: &Line<'_, L>) -> L::Vector {
    let d = line.d();
    let (n, unit) = (d.numbers().len(), power_of_two(magnitude(d)));
    let flat: L::Vector = line.units().flat(&vector(n, |i| d[i] / unit));
    let square = dot(&flat, d) / unit;
    let factor = if square > 0.0 { defect / unit / square } else { 0.0 };
    vector(n, |i| flat[i] * factor)
}
