//! Methods with stages: their orders on every kind of space, with both laws.
//!
//! The reference is the end of the explicit method of order 8 at a tolerance of 10⁻¹⁴.

use metriplectic::dynamics::system::Point;
use metriplectic::prelude::*;

mod models;

use models::{gas, top};

fn distance<M: Manifold>(a: &M::Point<f64>, b: &M::Point<f64>) -> f64 {
    let both = M::entries(a).into_iter().zip(M::entries(b));
    both.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

fn slope(steps: &[f64], errors: &[f64], round_off: f64) -> f64 {
    let points: Vec<(f64, f64)> = steps
        .iter()
        .zip(errors)
        .filter(|(_, error)| **error > round_off)
        .map(|(h, error)| (h.ln(), error.ln()))
        .collect();
    if points.len() < 2 {
        return f64::NAN;
    }
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let both: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    both / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

fn study<Y: Metriplectic, M: Method<Y> + Copy>(
    name: &str,
    method: M,
    system: &Y,
    x0: &Point<Y>,
    time: f64,
    exact: &Point<Y>,
    coarsest: usize,
) {
    let counts = [4, 5, 6, 8, 10, 12].map(|k| k * coarsest / 4);
    let steps = counts.map(|n| time / n as f64);
    let mut info = String::new();
    let errors = counts.map(|n| {
        let run = method.run(system, x0.clone(), Span::steps(time / n as f64, n));
        let Ok(run) = run else {
            println!("{name} {n}: {}", run.unwrap_err());
            return f64::NAN;
        };
        let c = run.certificate();
        info += &format!(
            " {:.1}/{:.0e}{}{}",
            c.effort.iterations as f64 / n as f64,
            c.max_relative_energy_error(),
            if c.keeps_energy() && c.keeps_entropy() && c.keeps_invariants() { "" } else { "!!!" },
            if c.effort.splits + c.effort.continued > 0 {
                format!("({},{})", c.effort.continued, c.effort.splits)
            } else {
                String::new()
            }
        );
        distance::<Y::Manifold>(&run.last().point, exact)
    });
    let p = slope(&steps, &errors, 2e-13);
    println!(
        "{name} order {} fitted {p:.2}: {:.1e} .. {:.1e} {info}",
        method.order(),
        errors[0],
        errors[5]
    );
}

fn orders<Y: Metriplectic>(name: &str, system: &Y, x0: &Point<Y>, time: f64, coarsest: [usize; 4]) {
    let exact = DormandPrince8
        .run(system, x0.clone(), Span::until(time).tolerance(1e-14).at_most(2))
        .unwrap()
        .last()
        .point
        .clone();
    let [a, b, c, d] = coarsest;
    study(&format!("{name} Gauss 1"), Gauss::<1>::default(), system, x0, time, &exact, a);
    study(&format!("{name} Gauss 2"), Gauss::<2>::default(), system, x0, time, &exact, b);
    study(&format!("{name} Gauss 3"), Gauss::<3>::default(), system, x0, time, &exact, c);
    study(&format!("{name} Gauss 4"), Gauss::<4>::default(), system, x0, time, &exact, d);
    study(&format!("{name} Radau 2"), Radau::<2>::default(), system, x0, time, &exact, b);
    study(&format!("{name} Radau 3"), Radau::<3>::default(), system, x0, time, &exact, c);
    study(&format!("{name} Radau 4"), Radau::<4>::default(), system, x0, time, &exact, d);
}

#[test]
fn on_lie_algebra_duals() {
    orders("so(3)*", &models::relaxing_body(), &vector![0.3, -0.9, 0.2], 30.0, [128, 64, 32, 24]);
}

#[test]
fn on_spheres_and_products_with_them() {
    let spin = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(top).build().unwrap();
    orders("S²", &spin, &Vector3::repeat(3_f64.sqrt().recip()), 20.0, [128, 64, 32, 24]);
    type Warm = (Vector3<Real>, Vector1<Real>);
    let warm = System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
        .bracket((AreaForm, Zero))
        .energy(|(x, s): &Warm| x.z + x.x * x.x * 0.3 + s.x.exp() * 0.2)
        .entropy(|(_, s): &Warm| s.x)
        .build()
        .unwrap();
    orders("S² × R", &warm, &(vector![0.6, 0.0, 0.8], Vector1::new(0.0)), 6.0, [64, 32, 16, 12]);
}

#[test]
fn on_gas_containers() {
    orders("gas, α = 0.5", &gas(0.5), &vector![1.0, 2.0, 2.0, 2.0], 2.0, [64, 32, 16, 12]);
}

#[test]
fn on_rotations() {
    let group = System::on(Rotations::bi_invariant())
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5)
        .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25)
        .build()
        .unwrap();
    let start = Rotations::bi_invariant().from_quaternion([0.8, 0.3, -0.4, 0.33]).unwrap();
    orders("SO(3)", &group, &start, 0.4, [64, 32, 16, 12]);
}
#[test]
fn more() {
    let body = System::on(LieDual::se3())
        .energy(models::heavy)
        .entropy(models::alignment)
        .casimir(models::gamma_squared)
        .build()
        .unwrap();
    orders("se(3)*", &body, &SVector::from(models::HEAVY), 4.0, [64, 32, 16, 12]);
    let metric = |x: &Vector3<Real>| {
        let [a, b] = [x.x * 0.3, x.y * 0.2];
        let (o, one) = (Real::from(0.0), Real::from(1.0));
        Matrix3::new(a * a + 1.0, a * b, o, a * b, b * b + 1.5, o, o, o, one + x.z * x.z * 0.1)
    };
    let system = System::on(Chart::<3>::new(|x| x.norm() < 4.0))
        .metric(Metric::field(metric))
        .bracket(Nambu::default())
        .energy(|x: &Vector3<Real>| x.x * x.x * 0.5 + x.y * x.y + x.z * x.z * 1.5 + x.x * x.y * 0.3)
        .entropy(|x: &Vector3<Real>| x.norm_squared() * 0.5 + x.z * 0.2)
        .build()
        .unwrap();
    orders("chart", &system, &vector![0.5, -0.6, 0.4], 2.0, [32, 16, 12, 8]);
}
#[test]
fn more2() {
    let system = System::on(Euclidean::<10>)
        .bracket(Poisson::constant(models::pendulum_bracket()).unwrap())
        .energy(models::pendulum_energy)
        .entropy(|x: &models::State10| x[8] + x[9])
        .dissipation(FieldDissipation(models::heat_exchange))
        .momentum(models::angular_momentum)
        .build()
        .unwrap();
    orders("double pendulum", &system, &SVector::from(models::PENDULUM), 2.0, [64, 32, 16, 12]);
    let globe = System::on(models::Globe)
        .metric(Metric::field(|_: &Vector3<Real>| Matrix3::identity()))
        .bracket(AreaForm)
        .energy(|x: &Vector3<Real>| x.z + x.x * x.x * 0.3 + x.y * x.x * 0.2)
        .build()
        .unwrap();
    orders("globe", &globe, &models::Globe::point(vector![0.6, 0.0, 0.8]), 12.0, [128, 64, 32, 24]);
}
