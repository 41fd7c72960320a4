//! The paths of steps: a straight line on a vector space, a curve of a retraction elsewhere.

use crate::room::with_numbers;
use crate::{Equations, MetricError, Model};

/// The retraction of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    /// The geodesic from `x`, with its base there.
    Exponential,
    /// The geodesic from `x`, with its base in the middle.
    Weyl,
    /// The straight line of the chart at `x`, with its base in the middle.
    Chart,
}

impl Path {
    /// Returns where the base is, as a fraction of the way.
    #[must_use]
    pub const fn base(self) -> f64 {
        match self {
            Self::Exponential => 0.0,
            Self::Weyl | Self::Chart => 0.5,
        }
    }
}

/// The path of a step with the unknown `u`: its base, its displacement there, and its end.
#[derive(Debug)]
pub struct PathAt<'a> {
    /// The base `z`.
    pub z: &'a mut [f64],
    /// The displacement `d` in the chart at `z`.
    pub d: &'a mut [f64],
    /// The end `x'`.
    pub end: &'a mut [f64],
}

/// The derivatives of a path along its unknown, matrices of `n × n` numbers.
#[derive(Debug)]
pub struct PathSlopes<'a> {
    /// `∂z/∂u` in the chart at `z`.
    pub dz: &'a mut [f64],
    /// `∂d/∂u` in the chart at `z`, which does not move.
    pub dd: &'a mut [f64],
    /// `∂x'/∂u` in the chart at `x'`.
    pub dend: &'a mut [f64],
}

/// The paths of steps on a space with its charts and its metric. Displacements and velocities at a state are in the frame of
/// the chart there.
///
/// Laws ([`laws::paths`](crate::laws::paths)): 1. the unknown zero stays at `x`; 2. the slopes are the derivatives of the path; 3. a
/// curve starts at `x` with the velocity `u` and ends where its path does, and its acceleration is the derivative of its velocity.
pub trait Paths {
    /// Returns whether there are paths of a retraction.
    fn follows(&self, path: Path) -> bool;

    /// Follows the path of the unknown `u` from `x`.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if it cannot be followed.
    fn path(
        &self,
        path: Path,
        x: &[f64],
        u: &[f64],
        to: &mut PathAt<'_>,
    ) -> Result<(), MetricError>;

    /// Follows the same path with its derivatives.
    ///
    /// # Errors
    ///
    /// The errors of [`path`](Self::path).
    fn path_jet(
        &self,
        path: Path,
        x: &[f64],
        u: &[f64],
        to: (&mut PathAt<'_>, &mut PathSlopes<'_>),
    ) -> Result<(), MetricError>;

    /// Computes the end of the same path, in closed form where there is one. The default follows the path.
    ///
    /// # Errors
    ///
    /// The errors of [`path`](Self::path).
    fn end(&self, path: Path, x: &[f64], u: &[f64], end: &mut [f64]) -> Result<(), MetricError> {
        let (entries, n) = (x.len(), u.len());
        with_numbers(entries + n, |room| {
            let (z, d) = room.split_at_mut(entries);
            self.path(path, x, u, &mut PathAt { z, d, end })
        })
    }

    /// Follows the curve of the same path from `x` for a fraction `t` of the way, to the point `y`, with its velocity `v` and its
    /// acceleration `a` in the chart there.
    ///
    /// # Errors
    ///
    /// The errors of [`path`](Self::path).
    fn curve(
        &self,
        path: Path,
        start: (&[f64], &[f64], f64),
        y: &mut [f64],
        to: [&mut [f64]; 2],
    ) -> Result<(), MetricError>;

    /// Computes the rounding error of the displacement `u` on the way from `x` to the `end` of its path; zero where it is not
    /// known.
    fn lost_digits(&self, path: Path, x: &[f64], u: &[f64], end: &[f64], lost: &mut [f64]) {
        let _ = (path, x, u, end);
        lost.fill(0.0);
    }

    /// Returns the relative accuracy of the ends of paths. The default is that of a closed form, a few roundings.
    fn accuracy(&self, path: Path) -> f64 {
        let _ = path;
        4.0 * f64::EPSILON
    }

    /// Computes the velocity at `φ_x(q)` with the components `v` in the chart at `x`, in the chart at `y`:
    /// `d/dε φ_y⁻¹(φ_x(q + εv))`.
    fn velocity_at(&self, y: &[f64], x: &[f64], q: &[f64], v: &[f64], to: &mut [f64]);

    /// Computes the velocities of all directions in this way, the derivative of `φ_y⁻¹ ∘ φ_x` at `q`, one column after another.
    fn turn_all(&self, y: &[f64], x: &[f64], q: &[f64], columns: &mut [f64]) {
        let n = q.len();
        with_numbers(n, |axis| {
            for (k, column) in columns.chunks_exact_mut(n.max(1)).enumerate() {
                axis.fill(0.0);
                axis[k] = 1.0;
                self.velocity_at(y, x, q, axis, column);
            }
        });
    }

    /// Carries vectors, one after another, from `x` to a state `y` near by. Only guesses use it.
    fn transport(&self, x: &[f64], y: &[f64], vectors: &mut [f64]) {
        let _ = (x, y, vectors);
    }

    /// Returns the size of the terms of the slope `⟨w, v⟩`, at a state. The default is that of a frame of no meaning, `|w||v|`.
    fn pairing_size(&self, w: &[f64], v: &[f64]) -> f64 {
        let square = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
        square(w).sqrt() * square(v).sqrt()
    }
}

/// Answers the questions of [`Paths`] by other paths, of which the method `$with` takes a closure.
#[doc(hidden)]
#[macro_export]
macro_rules! follows_paths {
    ($(#[$doc:meta])* [$($generics:tt)*] $type:ty: $with:ident) => {
        $(#[$doc])*
        impl<$($generics)*> $crate::Paths for $type {
            fn follows(&self, path: $crate::Path) -> bool {
                self.$with(|paths| paths.follows(path))
            }

            fn path(
                &self,
                path: $crate::Path,
                x: &[f64],
                u: &[f64],
                to: &mut $crate::PathAt<'_>,
            ) -> Result<(), $crate::MetricError> {
                self.$with(|paths| paths.path(path, x, u, to))
            }

            fn path_jet(
                &self,
                path: $crate::Path,
                x: &[f64],
                u: &[f64],
                to: (&mut $crate::PathAt<'_>, &mut $crate::PathSlopes<'_>),
            ) -> Result<(), $crate::MetricError> {
                self.$with(|paths| paths.path_jet(path, x, u, to))
            }

            fn end(
                &self,
                path: $crate::Path,
                x: &[f64],
                u: &[f64],
                end: &mut [f64],
            ) -> Result<(), $crate::MetricError> {
                self.$with(|paths| paths.end(path, x, u, end))
            }

            fn curve(
                &self,
                path: $crate::Path,
                start: (&[f64], &[f64], f64),
                y: &mut [f64],
                to: [&mut [f64]; 2],
            ) -> Result<(), $crate::MetricError> {
                self.$with(|paths| paths.curve(path, start, y, to))
            }

            fn lost_digits(
                &self,
                path: $crate::Path,
                x: &[f64],
                u: &[f64],
                end: &[f64],
                lost: &mut [f64],
            ) {
                self.$with(|paths| paths.lost_digits(path, x, u, end, lost));
            }

            fn accuracy(&self, path: $crate::Path) -> f64 {
                self.$with(|paths| paths.accuracy(path))
            }

            fn velocity_at(&self, y: &[f64], x: &[f64], q: &[f64], v: &[f64], to: &mut [f64]) {
                self.$with(|paths| paths.velocity_at(y, x, q, v, to));
            }

            fn turn_all(&self, y: &[f64], x: &[f64], q: &[f64], columns: &mut [f64]) {
                self.$with(|paths| paths.turn_all(y, x, q, columns));
            }

            fn transport(&self, x: &[f64], y: &[f64], vectors: &mut [f64]) {
                self.$with(|paths| paths.transport(x, y, vectors));
            }

            fn pairing_size(&self, w: &[f64], v: &[f64]) -> f64 {
                self.$with(|paths| paths.pairing_size(w, v))
            }
        }
    };
}

/// The lines of the charts of a model, `t ↦ φ_x(tu)`, with derivatives by differences.
///
/// A displacement `d` has some twelve digits then. Both laws hold with any `d`; Newton's method converges as it does with
/// derivatives of these digits.
#[allow(missing_debug_implementations, reason = "a model has none")]
#[derive(Clone, Copy)]
pub struct ByCharts<'a>(pub &'a dyn Model);

/// The length of a difference of the fourth order, relative to the size of an entry: its error `h⁴` is as large as the
/// round-off `ε/h`.
/// A factor of four fails `paths.rs::charts_have_the_paths_of_their_space`.
const LENGTH: f64 = 1e-3;

/// How far an entry of a midpoint may be, relative to its way, from where the chart at the start sees it; another such fraction of
/// the largest entry is round-off. A way around the space is off by as much as the way.
/// A factor of four is nowhere near either.
const SEEN: f64 = 1e-6;

/// The fraction of a vector that changes no entry by more than [`LENGTH`] of its size at `x`, or of the way from there. An entry
/// that is near zero has the size of the way.
fn fraction(system: &(impl Equations + ?Sized), x: &[f64], ways: [&[f64]; 2], v: &[f64]) -> f64 {
    with_numbers(v.len(), |sizes| {
        system.scales(x, sizes);
        let mut most = 0.0_f64;
        for (i, size) in sizes.iter().enumerate() {
            let size = ways.iter().map(|way| way[i].abs()).fold(*size, f64::max);
            if size > 0.0 {
                most = most.max((v[i] / size).abs());
            }
        }
        if most > 0.0 && most.is_finite() { LENGTH / most } else { LENGTH }
    })
}

/// The derivative at zero of a function of the fraction of a vector, by a difference of this length.
fn derivative(h: f64, mut f: impl FnMut(f64, &mut [f64]), to: &mut [f64]) {
    to.fill(0.0);
    with_numbers(to.len(), |value| {
        for (fraction, weight) in [(1.0, 8.0), (-1.0, -8.0), (2.0, -1.0), (-2.0, 1.0)] {
            f(fraction * h, value);
            to.iter_mut().zip(&*value).for_each(|(to, value)| *to += weight * value);
        }
    });
    to.iter_mut().for_each(|to| *to /= 12.0 * h);
}

/// The rates at `y = ψ_x(q)` of the velocity `v` there, `d/ds ψ_x⁻¹(φ_y(sv))`; those of charts that are translations are `v`.
pub(crate) fn rates(
    system: &(impl Equations + ?Sized),
    [x, q, y, v]: [&[f64]; 4],
    rates: &mut [f64],
) {
    let is_sum = |y: &[f64], x: &[f64], q: &[f64]| {
        let mut sums = x.iter().zip(q).map(|(x, q)| x + q).zip(y);
        x.len() == q.len() && sums.all(|(sum, y)| sum.to_bits() == y.to_bits())
    };
    with_numbers(y.len() + v.len(), |room| {
        let (there, part) = room.split_at_mut(y.len());
        system.chart(y, v, there);
        if is_sum(y, x, q) && is_sum(there, y, v) {
            return rates.copy_from_slice(v);
        }
        let h = fraction(system, y, [q, q], v);
        let along = |s: f64, to: &mut [f64]| {
            part.iter_mut().zip(v).for_each(|(part, v)| *part = s * v);
            system.chart(y, part, there);
            system.stage_coordinates(x, there, to);
        };
        derivative(h, along, rates);
    });
}

impl ByCharts<'_> {
    /// Refuses a way whose middle `z` the chart at the start does not see in the middle: it leads beyond the chart.
    fn reached(&self, x: &[f64], half: &[f64], z: &[f64]) -> Result<(), MetricError> {
        if self.0.is_vector_space() {
            return Ok(());
        }
        with_numbers(2 * half.len(), |room| {
            let (seen, sizes) = room.split_at_mut(half.len());
            let is_near = self.0.coordinates(x, z, seen);
            self.0.scales(x, sizes);
            let largest =
                [&*sizes, half, x].concat().iter().fold(0.0_f64, |most, v| most.max(v.abs()));
            let in_the_middle = seen.iter().zip(half).all(|(seen, half)| {
                (seen - half).abs() <= SEEN * (seen.abs().max(half.abs()) + SEEN * largest)
            });
            if is_near && in_the_middle {
                return Ok(());
            }
            let distance = 2.0 * half.iter().map(|half| half * half).sum::<f64>().sqrt();
            Err(MetricError::OutOfChart { distance })
        })
    }

    /// `φ_y⁻¹(φ_x(q + sv))`.
    fn seen_from(&self, y: &[f64], x: &[f64], q: &[f64], v: &[f64], s: f64, to: &mut [f64]) {
        let n = q.len();
        with_numbers(n + x.len(), |room| {
            let (at, point) = room.split_at_mut(n);
            at.copy_from_slice(q);
            at.iter_mut().zip(v).for_each(|(at, v)| *at += s * v);
            self.0.chart(x, at, point);
            let _ = self.0.coordinates(y, point, to);
        });
    }

    /// A derivative of [`velocity_at`](Paths::velocity_at), along a change `p` of `q` and a change `r` of `v`, with the whole way.
    fn bend(
        &self,
        y: &[f64],
        (x, q, v): (&[f64], &[f64], &[f64]),
        [p, r]: [&[f64]; 2],
        way: &[f64],
        to: &mut [f64],
    ) {
        let n = q.len();
        let along = |s: f64, to: &mut [f64]| {
            with_numbers(2 * n, |room| {
                let (at, turned) = room.split_at_mut(n);
                for i in 0..n {
                    at[i] = q[i] + s * p[i];
                    turned[i] = v[i] + s * r[i];
                }
                self.velocity_at(y, x, at, turned, to);
            });
        };
        derivative(fraction(self.0, x, [q, way], p), along, to);
    }
}

/// Refuses a displacement whose numbers are not finite.
fn finite(d: &[f64]) -> Result<(), MetricError> {
    let quantity = "a displacement in a chart";
    let bad = d.iter().find(|d| !d.is_finite());
    bad.map_or(Ok(()), |&value| Err(MetricError::NotFinite { quantity, value }))
}

impl Paths for ByCharts<'_> {
    fn follows(&self, path: Path) -> bool {
        path == Path::Chart
    }

    fn path(&self, _: Path, x: &[f64], u: &[f64], to: &mut PathAt<'_>) -> Result<(), MetricError> {
        with_numbers(u.len(), |half| {
            half.iter_mut().zip(u).for_each(|(half, u)| *half = 0.5 * u);
            self.0.chart(x, half, to.z);
            self.reached(x, half, to.z)?;
            self.velocity_at(to.z, x, half, u, to.d);
            Ok::<(), MetricError>(())
        })?;
        self.0.chart(x, u, to.end);
        finite(to.d)
    }

    fn path_jet(
        &self,
        path: Path,
        x: &[f64],
        u: &[f64],
        (to, slopes): (&mut PathAt<'_>, &mut PathSlopes<'_>),
    ) -> Result<(), MetricError> {
        self.path(path, x, u, to)?;
        let n = u.len();
        with_numbers(5 * n, |room| {
            let (half, room) = room.split_at_mut(n);
            let (axis, room) = room.split_at_mut(n);
            let (middle, room) = room.split_at_mut(n);
            let (turned, end) = room.split_at_mut(n);
            half.iter_mut().zip(u).for_each(|(half, u)| *half = 0.5 * u);
            for k in 0..n {
                axis.fill(0.0);
                axis[k] = 0.5;
                self.velocity_at(to.z, x, half, axis, middle);
                with_numbers(n, |one| {
                    one[k] = 1.0;
                    self.bend(to.z, (x, half, u), [axis, one], u, turned);
                    self.velocity_at(to.end, x, u, one, end);
                });
                for i in 0..n {
                    slopes.dz[i * n + k] = middle[i];
                    slopes.dd[i * n + k] = turned[i];
                    slopes.dend[i * n + k] = end[i];
                }
            }
        });
        Ok(())
    }

    fn curve(
        &self,
        _: Path,
        (x, u, t): (&[f64], &[f64], f64),
        y: &mut [f64],
        [v, a]: [&mut [f64]; 2],
    ) -> Result<(), MetricError> {
        let n = u.len();
        with_numbers(2 * n, |room| {
            let (q, nothing) = room.split_at_mut(n);
            q.iter_mut().zip(u).for_each(|(q, u)| *q = t * u);
            self.0.chart(x, q, y);
            self.velocity_at(y, x, q, u, v);
            self.bend(y, (x, q, u), [u, nothing], u, a);
        });
        finite(v)
    }

    fn velocity_at(&self, y: &[f64], x: &[f64], q: &[f64], v: &[f64], to: &mut [f64]) {
        let stays = || q.iter().all(|q| *q == 0.0) && x == y;
        if self.0.is_vector_space() || stays() {
            return to.copy_from_slice(v);
        }
        // The way from `y`.
        let nothing = [0.0; 0];
        with_numbers(q.len(), |back| {
            self.seen_from(y, x, q, &nothing, 0.0, back);
            let h = fraction(self.0, x, [q, back], v);
            derivative(h, |s, to| self.seen_from(y, x, q, v, s, to), to);
        });
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use crate::{Apart, Covectors, Differences, ENERGY, Part, Sizes};

    /// Angles with an entry beside, in charts `φ_x(q) = x + 2 atan(q/2)`, of which one sees another within half a turn.
    #[derive(Default)]
    struct Turns {
        /// Else they are `φ_x(q) = x + q` on a circle.
        is_stretched: bool,
        /// How often it was asked for differentials.
        asked: Cell<usize>,
    }

    impl Turns {
        fn stretched() -> Self {
            Self { is_stretched: true, ..Self::default() }
        }
    }

    impl Equations for Turns {
        fn sizes(&self) -> Sizes {
            Sizes { entries: 2, directions: 2, laws: 2 }
        }

        fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
            values.copy_from_slice(&[x[0], 0.0]);
        }

        fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
            self.asked.set(self.asked.get() + 1);
            self.values(t, x, values);
            w.copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
        }

        fn velocity(&self, _: f64, _: &[f64], v: &mut [f64]) -> Option<f64> {
            v.fill(0.0);
            Some(0.0)
        }

        fn scales(&self, x: &[f64], sizes: &mut [f64]) {
            sizes.copy_from_slice(&[1.0, x[1].abs()]);
        }

        fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
            y[0] = x[0] + if self.is_stretched { 2.0 * (0.5 * q[0]).atan() } else { q[0] };
            y[1] = x[1] + q[1];
        }

        fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool {
            let turn = std::f64::consts::TAU;
            let way = y[0] - x[0];
            let short = way - turn * (way / turn).round();
            q[0] = if self.is_stretched { 2.0 * (0.5 * short).tan() } else { short };
            q[1] = y[1] - x[1];
            true
        }
    }

    impl Apart for Turns {
        fn is_zero(&self, _: Part) -> bool {
            true
        }

        fn apply(&self, _: Part, _: f64, _: &[f64], _: Covectors<'_>, _: &[f64], v: &mut [f64]) {
            v.fill(0.0);
        }

        fn has_charts(&self) -> bool {
            true
        }
    }

    #[test]
    fn charts_have_the_paths_of_their_space() {
        let model = Differences(Turns::stretched());
        let (paths, x) = (ByCharts(&model), [0.4, 1.0]);
        let mut worst = 0.0_f64;
        for k in 1..=40 {
            let ([mut z, mut d, mut end], u) = ([[0.0; 2]; 3], [0.05 * f64::from(k), 0.0]);
            let to = &mut PathAt { z: &mut z, d: &mut d, end: &mut end };
            paths.path(Path::Chart, &x, &u, to).unwrap();
            // The velocity u of q at u/2, and θ' = q'/(1 + q²/4).
            let exact = u[0] / (1.0 + u[0] * u[0] / 16.0);
            worst = worst.max((d[0] - exact).abs() / exact);
            crate::laws::paths(&model, &paths, Path::Chart, &x, &u).unwrap();
        }
        assert!(worst < 4e-13, "{worst:.1e}");
        assert!(!paths.follows(Path::Weyl));
    }

    #[test]
    fn the_acceleration_of_a_curve_costs_one_differential() {
        let model = Differences(Turns::stretched());
        let (paths, x, u) = (ByCharts(&model), [0.4, 1.0], [0.7, 0.1]);
        let asked = |f: &mut dyn FnMut()| {
            let before = model.0.asked.get();
            f();
            model.0.asked.get() - before
        };
        let [mut y, mut v, mut a] = [[0.0; 2]; 3];
        let start = (&x[..], &u[..], 0.5);
        paths.curve(Path::Chart, start, &mut y, [&mut v, &mut a]).unwrap();
        assert!(a[0].abs() > 1e-3, "{a:?}");
        let velocity = asked(&mut || {
            model.along(ENERGY, 0.0, &y, [&v, &v]);
        });
        let mut law = [[0.0; 2]];
        let both = asked(&mut || {
            model.along_curve(0.0, (&paths, Path::Chart), start, &mut law).unwrap();
        });
        assert!(both <= velocity + 1 && velocity > 2, "{both} and {velocity}");
        // The energy is the angle.
        assert!((law[0][0] - v[0]).abs() + (law[0][1] - a[0]).abs() < 1e-9, "{law:?}");
    }

    #[test]
    fn a_displacement_keeps_its_digits_where_an_entry_passes_zero() {
        let model = Differences(Turns::stretched());
        let paths = ByCharts(&model);
        for small in [0.2, 1e-4, 1e-9, -1e-12, 1e-16, 1e-300, 0.0] {
            let (x, u) = ([0.4, small], [0.7, 0.01]);
            let [mut z, mut d, mut end] = [[0.0; 2]; 3];
            let to = &mut PathAt { z: &mut z, d: &mut d, end: &mut end };
            paths.path(Path::Chart, &x, &u, to).unwrap();
            let exact = u[0] / (1.0 + u[0] * u[0] / 16.0);
            assert!((d[0] - exact).abs() < 4e-13 && (d[1] - u[1]).abs() < 4e-15, "{small}: {d:?}");
            crate::laws::paths(&model, &paths, Path::Chart, &x, &u).unwrap();
        }
    }

    #[test]
    fn a_way_around_the_space_is_beyond_the_chart() {
        let model = Differences(Turns::default());
        let follow = |u: f64| {
            let [mut z, mut d, mut end] = [[0.0; 2]; 3];
            let to = &mut PathAt { z: &mut z, d: &mut d, end: &mut end };
            ByCharts(&model).path(Path::Chart, &[0.4, 1e11], &[u, 1e11], to)
        };
        // Its middle is less than half a turn away, and more.
        assert_eq!([6.0, -6.0].map(|u| follow(u).is_ok()), [true; 2]);
        for u in [7.0, -7.0, 13.0, 20.0] {
            let refused = follow(u).unwrap_err();
            assert!(matches!(refused, MetricError::OutOfChart { .. }), "{u}: {refused}");
        }
    }
}
