//! A product with more variables than the compiler adds.

use metriplectic::prelude::*;

fn main() {
    let _ = System::on(Product(Euclidean::<128>, Euclidean::<1>));
}
