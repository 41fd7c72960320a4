//! Energy, entropy and further invariants: scalar functions of a state, with exact derivatives in the charts of a space.

use metriplectic_equations::room::with_numbers;
use metriplectic_fields::Real;

use super::reals::with_reals;
use super::space::Layout;
use super::tapes::OfState;

/// A scalar function of the entries of a state, a tape with one output.
#[derive(Clone, Debug)]
pub(super) struct Law(pub(super) OfState);

impl Law {
    /// Calls `f` with the inputs of the tape: the entries, followed by the time if the law depends on it.
    #[inline]
    fn with_inputs<T>(&self, t: f64, x: &[f64], f: impl FnOnce(&[f64]) -> T) -> T {
        if !self.0.in_time {
            return f(x);
        }
        with_numbers(x.len() + 1, |inputs| {
            inputs[..x.len()].copy_from_slice(x);
            inputs[x.len()] = t;
            f(inputs)
        })
    }

    /// Evaluates the law.
    pub(super) fn value(&self, t: f64, x: &[f64]) -> f64 {
        self.with_inputs(t, x, |inputs| self.0.tape.value(inputs))
    }

    /// Evaluates the law with its slopes by the entries, and returns its slope by the time too.
    fn slopes(&self, t: f64, x: &[f64], w: &mut [f64]) -> [f64; 2] {
        if !self.0.in_time {
            return [self.0.tape.gradient(x, w), 0.0];
        }
        self.with_inputs(t, x, |inputs| {
            with_numbers(inputs.len(), |all| {
                let value = self.0.tape.gradient(inputs, all);
                w.copy_from_slice(&all[..x.len()]);
                [value, all[x.len()]]
            })
        })
    }

    /// Computes the slope by the time.
    pub(super) fn power(&self, t: f64, x: &[f64]) -> f64 {
        if !self.0.in_time {
            return 0.0;
        }
        with_numbers(x.len(), |w| self.slopes(t, x, w)[1])
    }

    /// Evaluates the law with its differential in the chart at `x`.
    #[inline]
    pub(super) fn jet(&self, layout: &Layout, t: f64, x: &[f64], df: &mut [f64]) -> f64 {
        if layout.is_flat {
            return self.slopes(t, x, df)[0];
        }
        with_numbers(x.len(), |w| {
            let [value, _] = self.slopes(t, x, w);
            layout.pull_back(x, w, df);
            value
        })
    }

    /// Evaluates the law with its differential and its Hessian in the chart at `x`.
    pub(super) fn hessian(
        &self,
        layout: &Layout,
        t: f64,
        x: &[f64],
        df: &mut [f64],
        hf: &mut [f64],
    ) -> f64 {
        if layout.is_flat && !self.0.in_time {
            return self.0.tape.hessian(x, df, hf);
        }
        let (entries, n) = (layout.entries, layout.directions);
        self.with_inputs(t, x, |inputs| {
            with_numbers(3 * inputs.len() + n, |room| {
                let (along, room) = room.split_at_mut(inputs.len());
                let (w, room) = room.split_at_mut(inputs.len());
                let (hv, column) = room.split_at_mut(inputs.len());
                let value = self.0.tape.gradient(inputs, w);
                layout.pull_back(x, &w[..entries], df);
                layout.bend(x, &w[..entries], hf);
                for k in 0..n {
                    layout.push_axis(x, k, &mut along[..entries]);
                    self.0.tape.gradient_along(inputs, along, w, hv);
                    layout.pull_back(x, &hv[..entries], column);
                    (0..n).for_each(|i| hf[i * n + k] += column[i]);
                }
                value
            })
        })
    }

    /// Evaluates the law at `φ_x(q)` with derivatives.
    pub(super) fn real(&self, layout: &Layout, t: f64, x: &[f64], q: &[Real]) -> Real {
        with_reals(x.len() + 1, |y| {
            layout.moved(x, q, &mut y[..x.len()]);
            y[x.len()] = Real::from(t);
            let mut value = [Real::from(0.0)];
            self.0.tape.evaluate(&y[..self.0.tape.inputs()], &mut value);
            value[0]
        })
    }

    /// Computes the differential at `φ_x(q)` in the chart at `x`.
    pub(super) fn differential_at(
        &self,
        layout: &Layout,
        t: f64,
        x: &[f64],
        q: &[f64],
        df: &mut [f64],
    ) {
        let n = q.len();
        with_numbers(2 * x.len(), |room| {
            let (y, w) = room.split_at_mut(x.len());
            layout.chart(x, q, y);
            self.slopes(t, y, w);
            if layout.is_flat {
                return df.copy_from_slice(w);
            }
            with_reals(n + x.len(), |room| {
                let (seeded, y) = room.split_at_mut(n);
                (0..n).for_each(|i| seeded[i] = Real::from(q[i]));
                for k in 0..n {
                    seeded[k].eps1 = 1.0;
                    layout.moved(x, seeded, y);
                    seeded[k].eps1 = 0.0;
                    df[k] = y.iter().zip(&*w).map(|(y, w)| y.eps1 * w).sum();
                }
            });
        });
    }

    /// Computes the Hessian at `φ_x(q)` in the chart at `x`.
    pub(super) fn hessian_at(&self, layout: &Layout, t: f64, x: &[f64], q: &[f64], hf: &mut [f64]) {
        let n = q.len();
        if layout.is_flat {
            return with_numbers(x.len() + n, |room| {
                let (y, df) = room.split_at_mut(x.len());
                layout.chart(x, q, y);
                self.hessian(layout, t, y, df, hf);
            });
        }
        with_reals(n, |seeded| {
            (0..n).for_each(|i| seeded[i] = Real::from(q[i]));
            for i in 0..n {
                for j in i..n {
                    seeded[i].eps1 = 1.0;
                    seeded[j].eps2 = 1.0;
                    let bend = self.real(layout, t, x, seeded).eps1eps2;
                    seeded[i].eps1 = 0.0;
                    seeded[j].eps2 = 0.0;
                    hf[i * n + j] = bend;
                    hf[j * n + i] = bend;
                }
            }
        });
    }
}
