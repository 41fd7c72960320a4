//! Heat in a rod.

use metriplectic_dynamics::bracket::Zero;
use metriplectic_dynamics::{FieldDissipation, System};
use metriplectic_fields::Real;
use metriplectic_integrators::Error;
use metriplectic_manifolds::{Canonical, Euclidean};
use nalgebra::{SMatrix, SVector};
use num_dual::DualNum;

use crate::parameter::positive;

/// An insulated rod of `N` cells that conducts heat, as their temperatures `T_i` (Fourier 1822):
///
/// ```math
/// H = C \sum_i T_i, \qquad S = C \sum_i \ln T_i, \qquad K = G \sum_i T_i T_{i+1}\, b_i b_i^{\mathsf T}, \qquad
/// b_i = e_i/w_i - e_{i+1}/w_{i+1}
/// ```
/// ```math
/// C\, \dot T_i = G\, (T_{i+1} - 2 T_i + T_{i-1}), \qquad C = c A\, \Delta x, \quad G = k A/\Delta x, \quad \Delta x = L/N .
/// ```
///
/// The mode `cos(πn(i + ½)/N)`, `i` from 0, decays at the rate `4 (G/C) sin²(πn/2N)`. A rod of more than 256 cells is a
/// [lattice](https://docs.rs/metriplectic/latest/metriplectic/lattices/index.html).
///
/// ```
/// use metriplectic_integrators::{Error, Method, Radau, Span};
/// use metriplectic_models::HeatRod;
/// use nalgebra::SVector;
///
/// # fn main() -> Result<(), Error> {
/// // Ten centimetres of copper, half of it hot.
/// let rod = HeatRod { length: 0.1, cross_section: 1e-4, conductivity: 400.0, heat_capacity: 3.45e6 };
/// let start = SVector::<f64, 8>::from_fn(|i, _| if i < 4 { 400.0 } else { 300.0 });
/// let run = Radau::<2>.run(&rod.system::<8>()?, start, Span::until(1000.0).tolerance(1e-6))?;
/// assert!(run.certificate().keeps_energy() && (run.last().point.max() - 350.0).abs() < 1e-3);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeatRod {
    /// The length `L`, m.
    pub length: f64,
    /// The cross-section `A`, m².
    pub cross_section: f64,
    /// The thermal conductivity `k`, W/(m K).
    pub conductivity: f64,
    /// The heat capacity `c` per volume, J/(m³ K).
    pub heat_capacity: f64,
}

impl HeatRod {
    /// Returns the system of a rod of `N` cells.
    ///
    /// # Errors
    ///
    /// [`ParameterError`](crate::ParameterError), as an [`Error`], if a parameter is not positive.
    pub fn system<const N: usize>(
        self,
    ) -> Result<
        System<
            Euclidean<N>,
            Canonical,
            Zero,
            FieldDissipation<
                impl Fn(&SVector<Real, N>, &SVector<Real, N>) -> SMatrix<Real, N, N> + Copy,
            >,
            impl Fn(&SVector<Real, N>) -> Real + Copy,
            impl Fn(&SVector<Real, N>) -> Real + Copy,
        >,
        Error,
    > {
        let Self { length, cross_section, conductivity, heat_capacity } = self;
        positive([("length", length), ("cross_section", cross_section)])?;
        positive([("conductivity", conductivity), ("heat_capacity", heat_capacity)])?;
        let cell = length / N as f64;
        let capacity = heat_capacity * cross_section * cell;
        let conductance = conductivity * cross_section / cell;
        let system = System::on(Euclidean::<N>)
            .energy(move |t: &SVector<Real, N>| t.sum() * capacity)
            .entropy(move |t: &SVector<Real, N>| t.iter().map(|t| t.ln()).sum::<Real>() * capacity)
            .dissipation(FieldDissipation(move |t: &SVector<Real, N>, w: &SVector<Real, N>| {
                let mut k = SMatrix::<Real, N, N>::zeros();
                for i in 1..N {
                    let rate = t[i - 1] * t[i] * conductance;
                    let (left, right) = (w[i - 1].recip(), w[i].recip());
                    k[(i - 1, i - 1)] += rate * left * left;
                    k[(i - 1, i)] -= rate * left * right;
                    k[(i, i - 1)] -= rate * left * right;
                    k[(i, i)] += rate * right * right;
                }
                k
            }))
            .build()?;
        Ok(system)
    }
}
