//! Spaces of states.
//!
//! # Why points do not drift
//!
//! The unknown of a step is a tangent vector `u` at `x`, and its end is the end of a path, `φ_x(u)` for a
//! geodesic in a normal chart. On a curved space the last operation of the chart is one step of Newton's
//! iteration for `|x| = 1` or `RᵀR = 1`, which squares a defect of round-off. The equation of the step
//! contains `H` and `S` at this end. So the point that a run stores satisfies the laws and lies on the
//! manifold. A projection after the step would move the point, and change `H`. The certificate of a run
//! contains the largest defect of its points.

pub use metriplectic_equations::PointError;
use metriplectic_fields::{Column, Real, Space, Vector, Velocity};
use rand::Rng;

use crate::chart_midpoint;
use crate::step_path::{StepPath, StepPathJet};

/// A space of states.
///
/// Beyond its points and charts ([`Space`]) a manifold says whether a point lies on it, how large
/// its entries are (the scale of round-off), and draws random points for the checks of a model.
///
/// Laws ([`laws::manifold`](crate::laws::manifold)): 1. `φ_x(0) = x`; 2. `φ_x⁻¹(φ_x(q)) = q`, at
/// dual numbers too; 3. chart points and random points lie on the manifold; 4. a point that is read
/// from its entries is the same point, bit for bit.
pub trait Manifold: Space {
    /// Says how many entries a point has, and 0 where it is not said.
    #[doc(hidden)]
    const ENTRIES: usize = 0;

    /// Measures how far the point is off the manifold, in the units of its entries. It is 0 where every array
    /// of numbers is a point, and NaN or infinite if an entry is.
    fn defect(&self, x: &Self::Point<f64>) -> f64;

    /// Returns whether a point of a chart is in the domain of the space. Only an open part of a space has points
    /// of its chart outside.
    #[inline]
    fn is_inside(&self, _x: &Self::Point<f64>) -> bool {
        true
    }

    /// Lists the entries of the point, in the order in which it is written.
    fn entries(x: &Self::Point<f64>) -> Vec<f64>;

    /// Passes the entries on one by one, in the order of [`entries`](Self::entries), from which the default takes them.
    #[inline]
    fn write(x: &Self::Point<f64>, put: &mut impl FnMut(f64)) {
        Self::entries(x).into_iter().for_each(put);
    }

    /// Reads a point, without a check, whose entries are `next()`, `next()`, … in the order of
    /// [`entries`](Self::entries). For numbers from outside, use [`from_entries`](Self::from_entries).
    fn assemble(next: &mut impl FnMut() -> f64) -> Self::Point<f64>;

    /// Makes the point with these entries, the inverse of [`entries`](Self::entries).
    ///
    /// ```
    /// use metriplectic_manifolds::{Manifold, PointError, Sphere};
    /// let sphere = Sphere::<2>::round();
    /// assert_eq!(sphere.from_entries(&[0.6, 0.0, 0.8])?.z, 0.8);
    /// assert!(matches!(sphere.from_entries(&[0.6, 0.8]), Err(PointError::Length { .. })));
    /// assert!(matches!(sphere.from_entries(&[1.0, 1.0, 1.0]), Err(PointError::OffManifold { .. })));
    /// # Ok::<(), PointError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`PointError::Length`] if there are too few or too many, and those of
    /// [`check`](Self::check).
    #[expect(clippy::wrong_self_convention, reason = "the space knows which points are its own")]
    fn from_entries(&self, entries: &[f64]) -> Result<Self::Point<f64>, PointError> {
        let mut asked = 0;
        let point = Self::assemble(&mut || {
            asked += 1;
            entries.get(asked - 1).copied().unwrap_or(0.0)
        });
        if asked != entries.len() {
            return Err(PointError::Length { found: entries.len(), expected: asked });
        }
        self.check(&point)?;
        Ok(point)
    }

    /// The size `|x|` of the entries, which sets the scale of round-off.
    fn magnitude(x: &Self::Point<f64>) -> f64;

    /// The sizes of the entries, one for each direction of the chart. Round-off and tolerances are relative to
    /// them.
    ///
    /// On a flat space they are `|x_i|`, each in the unit of its entry, and zero for an entry that is zero.
    /// On a curved space all directions have the one size of the space, because its frame is arbitrary; on
    /// a half line the chart is a logarithm, of size 1. A product has those of its factors in a row. The
    /// default is [`magnitude`](Self::magnitude) for each direction.
    ///
    /// ```
    /// use metriplectic_manifolds::{Euclidean, Manifold, Product, Sphere};
    /// use nalgebra::vector;
    /// type Spin = Product<Sphere<2>, Euclidean<2>>;
    /// let x = (vector![0.0, 0.6, 0.8], vector![3e-9, -300.0]);
    /// assert_eq!(Spin::scales(&x), vector![1.0, 1.0, 3e-9, 300.0]);
    /// ```
    #[inline]
    fn scales(x: &Self::Point<f64>) -> Vector<Self> {
        let size = Self::magnitude(x);
        Vector::<Self>::from_index(|_| size)
    }

    /// The size of the terms of the slope `⟨w, v⟩` of a covector along a vector.
    ///
    /// On a flat space it is `Σ_i |w_i v_i|`, where the unit of an entry cancels. On a curved space the frame is
    /// arbitrary, and the default `|w||v|` is the same in all frames. A product has the sum over its factors.
    ///
    /// ```
    /// use metriplectic_manifolds::{Euclidean, Manifold, Product, Sphere};
    /// use nalgebra::vector;
    /// type Spin = Product<Sphere<2>, Euclidean<2>>;
    /// let (w, v) = (vector![3.0, 4.0, 1e9, 2.0], vector![4.0, -3.0, 1e-9, -3.0]);
    /// assert_eq!(Spin::pairing_size(&w, &v), 25.0 + 7.0);
    /// ```
    #[inline]
    fn pairing_size(w: &Vector<Self>, v: &Vector<Self>) -> f64 {
        w.magnitude() * v.magnitude()
    }

    /// The `a`-th of as many velocities as one has entries. Their parts along the manifold, `E_a`, make the inverse of the
    /// [canonical](crate::Canonical) metric, `Σ_a E_a ⊗ E_a = g⁻¹`, and are smooth on the whole manifold. Thermal noise acts along
    /// them.
    ///
    /// The default is the `a`-th axis, where the canonical metric is that of the space around. A half line has `s`, for
    /// `ds²/s²`.
    #[inline]
    fn leg(_x: &Self::Point<Real>, a: usize) -> Velocity<Self, Real> {
        Column::basis(a)
    }

    /// Projects an array of numbers to the nearest point of the manifold, or to one of several. Entries that are
    /// not finite stay so. If no point is nearest, as for the centre of a sphere, the entries are NaN.
    /// [`check`](Self::check) finds both.
    fn project(&self, x: &Self::Point<f64>) -> Self::Point<f64>;

    /// The components at `y` of the tangent vector `v` at `x`, for `y` near `x`: a vector transport
    /// (Absil, Mahony, Sepulchre 2008, §8.1). Only guesses use it. The components do not change if the frame
    /// is the same everywhere.
    #[inline]
    fn transport(_x: &Self::Point<f64>, _y: &Self::Point<f64>, v: &Vector<Self>) -> Vector<Self> {
        *v
    }

    /// Applies [`transport`](Self::transport) to several vectors at once.
    #[inline]
    fn transport_all(x: &Self::Point<f64>, y: &Self::Point<f64>, vectors: &mut [Vector<Self>]) {
        for v in vectors {
            *v = Self::transport(x, y, v);
        }
    }

    /// Follows the straight line `t ↦ φ_x(tu)` of the chart at `x`: its middle `z = φ_x(u/2)`, the displacement
    /// `d` there, which is its velocity in the chart at `z`, and its end `φ_x(u)`. The path of
    /// [`ChartMidpoint`](crate::ChartMidpoint). By default a dual number carries the velocity.
    #[inline]
    fn line(x: &Self::Point<f64>, u: &Vector<Self>) -> StepPath<Self> {
        chart_midpoint::line(x, u)
    }

    /// Follows the same line with its derivatives along `u`. By default dual numbers carry them.
    #[inline]
    fn line_jet(x: &Self::Point<f64>, u: &Vector<Self>) -> StepPathJet<Self> {
        chart_midpoint::line_jet(x, u)
    }

    /// Computes the point of the same line at time `t`, with its first and second derivative along `t`: the
    /// point `φ_x((t + ε₁ + ε₂) u)`.
    #[inline]
    fn line_at(x: &Self::Point<f64>, u: &Vector<Self>, t: f64) -> Self::Point<Real> {
        chart_midpoint::line_at::<Self>(x, u, t)
    }

    /// Computes the end `φ_x(u)` of the same line; `None` if its numbers are no longer a point. By default the
    /// coordinates of the end must be finite.
    #[inline]
    fn line_end(x: &Self::Point<f64>, u: &Vector<Self>) -> Option<Self::Point<f64>> {
        let end = Self::chart(x, u);
        Self::coordinates(&end, &end).is_finite().then_some(end)
    }

    /// Computes the rounding error of the displacement `u` on the way from `x` to `y = φ_x(u)`, which the next
    /// step compensates; zero where it is not known, as on a curved space.
    #[inline]
    fn lost_digits(
        _x: &Self::Point<f64>,
        _u: &Vector<Self>,
        _y: &Self::Point<f64>,
    ) -> Vector<Self> {
        Vector::<Self>::zero()
    }

    /// Draws a random point, spread over a unit scale.
    fn random(&self, rng: &mut impl Rng) -> Self::Point<f64>;

    /// Accepts a point whose entries are finite and whose defect is round-off.
    ///
    /// # Errors
    ///
    /// [`PointError::NotFinite`] with the first bad entry, or [`PointError::OffManifold`] with the
    /// distance.
    fn check(&self, x: &Self::Point<f64>) -> Result<(), PointError> {
        let entries = Self::entries(x);
        if let Some(index) = entries.iter().position(|entry| !entry.is_finite()) {
            return Err(PointError::NotFinite { index, value: entries[index] });
        }
        let (defect, allowed) = (self.defect(x), POINT_TOLERANCE * Self::magnitude(x));
        if defect <= allowed { Ok(()) } else { Err(PointError::OffManifold { defect, allowed }) }
    }
}

/// The defect that is accepted, relative to the size of the point. A start that was typed with ten digits is
/// accepted, and a mistaken start is refused.
const POINT_TOLERANCE: f64 = 1e-10;
