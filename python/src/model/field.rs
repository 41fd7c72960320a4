//! Recorded tensors: matrices on velocities, in the frames of the charts of a space.

use metriplectic_equations::MetricError;
use metriplectic_equations::room::with_numbers;
use metriplectic_fields::Real;
use metriplectic_recording::{Tape, TapeError};

use super::reals::with_reals;
use super::space::{Layout, Placed};
use super::tapes::{self, Form};

/// A recorded tensor `A(x, w, t)` on velocities, of which the vector `A α` is known as a tape.
///
/// In the frame of a chart it is `θ⁺ A θ⁺ᵀ`, with the covectors `θ⁺ᵀ w` and `θ⁺ᵀ α` of velocities.
#[derive(Clone, Debug)]
pub(super) struct Field {
    layout: Layout,
    /// `A α`, with the inputs `[x | w | t | α]`, or `[x | t | α]`.
    product: Tape,
    has_w: bool,
    pub(super) in_time: bool,
}

/// A covector in the frame of a chart and the vector of a tensor, or their derivatives.
pub(super) struct FieldJet<'a> {
    pub(super) value: &'a mut [f64],
    pub(super) along_x: &'a mut [f64],
    /// The derivatives along `w`; zeros for a tensor that does not depend on it.
    pub(super) along_w: &'a mut [f64],
    pub(super) tensor: &'a mut [f64],
}

impl Field {
    /// Makes a tensor of a tape with the inputs `[x | w | t | θ]`, or `[x | t | θ]`.
    pub(super) fn new(
        layout: Layout,
        tape: &Tape,
        has_w: bool,
        form: Form,
        theta: &[f64],
    ) -> Result<Self, TapeError> {
        let states = layout.entries + if has_w { layout.velocities } else { 0 };
        let in_time = tapes::depends(tape, states);
        let product =
            tapes::product(tape, form, layout.velocities, tapes::Layout { states, theta })?;
        Ok(Self { layout, product, has_w, in_time })
    }

    /// Computes the vector `A α` at `φ_x(q)`, in the chart at `x`.
    pub(super) fn apply(
        &self,
        t: f64,
        (x, q): (&[f64], &[f64]),
        w: &[f64],
        alpha: &[f64],
        v: &mut [f64],
    ) -> Result<(), MetricError> {
        let Self { layout, product, has_w, .. } = self;
        let n = layout.directions;
        if layout.is_flat {
            with_numbers(product.inputs(), |inputs| {
                let (y, rest) = inputs.split_at_mut(layout.entries);
                layout.chart(x, q, y);
                let rest = if *has_w {
                    rest[..n].copy_from_slice(w);
                    &mut rest[n..]
                } else {
                    rest
                };
                rest[0] = t;
                rest[1..].copy_from_slice(alpha);
                product.evaluate(inputs, v);
            });
            return Ok(());
        }
        with_reals(4 * n, |room| {
            for i in 0..n {
                room[i] = Real::from(q[i]);
                room[n + i] = Real::from(if *has_w { w[i] } else { 0.0 });
                room[2 * n + i] = Real::from(alpha[i]);
            }
            let (given, to) = room.split_at_mut(3 * n);
            self.real(t, x, given, to)?;
            v.iter_mut().zip(&*to).for_each(|(v, to)| *v = to.re);
            Ok(())
        })
    }

    /// Computes the vector with derivatives at any place, from `q`, `w` and `α` in a row.
    fn real(&self, t: f64, x: &[f64], given: &[Real], v: &mut [Real]) -> Result<(), MetricError> {
        let Self { layout, product, has_w, .. } = self;
        let (n, velocities) = (layout.directions, layout.velocities);
        let (q, rest) = given.split_at(n);
        let (w, alpha) = rest.split_at(n);
        let coframes: usize = layout.factors.iter().map(coframe_size).sum();
        with_reals(product.inputs() + coframes + velocities, |room| {
            let (inputs, room) = room.split_at_mut(product.inputs());
            let (coframes, outputs) = room.split_at_mut(coframes);
            self.coframes(x, q, coframes)?;
            let (y, rest) = inputs.split_at_mut(layout.entries);
            layout.moved(x, q, y);
            let rest = if *has_w {
                let (to, rest) = rest.split_at_mut(velocities);
                self.to_velocities(coframes, w, to);
                rest
            } else {
                rest
            };
            rest[0] = Real::from(t);
            self.to_velocities(coframes, alpha, &mut rest[1..]);
            product.evaluate(inputs, outputs);
            self.to_directions(coframes, outputs, v);
            Ok(())
        })
    }

    /// Writes the coframes of the curved factors, one after another.
    fn coframes(&self, x: &[f64], q: &[Real], to: &mut [Real]) -> Result<(), MetricError> {
        let mut rest = to;
        for placed in &self.layout.factors {
            let (to, next) = rest.split_at_mut(coframe_size(placed));
            rest = next;
            let Placed { factor, entries, directions, .. } = placed;
            let q = &q[directions.clone()];
            if !to.is_empty() && !factor.coframe(&x[entries.clone()], q, to) {
                let distance = q.iter().map(|q| q.re * q.re).sum::<f64>().sqrt();
                return Err(MetricError::OutOfChart { distance });
            }
        }
        Ok(())
    }

    /// Computes `θ⁺ᵀ α`.
    fn to_velocities(&self, coframes: &[Real], alpha: &[Real], to: &mut [Real]) {
        let mut rest = coframes;
        for placed in &self.layout.factors {
            let (theta, next) = rest.split_at(coframe_size(placed));
            rest = next;
            let (alpha, to) =
                (&alpha[placed.directions.clone()], &mut to[placed.velocities.clone()]);
            if placed.factor.is_flat() {
                to.copy_from_slice(alpha);
                continue;
            }
            to.fill(Real::from(0.0));
            for (row, alpha) in theta.chunks_exact(to.len()).zip(alpha) {
                to.iter_mut().zip(row).for_each(|(to, theta)| *to += *theta * *alpha);
            }
        }
    }

    /// Computes `θ⁺ v`.
    fn to_directions(&self, coframes: &[Real], v: &[Real], to: &mut [Real]) {
        let mut rest = coframes;
        for placed in &self.layout.factors {
            let (theta, next) = rest.split_at(coframe_size(placed));
            rest = next;
            let (v, to) = (&v[placed.velocities.clone()], &mut to[placed.directions.clone()]);
            if placed.factor.is_flat() {
                to.copy_from_slice(v);
                continue;
            }
            for (row, to) in theta.chunks_exact(v.len()).zip(to) {
                *to = row.iter().zip(v).fold(Real::from(0.0), |sum, (theta, v)| sum + *theta * *v);
            }
        }
    }

    /// Evaluates the vector at a state with all derivatives in the chart there.
    pub(super) fn linearise(
        &self,
        t: f64,
        x: &[f64],
        w: &[f64],
        alpha: &[f64],
        to: &mut FieldJet<'_>,
    ) -> Result<(), MetricError> {
        let n = self.layout.directions;
        with_reals(4 * n, |room| {
            let (given, v) = room.split_at_mut(3 * n);
            for i in 0..n {
                given[i] = Real::from(0.0);
                given[n + i] = Real::from(if self.has_w { w[i] } else { 0.0 });
                given[2 * n + i] = Real::from(alpha[i]);
            }
            for k in 0..n {
                // A bracket has no `w`, and the second seed is that of `α`.
                let second = if self.has_w { n + k } else { 2 * n + k };
                given[k].eps1 = 1.0;
                given[second].eps2 = 1.0;
                self.real(t, x, given, v)?;
                given[k].eps1 = 0.0;
                given[second].eps2 = 0.0;
                for (i, v) in v.iter().enumerate() {
                    to.value[i] = v.re;
                    to.along_x[i * n + k] = v.eps1;
                    let (along_w, tensor) =
                        if self.has_w { (v.eps2, None) } else { (0.0, Some(v.eps2)) };
                    to.along_w[i * n + k] = along_w;
                    tensor.into_iter().for_each(|entry| to.tensor[i * n + k] = entry);
                }
            }
            Ok::<(), MetricError>(())
        })?;
        if self.has_w { self.tensor(t, x, w, to.tensor) } else { Ok(()) }
    }

    /// Evaluates the matrix at a state, in the chart there.
    pub(super) fn tensor(
        &self,
        t: f64,
        x: &[f64],
        w: &[f64],
        to: &mut [f64],
    ) -> Result<(), MetricError> {
        let n = self.layout.directions;
        with_numbers(3 * n, |room| {
            let (still, room) = room.split_at_mut(n);
            let (axis, column) = room.split_at_mut(n);
            for k in 0..n {
                axis[k] = 1.0;
                self.apply(t, (x, still), w, axis, column)?;
                axis[k] = 0.0;
                (0..n).for_each(|i| to[i * n + k] = column[i]);
            }
            Ok(())
        })
    }

    /// Evaluates the derivative of `A α` along the direction `u` of the chart at `x`.
    pub(super) fn slope_of(
        &self,
        t: f64,
        x: &[f64],
        u: &[f64],
        alpha: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError> {
        let n = self.layout.directions;
        with_reals(4 * n, |room| {
            let (given, v) = room.split_at_mut(3 * n);
            for i in 0..n {
                given[i] = Real::new(0.0, u[i], 0.0, 0.0);
                given[2 * n + i] = Real::from(alpha[i]);
            }
            self.real(t, x, given, v)?;
            slope.iter_mut().zip(&*v).for_each(|(slope, v)| *slope = v.eps1);
            Ok(())
        })
    }
}

/// The numbers of the coframe of a factor; none for a flat one.
fn coframe_size(placed: &Placed) -> usize {
    if placed.factor.is_flat() { 0 } else { placed.directions.len() * placed.velocities.len() }
}
