//! The bias of a mean over noisy paths, by steps that are doubled on the same paths.
//!
//! A mean in steps of size `h` is `m_h = m + C h^p + …`, with the weak order `p` of the method. So `m_{2h} − m_h` is `2^p − 1` times the bias
//! `C h^p` (Talay and Tubaro 1990). The runs with `h`, `2h` and `4h` have the same Brownian paths, so their differences have a far smaller
//! spread than the means.

use std::fmt;
use std::thread;

use metriplectic_integrators::{Error, Sampler, Span};

use crate::estimate::Estimate;

/// A measurement of the bias that steps of size `h` give to a mean over noisy paths.
///
/// ```
/// use metriplectic_dynamics::noise::Boltzmann;
/// use metriplectic_dynamics::System;
/// use metriplectic_ensembles::Doubling;
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{DormandPrince5, Method, NinomiyaVictoir, NoiseBuilder};
/// use metriplectic_manifolds::LieDual;
/// use nalgebra::{Vector3, vector};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let body = System::on(LieDual::so3())
///     .energy(|p: &Vector3<Real>| p.x * p.x / 6.0 + p.y * p.y / 4.0 + p.z * p.z * 0.5)
///     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
///     .noise(Boltzmann(0.15))
///     .build()?;
/// let doubling = Doubling { h: 0.05, steps: 40, paths: 200, order: 2.0 };
/// let bias = doubling.measure(|path| {
///     let method = path.sampler(NinomiyaVictoir(DormandPrince5).seed(7));
///     let run = method.run(&body, vector![0.4, 0.5, 0.3], path.span())?;
///     Ok(run.last().point.norm_squared())
/// })?;
/// println!("{bias}");
/// println!("take h = {:.2} for a bias below 1e-4", bias.step_for(1e-4)?);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Doubling {
    /// The size of the steps.
    pub h: f64,
    /// The number of the steps, a multiple of 4.
    pub steps: usize,
    /// The number of paths.
    pub paths: u64,
    /// The weak order of the mean: 1 with [`RandomFlow`](metriplectic_integrators::RandomFlow), 2 with
    /// [`NinomiyaVictoir`](metriplectic_integrators::NinomiyaVictoir), less for first passages
    /// ([`Watched::bridged`](metriplectic_integrators::Watched::bridged)).
    pub order: f64,
}

/// A path in steps of one of the three sizes.
#[derive(Clone, Copy, Debug)]
pub struct DoubledPath {
    doubling: Doubling,
    path: u64,
    doublings: u32,
}

impl DoubledPath {
    /// The number of the path.
    #[must_use]
    pub const fn number(&self) -> u64 {
        self.path
    }

    /// The size of its steps: `h`, `2h` or `4h`.
    #[must_use]
    pub fn h(&self) -> f64 {
        self.doubling.h * f64::from(1_u32 << self.doublings)
    }

    /// The steps of the path.
    #[must_use]
    pub fn span(&self) -> Span {
        Span::steps(self.h(), self.doubling.steps >> self.doublings)
    }

    /// A method with the numbers of the path.
    #[must_use]
    pub fn sampler<S>(&self, sampler: Sampler<S>) -> Sampler<S> {
        sampler.path(self.path).coarsened(self.doublings)
    }
}

impl Doubling {
    /// Runs all paths in steps of size `h`, `2h` and `4h`, on all threads, and compares the means of a number of each path. The result does
    /// not depend on the number of threads.
    ///
    /// # Errors
    ///
    /// [`DoublingError`]; of runs that fail, that of the first path.
    pub fn measure(
        self,
        number: impl Fn(&DoubledPath) -> Result<f64, Error> + Sync,
    ) -> Result<StepBias, DoublingError> {
        self.check()?;
        let of_path = |path: u64| {
            let of_size = |doublings: u32| {
                let path = DoubledPath { doubling: self, path, doublings };
                let failed = |source| DoublingError::Run { path: path.path, h: path.h(), source };
                let value = number(&path).map_err(failed)?;
                let is_number = value.is_finite();
                let off = DoublingError::NotANumber { path: path.path, h: path.h(), value };
                if is_number { Ok(value) } else { Err(off) }
            };
            Ok([of_size(0)?, of_size(1)?, of_size(2)?])
        };
        let threads = thread::available_parallelism().map_or(1, usize::from) as u64;
        let share = self.paths.div_ceil(threads);
        let values: Result<Vec<[f64; 3]>, DoublingError> = thread::scope(|scope| {
            let of_path = &of_path;
            let handles: Vec<_> = (0..threads)
                .map(|k| (k * share).min(self.paths)..((k + 1) * share).min(self.paths))
                .map(|paths| scope.spawn(move || paths.map(of_path).collect::<Result<Vec<_>, _>>()))
                .collect();
            let mut all = Vec::new();
            for handle in handles {
                match handle.join() {
                    Ok(values) => all.extend(values?),
                    Err(panic) => std::panic::resume_unwind(panic),
                }
            }
            Ok(all)
        });
        Ok(StepBias::of(self, &values?))
    }

    fn check(&self) -> Result<(), DoublingError> {
        let Self { steps, paths, order, .. } = *self;
        if steps == 0 || steps % 4 != 0 {
            return Err(DoublingError::Steps { steps });
        }
        if paths < 2 {
            return Err(DoublingError::Paths { paths });
        }
        if !(order > 0.0 && order.is_finite()) {
            return Err(DoublingError::Order { order });
        }
        Ok(())
    }
}

/// The bias of a mean; measured by [`Doubling`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct StepBias {
    /// The steps with which it was measured.
    pub doubling: Doubling,
    /// The means in steps of size `h`, `2h` and `4h`.
    pub means: [Estimate; 3],
    /// The bias of the mean in steps of size `h`, with its standard error.
    pub bias: Estimate,
    /// The bias of the mean in steps of size `2h`, by those of size `4h`.
    pub bias_of_double: Estimate,
    /// The order of the bias by all three sizes; not a number where the two differences have no common sign.
    pub measured_order: Estimate,
    /// By how much the second difference differs from `2^p` times the first one, in units of that.
    off_order: Estimate,
}

impl StepBias {
    fn of(doubling: Doubling, values: &[[f64; 3]]) -> Self {
        let estimate = |number: &dyn Fn(&[f64; 3]) -> f64| Estimate::of(values.iter().map(number));
        let factor = doubling.order.exp2();
        let means = [0, 1, 2].map(|k: usize| estimate(&|m| m[k]));
        let bias = estimate(&|m| (m[1] - m[0]) / (factor - 1.0));
        let bias_of_double = estimate(&|m| (m[2] - m[1]) / (factor - 1.0));
        let ratio = bias_of_double.mean / bias.mean;
        let of_ratio = estimate(&|m| {
            ((m[2] - m[1]) - ratio * (m[1] - m[0])) / (means[1].mean - means[0].mean)
        });
        let measured_order = Estimate {
            mean: ratio.log2(),
            standard_error: of_ratio.standard_error / (ratio * std::f64::consts::LN_2),
            count: values.len(),
        };
        let off_order = estimate(&|m| (m[2] - m[1]) / factor - (m[1] - m[0]));
        Self { doubling, means, bias, bias_of_double, measured_order, off_order }
    }

    /// The size of steps for which the bias of the mean is below a wanted one: `h (wanted/(|b| + 2 s))^{1/p}`, with the bias `b` at `h` and its
    /// standard error `s`, and at most `4h`. More paths make `s` smaller, and the answer larger where chance decides.
    ///
    /// # Errors
    ///
    /// [`StepAdviceError`].
    pub fn step_for(&self, wanted: f64) -> Result<f64, StepAdviceError> {
        let Self { doubling: Doubling { h, order, .. }, bias, measured_order, off_order, .. } =
            *self;
        if !(wanted > 0.0 && wanted.is_finite()) {
            return Err(StepAdviceError::NotPositive { wanted });
        }
        let difference = (self.means[1].mean - self.means[0].mean).abs();
        let off = off_order.mean.abs();
        if off > 3.0 * off_order.standard_error && off > 0.5 * difference {
            return Err(StepAdviceError::OffOrder { h, order, measured: measured_order.mean });
        }
        let most = bias.mean.abs() + 2.0 * bias.standard_error;
        Ok(h * (wanted / most).powf(order.recip()).min(4.0))
    }
}

impl fmt::Display for StepBias {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { doubling: Doubling { h, order, .. }, means, bias, measured_order, .. } = self;
        write!(f, "{} at h = {h}, of which the bias is {bias}", means[0])?;
        write!(f, "; it has the order {order}")?;
        if measured_order.mean.is_finite() {
            write!(f, ", measured {measured_order}")
        } else {
            Ok(())
        }
    }
}

/// Why the bias of a mean is not measured.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum DoublingError {
    /// Steps that cannot be doubled twice.
    #[error("{steps} steps cannot be doubled twice; take a multiple of 4")]
    Steps {
        /// The number of steps.
        steps: usize,
    },
    /// Too few paths for a standard error.
    #[error("{paths} paths have no standard error; take 2 or more, as 1000")]
    Paths {
        /// The number of paths.
        paths: u64,
    },
    /// An order that is not positive.
    #[error("the order {order} is not positive; take 1 with RandomFlow and 2 with NinomiyaVictoir")]
    Order {
        /// The order.
        order: f64,
    },
    /// A run that failed.
    #[error("path {path} in steps of size {h}: {source}")]
    Run {
        /// The path.
        path: u64,
        /// The size of its steps.
        h: f64,
        /// The error.
        source: Error,
    },
    /// A path without a number.
    #[error("path {path} in steps of size {h} gives {value}, which has no mean")]
    NotANumber {
        /// The path.
        path: u64,
        /// The size of its steps.
        h: f64,
        /// The value.
        value: f64,
    },
}

metriplectic_equations::debug_is_the_sentence!(DoublingError);

/// Why there is no advice on the size of steps.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepAdviceError {
    /// A bias that is not positive.
    #[error("a bias of {wanted} cannot be asked for; it must be positive")]
    NotPositive {
        /// The bias.
        wanted: f64,
    },
    /// The bias does not have its order.
    #[error(
        "the bias does not have the order {order} between h = {h} and 4h, but {measured:.1}: measure with smaller steps, or with the order of \
         this mean"
    )]
    OffOrder {
        /// The smallest steps.
        h: f64,
        /// The order that was given.
        order: f64,
        /// The order that was measured.
        measured: f64,
    },
}

metriplectic_equations::debug_is_the_sentence!(StepAdviceError);

metriplectic_integrators::passed_on_as_error!(DoublingError, StepAdviceError);
