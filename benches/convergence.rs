//! The convergence study as a bench: the table of fitted orders, with the time that it took.

use std::time::Instant;

use metriplectic_studies::Convergence;
use metriplectic_studies::problems::Orders;

fn main() {
    let begin = Instant::now();
    let orders = Orders::of_every_problem();
    println!("{}", Convergence::table(&orders.studies));
    println!("worst energy error {:.1e}", orders.energy_error);
    for failure in &orders.failures {
        println!("{failure}");
    }
    println!("{} studies in {:.1?}", orders.studies.len(), begin.elapsed());
}
