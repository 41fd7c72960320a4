//! A gas below a piston with friction.

use metriplectic_dynamics::bracket::ConstantPoisson;
use metriplectic_dynamics::{Contact, OnsagerDissipation, Poisson, System};
use metriplectic_fields::Real;
use metriplectic_integrators::Error;
use metriplectic_manifolds::{Euclidean, Metric};
use nalgebra::{Matrix3, Vector3, matrix, vector};
use num_dual::DualNum;

use crate::OnEuclidean;
use crate::parameter::{finite, not_negative, positive};

/// A gas of van der Waals with a constant heat capacity `C`,
///
/// ```math
/// U(S, V) = C\, T_0 \Bigl(\frac{V_0 - b}{V - b}\Bigr)^{Nk/C} e^{S/C} - \frac{a}{V}, \qquad
/// T = \frac{\partial U}{\partial S}, \qquad P = -\frac{\partial U}{\partial V} = \frac{Nk\, T}{V - b} - \frac{a}{V^2},
/// ```
///
/// whose entropy is zero at `T₀` and `V₀`. It is ideal with `a = b = 0`: [`Gas::ideal`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gas {
    /// The constant `Nk`, J/K: moles times 8.314 J/(K mol).
    pub constant: f64,
    /// The heat capacity `C` at constant volume, J/K: `3Nk/2` of a monatomic gas.
    pub heat_capacity: f64,
    /// The volume `b` of the particles, m³.
    pub excluded_volume: f64,
    /// The attraction `a` of the particles, J m³.
    pub attraction: f64,
    /// The temperature `T₀`, K.
    pub temperature: f64,
    /// The volume `V₀`, m³.
    pub volume: f64,
}

impl Gas {
    /// Returns the monatomic ideal gas with the constant `Nk` (J/K), whose entropy is zero at this temperature (K) and volume (m³).
    #[must_use]
    pub const fn ideal(constant: f64, temperature: f64, volume: f64) -> Self {
        let heat_capacity = 1.5 * constant;
        Self { constant, heat_capacity, excluded_volume: 0.0, attraction: 0.0, temperature, volume }
    }

    fn check(&self) -> Result<(), Error> {
        let free = self.volume - self.excluded_volume;
        positive([
            ("gas.constant", self.constant),
            ("gas.heat_capacity", self.heat_capacity),
            ("gas.temperature", self.temperature),
            ("gas.volume", self.volume),
            ("gas.volume - gas.excluded_volume", free),
        ])?;
        not_negative([
            ("gas.excluded_volume", self.excluded_volume),
            ("gas.attraction", self.attraction),
        ])?;
        Ok(())
    }

    /// The energy `U(S, V)`, by a logarithm, which is no number where `V < b`.
    fn energy(&self, s: Real, volume: Real) -> Real {
        let free = (volume - self.excluded_volume) / (self.volume - self.excluded_volume);
        let log = (s - free.ln() * self.constant) / self.heat_capacity;
        log.exp() * (self.heat_capacity * self.temperature) - volume.recip() * self.attraction
    }

    /// Returns the entropy `S = C ln(T/T₀) + Nk ln((V − b)/(V₀ − b))`, J/K.
    #[must_use]
    pub fn entropy(&self, temperature: f64, volume: f64) -> f64 {
        let free = (volume - self.excluded_volume) / (self.volume - self.excluded_volume);
        self.heat_capacity * (temperature / self.temperature).ln() + self.constant * free.ln()
    }
}

/// A piston on a thermally insulated gas, with friction that warms the gas, as `(q, p, S)` (Gay-Balmaz and Yoshimura 2017; Bajo, de
/// León and López-Gordón 2025):
///
/// ```math
/// H = \frac{p^2}{2m} + U(S, Aq) + F q, \qquad
/// \dot q = p/m, \qquad \dot p = A P - F - \lambda p/m, \qquad T \dot S = \lambda (p/m)^2 .
/// ```
///
/// An ideal gas ends at rest with `T = E/(C + Nk)` and `q = Nk T/F`. Without friction, small motions have the frequency
/// `ω² = γ P A²/mV`, `γ = 1 + Nk/C` (Rüchhardt 1929).
///
/// ```
/// use metriplectic_integrators::{DormandPrince8, Error, Method, Span};
/// use metriplectic_models::{DampedPiston, Gas};
///
/// # fn main() -> Result<(), Error> {
/// // A litre of argon below a piston of 5 kg, whose weight it bears.
/// let piston = DampedPiston {
///     mass: 5.0, area: 5e-4, force: 49.0, friction: 2.0, gas: Gas::ideal(0.33, 300.0, 1e-3),
/// };
/// let start = piston.start(1.8, 0.0, 300.0);
/// let run = DormandPrince8.run(&piston.system()?, start, Span::until(10.0).tolerance(1e-9))?;
/// assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DampedPiston {
    /// The mass `m` of the piston, kg.
    pub mass: f64,
    /// Its area `A`, m².
    pub area: f64,
    /// The force `F` that presses it on the gas, N: its weight, or the pressure of the air times its area.
    pub force: f64,
    /// Its friction `λ`, kg/s.
    pub friction: f64,
    /// The gas.
    pub gas: Gas,
}

impl DampedPiston {
    /// Returns the system.
    ///
    /// # Errors
    ///
    /// [`ParameterError`](crate::ParameterError), as an [`Error`]: mass, area and the values of the gas are positive; friction, attraction
    /// and excluded volume may vanish; the force is finite.
    pub fn system(
        self,
    ) -> Result<
        OnEuclidean<
            3,
            ConstantPoisson<3>,
            impl Fn(&Vector3<Real>, &Vector3<Real>) -> [Contact<Vector3<Real>>; 1] + Copy,
            impl Fn(&Vector3<Real>) -> Real + Copy,
            impl Fn(&Vector3<Real>) -> Real + Copy,
        >,
        Error,
    > {
        let Self { mass, area, force, friction, gas } = self;
        gas.check()?;
        positive([("mass", mass), ("area", area)])?;
        not_negative([("friction", friction)])?;
        finite([("force", force)])?;
        let canonical = matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0];
        let units = vector![
            (gas.volume / area).powi(-2),
            (mass * gas.constant * gas.temperature).recip(),
            gas.constant.powi(-2)
        ];
        let system = System::on(Euclidean::<3>)
            .metric(Metric::constant(Matrix3::from_diagonal(&units))?)
            .bracket(Poisson::constant(canonical)?)
            .energy(move |x: &Vector3<Real>| {
                x.y.powi(2) * (0.5 / mass) + gas.energy(x.z, x.x * area) + x.x * force
            })
            .entropy(|x: &Vector3<Real>| x.z)
            .dissipation(OnsagerDissipation(move |_: &Vector3<Real>, w: &Vector3<Real>| {
                // w = (.., p/m, T).
                [Contact {
                    rate: w.z.recip() * friction,
                    along: vector![Real::from(0.0), w.z, -w.y],
                }]
            }))
            .build()?;
        Ok(system)
    }

    /// Returns the state with the piston at `q` (m), its momentum `p` (kg m/s) and the temperature of the gas (K).
    #[must_use]
    pub fn start(&self, q: f64, p: f64, temperature: f64) -> Vector3<f64> {
        vector![q, p, self.gas.entropy(temperature, self.area * q)]
    }
}
