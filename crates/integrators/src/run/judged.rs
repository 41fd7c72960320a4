//! The sizes that the errors of a run are relative to, compared with those that its state has reached.

use crate::run::certificate::MisjudgedSize;
use crate::step::Vector;

/// The sizes beyond those of its state that the errors of a run were relative to at its start, zero for other entries,
/// and the largest sizes that the state has had.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(crate) struct Judged<V> {
    pub(crate) first: V,
    pub(crate) reached: V,
}

/// The factor by which a size that was estimated may differ from the one that is reached.
/// A factor of four fails `run/judged.rs::a_size_is_misjudged_where_it_is_off_by_a_factor_of_a_hundred`.
const MISJUDGED: f64 = 100.0;

impl<V: Vector> Judged<V> {
    /// At a state with the sizes `here`, whose errors are relative to these ones.
    pub(crate) fn new(judged_by: &V, here: V) -> Self {
        let first = V::zip([judged_by, &here], |[size, here]| if size > here { size } else { 0.0 });
        Self { first, reached: here }
    }

    /// The kind of entry whose size differs most from the one that it has reached, by more than a factor of
    /// [`MISJUDGED`]: it has outgrown the estimate at the start, or the run `has_ended` and the state has not come near
    /// the size that its errors are relative to. Sizes of the size of `noise` are left out.
    pub(crate) fn worst(
        &self,
        relative_to: &V,
        noise: &V,
        has_ended: bool,
    ) -> Option<MisjudgedSize> {
        let (mut worst, mut largest) = (None, MISJUDGED);
        let by_kind = [&self.first, relative_to, &self.reached, noise].map(V::by_kind);
        for direction in 0..relative_to.kinds() {
            let [first, last, reached, noise] = by_kind.each_ref().map(|v| v.get(direction));
            let outgrown = (first > noise).then(|| (first, reached / first));
            let not_reached = (has_ended && last > noise).then(|| (last, last / reached));
            for (judged, factor) in [outgrown, not_reached].into_iter().flatten() {
                if factor > largest {
                    (worst, largest) = (Some(MisjudgedSize { direction, judged, reached }), factor);
                }
            }
        }
        worst
    }
}

#[cfg(test)]
mod tests {
    use super::Judged;

    #[test]
    fn a_size_is_misjudged_where_it_is_off_by_a_factor_of_a_hundred() {
        // An entry that starts at zero was estimated to reach 1.
        let direction = |reached: f64| {
            let mut judged = Judged::new(&vec![1.0], vec![0.0]);
            judged.reached = vec![reached];
            judged.worst(&vec![1.0], &vec![0.0], true).map(|worst| worst.direction)
        };
        assert_eq!([0.02, 0.5, 50.0].map(direction), [None; 3]);
        assert_eq!([0.005, 200.0].map(direction), [Some(0); 2]);
    }
}
