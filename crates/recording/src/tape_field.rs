//! Tapes as fields.

use std::fmt;
use std::marker::PhantomData;
use std::sync::Arc;

use crate::{PointEntries, RecordingError, Tape, room};
use metriplectic_fields::{
    Dimension, Evaluation, Form, Jet1, Jet2, Matrix, MatrixField, Real, Scalar, ScalarField,
    Square, Vector, seeded,
};

/// A tape as a scalar field: a function of the entries of a point.
///
/// `jet1` is a sweep forward and one back, whatever the dimension is. `jet2` differentiates these along the `n`
/// directions of the chart, several at a time. On a curved space the derivatives by the entries `x_e` are those along the chart `φ_x`
///
/// ```math
/// \partial_i f = w_e \, \partial_i x_e, \qquad
/// \partial_i\partial_j f = \partial_i x_e \, \partial_j w_e + w_e \, \partial_i\partial_j x_e, \qquad
/// w_e = \partial f/\partial x_e .
/// ```
pub struct TapeField<M> {
    tape: Arc<Tape>,
    space: PhantomData<fn() -> M>,
}

/// A tape as a field of square matrices, which it gives row by row.
pub struct TapeMatrix<M> {
    tape: Arc<Tape>,
    space: PhantomData<fn() -> M>,
}

macro_rules! tapes {
    ($($name:ident $number:literal $expected:expr;)*) => {$(
        impl<M: PointEntries> $name<M> {
            #[doc = concat!("Makes a field of a tape with an input for each entry and with ", $number, ".")]
            ///
            /// # Errors
            ///
            /// [`RecordingError::Shape`] for another number of inputs or outputs.
            pub fn new(tape: impl Into<Arc<Tape>>) -> Result<Self, RecordingError> {
                let tape = tape.into();
                let (inputs, outputs) = (tape.inputs(), tape.outputs().len());
                let (entries, expected) = (M::COUNT, $expected);
                if (inputs, outputs) != (entries, expected) {
                    return Err(RecordingError::Shape { inputs, outputs, entries, expected });
                }
                Ok(Self { tape, space: PhantomData })
            }

            /// The tape.
            #[must_use]
            pub fn tape(&self) -> &Tape {
                &self.tape
            }

            /// Evaluates all registers at the entries of a point.
            #[inline]
            fn forward<D: Scalar>(&self, x: &M::Point<D>, r: &mut Vec<D>) {
                self.tape.forward(r, |inputs| fill::<M, D>(x, inputs));
            }
        }

        impl<M> Clone for $name<M> {
            fn clone(&self) -> Self {
                Self { tape: Arc::clone(&self.tape), space: PhantomData }
            }
        }

        impl<M> fmt::Debug for $name<M> {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                let (registers, inputs) = (self.tape.registers(), self.tape.inputs());
                f.debug_struct(stringify!($name))
                    .field("inputs", &inputs)
                    .field("instructions", &(registers - inputs))
                    .finish_non_exhaustive()
            }
        }
    )*};
}

tapes! {
    TapeField "one output" 1;
    TapeMatrix "an output for each entry of the matrix" {
        let n = <M::Velocity as Dimension>::LEN;
        n * n
    };
}

impl<M: PointEntries> TapeField<M> {
    fn output(&self) -> usize {
        self.tape.outputs()[0] as usize
    }

    /// The sizes to which the round-off of value and differential at `x` is relative.
    pub(crate) fn sizes(&self, x: &M::Point<f64>) -> (f64, f64) {
        self.tape.second_order(|inputs| fill::<M, f64>(x, inputs), |at| at.sizes())
    }
}

#[diagnostic::do_not_recommend]
impl<M: PointEntries> ScalarField<M> for TapeField<M> {
    fn evaluation(&self, _: &M::Point<f64>) -> Evaluation {
        Evaluation::Tape
    }

    fn at<D: Scalar>(&self, x: &M::Point<D>) -> D {
        room::with(|room| {
            self.forward(x, &mut room.values);
            room.values[self.output()]
        })
    }

    fn jet1(&self, x: &M::Point<f64>) -> Jet1<M> {
        let (value, df) = self.gradient(x, |w| M::pull_back(x, w));
        Jet1 { value, df }
    }

    fn jet2(&self, x: &M::Point<f64>) -> Jet2<M> {
        let (n, seeded) = (M::Dim::LEN, M::seeds(x));
        self.second(x, |j| seeded(j, n), |w| M::pull_back(x, w), |w| M::bend(x, w))
    }

    fn differential_at(&self, x: &M::Point<f64>, q: &Vector<M>) -> Vector<M> {
        self.gradient(&M::chart(x, q), |w| M::pull_back_at(x, q, w)).1
    }

    fn hessian_at(&self, x: &M::Point<f64>, q: &Vector<M>) -> Matrix<M> {
        let seed = |j| seeded::<M>(x, q, j, M::Dim::LEN);
        let pulled = |w: &[f64]| M::pull_back_at(x, q, w);
        self.second(&M::chart(x, q), seed, pulled, |w| M::bend_at(x, q, w)).hf
    }
}

impl<M: PointEntries> TapeField<M> {
    /// Computes the value and the differential at a point, which `pulled` makes of the derivatives by its entries.
    #[inline]
    fn gradient(
        &self,
        at: &M::Point<f64>,
        pulled: impl FnOnce(&[f64]) -> Vector<M>,
    ) -> (f64, Vector<M>) {
        room::with(|room| {
            self.forward(at, &mut room.values);
            let output = self.output();
            self.tape.backward(&room.values, &mut room.weights, |bar| bar[output] = 1.0);
            (room.values[output], pulled(&room.weights[..M::COUNT]))
        })
    }

    /// Computes value, differential and Hessian at a point, of which `seeded(j)` is the point with its derivatives along the
    /// `j`-th direction of a chart. The others are the transposed derivative of the chart and what its curvature adds.
    #[inline]
    fn second(
        &self,
        at: &M::Point<f64>,
        seeded: impl Fn(usize) -> M::Point<Real>,
        pulled: impl Fn(&[f64]) -> Vector<M>,
        bend: impl FnOnce(&[f64]) -> Matrix<M>,
    ) -> Jet2<M> {
        let n = M::Dim::LEN;
        let seed = |j: usize, put: &mut dyn FnMut(usize, f64)| {
            if M::IS_TRANSLATION {
                return put(j, 1.0);
            }
            let mut input = 0;
            M::list(&seeded(j), &mut |entry: Real| {
                put(input, entry.eps1);
                input += 1;
            });
        };
        self.tape.second_order(
            |inputs| fill::<M, f64>(at, inputs),
            |at| {
                let w = at.gradient();
                let mut hf = bend(w);
                at.along(n, seed, |j, column| {
                    let column = pulled(column);
                    for i in 0..n {
                        hf[(i, j)] += column[i];
                    }
                });
                Jet2 { value: at.value(), df: pulled(w), hf }
            },
        )
    }
}

/// Writes the entries of a point.
#[inline]
fn fill<M: PointEntries, D: Scalar>(x: &M::Point<D>, inputs: &mut [D]) {
    let mut inputs = inputs.iter_mut();
    M::list(x, &mut |entry| {
        if let Some(input) = inputs.next() {
            *input = entry;
        }
    });
}

#[diagnostic::do_not_recommend]
impl<M: PointEntries> MatrixField<M> for TapeMatrix<M> {
    const IS_RECORDED: bool = true;

    fn at<D: Scalar>(&self, x: &M::Point<D>) -> Form<M, D> {
        room::with(|room| {
            self.forward(x, &mut room.values);
            let n = <M::Velocity as Dimension>::LEN;
            let outputs = self.tape.outputs();
            Form::<M, D>::from_entries(|i, j| room.values[outputs[i * n + j] as usize])
        })
    }
}
