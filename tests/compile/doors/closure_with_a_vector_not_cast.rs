use metriplectic::prelude::*;

fn main() {
    let axis = Vector3::new(0.0, 0.6, 0.8);
    let _ = System::on(LieDual::so3()).energy(move |p: &Vector3<Real>| p.dot(&axis));
}
