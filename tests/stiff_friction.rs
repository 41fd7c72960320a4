//! Stiff friction with Radau's methods.

use metriplectic::dynamics::system::Point;
use metriplectic::prelude::*;

mod models;

use models::gas;

fn report<Y: Metriplectic, M: Method<Y>>(
    name: &str,
    m: M,
    y: &Y,
    x0: &Point<Y>,
    span: impl Into<metriplectic::integrators::Schedule>,
    exact: Option<&Vec<f64>>,
) {
    let t = std::time::Instant::now();
    match m.run(y, x0.clone(), span) {
        Ok(run) => {
            let c = run.certificate();
            let end = Y::Manifold::entries(&run.last().point);
            let e = exact.map_or(f64::NAN, |x| {
                x.iter().zip(&end).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
            });
            println!(
                "{name}: err {e:.2e} steps {} its {} cont {} splits {} dH {:.1e} falls {} friction {:.1e} end {end:.6?} {:.0?}",
                c.steps,
                c.effort.iterations,
                c.effort.continued,
                c.effort.splits,
                c.max_relative_energy_error(),
                c.entropy_falls,
                c.friction,
                t.elapsed()
            );
        }
        Err(e) => {
            let e = e.to_string();
            println!("{name}: ERROR {} {:.0?}", &e[..60.min(e.len())], t.elapsed())
        }
    }
}

#[test]
fn gas_study() {
    for alpha in [1e4, 1e6] {
        let system = gas(alpha);
        let x0 = vector![1.0, 2.0, 2.01, 1.99];
        let fine = Radau::<4>::default()
            .run(&system, x0, Span::until(2.0).tolerance(1e-11).at_most(2))
            .unwrap();
        println!("fine {} steps {:?}", fine.certificate().steps, fine.last().point);
        let exact = Euclidean::<4>::entries(&fine.last().point);
        if alpha < 1e5 {
            report(
                "DP8",
                DormandPrince8,
                &system,
                &x0,
                Span::until(2.0).tolerance(1e-12).at_most(2),
                Some(&exact),
            );
        }
        for n in [40, 80, 160, 320] {
            let span = Span::steps(2.0 / n as f64, n);
            report(
                &format!("{alpha:.0e} N {n} Gauss 3"),
                Gauss::<3>::default(),
                &system,
                &x0,
                span,
                Some(&exact),
            );
            report(
                &format!("{alpha:.0e} N {n} Radau 2"),
                Radau::<2>::default(),
                &system,
                &x0,
                span,
                Some(&exact),
            );
            report(
                &format!("{alpha:.0e} N {n} Radau 3"),
                Radau::<3>::default(),
                &system,
                &x0,
                span,
                Some(&exact),
            );
            report(
                &format!("{alpha:.0e} N {n} Radau 4"),
                Radau::<4>::default(),
                &system,
                &x0,
                span,
                Some(&exact),
            );
        }
        for k in [4, 8] {
            let span = Span::until(2.0).tolerance(10_f64.powi(-k)).at_most(2);
            report(
                &format!("{alpha:.0e} tol {k} Radau 2"),
                Radau::<2>::default(),
                &system,
                &x0,
                span,
                Some(&exact),
            );
            report(
                &format!("{alpha:.0e} tol {k} Radau 3"),
                Radau::<3>::default(),
                &system,
                &x0,
                span,
                Some(&exact),
            );
            report(
                &format!("{alpha:.0e} tol {k} Radau 4"),
                Radau::<4>::default(),
                &system,
                &x0,
                span,
                Some(&exact),
            );
            report(
                &format!("{alpha:.0e} tol {k} Gauss 3"),
                Gauss::<3>::default(),
                &system,
                &x0,
                span,
                Some(&exact),
            );
        }
    }
}

fn energy(t: Real) -> Real {
    t + t * t * 0.5
}
fn entropy(t: Real) -> Real {
    t.ln() + t
}
fn conduction(w: &Vector2<Real>, kappa: f64) -> Matrix2<Real> {
    let b = Vector2::new(w.x.recip(), -w.y.recip());
    b * b.transpose() * Real::from(kappa)
}

#[test]
fn temperatures() {
    type X = Vector2<Real>;
    let kappa = 1e6;
    let flat = System::on(Euclidean::<2>)
        .energy(|x: &X| energy(x.x) + energy(x.y))
        .entropy(|x: &X| entropy(x.x) + entropy(x.y))
        .dissipation(FieldDissipation(move |_: &X, w: &Vector2<Real>| conduction(w, kappa)))
        .build()
        .unwrap();
    type P = (Vector1<Real>, Vector1<Real>);
    let positive = System::on(Product(HalfLine, HalfLine))
        .energy(|x: &P| energy(x.0.x) + energy(x.1.x))
        .entropy(|x: &P| entropy(x.0.x) + entropy(x.1.x))
        .dissipation(FieldDissipation(move |_: &P, w: &Vector2<Real>| conduction(w, kappa)))
        .build()
        .unwrap();
    for start in [[0.01, 3.0], [1.0, 3.0]] {
        for k in [-6, -4, -3, -2, 0, 2, 3] {
            let h = 10_f64.powi(k);
            let span = Span::steps(h, 20);
            let x = vector![start[0], start[1]];
            let p = (vector![start[0]], vector![start[1]]);
            report(
                &format!("flat {start:?} 1e{k} Radau 2"),
                Radau::<2>::default(),
                &flat,
                &x,
                span,
                None,
            );
            report(
                &format!("flat {start:?} 1e{k} Radau 3"),
                Radau::<3>::default(),
                &flat,
                &x,
                span,
                None,
            );
            report(
                &format!("flat {start:?} 1e{k} Radau 4"),
                Radau::<4>::default(),
                &flat,
                &x,
                span,
                None,
            );
            report(
                &format!("half {start:?} 1e{k} Radau 3"),
                Radau::<3>::default(),
                &positive,
                &p,
                span,
                None,
            );
            report(
                &format!("half {start:?} 1e{k} Radau 2"),
                Radau::<2>::default(),
                &positive,
                &p,
                span,
                None,
            );
        }
    }
}

/// x' = p, p' = −x − γ p, e' = γp².
#[test]
fn oscillator() {
    for gamma in [1e7, 1e8] {
        let system = System::on(Euclidean::<3>)
            .bracket(
                Poisson::constant(Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
                    .unwrap(),
            )
            .energy(|x: &Vector3<Real>| (x.x * x.x + x.y * x.y) * 0.5 + x.z)
            .entropy(|x: &Vector3<Real>| x.z)
            .dissipation(FieldDissipation(move |_: &Vector3<Real>, w: &Vector3<Real>| {
                let b = Vector3::new(Real::from(0.0), w.z, -w.y);
                b * b.transpose() * (w.z.recip() * gamma)
            }))
            .build()
            .unwrap();
        for (name, p0) in [("on", -1.0 / gamma), ("off", 0.5)] {
            for h in [1e-3, 1.0, 1e3, 1e6] {
                let n = 20;
                let t = h * n as f64;
                // slow decay
                let slow = (gamma - (gamma * gamma - 4.0_f64).sqrt()) / 2.0;
                let slow = if slow == 0.0 || gamma > 1e7 { 1.0 / gamma } else { slow };
                let x = (-t * slow).exp();
                let e = 1.0 + 0.5 + 0.5 * p0 * p0;
                let exact = vec![x, -x * slow, e - 0.5 * x * x];
                for (m, run) in [("Radau 2", 2), ("Radau 3", 3), ("Radau 4", 4)] {
                    let x0 = vector![1.0, p0, 1.0];
                    let name = format!("γ {gamma:.0e} {name} h {h:.0e} {m}");
                    let span = Span::steps(h, n);
                    match run {
                        2 => report(&name, Radau::<2>::default(), &system, &x0, span, Some(&exact)),
                        3 => report(&name, Radau::<3>::default(), &system, &x0, span, Some(&exact)),
                        4 => report(&name, Radau::<4>::default(), &system, &x0, span, Some(&exact)),
                        5 => report(&name, Gauss::<3>::default(), &system, &x0, span, Some(&exact)),
                        _ => report(
                            &name,
                            Scheme::new(WeylMidpoint),
                            &system,
                            &x0,
                            span,
                            Some(&exact),
                        ),
                    }
                }
            }
        }
    }
}

#[test]
fn dbg() {
    type X = Vector2<Real>;
    let kappa = 1e6;
    let flat = System::on(Euclidean::<2>)
        .energy(|x: &X| energy(x.x) + energy(x.y))
        .entropy(|x: &X| entropy(x.x) + entropy(x.y))
        .dissipation(FieldDissipation(move |_: &X, w: &Vector2<Real>| conduction(w, kappa)))
        .build()
        .unwrap();
    report("D", Radau::<2> { splits: 0 }, &flat, &vector![1.0, 3.0], Span::steps(1e-2, 1), None);
}
