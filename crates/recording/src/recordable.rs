//! Closures that can be recorded.

use metriplectic_fields::{
    Column, Dimension, Evaluation, Form, Jet1, Jet2, MatrixField, Real, Scalar, ScalarField, Vector,
};
use metriplectic_manifolds::Manifold;

use crate::{
    PointEntries, Recorded, RecordedField, RecordingError, Tape, TapeField, TapeMatrix, record,
    recorded_field::GRADIENT_FROM,
};

/// Writes a closure over `Real` that can be recorded too: a [`Recordable`].
///
/// `field!(move |p: &Vector3<Real>| p.norm_squared() * 0.5)` is the closure twice, in two blocks that give the name `Real` to
/// [`metriplectic_fields::Real`](metriplectic_fields::Real) and to [`Recorded`]. So what it moves must be `Copy`, and a reference to a
/// longer list is. The name `Real` must stand in the closure as such, and functions that it calls are generic in a
/// [`Scalar`].
///
/// # Examples
///
/// ```
/// use metriplectic_fields::ScalarField;
/// use metriplectic_manifolds::Euclidean;
/// use metriplectic_recording::field;
/// use nalgebra::{SVector, vector};
///
/// let inertia = [10.0, 5.0, 1.0];
/// let energy = field!(move |p: &SVector<Real, 3>| {
///     (p[0] * p[0] / inertia[0] + p[1] * p[1] / inertia[1] + p[2] * p[2] / inertia[2]) * 0.5
/// });
/// let at = vector![1.0, 2.0, 3.0];
/// let recorded = energy.recorded(&Euclidean::<3>, &at)?;
/// let (plain, tape) = (ScalarField::<Euclidean<3>>::jet1(&energy, &at), recorded.jet1(&at));
/// assert!((plain.df - tape.df).norm() < 1e-15);
/// # Ok::<(), metriplectic_recording::RecordingError>(())
/// ```
#[macro_export]
macro_rules! field {
    ($($closure:tt)*) => {
        $crate::Recordable::new(
            {
                #[allow(dead_code, reason = "the closure need not name it")]
                type Real = $crate::Real;
                $($closure)*
            },
            {
                #[allow(dead_code, reason = "the closure need not name it")]
                type Real = $crate::Recorded;
                $($closure)*
            },
        )
    };
}

/// A closure at two scalars: at [`Real`], where it is an ordinary field, and at [`Recorded`]. The macro
/// [`field!`](crate::field) makes it.
#[derive(Clone, Copy, Debug)]
pub struct Recordable<F, R> {
    closure: F,
    recording: R,
}

impl<F, R> Recordable<F, R> {
    /// Joins a closure with its copy at the recording scalar. Both must compute the same.
    pub const fn new(closure: F, recording: R) -> Self {
        Self { closure, recording }
    }

    /// Records a scalar field as a tape with one input for each entry of the point `x`.
    ///
    /// # Errors
    ///
    /// The errors of [`record`](crate::record()).
    pub fn tape<M>(&self, _: &M, x: &M::Point<f64>) -> Result<Tape, RecordingError>
    where
        M: PointEntries,
        R: Fn(&M::Point<Recorded>) -> Recorded,
    {
        self.tape_at::<M>(x)
    }

    fn tape_at<M>(&self, x: &M::Point<f64>) -> Result<Tape, RecordingError>
    where
        M: PointEntries,
        R: Fn(&M::Point<Recorded>) -> Recorded,
    {
        record(&M::entries(x), |entries| vec![(self.recording)(&point::<M>(entries))])
    }

    /// Records a matrix field, such as a metric or a Poisson tensor. A tape has no advantage over the closure here, except
    /// that it can be written down.
    ///
    /// # Errors
    ///
    /// The errors of [`record`](crate::record()).
    pub fn recorded_matrix<M>(
        &self,
        _: &M,
        x: &M::Point<f64>,
    ) -> Result<TapeMatrix<M>, RecordingError>
    where
        M: PointEntries,
        R: Fn(&M::Point<Recorded>) -> Form<M, Recorded>,
    {
        let n = <M::Velocity as Dimension>::LEN;
        TapeMatrix::new(record(&M::entries(x), |entries| {
            let form = (self.recording)(&point::<M>(entries));
            (0..n * n).map(|k| form[(k / n, k % n)]).collect()
        })?)
    }

    /// Records a scalar field, and checks the tape against the closure: value and differential at the point `x` of the
    /// space and at two points near it.
    ///
    /// The field that comes out uses the tape where it is faster, see [`RecordedField`].
    ///
    /// # Errors
    ///
    /// The errors of [`record`](crate::record()), and [`RecordingError::Disagrees`] if the closure gives other numbers.
    pub fn recorded<M>(
        self,
        _: &M,
        x: &M::Point<f64>,
    ) -> Result<RecordedField<M, F>, RecordingError>
    where
        M: PointEntries,
        F: Fn(&M::Point<Real>) -> Real,
        R: Fn(&M::Point<Recorded>) -> Recorded,
    {
        let tape = self.checked_tape::<M>(x)?;
        Ok(RecordedField::new(self.closure, tape))
    }

    /// Records a scalar field, and checks the tape against the closure.
    fn checked_tape<M>(&self, x: &M::Point<f64>) -> Result<TapeField<M>, RecordingError>
    where
        M: PointEntries,
        F: Fn(&M::Point<Real>) -> Real,
        R: Fn(&M::Point<Recorded>) -> Recorded,
    {
        let tape = TapeField::new(self.tape_at::<M>(x)?)?;
        for turn in [0.0, 1.0, 2.0] {
            agree(&tape, &self.closure, &near::<M>(x, turn))?;
        }
        Ok(tape)
    }
}

/// The point with these entries.
fn point<M: PointEntries>(entries: &[Recorded]) -> M::Point<Recorded> {
    let mut entries = entries.iter();
    M::point(&mut || entries.next().copied().unwrap_or_else(|| Recorded::from_re(f64::NAN)))
}

/// A point near `x`, and `x` itself for a `turn` of zero: each coordinate changes by a thousandth of its scale.
fn near<M: Manifold>(x: &M::Point<f64>, turn: f64) -> M::Point<f64> {
    let scales = M::scales(x);
    let part = |k: usize| {
        let scale = if scales[k] > 0.0 { scales[k] } else { 1.0 };
        1e-3 * scale * (turn * (1.0 + k as f64)).sin()
    };
    if turn == 0.0 { x.clone() } else { M::chart(x, &Vector::<M>::from_index(part)) }
}

/// By how much a tape and its closure may differ, relative to the largest numbers on the tape.
///
/// A factor of four fails `src/recordable.rs::a_tape_that_is_not_its_closure_is_refused`.
const AGREEMENT: f64 = 1e-10;

/// Compares values and differentials of a tape and a closure.
fn agree<M: PointEntries>(
    tape: &TapeField<M>,
    closure: &impl ScalarField<M>,
    x: &M::Point<f64>,
) -> Result<(), RecordingError> {
    let (ours, theirs) = (tape.jet1(x), closure.jet1(x));
    let (size, slope) = tape.sizes(x);
    let one = |quantity, recorded: f64, closure: f64, size: f64| {
        let is_same = recorded.to_bits() == closure.to_bits()
            || (recorded.is_nan() && closure.is_nan())
            || (recorded - closure).abs() <= AGREEMENT * size;
        if is_same {
            Ok(())
        } else {
            Err(RecordingError::Disagrees { quantity, recorded, closure })
        }
    };
    one("value", ours.value, theirs.value, size)?;
    for i in 0..M::Dim::LEN {
        one("differential", ours.df[i], theirs.df[i], slope)?;
    }
    Ok(())
}

#[diagnostic::do_not_recommend]
impl<M, F, R> ScalarField<M> for Recordable<F, R>
where
    M: PointEntries,
    F: Fn(&M::Point<Real>) -> Real,
    R: Fn(&M::Point<Recorded>) -> Recorded,
{
    fn evaluation(&self, x: &M::Point<f64>) -> Evaluation {
        match self.checked_tape::<M>(x) {
            Ok(_) if M::Dim::LEN >= GRADIENT_FROM => Evaluation::Recordable,
            Ok(_) => Evaluation::FewVariables(M::Dim::LEN),
            Err(RecordingError::Branches { file, line, .. }) => Evaluation::Branches { file, line },
            Err(_) => Evaluation::Unrecordable,
        }
    }

    #[inline]
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> D {
        ScalarField::<M>::at(&self.closure, x)
    }

    #[inline]
    fn at_real(&self, x: &M::Point<Real>) -> Real {
        (self.closure)(x)
    }

    #[inline]
    fn jet1(&self, x: &M::Point<f64>) -> Jet1<M> {
        ScalarField::<M>::jet1(&self.closure, x)
    }

    #[inline]
    fn jet2(&self, x: &M::Point<f64>) -> Jet2<M> {
        ScalarField::<M>::jet2(&self.closure, x)
    }
}

#[diagnostic::do_not_recommend]
impl<M, F, R> MatrixField<M> for Recordable<F, R>
where
    M: Manifold,
    F: Fn(&M::Point<Real>) -> Form<M, Real>,
{
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> Form<M, D> {
        MatrixField::<M>::at(&self.closure, x)
    }

    #[inline]
    fn at_real(&self, x: &M::Point<Real>) -> Form<M, Real> {
        (self.closure)(x)
    }
}

#[cfg(test)]
mod tests {
    use metriplectic_manifolds::Euclidean;
    use nalgebra::Vector1;

    use super::*;

    #[test]
    fn a_tape_that_is_not_its_closure_is_refused() {
        let differing = |part: f64| {
            let field = Recordable::new(
                move |x: &Vector1<Real>| x[0] * x[0] * (1.0 + part),
                |x: &Vector1<Recorded>| x[0] * x[0],
            );
            field.recorded(&Euclidean::<1>, &Vector1::new(3.0)).map(|_| ())
        };
        assert_eq!(differing(0.0), Ok(()));
        assert_eq!(differing(0.5e-10), Ok(()));
        assert!(matches!(
            differing(2e-10),
            Err(RecordingError::Disagrees { quantity: "value", .. })
        ));
        // Not a number on both sides is no difference.
        let root = crate::field!(|x: &Vector1<Real>| num_dual::DualNum::sqrt(&x[0]));
        assert!(root.recorded(&Euclidean::<1>, &Vector1::new(-1.0)).is_ok());
    }
}
