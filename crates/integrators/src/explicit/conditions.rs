//! The conditions of order of a Runge-Kutta method, one for each rooted tree (Butcher 1963; Hairer, Nørsett, Wanner,
//! Solving ODEs I, §II.2).
//!
//! A tree `t` with the subtrees `t_1, t_2, …` at its root has the density `γ(t) = |t| Π γ(t_l)` and at stage `i` the
//! elementary weight
//!
//! ```math
//! \Phi_i(t) = \prod_l \sum_j a_{ij} \Phi_j(t_l) .
//! ```
//!
//! A method has the order `p` if `Σ b_i Φ_i(t) = 1/γ(t)` for all trees with at most `p` nodes; inside a step, at the
//! fraction `θ`, the right side is `θ^{|t|}/γ(t)`.

use super::tableau::{ESTIMATED, Row, STAGES, Tableau};
use super::tableau_error::TableauError;

/// The highest order whose conditions are looked at: no tableau that fits has a higher one.
/// A factor of four fails `explicit/conditions.rs::there_are_as_many_rooted_trees_as_cayley_counted`.
const HIGHEST: u32 = 10;

/// A rooted tree.
struct Tree {
    nodes: u32,
    density: f64,
    /// The elementary weight of each stage.
    weights: Vec<f64>,
    /// The sum of its absolute terms.
    sizes: Vec<f64>,
}

/// The trees with their weights at the stages of a tableau.
pub(crate) struct Conditions<'a> {
    tableau: &'a Tableau,
    trees: Vec<Tree>,
}

/// The residual of a condition of order, relative to its terms, above which a weight is misprinted.
/// A factor of four fails `tests/tableau.rs::a_wrong_tableau_is_refused_by_its_laws_and_before_a_run`.
const MISPRINTED: f64 = 1e-8;

impl Tableau {
    /// Refuses a tableau with which a run cannot start: one whose rows name stages that are not known; whose end, errors or
    /// dense output miss their conditions of order; with an error that estimates nothing; or without an error of its own
    /// where steps follow a tolerance.
    ///
    /// # Errors
    ///
    /// [`TableauError`].
    pub fn check(&self, follows_tolerance: bool) -> Result<(), TableauError> {
        let Self { name, order, fault, errors: [error, _], .. } = *self;
        if let Some(fault) = fault {
            return Err(fault);
        }
        let orders = self.orders_of_errors();
        let conditions = Conditions::of(self, highest(order, orders));
        let off = conditions.of_end();
        if !is_as_printed(off) {
            return Err(TableauError::Order { name, order, off });
        }
        for (which, &order) in orders.iter().enumerate() {
            let [off, own] = conditions.of_error(which);
            if !is_as_printed(off) {
                return Err(TableauError::Error { name, which, order, off });
            }
            if own <= MISPRINTED {
                return Err(TableauError::NothingEstimated { name, which, order });
            }
        }
        if self.has_dense_output() {
            let off = conditions.inside(order - 1);
            if !is_as_printed(off) {
                return Err(TableauError::Dense { name, order: order - 1, off });
            }
        }
        if follows_tolerance && error.is_empty() && order > ESTIMATED {
            return Err(TableauError::NoError { name, order });
        }
        Ok(())
    }
}

/// Returns whether a residual is round-off of the printed digits. One that is not a number is not.
fn is_as_printed(off: f64) -> bool {
    off <= MISPRINTED
}

/// The highest order whose conditions a tableau of this order is asked for, with errors of these orders: that of the method, or the
/// one above that of an error.
pub(crate) fn highest(order: u32, errors: &[u32]) -> u32 {
    errors.iter().map(|order| order.saturating_add(1)).fold(order, u32::max)
}

impl<'a> Conditions<'a> {
    /// All trees with up to `order` nodes.
    pub(crate) fn of(tableau: &'a Tableau, order: u32) -> Self {
        let rows = tableau.rows().iter().chain([&tableau.end]).chain(tableau.more_stages);
        let stages: Vec<Row> = [&[] as Row].into_iter().chain(rows.copied()).collect();
        let mut trees: Vec<Tree> = Vec::new();
        for nodes in 1..=order.min(HIGHEST) {
            let known = trees.len();
            let mut found = Vec::new();
            forests(&trees, nodes - 1, known, &mut Vec::new(), &mut found);
            trees.extend(
                found
                    .iter()
                    .map(|forest| planted(&trees[..known], forest, &stages))
                    .collect::<Vec<_>>(),
            );
        }
        Self { tableau, trees }
    }

    /// The largest residual of the conditions of the end; infinite for an order that no such tableau has.
    pub(crate) fn of_end(&self) -> f64 {
        let order = self.tableau.order;
        if order == 0 || order > HIGHEST {
            return f64::INFINITY;
        }
        self.largest(order, self.tableau.end, 1.0)
    }

    /// The largest weights of an error up to its order, and in the next one.
    pub(crate) fn of_error(&self, which: usize) -> [f64; 2] {
        let (row, order) = (self.tableau.errors[which], self.tableau.error_orders[which]);
        let next = self.trees.iter().filter(|tree| tree.nodes == order + 1);
        [self.largest(order, row, 0.0), next.map(|tree| tree.off(row, 0.0)).fold(0.0, larger)]
    }

    /// The largest residual of the conditions of a state inside a step, up to this order.
    pub(crate) fn inside(&self, order: u32) -> f64 {
        let Tableau { end, dense, .. } = *self.tableau;
        let at_end = self.tableau.rows().len() + 1;
        let residual = |theta: f64| {
            let rest = 1.0 - theta;
            let mut weights = vec![0.0; STAGES];
            // Hermite's cubic through both ends, with the rates there.
            for &(stage, b) in end {
                weights[stage] += theta * theta * (3.0 - 2.0 * theta) * b;
            }
            weights[0] += theta * rest * rest;
            weights[at_end] -= theta * theta * rest;
            let mut factor = theta * theta * rest * rest;
            for (k, row) in dense.iter().enumerate() {
                for &(stage, c) in *row {
                    weights[stage] += factor * c;
                }
                factor *= if k % 2 == 0 { theta } else { rest };
            }
            let row: Vec<(usize, f64)> =
                weights.into_iter().enumerate().filter(|(_, w)| *w != 0.0).collect();
            self.largest(order, &row, theta)
        };
        [0.2, 0.5, 0.9].into_iter().map(residual).fold(0.0, larger)
    }

    /// The largest residual of a row, where the value wanted is `θ^{|t|}/γ(t)`.
    fn largest(&self, order: u32, row: &[(usize, f64)], theta: f64) -> f64 {
        let trees = self.trees.iter().filter(|tree| tree.nodes <= order);
        trees.map(|tree| tree.off(row, theta)).fold(0.0, larger)
    }
}

/// The larger one of two residuals; NaN if one is.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

impl Tree {
    /// `|Σ w_i Φ_i − θ^{|t|}/γ|`, relative to the terms of the sum and to `1/γ`.
    fn off(&self, row: &[(usize, f64)], theta: f64) -> f64 {
        let wanted = theta.powi(self.nodes.cast_signed()) / self.density;
        let (mut sum, mut terms) = (-wanted, 1.0 / self.density);
        for &(stage, w) in row {
            sum += w * self.weights[stage];
            terms += (w * self.sizes[stage]).abs();
        }
        sum.abs() / terms
    }
}

/// The lists of trees, by their indices below `bound` and never rising, that have so many nodes together.
fn forests(
    trees: &[Tree],
    nodes: u32,
    bound: usize,
    forest: &mut Vec<usize>,
    found: &mut Vec<Vec<usize>>,
) {
    if nodes == 0 {
        found.push(forest.clone());
        return;
    }
    for index in (0..bound).filter(|&index| trees[index].nodes <= nodes) {
        forest.push(index);
        forests(trees, nodes - trees[index].nodes, index + 1, forest, found);
        forest.pop();
    }
}

/// The tree with these subtrees at its root.
fn planted(trees: &[Tree], forest: &[usize], stages: &[Row]) -> Tree {
    let subtrees = || forest.iter().map(|&index| &trees[index]);
    let nodes = 1 + subtrees().map(|tree| tree.nodes).sum::<u32>();
    let density = f64::from(nodes) * subtrees().map(|tree| tree.density).product::<f64>();
    let at = |row: Row, of: fn(&Tree) -> &[f64], weight: fn(f64) -> f64| -> f64 {
        let branch = |tree| row.iter().map(|&(j, a)| weight(a) * of(tree)[j]).sum::<f64>();
        subtrees().map(branch).product()
    };
    let weights = stages.iter().map(|row| at(row, |tree| &tree.weights, |a| a)).collect();
    let sizes = stages.iter().map(|row| at(row, |tree| &tree.sizes, f64::abs)).collect();
    Tree { nodes, density, weights, sizes }
}

#[cfg(test)]
mod tests {
    use super::super::dormand_prince::FIVE;
    use super::*;

    #[test]
    fn there_are_as_many_rooted_trees_as_cayley_counted() {
        let conditions = Conditions::of(&FIVE, 8);
        let count = |nodes| conditions.trees.iter().filter(|tree| tree.nodes == nodes).count();
        assert_eq!([1, 2, 3, 4, 5, 6, 7, 8].map(count), [1, 1, 2, 4, 9, 20, 48, 115]);
        // The tall tree and the bush of five nodes.
        let densities: Vec<f64> = conditions.trees.iter().map(|tree| tree.density).collect();
        assert!(densities.contains(&120.0) && densities.contains(&5.0));
    }
}
