//! The strength of the noise, and the measure that its law is relative to.

use std::fmt;

use metriplectic_fields::Column as _;
use metriplectic_fields::{Jet1, Jet2, Matrix, Scalar, ScalarField, Space, Square, Vector};

/// Boltzmann's constant `k_B`, in the unit of the entropy: 1.380649e-23 in SI units.
///
/// ```
/// use metriplectic_dynamics::noise::{Boltzmann, Fluctuation};
/// use metriplectic_fields::Real;
/// use nalgebra::Vector2;
/// use num_dual::DualNum;
/// let strong = Boltzmann(0.15);
/// // In polar coordinates (r, φ) of a plane with the area r dr dφ.
/// let polar = Boltzmann(0.15).measure(|x: &Vector2<Real>| x.x.ln());
/// assert_eq!(strong.k_b(), polar.k_b());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Boltzmann(pub f64);

impl Boltzmann {
    /// Sets the logarithm of the density of the measure `μ`, relative to the volume of the canonical metric: a closure
    /// `|x| -> Real` or any other [`ScalarField`].
    pub const fn measure<F>(self, ln_density: F) -> Measured<F> {
        Measured { k_b: self.0, ln_density }
    }
}

/// Boltzmann's constant with a measure; see [`Boltzmann::measure`].
#[derive(Clone, Copy)]
pub struct Measured<F> {
    k_b: f64,
    ln_density: F,
}

// By hand, because closures have no `Debug`.
impl<F> fmt::Debug for Measured<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Measured").field("k_b", &self.k_b).finish_non_exhaustive()
    }
}

/// The strength of thermal noise, with its measure: [`Boltzmann`], or [`Measured`].
pub trait Fluctuation {
    /// The type of `ln μ`.
    type Measure;

    /// True if the density is 1.
    const IS_UNIFORM: bool;

    /// Boltzmann's constant.
    fn k_b(&self) -> f64;

    /// The logarithm of the density of the measure.
    fn into_measure(self) -> Self::Measure;
}

impl Fluctuation for Boltzmann {
    type Measure = Uniform;
    const IS_UNIFORM: bool = true;

    fn k_b(&self) -> f64 {
        self.0
    }

    fn into_measure(self) -> Uniform {
        Uniform
    }
}

impl<F> Fluctuation for Measured<F> {
    type Measure = F;
    const IS_UNIFORM: bool = false;

    fn k_b(&self) -> f64 {
        self.k_b
    }

    fn into_measure(self) -> F {
        self.ln_density
    }
}

/// The density 1: the volume of the canonical metric.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Uniform;

#[diagnostic::do_not_recommend]
impl<M: Space> ScalarField<M> for Uniform {
    fn at<D: Scalar>(&self, _: &M::Point<D>) -> D {
        D::zero()
    }

    fn jet1(&self, _: &M::Point<f64>) -> Jet1<M> {
        Jet1 { value: 0.0, df: Vector::<M>::zero() }
    }

    fn jet2(&self, _: &M::Point<f64>) -> Jet2<M> {
        Jet2 { value: 0.0, df: Vector::<M>::zero(), hf: Matrix::<M>::zeros() }
    }
}
