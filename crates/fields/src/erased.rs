//! Fields of one type.

use std::{fmt, sync::Arc};

use crate::{Real, Scalar, ScalarField, Space};

/// A scalar field behind a pointer: every field of a space has this type.
///
/// Two systems with erased fields have one type, so that a `Vec` holds both and a struct can name it. An evaluation is a
/// call through a pointer, which the compiler cannot inline.
///
/// A closure keeps its bits. A field with a generic [`at`](ScalarField::at) is evaluated at [`Real`] alone, as a closure
/// is: up to second derivatives.
///
/// # Examples
///
/// ```
/// use metriplectic_fields::{ErasedField, Real, ScalarField};
/// use metriplectic_manifolds::Euclidean;
/// use nalgebra::Vector2;
///
/// let fields: Vec<ErasedField<Euclidean<2>>> = vec![
///     ErasedField::new(|x: &Vector2<Real>| x.x * x.y),
///     ErasedField::new(|x: &Vector2<Real>| x.norm_squared()),
/// ];
/// let values: Vec<f64> = fields.iter().map(|f| f.at(&Vector2::new(3.0, 4.0))).collect();
/// assert_eq!(values, [12.0, 25.0]);
/// ```
pub struct ErasedField<M: Space>(Arc<Erased<M>>);

type Erased<M> = dyn Fn(&<M as Space>::Point<Real>) -> Real + Send + Sync;

impl<M: Space> ErasedField<M> {
    /// Moves a field behind a pointer.
    pub fn new(field: impl ScalarField<M> + Send + Sync + 'static) -> Self {
        Self(Arc::new(move |x| field.at_real(x)))
    }
}

impl<M: Space> Clone for ErasedField<M> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<M: Space> fmt::Debug for ErasedField<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("ErasedField").finish_non_exhaustive()
    }
}

#[diagnostic::do_not_recommend]
impl<M: Space> ScalarField<M> for ErasedField<M> {
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> D {
        ScalarField::<M>::at(&|x: &M::Point<Real>| (self.0)(x), x)
    }

    fn at_real(&self, x: &M::Point<Real>) -> Real {
        (self.0)(x)
    }
}
