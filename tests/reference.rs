//! One step and whole flows against data computed by other methods, to 25 digits.

mod models;

use metriplectic::prelude::*;
use models::{TUMBLING, UNSTABLE, free_body, relaxing_body, top};

/// The entries of a case of `tests/data/flow.json`: 25-digit flows by extrapolation and Gauss
/// collocation, and single steps of the published Weyl scheme in high precision.
fn data<const N: usize>(case: &str, key: &str) -> [f64; N] {
    let file = include_str!("data/flow.json");
    let cases: serde_json::Value = serde_json::from_str(file).expect("the data are JSON");
    let found = cases.as_array().into_iter().flatten().find(|entry| entry["name"] == case);
    let entries = found.expect("the case is in the data")[key].clone();
    let entries: Vec<String> = serde_json::from_value(entries).expect("numbers are strings");
    let numbers: Vec<f64> =
        entries.iter().map(|digits| digits.parse().expect("a number")).collect();
    numbers.try_into().expect("the case has this dimension")
}

/// The largest difference between one step and the step of the data, in any entry.
fn one_step<Y: Metriplectic>(system: &Y, case: &str, h: f64) -> f64
where
    Y::Manifold: Manifold<Point<f64> = Vector3<f64>>,
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let x0 = Vector3::from(data(case, "x0"));
    let run = WeylMidpoint.run(system, x0, Span::steps(h, 1)).expect("one step is taken");
    (run.last().point - Vector3::from(data(case, "scheme_x1"))).amax()
}

/// `S = x₃ + 0.3 x₁x₂`.
fn hill(x: &Vector3<Real>) -> Real {
    x.z + x.x * x.y * 0.3
}

#[test]
fn one_step_of_the_rigid_body_is_the_published_one() {
    assert!(one_step(&relaxing_body(), "rigid_body", 0.1) < 1e-13);
}

#[test]
fn one_step_of_the_spinning_top_is_the_published_one() {
    let system = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(top).build().unwrap();
    assert!(one_step(&system, "spinning_top", 0.1) < 1e-13);
}

#[test]
fn one_step_of_pure_relaxation_on_the_sphere_is_the_published_one() {
    let system = System::on(Sphere::<2>::round())
        .energy(top)
        .entropy(hill)
        .second_law(SecondLaw::Published)
        .build()
        .unwrap();
    assert!(one_step(&system, "sphere_relaxation", 0.1) < 1e-13);
}

#[test]
fn one_step_with_an_entropy_that_is_no_casimir_is_the_published_one() {
    let system = System::on(Sphere::<2>::round())
        .bracket(AreaForm)
        .energy(top)
        .entropy(hill)
        .second_law(SecondLaw::Published)
        .build()
        .unwrap();
    assert!(one_step(&system, "sphere_mixed", 0.1) < 1e-13);
}

#[test]
fn one_step_on_the_rotation_group_is_the_published_one() {
    let system = System::on(Rotations::bi_invariant())
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5)
        .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25)
        .second_law(SecondLaw::Published)
        .build()
        .unwrap();
    let start = Matrix3::from_row_slice(&data::<9>("so3_nambu", "x0"));
    let end = Matrix3::from_row_slice(&data::<9>("so3_nambu", "scheme_x1"));
    let run = WeylMidpoint.run(&system, start, Span::steps(0.05, 1)).unwrap();
    assert!((run.last().point - end).amax() < 1e-13);
}

#[test]
fn the_relaxing_body_follows_its_exact_flow_to_second_order() {
    // The exact flow to 18 digits (Gragg-Bulirsch-Stoer) at t = 1 and t = 10.
    let exact = [
        (1.0, vector![0.000302005438967183, -1.000_001_151_105_896_8, 0.000794000407907643]),
        (10.0, vector![-0.0066814549293953, -0.999_983_850_617_850_8, 0.00175940805437915]),
    ];
    for (time, point) in exact {
        let error = |h: f64| {
            let steps = (1..).find(|&n| f64::from(n) * h > time - 0.5 * h).unwrap();
            let span = Span::steps(h, usize::try_from(steps).unwrap());
            let run = WeylMidpoint.run(&relaxing_body(), UNSTABLE, span).unwrap();
            (run.last().point - point).norm()
        };
        let (coarse, fine) = (error(0.1), error(0.05));
        assert!(coarse < 1e-4 * 0.1 * 0.1 * time, "t = {time}: {coarse:.1e}");
        assert!((coarse / fine - 4.0).abs() < 0.05, "t = {time}: ratio {}", coarse / fine);
    }
}

#[test]
fn the_relaxing_body_comes_to_rest_on_its_axis_of_largest_inertia() {
    let run = WeylMidpoint.run(&relaxing_body(), UNSTABLE, Span::steps(0.1, 1000)).unwrap();
    let end = run.last();
    assert!((end.point.x + 1.414_217_451_455_044).abs() < 1e-3);
    assert!(end.point.yz().norm() < 2e-3);
    // All of H is in the axis of largest inertia: S = H I₁.
    assert!((end.entropy - 1.0000055).abs() < 1e-5);
}

/// The end of a run extrapolated to `h = 0` from runs with steps near `h`, `h/2` and `h/4`.
///
/// The scheme is symmetric, so its error has an expansion in even powers of `h`; two rounds of
/// Richardson's extrapolation leave `O(h⁶)` of it.
fn extrapolated<Y>(system: &Y, x0: Vector3<f64>, time: f64, h: f64) -> Vector3<f64>
where
    Y: Metriplectic,
    Y::Manifold: Manifold<Point<f64> = Vector3<f64>>,
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let n = (1..).find(|&n: &u32| f64::from(n) * h > time - 0.5 * h).expect("a number of steps");
    let [a, b, c] = [n, 2 * n, 4 * n].map(|n| {
        let span = Span::steps(time / f64::from(n), n as usize).every(n as usize);
        WeylMidpoint.run(system, x0, span).expect("the run is finished").last().point
    });
    let (ab, bc) = (b + (b - a) / 3.0, c + (c - b) / 3.0);
    bc + (bc - ab) / 15.0
}

#[test]
fn the_relaxing_body_extrapolated_to_no_step_is_its_exact_flow() {
    // Points and entropies to 16 digits and more (Gragg-Bulirsch-Stoer).
    let table = [
        (1.0, [0.000302005438967183, -1.000_001_151_105_896_8, 0.000794000407907643], None),
        (
            10.0,
            [-0.0066814549293953, -0.999_983_850_617_850_8, 0.00175940805437915],
            Some(0.500_007_719_426_589_8),
        ),
        (20.0, data("rigid_body", "x_T"), Some(0.500_493_595_208_811_3)),
        (
            30.0,
            [-0.596_732_137_587_354_2, -0.842_450_246_201_365_2, 0.149_825_538_984_829_03],
            Some(0.544_129_676_743_204_2),
        ),
        (
            50.0,
            [-1.397_818_864_117_175_7, -0.080_004_619_425_293_5, 0.05771650098489737],
            Some(0.981_814_755_248_578_5),
        ),
        (
            100.0,
            [-1.414_216_390_141_319, 0.00122059047737565, -0.000_047_088_671_655_43],
            Some(1.000_004_745_101_399_8),
        ),
    ];
    for (time, point, entropy) in table {
        let end = extrapolated(&relaxing_body(), UNSTABLE, time, 0.05);
        let off = (end - Vector3::from(point)).norm();
        println!("t = {time}: off by {off:.1e}");
        // Up to 8000 steps round p by ε|p| each, ε√8000 = 2·10⁻¹⁴ together; O(h⁶) is far below.
        assert!(off <= 5e-14, "t = {time}: {off:.1e}");
        if let Some(entropy) = entropy {
            // |dS| = |p| ≤ √2, and the published digits end at 10⁻¹⁵.
            let off = (0.5 * end.norm_squared() - entropy).abs();
            assert!(off <= 1e-13, "t = {time}: S is off by {off:.1e}");
        }
    }
}

#[test]
fn the_free_body_extrapolated_to_no_step_follows_its_elliptic_functions() {
    // Jacobi's solution within its first period, and after eight of them.
    let table = [
        (10.0, [0.979_621_777_929_109_3, -0.501_362_831_518_296_1, 0.720_400_224_444_001_3]),
        (100.0, [0.887_270_836_276_842_3, -0.970_052_499_801_104_3, 0.0418163929843483]),
    ];
    for (time, point) in table {
        let end = extrapolated(&free_body(), TUMBLING, time, 0.0125);
        let off = (end - Vector3::from(point)).norm();
        println!("t = {time}: off by {off:.1e}");
        // O(h⁶) is 4⁻⁶ of the 5·10⁻¹¹ that are left at the step 0.05; 32000 steps round M by
        // ε√32000 = 4·10⁻¹⁴.
        assert!(off <= 1e-13, "t = {time}: {off:.1e}");
    }
}

#[test]
fn the_spinning_top_has_the_published_errors() {
    // Errors at T = 5 of an independent implementation: Weyl midpoint, and exponential at x.
    let table = [
        (25, 3.572e-4, 1.747e-2),
        (50, 8.933e-5, 8.647e-3),
        (100, 2.233e-5, 4.303e-3),
        (200, 5.584e-6, 2.146e-3),
    ];
    let exact = vector![-0.135_129_410_617_930_4, 0.973_728_123_375_976_9, 0.183_285_526_250_026_5];
    let system = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(top).build().unwrap();
    let start = Vector3::from_element(3.0_f64.sqrt().recip());
    for (steps, weyl, exponential) in table {
        let span = Span::steps(5.0 / f64::from(steps), usize::try_from(steps).unwrap());
        let midpoint = WeylMidpoint.run(&system, start, span).unwrap();
        let error = (midpoint.last().point - exact).norm();
        assert!((error / weyl - 1.0).abs() < 1e-3, "{steps} steps: {error:.4e}");
        let based_at_x = Exponential.run(&system, start, span).unwrap();
        let error = (based_at_x.last().point - exact).norm();
        assert!((error / exponential - 1.0).abs() < 1e-3, "{steps} steps: {error:.4e}");
    }
}
