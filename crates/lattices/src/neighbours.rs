//! Questions of the process of one part of a lattice to those of the other parts.
//!
//! There is one implementation outside the tests, [`Alone`]: a lattice of one part.

use std::fmt;

/// The other parts of a lattice. All parts call the same methods in the same order.
pub(crate) trait Neighbours: fmt::Debug + Send + Sync {
    /// How many parts there are, this one included.
    fn count(&self) -> usize;

    /// Fills the numbers at the places that `edges` receives: `width` numbers at each place.
    fn exchange(&self, edges: &Edges, width: usize, numbers: &mut [f64]);

    /// Returns the nodes of all parts in the order of the parts.
    fn gather(&self, nodes: Vec<Node<Vec<f64>>>) -> Vec<Node<Vec<f64>>>;
}

/// The only part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Alone;

impl Neighbours for Alone {
    fn count(&self) -> usize {
        1
    }

    fn exchange(&self, _: &Edges, _: usize, _: &mut [f64]) {}

    fn gather(&self, nodes: Vec<Node<Vec<f64>>>) -> Vec<Node<Vec<f64>>> {
        nodes
    }
}

/// The places of an array whose numbers go to other parts, and those whose numbers come from there.
#[derive(Clone, Debug, Default)]
pub(crate) struct Edges {
    pub(crate) sent: Vec<Edge>,
    pub(crate) received: Vec<Edge>,
}

/// A place of an array, and its name in the whole lattice: the number of a site, or of a bond between two chunks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Edge {
    pub(crate) place: u32,
    pub(crate) name: u32,
}

/// The sum over the chunks from `index 2ˡ` to `(index + 1) 2ˡ`, `l` the level.
#[derive(Clone, Debug)]
pub(crate) struct Node<R> {
    pub(crate) level: u32,
    pub(crate) index: usize,
    pub(crate) sum: R,
}

/// A sum that other parts can be told.
pub(crate) trait Shared: Sized {
    /// Lists its numbers.
    fn list(&self) -> Vec<f64>;

    /// Reads such a list; `self` has its form.
    fn of_list(&self, list: &[f64]) -> Self;
}

impl Shared for Vec<f64> {
    fn list(&self) -> Self {
        self.clone()
    }

    fn of_list(&self, list: &[f64]) -> Self {
        list.to_vec()
    }
}
