//! The laws of a system in plain numbers at a state, with their differentials.

use metriplectic_equations::room::with_numbers;
use metriplectic_equations::{ENERGY, ENTROPY, Equations, Sizes};

use crate::step::{Directions, Few, Vector as _};
use crate::system::NO_CLOCK;

/// The laws of a system with their differentials.
#[derive(Clone, Debug)]
pub struct Rows {
    /// The values.
    pub(super) values: Few<3>,
    /// The differentials of the energy and of the entropy.
    first: [Directions; 2],
    /// The differentials of the further invariants.
    invariants: Vec<Directions>,
}

impl Rows {
    pub(super) fn of(system: &dyn Equations, x: &[f64]) -> Self {
        let Sizes { directions, laws, .. } = system.sizes();
        with_numbers(laws * directions, |w| {
            let mut values = Few::zeros(laws);
            system.differentials(NO_CLOCK, x, &mut values, w);
            let row = |law: usize| Directions::of(&w[law * directions..][..directions]);
            let first = [row(ENERGY), row(ENTROPY)];
            let invariants = if laws > 2 { (2..laws).map(row).collect() } else { Vec::new() };
            Self { values, first, invariants }
        })
    }

    /// Returns whether all numbers are finite.
    pub(super) fn is_finite(&self) -> bool {
        let check = |numbers: &[f64]| numbers.iter().fold(0.0, |sum, number| sum + 0.0 * number);
        let rows = self.first.iter().chain(&self.invariants);
        rows.fold(check(&self.values), |sum, row| sum + check(row.numbers())) == 0.0
    }

    /// The differential of a law.
    pub(super) fn row(&self, law: usize) -> &Directions {
        if law <= ENTROPY { &self.first[law] } else { &self.invariants[law - ENTROPY - 1] }
    }

    /// Calls `f` with the differentials of all laws, one after another.
    pub(super) fn with_all<T>(&self, f: impl FnOnce(&[f64]) -> T) -> T {
        let n = self.first[ENERGY].len();
        with_numbers(self.values.len() * n, |w| {
            let rows = self.first.iter().chain(&self.invariants);
            w.chunks_exact_mut(n.max(1)).zip(rows).for_each(|(to, row)| {
                to.copy_from_slice(row.numbers());
            });
            f(w)
        })
    }
}
