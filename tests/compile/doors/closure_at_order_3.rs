use metriplectic::prelude::*;
use num_dual::Dual3_64;

fn main() {
    let f = |x: &Vector2<Real>| x.norm_squared() * 0.5;
    let x = vector![Dual3_64::from_re(3.0).derivative(), Dual3_64::from_re(4.0)];
    let _: Dual3_64 = ScalarField::<Euclidean<2>>::at(&f, &x);
}
