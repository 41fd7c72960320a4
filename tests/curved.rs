//! The published scheme on S² and SO(3) against reference data.
use metriplectic::prelude::*;

fn top(x: &Vector3<Real>) -> Real {
    let d = [1.0, 0.5, 0.25];
    (0..3).map(|i| (x[i].powi(2) + x[i].powi(3) * (2.0 / 3.0)) * (0.5 * d[i])).sum()
}
fn climb(x: &Vector3<Real>) -> Real {
    x.z + x.x * x.y * 0.3
}

#[test]
fn one_step() {
    let x0 = Vector3::from_element(1.0 / 3.0_f64.sqrt());
    let spinning = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(top).build().unwrap();
    let run = WeylMidpoint.run(&spinning, x0, Span::steps(0.1, 1)).unwrap();
    println!(
        "{:e}",
        (run.last().point
            - vector![
                0.5636415013789200556146201,
                0.6153367927770747970429893,
                0.5510616021627166239228128
            ])
        .amax()
    );
    let relax = System::on(Sphere::<2>::round()).energy(top).entropy(climb).build().unwrap();
    let run = WeylMidpoint.run(&relax, x0, Span::steps(0.1, 1)).unwrap();
    println!(
        "{:e}",
        (run.last().point
            - vector![
                0.5801633902009668186380818,
                0.5687597588607629834085012,
                0.5830289678662351519436703
            ])
        .amax()
    );
    let mixed = System::on(Sphere::<2>::round())
        .bracket(AreaForm)
        .energy(top)
        .entropy(climb)
        .second_law(SecondLaw::Published)
        .build()
        .unwrap();
    let run = WeylMidpoint.run(&mixed, x0, Span::steps(0.1, 1)).unwrap();
    println!(
        "{:e}",
        (run.last().point
            - vector![
                0.5667704385483652897747611,
                0.6071752864480126642966078,
                0.5568747089914895657799976 + -0.0000000000001
            ])
        .amax()
    );
    println!("{}", run.certificate());
    let h = |r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5;
    let s = |r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25;
    let nambu =
        System::on(Rotations).bracket(Nambu::default()).energy(h).entropy(s).build().unwrap();
    let r0 = Matrix3::new(
        0.8595338985586632049098838,
        -0.4979915370029220078269443,
        -0.114916953936366726076708,
        0.4398676329582309202034479,
        0.8353156052067085850667603,
        -0.3297943376922551180953646,
        0.2602267140480944451354489,
        0.2329211642844366387228707,
        0.937032437284917988407879,
    );
    let run = WeylMidpoint.run(&nambu, r0, Span::steps(0.05, 1)).unwrap();
    let x1 = Matrix3::new(
        0.8787343750001591969597182,
        -0.4728857051409157420370051,
        0.06484603354453135910637747,
        0.4660757996079281087869519,
        0.8207912246211189097928852,
        -0.3302652185816640966935411,
        0.102952645487670844376683,
        0.3204385673703195454977603,
        0.9416580470197654289253315,
    );
    println!("{:e}", (run.last().point - x1).amax());
    println!("{}", nambu.report(&r0));
    let run = WeylMidpoint.run(&nambu, r0, Span::steps(0.05, 20000).every(1000)).unwrap();
    println!("{} {:?}", run.certificate(), run.certificate());
    for s in &run {
        println!("{} {:e} {}", s.time, s.energy - run.certificate().energy, s.entropy);
    }
    let mut st = WeylMidpoint.steps(&nambu, r0, 0.05).unwrap();
    for _ in 0..20000 {
        st.advance().unwrap();
    }
    let a = *st.certificate();
    let x = st.state().point;
    for _ in 0..5 {
        st.advance().unwrap();
        println!(
            "{:e} {} {}",
            (st.state().point - x).amax(),
            st.certificate().sweeps - a.sweeps,
            st.certificate().globalised - a.globalised
        );
    }
}
