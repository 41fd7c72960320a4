//! Convergence orders, measured: retraction × manifold × metric × problem.
//!
//! The references are flows of the same velocity by another method, a Runge-Kutta method of order 4
//! with round-off for an error. The orders are fitted to the errors, with 95 % intervals: 2 for the symmetric retractions,
//! 1 for the exponential based at the start.

use std::error::Error;

use metriplectic_studies::problems::Orders;
use metriplectic_studies::{Convergence, Gallery, Options, print};
use serde_json::{Value, json};

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let orders = Orders::of_every_problem();
    if !orders.failures.is_empty() {
        return Err(orders.failures.join("\n").into());
    }
    let gallery = Gallery::open()?;
    for (place, name) in [
        ("spheres", "convergence.svg"),
        ("rotations", "convergence_rotations.svg"),
        ("charts and products", "convergence_charts.svg"),
    ] {
        let there = |study: &&Convergence| kind(&study.manifold) == place;
        let studies: Vec<Convergence> = orders.studies.iter().filter(there).cloned().collect();
        let figure = Convergence::figure(&format!("Order of convergence: {place}"), &studies);
        figure.guide(2.0).guide(1.0).save(gallery.path(name))?;
    }
    if options.json {
        let rows = orders.studies.iter().map(|s| {
            json!({
                "problem": s.problem, "manifold": s.manifold, "metric": s.metric,
                "scheme": s.scheme, "steps": s.steps, "errors": s.errors,
                "order": s.order.slope, "order_interval": s.order.interval,
            })
        });
        print(Value::Array(rows.collect()))?;
    } else {
        print(Convergence::table(&orders.studies))?;
        print(format_args!("worst energy error {:.1e}", orders.energy_error))?;
        print(format_args!("figures: {}", gallery.path("convergence*.svg").display()))?;
    }
    Ok(())
}

/// Which figure a manifold is in; none has more problems than there are colours.
fn kind(manifold: &str) -> &'static str {
    match manifold {
        "S²" | "S³" | "S⁵" => "spheres",
        _ if manifold.to_lowercase().starts_with("so(3)") => "rotations",
        _ => "charts and products",
    }
}
