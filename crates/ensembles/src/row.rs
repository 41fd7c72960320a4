//! One row of a sweep, as its closure sees it.

use std::fmt;
use std::ops::Index;
use std::sync::Arc;

use metriplectic_dynamics::system::Point;
use metriplectic_dynamics::{Metriplectic, ModelError, Verified};

use crate::draw::{Draw, OF_THE_ROW};

/// The rows up to this number verify their models in full.
const FIRST: usize = 2;
/// Rows whose number is a multiple of this one verify in full too.
const EVERY: usize = 256;

/// A row of a sweep: its number and its parameters by name.
pub struct Row {
    number: usize,
    names: Arc<[String]>,
    values: Box<[f64]>,
    seed: u64,
    #[cfg(feature = "serde")]
    pub(crate) long: Option<crate::long::LongRow>,
}

impl Row {
    pub(crate) const fn new(
        number: usize,
        names: Arc<[String]>,
        values: Box<[f64]>,
        seed: u64,
    ) -> Self {
        Self {
            number,
            names,
            values,
            seed,
            #[cfg(feature = "serde")]
            long: None,
        }
    }

    /// The number of the row, from 0.
    #[must_use]
    pub const fn number(&self) -> usize {
        self.number
    }

    /// The parameter of this name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<f64> {
        self.names.iter().position(|other| other == name).map(|k| self.values[k])
    }

    /// The parameters in the order of the plan.
    #[must_use]
    pub const fn values(&self) -> &[f64] {
        &self.values
    }

    /// The system of this row, verified: in full in rows 0, 1 and 2 and in each 256th, and at the start alone in the others.
    ///
    /// The rows of a sweep build their systems from the same closures with other parameters. To verify each of them at 17
    /// points costs as much as 150 steps. A run of the system that is returned checks its laws at its start and on its way,
    /// as each run does. Which rows are verified in full depends on their numbers alone, not on threads or shards.
    ///
    /// ```
    /// use metriplectic_dynamics::System;
    /// use metriplectic_ensembles::Sweep;
    /// use metriplectic_fields::Real;
    /// use metriplectic_integrators::{DormandPrince8, Method, Span};
    /// use metriplectic_manifolds::LieDual;
    /// use nalgebra::{Vector3, vector};
    /// let table = Sweep::new("spins")
    ///     .grid("spin", [0.1, 0.2, 0.3])
    ///     .run(|row| {
    ///         let body = System::on(LieDual::so3())
    ///             .energy(|p: &Vector3<Real>| p.x * p.x + p.y * p.y * 0.5 + p.z * p.z * 0.1)
    ///             .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
    ///             .build()?;
    ///         let start = vector![row["spin"], -1.0, 0.3];
    ///         let body = row.verified(&body, &start)?;
    ///         Ok(DormandPrince8.run(&body, start, Span::steps(0.1, 20))?)
    ///     })
    ///     .quiet()
    ///     .execute()?;
    /// assert_eq!(table.failed(), 0);
    /// # Ok::<(), metriplectic_ensembles::SweepError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`ModelError`] that names the law, the point and the size of the violation.
    pub fn verified<'a, Y: Metriplectic>(
        &self,
        system: &'a Y,
        start: &Point<Y>,
    ) -> Result<Verified<'a, Y>, ModelError> {
        if self.number <= FIRST || self.number.is_multiple_of(EVERY) {
            system.verified(start)
        } else {
            system.verified_as_member(start)
        }
    }

    /// Random numbers for the closure, from the seed and the number of the row alone. Each call begins the same stream.
    #[must_use]
    pub fn draw(&self) -> Draw {
        Draw::of(self.seed, OF_THE_ROW, self.number)
    }
}

/// The parameter of this name; [`Row::get`] does not panic.
///
/// # Panics
///
/// If there is none, which makes the row a failed one.
impl Index<&str> for Row {
    type Output = f64;

    fn index(&self, name: &str) -> &f64 {
        let at = self.names.iter().position(|other| other == name);
        match at {
            Some(k) => &self.values[k],
            None => panic!("the row has no parameter {name:?}; it has {}", self.names.join(", ")),
        }
    }
}

impl fmt::Debug for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parameters = self.names.iter().zip(&self.values);
        write!(f, "Row {} ", self.number)?;
        f.debug_map().entries(parameters).finish()
    }
}

#[cfg(test)]
mod tests {
    use metriplectic_dynamics::{Poisson, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Vector3, vector};

    use super::*;

    fn row(number: usize) -> Row {
        Row::new(number, Arc::from([]), Box::from([]), 0)
    }

    #[test]
    fn the_first_rows_verify_their_models_in_full_and_the_others_at_their_start() {
        // Π dS = 0 holds up to x = 1, and not beyond it.
        let bent = System::on(Euclidean::<3>)
            .bracket(Poisson::constant(Vector3::z().cross_matrix()).expect("a skew matrix"))
            .energy(|x: &Vector3<Real>| x.norm_squared())
            .entropy(|x: &Vector3<Real>| if x.x.re > 1.0 { x.z + x.x * (x.x - 1.0) } else { x.z })
            .build()
            .expect("a system");
        let [inside, outside] = [vector![0.99, 0.4, 0.3], vector![1.5, 0.4, 0.3]];
        for number in [0, 1, 2, 256, 512] {
            assert!(row(number).verified(&bent, &inside).is_err(), "row {number}");
        }
        for number in [3, 100, 255, 257] {
            assert!(row(number).verified(&bent, &inside).is_ok(), "row {number}");
            assert!(row(number).verified(&bent, &outside).is_err(), "row {number}");
        }
    }
}
