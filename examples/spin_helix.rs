//! A helix of spins on a ring, damped by a bath that it heats: `(n, s) ∈ S² × R` at each of a thousand sites.
//!
//! `H = −J Σ n·n' − K Σ n_z² + C Σ e^{s/C}`, and the friction is `n' = −λ w_tan` (Landau, Lifshitz 1935). A helix of
//! the wave number `k` keeps its form, with `b = J (1 − cos k) + K` and `a = 2λb`:
//!
//! ```text
//! tan θ = tan θ₀ e^{−at},   φ = ki + (2b/a) (artanh cos θ − artanh cos θ₀),   C e^{s/C} = C + b (cos²θ − cos²θ₀) .
//! ```

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

const SITES: usize = 1000;
const EXCHANGE: f64 = 1.0;
const ANISOTROPY: f64 = 0.3;
const CAPACITY: f64 = 2.0;
const FRICTION: f64 = 0.05;

type Spin = (Vector3<Real>, Vector1<Real>);

fn main() -> Result<(), Box<dyn Error>> {
    let helix = Lattice::on(Graph::ring(SITES), Product(Sphere::<2>::round(), Euclidean::<1>))
        .bracket((AreaForm, Zero))
        .energy(|(n, s): &Spin| (s.x / CAPACITY).exp() * CAPACITY - n.z.powi(2) * ANISOTROPY)
        .bond_energy(|(x, y): &(Spin, Spin)| x.0.dot(&y.0) * -EXCHANGE)
        .entropy(|(_, s): &Spin| s.x)
        .site_onsager(|site| {
            // Two tangent directions and the temperature, in the frame of the spin.
            let w = site.w;
            let rate = FRICTION * w.z;
            [vector![1.0, 0.0, -w.x / w.z], vector![0.0, 1.0, -w.y / w.z]]
                .map(|b| Onsager { rate, b })
        })
        .build()?;
    let start = helix.points(|i| exact(i, 0.0));

    let about = "A damped helix of spins that heats its bath, beside its closed form.";
    let example = Example::new(about, 600, 0.1);
    let mut run = DormandPrince8.steps(&helix, start, example.step_size)?;
    let mut rows = vec![row(run.state())];
    for _ in 0..example.steps {
        run.advance()?;
        rows.push(row(run.state()));
    }
    let (certificate, end) = (run.certificate(), run.state());
    let column = |k: usize| rows.iter().map(|row| (row[0], row[k])).collect::<Vec<_>>();
    let closed = |f: fn(Vector3<f64>, f64) -> f64| {
        let point = |t: f64| exact(0, t);
        rows.iter().map(|row| (row[0], f(point(row[0]).0, point(row[0]).1.x))).collect::<Vec<_>>()
    };
    let beside = |name: &str, k: usize, f: fn(Vector3<f64>, f64) -> f64| {
        Panel::new(name, "t").line("closed form", closed(f)).line("lattice", column(k))
    };
    let figure = Panels::new(format!("A damped helix of {SITES} spins"))
        .panel(beside("n_x of the first spin", 1, |n, _| n.x))
        .panel(beside("n_z", 2, |n, _| n.z))
        .panel(beside("temperature", 3, |_, s| (s / CAPACITY).exp()))
        .panel(
            Panel::new("largest error of a site", "t").line("error", column(4)).logarithmic(1e-17),
        );
    let worst = rows.iter().map(|row| row[4]).fold(0.0, f64::max);
    let (n, s) = end.point[0];
    let report = example.report_of(certificate, end.time, vec![n.x, n.y, n.z, s.x]);
    report.with("error", worst).figure(figure).print()
}

type Ring = metriplectic::lattices::Sites<Product<Sphere<2>, Euclidean<1>>>;

/// The time, the first spin, its temperature, and the largest error of a site.
fn row(state: &State<Ring>) -> [f64; 5] {
    let error = state.point.iter().enumerate().map(|(i, (n, s))| {
        let (exact, heat) = exact(i, state.time);
        (n - exact).amax().max((s - heat).amax())
    });
    let (n, s) = state.point[0];
    [state.time, n.x, n.z, (s.x / CAPACITY).exp(), error.fold(0.0, f64::max)]
}

/// Spin `i` at the time `t`, of a helix that starts 1.2 from the axis and has 50 turns.
fn exact(i: usize, t: f64) -> (Vector3<f64>, Vector1<f64>) {
    let k = 50.0 * std::f64::consts::TAU / SITES as f64;
    let (b, start) = (EXCHANGE * (1.0 - k.cos()) + ANISOTROPY, 1.2_f64);
    let a = 2.0 * FRICTION * b;
    let theta = (start.tan() * (-a * t).exp()).atan();
    let phi = k * i as f64 + (2.0 * b / a) * (theta.cos().atanh() - start.cos().atanh());
    let heat = b * (theta.cos().powi(2) - start.cos().powi(2));
    let n = vector![theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
    (n, vector![CAPACITY * (heat / CAPACITY).ln_1p()])
}
