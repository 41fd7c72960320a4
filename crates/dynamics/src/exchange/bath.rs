//! Baths: heat at a temperature.

use std::fmt;

use metriplectic_fields::{Column, Real, Vector, Velocity};
use metriplectic_manifolds::{InnerProduct, Manifold, MetricError, Riemannian, out_of_chart};
use nalgebra::SVector;

use super::list::ExchangeArgs;
use super::{components, vanishes};
use crate::dissipation::along_velocities;

/// A bath at a temperature `T`, with a friction `R` through which it gives and takes heat.
///
/// ```
/// use metriplectic_dynamics::exchange::{Bath, Contact};
/// use metriplectic_fields::Real;
/// use nalgebra::Vector2;
/// use num_dual::DualNum;
/// // Air at 300 K that slows the second entry down, a momentum: R = γ on it.
/// let air = Bath::at(300.0).friction(|_t: Real, _x: &Vector2<Real>, _w: &Vector2<Real>| {
///     [Contact::along(0.08, [0.0, 1.0])]
/// });
/// // A room whose temperature changes, and `R = rate · g⁻¹` with the metric of the system.
/// let room = Bath::in_time(|t| (t * 0.26).sin() * 5.0 + 290.0).isotropic(0.1);
/// ```
#[derive(Clone)]
pub struct Bath<T, R> {
    pub(super) temperature: T,
    pub(super) friction: R,
}

impl Bath<f64, ()> {
    /// A bath at the constant temperature `T ≥ 0`, in the unit of `H/S`, without friction yet.
    pub const fn at(temperature: f64) -> Self {
        Self { temperature, friction: () }
    }
}

impl<T: Fn(Real) -> Real> Bath<T, ()> {
    /// A bath whose temperature is a function `|t: Real| -> Real` of time, as every other closure of time.
    pub const fn in_time(temperature: T) -> Self {
        Self { temperature, friction: () }
    }
}

impl<T> Bath<T, ()> {
    /// Sets the friction `R = Σ rate · along ⊗ along`, from a closure `|t, x, w|` that returns an array of [`Contact`]s. `w` is
    /// `dH` in the equation of motion and a discrete gradient of `H` in a step, dual to velocities.
    pub fn friction<F>(self, contacts: F) -> Bath<T, Contacts<F>> {
        Bath { temperature: self.temperature, friction: Contacts(contacts) }
    }

    /// Sets the friction `R = rate · g⁻¹`, with the metric `g` of the system. It acts along every direction: on SO(3) × R³ it turns
    /// the attitude towards lower energy as it slows the momenta down. A bath of one factor has
    /// [contacts](Self::friction) along its directions:
    ///
    /// ```
    /// use metriplectic_dynamics::exchange::{Bath, Contact};
    /// use metriplectic_fields::Real;
    /// use nalgebra::{Matrix3, Vector3, Vector6};
    /// // On SO(3) × R³: the isotropic friction of the momenta alone, directions 3 to 5.
    /// type State = (Matrix3<Real>, Vector3<Real>);
    /// let drag = Bath::at(300.0).friction(|_: Real, _: &State, _: &Vector6<Real>| {
    ///     [3, 4, 5].map(|k| Contact {
    ///         rate: Real::from(0.1),
    ///         along: Vector6::ith(k, Real::from(1.0)),
    ///     })
    /// });
    /// ```
    pub fn isotropic(self, rate: f64) -> Bath<T, Isotropic> {
        Bath { temperature: self.temperature, friction: Isotropic { rate } }
    }
}

// By hand, because closures have no `Debug`.
impl<T, R> fmt::Debug for Bath<T, R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Bath").finish_non_exhaustive()
    }
}

/// The temperature of a bath: a number, or a closure of the time.
pub trait Temperature {
    /// The temperature at the time `t`.
    fn at(&self, t: f64) -> f64;

    /// Returns whether it is zero at all times.
    fn is_zero(&self) -> bool {
        false
    }
}

impl Temperature for f64 {
    #[inline]
    fn at(&self, _: f64) -> f64 {
        *self
    }

    fn is_zero(&self) -> bool {
        *self == 0.0
    }
}

impl<F: Fn(Real) -> Real> Temperature for F {
    #[inline]
    fn at(&self, t: f64) -> f64 {
        self(Real::from(t)).re
    }
}

/// A contact between a system and a bath: the rank-one friction `rate · along ⊗ along`.
///
/// `along` is a velocity as in [`Space::embed`](metriplectic_fields::Space::embed), and `rate ≥ 0`. The unit of
/// `rate · along²` is that of an entry squared, over time and energy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact<V> {
    /// The rate.
    pub rate: Real,
    /// The direction.
    pub along: V,
}

impl<const N: usize> Contact<SVector<Real, N>> {
    /// A contact of a constant direction.
    pub fn along(rate: impl Into<Real>, along: [f64; N]) -> Self {
        Self { rate: rate.into(), along: along.map(Real::from).into() }
    }
}

/// The friction `R` of a bath.
///
/// Laws: `R` is symmetric and positive semidefinite.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not the friction of a bath on `{M}`",
    note = "a friction is `.isotropic(rate)`, or `.friction(..)` of a closure of time, point and covector that returns an array of `Contact`s"
)]
pub trait Friction<M: Manifold, G: Riemannian<M>> {
    /// Computes the vector `R α`.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric or the chart cannot be used there.
    fn apply(
        &self,
        at: &ExchangeArgs<'_, M, G>,
        alpha: &Vector<M, Real>,
    ) -> Result<Vector<M, Real>, MetricError>;

    /// Computes the least of the rates; NaN if one is no number.
    ///
    /// # Errors
    ///
    /// The errors of [`apply`](Self::apply).
    fn least_rate(&self, at: &ExchangeArgs<'_, M, G>) -> Result<f64, MetricError>;
}

/// The friction `R = rate · g⁻¹`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Isotropic {
    rate: f64,
}

impl Isotropic {
    /// The rate.
    pub(super) const fn rate(&self) -> f64 {
        self.rate
    }
}

impl<M: Manifold, G: Riemannian<M>> Friction<M, G> for Isotropic {
    fn apply(
        &self,
        at: &ExchangeArgs<'_, M, G>,
        alpha: &Vector<M, Real>,
    ) -> Result<Vector<M, Real>, MetricError> {
        Ok(at.g.inner()?.sharp(alpha) * Real::from(self.rate))
    }

    fn least_rate(&self, _: &ExchangeArgs<'_, M, G>) -> Result<f64, MetricError> {
        Ok(self.rate)
    }
}

/// The friction of a closure that returns contacts.
#[derive(Clone, Copy)]
pub struct Contacts<F>(F);

impl<F> fmt::Debug for Contacts<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Contacts").finish_non_exhaustive()
    }
}

impl<F> Contacts<F> {
    pub(super) fn at<M: Manifold, G: Riemannian<M>, const N: usize>(
        &self,
        at: &ExchangeArgs<'_, M, G>,
    ) -> Result<[Contact<Velocity<M, Real>>; N], MetricError>
    where
        F: Fn(Real, &M::Point<Real>, &Velocity<M, Real>) -> [Contact<Velocity<M, Real>>; N],
    {
        let x = at.g.x;
        let w = along_velocities(x, at.w, vanishes).ok_or_else(|| out_of_chart(x))?;
        Ok((self.0)(Real::from(at.t), &x.point(), &w))
    }
}

impl<M, G, F, const N: usize> Friction<M, G> for Contacts<F>
where
    M: Manifold,
    G: Riemannian<M>,
    F: Fn(Real, &M::Point<Real>, &Velocity<M, Real>) -> [Contact<Velocity<M, Real>>; N],
{
    fn apply(
        &self,
        at: &ExchangeArgs<'_, M, G>,
        alpha: &Vector<M, Real>,
    ) -> Result<Vector<M, Real>, MetricError> {
        let x = at.g.x;
        let mut sum = Vector::<M, Real>::zero();
        for Contact { rate, along } in self.at(at)? {
            let y = components(x, &along).ok_or_else(|| out_of_chart(x))?;
            sum += y * (rate * y.dot(alpha));
        }
        Ok(sum)
    }

    fn least_rate(&self, at: &ExchangeArgs<'_, M, G>) -> Result<f64, MetricError> {
        let rates = self.at(at)?.map(|contact| contact.rate.re);
        let least = rates.iter().fold(f64::INFINITY, |least, rate| least.min(*rate));
        Ok(if rates.iter().any(|rate| rate.is_nan()) { f64::NAN } else { least })
    }
}
