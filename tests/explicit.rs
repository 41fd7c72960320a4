//! The explicit methods: their orders with the laws on, and the laws at every tolerance.

use metriplectic::dynamics::system::Point;
use metriplectic::prelude::*;

mod models;

/// A closure of a field, so that systems on one space share their type.
type Field<P> = Box<dyn Fn(&P) -> Real + Send + Sync>;

fn field<P>(f: impl Fn(&P) -> Real + Send + Sync + 'static) -> Field<P> {
    Box::new(f)
}

/// `log₂` of the ratio of the errors of two step sizes, the median of a row.
fn slope(errors: &[(f64, f64)]) -> f64 {
    let n = errors.len() as f64;
    let (x, y): (Vec<f64>, Vec<f64>) = errors.iter().map(|(h, e)| (h.ln(), e.ln())).unzip();
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let cov: f64 = x.iter().zip(&y).map(|(x, y)| (x - mx) * (y - my)).sum();
    cov / x.iter().map(|x| (x - mx).powi(2)).sum::<f64>()
}

fn distance<M: Manifold>(a: &M::Point<f64>, b: &M::Point<f64>) -> f64 {
    let both = M::entries(a).into_iter().zip(M::entries(b));
    both.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

fn study<Y: Metriplectic>(
    name: &str,
    system: &Y,
    x0: Point<Y>,
    time: f64,
    counts: [[usize; 4]; 2],
) {
    let fine = DormandPrince5.run(system, x0.clone(), Span::until(time).tolerance(1e-13)).unwrap();
    let other = DormandPrince8.run(system, x0.clone(), Span::until(time).tolerance(1e-13)).unwrap();
    println!(
        "{name}: references apart {:.1e}, steps {} {}",
        distance::<Y::Manifold>(&fine.last().point, &other.last().point),
        fine.certificate().steps,
        other.certificate().steps
    );
    let reference = &other.last().point;
    let row = |n: usize, eight: bool| {
        let span = Span::steps(time / n as f64, n);
        let run = if eight {
            DormandPrince8.run(system, x0.clone(), span)
        } else {
            DormandPrince5.run(system, x0.clone(), span)
        }
        .unwrap();
        let c = run.certificate();
        assert!(c.keeps_energy() && c.keeps_entropy() && c.keeps_invariants(), "{name} {n}\n{c}");
        let e = distance::<Y::Manifold>(&run.last().point, reference);
        println!(
            "   {n} {e:.2e} dH {:.1e} {:?} splits {}",
            c.max_relative_energy_error(),
            c.projected_steps,
            c.effort.splits
        );
        (time / n as f64, e)
    };
    let five: Vec<_> = counts[0].iter().map(|&n| row(n, false)).collect();
    let eight: Vec<_> = counts[1].iter().map(|&n| row(n, true)).collect();
    println!("   orders {:.2} {:.2}", slope(&five), slope(&eight));
    for k in [3, 6, 9, 12] {
        let run = DormandPrince8
            .run(system, x0.clone(), Span::until(time).tolerance(10f64.powi(-k)))
            .unwrap();
        let c = run.certificate();
        println!(
            "   tol 1e-{k}: error {:.1e} steps {} rejected {} ({}) dH {:.1e} falls {} {:?}",
            distance::<Y::Manifold>(&run.last().point, reference),
            c.steps,
            c.rejected,
            c.falls_avoided,
            c.max_relative_energy_error(),
            c.entropy_falls,
            c.projected_steps
        );
    }
}

#[test]
fn orders() {
    let body = models::relaxing_body();
    study("so(3)*", &body, vector![0.3, -0.9, 0.2], 10.0, [[20, 40, 80, 160], [10, 20, 40, 80]]);
    let top =
        System::on(Sphere::<2>::round()).bracket(AreaForm).energy(models::top).build().unwrap();
    study(
        "S2",
        &top,
        Vector3::repeat(3f64.sqrt().recip()),
        10.0,
        [[20, 40, 80, 160], [10, 20, 40, 80]],
    );
    for alpha in [0.5, 1e-3] {
        let wall = |x: &Vector4<Real>| {
            let [left, right] = [x.z / x.x, x.w / (-x.x + 2.0)].map(|d| d * (2.0 / 3.0));
            let push = Vector4::new(1.0.into(), 0.0.into(), -left, right);
            push * Vector4::y().transpose() - Vector4::y() * push.transpose()
        };
        let leak = move |_: &Vector4<Real>, w: &Vector4<Real>| {
            let b = Vector4::new(0.0.into(), 0.0.into(), w.w, -w.z);
            b * b.transpose() * Real::from(alpha)
        };
        let gas = System::on(Euclidean::<4>)
            .bracket(Poisson::field(wall))
            .dissipation(FieldDissipation(leak))
            .energy(|x: &Vector4<Real>| x.y.powi(2) * 0.5 + x.z + x.w)
            .entropy(|x: &Vector4<Real>| (x.x * (-x.x + 2.0)).ln() + (x.z * x.w).ln() * 1.5)
            .build()
            .unwrap();
        study(
            "gas",
            &gas,
            vector![1.0, 2.0, 2.0, 2.0],
            4.0,
            [[40, 80, 160, 320], [20, 40, 80, 160]],
        );
    }
}
