//! Extrapolation of the modified midpoint rule (Gragg 1965, Bulirsch and Stoer 1966): an explicit
//! method of variable order, for any state that can be added and compared.

/// A state of a solution.
pub(crate) trait State: Copy {
    /// `self + other · h`.
    fn plus(&self, other: &Self, h: f64) -> Self;

    /// The largest difference to another state, relative to the sizes of its parts.
    fn distance(&self, other: &Self) -> f64;

    /// Whether every number of the state is finite.
    fn is_finite(&self) -> bool;
}

/// The relative error of a step.
pub(crate) const TOLERANCE: f64 = 1e-13;
/// Substeps of the midpoint rule, before extrapolation.
const SUBSTEPS: [u32; 8] = [2, 4, 6, 8, 10, 12, 14, 16];

/// The start of a step, with the rate there, which is the same in every row and for every size.
pub(crate) struct Start<Y> {
    pub(crate) state: Y,
    pub(crate) slope: Y,
}

/// One row of the extrapolation: the midpoint rule with `n` substeps over `h`, smoothed by Gragg.
fn midpoint_rule<Y: State>(
    rate: &impl Fn(&Y) -> Option<Y>,
    Start { state: start, slope }: &Start<Y>,
    h: f64,
    n: u32,
) -> Option<Y> {
    let step = h / f64::from(n);
    let mut before = *start;
    let mut here = start.plus(slope, step);
    for _ in 1..n {
        let next = before.plus(&rate(&here)?, 2.0 * step);
        (before, here) = (here, next);
    }
    let last = here.plus(&rate(&here)?, step);
    // ½ (before + last)
    let smooth = before.plus(&last.plus(&before, -1.0), 0.5);
    smooth.is_finite().then_some(smooth)
}

/// The end of a step.
pub(crate) struct End<Y> {
    /// The state there.
    pub(crate) state: Y,
    /// Whether it has converged with rows to spare, so that a step of twice the size may, too.
    pub(crate) easy: bool,
}

/// The row up to which a step is easy: twice the size needs two or three rows more.
const EASY: usize = SUBSTEPS.len() - 3;
/// A row gains two digits at best, so a step that lacks more than four at the row [`EASY`] fails.
const HOPELESS: f64 = 1e-9;

/// One step of size `h`; `None` if it does not converge or leaves the domain of `rate`.
pub(crate) fn step<Y: State>(
    rate: &impl Fn(&Y) -> Option<Y>,
    start: &Start<Y>,
    h: f64,
) -> Option<End<Y>> {
    let mut table: [Option<Y>; SUBSTEPS.len()] = [None; SUBSTEPS.len()];
    for (row, &n) in SUBSTEPS.iter().enumerate() {
        // Aitken and Neville: the table of the row above is overwritten from the left.
        let mut entry = midpoint_rule(rate, start, h, n)?;
        let mut change = f64::INFINITY;
        let last = row.checked_sub(1).and_then(|above| table[above]);
        for column in 1..=row {
            let above = table[column - 1].replace(entry)?;
            let ratio = f64::from(n) / f64::from(SUBSTEPS[row - column]);
            let weight = 1.0 / (ratio * ratio - 1.0);
            let better = entry.plus(&entry.plus(&above, -1.0), weight);
            change = better.distance(&entry);
            entry = better;
        }
        table[row] = Some(entry);
        let gained = last.map_or(f64::INFINITY, |last| entry.distance(&last));
        let allowed = TOLERANCE * h.max(0.1);
        if change <= allowed && gained <= 10.0 * allowed {
            return Some(End { state: entry, easy: row <= EASY });
        }
        if row == EASY && change > HOPELESS {
            return None;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    impl State for [f64; 2] {
        fn plus(&self, other: &Self, h: f64) -> Self {
            [self[0] + other[0] * h, self[1] + other[1] * h]
        }

        fn distance(&self, other: &Self) -> f64 {
            (self[0] - other[0]).hypot(self[1] - other[1])
        }

        fn is_finite(&self) -> bool {
            self.iter().all(|entry| entry.is_finite())
        }
    }

    #[test]
    fn a_turn_by_one_radian_is_exact_to_round_off() {
        let start = Start { state: [1.0, 0.0], slope: [0.0, 1.0] };
        let end = step(&|y: &[f64; 2]| Some([-y[1], y[0]]), &start, 1.0).unwrap();
        let (sine, cosine) = 1_f64.sin_cos();
        assert!(end.state.distance(&[cosine, sine]) < 1e-14);
    }

    #[test]
    fn a_singularity_on_the_way_is_no_step() {
        // x' = x² blows up at t = 1.
        let start = Start { state: [1.0, 0.0], slope: [1.0, 0.0] };
        let end = step(&|y: &[f64; 2]| Some([y[0] * y[0], 0.0]), &start, 1.5);
        assert!(end.is_none());
    }
}
