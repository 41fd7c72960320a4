//! Frictions `K_w(x)` that annihilate the covector `w` of the energy.

use metriplectic_equations::room::with_numbers;
use metriplectic_equations::{Jet, MetricError, Terms};
use metriplectic_recording::TapeError;

use super::definition::{self, Friction};
use super::error::DefinitionError;
use super::field::{Field, FieldJet};
use super::law::Law;
use super::metric::{Inner, Metric};
use super::normals::dot;
use super::space::Layout;
use super::tapes::{self, Form, OfState};

/// A space with its metric.
#[derive(Clone, Debug)]
pub(super) struct Around {
    pub(super) layout: Layout,
    /// The recorded metric; the canonical one otherwise.
    pub(super) metric: Option<Metric>,
}

impl Around {
    /// Calls `f` with the inner product at a state.
    #[inline]
    pub(super) fn with_inner<T>(
        &self,
        x: &[f64],
        f: impl FnOnce(Inner<'_>) -> T,
    ) -> Result<T, MetricError> {
        match &self.metric {
            None => Ok(f(Inner::Canonical)),
            Some(metric) => metric.with_inner(x, f),
        }
    }
}

/// A friction that is ready to be evaluated.
#[derive(Clone, Debug)]
pub(super) struct Rub {
    kind: RubKind,
    /// The contacts themselves, if the friction is made of them: a tape with the inputs `[x | w | t]`.
    contacts: Option<OfState>,
}

#[derive(Clone, Debug)]
enum RubKind {
    None,
    /// `κ ((w·w) ♯α − (w·α) ♯w)`.
    Metric {
        factor: Option<Law>,
    },
    Field(Box<Field>),
}

/// The number of directions up to which a sum over pairs is taken, as in the library.
const PAIRS: usize = 8;

/// Computes `q (p·w) − p (q·w)` so that `⟨w, ·⟩` cancels, as the library does.
#[inline]
fn turn(p: &[f64], q: &[f64], w: &[f64], k: &mut [f64]) {
    let n = w.len();
    if n > PAIRS {
        let (along_p, along_q, square) = (dot(p, w), dot(q, w), dot(w, w));
        (0..n).for_each(|i| k[i] = q[i] * along_p - p[i] * along_q);
        if square > 0.0 {
            let part = dot(w, k) / square;
            (0..n).for_each(|i| k[i] -= w[i] * part);
        }
        return;
    }
    k.fill(0.0);
    for i in 0..n {
        for j in 0..i {
            let a = p[j] * q[i] - p[i] * q[j];
            k[i] += w[j] * a;
            k[j] -= w[i] * a;
        }
    }
}

impl Rub {
    /// Prepares a friction on a space.
    pub(super) fn of(
        friction: &Friction,
        layout: &Layout,
        theta: &[f64],
    ) -> Result<Self, DefinitionError> {
        let part = "friction";
        let states = layout.entries + layout.velocities;
        let error = |source: TapeError| DefinitionError::Tape { part, source };
        let inputs = states + 1 + theta.len();
        let n = layout.velocities;
        let field = |tape, form| Field::new(layout.clone(), tape, true, form, theta).map_err(error);
        let kind = match friction {
            Friction::None => RubKind::None,
            Friction::Metric { factor } => {
                let factor = factor.as_ref().map(|tape| {
                    definition::expect(
                        "factor of the friction",
                        tape,
                        layout.entries + 1 + theta.len(),
                        1,
                    )?;
                    let layout = tapes::Layout { states: layout.entries, theta };
                    OfState::bound(tape, layout).map(Law).map_err(error)
                });
                RubKind::Metric { factor: factor.transpose()? }
            }
            Friction::Recorded(tape) => {
                definition::expect(part, tape, inputs, n * n)?;
                RubKind::Field(Box::new(field(tape, Form::Rows)?))
            }
            Friction::Contacts(tape) => {
                let outputs = tape.outputs().len();
                definition::expect(part, tape, inputs, outputs)?;
                if outputs % (n + 1) != 0 || outputs == 0 {
                    return Err(DefinitionError::Contacts { outputs, velocities: n });
                }
                RubKind::Field(Box::new(field(tape, Form::Contacts)?))
            }
        };
        let contacts = match friction {
            Friction::Contacts(tape) => {
                Some(OfState::bound(tape, tapes::Layout { states, theta }).map_err(error)?)
            }
            _ => None,
        };
        Ok(Self { kind, contacts })
    }

    /// Returns whether there is no friction.
    pub(super) const fn is_none(&self) -> bool {
        matches!(self.kind, RubKind::None)
    }

    /// Returns whether it is that of the metric, out of which further invariants are projected.
    pub(super) const fn is_of_metric(&self) -> bool {
        matches!(self.kind, RubKind::Metric { .. })
    }

    /// Computes the vector of the friction of a metric without its factor.
    pub(super) fn unscaled(
        around: &Around,
        x: &[f64],
        covectors: [&[f64]; 2],
        v: &mut [f64],
    ) -> Result<(), MetricError> {
        of_metric(around, None, 0.0, x, covectors, v)
    }

    /// Returns whether it depends on the time.
    pub(super) fn in_time(&self) -> bool {
        match &self.kind {
            RubKind::None => false,
            RubKind::Metric { factor } => factor.as_ref().is_some_and(|factor| factor.0.in_time),
            RubKind::Field(field) => field.in_time,
        }
    }

    /// Computes the vector `K_w α` at `φ_x(q)`, in the chart at `x`.
    #[inline]
    pub(super) fn apply(
        &self,
        around: &Around,
        t: f64,
        (x, q): (&[f64], &[f64]),
        [w, alpha]: [&[f64]; 2],
        v: &mut [f64],
    ) -> Result<(), MetricError> {
        let factor = match &self.kind {
            RubKind::None => {
                v.fill(0.0);
                return Ok(());
            }
            RubKind::Field(field) => return field.apply(t, (x, q), w, alpha, v),
            RubKind::Metric { factor } => factor.as_ref(),
        };
        if q.iter().all(|q| *q == 0.0) {
            return of_metric(around, factor, t, x, [w, alpha], v);
        }
        with_numbers(x.len() + 3 * q.len(), |room| {
            let (y, room) = room.split_at_mut(x.len());
            let (w_there, room) = room.split_at_mut(q.len());
            let (alpha_there, there) = room.split_at_mut(q.len());
            around.layout.chart(x, q, y);
            around.layout.covector_there([x, y], w, w_there);
            around.layout.covector_there([x, y], alpha, alpha_there);
            of_metric(around, factor, t, y, [w_there, alpha_there], there)?;
            around.layout.vector_here([x, y], there, v);
            Ok(())
        })
    }

    /// Evaluates the matrix `K_w` at a state.
    pub(super) fn tensor(
        &self,
        around: &Around,
        t: f64,
        x: &[f64],
        w: &[f64],
        to: &mut [f64],
    ) -> Result<(), MetricError> {
        match &self.kind {
            RubKind::None => {
                to.fill(0.0);
                Ok(())
            }
            RubKind::Field(field) => field.tensor(t, x, w, to),
            RubKind::Metric { .. } => {
                let n = w.len();
                with_numbers(3 * n, |room| {
                    let (still, room) = room.split_at_mut(n);
                    let (axis, column) = room.split_at_mut(n);
                    for k in 0..n {
                        axis[k] = 1.0;
                        self.apply(around, t, (x, still), [w, axis], column)?;
                        axis[k] = 0.0;
                        (0..n).for_each(|i| to[i * n + k] = column[i]);
                    }
                    Ok(())
                })
            }
        }
    }

    /// Evaluates `K_w α` at a state with its derivatives.
    pub(super) fn linearise(
        &self,
        around: &Around,
        t: f64,
        x: &[f64],
        [w, alpha]: [&[f64]; 2],
        jet: &mut Jet<'_>,
    ) -> Result<(), MetricError> {
        let Jet { value, along_x, along_w, tensor } = jet;
        match &self.kind {
            RubKind::None => {
                [value, along_x, along_w, tensor].into_iter().for_each(|numbers| numbers.fill(0.0));
                Ok(())
            }
            RubKind::Field(field) => {
                field.linearise(t, x, w, alpha, &mut FieldJet { value, along_x, along_w, tensor })
            }
            RubKind::Metric { factor } => {
                linearise_metric(around, factor.as_ref(), t, x, [w, alpha], jet)
            }
        }
    }

    /// Returns how many terms there are, if the friction is known as a sum of them.
    pub(super) fn term_count(&self, around: &Around) -> Option<usize> {
        let n = around.layout.directions;
        match (&self.kind, &self.contacts) {
            (RubKind::None, _) => Some(0),
            (RubKind::Metric { .. }, _) if around.metric.is_none() => Some(n * (n - 1) / 2),
            (_, Some(contacts)) if around.layout.is_flat => {
                Some(contacts.tape.outputs().len() / (around.layout.velocities + 1))
            }
            _ => None,
        }
    }

    /// Lists the terms `ρ b bᵀ` at a state: those of the contacts, or `κ (w_i e_j − w_j e_i)` for each pair of directions.
    pub(super) fn terms(
        &self,
        around: &Around,
        t: f64,
        x: &[f64],
        w: &[f64],
        term: &mut Terms<'_>,
    ) {
        let n = around.layout.directions;
        match (&self.kind, &self.contacts) {
            (RubKind::Metric { factor }, _) if around.metric.is_none() => {
                let rate = factor.as_ref().map_or(1.0, |factor| factor.value(t, x));
                for i in 0..n {
                    for j in 0..i {
                        term(rate, &[(j, w[i]), (i, -w[j])]);
                    }
                }
            }
            (_, Some(contacts)) if around.layout.is_flat => {
                let count = contacts.tape.outputs().len();
                let states = x.len() + n;
                with_numbers(states + 1 + count, |room| {
                    let (inputs, outputs) = room.split_at_mut(states + 1);
                    inputs[..x.len()].copy_from_slice(x);
                    inputs[x.len()..states].copy_from_slice(w);
                    inputs[states] = t;
                    contacts.tape.evaluate(&inputs[..contacts.tape.inputs()], outputs);
                    let mut listed = Vec::with_capacity(n);
                    for contact in outputs.chunks_exact(n + 1) {
                        listed.clear();
                        let entries = contact[1..].iter().copied().enumerate();
                        listed.extend(entries.filter(|(_, entry)| *entry != 0.0));
                        term(contact[0], &listed);
                    }
                });
            }
            _ => {}
        }
    }
}

/// Computes the vector of the friction of the metric at a state.
#[inline]
fn of_metric(
    around: &Around,
    factor: Option<&Law>,
    t: f64,
    x: &[f64],
    [w, alpha]: [&[f64]; 2],
    v: &mut [f64],
) -> Result<(), MetricError> {
    let n = w.len();
    if around.metric.is_none() {
        turn(w, alpha, w, v);
    } else {
        around.with_inner(x, |inner| {
            with_numbers(3 * n, |room| {
                let (w_hat, room) = room.split_at_mut(n);
                let (alpha_hat, k) = room.split_at_mut(n);
                inner.orthonormal(w, w_hat);
                inner.orthonormal(alpha, alpha_hat);
                turn(w_hat, alpha_hat, w_hat, k);
                inner.vector(k, v);
            });
        })?;
    }
    if let Some(factor) = factor {
        let kappa = factor.value(t, x);
        v.iter_mut().for_each(|v| *v *= kappa);
    }
    Ok(())
}

/// Evaluates the friction of the metric with its derivatives: `K_w α = κ ((w·w) ♯α − (w·α) ♯w)`.
fn linearise_metric(
    around: &Around,
    factor: Option<&Law>,
    t: f64,
    x: &[f64],
    [w, alpha]: [&[f64]; 2],
    jet: &mut Jet<'_>,
) -> Result<(), MetricError> {
    let n = w.len();
    of_metric(around, None, t, x, [w, alpha], jet.value)?;
    jet.along_x.fill(0.0);
    around.with_inner(x, |inner| {
        with_numbers(5 * n, |room| {
            let (p, room) = room.split_at_mut(n);
            let (a, room) = room.split_at_mut(n);
            let (axis, room) = room.split_at_mut(n);
            let (cometric, other) = room.split_at_mut(n);
            inner.sharp(w, p);
            inner.sharp(alpha, a);
            let (ww, wa) = (dot(w, p), dot(w, a));
            for j in 0..n {
                axis[j] = 1.0;
                inner.sharp(axis, cometric);
                axis[j] = 0.0;
                for i in 0..n {
                    jet.tensor[i * n + j] = ww * cometric[i] - p[i] * p[j];
                    jet.along_w[i * n + j] = 2.0 * a[i] * p[j] - p[i] * a[j] - wa * cometric[i];
                }
            }
            let Some(metric) = &around.metric else { return };
            let slopes = &mut vec![0.0; n * n * n];
            metric.slopes(x, slopes);
            let times = |slope: &[f64], v: &[f64], to: &mut [f64]| {
                to.iter_mut().zip(slope.chunks_exact(n)).for_each(|(to, row)| *to = dot(row, v));
            };
            for (k, slope) in slopes.chunks_exact(n * n).enumerate() {
                // ∂_k of (w·w) ♯α − (w·α) ♯w, with ∂_k ♯α = −♯(∂_k g ♯α).
                times(slope, p, axis);
                let (pp, ap) = (dot(p, axis), dot(a, axis));
                inner.sharp(axis, cometric);
                times(slope, a, axis);
                inner.sharp(axis, other);
                for i in 0..n {
                    jet.along_x[i * n + k] =
                        -a[i] * pp - other[i] * ww + p[i] * ap + cometric[i] * wa;
                }
            }
        });
    })?;
    let Some(factor) = factor else { return Ok(()) };
    with_numbers(n, |slope| {
        let kappa = factor.jet(&around.layout, t, x, slope);
        for i in 0..n {
            for (k, slope) in slope.iter().enumerate() {
                let at = i * n + k;
                jet.along_x[at] = kappa * jet.along_x[at] + jet.value[i] * slope;
                jet.along_w[at] *= kappa;
                jet.tensor[at] *= kappa;
            }
            jet.value[i] *= kappa;
        }
    });
    Ok(())
}
