//! What a pointer to a system points to answers for it.

use std::rc::Rc;
use std::sync::Arc;

use crate::{Equations, Kind, Model, PointError, SecondLaw, Sizes};

macro_rules! pointer {
    ($($pointer:ty),+) => {$(
        impl<S: Equations + ?Sized> Equations for $pointer {
            fn sizes(&self) -> Sizes {
                (**self).sizes()
            }

            fn values(&self, t: f64, x: &[f64], values: &mut [f64]) {
                (**self).values(t, x, values);
            }

            fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
                (**self).differentials(t, x, values, w);
            }

            fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
                (**self).velocity(t, x, v)
            }

            fn second_law(&self) -> SecondLaw {
                (**self).second_law()
            }

            fn kind(&self, invariant: usize) -> Kind {
                (**self).kind(invariant)
            }

            fn check(&self, x: &[f64]) -> Result<(), PointError> {
                (**self).check(x)
            }

            fn defect(&self, x: &[f64]) -> f64 {
                (**self).defect(x)
            }

            fn scales(&self, x: &[f64], sizes: &mut [f64]) {
                (**self).scales(x, sizes);
            }

            fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
                (**self).chart(x, q, y);
            }

            fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool {
                (**self).coordinates(x, y, q)
            }

            fn stage_state(&self, x: &[f64], q: &[f64], y: &mut [f64]) -> bool {
                (**self).stage_state(x, q, y)
            }

            fn stage_coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) {
                (**self).stage_coordinates(x, y, q);
            }

            fn stage_rates(&self, x: &[f64], q: &[f64], y: &[f64], v: &[f64], rates: &mut [f64]) {
                (**self).stage_rates(x, q, y, v, rates);
            }

            fn model(&self) -> Option<&dyn Model> {
                (**self).model()
            }
        }
    )+};
}

pointer!(&S, Box<S>, Rc<S>, Arc<S>);
