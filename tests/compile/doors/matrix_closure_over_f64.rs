use metriplectic::prelude::*;

fn main() {
    let g = Matrix3::from_diagonal(&vector![2.0, 1.0, 3.0]);
    let _ = System::on(LieDual::so3()).metric(Metric::field(move |_: &Vector3<f64>| g));
}
