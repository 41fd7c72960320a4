//! A state of a run.

use approx::{AbsDiffEq, RelativeEq};

use crate::step::StateSpace;

/// A state of a run: time, point, and the two fields there.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(bound = "M: StateSpace"))]
#[non_exhaustive]
pub struct State<M: StateSpace> {
    /// Steps taken; for a state inside a step, those before it.
    pub step: usize,
    /// The time: `t₀ + step · h` in steps of one size, `t₀` and their sum in others.
    pub time: f64,
    /// The point; serialized as the list of its entries, in the order of
    /// [`StateSpace::numbers`].
    #[cfg_attr(feature = "serde", serde(serialize_with = "entries::<M, _>"))]
    pub point: M::Element,
    /// The energy `H` there.
    pub energy: f64,
    /// The entropy `S` there; 0 without an entropy.
    pub entropy: f64,
}

#[cfg(feature = "serde")]
fn entries<M: StateSpace, S: serde::Serializer>(
    point: &M::Element,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(M::numbers(point))
}

/// States are compared by their times and the entries of their points.
impl<M: StateSpace> AbsDiffEq for State<M>
where
    Self: PartialEq,
{
    type Epsilon = f64;

    fn default_epsilon() -> f64 {
        f64::default_epsilon()
    }

    fn abs_diff_eq(&self, other: &Self, epsilon: f64) -> bool {
        self.time.abs_diff_eq(&other.time, epsilon)
            && M::numbers(&self.point).abs_diff_eq(&M::numbers(&other.point), epsilon)
    }
}

impl<M: StateSpace> RelativeEq for State<M>
where
    Self: PartialEq,
{
    fn default_max_relative() -> f64 {
        f64::default_max_relative()
    }

    fn relative_eq(&self, other: &Self, epsilon: f64, max_relative: f64) -> bool {
        let (here, there) = (M::numbers(&self.point), M::numbers(&other.point));
        self.time.relative_eq(&other.time, epsilon, max_relative)
            && here.relative_eq(&there, epsilon, max_relative)
    }
}
