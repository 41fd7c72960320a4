use metriplectic::prelude::*;

fn main() {
    let _ = System::on(LieDual::so3()).entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5).build();
}
