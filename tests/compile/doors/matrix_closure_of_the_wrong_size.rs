use metriplectic::prelude::*;

fn main() {
    let _ = System::on(LieDual::so3())
        .metric(Metric::field(|_: &Vector3<Real>| Matrix2::<Real>::identity()));
}
