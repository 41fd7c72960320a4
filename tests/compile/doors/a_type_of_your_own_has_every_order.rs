use metriplectic::prelude::*;
use num_dual::Dual3_64;

struct HalfSquare;

impl<const N: usize> ScalarField<Euclidean<N>> for HalfSquare {
    fn at<D: Scalar>(&self, x: &SVector<D, N>) -> D {
        x.dot(x) * 0.5
    }
}

fn main() {
    let x = vector![Dual3_64::from_re(3.0).derivative(), Dual3_64::from_re(4.0)];
    let f = HalfSquare.at(&x);
    assert_eq!((f.re, f.v1, f.v2, f.v3), (12.5, 3.0, 1.0, 0.0));
}
