//! Prints the solutions that errors are measured against, and how far those with
//! twice as many steps are from them.

use metriplectic_peers::{Gas, Problem, RelaxingBody, SpinningTop, exact};

fn print<P: Problem<N>, const N: usize>(problem: &P) {
    for time in [30.0, 100.0, 1e4] {
        let steps = 8 * time as u32;
        let [coarse, fine] = [1, 2].map(|k| exact::flow(problem, time, k * steps));
        let apart = (0..N).map(|i| f64::from(fine[i] - coarse[i]).abs()).fold(0.0, f64::max);
        println!("{}, t = {time}: {apart:.1e} apart", problem.name());
        for x in fine {
            println!("    {:?},", f64::from(x));
        }
    }
}

fn main() {
    print(&RelaxingBody);
    print(&SpinningTop);
    print(&Gas { alpha: 1e-3 });
    print(&Gas { alpha: 0.5 });
}
