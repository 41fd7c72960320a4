//! What the examples print when a program reads them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;
use std::time::SystemTime;

use metriplectic_studies::{Claim, Guarantee, scientific};

/// Runs an example. Each call draws into a folder of its own, so that the gallery keeps the pictures of a
/// reader.
fn example(name: &str, arguments: &[&str]) -> Output {
    command(name, arguments).output().expect("the example starts")
}

/// The same, not yet started.
fn command(name: &str, arguments: &[&str]) -> Command {
    let mut run = Command::new(program(name));
    run.args(arguments).env("CARGO_TARGET_DIR", gallery(name, arguments));
    run
}

/// The program of an example. A `cargo test` of everything has built it beside this test; a `cargo test` of
/// this test alone may have left one that is older than the sources, and then it is built for release.
fn program(name: &str) -> PathBuf {
    let tests = std::env::current_exe().expect("a test has a path");
    let folder = tests.ancestors().nth(2).expect("tests are in `deps` of a profile's folder");
    let beside = folder.join("examples").join(name);
    if modified(&beside).is_some_and(|time| time >= newest_source()) {
        return beside;
    }
    let mut build = Command::new(env!("CARGO"));
    build.args([
        "build",
        "--quiet",
        "--package",
        "metriplectic",
        "--example",
        name,
        "--target-dir",
    ]);
    build.arg(folder.parent().expect("a profile is in the build folder"));
    build.args(["--release", "--all-features"]);
    assert!(build.status().expect("cargo starts").success(), "{name} is not built");
    folder.with_file_name("release").join("examples").join(name)
}

fn modified(path: &Path) -> Option<SystemTime> {
    path.metadata().and_then(|data| data.modified()).ok()
}

/// When a source was changed last.
fn newest_source() -> SystemTime {
    static NEWEST: LazyLock<SystemTime> = LazyLock::new(|| {
        let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
        let mut folders = ["src", "crates", "examples"].map(|name| root.join(name)).to_vec();
        let mut newest = modified(&root.join("Cargo.toml")).expect("a manifest");
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).expect("a folder of sources") {
                let path = entry.expect("an entry").path();
                if path.is_dir() {
                    folders.push(path);
                } else {
                    newest = newest.max(modified(&path).expect("a source"));
                }
            }
        }
        newest
    });
    *NEWEST
}

/// Where such a call draws.
fn gallery(name: &str, arguments: &[&str]) -> String {
    format!("{}/{name}{}", env!("CARGO_TARGET_TMPDIR"), arguments.concat())
}

fn json(output: &Output) -> serde_json::Value {
    assert!(output.status.success());
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON value and nothing else")
}

#[test]
fn the_relaxing_rigid_body_prints_one_object() {
    let report = json(&example("relaxing_rigid_body", &["--json"]));
    assert_eq!(report["steps"], 1000);
    assert_eq!(report["second_law"], "Exact");
    let number = |key: &str| report[key].as_f64().expect("a number");
    assert!(number("max_relative_energy_error") <= 5e-15);
    assert!(number("min_entropy_increment") > 0.0);
    assert!(number("max_manifold_defect") == 0.0);
    let state: Vec<f64> =
        serde_json::from_value(report["final_state"].clone()).expect("a list of numbers");
    assert!((state[0] + 1.414_217).abs() < 1e-3 && state.len() == 3);
}

#[test]
fn the_relaxing_rigid_body_draws_its_figure_and_writes_its_table() {
    let arguments = ["--json", "--steps", "100"];
    assert_eq!(json(&example("relaxing_rigid_body", &arguments))["steps"], 100);
    let folder = format!("{}/gallery", gallery("relaxing_rigid_body", &arguments));
    let read = |name: &str| {
        std::fs::read_to_string(format!("{folder}/{name}")).expect("the example writes it")
    };
    let figure = read("relaxing_rigid_body.svg");
    for quantity in ["p₁", "p₂", "p₃", "H − H₀", "entropy S"] {
        assert!(figure.contains(quantity), "{quantity} is missing");
    }
    for letter in 'a'..='e' {
        assert!(figure.contains(&format!(">{letter}</text>")), "panel {letter} is missing");
    }
    // So that one sees that it is exact.
    assert!(["10⁻¹⁶", "10⁻¹⁷"].iter().any(|unit| figure.contains(&format!("({unit})"))));
    let table = read("relaxing_rigid_body.csv");
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some("t,p1,p2,p3,energy,entropy"));
    let rows: Vec<Vec<f64>> = lines
        .map(|line| line.split(',').map(|entry| entry.parse().expect("a number")).collect())
        .collect();
    assert!(rows.len() == 101 && rows.iter().all(|row| row.len() == 6));
    assert_eq!(rows[0][..4], [0.0, 0.001, -1.0, 0.001]);
}

#[test]
fn every_example_of_a_run_reports_the_same_keys() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples");
    let files = std::fs::read_dir(folder).expect("the examples are there");
    let names = files.map(|file| file.expect("a file").path());
    let names = names.map(|path| path.file_stem().map(|name| name.to_string_lossy().into_owned()));
    let mut seen = 0;
    // The study of convergence and the sweep are of many runs.
    let many = [
        "convergence",
        "sweep",
        "hysteresis_loops",
        "carnot_engine",
        "nanoparticle",
        "pulled_particle",
        "learning_data",
        // The runs that they report choose their steps.
        "entropy_containers",
        "heated_rod",
        "network",
    ];
    for name in names.flatten().filter(|name| !many.contains(&name.as_str())) {
        let report = json(&example(&name, &["--json", "--steps", "20"]));
        let (_, state) = certified(&report);
        assert!(report["steps"] == 20 && !state.is_empty(), "{name}: {report}");
        seen += 1;
    }
    assert!(seen >= 13);
}

/// The numbers that every example reports, with the state at the end.
fn certified(report: &serde_json::Value) -> ([f64; 3], Vec<f64>) {
    let keys = ["max_relative_energy_error", "min_entropy_increment", "max_manifold_defect"];
    let numbers = keys.map(|key| report[key].as_f64().expect("a number"));
    let state = serde_json::from_value(report["final_state"].clone());
    (numbers, state.expect("a list of numbers"))
}

#[test]
fn the_spinning_top_keeps_its_energy_where_runge_kutta_drifts() {
    let report = json(&example("spinning_top", &["--json"]));
    let ([energy, entropy, defect], state) = certified(&report);
    assert!(energy <= 5e-15 && entropy == 0.0 && defect <= 1e-15, "{report}");
    let drift = report["runge_kutta_energy_error"].as_f64().expect("a number");
    assert!(drift > 1e-8, "{report}");
    assert!(report["evaluations"].as_u64().expect("a count") < 12_500, "{report}");
    assert_eq!(state.len(), 3);
    // The exact flow at t = 30; the phase is off by an error of second order.
    let short = json(&example("spinning_top", &["--json", "--steps", "300"]));
    let exact = [-0.203_053_235_046, 0.965_621_558_204, -0.162_309_550_149];
    let (_, end) = certified(&short);
    assert!(end.iter().zip(exact).all(|(a, b)| (a - b).abs() < 1e-3), "{short}");
}

#[test]
fn the_sphere_relaxation_climbs_to_the_top_of_its_level_curve() {
    let report = json(&example("sphere_relaxation", &["--json"]));
    let ([energy, entropy, defect], state) = certified(&report);
    assert!(energy <= 5e-15 && entropy > 0.0 && defect <= 1e-15, "{report}");
    // At rest dS ∥ dH on the sphere: x, ∇S and ∇H are in one plane.
    let [x, y, z] = state[..] else { panic!("{report}") };
    let ds = [0.3 * y, 0.3 * x, 1.0];
    let dh = [x + x * x, 0.5 * (y + y * y), 0.25 * (z + z * z)];
    let volume = x * (ds[1] * dh[2] - ds[2] * dh[1])
        + y * (ds[2] * dh[0] - ds[0] * dh[2])
        + z * (ds[0] * dh[1] - ds[1] * dh[0]);
    assert!(volume.abs() < 1e-3, "{volume:.1e} in {report}");
}

#[test]
fn the_rotations_reach_the_reference_state() {
    let report = json(&example("rotations", &["--json"]));
    let ([energy, entropy, defect], state) = certified(&report);
    assert!(energy <= 5e-15 && entropy > 0.0 && defect <= 4e-15, "{report}");
    let cases: serde_json::Value =
        serde_json::from_str(include_str!("data/flow.json")).expect("the data are JSON");
    let case = cases.as_array().into_iter().flatten().find(|case| case["name"] == "so3_nambu");
    let exact: Vec<String> =
        serde_json::from_value(case.expect("the case")["x_T"].clone()).expect("a list of digits");
    assert_eq!((state.len(), exact.len()), (9, 9));
    for (entry, digits) in state.iter().zip(&exact) {
        let exact: f64 = digits.parse().expect("a number");
        assert!((entry - exact).abs() < 1e-3, "{entry} for {exact}");
    }
}

#[test]
fn the_spin_heats_its_bath_and_comes_to_rest_in_the_field() {
    let report = json(&example("spin_in_a_bath", &["--json"]));
    let ([energy, entropy, defect], state) = certified(&report);
    assert!(energy <= 1e-14 && entropy > 0.0 && defect <= 1e-15, "{report}");
    assert_eq!((&report["second_law"], &report["entropy_falls"]), (&"Exact".into(), &0.into()));
    assert!(state.len() == 4 && (state[2] - 1.0).abs() < 1e-6, "{report}");
    // All of the spin's energy is in the bath.
    let [end, rest] = ["temperature", "temperature_at_rest"].map(|key| report[key].as_f64());
    assert!((end.expect("a number") - rest.expect("a number")).abs() < 1e-6, "{report}");
}

/// A list of numbers in a report.
fn numbers(report: &serde_json::Value, key: &str) -> Vec<f64> {
    serde_json::from_value(report[key].clone()).expect("a list of numbers")
}

/// The number of further invariants, each of which is kept to round-off.
fn invariants(report: &serde_json::Value) -> usize {
    let kept = report["invariants"].as_array().expect("a list");
    for one in kept {
        assert!(one["max_error"].as_f64().expect("a number") <= 50.0 * f64::EPSILON, "{report}");
    }
    kept.len()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn the_heavy_top_rises_until_it_sleeps() {
    let report = json(&example("heavy_top", &["--json"]));
    let ([energy, entropy, _], state) = certified(&report);
    assert!(energy <= 5e-15 && entropy > 0.0 && report["entropy_falls"] == 0, "{report}");
    assert_eq!((invariants(&report), &report["second_law"]), (1, &"Exact".into()));
    let [reached, asleep] = numbers(&report, "entropies")[..] else { panic!("{report}") };
    assert!((asleep - 14_f64.sqrt()).abs() < 1e-14 && (asleep - reached).abs() < 1e-4, "{report}");
    assert!((state[5] - 1.0).abs() < 1e-4, "{report}");
    // The equations at t = 2, by a Runge-Kutta method in steps of 10⁻⁴; the error falls like h².
    let exact = [
        0.031_072_503_009,
        0.086_520_251_061,
        3.926_321_234_872,
        0.652_240_426_612,
        -0.402_376_062_496,
        0.642_398_575_826,
    ];
    let error = |steps: &str, h: &str| {
        let arguments = ["--json", "--steps", steps, "--step-size", h];
        distance(&certified(&json(&example("heavy_top", &arguments))).1, &exact)
    };
    let (coarse, fine) = (error("100", "0.02"), error("200", "0.01"));
    assert!(fine < 2e-4 && (coarse / fine - 4.0).abs() < 0.1, "{coarse:.2e}, {fine:.2e}");
}

#[test]
fn the_kovalevskaya_top_keeps_four_invariants_and_a_midpoint_rule_three() {
    let output = example("kovalevskaya_top", &[]);
    let text = String::from_utf8(output.stdout).expect("text");
    // "K     off by 2.8e-14; by the plain midpoint rule 3.6e-1"
    let errors = |name: &str| -> [f64; 2] {
        let line = text.lines().find(|line| line.starts_with(name) && line.contains("off by"));
        let line = line.unwrap_or_else(|| panic!("no line of {name} in {text}"));
        let number = |part: &str| part.rsplit(' ').next().and_then(|n| n.parse().ok());
        let parts = line.split_once(';').expect("two methods");
        [parts.0, parts.1].map(|part| number(part).expect("a number"))
    };
    for name in ["H", "n·l", "|n|²", "K"] {
        let [ours, plain] = errors(name);
        assert!(ours <= 1e-13, "{text}");
        // Published by Andrews and Farrell (2024): the midpoint rule loses K by 0.36, and keeps the others.
        assert!(if name == "K" { (0.3..0.4).contains(&plain) } else { plain < 1e-13 }, "{text}");
    }
}

#[test]
fn the_ellipse_of_kepler_does_not_turn_but_with_a_midpoint_rule() {
    let text = String::from_utf8(example("kepler", &[]).stdout).expect("text");
    let errors = |name: &str| -> [f64; 2] {
        let line = text.lines().find(|line| line.starts_with(name) && line.contains("off by"));
        let line = line.unwrap_or_else(|| panic!("no line of {name} in {text}"));
        let parts = line.split_once(';').expect("two methods");
        let number = |part: &str| part.rsplit(' ').next().and_then(|n| n.parse().ok());
        [parts.0, parts.1].map(|part| number(part).expect("a number"))
    };
    for (name, plain) in [("H", 1e-2..1e-1), ("L", 0.0..1e-14), ("the direction", 1.0..3.2)] {
        let [ours, theirs] = errors(name);
        assert!(ours <= 1e-14 && plain.contains(&theirs), "{text}");
    }
}

#[test]
fn the_entropy_containers_meet_their_reference() {
    let report = json(&example("entropy_containers", &["--json"]));
    let ([energy, entropy, _], _) = certified(&report);
    let errors: Vec<f64> = serde_json::from_value(report["errors"].clone()).expect("numbers");
    assert!(energy <= 5e-15 && entropy > 0.0 && report["entropy_falls"] == 0, "{report}");
    // The reference has 14 decimals; learned models are published with errors from 0.068 on.
    assert!(errors.len() == 2 && errors[0] < 2e-3 && errors[1] < 1e-13, "{report}");
}

#[test]
fn the_thermoelastic_rod_meets_its_references() {
    let report = json(&example("thermoelastic_rod", &["--json"]));
    let ([energy, entropy, _], _) = certified(&report);
    let errors: Vec<f64> = serde_json::from_value(report["errors"].clone()).expect("numbers");
    assert!(energy <= 5e-15 && entropy > 0.0, "{report}");
    // The references at t = 48 have ten digits, of an entry that has nearly come to rest.
    assert!(errors.len() == 2 && errors[0] < 1e-10 && errors[1] < 5e-9, "{report}");
}

#[test]
fn the_training_data_keep_both_laws_and_are_one_array() {
    let arguments = ["--json", "--steps", "20"];
    let report = json(&example("learning_data", &arguments));
    let number = |key: &str| report[key].as_f64().expect("a number");
    let claim = |guarantee, law: &str| {
        let problem = format!("training set of 50 double pendulums, 20 steps of 0.3: {law}");
        Claim::new(guarantee, problem, "DormandPrince8, tolerance 1e-9")
    };
    claim(Guarantee::Energy, "H")
        .against("H at the start, relative; 1.55e-4 in the published set, arXiv:2004.04653")
        .record(scientific(number("energy_error")), "5e-14");
    claim(Guarantee::Invariants, "L")
        .against("L at the start, relative; 5e-14 in the published set, arXiv:2004.04653")
        .record(scientific(number("momentum_error")), "5e-14");
    claim(Guarantee::Entropy, "S")
        .against("S of every step; no fall in the published set")
        .record(format!("{} runs with a fall", report["entropy_falls"]), "0 runs with a fall");
    assert!(number("energy_error") < 5e-14 && number("momentum_error") < 5e-14, "{report}");
    assert_eq!(report["entropy_falls"], 0, "{report}");
    assert_eq!([&report["rows"], &report["failed"]], [50, 0]);
    let folder = format!("{}/gallery", gallery("learning_data", &arguments));
    let bytes =
        std::fs::read(format!("{folder}/learning_data.npy")).expect("the example writes it");
    // 50 runs of 21 states with ten numbers.
    assert_eq!(bytes.len(), 128 + 50 * 21 * 10 * 8);
    assert!(String::from_utf8_lossy(&bytes[..128]).contains("(1050, 10)"), "the shape");
}

#[test]
fn the_forced_rigid_body_relaxes_as_by_the_metric_and_more_slowly_about_one_axis() {
    let report = json(&example("forced_rigid_body", &["--json"]));
    let ([energy, _, _], state) = certified(&report);
    assert!(energy <= 5e-15 && report["entropy_falls"] == 0, "{report}");
    let most = 10.0 * report["initial_energy"].as_f64().expect("a number");
    assert!((0.5 * state.iter().map(|p| p * p).sum::<f64>() - most).abs() < 1e-12, "{report}");
    // Steps are the same to round-off. But one that takes the round-off of its energy back is shifted
    // by that round-off over its own length, and near rest the steps are short.
    assert!(report["apart"].as_f64().expect("a number") < 1e-9, "{report}");
    let step = json(&example("forced_rigid_body", &["--json", "--steps", "1"]));
    assert!(step["apart"].as_f64().expect("a number") <= 8.0 * f64::EPSILON, "{step}");

    // What is left of the entropy about one axis halves from t = 100 to t = 200.
    let left = |report: &serde_json::Value| {
        let one = &report["about_one_axis"];
        assert_eq!(one["entropy_falls"], 0);
        let value = |key: &str| one[key].as_f64().expect("a number");
        assert!(value("max_energy_error") <= 5e-15, "{report}");
        most - value("initial_entropy") - value("entropy_gained")
    };
    let later = json(&example("forced_rigid_body", &["--json", "--steps", "2000"]));
    let ratio = left(&later) / left(&report);
    assert!((ratio - 0.5).abs() < 0.05, "{ratio}");
}

#[test]
fn a_saturated_torque_has_the_second_law_and_a_vortex_has_the_first_alone() {
    let report = json(&example("feedback_torque", &["--json"]));
    let ([energy, _, _], state) = certified(&report);
    assert!(energy <= 5e-15 && report["entropy_falls"] == 0, "{report}");
    assert_eq!(report["second_law"], "Exact");
    // ΔC/h is C' of the middle of the step, to the rounding of C over h.
    assert!(figure(&report, "rate_error") <= 8.0 * f64::EPSILON * 6.3 / 0.02, "{report}");
    let most = 3.0 * figure(&report, "initial_energy");
    let casimir = 0.5 * state.iter().map(|p| p * p).sum::<f64>();
    assert!((casimir - most).abs() < 1e-6, "{report}");
    let vortex = &report["vortex"];
    assert_eq!(vortex["second_law"], "Published");
    assert!(figure(vortex, "max_energy_error") <= 50.0 * f64::EPSILON * 2.1, "{report}");
    assert!(vortex["entropy_falls"].as_u64().expect("a count") > 100, "{report}");
}

#[test]
fn the_sleigh_follows_its_closed_form_with_order_two() {
    let report = json(&example("chaplygin_sleigh", &["--json"]));
    let ([energy, _, _], state) = certified(&report);
    assert!(energy <= 5e-15 && report["second_law"] == "NoEntropy", "{report}");
    assert!((figure(&report, "order") - 2.0).abs() < 0.01, "{report}");
    // At t = 20 it goes ahead as it came in: v = tanh 5, and the turn is 4 gd 5 with m = J = 1, a = ½.
    assert!((state[3] - 5_f64.tanh()).abs() < 1e-3, "{report}");
    assert!((state[2] - 8.0 * 2.5_f64.tanh().atan()).abs() < 1e-2, "{report}");
}

#[test]
fn the_satellite_ends_in_a_flat_spin() {
    let report = json(&example("tumbling_satellite", &["--json"]));
    let ([energy, entropy, defect], state) = certified(&report);
    assert!(energy <= 1e-14 && entropy > 0.0 && defect <= 4e-15, "{report}");
    assert_eq!((state.len(), &report["entropy_falls"]), (13, &0.into()));
    let [start, end, flat] = numbers(&report, "kinetic_energies")[..] else { panic!("{report}") };
    assert!(start > 2.9 * flat && (end - flat).abs() < 1e-5, "{report}");
    assert_eq!((invariants(&report), &report["second_law"]), (3, &"Exact".into()));
    // Attitude by rows, momentum and entropy at t = 10, by a Runge-Kutta method in 40000 steps; the
    // error falls like h².
    let exact = [
        [0.565_306_117_316, -0.817_728_598_011, 0.108_392_498_445],
        [0.809_705_977_900, 0.525_005_363_158, -0.262_193_817_638],
        [0.157_496_739_895, 0.235_985_822_984, 0.958_908_477_527],
        [0.480_759_995_177, 0.401_812_892_581, 1.907_856_448_057],
    ];
    let exact = [exact.as_flattened(), &[0.113_357_936_877]].concat();
    let error = |steps: &str, h: &str| {
        let arguments = ["--json", "--steps", steps, "--step-size", h];
        distance(&certified(&json(&example("tumbling_satellite", &arguments))).1, &exact)
    };
    let (coarse, fine) = (error("500", "0.02"), error("1000", "0.01"));
    assert!(fine < 2e-4 && (coarse / fine - 4.0).abs() < 0.1, "{coarse:.2e}, {fine:.2e}");
}

#[test]
fn the_steps_of_the_adaptive_relaxation_follow_the_motion_until_it_rests() {
    let report = json(&example("adaptive_relaxation", &["--json"]));
    let ([energy, _, defect], state) = certified(&report);
    assert!(energy <= 5e-15 && defect == 0.0 && report["entropy_falls"] == 0, "{report}");
    assert_eq!(report["rested"], true);
    let (smallest, largest) = (figure(&report, "smallest_step"), figure(&report, "largest_step"));
    assert!(largest > 100.0 * smallest, "{report}");
    // At rest on the axis of largest inertia, with S = H I₁.
    let axis = (2.0 * 10.0 * figure(&report, "initial_energy")).sqrt();
    assert!((state[0].abs() - axis).abs() < 1e-8, "{report}");
    // A bound on the number of steps is kept, and the run has not come to rest then.
    let short = json(&example("adaptive_relaxation", &["--json", "--steps", "30"]));
    assert_eq!((&short["steps"], &short["rested"]), (&30.into(), &false.into()));
}

/// Ctrl-C ends a run of some hours within moments, and its file has whole rows and its report.
#[cfg(unix)]
#[test]
fn an_interrupted_example_leaves_a_whole_file() {
    use std::process::Stdio;
    use std::time::{Duration, Instant};
    let arguments = ["--json", "--step-size", "1e-6"];
    let folder = gallery("adaptive_relaxation", &arguments);
    let path = format!("{folder}/gallery/adaptive_relaxation.csv");
    let _ = std::fs::remove_file(&path);
    let child = command("adaptive_relaxation", &arguments).stdout(Stdio::piped()).spawn();
    let child = child.expect("the example starts");
    let length = || std::fs::metadata(&path).map_or(0, |file| file.len());
    let begin = Instant::now();
    // The first rows are in the file once the loop is running.
    while length() < 1000 {
        assert!(begin.elapsed() < Duration::from_secs(60), "no row after a minute");
        std::thread::sleep(Duration::from_millis(5));
    }
    let interrupt = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(interrupt.expect("kill starts").success());
    let output = child.wait_with_output().expect("the example ends");
    assert!(output.status.success(), "{:?}", output.status);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON value");
    assert_eq!(report["rested"], false);
    let text = std::fs::read_to_string(&path).expect("the file is there");
    assert!(text.ends_with('\n'));
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("t,p1,p2,p3,entropy"));
    let rows: Vec<Vec<f64>> = lines
        .map(|line| line.split(',').map(|entry| entry.parse().expect("a number")).collect())
        .collect();
    assert!(rows.iter().all(|row| row.len() == 5));
    // Every step that the report counts, and the start.
    assert_eq!(report["steps"], rows.len() - 1);
    // The same bits: `serde_json` may read a number of the report an ulp off, `parse` does not.
    let printed = String::from_utf8_lossy(&output.stdout);
    let time = printed.split("\"time\":").nth(1).and_then(|rest| rest.split([',', '}']).next());
    let time: Option<f64> = time.and_then(|digits| digits.trim().parse().ok());
    assert!(time.is_some());
    assert_eq!(rows.last().map(|row| row[0]), time);
}

#[test]
fn your_own_metric_has_its_semicircles_and_comes_to_rest_where_ds_is_parallel_to_dh() {
    let report = json(&example("your_own_metric", &["--json"]));
    let ([energy, entropy, _], state) = certified(&report);
    assert!(energy <= 5e-15 && entropy > 0.0, "{report}");
    assert!(report["geodesic_deviation"].as_f64().expect("a number") < 5e-12, "{report}");
    let [x, y, phi] = state[..] else { panic!("{report}") };
    // dS = (−x/y, −(y² − x² − 1)/2y², −φ) is nearly a multiple of (½, 0, 1): the last turn of the
    // spiral is some thousandths wide.
    assert!((x / y - 0.5 * phi).abs() < 1e-2, "{report}");
    assert!((1.0 + x * x - y * y).abs() < 1e-2, "{report}");
}

#[test]
fn the_run_of_an_example_can_be_changed() {
    let arguments = ["--json", "--steps", "10", "--step-size", "0.05"];
    let report = json(&example("relaxing_rigid_body", &arguments));
    assert_eq!((&report["steps"], &report["largest_step"]), (&10.into(), &0.05.into()));
    let refused = example("relaxing_rigid_body", &["--step-size", "-1"]);
    assert!(!refused.status.success() && refused.stdout.is_empty());
    assert!(String::from_utf8_lossy(&refused.stderr).contains("positive"));
}

#[test]
fn help_says_what_an_example_is_and_its_defaults() {
    let help = example("heavy_top", &["--help"]);
    let text = String::from_utf8_lossy(&help.stdout);
    for part in ["A heavy top rises", "[default: 1200]", "[default: 0.05]", "--json"] {
        assert!(help.status.success() && text.contains(part), "{part} in {text}");
    }
    // A study of many runs has no step of its own.
    let refused = example("convergence", &["--steps", "10"]);
    assert!(!refused.status.success() && refused.stdout.is_empty());
}

#[test]
fn the_convergence_study_prints_an_array_of_orders() {
    let report = json(&example("convergence", &["--json"]));
    let rows = report.as_array().expect("an array");
    assert_eq!(rows.len(), 47);
    for row in rows {
        let mut keys: Vec<_> = row.as_object().expect("an object").keys().collect();
        keys.sort();
        let expected = "agrees errors expected_order manifold metric order order_interval problem scheme steps \
                        worst_energy_error";
        assert!(keys.into_iter().eq(expected.split(' ')), "{row}");
        assert!(
            row.as_object().expect("an object").values().all(|value| !value.is_null()),
            "{row}"
        );
        // The order is within 0.05 of theory, with its whole interval, and the energy is conserved on the way.
        let expected = if row["scheme"] == "exponential" { 1.0 } else { 2.0 };
        let text = |key: &str| row[key].as_str().expect("a text");
        let [low, high] = [0, 1].map(|k| row["order_interval"][k].as_f64().expect("a number"));
        let place = match text("metric") {
            "canonical" => text("manifold").to_owned(),
            metric => format!("{}, {metric} metric", text("manifold")),
        };
        Claim::new(Guarantee::Order, format!("{}, {place}", text("problem")), text("scheme"))
            .against("a Runge-Kutta flow of order 4 of the same velocity")
            .record(
                format!("{:.2} [{low:.2}, {high:.2}]", figure(row, "order")),
                format!("{expected} ± 0.05"),
            );
        assert!(row["agrees"] == true && row["expected_order"] == expected, "{row}");
        assert!((figure(row, "order") - expected).abs() <= 0.05, "{row}");
        assert!(figure(row, "worst_energy_error") <= 50.0 * f64::EPSILON, "{row}");
    }
}

/// One of the numbers of a report.
fn figure(report: &serde_json::Value, key: &str) -> f64 {
    report[key].as_f64().unwrap_or_else(|| panic!("{key} in {report}"))
}

#[test]
fn the_gas_containers_lose_entropy_with_the_published_scheme_alone() {
    let report = json(&example("gas_containers", &["--json"]));
    let (published, exact) = (&report["published"], &report);
    for run in [published, exact] {
        assert_eq!(run["steps"], 300);
        assert!((figure(run, "initial_energy") - 6.0).abs() < 1e-15);
        assert!(figure(run, "max_energy_error") <= 5e-14 * 6.0, "{run}");
    }
    // A reference scheme of another hand falls on 150 steps, by 1.4e-3 at worst.
    let falls = published["entropy_falls"].as_u64().expect("a count");
    assert!((148..=152).contains(&falls), "{published}");
    assert!((figure(published, "min_entropy_increment") + 1.4e-3).abs() < 1e-4, "{published}");
    assert_eq!(exact["entropy_falls"], 0);
    assert!(figure(exact, "min_entropy_increment") >= 0.0, "{exact}");

    // A quarter of the step does not mend it.
    let run = |steps, h| {
        json(&example("gas_containers", &["--json", "--steps", steps, "--step-size", h]))
    };
    let fine = run("1200", "0.025");
    let falls = fine["published"]["entropy_falls"].as_u64().expect("a count");
    assert!((498..=502).contains(&falls), "{fine}");
    assert_eq!(fine["entropy_falls"], 0);

    // The flow at t = 30, by a Runge-Kutta method of order 4 with h = 1e-3.
    let finest = run("4800", "0.00625");
    let state: Vec<f64> = serde_json::from_value(finest["final_state"].clone()).expect("numbers");
    let flow = [1.711_934_52, 0.069_399_6, 1.401_216_8, 4.596_375_1];
    assert!(state.iter().zip(flow).all(|(a, b)| (a - b).abs() < 3e-2), "{finest}");
    for run in [&finest["published"], &finest] {
        assert!((figure(run, "entropy_gained") - 7.528_452e-3).abs() < 2e-4, "{finest}");
    }
}

#[test]
fn the_damped_oscillator_goes_to_its_closed_form_with_order_two() {
    let report = json(&example("damped_oscillator", &["--json"]));
    let ([energy, entropy, _], state) = certified(&report);
    assert!(energy <= 5e-14 && entropy > 0.0, "{report}");
    assert_eq!(report["entropy_falls"], 0);
    let closed = [1.042_199_194_672_55, 0.615_567_352_383_51, 1.267_448_836_651_72];
    let error = state.iter().zip(closed).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let errors: Vec<f64> = serde_json::from_value(report["errors"].clone()).expect("numbers");
    assert!((errors[0] - error).abs() < 1e-12 && errors.len() == 4, "{report}");
    // The midpoint rule turns by 2 atan(h/2) rather than by h: late by h²/12 of the angle.
    let late = 100.0 * 0.1_f64.powi(2) / 12.0 * (closed[0].powi(2) + closed[1].powi(2)).sqrt();
    assert!((error / late - 1.0).abs() < 0.02, "{error:.4} for {late:.4}");
    assert!((figure(&report, "order") - 2.0).abs() < 0.01, "{report}");
}

#[test]
fn the_molecule_in_si_units_is_its_twin_and_warms_its_bath() {
    let run = |steps, h| {
        json(&example("molecule_in_si_units", &["--json", "--steps", steps, "--step-size", h]))
    };
    // r, p and s after 10⁻¹³ s, by the classical Runge-Kutta method in SI units.
    let flow = |x: [f64; 3]| {
        let [mu, d, a, r0] = [1.6266e-27, 7.399e-19, 1.868e10, 1.2746e-10];
        let ([v, t], e) = ([x[1] / mu, 300.0 * (x[2] / 1.38e-21).exp()], (-a * (x[0] - r0)).exp());
        [v, -2.0 * d * a * (1.0 - e) * e - 3e-14 * v, 3e-14 * v * v / t]
    };
    let plus = |x: [f64; 3], k: [f64; 3], h: f64| [0, 1, 2].map(|i| x[i] + h * k[i]);
    let (mut x, h) = ([1.2746e-10 + 0.5 / 1.868e10, 0.0, 0.0], 1e-18);
    for _ in 0..100_000 {
        let a = flow(x);
        let b = flow(plus(x, a, 0.5 * h));
        let c = flow(plus(x, b, 0.5 * h));
        let d = flow(plus(x, c, h));
        x = [0, 1, 2].map(|i| x[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
    }
    let errors = [("1000", "1e-16"), ("2000", "5e-17")].map(|(steps, h)| {
        let report = run(steps, h);
        let ([energy, entropy, _], state) = certified(&report);
        assert!(energy <= 5e-14 && entropy > 0.0 && report["entropy_falls"] == 0, "{report}");
        // The entropy is known to the fourth digit.
        assert!((state[2] / x[2] - 1.0).abs() < 1e-3, "{report}");
        [(state[0] - x[0]).abs() * 1.868e10, figure(&report, "apart")]
    });
    assert!((errors[0][0] / errors[1][0] - 4.0).abs() < 0.1, "{errors:?}");
    // The discrete gradient depends on the units through the metric, but at second order only, and the twin
    // is nearer to the run than either is to the flow.
    assert!((errors[0][1] / errors[1][1] - 4.0).abs() < 0.1, "{errors:?}");
    assert!(errors[0][1] < 0.1 * errors[0][0], "{errors:?}");
    let report = run("4000", "1e-16");
    let [end, rest] = ["temperature", "temperature_at_rest"].map(|key| figure(&report, key));
    assert!((end - rest).abs() < 0.1 && rest > 380.0, "{report}");
}

#[test]
fn the_thermoelastic_pendulum_keeps_energy_and_angular_momentum() {
    let run = |steps, h| {
        json(&example("thermoelastic_pendulum", &["--json", "--steps", steps, "--step-size", h]))
    };
    let errors = [("800", "0.05"), ("1600", "0.025")].map(|(steps, h)| {
        let report = run(steps, h);
        assert!((figure(&report, "initial_energy") - 4.435_059_592_089_027).abs() < 1e-14);
        assert!(figure(&report, "max_relative_energy_error") <= 5e-14, "{report}");
        assert!(figure(&report, "min_entropy_increment") > 0.0, "{report}");
        let momentum = &report["invariants"][0];
        assert!((figure(momentum, "initial") - 2.0).abs() < 1e-15, "{momentum}");
        assert!(figure(momentum, "max_error") <= 50.0 * f64::EPSILON * 2.0, "{momentum}");
        figure(&report, "final_entropy") - 2.826_653_749_911_492
    });
    assert!(errors[0].abs() < 1e-3, "{errors:?}");
    assert!((errors[0] / errors[1] - 4.0).abs() < 0.1, "{errors:?}");
}

/// Asserts that a model keeps both laws and its momenta over so many steps.
fn keeps_its_laws(name: &str, steps: u32, size: &str, allowed: f64) {
    let options = ["--json", "--steps", &steps.to_string(), "--step-size", size];
    let report = json(&example(name, &options));
    let number = |key: &str| report[key].as_f64().expect("a number");
    let (energy, taken) = (number("initial_energy").abs().max(1.0), number("steps"));
    let error = number("max_energy_error") / energy;
    println!("{name}: {taken} steps, |H − H₀| ≤ {error:.1e}, {}", report["invariants"]);
    assert!(taken >= f64::from(steps) && error <= 50.0 * f64::EPSILON, "{name}: {report}");
    assert_eq!(report["entropy_falls"], 0, "{name}: {report}");
    for kept in report["invariants"].as_array().expect("a list") {
        let error = kept["max_error"].as_f64().expect("a number");
        assert!(error <= allowed, "{name}: {kept}");
    }
}

#[test]
fn every_model_keeps_both_laws_over_a_hundred_thousand_steps() {
    for name in [
        "gas_containers",
        "thermoelastic_pendulum",
        "heavy_top",
        "forced_rigid_body",
        "feedback_torque",
    ] {
        keeps_its_laws(name, 100_000, "0.05", 5e-14);
    }
    // The oscillator is at rest after t = 10⁴, with no error left of which to fit an order.
    keeps_its_laws("damped_oscillator", 100_000, "0.001", 5e-14);
}

#[test]
fn the_satellite_keeps_both_laws_on_its_way_to_rest_and_there() {
    keeps_its_laws("tumbling_satellite", 20_000, "0.05", 5e-14);
}

#[test]
#[ignore = "slow study: a hundred thousand steps in thirteen dimensions"]
fn the_satellite_keeps_both_laws_over_a_hundred_thousand_steps() {
    // At rest, a relative equilibrium, the three momenta of the satellite are dependent.
    keeps_its_laws("tumbling_satellite", 100_000, "0.05", 1e-9);
}

#[test]
fn the_top_crosses_a_plane_after_one_period_each() {
    let report = json(&example("plane_crossings", &["--json"]));
    let ([energy, entropy, defect], _) = certified(&report);
    assert!(energy <= 5e-15 && entropy == 0.0 && defect <= 1e-15, "{report}");
    // Twice in each of ten periods up to t = 200.
    assert_eq!((&report["crossings"], &report["outputs"]), (&20.into(), &1000.into()));
    assert!(figure(&report, "period_error") < 1e-10, "{report}");
    // With half the step a period is the same to the error of order 8.
    let fine =
        json(&example("plane_crossings", &["--json", "--steps", "1600", "--step-size", "0.125"]));
    assert!(
        (figure(&report, "period") - figure(&fine, "period")).abs() < 1e-10,
        "{report}, {fine}"
    );
    assert!(figure(&fine, "period_error") < 1e-12, "{fine}");
    // The exact flow at t = 30.
    let short = json(&example("plane_crossings", &["--json", "--steps", "120"]));
    let exact = [-0.203_053_235_046, 0.965_621_558_204, -0.162_309_550_149];
    assert!(distance(&certified(&short).1, &exact) < 1e-9, "{short}");
}

#[test]
fn both_laws_make_the_long_run_of_the_gases_more_accurate() {
    let report = json(&example("gas_containers_long", &["--json"]));
    let ([energy, entropy, _], state) = certified(&report);
    assert!(energy <= 5e-15 && entropy > 0.0 && report["entropy_falls"] == 0, "{report}");
    // Both take the same steps, to one in a thousand.
    let (with, without) = (figure(&report, "steps"), figure(&report, "steps_without_laws"));
    assert!((with / without - 1.0).abs() < 1e-3, "{report}");
    let error = |of: &str, run: &str| figure(&report, &format!("{of}_error_{run}"));
    for (of, gain) in [("entropy", 1e3), ("position", 1e3), ("energy", 1e8)] {
        let (with, without) = (error(of, "with_both_laws"), error(of, "without"));
        assert!(gain * with < without, "{of}: {with:.1e}, {without:.1e}");
    }
    // The flow at t = 10⁴ in numbers of twice the digits, by `benches/peers`.
    let flow =
        [0.697_372_907_244_776, 0.543_261_789_486_713, 3.526_959_397_033_727, 2.325_473_917_008_12];
    assert!(distance(&state, &flow) < 1e-5, "{report}");
}

#[test]
fn the_colloid_follows_its_drift_and_is_damped() {
    let report = json(&example("colloid", &["--json"]));
    let ([energy, entropy, _], state) = certified(&report);
    assert!(energy <= 1e-14 && entropy > 0.0, "{report}");
    assert_eq!(report["entropy_falls"], 0);
    // Of the 102 nm where the drift begins, in closed form; without damping the momentum is 10⁻¹⁷.
    assert!(figure(&report, "apart") < 1e-10 && state[1].abs() < 1e-20, "{report}");
    assert!(figure(&report, "friction") < 10.0 && figure(&report["midpoint"], "friction") > 100.0);
}

#[test]
fn two_spins_keep_an_angular_momentum_that_is_not_listed() {
    let run = |steps| {
        let report = json(&example("two_spins", &["--json", "--steps", steps]));
        let ([energy, _, _], _) = certified(&report);
        assert!(energy <= 2e-14, "{report}");
        ["momentum", "momentum_explicit", "momentum_radau"].map(|name| figure(&report, name))
    };
    let (short, long) = (run("1000"), run("5000"));
    assert!(long[0] < 1e-5 && long[0] < 1.1 * short[0], "{long:?}");
    assert!(long[1] > 4.0 * short[1] && long[2] > 4.0 * short[2], "{short:?}, {long:?}");
}

#[test]
fn the_shards_of_the_sweep_make_the_table_of_one_process() {
    let folder = PathBuf::from(gallery("sweep", &["shards"]));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    let in_folder = |arguments: &[&str]| {
        let output = command("sweep", arguments).current_dir(&folder).output();
        let report = json(&output.expect("the example starts"));
        (report, gallery("sweep", arguments) + "/gallery/sweep.csv")
    };
    let (whole, table) = in_folder(&["--json"]);
    assert_eq!([&whole["rows"], &whole["failed"], &whole["missing"]], [1000, 0, 0], "{whole}");
    assert!(figure(&whole, "worst_energy_error") <= 50.0 * f64::EPSILON, "{whole}");
    // Half of the bodies fall to either side, by stripes.
    assert!((0.4..0.6).contains(&(figure(&whole, "backwards") / 1000.0)), "{whole}");
    for shard in ["0/2", "1/2"] {
        let (part, _) = in_folder(&["--json", "--shard", shard]);
        assert_eq!([&part["rows"], &part["missing"]], [500, 500], "{part}");
    }
    let (merged, shards) = in_folder(&["--json", "--merge"]);
    assert_eq!(merged, whole);
    let read = |path: &str| std::fs::read(path).expect("the example writes it");
    assert!(read(&table) == read(&shards));
}

#[test]
fn a_fit_finds_the_coefficients_of_a_metric() {
    let report = json(&example("fit_metric", &["--json"]));
    let mut worst = 0.0_f64;
    for (key, truth) in [("a", 1.5), ("b", 1.0), ("c", 2.2), ("d", 0.8)] {
        let error = figure(&report, &format!("{key}_error"));
        assert!(error < 0.05, "{report}");
        worst = worst.max((figure(&report, key) - truth).abs() / error);
    }
    assert!(worst < 4.0, "{report}");
    let claim = |about: &str| Claim::new(Guarantee::Derivatives, about, "DormandPrince8 on so(3)*");
    claim("four coefficients of a metric, from 240 numbers with noise")
        .against("the truth")
        .record(format!("{worst:.1} standard errors"), "4");
    let law = figure(&report, "tangent_law");
    claim("`dH T`, over the run of the fit").record(scientific(law), scientific(1e-12));
    assert!((figure(&report, "noise") - 1e-3).abs() < 2e-4, "{report}");
    assert!(figure(&report, "runs") <= 30.0 && figure(&report, "tangent_law") < 1e-12, "{report}");
}

#[test]
fn a_fit_finds_the_inertias_of_a_body() {
    let report = json(&example("fit_rigid_body", &["--json"]));
    let off = |key: &str, truth: f64| {
        (figure(&report, key) - truth) / figure(&report, &format!("{key}_error"))
    };
    assert!(off("I1", 3.0).abs() < 4.0 && off("friction", 0.08).abs() < 4.0, "{report}");
    assert!((figure(&report, "noise") - 1e-3).abs() < 2e-4, "{report}");
    assert!(figure(&report, "runs") <= 30.0 && figure(&report, "tangent_law") < 1e-12, "{report}");
}

#[test]
fn neighbours_of_a_top_lie_on_the_ellipse_of_its_tangent() {
    let report = json(&example("sensitivity_of_a_top", &["--json"]));
    let (growth, off) = (figure(&report, "growth"), figure(&report, "distance_from_the_ellipse"));
    // They are off by the square of their distance, some 10⁻³ of 2·10⁻².
    assert!(growth > 1.2 && off < 2e-3, "{report}");
    assert!(figure(&report, "tangent_law") < 1e-8, "{report}");
}

#[test]
fn a_capacitor_turns_half_of_its_energy_into_heat_each_time() {
    let report = json(&example("rc_circuit", &["--json"]));
    assert_eq!(report["entropy_falls"], 0);
    let (heat, whole) = (figure(&report, "heat_of_both"), figure(&report, "c_v_squared"));
    assert!((heat / whole - 1.0).abs() < 1e-7, "{report}");
}

#[test]
fn the_oven_at_the_end_of_a_rod_gives_the_heat_of_the_closed_form() {
    let report = json(&example("heated_rod", &["--json"]));
    assert_eq!(report["entropy_falls"], 0);
    let [heat, exact] = ["heat", "heat_by_the_closed_form"].map(|key| figure(&report, key));
    // The first seconds are those of sites, and not of a continuous rod.
    assert!((heat / exact - 1.0).abs() < 1e-2, "{report}");
    assert!(figure(&report, "heat_less_gain").abs() < 1e-12, "{report}");
}

#[test]
fn the_engine_obeys_the_identity_of_its_efficiency_at_each_speed() {
    let report = json(&example("carnot_engine", &["--json"]));
    let list = |key: &str| -> Vec<f64> {
        serde_json::from_value(report[key].clone()).expect("a list of numbers")
    };
    let (efficiencies, off) = (list("efficiencies"), list("errors_of_the_identity"));
    assert!(
        efficiencies.is_sorted() && efficiencies[3] > 0.49 && efficiencies[3] < 0.5,
        "{report}"
    );
    assert!(off.len() == 4 && off.iter().all(|off| off.abs() < 1e-12), "{report}");
}

#[test]
fn the_loops_of_a_spin_have_the_work_of_the_field_as_heat() {
    let report = json(&example("spin_in_a_rotating_field", &["--json"]));
    let ([energy, _, manifold], _) = certified(&report);
    assert!(energy <= 5e-15 && manifold <= 1e-15, "{report}");
    // Two loops end where they began, but for what the spin still holds.
    let (work, heat) = (figure(&report, "work"), figure(&report, "heat"));
    assert!(work > 0.3 && (work + heat).abs() < 0.01 * work, "{report}");
}

#[test]
fn the_wheels_stop_the_satellite_and_keep_its_momentum() {
    let report = json(&example("reaction_wheels", &["--json"]));
    let (_, state) = certified(&report);
    // Rounding is that of the energy that the motors have brought in.
    let most = figure(&report, "initial_energy") + figure(&report, "work");
    assert!(figure(&report, "max_energy_error") <= 4.0 * f64::EPSILON * most, "{report}");
    let momentum = state[..3].iter().map(|l| l * l).sum::<f64>();
    assert!((momentum - 1.42).abs() < 1e-13 && figure(&report, "speed") < 0.05, "{report}");
}

#[test]
fn a_thermal_body_and_fluctuating_heat_have_the_means_of_their_laws() {
    let body = json(&example("thermal_rigid_body", &["--json"]));
    let (mean, exact) = (figure(&body, "mean_entropy"), figure(&body, "mean_entropy_of_the_law"));
    assert!((mean / exact - 1.0).abs() < 0.02, "{body}");
    assert!(figure(&body, "distance_of_the_histogram") < 0.15, "{body}");
    let (theorem, error) = (figure(&body, "fluctuation_theorem"), figure(&body, "standard_error"));
    assert!((theorem - 1.0).abs() < 4.0 * error && error < 0.2, "{body}");
    let heat = json(&example("fluctuating_heat", &["--json"]));
    let (variance, exact) = (figure(&heat, "variance"), figure(&heat, "variance_of_the_law"));
    assert!((variance / exact - 1.0).abs() < 0.06, "{heat}");
    assert!((figure(&heat, "mean") - figure(&heat, "mean_of_the_law")).abs() < 2e-3, "{heat}");
    for report in [body, heat] {
        assert!(figure(&report, "max_relative_energy_error") < 5e-15, "{report}");
        assert!(figure(&report, "min_entropy_increment") < 0.0, "{report}");
    }
}

#[test]
fn a_nanoparticle_and_a_pulled_particle_obey_their_equalities() {
    let spin = json(&example("nanoparticle", &["--json"]));
    assert!(figure(&spin, "worst_in_standard_errors") < 4.0, "{spin}");
    assert!(figure(&spin, "worst_balance_in_thermal_energies") < 1e-13, "{spin}");
    let pulled = json(&example("pulled_particle", &["--json"]));
    let (mean, error) = (figure(&pulled, "jarzynski"), figure(&pulled, "standard_error"));
    assert!((mean - 1.0).abs() < 4.0 * error && error < 0.03, "{pulled}");
    assert!(figure(&pulled, "mean_work") > figure(&pulled, "free_energy") + 0.2, "{pulled}");
    assert!(figure(&pulled, "worst_balance") < 1e-13, "{pulled}");
}
