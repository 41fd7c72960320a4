use metriplectic::prelude::*;

fn main() {
    let _ = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .dissipation(|p: &Vector3<Real>| p * p.transpose())
        .build();
}
