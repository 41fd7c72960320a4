//! The laws of a system in plain numbers at a state, with their differentials.

use metriplectic_equations::{Equations, Sizes};

/// The time that a system without a clock is asked at.
pub(super) const NO_CLOCK: f64 = 0.0;

/// The laws of a system with their differentials, one after another.
#[derive(Clone, Debug)]
pub struct Rows {
    /// The values.
    pub(super) values: Vec<f64>,
    /// The differentials.
    w: Vec<f64>,
}

impl Rows {
    pub(super) fn of(system: &(impl Equations + ?Sized), x: &[f64]) -> Self {
        let Sizes { directions, laws, .. } = system.sizes();
        let (mut values, mut w) = (vec![0.0; laws], vec![0.0; laws * directions]);
        system.differentials(NO_CLOCK, x, &mut values, &mut w);
        Self { values, w }
    }

    pub(super) fn is_finite(&self) -> bool {
        self.values.iter().chain(&self.w).all(|number| number.is_finite())
    }

    /// The differential of a law.
    pub(super) fn row(&self, law: usize) -> &[f64] {
        let n = self.w.len() / self.values.len();
        &self.w[law * n..][..n]
    }
}
