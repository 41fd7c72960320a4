//! The step of a linear model within a trust region and a box.
//!
//! The unknowns that a step within the trust region would take out of the box are put on it, and the others take the best step beside
//! them: once the bounds that are met at the minimum are known, this is the step of the unknowns that are free, with its speed. It is
//! taken if it predicts no less than a step down the slope that is bent at the box, the *generalised Cauchy point*; by that the
//! iterations cannot end but at a minimum in the box (Moré and Toraldo 1991; Conn, Gould and Toint 2000, §12.2).

use nalgebra::{DMatrix, DVector};

use crate::least_squares::Squares;
use crate::trust_region::Linear;

/// The fraction of the reduction along the slope that the bent step has to predict.
const DESCENT: f64 = 0.1;

/// A model `|J δ + r|²`, the lengths of its columns, and the room of each unknown on both sides: `[lower − φ, upper − φ]`.
pub(crate) struct InBox<'a> {
    pub(crate) at: &'a Squares,
    pub(crate) lengths: &'a [f64],
    pub(crate) room: &'a [[f64; 2]],
}

impl InBox<'_> {
    /// The model at a step, less that at none.
    pub(crate) fn change(&self, delta: &DVector<f64>) -> f64 {
        let moved = &self.at.jacobian * delta;
        moved.norm_squared() + 2.0 * moved.dot(&self.at.residuals)
    }

    fn size(&self, delta: &DVector<f64>) -> f64 {
        let hat = delta.iter().zip(self.lengths).map(|(delta, length)| delta * length);
        hat.map(|hat| hat * hat).sum::<f64>().sqrt()
    }

    /// The step, but for unknowns that a bound holds.
    pub(crate) fn within(&self, radius: f64, is_held: &[bool]) -> Option<DVector<f64>> {
        let free: Vec<usize> = (0..self.room.len()).filter(|&j| !is_held[j]).collect();
        let (step, bent) = (self.along(radius, free.clone())?, self.bent(radius, &free));
        Some(if self.change(&step) <= self.change(&bent) { step } else { bent })
    }

    /// The length of the damped step of the unknowns that no bound holds.
    pub(crate) fn damped(&self, damping: f64, is_held: &[bool]) -> Option<f64> {
        let free: Vec<usize> = (0..self.room.len()).filter(|&j| !is_held[j]).collect();
        let (linear, _) = self.of(&free, &DVector::zeros(self.room.len()))?;
        Some(linear.damped(damping).norm())
    }

    /// The model of some unknowns beside a step of the others.
    fn of(&self, free: &[usize], beside: &DVector<f64>) -> Option<(Linear, Vec<f64>)> {
        let Squares { residuals, jacobian } = self.at;
        let lengths: Vec<f64> = free.iter().map(|&j| self.lengths[j]).collect();
        let columns = DMatrix::from_fn(residuals.len(), free.len(), |i, k| jacobian[(i, free[k])]);
        let at = Squares { residuals: residuals + jacobian * beside, jacobian: columns };
        Some((Linear::of(&at, &lengths)?, lengths))
    }

    /// The step within the radius, with those unknowns on the box that it would take out of it.
    fn along(&self, radius: f64, mut free: Vec<usize>) -> Option<DVector<f64>> {
        let mut delta = DVector::zeros(self.room.len());
        while !free.is_empty() {
            let used = self.size(&delta) / radius;
            let left = radius * (1.0 - used * used).max(0.0).sqrt();
            if left <= f64::EPSILON.sqrt() * radius {
                break;
            }
            let (linear, lengths) = self.of(&free, &delta)?;
            let hat = linear.within(left);
            let mut next = delta.clone();
            for (k, &j) in free.iter().enumerate() {
                next[j] = hat[k] / lengths[k];
            }
            let is_inside = |j: usize| self.room[j][0] <= next[j] && next[j] <= self.room[j][1];
            let (inside, outside): (Vec<usize>, Vec<usize>) =
                free.iter().partition(|j| is_inside(**j));
            if outside.is_empty() {
                return Some(next);
            }
            for j in outside {
                delta[j] = next[j].clamp(self.room[j][0], self.room[j][1]);
            }
            free = inside;
        }
        Some(delta)
    }

    /// The longest of the steps `Δ 2⁻ᵏ` down the slope, bent at the box, that predicts a fraction of what the slope promises.
    fn bent(&self, radius: f64, free: &[usize]) -> DVector<f64> {
        let mut slope = DVector::zeros(self.room.len());
        for &j in free {
            slope[j] = self.at.jacobian.column(j).dot(&self.at.residuals);
        }
        let down = DVector::from_fn(slope.len(), |j, _| -slope[j] / self.lengths[j].powi(2));
        let size = self.size(&down);
        let mut t = if size > 0.0 { radius / size } else { 0.0 };
        for _ in 0..HALVINGS {
            let room = |j: usize| (t * down[j]).clamp(self.room[j][0], self.room[j][1]);
            let delta = DVector::from_fn(down.len(), |j, _| room(j));
            if self.change(&delta) <= DESCENT * 2.0 * slope.dot(&delta) {
                return delta;
            }
            t *= 0.5;
        }
        DVector::zeros(down.len())
    }
}

/// The halvings of the bent step.
const HALVINGS: u32 = 60;
