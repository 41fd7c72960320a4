//! Two masses on elastic threads that exchange heat.

use metriplectic_dynamics::bracket::ConstantPoisson;
use metriplectic_dynamics::invariants::Momentum;
use metriplectic_dynamics::{Contact, OnsagerDissipation, Poisson, System};
use metriplectic_fields::Real;
use metriplectic_integrators::Error;
use metriplectic_manifolds::{Euclidean, Metric};
use nalgebra::{SMatrix, SVector};
use num_dual::DualNum;

use crate::OnEuclidean;
use crate::parameter::{finite, not_negative, positive};

type State<D> = SVector<D, 10>;

/// The thermoelastic double pendulum in the plane, as `(q₁, q₂, p₁, p₂, s₁, s₂)` (Romero 2009; Hernández, Badías, González,
/// Chinesta and Cueto 2021): a mass hangs from the origin on an elastic thread, and a second mass from the first.
///
/// ```math
/// H = \frac{|p_1|^2}{2m_1} + \frac{|p_2|^2}{2m_2} + e_1 + e_2, \qquad S = s_1 + s_2, \qquad
/// \theta_1 \dot s_1 = \kappa (\theta_2 - \theta_1) = -\theta_2 \dot s_2
/// ```
/// ```math
/// e_i = \tfrac12 C_i \ln^2\frac{\lambda_i}{l_i} + \beta \theta_0 \ln\frac{\lambda_i}{l_i}
///     + c\, \theta_0 \Bigl(\exp\frac{s_i - \beta \ln(\lambda_i/l_i)}{c} - 1\Bigr), \qquad \theta_i = \frac{\partial e_i}{\partial s_i},
/// ```
///
/// with the lengths `λ₁ = |q₁|`, `λ₂ = |q₂ − q₁|` of the threads. The angular momentum `Σ q × p` is conserved. A thread of its natural
/// length with `s = 0` has the temperature `θ₀` and no tension.
///
/// ```
/// use metriplectic_integrators::{DormandPrince8, Error, Method, Span};
/// use metriplectic_models::ThermoelasticDoublePendulum;
/// use nalgebra::SVector;
///
/// # fn main() -> Result<(), Error> {
/// let pendulum = ThermoelasticDoublePendulum {
///     masses: [1.0, 2.0], lengths: [2.0, 1.0], stiffness: [0.019, 0.188], coupling: 0.087,
///     heat_capacity: 5.0, temperature: 300.0, conductance: 300.0,
/// };
/// let start = SVector::from([4.5, 4.5, 2.0, 4.5, -0.5, 1.5, 1.4, -0.2, 0.0, 0.0]);
/// let run = DormandPrince8.run(&pendulum.system()?, start, Span::until(3.0).tolerance(1e-9))?;
/// assert!(run.certificate().keeps_energy() && run.certificate().keeps_invariants());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThermoelasticDoublePendulum {
    /// The masses `m₁`, `m₂`, kg.
    pub masses: [f64; 2],
    /// The natural lengths `l₁`, `l₂` of the threads, m.
    pub lengths: [f64; 2],
    /// Their stiffnesses `C₁`, `C₂`, J.
    pub stiffness: [f64; 2],
    /// Their thermoelastic coupling `β`, J/K; a positive one cools a thread that is stretched.
    pub coupling: f64,
    /// The heat capacity `c` of each, J/K.
    pub heat_capacity: f64,
    /// The temperature `θ₀` at which they have their natural lengths, K.
    pub temperature: f64,
    /// The conductance `κ` between them, W/K.
    pub conductance: f64,
}

impl ThermoelasticDoublePendulum {
    /// Returns the system, with its angular momentum as a further invariant.
    ///
    /// # Errors
    ///
    /// [`ParameterError`](crate::ParameterError), as an [`Error`]: all parameters are positive, except that the coupling may have either
    /// sign and the conductance may vanish.
    pub fn system(
        self,
    ) -> Result<
        OnEuclidean<
            10,
            ConstantPoisson<10>,
            impl Fn(&State<Real>, &State<Real>) -> [Contact<State<Real>>; 1] + Copy,
            impl Fn(&State<Real>) -> Real + Copy,
            impl Fn(&State<Real>) -> Real + Copy,
            ((), Momentum<impl Fn(&State<Real>) -> Real + Copy>),
        >,
        Error,
    > {
        let Self { masses, lengths, stiffness, coupling, heat_capacity, temperature, conductance } =
            self;
        positive([("masses[0]", masses[0]), ("masses[1]", masses[1])])?;
        positive([("lengths[0]", lengths[0]), ("lengths[1]", lengths[1])])?;
        positive([("stiffness[0]", stiffness[0]), ("stiffness[1]", stiffness[1])])?;
        positive([("heat_capacity", heat_capacity), ("temperature", temperature)])?;
        not_negative([("conductance", conductance)])?;
        finite([("coupling", coupling)])?;
        let thread = move |i: usize, squared: Real, s: Real| {
            let log = squared.ln() * 0.5 - lengths[i].ln();
            let heat = ((s - log * coupling) / heat_capacity).exp_m1();
            log.powi(2) * (0.5 * stiffness[i])
                + log * (coupling * temperature)
                + heat * (heat_capacity * temperature)
        };
        let units = State::from_fn(|i, _| match i {
            0..4 => lengths[0].powi(-2),
            4..8 => (masses[i / 6] * heat_capacity * temperature).recip(),
            _ => heat_capacity.powi(-2),
        });
        let system = System::on(Euclidean::<10>)
            .metric(Metric::constant(SMatrix::from_diagonal(&units))?)
            .bracket(Poisson::constant(SMatrix::from_fn(|i, j| {
                f64::from(u8::from(i < 4 && j == i + 4)) - f64::from(u8::from(j < 4 && i == j + 4))
            }))?)
            .energy(move |x: &State<Real>| {
                let upper = x[0].powi(2) + x[1].powi(2);
                let lower = (x[2] - x[0]).powi(2) + (x[3] - x[1]).powi(2);
                (x[4].powi(2) + x[5].powi(2)) * (0.5 / masses[0])
                    + (x[6].powi(2) + x[7].powi(2)) * (0.5 / masses[1])
                    + thread(0, upper, x[8])
                    + thread(1, lower, x[9])
            })
            .entropy(|x: &State<Real>| x[8] + x[9])
            .dissipation(OnsagerDissipation(move |_: &State<Real>, w: &State<Real>| {
                // w = (.., θ₁, θ₂).
                [Contact {
                    rate: (w[8] * w[9]).recip() * conductance,
                    along: State::ith(8, w[9]) - State::ith(9, w[8]),
                }]
            }))
            .momentum(|x: &State<Real>| x[0] * x[5] - x[1] * x[4] + x[2] * x[7] - x[3] * x[6])
            .build()?;
        Ok(system)
    }
}
