use metriplectic::prelude::*;

fn main() {
    let _ = System::on(LieDual::so3()).force(|xi: &Vector3<Real>| xi.norm_squared());
}
