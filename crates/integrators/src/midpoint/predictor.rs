//! The guess of a displacement.

use metriplectic_dynamics::Metriplectic;
use metriplectic_dynamics::system::Point;
use metriplectic_fields::{ChartPoint, Column, Dimension, Space as _, Vector};
use metriplectic_manifolds::Manifold;

use crate::step::{Dim, FARTHEST, Start};

/// The displacements of the steps before, from which the next one is extrapolated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Predictor<N: Dimension> {
    /// The backward differences `∇ʲd` of the displacements, as far as they are `known`.
    pub(crate) differences: [N::Vector<f64>; DIFFERENCES],
    pub(crate) known: usize,
}

/// Displacements that are remembered.
pub(crate) const DIFFERENCES: usize = 8;
/// The order from which on a difference has to fall well below the one before to count.
/// A factor of four fails `midpoint/predictor.rs::a_high_difference_counts_where_it_falls_well_below_the_one_before`.
pub(crate) const LOW: usize = 4;
/// The fraction of the squared difference before it that its own square may be: `1/4²`. Round-off grows by a factor
/// of two from one order to the next.
/// A factor of four fails `midpoint/predictor.rs::a_high_difference_counts_where_it_falls_well_below_the_one_before`.
pub(crate) const FALLS: f64 = 0.0625;

impl<N: Dimension> Default for Predictor<N> {
    fn default() -> Self {
        Self { differences: [N::Vector::<f64>::zero(); DIFFERENCES], known: 0 }
    }
}

impl<N: Dimension> Predictor<N> {
    /// The displacement of a step: extrapolated, else that of explicit Euler, else rest.
    #[inline]
    pub(super) fn guess<Y>(&self, system: &Y, start: &Start<'_, Y>) -> Vector<Y::Manifold>
    where
        Y: Metriplectic,
        Y::Manifold: Manifold<Dim = N>,
    {
        let guess = self.extrapolate().or_else(|| explicit(system, start));
        guess.unwrap_or_else(Vector::<Y::Manifold>::zero)
    }

    /// The next displacement `Σ_{j<k} ∇ʲd`, on the polynomial through the last `k` of them; `k` is the
    /// one that would have been best for the last step, where it was wrong by `∇ᵏd`. A higher difference than the
    /// third counts only if it falls well below the one before, which round-off does not.
    #[inline]
    fn extrapolate(&self) -> Option<N::Vector<f64>> {
        if self.known < 2 {
            return None;
        }
        let (last, differences) = self.differences[..self.known].split_first()?;
        let (mut best, mut smallest) = (1, f64::INFINITY);
        for (difference, k) in differences.iter().zip(1..) {
            let size = difference.dot(difference);
            if k >= LOW && (best + 1 < k || size > FALLS * smallest) {
                break;
            }
            if size < smallest {
                (best, smallest) = (k, size);
            }
        }
        // Where the last difference is the smallest, it is the next one that counts.
        if best + 1 == self.known || best + 1 >= LOW {
            best += 1;
        }
        Some(differences.iter().take(best - 1).fold(*last, |sum, difference| sum + *difference))
    }

    /// Notes the displacement `d` of the step from `x` to `end`.
    #[inline]
    pub(super) fn note<M: Manifold<Dim = N>>(
        &mut self,
        x: &M::Point<f64>,
        d: &N::Vector<f64>,
        end: &M::Point<f64>,
    ) {
        let mut difference = *d;
        for last in &mut self.differences {
            let next = difference - *last;
            *last = difference;
            difference = next;
        }
        M::transport_all(x, end, &mut self.differences);
        self.known = DIFFERENCES.min(self.known + 1);
    }

    /// Rescales the displacements to steps of another size: with the parabola `D(s)` through the last
    /// three, where `s` counts the steps from the middle of the last one, those of a step `ρ` times
    /// as long are `ρ D(½ − ρ/2)`, `ρ D(½ − 3ρ/2)` and `ρ D(½ − 5ρ/2)`, each with `ρ(ρ² − 1)D''/24`
    /// for the shorter mean: exact where the state is a cubic of the time.
    pub(super) fn rescaled(&self, ratio: f64) -> Self {
        if ratio.to_bits() == 1.0_f64.to_bits() {
            return *self;
        }
        if ratio > FARTHEST {
            return Self::default();
        }
        // Far from the three points their parabola says nothing.
        let known = if ratio > 2.0 { self.known.min(1) } else { self.known.min(3) };
        let difference = |j| if j < known { self.differences[j] } else { N::Vector::<f64>::zero() };
        let (d, slope, bend) = (difference(0), difference(1), difference(2));
        let mean = d + bend * ((ratio * ratio - 1.0) / 24.0);
        let at = |k: f64| {
            let s = 0.5 - (k + 0.5) * ratio;
            (mean + slope * s + bend * (0.5 * s * (s + 1.0))) * ratio
        };
        let (a, b, c) = (at(0.0), at(1.0), at(2.0));
        let mut rescaled = Self { known: if ratio > 2.0 { 2 * known } else { known }, ..*self };
        rescaled.differences[..3].copy_from_slice(&[a, a - b, a - b * 2.0 + c]);
        rescaled
    }
}

/// The explicit Euler displacement `h (Π dH + K dS)(x)`. An entry that it hardly moves gets that of the velocity at half of it.
///
/// Without it a position that starts from rest has no displacement beside that of its momentum, which may have a unit so small that a
/// discrete gradient along it is round-off: Newton's method then ends anywhere.
fn explicit<Y: Metriplectic>(system: &Y, start: &Start<'_, Y>) -> Option<Vector<Y::Manifold>> {
    let displacement = |x: &Point<Y>| {
        let velocity = system.velocity(&ChartPoint::<Y::Manifold>::centre(x)).ok()?;
        let displacement = velocity * start.h;
        displacement.is_finite().then_some(displacement)
    };
    let (u, sizes) = (displacement(start.x)?, Y::Manifold::scales(start.x));
    // The round-off of an energy ε H, over the square of such a displacement, is as large as its second derivative.
    let rests = |i: usize| sizes[i] > 0.0 && u[i].abs() <= f64::EPSILON.sqrt() * sizes[i];
    if !(0..Dim::<Y>::LEN).any(rests) {
        return Some(u);
    }
    let Some(later) = displacement(&Y::Manifold::chart(start.x, &(u * 0.5))) else {
        return Some(u);
    };
    // A stiff entry would move by more than its size.
    let moves = |i: usize| rests(i) && later[i].abs() <= sizes[i];
    Some(Vector::<Y::Manifold>::from_index(|i| if moves(i) { later[i] } else { u[i] }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Const, Vector1};

    #[test]
    fn displacements_of_a_cubic_are_those_of_every_step_size() {
        type Line = Predictor<Const<1>>;
        // The last `n` steps of size `h` along x(t), up to t = 0.
        let memory = |x: &dyn Fn(f64) -> f64, h: f64, n: usize| {
            let step = |k: f64| x(-k * h) - x(-(k + 1.0) * h);
            let [a, b, c] = [0.0, 1.0, 2.0].map(step);
            let mut memory = Line { known: n, ..Line::default() };
            for (slot, d) in memory.differences.iter_mut().zip([a, a - b, a - b * 2.0 + c]).take(n)
            {
                *slot = Vector1::new(d);
            }
            memory
        };
        let close = |a: &Line, b: &Line| {
            assert_eq!(a.known, b.known);
            for (a, b) in a.differences.iter().zip(&b.differences).take(a.known) {
                assert!((a - b).norm() < 1e-15, "{a} for {b}");
            }
        };
        let cubic = |t: f64| 0.3 * t - 0.7 * t * t + 0.2 * t * t * t;
        for ratio in [0.2, 0.7, 1.0, 1.3, 2.0] {
            close(&memory(&cubic, 0.1, 3).rescaled(ratio), &memory(&cubic, 0.1 * ratio, 3));
        }
        // Two displacements make a line, one a constant.
        let parabola = |t: f64| 0.3 * t - 0.7 * t * t;
        close(&memory(&parabola, 0.1, 2).rescaled(0.5), &memory(&parabola, 0.05, 2));
        let line = |t: f64| 0.3 * t;
        close(&memory(&line, 0.1, 1).rescaled(0.5), &memory(&line, 0.05, 1));
        close(&memory(&line, 0.1, 3).rescaled(3.0), &memory(&line, 0.3, 2));
    }

    #[test]
    fn nothing_is_extrapolated_to_a_far_longer_step() {
        let memory = Predictor::<Const<1>> { known: 3, ..Default::default() };
        assert!(memory.rescaled(12.0).known > 0 && memory.rescaled(20.0).known == 0);
    }

    #[test]
    fn a_high_difference_counts_where_it_falls_well_below_the_one_before() {
        // A displacement of 10 and its differences; the extrapolated displacement less 10.
        let added = |differences: &[f64]| {
            let known = differences.len() + 1;
            let mut memory = Predictor::<Const<1>> { known, ..Default::default() };
            for (slot, d) in
                memory.differences.iter_mut().zip([&10.0].into_iter().chain(differences))
            {
                *slot = Vector1::new(*d);
            }
            memory.extrapolate().map(|d| d.x - 10.0).unwrap()
        };
        let is = |differences: &[f64], sum: f64| {
            let added = added(differences);
            assert!((added - sum).abs() < 1e-12, "{added} of {differences:?}");
        };
        // Low ones count as long as they fall, and from the fourth on those below a quarter.
        is(&[1.0, 0.9, 0.8, 0.7, 0.6], 1.0 + 0.9 + 0.8);
        is(&[1.0, 0.9, 0.8, 0.2 * 0.8, 0.16], 1.0 + 0.9 + 0.8 + 0.16);
        is(&[1.0, 0.9, 0.8, 0.3 * 0.8, 0.01], 1.0 + 0.9 + 0.8);
    }
}
