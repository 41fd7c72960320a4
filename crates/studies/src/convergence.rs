//! A study of convergence: errors over step sizes, with the fitted order.

use crate::{LogLog, Order, OrderError, Table, scientific};

/// The errors of one scheme on one problem, and the order fitted to them.
///
/// # Examples
///
/// ```
/// use metriplectic_studies::Convergence;
///
/// let labels = ["decay", "R", "Euclidean", "explicit Euler"];
/// let study = Convergence::measure(labels, 1.0, &[64, 128, 256, 512], |h, steps| {
///     ((0..steps).fold(1.0, |x, _| x * (1.0 - h)) - (-1.0_f64).exp()).abs()
/// })?;
/// assert!(study.order.agrees(1.0, 0.05), "{}", study.order);
/// # Ok::<(), metriplectic_studies::OrderError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Convergence {
    /// The problem.
    pub problem: String,
    /// The manifold its state lives on.
    pub manifold: String,
    /// The metric there.
    pub metric: String,
    /// The scheme.
    pub scheme: String,
    /// The step sizes.
    pub steps: Vec<f64>,
    /// The error with each of them.
    pub errors: Vec<f64>,
    /// The order.
    pub order: Order,
}

impl Convergence {
    /// Runs `error(h, n)` for each number `n` of steps over `time`, and fits the order. The labels
    /// are problem, manifold, metric, scheme.
    ///
    /// # Errors
    ///
    /// [`OrderError`] if the errors do not follow a power law.
    pub fn measure(
        labels: [&str; 4],
        time: f64,
        counts: &[u32],
        mut error: impl FnMut(f64, usize) -> f64,
    ) -> Result<Self, OrderError> {
        let steps: Vec<f64> = counts.iter().map(|&n| time / f64::from(n)).collect();
        let errors: Vec<f64> =
            steps.iter().zip(counts).map(|(&h, &n)| error(h, n as usize)).collect();
        let order = Order::fit(&steps, &errors)?;
        let [problem, manifold, metric, scheme] = labels.map(str::to_owned);
        Ok(Self { problem, manifold, metric, scheme, steps, errors, order })
    }

    /// A table of studies, a row each, with the error of the smallest step.
    #[must_use]
    pub fn table(studies: &[Self]) -> Table<6> {
        let mut table =
            Table::new(["problem", "manifold", "metric", "scheme", "order [95 %]", "least error"]);
        for study in studies {
            table.row([
                study.problem.clone(),
                study.manifold.clone(),
                study.metric.clone(),
                study.scheme.clone(),
                study.order.to_string(),
                scientific(study.errors.iter().copied().fold(f64::INFINITY, f64::min)),
            ]);
        }
        table
    }

    /// A figure of studies, a series each; the schemes that follow the first on a problem are its
    /// rivals.
    #[must_use]
    pub fn figure(title: &str, studies: &[Self]) -> LogLog {
        let mut figure = LogLog::new(title, "h", "error");
        let mut before = None;
        for study in studies {
            let points: Vec<(f64, f64)> =
                study.steps.iter().copied().zip(study.errors.iter().copied()).collect();
            let Self { problem, manifold, metric, scheme, .. } = study;
            let place = format!("{problem} on {manifold}");
            let label = match metric.as_str() {
                "canonical" => format!("{place}, {scheme}"),
                _ => format!("{place} ({metric}), {scheme}"),
            };
            let place = Some((problem, manifold, metric));
            figure = if before == place {
                figure.rival(scheme, points)
            } else {
                figure.series(label, points)
            };
            before = place;
        }
        figure
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_the_order_and_the_error_of_the_smallest_step() {
        let error = |h: f64, _| 3.0 * h * h;
        let study =
            Convergence::measure(["p", "m", "g", "s"], 1.0, &[10, 20, 40, 80], error).unwrap();
        assert_eq!(study.steps, [0.1, 0.05, 0.025, 0.0125]);
        let row = Convergence::table(&[study]).to_string();
        assert!(row.contains("2.00 [2.00, 2.00]") && row.contains("4.69e-4"), "{row}");
    }
}
