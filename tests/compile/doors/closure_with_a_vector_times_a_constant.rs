use metriplectic::prelude::*;

fn main() {
    let _ = System::on(LieDual::so3()).energy(|p: &Vector3<Real>| (p * 0.5).dot(p));
}
