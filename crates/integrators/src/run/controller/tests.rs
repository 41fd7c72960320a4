use super::*;
use crate::{Method as _, Scheme, Span};
use metriplectic_dynamics::{AreaForm, Metriplectic, Nambu, System, system::Point};
use metriplectic_fields::{Column as _, Real, Space as _};
use metriplectic_manifolds::{Exponential, Retraction, Rotations, Sphere, WeylMidpoint};
use nalgebra::{Matrix3, Vector3};
use num_dual::DualNum;

/// How far the estimate is off the local error, relative to it; that is found by 200 steps.
fn off<Y, R>(retraction: R, system: &Y, x: &Point<Y>, h: f64) -> f64
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let one = Scheme::new(retraction).run(system, x.clone(), Span::steps(h, 1)).unwrap();
    let end = one.last().point.clone();
    let fine = WeylMidpoint.run(system, x.clone(), Span::steps(h / 200.0, 200)).unwrap();
    let at = |y| Y::Manifold::coordinates(x, y);
    let exact = at(&end) - at(&fine.last().point);
    let estimate = system.local_error(x, &end, h).unwrap().0;
    (estimate - exact).magnitude() / exact.magnitude()
}

#[test]
fn the_estimate_tends_to_the_local_error() {
    let top = System::on(Sphere::<2>::round())
        .bracket(AreaForm)
        .energy(|x: &Vector3<Real>| x.x.powi(2) * 0.5 + x.y.powi(3) * 0.4 + x.z * x.x)
        .build()
        .unwrap();
    let start = Vector3::new(0.48, 0.6, 0.64);
    let group = System::on(Rotations::bi_invariant())
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5)
        .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25)
        .build()
        .unwrap();
    let turned = Rotations::bi_invariant().from_quaternion([0.8, 0.3, -0.4, 0.33]).unwrap();
    let steps = [0.1, 0.05, 0.025];
    for (name, off) in [
        ("S²", steps.map(|h| off(WeylMidpoint, &top, &start, h))),
        ("S², based at the start", steps.map(|h| off(Exponential, &top, &start, h))),
        ("SO(3)", steps.map(|h| off(WeylMidpoint, &group, &turned, 0.03 * h))),
    ] {
        println!("{name}: {off:.4?}");
        // Of order one: the estimate is the local error, and no multiple of it.
        assert!(off[2] < 0.05, "{name}: {off:?}");
        assert!(off[2] < 0.6 * off[1] && off[1] < 0.6 * off[0], "{name}: {off:?}");
    }
}

#[test]
fn the_controller_stays_within_its_bounds() {
    let rule = Rule { order: 2, control: Control::of_order(2), start: 0.0 };
    let mut pace = Pace {
        end: 10.0,
        tolerance: 1e-4,
        least: Some(1e-6),
        largest: Some(2.0),
        next: 1.0,
        ..Pace::default()
    };
    pace.accept(&rule, 1.0, 0.0);
    assert!((pace.next - 2.0).abs() < 1e-15);
    pace.reject(&rule, 1.0, Some(1e9));
    assert!((pace.next - 0.2).abs() < 1e-15);
    pace.accept(&rule, 0.2, 0.0);
    // Not larger right after a rejection.
    assert!((pace.next - 0.2).abs() < 1e-15);
    pace.reject(&rule, 0.2, None);
    assert!((pace.next - 0.05).abs() < 1e-15);
    // The last steps: one, if it is nearly as long; two of one size, if it would be cut.
    pace.next = 1.0;
    assert_eq!(pace.attempt(9.0, 10.0), (1.0, true));
    assert_eq!(pace.attempt(8.5, 10.0), (0.75, false));
    assert_eq!(pace.attempt(2.0, 10.0), (1.0, false));
}

/// A pace without bounds that would matter, at the size 1.
fn free(rule: &Rule) -> Pace {
    let pace = Pace { end: 1e9, tolerance: 1e-4, largest: Some(1e6), next: 1.0, ..Pace::default() };
    assert!(pace.least(rule) < 1e-3);
    pace
}

#[test]
fn a_step_with_the_error_that_is_allowed_is_followed_by_a_slightly_smaller_one() {
    let rule = Rule { order: 2, control: Control::of_order(2), start: 0.0 };
    let mut pace = free(&rule);
    pace.accept(&rule, 1.0, 1.0);
    assert!((0.8..1.0).contains(&pace.next), "{}", pace.next);
    // A step without an error is remembered as one with a small error, after which the next one is not cut to a tenth.
    pace.accept(&rule, 1.0, 0.0);
    pace.accept(&rule, 1.0, 1.0);
    assert!((0.25..0.3).contains(&pace.next), "{}", pace.next);
}

#[test]
fn the_bound_after_a_fall_of_the_entropy_is_raised_slowly() {
    let rule = Rule { order: 5, control: Control::of_order(5), start: 0.0 };
    let mut pace = free(&rule);
    pace.reject_fall(1.0);
    let bound = pace.next;
    assert!((0.5..0.9).contains(&bound), "{bound}");
    let mut steps = 0;
    while pace.next <= bound {
        pace.accept(&rule, pace.next, 1e-3);
        steps += 1;
        assert!(steps < 40, "it is never raised");
    }
    assert!(steps > 10, "it is raised after {steps} steps");
    assert!(pace.next < 1.6 * bound, "{} after {bound}", pace.next);
    // A step that was held ends the row of tries, and the size is again the one before it, and somewhat more.
    let before = pace.next;
    pace.reject_fall(before);
    pace.reject_fall(pace.next);
    pace.accept_held(&rule, pace.next);
    assert!(pace.next > before && pace.next < 2.0 * before, "{} after {before}", pace.next);
}
