//! A map: cells over two parameters, in bands of colour.

use svg::node::element::{self, Element};

use crate::frame::Frame;
use crate::plot::At;

/// The colours of viridis (Smith, van der Walt 2015), from low to high numbers.
const COLORS: [&str; 7] =
    ["#440154", "#443983", "#31688E", "#21918C", "#35B779", "#90D743", "#FDE725"];

/// A number in each cell of a grid, drawn in bands of colour between bounds. A number that is not finite leaves its
/// cell blank.
///
/// ```
/// use metriplectic_studies::{Map, Panel, Panels};
/// let points = (0..12).map(|k| [f64::from(k % 4), f64::from(k / 4), f64::from(k)]);
/// let map = Map::new(points, [4.0, 8.0]);
/// let svg = Panels::new("twelve cells").panel(Panel::new("y", "x").map(map)).svg()?;
/// assert!(svg.contains("below 4") && svg.contains("4 to 8") && svg.contains("from 8"));
/// # Ok::<(), metriplectic_studies::PlotError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Map {
    /// The label of each band with its cells, as left, right, lower and upper edge.
    bands: Vec<(String, Vec<[f64; 4]>)>,
    /// Two corners of all cells.
    corners: [At; 2],
}

impl Map {
    /// A map of points `[x, y, number]` on a grid, with bands between so many bounds.
    #[must_use]
    pub fn new(
        points: impl IntoIterator<Item = [f64; 3]>,
        bounds: impl IntoIterator<Item = f64>,
    ) -> Self {
        let points: Vec<[f64; 3]> = points.into_iter().collect();
        let bounds: Vec<f64> = bounds.into_iter().collect();
        let [x, y] = [0, 1].map(|k| edges(points.iter().map(|point| point[k])));
        let mut bands: Vec<_> = labels(&bounds).into_iter().map(|l| (l, Vec::new())).collect();
        for [a, b, number] in points.into_iter().filter(|point| point[2].is_finite()) {
            let band = bounds.iter().filter(|bound| number >= **bound).count();
            let ([left, right], [low, high]) = (around(&x, a), around(&y, b));
            bands[band].1.push([left, right, low, high]);
        }
        let end = |edges: &[f64]| [edges.first(), edges.last()].map(|e| e.copied().unwrap_or(0.0));
        let ([left, right], [low, high]) = (end(&x), end(&y));
        Self { bands, corners: [(left, low), (right, high)] }
    }

    pub(crate) const fn corners(&self) -> [At; 2] {
        self.corners
    }

    /// The label and the colour of each band.
    pub(crate) fn legend(&self) -> impl Iterator<Item = (&str, &'static str)> {
        let n = self.bands.len();
        self.bands.iter().enumerate().map(move |(k, (label, _))| (label.as_str(), color(k, n)))
    }

    /// One path for each band.
    pub(crate) fn parts(&self, frame: &Frame<'_>) -> Vec<Element> {
        let n = self.bands.len();
        let path = |(k, (_, cells)): (usize, &(String, Vec<[f64; 4]>))| {
            let cell = |&[left, right, low, high]: &[f64; 4]| {
                let ((a, b), (c, d)) = (frame.at((left, high)), frame.at((right, low)));
                format!("M{a:.1} {b:.1}H{c:.1}V{d:.1}H{a:.1}Z")
            };
            let path = element::Path::new().set("d", cells.iter().map(cell).collect::<String>());
            path.set("fill", color(k, n)).set("shape-rendering", "crispEdges").into()
        };
        self.bands
            .iter()
            .enumerate()
            .filter(|(_, (_, cells))| !cells.is_empty())
            .map(path)
            .collect()
    }
}

/// The colour of band `k` of `n`.
const fn color(k: usize, n: usize) -> &'static str {
    COLORS[if n > 1 { k * (COLORS.len() - 1) / (n - 1) } else { 0 }]
}

fn labels(bounds: &[f64]) -> Vec<String> {
    let (Some(first), Some(last)) = (bounds.first(), bounds.last()) else {
        return vec![String::new()];
    };
    let inner = bounds.windows(2).map(|pair| format!("{} to {}", pair[0], pair[1]));
    let outer = [format!("below {first}"), format!("from {last}")];
    let [below, above] = outer;
    std::iter::once(below).chain(inner).chain([above]).collect()
}

/// The edges of the cells around some numbers, half-way between neighbours.
fn edges(numbers: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut numbers: Vec<f64> = numbers.collect();
    numbers.sort_by(f64::total_cmp);
    numbers.dedup();
    let inner = numbers.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
    let mut edges: Vec<f64> = inner.collect();
    let (Some(&first), Some(&last)) = (numbers.first(), numbers.last()) else { return edges };
    let half = |edge: Option<&f64>, number: f64| edge.map_or(0.5, |edge| (edge - number).abs());
    let (before, after) = (half(edges.first(), first), half(edges.last(), last));
    edges.insert(0, first - before);
    edges.push(last + after);
    edges
}

/// The edges around a number.
fn around(edges: &[f64], number: f64) -> [f64; 2] {
    let k = edges.iter().filter(|edge| **edge < number).count();
    [edges[k.max(1) - 1], edges[k.clamp(1, edges.len() - 1)]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_touch_each_other_and_lie_around_their_points() {
        assert_eq!(edges([2.0, 0.0, 1.0, 2.0].into_iter()), [-0.5, 0.5, 1.5, 2.5]);
        assert_eq!(edges([3.0].into_iter()), [2.5, 3.5]);
        let edges = [-0.5, 0.5, 1.5, 2.5];
        assert_eq!(
            [0.0, 1.0, 2.0].map(|x| around(&edges, x)),
            [[-0.5, 0.5], [0.5, 1.5], [1.5, 2.5]]
        );
    }

    #[test]
    fn a_number_is_in_the_band_of_its_bounds_and_nan_in_none() {
        let points = [[0.0, 0.0, 4.0], [1.0, 0.0, 3.9], [0.0, 1.0, f64::NAN], [1.0, 1.0, 9.0]];
        let map = Map::new(points, [4.0, 8.0]);
        assert_eq!(map.bands.iter().map(|(_, cells)| cells.len()).collect::<Vec<_>>(), [1, 1, 1]);
        assert_eq!(map.corners(), [(-0.5, -0.5), (1.5, 1.5)]);
    }
}
