use metriplectic::prelude::*;

fn main() {
    let inverse_inertia = Matrix3::new(2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.5);
    let _ = System::on(LieDual::so3())
        .energy(move |p: &Vector3<Real>| p.dot(&(inverse_inertia * p)) * 0.5);
}
