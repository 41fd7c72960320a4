//! Convergence orders, measured: retraction × manifold × problem.
//!
//! The references are exact flows to 25 digits, by extrapolation and Gauss collocation in high
//! precision: another method, and gradients by hand. The orders are fitted to the errors, with 95 %
//! intervals: 2 for the Weyl midpoint, 1 for the exponential based at the start.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Convergence, Gallery, Options, print};
use serde_json::{Value, json};

/// The number of steps of each run.
const COUNTS: [u32; 6] = [40, 80, 160, 320, 640, 1280];

fn top(x: &Vector3<Real>) -> Real {
    let d = [1.0, 0.5, 0.25];
    (0..3).map(|i| (x[i].powi(2) + x[i].powi(3) * (2.0 / 3.0)) * (0.5 * d[i])).sum()
}

fn hill(x: &Vector3<Real>) -> Real {
    x.z + x.x * x.y * 0.3
}

/// Both retractions on one problem, by its key in the data file, its name and its manifold.
fn study<Y: Metriplectic>(
    system: &Y,
    [key, problem, manifold]: [&str; 3],
    point: impl Fn(&[f64]) -> metriplectic::dynamics::Point<Y>,
) -> Result<Vec<Convergence>, Box<dyn Error>>
where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
    Exponential: Retraction<Y::Manifold, Y::Metric>,
{
    let cases: Value = serde_json::from_str(include_str!("../tests/data/flow.json"))?;
    let case = cases.as_array().into_iter().flatten().find(|case| case["name"] == key);
    let case = case.ok_or("the problem is not in the data")?;
    let numbers = |entry: &str| -> Result<Vec<f64>, Box<dyn Error>> {
        let digits: Vec<String> = serde_json::from_value(case[entry].clone())?;
        Ok(digits.iter().map(|digits| digits.parse()).collect::<Result<_, _>>()?)
    };
    let (start, exact) = (point(&numbers("x0")?), numbers("x_T")?);
    let time: f64 = case["T"].as_str().ok_or("no end time")?.parse()?;
    let error = |run: Result<Trajectory<Y::Manifold>, _>| {
        let end =
            run.map_or_else(|_| vec![f64::NAN], |run| Y::Manifold::entries(&run.last().point));
        end.iter().zip(&exact).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };
    let labels = |scheme| [problem, manifold, "canonical", scheme];
    let weyl = Convergence::measure(labels("Weyl midpoint"), time, &COUNTS, |h, n| {
        error(WeylMidpoint.run(system, start.clone(), Span::steps(h, n)))
    });
    let fine = COUNTS.map(|n| 4 * n);
    let exponential = Convergence::measure(labels("exponential"), time, &fine, |h, n| {
        error(Exponential.run(system, start.clone(), Span::steps(h, n)))
    });
    Ok(vec![weyl?, exponential?])
}

fn main() -> Result<(), Box<dyn Error>> {
    let vector = |x: &[f64]| Vector3::from_column_slice(x);
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x.powi(2) * 0.05 + p.y.powi(2) * 0.1 + p.z.powi(2) * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()?;
    let sphere = || System::on(Sphere::<2>::round()).energy(top);
    let spinning = sphere().bracket(AreaForm).build()?;
    let relaxing = sphere().entropy(hill).build()?;
    let mixed =
        sphere().bracket(AreaForm).entropy(hill).second_law(SecondLaw::Published).build()?;
    let frame = System::on(Rotations::bi_invariant())
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5)
        .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25)
        .build()?;
    let mut studies = study(&body, ["rigid_body", "rigid body", "so(3)*"], vector)?;
    studies.extend(study(&spinning, ["spinning_top", "spinning top", "S²"], vector)?);
    studies.extend(study(&relaxing, ["sphere_relaxation", "relaxation", "S²"], vector)?);
    studies.extend(study(&mixed, ["sphere_mixed", "relaxing top", "S²"], vector)?);
    let matrix = Matrix3::from_row_slice;
    studies.extend(study(&frame, ["so3_nambu", "Nambu bracket", "SO(3)"], matrix)?);

    let path = Gallery::open()?.path("convergence.svg");
    Convergence::figure("Order of convergence", &studies).guide(2.0).guide(1.0).save(&path)?;
    if Options::read().json {
        let rows = studies.iter().map(|s| json!({
            "problem": s.problem, "manifold": s.manifold, "metric": s.metric, "scheme": s.scheme,
            "steps": s.steps, "errors": s.errors,
            "order": s.order.slope, "order_interval": s.order.interval,
        }));
        print(Value::Array(rows.collect()))?;
    } else {
        print(format_args!("{}\nfigure: {}", Convergence::table(&studies), path.display()))?;
    }
    Ok(())
}
