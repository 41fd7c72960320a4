//! The result of a fit.

use std::fmt;

use nalgebra::{DMatrix, DVector};

use crate::bounds::{Bound, WITHOUT};
use crate::covariance::Covariance;
use crate::least_squares::Squares;
use crate::robust::Robust;
use crate::unknowns::Unknown;

/// An estimate of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Estimate {
    /// Its name; that of a coordinate of the start is `start`.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its standard error, in the same unit; NaN if a bound [holds](Self::held) it.
    pub standard_error: f64,
    /// Whether its logarithm was fitted.
    pub positive: bool,
    /// Whether the data do not tell it from its bound, zero: its logarithm is uncertain by more than 1.
    pub at_bound: bool,
    /// The bounds that were [asked for](crate::FitBuilder::between); infinite without them.
    pub bounds: [f64; 2],
    /// The bound that holds it: it is there to the last bit, and the residuals still fall beyond. It has no standard error then.
    pub held: Option<Bound>,
}

impl Estimate {
    /// The interval of `q` standard errors; `θ̂ exp(±q s/θ̂)` if the logarithm was fitted. It ends at the bounds, and is NaN if one of
    /// them [holds](Self::held) the estimate.
    pub fn interval(&self, q: f64) -> [f64; 2] {
        let Self { value, standard_error, positive, bounds: [lower, upper], .. } = *self;
        if positive {
            [-q, q].map(|q| (value * (q * standard_error / value).exp()).clamp(lower, upper))
        } else {
            [-q, q].map(|q| (value + q * standard_error).clamp(lower, upper))
        }
    }
}

/// The end of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Ending {
    /// At a minimum of the sum of squares, to a tenth of a standard error.
    Minimum,
    /// In a flat valley: the iterations ran out, or went on without an effect, where the linear model promises a step of less than a
    /// tenth of a standard error, along a combination that the data hardly see. The errors say how wide the valley is.
    FlatValley,
}

/// The square of the distance to the minimum, in standard errors, at which a valley is flat.
pub(crate) const FLAT: f64 = 1e-2;

/// The [fraction](Covariance::fraction) of the columns below which iterations without an end are those in a valley.
const NARROW: f64 = 1e-3;

/// A correlation from which on two estimates are named together.
const CORRELATED: f64 = 0.95;

/// The result of a fit. It prints each parameter with its standard error, and what the data cannot tell apart.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Fitted {
    /// The estimates: free parameters, and then coordinates of a free start, in the chart at its guess.
    pub estimates: Vec<Estimate>,
    /// All parameters of the family, fixed ones too.
    pub parameters: Vec<f64>,
    /// The entries of the start.
    pub start: Vec<f64>,
    /// The sum that was minimised: of squares of residuals in units of the noise, or of residuals themselves if it is not known; with a
    /// robust loss that of `C² ρ(r²/C²)`, which is twice the cost of SciPy.
    pub chi_squared: f64,
    /// The numbers that were measured less the unknowns that no bound holds.
    pub degrees: usize,
    /// The noise that the residuals show, `√(χ²/degrees)`: near 1 if it was given and the model is right. With a robust loss it is the one
    /// with which a fit by squares would have these standard errors.
    pub noise: f64,
    /// The loss, if it was not that of squares.
    pub robust: Option<Robust>,
    /// The residuals beyond the scale of the loss; 0 without one.
    pub beyond: usize,
    /// Whether the noise was given.
    pub noise_is_known: bool,
    /// The runs that were made.
    pub runs: u64,
    /// The end of the iterations.
    pub ending: Ending,
    /// The covariance of the unknowns: parameters, or their logarithms. Those that a bound holds have NaN.
    pub covariance: Covariance,
}

/// The numbers that a result is made of.
pub(crate) struct Parts<'a> {
    pub(crate) unknowns: &'a [Unknown],
    pub(crate) phi: &'a [f64],
    pub(crate) squares: &'a Squares,
    pub(crate) parameters: Vec<f64>,
    pub(crate) start: Vec<f64>,
    pub(crate) noise_is_known: bool,
    pub(crate) runs: u64,
    pub(crate) stop: Stop,
    pub(crate) held: Vec<Option<Bound>>,
    pub(crate) robust: Option<Robust>,
}

/// The reason for which the iterations stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stop {
    /// By the conditions of a minimum.
    Converged,
    /// Several iterations in a row had no effect, or there were as many as were allowed.
    Unfinished,
}

impl Fitted {
    pub(crate) fn new(parts: Parts<'_>) -> Self {
        let Parts {
            unknowns,
            phi,
            squares,
            parameters,
            start,
            noise_is_known,
            runs,
            stop,
            held,
            robust,
        } = parts;
        let held = |i: usize| held.get(i).copied().flatten();
        let free: Vec<usize> = (0..phi.len()).filter(|&i| held(i).is_none()).collect();
        let residuals = squares.residuals.as_slice();
        let degrees = residuals.len() - free.len();
        let chi_squared = robust.map_or_else(|| squares.sum(), |loss| loss.sum(residuals));
        let variance = match robust {
            Some(loss) => loss.spread(residuals, free.len()).variance,
            None => chi_squared / degrees as f64,
        };
        let is_unit = noise_is_known && robust.is_none();
        let covariance =
            Covariance::of_some(&squares.jacobian, &free, if is_unit { 1.0 } else { variance });
        let estimates = (phi.iter().enumerate())
            .map(|(i, &phi)| {
                let error = covariance.standard_error(i);
                match unknowns.get(i) {
                    Some(unknown) => {
                        let value = unknown.parameter(phi);
                        let held = held(i);
                        let is_wide = error > 1.0 || error.is_nan();
                        Estimate {
                            name: unknown.name,
                            value,
                            standard_error: error * unknown.slope(value),
                            positive: unknown.positive,
                            at_bound: unknown.positive && held.is_none() && is_wide,
                            bounds: unknown.bounds,
                            held,
                        }
                    }
                    None => Estimate {
                        name: "start",
                        value: phi,
                        standard_error: error,
                        positive: false,
                        at_bound: false,
                        bounds: WITHOUT,
                        held: None,
                    },
                }
            })
            .collect();
        let noise = variance.sqrt();
        let beyond = robust.map_or(0, |loss| {
            residuals.iter().filter(|residual| residual.abs() > loss.scale()).count()
        });
        let ending = match stop {
            Stop::Unfinished if covariance.fraction <= NARROW => Ending::FlatValley,
            Stop::Converged | Stop::Unfinished => Ending::Minimum,
        };
        Self {
            estimates,
            parameters,
            start,
            chi_squared,
            degrees,
            noise,
            noise_is_known,
            robust,
            beyond,
            runs,
            ending,
            covariance,
        }
    }

    /// The estimate of a parameter; `None` if it was not free.
    pub fn estimate(&self, name: &str) -> Option<&Estimate> {
        self.estimates.iter().find(|estimate| estimate.name == name)
    }

    /// The correlations of the unknowns.
    pub fn correlations(&self) -> DMatrix<f64> {
        let n = self.estimates.len();
        DMatrix::from_fn(n, n, |i, j| if i == j { 1.0 } else { self.covariance.correlation(i, j) })
    }

    /// The names that the data cannot tell apart: those in a combination that no residual depends on.
    pub fn not_told_apart(&self) -> Vec<&'static str> {
        self.named(&self.covariance.unseen)
    }

    /// The names in the combination that the residuals depend on least.
    pub fn flattest(&self) -> Vec<&'static str> {
        self.named(std::slice::from_ref(&self.covariance.flattest))
    }

    /// The names of estimates with a part in one of some directions.
    fn named(&self, directions: &[DVector<f64>]) -> Vec<&'static str> {
        let is_in = |k: usize| directions.iter().any(|along| along[k].abs() > 0.1 * along.amax());
        let named = self.estimates.iter().enumerate().filter(|(k, _)| is_in(*k));
        named.map(|(_, estimate)| estimate.name).collect()
    }
}

impl fmt::Display for Fitted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for Estimate { name, value, standard_error, at_bound, held, .. } in &self.estimates {
            if let Some(bound) = held {
                let side = match bound {
                    Bound::Lower => "lower",
                    Bound::Upper => "upper",
                };
                writeln!(
                    f,
                    "{name:>12} = {value:.9} is held at its {side} bound: the residuals still fall beyond it, so it has no standard \
                     error, and those of the others are at this value"
                )?;
            } else if *at_bound {
                writeln!(
                    f,
                    "{name:>12} is at its bound: the data do not tell {value:.3e} from zero"
                )?;
            } else {
                writeln!(f, "{name:>12} = {value:.9} ± {standard_error:.1e}")?;
            }
        }
        let n = self.estimates.len();
        for i in 0..n {
            for j in i + 1..n {
                let correlation = self.covariance.correlation(i, j);
                if correlation.abs() > CORRELATED {
                    let [a, b] = [i, j].map(|k| self.estimates[k].name);
                    writeln!(
                        f,
                        "{a} and {b} are correlated by {correlation:.4}: their errors go together"
                    )?;
                }
            }
        }
        let together = self.not_told_apart();
        if !together.is_empty() {
            writeln!(f, "the data do not tell apart: {}; fix one of them", together.join(", "))?;
        }
        if self.ending == Ending::FlatValley {
            let along = self.flattest().join(", ");
            writeln!(
                f,
                "the sum of squares is flat along {along}: further steps change it by less than the data can tell; fix one of \
                 them, or measure what tells them apart"
            )?;
        }
        let Self { chi_squared, degrees, noise, runs, beyond, .. } = self;
        if let Some(loss) = self.robust {
            if noise.is_infinite() {
                writeln!(
                    f,
                    "so many residuals are beyond the scale of the loss that nothing says how they scatter: there are no standard \
                     errors, take a larger scale"
                )?;
            }
            let all = degrees + self.estimates.iter().filter(|one| one.held.is_none()).count();
            write!(
                f,
                "{loss:?}: Σ C²ρ = {chi_squared:.4e}, {beyond} of {all} residuals are beyond the scale, noise {noise:.3e} by {degrees} \
                 degrees of freedom, {runs} runs"
            )
        } else if self.noise_is_known {
            write!(f, "χ² = {chi_squared:.4e} for {degrees} degrees of freedom, {runs} runs")
        } else {
            write!(f, "noise {noise:.3e} by {degrees} degrees of freedom, {runs} runs")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// Two columns that differ by 10⁻⁴ of their length, with residuals that no step makes smaller.
    #[test]
    fn a_valley_without_an_end_is_a_sentence() {
        let unknowns =
            ["a", "b"].map(|name| Unknown { index: 0, name, positive: false, bounds: WITHOUT });
        let fitted = |apart: f64, stop: Stop| {
            let column = |i: usize| 1.0 + 0.1 * i as f64;
            let jacobian =
                DMatrix::from_fn(8, 2, |i, j| column(i) + if i % 2 == j { apart } else { 0.0 });
            let residuals = DVector::from_fn(8, |i, _| if i % 4 < 2 { 0.1 } else { -0.1 });
            Fitted::new(Parts {
                unknowns: &unknowns,
                phi: &[1.0, 2.0],
                squares: &Squares { residuals, jacobian },
                parameters: vec![1.0, 2.0],
                start: Vec::new(),
                noise_is_known: false,
                runs: 9,
                stop,
                held: Vec::new(),
                robust: None,
            })
        };
        let flat = fitted(1e-4, Stop::Unfinished);
        assert_eq!(flat.ending, Ending::FlatValley);
        assert_eq!(flat.flattest(), ["a", "b"]);
        assert!(flat.to_string().contains("flat along a, b"), "{flat}");
        // The same at a minimum, or with columns that the data tell apart, is none.
        for (apart, stop) in [(1e-4, Stop::Converged), (0.5, Stop::Unfinished)] {
            let other = fitted(apart, stop);
            assert!(other.ending == Ending::Minimum && !other.to_string().contains("flat"));
        }
    }
}
