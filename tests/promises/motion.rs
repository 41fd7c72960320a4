//! The damped oscillator with a periodic drive in closed form, as a sum of complex exponentials.
//!
//! ```math
//! q'' + \gamma q' + \omega^2 q = D \sin \Omega t, \qquad q = \sum_j c_j e^{\lambda_j t}
//! ```

use metriplectic::nalgebra::Complex;

type C = Complex<f64>;

/// A function `Σ c_j e^{λ_j t}` with real values.
#[derive(Clone, Debug)]
pub(crate) struct Modes(Vec<(C, C)>);

impl Modes {
    /// `A sin(Ωt + φ)` by its values `A sin φ` and `A cos φ`.
    pub(crate) fn wave(rate: f64, [sine, cosine]: [f64; 2]) -> Self {
        // sin φ cos Ωt + cos φ sin Ωt.
        let c = C::new(0.5 * sine, -0.5 * cosine);
        Self(vec![(c, C::new(0.0, rate)), (c.conj(), C::new(0.0, -rate))])
    }

    /// The motion of the oscillator that has forgotten its start.
    pub(crate) fn driven([omega, gamma]: [f64; 2], drive: &Self) -> Self {
        let modes = drive.0.iter();
        Self(modes.map(|(c, rate)| (c / (rate * (rate + gamma) + omega * omega), *rate)).collect())
    }

    /// The oscillator from `(q, v)` at `t = 0`.
    pub(crate) fn oscillator([q, v]: [f64; 2], [omega, gamma]: [f64; 2], drive: &Self) -> Self {
        let square = omega * omega;
        let driven = Self::driven([omega, gamma], drive);
        let [q, v] = [q - driven.at(0.0), v - driven.slope().at(0.0)];
        // The rate of the slow mode as a quotient, because its difference cancels.
        let root = C::new(gamma * gamma - 4.0 * square, 0.0).sqrt();
        let fast = -0.5 * (root + gamma);
        let slow = C::from(square) / fast;
        let apart = fast - slow;
        let own = [((C::from(v) - slow * q) / apart, fast), ((fast * q - v) / apart, slow)];
        Self(own.into_iter().chain(driven.0).collect())
    }

    pub(crate) fn at(&self, t: f64) -> f64 {
        self.0.iter().map(|(c, rate)| (c * (rate * t).exp()).re).sum()
    }

    pub(crate) fn slope(&self) -> Self {
        Self(self.0.iter().map(|(c, rate)| (c * rate, *rate)).collect())
    }

    pub(crate) fn plus(&self, factor: f64, other: &Self) -> Self {
        let other = other.0.iter().map(|(c, rate)| (c * factor, *rate));
        Self(self.0.iter().copied().chain(other).collect())
    }

    /// `∫₀ᵗ f g`.
    pub(crate) fn integral(&self, other: &Self, t: f64) -> f64 {
        let pairs = self.0.iter().flat_map(|a| other.0.iter().map(move |b| (a, b)));
        pairs.map(|((a, x), (b, y))| (a * b * of_exponential(x + y, t)).re).sum()
    }

    /// `∫₀ᵗ |f g|`, to a percent.
    pub(crate) fn gross(&self, other: &Self, t: f64) -> f64 {
        let product = |k: i32| {
            let t = t * (f64::from(k) + 0.5) / f64::from(PARTS);
            (self.at(t) * other.at(t)).abs()
        };
        (0..PARTS).map(product).sum::<f64>() * t / f64::from(PARTS)
    }

    /// `Σ |c_j|`, which the values do not exceed where nothing grows.
    pub(crate) fn size(&self) -> f64 {
        self.0.iter().map(|(c, _)| c.norm()).sum()
    }
}

/// The points at which a mean is taken.
const PARTS: i32 = 2000;

/// `∫₀ᵗ e^{λs} ds`.
fn of_exponential(rate: C, t: f64) -> C {
    let z = rate * t;
    if z.norm() > 1e-2 {
        return (z.exp() - 1.0) / rate;
    }
    // Σ zⁿ/(n+1)!
    let terms = (1..12).rev().fold(C::from(1.0), |sum, n| sum * z / f64::from(n + 1) + 1.0);
    terms * t
}
