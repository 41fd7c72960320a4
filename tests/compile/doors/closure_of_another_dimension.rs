use metriplectic::prelude::*;

fn main() {
    let _ = System::on(LieDual::so3()).energy(|p: &Vector2<Real>| p.norm_squared() * 0.5);
}
