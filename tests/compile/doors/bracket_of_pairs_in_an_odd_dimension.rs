use metriplectic::prelude::*;

fn main() {
    let _ = System::on(Euclidean::<3>)
        .bracket(Symplectic)
        .energy(|x: &Vector3<Real>| x.norm_squared())
        .build();
}
