//! Options of steps that follow a tolerance.

use crate::run::controller::{Controller, Entries, Pace, Rule};
use crate::run::span_error::{SpanError, check_end, check_step_size};
use crate::step::{Element, Flow, Scales, Vector};

/// The least error `τ^p` of a step, with the power of its [`Control`](crate::step::Control), and the least error `τ`
/// of a run: some units of round-off. So the least tolerance is 10⁻¹⁰ for `p = 3/2`, and this one for `p ≤ 1`.
/// A factor of four fails `tests/adaptive.rs::a_tolerance_has_the_bounds_of_its_method`.
const LEAST: f64 = 1e-15;
/// The largest tolerance: an error of the size of the entry.
/// A factor of four fails `tests/adaptive.rs::a_tolerance_has_the_bounds_of_its_method`.
const LARGEST: f64 = 1.0;

/// Options of steps that follow a tolerance.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Adaptive {
    pub(super) end: f64,
    pub(super) tolerance: f64,
    pub(super) first: Option<f64>,
    pub(super) least: Option<f64>,
    pub(super) largest: Option<f64>,
    pub(super) entries: Entries<Box<[f64]>>,
}

impl Adaptive {
    pub(crate) const fn end(&self) -> f64 {
        self.end
    }

    /// Multiplies the tolerance by a factor, and takes no longer steps than this.
    pub(crate) fn tighten(&mut self, factor: f64, largest: f64) {
        self.tolerance *= factor;
        let within = |h: f64| h.min(largest);
        self.largest = Some(self.largest.map_or(largest, within));
        (self.first, self.least) = (self.first.map(within), self.least.map(within));
    }

    pub(crate) fn check(&self, start: f64, backward: bool) -> Result<(), SpanError> {
        check_end(start, self.end, backward)?;
        for h in [self.first, self.least, self.largest].into_iter().flatten() {
            check_step_size(h)?;
        }
        if let (Some(least), Some(largest)) = (self.least, self.largest)
            && least > largest
        {
            return Err(SpanError::StepSizes { least, largest });
        }
        Ok(())
    }

    /// Accepts a tolerance that a method with this rule can hold.
    pub(crate) fn check_tolerance(&self, rule: &Rule) -> Result<(), SpanError> {
        let (tolerance, least, largest) = (self.tolerance, rule.tolerance_of(LEAST), LARGEST);
        let least = least.max(LEAST);
        if tolerance >= least && tolerance <= largest {
            Ok(())
        } else {
            Err(SpanError::Tolerance { tolerance, least, largest })
        }
    }

    /// The numbers for the entries of a point with `expected` directions.
    fn entries<V: Vector>(&self, like: &V) -> Result<Entries<V>, SpanError> {
        self.entries.convert(|_, list| {
            let bad = list.iter().position(|x| !(*x >= 0.0 && x.is_finite()));
            if let Some(index) = bad {
                return Err(SpanError::Entry { index, value: list[index] });
            }
            let other = SpanError::Entries { found: list.len(), expected: like.kinds() };
            like.with_list(list).ok_or(other)
        })
    }

    /// The controller of a run from `x` under this rule, with entries of these sizes.
    pub(crate) fn controller<F: Flow + ?Sized>(
        &self,
        rule: &Rule,
        flow: &F,
        x: &Element<F>,
        scales: &Scales<F::Vector>,
    ) -> Result<Controller<F::Vector>, SpanError> {
        let Self { end, tolerance, least, largest, .. } = *self;
        let pace = Pace { end, tolerance, least, largest, ..Pace::default() };
        let mut controller = Controller { pace, entries: self.entries(&scales.sizes)? };
        let first = self.first.unwrap_or_else(|| controller.first_step(rule, flow, x, scales));
        controller.pace.next = controller.pace.within(rule, first);
        Ok(controller)
    }
}
