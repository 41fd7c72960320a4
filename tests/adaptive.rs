//! Steps of a size that follows the motion.

mod models;

use std::time::Instant;

use metriplectic::prelude::*;
use models::{TUMBLING, UNSTABLE, free_body, half_square, kinetic, relaxing_body};

#[test]
fn probe() {
    let body = relaxing_body();
    for tolerance in [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8] {
        let begin = Instant::now();
        let run =
            WeylMidpoint.run(&body, UNSTABLE, Span::until(100.0).tolerance(tolerance)).unwrap();
        let t = begin.elapsed();
        println!("{tolerance:.0e}: {t:?} {:?}\n{}", run.last().point, run.certificate());
        let n = run.certificate().steps;
        let begin = Instant::now();
        let fixed = WeylMidpoint.run(&body, UNSTABLE, Span::steps(100.0 / n as f64, n)).unwrap();
        println!(
            "fixed: {:?} {:?} {:?} sweeps {}",
            begin.elapsed(),
            fixed.last().point,
            (fixed.last().point - run.last().point).norm(),
            fixed.certificate().sweeps
        );
    }
}
