use metriplectic::prelude::*;

fn main() -> Result<(), Error> {
    let inertia = Vector3::new(10.0, 5.0, 1.0);
    let body = System::on(LieDual::so3())
        .energy(move |p: &Vector3<Real>| {
            p.component_mul(p).component_div(&inertia.cast()).sum() * 0.5
        })
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()?;
    let run = WeylMidpoint.run(&body, vector![0.001, -1.0, 0.001], Span::steps(0.1, 100))?;
    assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
    Ok(())
}
