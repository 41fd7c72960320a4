//! The inverse of a Jacobian, which learns from each correction.

use metriplectic_fields::{Column, Dimension, Space, Square};

use super::{Linearised, Rounding, SURE, Stiffness};

/// The factor between the bound of round-off to first order and what is taken for round-off.
/// A factor of four fails `tests/mutations.rs::the_friction_of_a_certificate_is_that_of_the_steps_however_long_a_jacobian_is_kept`.
pub(crate) const MARGIN: f64 = 3.0;
/// The error of `J⁻¹J` at which an inverse has no digits: the Jacobian is singular to round-off, as with
/// friction that is 10¹⁶ times faster than the motion along no axis.
/// A factor of four fails `newton/tests.rs::an_inverse_that_is_off_by_a_hundredth_is_none`.
pub(crate) const INVERTED: f64 = 0.01;
/// The inverse of a Jacobian, kept up to date by Broyden's rank-one corrections, and what it makes of
/// the round-off of the equation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Inverse<N: Dimension> {
    pub(crate) matrix: N::Matrix<f64>,
    /// The round-off `|J⁻¹| r + |J⁻¹G| η + |1 − J⁻¹| ξ` of the solution, where the Jacobian was formed.
    pub(crate) round_off: N::Vector<f64>,
    /// The norm of the round-off of the residual, where the Jacobian was formed.
    pub(crate) residual_bound: f64,
    /// The fraction of a residual that the first correction by a kept inverse has left of late.
    pub(crate) contraction: f64,
    /// The residual of the guess in the last step, in units of its round-off.
    pub(crate) first: f64,
    /// The rate of the friction where the Jacobian was formed.
    pub(crate) friction: f64,
    /// Equations that it has solved since the one whose Jacobian it is.
    pub(crate) age: u32,
}

impl<N: Dimension> Inverse<N> {
    pub(super) fn of<M: Space<Dim = N>, E>(
        Linearised { jacobian, rounding, stiffness, .. }: &Linearised<M, E>,
        residual_bound: f64,
    ) -> Option<Self> {
        let Rounding { terms, sensitivity, covector, argument } = rounding;
        let matrix = jacobian.inverse()?;
        // In mixed units only the diagonal of J⁻¹J has none, and tells whether the inverse has digits.
        let digits = |i| {
            let product: f64 = (0..N::LEN).map(|j| matrix[(i, j)] * jacobian[(j, i)]).sum();
            (product - 1.0).abs() < INVERTED
        };
        if !(0..N::LEN).all(digits) {
            return None;
        }
        // J⁻¹(J − 1) = 1 − J⁻¹.
        let moved = (N::Matrix::<f64>::one() - matrix).abs();
        // A point and its compensation have twice the digits: smaller displacements move nothing.
        let round_off = matrix.abs() * *terms
            + (matrix * *sensitivity).abs() * *covector
            + moved * *argument
            + *argument * f64::EPSILON;
        let Stiffness { friction, .. } = *stiffness;
        Some(Self {
            matrix,
            round_off,
            residual_bound,
            contraction: 0.0,
            first: 0.0,
            friction,
            age: 0,
        })
    }

    /// Whether as many corrections of the next guess as a Jacobian is worth are expected to be enough, the last
    /// one unchecked.
    pub(super) fn serves(&self) -> bool {
        reaches(self.first, self.contraction, corrections(N::LEN), SURE)
    }

    /// The correction of a residual.
    #[inline]
    pub(super) fn times(&self, residual: &N::Vector<f64>) -> N::Vector<f64> {
        self.matrix * *residual
    }

    /// The round-off of each component of a solution near `u`.
    #[inline]
    pub(super) fn round_off(&self, u: &N::Vector<f64>) -> N::Vector<f64> {
        (self.round_off + u.abs() * f64::EPSILON) * MARGIN
    }

    /// Broyden's update: the least change of the inverse after which the step `s` has the change `y`
    /// of the residual, `s = J⁻¹y`, with `predicted = J⁻¹y` before it (Broyden 1965, in the form of
    /// Sherman and Morrison). The `correction` of a residual becomes that of the new inverse.
    #[inline]
    pub(super) fn learn(
        &mut self,
        s: &N::Vector<f64>,
        predicted: &N::Vector<f64>,
        correction: &mut N::Vector<f64>,
    ) {
        let along = s.dot(predicted);
        // Beyond a factor of four the step says little about the slope, and nothing where its square
        // underflows.
        if along > 0.25 * s.dot(s) && along > 1e-280 {
            let row = self.matrix.transpose_times(s);
            let turned = (*s - *predicted) * along.recip();
            self.matrix += N::Matrix::<f64>::outer(&turned, &row);
            *correction += turned * s.dot(correction);
        }
    }
}

/// The corrections by a kept Jacobian that cost less than a new one. In dimension `n` the derivatives of the
/// residual cost about as much as `n` residuals.
pub(crate) const fn corrections(n: usize) -> usize {
    if n > 6 { n / 2 } else { 3 }
}

/// Whether a number of corrections with this contraction reduce a residual to a limit.
#[inline]
pub(crate) fn reaches(residual: f64, contraction: f64, corrections: usize, limit: f64) -> bool {
    let mut left = residual;
    for _ in 0..corrections {
        if left <= limit {
            return true;
        }
        left *= contraction;
    }
    left <= limit
}
