//! Convergence orders, measured: retraction × manifold × metric × problem.
//!
//! The references are flows of the same velocity by another method, a Runge-Kutta method of order 4
//! with round-off for an error. The orders are fitted to the errors, with 95 % intervals: 2 for the symmetric retractions,
//! 1 for the exponential based at the start.

use std::error::Error;

use metriplectic_studies::problems::Orders;
use metriplectic_studies::{Convergence, Example, Progress};
use serde_json::{Value, json};

fn main() -> Result<(), Box<dyn Error>> {
    let about = "Orders of convergence, measured: retraction × manifold × metric × problem.";
    let example = Example::study(about);

    let (mut studies, mut expected) = (Vec::new(), Vec::new());
    let (mut worst, mut progress) = (0.0_f64, Progress::over(3));
    for part in [Orders::canonical, Orders::closures, Orders::products] {
        let orders = part();
        if !orders.failures.is_empty() {
            return Err(orders.failures.join("\n").into());
        }
        studies.extend(orders.studies);
        expected.extend(orders.expected);
        worst = worst.max(orders.energy_error);
        progress.step();
    }
    drop(progress);

    let rows = studies.iter().zip(&expected).map(|(s, expected)| {
        json!({
            "problem": s.problem, "manifold": s.manifold, "metric": s.metric,
            "scheme": s.scheme, "steps": s.steps, "errors": s.errors,
            "order": s.order.slope, "order_interval": s.order.interval,
            "expected_order": expected, "agrees": s.order.agrees(*expected, 0.05),
            "worst_energy_error": worst,
        })
    });
    let figure = |place: &str| {
        let there = studies.iter().filter(|study| kind(&study.manifold) == place);
        let there: Vec<Convergence> = there.cloned().collect();
        let title = format!("Order of convergence: {place}");
        Convergence::figure(&title, &there).guide(2.0).guide(1.0)
    };
    example
        .report_of_many()
        .text(Convergence::table(&studies))
        .with("worst_energy_error", worst)
        .log_log("", &figure("spheres"))
        .log_log("_rotations", &figure("rotations"))
        .log_log("_charts", &figure("charts and products"))
        .print_as(&Value::Array(rows.collect()))
}

/// Which figure a manifold is in; none has more problems than there are colours.
fn kind(manifold: &str) -> &'static str {
    match manifold {
        "S²" | "S³" | "S⁵" => "spheres",
        _ if manifold.to_lowercase().starts_with("so(3)") => "rotations",
        _ => "charts and products",
    }
}
