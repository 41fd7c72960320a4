//! Random numbers that are the same in each run, and wherever a site is.

use metriplectic_fields::Column;
use metriplectic_integrators::noise::{Purpose, philox};

/// The purpose of random directions, so that no two purposes share numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub(crate) enum Use {
    /// The displacement of a state near another one.
    Near,
    /// Directions at the start.
    Start,
    /// Directions where each entry has a size of its own.
    Own,
    /// Directions at a state that a run has reached.
    Reached,
    /// A displacement by roundings.
    Rounding,
}

/// The owner of a direction, by its number in the graph.
#[derive(Clone, Copy, Debug)]
pub(crate) enum At {
    /// The entries at a site.
    Site(usize),
    /// The entries of both sites of a bond.
    Bond(usize),
    /// A covector at a site.
    Covector(usize),
}

/// The numbers of one use: functions of the place and of their order there, by the
/// [law](metriplectic_integrators::noise::Counter) of all random numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Random(Use);

impl Random {
    pub(crate) const fn new(of: Use) -> Self {
        Self(of)
    }

    /// A number between −1 and 1.
    fn number(self, [index, place]: [u64; 2]) -> f64 {
        let [word, ..] = philox([0; 2], [index, place, Purpose::Trial as u64, self.0 as u64]);
        // The 53 leading bits make a number between 0 and 2⁵³.
        (word >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// The number between −1 and 1 of an entry of a state, by its number among all of them.
    pub(crate) fn of_entry(self, entry: usize) -> f64 {
        self.number([0, entry as u64])
    }

    /// The numbers between −1 and 1 at a place, one after the other.
    pub(crate) fn at(self, place: At) -> impl FnMut() -> f64 {
        // Places of each kind begin at an index of their own, and have fewer numbers than lie between.
        let [place, mut index] = match place {
            At::Site(site) => [site as u64, 1 << 16],
            At::Bond(bond) => [bond as u64, 2 << 16],
            At::Covector(site) => [site as u64, 3 << 16],
        };
        move || {
            index += 1;
            self.number([index, place])
        }
    }

    /// A vector at a place with entries up to these sizes.
    pub(crate) fn vector<V: Column<f64>>(self, place: At, sizes: &V) -> V {
        let mut next = self.at(place);
        V::from_index(|k| sizes[k] * next())
    }
}
