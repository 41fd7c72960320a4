//! Two gases with a moving wall between them.

use metriplectic_dynamics::bracket::ConstantPoisson;
use metriplectic_dynamics::{Contact, OnsagerDissipation, Poisson, System};
use metriplectic_fields::Real;
use metriplectic_integrators::Error;
use metriplectic_manifolds::{Euclidean, Metric};
use nalgebra::{Matrix4, Vector4, matrix, vector};
use num_dual::DualNum;

use crate::OnEuclidean;
use crate::parameter::{not_negative, positive};

/// Two containers of a monatomic ideal gas with a wall between them that moves and leaks heat, as `(q, p, S₁, S₂)`
/// (Öttinger 2018, eq. 1; Shang and Öttinger 2020, §5):
///
/// ```math
/// H = \frac{p^2}{2m} + U_1 + U_2, \qquad S = S_1 + S_2, \qquad
/// U_i = \tfrac32 N k\, T_0 \Bigl(\frac{\ell/2}{q_i}\Bigr)^{2/3} \exp\frac{2 S_i}{3 N k}, \qquad q_1 = q, \; q_2 = \ell - q
/// ```
/// ```math
/// \dot q = p/m, \qquad \dot p = \frac{2 U_1}{3 q} - \frac{2 U_2}{3 (\ell - q)}, \qquad
/// T_1 \dot S_1 = \alpha \Bigl(\frac{1}{T_1} - \frac{1}{T_2}\Bigr) = -T_2 \dot S_2, \qquad T_i = \frac{2 U_i}{3 N k}.
/// ```
///
/// An entropy is zero at the temperature `T₀` with the wall in the middle. The state exists for `0 < q < ℓ`, and ends at
/// rest with `q = ℓ/2` and `T₁ = T₂ = E/3Nk`. The containers of Gruber, Gunzburger, Ju and Wang (2023) have `m = Nk = 1`, `ℓ = 2`,
/// `T₀ = 2/3` and `α = 8`.
///
/// ```
/// use metriplectic_integrators::{Error, Gauss, Method, Span};
/// use metriplectic_models::TwoGasContainers;
///
/// # fn main() -> Result<(), Error> {
/// // A wall of 1 g between two tubes of 10 cm, each with a millimole of helium.
/// let tubes = TwoGasContainers {
///     mass: 1e-3, length: 0.2, gas: 8.314e-3, temperature: 300.0, conductance: 10.0,
/// };
/// let start = tubes.start(0.12, 0.0, [300.0, 400.0]);
/// let run = Gauss::<2>.run(&tubes.system()?, start, Span::until(0.1).tolerance(1e-8))?;
/// assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoGasContainers {
    /// The mass `m` of the wall, kg.
    pub mass: f64,
    /// The length `ℓ` of both containers together, m.
    pub length: f64,
    /// The constant `Nk` of each gas, J/K: moles times 8.314 J/(K mol).
    pub gas: f64,
    /// The temperature `T₀` at which the entropies are zero, K.
    pub temperature: f64,
    /// The conductance `α` of the wall, W K: the heat flow over `1/T₁ − 1/T₂`.
    pub conductance: f64,
}

impl TwoGasContainers {
    /// Returns the system.
    ///
    /// # Errors
    ///
    /// [`ParameterError`](crate::ParameterError), as an [`Error`], if a parameter is not positive, or the conductance negative.
    pub fn system(
        self,
    ) -> Result<
        OnEuclidean<
            4,
            ConstantPoisson<4>,
            impl Fn(&Vector4<Real>, &Vector4<Real>) -> [Contact<Vector4<Real>>; 1] + Copy,
            impl Fn(&Vector4<Real>) -> Real + Copy,
            impl Fn(&Vector4<Real>) -> Real + Copy,
        >,
        Error,
    > {
        let Self { mass, length, gas, temperature, conductance } = self;
        positive([("mass", mass), ("length", length), ("gas", gas), ("temperature", temperature)])?;
        not_negative([("conductance", conductance)])?;
        let canonical = matrix![0.0, 1.0, 0.0, 0.0; -1.0, 0.0, 0.0, 0.0; 0.0, 0.0, 0.0, 0.0; 0.0, 0.0, 0.0, 0.0];
        let units = vector![
            length.powi(-2),
            (mass * gas * temperature).recip(),
            gas.powi(-2),
            gas.powi(-2)
        ];
        // By the logarithm, which is no number where the wall has left the containers.
        let inner = move |q: Real, s: Real| {
            ((s / gas - (q * (2.0 / length)).ln()) * (2.0 / 3.0)).exp() * (1.5 * gas * temperature)
        };
        let system = System::on(Euclidean::<4>)
            .metric(Metric::constant(Matrix4::from_diagonal(&units))?)
            .bracket(Poisson::constant(canonical)?)
            .energy(move |x: &Vector4<Real>| {
                x.y.powi(2) * (0.5 / mass) + inner(x.x, x.z) + inner(-x.x + length, x.w)
            })
            .entropy(|x: &Vector4<Real>| x.z + x.w)
            .dissipation(OnsagerDissipation(move |_: &Vector4<Real>, w: &Vector4<Real>| {
                // w = (.., .., T₁, T₂).
                let zero = Real::from(0.0);
                [Contact {
                    rate: (w.z * w.w).powi(-2) * conductance,
                    along: vector![zero, zero, w.w, -w.z],
                }]
            }))
            .build()?;
        Ok(system)
    }

    /// Returns the state with the wall at `q` (m), its momentum `p` (kg m/s) and the temperatures of the gases (K).
    #[must_use]
    pub fn start(&self, q: f64, p: f64, temperatures: [f64; 2]) -> Vector4<f64> {
        let entropy = |q: f64, t: f64| {
            self.gas * ((2.0 * q / self.length).ln() + 1.5 * (t / self.temperature).ln())
        };
        vector![q, p, entropy(q, temperatures[0]), entropy(self.length - q, temperatures[1])]
    }
}
