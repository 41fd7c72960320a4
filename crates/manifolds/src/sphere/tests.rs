use super::*;
use crate::laws;
use crate::{Canonical, Exponential, MetricError, PointError, Riemannian, WeylMidpoint};
use nalgebra::vector;
use proptest::prelude::*;
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

macro_rules! keeps_the_laws {
    ($name:ident, $n:literal) => {
        proptest! {
            #[test]
            fn $name(seed in any::<u64>(), u in prop::array::uniform::<_, $n>(-1.0..1.0)) {
                let sphere = Sphere::<$n>::round();
                let x = sphere.random(&mut ChaCha8Rng::seed_from_u64(seed));
                // Up to 2.9 radians.
                let u = SVector::<f64, $n>::from(u) * (2.9 / f64::from($n as u8).sqrt());
                laws::manifold(&sphere, &x, &u)?;
                laws::metric::<Sphere<$n>, _>(&Canonical, &x, &u)?;
                laws::retraction::<Sphere<$n>, _, _>(&WeylMidpoint, &Canonical, &x, &u)?;
                laws::retraction::<Sphere<$n>, _, _>(&Exponential, &Canonical, &x, &u)?;
                let y = Sphere::<$n>::chart(&x, &u);
                laws::symmetric_retraction::<Sphere<$n>, _, _>(
                    &WeylMidpoint, &Canonical, &x, &y,
                )?;
            }
        }
    };
}
keeps_the_laws!(the_circle_keeps_the_laws, 1);
keeps_the_laws!(the_sphere_keeps_the_laws, 2);
keeps_the_laws!(the_three_sphere_keeps_the_laws, 3);
keeps_the_laws!(the_four_sphere_keeps_the_laws, 4);
keeps_the_laws!(the_five_sphere_keeps_the_laws, 5);
keeps_the_laws!(the_six_sphere_keeps_the_laws, 6);
keeps_the_laws!(the_seven_sphere_keeps_the_laws, 7);

#[test]
fn the_frame_is_oriented_at_both_poles_and_between() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..100 {
        let x = Sphere::<2>.random(&mut rng);
        let e = frame::<3, 2>(&x);
        let determinant = nalgebra::Matrix3::from_columns(&[
            x,
            e.column(0).into_owned(),
            e.column(1).into_owned(),
        ])
        .determinant();
        assert!((determinant - 1.0).abs() < 1e-14);
    }
}

#[test]
fn what_has_no_nearest_point_is_found_by_its_defect() {
    for off in
        [vector![0.0, 0.0, 0.0], vector![f64::NAN, 1.0, 0.0], vector![f64::INFINITY, 1.0, 0.0]]
    {
        let projected = Sphere::<2>.project(&off);
        assert!(!Sphere::<2>.defect(&projected).is_finite(), "{projected}");
        assert!(matches!(Sphere::<2>.check(&projected), Err(PointError::NotFinite { .. })));
    }
    for scale in [1e-320, 1e-200, 1.0, 1e200] {
        let projected = Sphere::<2>.project(&(vector![3.0, 0.0, 4.0] * scale));
        assert!((projected - vector![0.6, 0.0, 0.8]).norm() < 1e-3, "{scale}: {projected}");
        assert!(Sphere::<2>.defect(&projected) < 1e-15);
    }
}

macro_rules! chart_at_its_centre {
    ($name:ident, $n:literal in $a:literal) => {
        /// `φ_x(q) = x + E q − ½|q|²x + O(q³)`, with the columns of `E` orthonormal and across `x`.
        #[test]
        fn $name() {
            const BOUND: f64 = 8.0 * f64::EPSILON;
            let mut rng = ChaCha8Rng::seed_from_u64(3);
            for x in (0..20).map(|_| Sphere::<$n>.random(&mut rng)) {
                let mut columns = vec![x];
                for (i, j) in (0..$n).flat_map(|i| (0..$n).map(move |j| (i, j))) {
                    let part = |k, direction| if k == direction { 1.0 } else { 0.0 };
                    let seed = |k, _| Real::new(0.0, part(k, i), part(k, j), 0.0);
                    let y = Sphere::<$n>::chart(&x, &SVector::<Real, $n>::from_fn(seed));
                    assert!((y.map(|entry| entry.re) - x).norm() < BOUND);
                    let bend = x * if i == j { -1.0 } else { 0.0 };
                    assert!((y.map(|entry| entry.eps1eps2) - bend).norm() < BOUND);
                    let [along_i, along_j] = [y.map(|entry| entry.eps1), y.map(|entry| entry.eps2)];
                    let right = part(i, j);
                    assert!((along_i.dot(&along_j) - right).abs() < BOUND, "{i} and {j}");
                    if j == 0 {
                        columns.push(along_i);
                    }
                    let back = Sphere::<$n>::coordinates(&x, &y);
                    assert!((back[i].eps1 - 1.0).abs() < BOUND);
                    assert!((back[j].eps2 - 1.0).abs() < BOUND);
                    assert!(back.iter().all(|entry| entry.eps1eps2.abs() < BOUND));
                }
                let turn = SMatrix::<f64, $a, $a>::from_columns(&columns);
                assert!((turn.determinant() - 1.0).abs() < BOUND);
                assert!(columns[1..].iter().all(|e| e.dot(&x).abs() < BOUND));
            }
        }
    };
}
chart_at_its_centre!(the_chart_of_the_circle_has_its_derivatives_at_the_centre, 1 in 2);
chart_at_its_centre!(the_chart_of_the_sphere_has_its_derivatives_at_the_centre, 2 in 3);
chart_at_its_centre!(the_chart_of_the_three_sphere_has_its_derivatives_at_the_centre, 3 in 4);
chart_at_its_centre!(the_chart_of_the_four_sphere_has_its_derivatives_at_the_centre, 4 in 5);
chart_at_its_centre!(the_chart_of_the_five_sphere_has_its_derivatives_at_the_centre, 5 in 6);
chart_at_its_centre!(the_chart_of_the_six_sphere_has_its_derivatives_at_the_centre, 6 in 7);
chart_at_its_centre!(the_chart_of_the_seven_sphere_has_its_derivatives_at_the_centre, 7 in 8);

#[test]
fn antipodes_and_longer_arcs_are_refused_with_their_length() {
    let x = vector![1.0, 0.0, 0.0];
    let error = Riemannian::<Sphere<2>>::log(&Canonical, &x, &-x).unwrap_err();
    assert!(matches!(error, MetricError::CutLocus { length, .. } if (length - PI).abs() < 1e-15));
    let long = vector![0.0, 3.5];
    let error = Riemannian::<Sphere<2>>::weyl_jet(&Canonical, &x, &long).unwrap_err();
    assert!(matches!(error, MetricError::CutLocus { length, .. } if (length - 3.5).abs() < 1e-15));
}
