//! The coefficients of an explicit Runge-Kutta method.

use super::tableau_error::TableauError;
use crate::step::Control;

/// The most stages of a step: those of order 8, its end, and three for its dense output.
pub(super) const STAGES: usize = 16;

/// The weights of stages, as a list of (stage, weight) without the zeros.
pub type Row = &'static [(usize, f64)];

/// The coefficients of an explicit Runge-Kutta method, for [`ExplicitRungeKutta`](crate::ExplicitRungeKutta).
///
/// With the rates `k_0` at the start `q = 0` of a step of size `h`, row `i` makes stage `i + 1`, and the end follows:
///
/// ```math
/// k_{i+1} = f\Bigl( h \sum_j a_{ij} k_j \Bigr), \qquad q_1 = h \sum_j b_j k_j .
/// ```
///
/// A step of `n` rows has the stages `0 … n`, and stage `n + 1` is the rates at its end, after the end was moved onto the
/// laws. So leave out a last row that repeats the weights of the end.
///
/// Write it down as a constant. [`laws::tableau`](crate::laws::tableau) checks its order, and so does a run before its
/// first step.
///
/// ```
/// use metriplectic_integrators::{Tableau, laws};
/// /// Kutta's method of order 3 (1901).
/// const KUTTA: Tableau = Tableau::new(
///     "Kutta3",
///     3,
///     &[&[(0, 0.5)], &[(0, -1.0), (1, 2.0)]],
///     &[(0, 1.0 / 6.0), (1, 2.0 / 3.0), (2, 1.0 / 6.0)],
/// );
/// assert!(laws::tableau(&KUTTA).is_ok());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Tableau {
    pub(super) name: &'static str,
    pub(super) order: u32,
    pub(super) stages: Stages,
    /// The end of the step.
    pub(super) end: Row,
    /// The weights of the error, of which the first is the one of higher order.
    pub(super) errors: [Row; 2],
    /// The first of them if it is known before the end of the step is, and none otherwise.
    pub(super) early_error: Row,
    /// The orders of both.
    pub(super) error_orders: [u32; 2],
    /// Further stages for the dense output; the stage at the end of the step comes before them.
    pub(super) more_stages: &'static [Row],
    /// The rows of the dense output beyond those of a cubic.
    pub(super) dense: &'static [Row],
    pub(super) control: Control,
    /// Whether the control was given.
    has_control: bool,
    /// `h|λ|` at the edge of the region of stability, on the negative axis.
    pub(super) stability: f64,
    /// The stages that only other stages before the end need, one bit for each.
    passed: u32,
    /// Whether its rows are compiled as constants.
    pub(super) compiled: Option<Compiled>,
    pub(super) fault: Option<TableauError>,
}

/// A tableau whose rows are compiled as constants.
#[derive(Clone, Copy, Debug)]
pub(super) enum Compiled {
    /// [`DormandPrince5`](crate::DormandPrince5).
    Five,
    /// [`DormandPrince8`](crate::DormandPrince8).
    Eight,
}

/// The stages before the end of a step.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stages {
    /// Row `i` makes stage `i + 1`, and stage 0 is at the start.
    Rows(&'static [Row]),
    /// As many as the size of the step asks for, by a recursion.
    Chebyshev,
}

/// The highest order of a tableau without an error of its own for which the estimate of the flow serves: its error is
/// `O(h⁵)`.
/// A factor of four fails `tests/tableau.rs::steps_follow_a_tolerance_only_where_their_error_is_known`.
pub(super) const ESTIMATED: u32 = 3;

impl Tableau {
    /// A method of this order: its name in checkpoints, its rows of stages and the weights of its end.
    pub const fn new(name: &'static str, order: u32, stages: &'static [Row], end: Row) -> Self {
        let tableau = Self {
            name,
            order,
            stages: Stages::Rows(stages),
            end,
            errors: [&[], &[]],
            early_error: &[],
            error_orders: [0, 0],
            more_stages: &[],
            dense: &[],
            control: Control::of_order(order),
            has_control: false,
            stability: f64::INFINITY,
            passed: 0,
            compiled: None,
            fault: None,
        };
        let tableau = tableau.checked();
        if tableau.fault.is_some() {
            return tableau;
        }
        Self { stability: edge_of_stability(stages, end), ..tableau }
    }

    /// The weights of the error: those of the end less those of an embedded method of this order. They may name stage
    /// `n + 1`. Without a control of its own, steps follow the PI controller for this order.
    ///
    /// If they do not name stage `n + 1`, the entropy of a step is aimed at only if its own error is at most half of its
    /// rise.
    #[must_use]
    pub const fn error(self, row: Row, order: u32) -> Self {
        Self { errors: [row, self.errors[1]], error_orders: [order, self.error_orders[1]], ..self }
            .controlled()
            .checked()
    }

    /// The weights of a second error, of a lower order. With the errors `e` and `e₂` a step has the error
    /// `e²/√(e² + e₂²/100)` (Hairer, Nørsett, Wanner, Solving ODEs I, §II.10). Without a first error it does nothing.
    #[must_use]
    pub const fn second_error(self, row: Row, order: u32) -> Self {
        Self { errors: [self.errors[0], row], error_orders: [self.error_orders[0], order], ..self }
            .controlled()
            .checked()
    }

    /// The dense output. It adds these terms to the cubic of Hermite `C` through both ends, with one row `c_i` for each,
    ///
    /// ```math
    /// q(\theta) = C(\theta) + \theta^2 (1 - \theta)^2 h
    ///     \bigl( C_1 + \theta C_2 + \theta (1 - \theta) C_3 + \theta^2 (1 - \theta) C_4 + \dots \bigr), \qquad
    /// C_i = \sum_j c_{ij} k_j .
    /// ```
    ///
    /// The rows of `more_stages` make the stages `n + 2`, `n + 3`, …, and are evaluated only where a state inside a step
    /// is asked for. Without a dense output it is the cubic, of order 3.
    #[must_use]
    pub const fn dense(self, more_stages: &'static [Row], rows: &'static [Row]) -> Self {
        Self { more_stages, dense: rows, ..self }.checked()
    }

    /// How steps follow a tolerance.
    #[must_use]
    pub const fn control(self, control: Control) -> Self {
        Self { control, has_control: true, ..self }
    }

    /// The largest `z` for which the method is stable on `[−z, 0]`, by which a certificate says that stability sets the
    /// steps. Without it, the `z` is the one of the stability function if the last stage is at the end of the step, and
    /// nothing is said otherwise.
    #[must_use]
    pub const fn stable_to(self, z: f64) -> Self {
        Self { stability: z, ..self }
    }

    /// The name in checkpoints.
    pub const fn name(&self) -> &'static str {
        self.name
    }

    /// A digest of the order and of all rows. How steps follow a tolerance is an option and is not in it.
    pub(super) fn digest(&self) -> u64 {
        let mut digest = u64::from(self.order);
        let mut put = |word: u64| {
            digest = (digest ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
        };
        let [end, errors] = [std::slice::from_ref(&self.end), &self.errors];
        for part in [self.rows(), end, errors, self.more_stages, self.dense] {
            put(part.len() as u64);
            for row in part {
                put(row.len() as u64);
                for &(stage, weight) in *row {
                    put(stage as u64);
                    put(weight.to_bits());
                }
            }
        }
        digest
    }

    /// The order of convergence.
    pub const fn order(&self) -> u32 {
        self.order
    }

    /// Whether a row names a stage that is not known, or there are too many.
    pub(crate) const fn has_a_fault(&self) -> bool {
        self.fault.is_some()
    }

    /// The orders of the errors.
    pub(crate) fn orders_of_errors(&self) -> &[u32] {
        let count = self.errors.iter().take_while(|row| !row.is_empty()).count();
        &self.error_orders[..count]
    }

    /// Whether states inside a step have more than a cubic.
    pub(crate) const fn has_dense_output(&self) -> bool {
        !self.dense.is_empty()
    }

    /// Makes the tableau of Chebyshev's method, whose stages are computed in each step.
    pub(super) const fn chebyshev(name: &'static str, control: Control) -> Self {
        let tableau = Self::new(name, 2, &[], &[]);
        Self { stages: Stages::Chebyshev, stability: f64::INFINITY, control, ..tableau }
    }

    /// The tableau whose rows are compiled as constants. What changes a row takes it back.
    pub(super) const fn compiled(self, which: Compiled) -> Self {
        Self { compiled: Some(which), ..self }
    }

    /// The rows of the stages.
    pub(crate) const fn rows(&self) -> &'static [Row] {
        match self.stages {
            Stages::Rows(rows) => rows,
            Stages::Chebyshev => &[],
        }
    }

    /// The weights of the end.
    pub(crate) const fn weights(&self) -> Row {
        self.end
    }

    /// The stages that only other stages before the end need.
    pub(super) fn passed(&self) -> impl Iterator<Item = usize> {
        let mut left = self.passed;
        std::iter::from_fn(move || {
            let stage = left.trailing_zeros();
            left &= left.wrapping_sub(1);
            (stage < u32::BITS).then_some(stage as usize)
        })
    }

    /// The tableau with the control for the order of its error.
    const fn controlled(self) -> Self {
        if self.has_control || self.errors[0].is_empty() {
            return self;
        }
        let [first, second] = self.error_orders;
        // The order of e²/e₂.
        let order = if self.errors[1].is_empty() {
            first
        } else {
            (2 * first + 1).saturating_sub(second + 1)
        };
        Self { control: Control { power: 1.0, ..Control::of_order(order) }, ..self }
    }

    /// The tableau with its first fault, and with the stages that are passed.
    const fn checked(self) -> Self {
        let (rows, name) = (self.rows(), self.name);
        let end = rows.len() + 1;
        let found = end + 1 + self.more_stages.len();
        let mut fault = None;
        if found > STAGES {
            fault = Some(TableauError::Stages { name, found, most: STAGES });
        }
        if fault.is_none() {
            fault = self.unknown("the stages", rows, 1, true);
        }
        if fault.is_none() {
            fault = self.unknown("the end", &[self.end], end, false);
        }
        if fault.is_none() {
            fault = self.unknown("the errors", &self.errors, end + 1, false);
        }
        if fault.is_none() {
            fault = self.unknown("the further stages", self.more_stages, end + 1, true);
        }
        if fault.is_none() {
            fault = self.unknown("the dense output", self.dense, found, false);
        }
        let mut passed = 0;
        let mut stage = 1;
        while stage < end && fault.is_none() {
            let [first, second] = self.errors;
            let is_named = names(self.end, stage)
                || names(first, stage)
                || names(second, stage)
                || one_names(self.more_stages, stage)
                || one_names(self.dense, stage);
            if !is_named {
                passed |= 1 << stage;
            }
            stage += 1;
        }
        let [error, _] = self.errors;
        let early_error: Row = if names(error, end) { &[] } else { error };
        // Its rows may be others now.
        Self { fault, passed, early_error, compiled: None, ..self }
    }

    /// The first row of a part that names a stage which is not known: of `known` stages, and of one more for each row if
    /// the rows make stages.
    const fn unknown(
        &self,
        part: &'static str,
        rows: &[Row],
        known: usize,
        makes: bool,
    ) -> Option<TableauError> {
        let mut row = 0;
        while row < rows.len() {
            let known = if makes { known + row } else { known };
            let mut at = 0;
            while at < rows[row].len() {
                let (stage, _) = rows[row][at];
                if stage >= known {
                    return Some(TableauError::Unknown {
                        name: self.name,
                        part,
                        row,
                        stage,
                        known,
                    });
                }
                at += 1;
            }
            row += 1;
        }
        None
    }
}

/// Whether a row names a stage.
const fn names(row: Row, stage: usize) -> bool {
    let mut at = 0;
    while at < row.len() {
        if row[at].0 == stage {
            return true;
        }
        at += 1;
    }
    false
}

/// Whether one of several rows names a stage.
const fn one_names(rows: &[Row], stage: usize) -> bool {
    let mut row = 0;
    while row < rows.len() {
        if names(rows[row], stage) {
            return true;
        }
        row += 1;
    }
    false
}

/// `Σ_j w_j k_j`.
const fn weighed(row: Row, k: &[f64; STAGES]) -> f64 {
    let (mut sum, mut at) = (0.0, 0);
    while at < row.len() {
        let (stage, w) = row[at];
        sum += w * k[stage];
        at += 1;
    }
    sum
}

/// The stability function `R(−z)`: the end of a step with `hλ = −z` from 1.
const fn stability_function(rows: &[Row], end: Row, z: f64) -> f64 {
    let mut k = [1.0; STAGES];
    let mut row = 0;
    while row < rows.len() {
        k[row + 1] = 1.0 - z * weighed(rows[row], &k);
        row += 1;
    }
    1.0 - z * weighed(end, &k)
}

/// The first `z` with `|R(−z)| > 1`; infinite if the last stage is not at the end of the step, because the rates of both
/// are compared.
const fn edge_of_stability(rows: &[Row], end: Row) -> f64 {
    if rows.is_empty() || (weighed(rows[rows.len() - 1], &[1.0; STAGES]) - 1.0).abs() > 1e-10 {
        return f64::INFINITY;
    }
    let (mut stable, mut unstable) = (0.0, 0.25);
    while stability_function(rows, end, unstable).abs() <= 1.0 {
        stable = unstable;
        unstable += 0.25;
        if unstable > 64.0 {
            return f64::INFINITY;
        }
    }
    let mut halvings = 0;
    while halvings < 40 {
        let middle = 0.5 * (stable + unstable);
        if stability_function(rows, end, middle).abs() <= 1.0 {
            stable = middle;
        } else {
            unstable = middle;
        }
        halvings += 1;
    }
    stable
}

#[cfg(test)]
mod tests {
    use super::super::dormand_prince::{EIGHT, FIVE};
    use super::*;

    #[test]
    fn the_edge_of_stability_is_where_the_stability_function_leaves_one() {
        // R(−z) = 1 − z + z²/2 − z³/6 is −1 at 2.5127.
        let kutta: &[Row] = &[&[(0, 0.5)], &[(0, -1.0), (1, 2.0)]];
        let end: Row = &[(0, 1.0 / 6.0), (1, 2.0 / 3.0), (2, 1.0 / 6.0)];
        assert!((Tableau::new("Kutta3", 3, kutta, end).stability - 2.512_745).abs() < 1e-6);
        // Hairer, Wanner (Solving ODEs II, §IV.2) draw the regions of both.
        let edges = [&FIVE, &EIGHT].map(|tableau| edge_of_stability(tableau.rows(), tableau.end));
        println!("{edges:?}");
        assert!((edges[0] - 3.307).abs() < 1e-2 && (edges[1] - 6.393).abs() < 1e-2, "{edges:?}");
        // The last stage of Bogacki and Shampine is not at the end of the step.
        let rows: &[Row] = &[&[(0, 0.5)], &[(1, 0.75)]];
        let end: Row = &[(0, 2.0 / 9.0), (1, 1.0 / 3.0), (2, 4.0 / 9.0)];
        assert!(Tableau::new("BogackiShampine3", 3, rows, end).stability.is_infinite());
    }

    #[test]
    fn the_parts_that_follow_from_the_rows_are_those_of_dormand_and_prince() {
        assert_eq!(EIGHT.passed().collect::<Vec<_>>(), [1, 2, 3, 4]);
        assert_eq!(FIVE.passed().collect::<Vec<_>>(), [1]);
        // The error of order 5 needs the rates at the end.
        assert!(EIGHT.early_error == EIGHT.errors[0] && FIVE.early_error.is_empty());
    }

    #[test]
    fn a_pair_follows_a_tolerance_by_the_order_of_its_error() {
        let plain = Tableau::new("plain", 3, &[], &[]);
        assert_eq!(plain.control, Control::of_order(3));
        let pair = plain.error(&[(0, 1.0)], 2);
        assert_eq!(pair.control, Control { power: 1.0, ..Control::of_order(2) });
        // e²/e₂ of the orders 5 and 3 is O(h⁸), as the control of order 8 says.
        let two = plain.error(&[(0, 1.0)], 5).second_error(&[(0, 1.0)], 3);
        assert!((two.control.rejected - EIGHT.control.rejected).abs() < 1e-15);
    }
}
