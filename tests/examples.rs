//! What the examples print when a program reads them.

use std::process::{Command, Output};

/// Builds an example as these tests were built, which takes no time if `cargo test` has just done
/// it, and runs it. Each call draws into a folder of its own, so that the gallery keeps the pictures
/// of a reader.
fn example(name: &str, arguments: &[&str]) -> Output {
    let tests = std::env::current_exe().expect("a test has a path");
    let folder = tests.ancestors().nth(2).expect("tests are in `deps` of a profile's folder");
    let mut build = Command::new(env!("CARGO"));
    build.args(["build", "--quiet", "--workspace", "--example", name, "--target-dir"]);
    build.arg(folder.parent().expect("a profile is in the build folder"));
    build.args(["--profile", if cfg!(debug_assertions) { "test" } else { "release" }]);
    if cfg!(feature = "serde") {
        build.arg("--all-features");
    }
    assert!(build.status().expect("cargo starts").success(), "{name} is not built");

    let program = folder.join("examples").join(name);
    let gallery = format!("{}/{name}{}", env!("CARGO_TARGET_TMPDIR"), arguments.concat());
    let run = Command::new(program).args(arguments).env("CARGO_TARGET_DIR", gallery).output();
    run.expect("the example starts")
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
    assert_eq!(report["second_law"], "Casimir");
    let number = |key: &str| report[key].as_f64().expect("a number");
    assert!(number("max_relative_energy_error") <= 5e-15);
    assert!(number("min_entropy_increment") > 0.0);
    assert!(number("max_manifold_defect") == 0.0);
    let state: Vec<f64> =
        serde_json::from_value(report["final_state"].clone()).expect("a list of numbers");
    assert!((state[0] + 1.414_217).abs() < 1e-3 && state.len() == 3);
}

#[test]
fn the_run_of_an_example_can_be_changed() {
    let arguments = ["--json", "--steps", "10", "--step-size", "0.05"];
    assert_eq!(json(&example("relaxing_rigid_body", &arguments))["steps"], 10);
    let refused = example("relaxing_rigid_body", &["--step-size", "-1"]);
    assert!(!refused.status.success() && refused.stdout.is_empty());
    assert!(String::from_utf8_lossy(&refused.stderr).contains("positive"));
}

#[test]
fn the_convergence_study_prints_an_array_of_orders() {
    let report = json(&example("convergence", &["--json"]));
    let rows = report.as_array().expect("an array");
    assert_eq!(rows.len(), 10);
    for row in rows {
        for key in ["problem", "manifold", "metric", "scheme", "steps", "errors", "order_interval"]
        {
            assert!(!row[key].is_null(), "{key} is missing in {row}");
        }
        let expected = if row["scheme"] == "Weyl midpoint" { 2.0 } else { 1.0 };
        let order = row["order"].as_f64().expect("a number");
        assert!((order - expected).abs() < 0.05, "{row}");
    }
}
