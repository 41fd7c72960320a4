//! The charts of a space: those of its factors, side by side.

use metriplectic_equations::PointError;
use metriplectic_equations::room::with_numbers;
use metriplectic_fields::Real;

use super::factor::frame_seen_from;
use super::reals::with_reals;
use super::space::{Layout, Placed};

/// Writes a matrix of a factor into that of the space.
pub(super) fn put_block(n: usize, at: &std::ops::Range<usize>, block: &[f64], to: &mut [f64]) {
    for (i, row) in block.chunks_exact(at.len()).enumerate() {
        to[(at.start + i) * n + at.start..][..row.len()].copy_from_slice(row);
    }
}

impl Layout {
    /// Checks that the entries are a state.
    pub(super) fn check(&self, x: &[f64]) -> Result<(), PointError> {
        for Placed { factor, entries, .. } in &self.factors {
            factor.check(&x[entries.clone()]).map_err(|error| match error {
                PointError::NotFinite { index, value } => {
                    PointError::NotFinite { index: index + entries.start, value }
                }
                other => other,
            })?;
        }
        Ok(())
    }

    /// Measures how far a state is off the space; NaN if an entry is.
    pub(super) fn defect(&self, x: &[f64]) -> f64 {
        let of = |Placed { factor, entries, .. }: &Placed| factor.defect(&x[entries.clone()]);
        self.factors
            .iter()
            .map(of)
            .fold(0.0, |most, defect| if defect > most || defect.is_nan() { defect } else { most })
    }

    pub(super) fn scales(&self, x: &[f64], sizes: &mut [f64]) {
        for Placed { factor, entries, directions, .. } in &self.factors {
            factor.scales(&x[entries.clone()], &mut sizes[directions.clone()]);
        }
    }

    #[inline]
    pub(super) fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
        for Placed { factor, entries, directions, .. } in &self.factors {
            factor.chart(&x[entries.clone()], &q[directions.clone()], &mut y[entries.clone()]);
        }
    }

    pub(super) fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool {
        let mut is_near = true;
        for Placed { factor, entries, directions, .. } in &self.factors {
            is_near &= factor.coordinates(
                &x[entries.clone()],
                &y[entries.clone()],
                &mut q[directions.clone()],
            );
        }
        is_near
    }

    #[inline]
    pub(super) fn stage_state(&self, x: &[f64], q: &[f64], y: &mut [f64]) -> bool {
        self.factors.iter().all(|Placed { factor, entries, directions, .. }| {
            factor.stage_state(&x[entries.clone()], &q[directions.clone()], &mut y[entries.clone()])
        })
    }

    pub(super) fn stage_coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) {
        for Placed { factor, entries, directions, .. } in &self.factors {
            factor.stage_coordinates(
                &x[entries.clone()],
                &y[entries.clone()],
                &mut q[directions.clone()],
            );
        }
    }

    #[inline]
    pub(super) fn stage_rates(
        &self,
        x: &[f64],
        q: &[f64],
        y: &[f64],
        v: &[f64],
        rates: &mut [f64],
    ) {
        for Placed { factor, entries, directions, .. } in &self.factors {
            let [x, y] = [x, y].map(|x| &x[entries.clone()]);
            let [q, v] = [q, v].map(|q| &q[directions.clone()]);
            factor.stage_rates(x, q, y, v, &mut rates[directions.clone()]);
        }
    }

    pub(super) fn moved(&self, x: &[f64], q: &[Real], y: &mut [Real]) {
        for Placed { factor, entries, directions, .. } in &self.factors {
            factor.moved(&x[entries.clone()], &q[directions.clone()], &mut y[entries.clone()]);
        }
    }

    pub(super) fn pull_back(&self, x: &[f64], w: &[f64], df: &mut [f64]) {
        for Placed { factor, entries, directions, .. } in &self.factors {
            factor.pull_back(&x[entries.clone()], &w[entries.clone()], &mut df[directions.clone()]);
        }
    }

    /// Writes the second derivatives of the chart times slopes by the entries, a block for each factor.
    pub(super) fn bend(&self, x: &[f64], w: &[f64], hf: &mut [f64]) {
        hf.fill(0.0);
        for Placed { factor, entries, directions, .. } in &self.factors {
            if !factor.is_flat() {
                with_numbers(directions.len() * directions.len(), |block| {
                    factor.bend(&x[entries.clone()], &w[entries.clone()], block);
                    put_block(self.directions, directions, block, hf);
                });
            }
        }
    }

    /// Computes the velocity of the entries along a direction of the chart at `x`.
    pub(super) fn push_axis(&self, x: &[f64], axis: usize, along: &mut [f64]) {
        along.fill(0.0);
        let Some(placed) = self.factors.iter().find(|placed| placed.directions.contains(&axis))
        else {
            return;
        };
        let Placed { factor, entries, directions, .. } = placed;
        let (n, k) = (directions.len(), axis - directions.start);
        if factor.is_flat() {
            along[entries.start + k] = 1.0;
            return;
        }
        with_reals(n + entries.len(), |room| {
            let (q, y) = room.split_at_mut(n);
            q[k].eps1 = 1.0;
            factor.moved(&x[entries.clone()], q, y);
            along[entries.clone()].iter_mut().zip(&*y).for_each(|(along, y)| *along = y.eps1);
        });
    }

    /// Computes the components `Uᵀα` in the frame at `y` of covectors in the chart at `x`, or `U v` in the chart at `x` of
    /// vectors in the frame at `y`, with `U` the derivative of `φ_x⁻¹ ∘ φ_y` at zero.
    fn turned(&self, [x, y]: [&[f64]; 2], from: &[f64], to: &mut [f64], is_covector: bool) {
        for Placed { factor, entries, directions, .. } in &self.factors {
            let (from, to) = (&from[directions.clone()], &mut to[directions.clone()]);
            if factor.is_flat() {
                to.copy_from_slice(from);
                continue;
            }
            let n = directions.len();
            with_numbers(n * n, |columns| {
                frame_seen_from(&**factor, &x[entries.clone()], &y[entries.clone()], columns);
                to.fill(0.0);
                for (k, column) in columns.chunks_exact(n).enumerate() {
                    for i in 0..n {
                        if is_covector {
                            to[k] += column[i] * from[i];
                        } else {
                            to[i] += column[i] * from[k];
                        }
                    }
                }
            });
        }
    }

    /// Turns a covector of the chart at `x` into the frame at `y`.
    pub(super) fn covector_there(&self, places: [&[f64]; 2], w: &[f64], to: &mut [f64]) {
        self.turned(places, w, to, true);
    }

    /// Turns a vector of the frame at `y` into the chart at `x`.
    pub(super) fn vector_here(&self, places: [&[f64]; 2], v: &[f64], to: &mut [f64]) {
        self.turned(places, v, to, false);
    }
}
