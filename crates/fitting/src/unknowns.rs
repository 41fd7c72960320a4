//! The unknowns of a fit: free parameters, some by their logarithm.

use nalgebra::SVector;

use crate::bounds::Bounds;
use crate::error::FitError;

/// A free parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unknown {
    /// Which parameter of the family.
    pub index: usize,
    /// Its name.
    pub name: &'static str,
    /// Whether its logarithm is fitted, so that it stays positive.
    pub positive: bool,
    /// The least and the largest value of the parameter; infinite without a bound.
    pub bounds: [f64; 2],
}

impl Unknown {
    /// The unknown `φ`: the parameter, or its logarithm.
    pub fn of(&self, theta: f64) -> f64 {
        if self.positive { theta.ln() } else { theta }
    }

    /// The least and the largest unknown; those of a logarithm without a positive bound are infinite.
    pub fn range(&self) -> [f64; 2] {
        let [lower, upper] = self.bounds;
        [self.of(if self.positive { lower.max(0.0) } else { lower }), self.of(upper)]
    }

    /// The parameter of an unknown; at a bound it has the bits of the bound.
    pub fn parameter(&self, phi: f64) -> f64 {
        if !self.positive {
            return phi;
        }
        let ([lower, upper], [first, last]) = (self.bounds, self.range());
        if phi.is_infinite() {
            phi.exp()
        } else if phi <= first {
            lower
        } else if phi >= last {
            upper
        } else {
            phi.exp().clamp(lower, upper)
        }
    }

    /// The derivative `dθ/dφ`.
    pub fn slope(&self, theta: f64) -> f64 {
        if self.positive { theta } else { 1.0 }
    }
}

/// The parameters at unknowns: those of the guess, with the free ones in their places.
pub(crate) fn parameters<const P: usize>(
    guess: &SVector<f64, P>,
    unknowns: &[Unknown],
    phi: &[f64],
) -> SVector<f64, P> {
    let mut theta = *guess;
    for (unknown, phi) in unknowns.iter().zip(phi) {
        theta[unknown.index] = unknown.parameter(*phi);
    }
    theta
}

/// Names of parameters: some, or all.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) enum Names {
    /// None of them.
    #[default]
    None,
    /// All of them.
    All,
    /// These.
    Some(Vec<String>),
}

impl Names {
    fn has(&self, name: &str) -> bool {
        match self {
            Self::None => false,
            Self::All => true,
            Self::Some(names) => names.iter().any(|other| other == name),
        }
    }

    fn check(&self, known: &[&'static str]) -> Result<(), FitError> {
        let Self::Some(names) = self else { return Ok(()) };
        match names.iter().find(|name| !known.contains(&name.as_str())) {
            Some(name) => {
                Err(FitError::UnknownParameter { name: name.clone(), known: known.to_vec() })
            }
            None => Ok(()),
        }
    }
}

/// The free parameters of a guess.
pub(crate) fn unknowns(
    known: &[&'static str],
    guess: &[f64],
    [free, positive]: [&Names; 2],
    bounds: &Bounds,
) -> Result<Vec<Unknown>, FitError> {
    free.check(known)?;
    positive.check(known)?;
    let bounds = bounds.around(known, guess)?;
    let mut unknowns = Vec::new();
    for (index, &name) in known.iter().enumerate().filter(|(_, name)| free.has(name)) {
        let positive = positive.has(name);
        let value = guess[index];
        if positive && !(value > 0.0 && value.is_finite()) {
            return Err(FitError::NotPositive { name, value });
        }
        unknowns.push(Unknown { index, name, positive, bounds: bounds[index] });
    }
    if unknowns.is_empty() { Err(FitError::NothingFree) } else { Ok(unknowns) }
}
