//! Functions with a kink, recorded.

use metriplectic_fields::Piecewise;
use num_dual::DualNum;
use num_traits::Signed;

use crate::{Branchless, Recorded};

impl Piecewise for Recorded {
    fn abs(self) -> Self {
        Signed::abs(&self)
    }

    fn signum(self) -> Self {
        Signed::signum(&self)
    }

    fn min(self, other: impl Into<Self>) -> Self {
        self.least(other.into())
    }

    fn max(self, other: impl Into<Self>) -> Self {
        self.greatest(other.into())
    }

    /// Without the scale of the closure, so that it overflows beyond 1e154.
    fn hypot(self, other: impl Into<Self>) -> Self {
        let other = other.into();
        (self * self + other * other).sqrt()
    }

    /// A remainder asks for the value, so that the recording is refused.
    fn rem_euclid(self, modulus: f64) -> Self {
        let value = self.known("`rem_euclid`");
        Self::from_re(value.rem_euclid(modulus))
    }
}

#[cfg(test)]
mod tests {
    use metriplectic_fields::{Piecewise, ScalarField};
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Vector2, vector};

    use crate::{RecordingError, field};

    #[test]
    fn recorded_kinks_have_the_derivatives_of_the_closure() {
        let kinks = field!(|p: &Vector2<Real>| {
            p.x.abs() * p.y.signum()
                + p.x.min(p.y)
                + p.x.max(0.3)
                + p.y.clamp(-0.5, 0.5)
                + p.x.hypot(p.y)
        });
        let space = Euclidean::<2>;
        let tape = kinks.tape(&space, &vector![0.7, -0.2]).unwrap();
        let closure = kinks.recorded(&space, &vector![0.7, -0.2]).unwrap();
        for p in [vector![0.7, -0.2], vector![-0.7, 0.2], vector![0.1, 0.9], vector![-2.0, -3.0]] {
            let jet = ScalarField::<Euclidean<2>>::jet1(&closure, &p);
            let mut slope = [0.0; 2];
            let value = tape.gradient(p.as_slice(), &mut slope);
            assert!((value - jet.value).abs() < 1e-14, "{p}: {value}");
            assert!((Vector2::from(slope) - jet.df).norm() < 1e-14, "{p}: {slope:?}");
        }
    }

    #[test]
    fn a_remainder_is_not_recorded() {
        let angle = field!(|p: &Vector2<Real>| p.x.rem_euclid(1.5));
        let error = angle.tape(&Euclidean::<2>, &vector![0.7, -0.2]).unwrap_err();
        assert!(matches!(error, RecordingError::Branches { .. }), "{error}");
    }
}
