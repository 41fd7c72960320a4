//! Convergence orders, measured: retraction × manifold × metric × problem.
//!
//! The references are flows by another method, a Runge-Kutta method of order 4 with round-off for an
//! error. The orders are fitted to the errors, with 95 % intervals: 2 for the symmetric retractions,
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
    // A figure for closed forms and one for numerical geodesics, with the two schemes that all have.
    let gallery = Gallery::open()?;
    let shared = |study: &&Convergence| ["Weyl midpoint", "exponential"].contains(&&*study.scheme);
    let (closed, numerical): (Vec<Convergence>, Vec<Convergence>) =
        orders.studies.iter().filter(shared).cloned().partition(|s| s.metric == "canonical");
    for (title, name, studies) in [
        ("Order of convergence", "convergence.svg", closed),
        ("Order of convergence, metrics from closures", "convergence_closures.svg", numerical),
    ] {
        let figure = Convergence::figure(title, &studies).guide(2.0).guide(1.0);
        figure.save(gallery.path(name))?;
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
