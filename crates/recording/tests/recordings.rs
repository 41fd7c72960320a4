//! Recordings: the text of ordinary closures, what cannot be recorded, and fields on the spaces of the library.
#![expect(clippy::float_cmp, reason = "the numbers are compared to the bit")]

use std::cell::Cell;
use std::sync::atomic::{AtomicU32, Ordering};

use metriplectic_fields::{Dimension, MatrixField, Scalar, ScalarField, Vector, laws};
use metriplectic_manifolds::rand::rngs::ChaCha8Rng;
use metriplectic_manifolds::rand::{RngExt, SeedableRng};
use metriplectic_manifolds::{Euclidean, HalfLine, LieDual, Manifold, Product, Rotations, Sphere};
use metriplectic_recording::{
    Branchless, PointEntries, Recorded, RecordingError, TapeField, field, record,
};
use nalgebra::{Matrix2, Matrix3, SVector, Vector1, Vector2, Vector3, vector};
use num_dual::{DualNum, DualStruct};
use num_traits::{One, Signed, Zero};

/// Checks a recorded field at random points of its space: tape and closure agree, and both keep the laws of a field, except near
/// a kink.
fn check<M: PointEntries>(space: &M, tape: &TapeField<M>, closure: &impl ScalarField<M>) {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    for _ in 0..20 {
        let x = space.random(&mut random);
        let v = <Vector<M> as metriplectic_fields::Column<f64>>::from_index(|_| {
            random.random_range(-0.5..0.5)
        });
        let broken = laws::scalar_field(tape, &x, &v);
        assert_eq!(broken.is_ok(), laws::scalar_field(closure, &x, &v).is_ok(), "{broken:?}");
        let (ours, theirs) = (tape.differential_at(&x, &v), closure.differential_at(&x, &v));
        let (bend, expected) = (tape.hessian_at(&x, &v), closure.hessian_at(&x, &v));
        for i in 0..M::Dim::LEN {
            let size = 1.0 + expected[(i, i)].abs();
            assert!((ours[i] - theirs[i]).abs() < 1e-12 * size, "{ours:?} {theirs:?}");
            for j in 0..M::Dim::LEN {
                let (a, b) = (bend[(i, j)], expected[(i, j)]);
                assert!(
                    (a - b).abs() < 1e-11 * size,
                    "off the centre, entry {i} {j}: {a:e} and {b:e}"
                );
            }
        }
        let (ours, theirs) = (tape.jet2(&x), closure.jet2(&x));
        for i in 0..M::Dim::LEN {
            assert!((ours.df[i] - theirs.df[i]).abs() < 1e-12, "{:?} {:?}", ours.df, theirs.df);
            for j in 0..M::Dim::LEN {
                let (a, b) = (ours.hf[(i, j)], theirs.hf[(i, j)]);
                assert!((a - b).abs() < 1e-11, "entry {i} {j}: {a:e} and {b:e}");
            }
        }
        let mut entries = M::entries(&x).into_iter();
        M::list(&x, &mut |entry| assert_eq!(Some(entry), entries.next()));
        let mut entries = M::entries(&x).into_iter();
        assert_eq!(M::point(&mut || entries.next().expect("as many")), x);
        assert_eq!(M::entries(&x).len(), M::COUNT);
    }
}

macro_rules! checks {
    ($space:expr, $x:expr, $field:expr) => {{
        let (space, field) = ($space, $field);
        let tape = TapeField::new(field.tape(&space, &$x).unwrap()).unwrap();
        check(&space, &tape, &field);
        field.recorded(&space, &$x).unwrap()
    }};
}

fn helper<D: Scalar>(x: D) -> D {
    (x * x + 1.0).sqrt()
}

#[test]
fn the_text_of_a_closure_compiles_at_both_scalars() {
    let k = [0.5, 1.5, 2.5];
    let matrix = Matrix3::new(2.0, 1.0, 0.0, 1.0, 3.0, 1.0, 0.0, 1.0, 4.0);
    let weights = vec![1.0, 2.0, 3.0];
    let weights = &weights;
    let at = vector![0.3, -0.7, 1.1];
    let space = Euclidean::<3>;
    checks!(space, at, field!(|p: &Vector3<Real>| p.norm_squared() * 0.5));
    checks!(space, at, field!(|p: &Vector3<Real>| (p.norm_squared() + 1.0).sqrt() + p.norm()));
    checks!(space, at, field!(move |p: &Vector3<Real>| p.x * p.x * k[0] + helper(p.y) * k[1]));
    checks!(space, at, field!(move |p: &Vector3<Real>| (matrix.cast::<Real>() * p).dot(p)));
    checks!(
        space,
        at,
        field!(|p: &Vector3<Real>| {
            p.cross(&Vector3::new(1.0, 2.0, 3.0).cast()).component_mul(p).sum()
        })
    );
    checks!(
        space,
        at,
        field!(|p: &Vector3<Real>| {
            let m =
                Matrix3::from_fn(|i, j| p[i] * p[j] + Real::from(if i == j { 1.0 } else { 0.0 }));
            m.determinant().ln() + m.trace() + (m * m.transpose()).norm()
        })
    );
    checks!(
        space,
        at,
        field!(move |p: &Vector3<Real>| {
            let terms: Vec<Real> = p.iter().zip(weights).map(|(p, w)| p.sin() * *w).collect();
            let mut sum: Real = terms.iter().sum();
            sum += p.iter().copied().map(|x| (x * 0.3).exp()).sum::<Real>();
            sum -= p.x.powi(3) / 3.0;
            sum * nalgebra::RealField::max(p.x, p.y).atan()
        })
    );
    checks!(
        space,
        at,
        field!(|p: &Vector3<Real>| {
            let n = p.normalize();
            n.x * n.y + p.metric_distance(&Vector3::repeat(Real::from(3.0)))
        })
    );
    checks!(
        space,
        at,
        field!(|p: &Vector3<Real>| {
            (p.x.tanh() + p.y.cosh() - p.z.atan2(p.x * p.x + 1.0)).mul_add(p.y, p.z)
                - Signed::abs(&p.x.exp_m1())
        })
    );
    checks!(
        space,
        at,
        field!(|p: &Vector3<Real>| {
            p.x.less(p.y).select(p.x.exp() * p.y, p.z.powi(2)) + p.y.least(p.z)
        })
    );
    // Constants.
    checks!(space, at, field!(|_: &Vector3<Real>| Real::from(2.0).sqrt()));
    checks!(space, at, field!(|p: &Vector3<Real>| p.x));
}

#[test]
fn fields_are_recorded_on_every_space() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    macro_rules! on {
        ($space:expr, $field:expr) => {{
            let space = $space;
            let x = space.random(&mut random);
            checks!(space, x, $field);
        }};
    }
    on!(LieDual::<3>::so3(), field!(|p: &Vector3<Real>| p.x.powi(4) + p.y * p.z));
    on!(Sphere::<2>, field!(|p: &Vector3<Real>| p.x * p.y + (p.z * 0.7).exp()));
    on!(Sphere::<1>, field!(|p: &Vector2<Real>| p.x * p.y));
    on!(Sphere::<3>, field!(|p: &SVector<Real, 4>| p.dot(&p.map(|x| x.sin()))));
    on!(HalfLine, field!(|p: &Vector1<Real>| p.x.ln() + p.x.powi(2)));
    on!(Rotations, field!(|p: &Matrix3<Real>| p.trace() + p[(0, 1)] * p[(2, 0)]));
    on!(
        Product(Sphere::<2>, Product(Euclidean::<2>, Rotations)),
        field!(|(n, (q, r)): &(Vector3<Real>, (Vector2<Real>, Matrix3<Real>))| {
            (r * n).dot(&Vector3::new(q.x, q.y, q.x * q.y)) + q.x.sin()
        })
    );
}

#[test]
fn a_matrix_field_is_recorded() {
    let field = field!(|q: &Vector2<Real>| Matrix2::new(q.x * q.x, q.y, q.y, q.x.exp()));
    let (space, at) = (Euclidean::<2>, vector![0.5, 2.0]);
    let tape = field.recorded_matrix(&space, &at).unwrap();
    let seeded = at.map(|x| metriplectic_fields::Real::new(x, 1.0, 0.5, 0.0));
    let a = MatrixField::<Euclidean<2>>::at_real(&tape, &seeded);
    let b = MatrixField::<Euclidean<2>>::at_real(&field, &seeded);
    for (a, b) in a.iter().zip(&b) {
        assert_eq!((a.re, a.eps1, a.eps2, a.eps1eps2), (b.re, b.eps1, b.eps2, b.eps1eps2));
    }
    let scalar = TapeField::<Euclidean<2>>::new(tape.tape().clone());
    let shape = RecordingError::Shape { inputs: 2, outputs: 4, entries: 2, expected: 1 };
    assert_eq!(scalar.unwrap_err(), shape);
}

#[test]
fn a_question_for_a_value_breaks_the_recording() {
    let line = |f: fn(&[Recorded]) -> Recorded| match record(&[0.5, 2.0], |x| vec![f(x)]) {
        Err(RecordingError::Branches { file, question, .. }) => {
            assert!(file.ends_with("recordings.rs"), "{file}: {question}");
        }
        other => panic!("{other:?}"),
    };
    line(|x| if x[0] < x[1] { x[0] } else { x[1] });
    line(|x| if x[0] >= 1.0 { x[0] } else { x[1] });
    line(|x| if x[0] == x[1] { x[0] } else { x[1] });
    line(|x| if x[0] == 0.5 { x[0] } else { x[1] });
    line(|x| x[0] * x[1].re());
    line(|x| if Zero::is_zero(&x[0]) { x[0] } else { x[1] });
    line(|x| if One::is_one(&x[0]) { x[0] } else { x[1] });
    line(|x| if Signed::is_positive(&x[0]) { x[0] } else { x[1] });
    line(|x| if Signed::is_negative(&x[0]) { x[0] } else { x[1] });
    line(|x| Signed::abs_sub(&x[0], &x[1]));
    line(|x| x[0] % x[1]);
    line(|x| x[0].sph_j0());
    line(|x| nalgebra::ComplexField::floor(x[0]));
    line(|x| nalgebra::RealField::copysign(x[0], x[1]));
    line(|x| nalgebra::ComplexField::try_sqrt(x[0]).unwrap_or(x[1]));
    // Inside of nalgebra the question is in its files.
    let inverse = record(&[0.5], |x| {
        vec![Matrix2::new(x[0], x[0] * 2.0, x[0].sin(), x[0]).try_inverse().unwrap().m11]
    });
    assert!(matches!(inverse, Err(RecordingError::Branches { question: "`is_zero`", .. })));
    // Constants may be asked.
    let tape = record(&[0.5], |x| {
        let two = Recorded::from(2.0);
        vec![if two > 1.0 { x[0] * two.re() } else { x[0] }]
    });
    assert_eq!(tape.unwrap().code().len(), 1);
    let message = record(&[0.5], |x| vec![if x[0] < 1.0 { x[0] } else { -x[0] }]).unwrap_err();
    let message = message.to_string();
    assert!(message.starts_with("the field asks for a comparison of a number"), "{message}");
    // A field that is refused is an ordinary field.
    let field = field!(|p: &Vector1<Real>| if p.x < 0.0 { -p.x } else { p.x });
    let refused = field.recorded(&Euclidean::<1>, &vector![2.0]);
    assert!(matches!(refused, Err(RecordingError::Branches { .. })));
    assert_eq!(ScalarField::<Euclidean<1>>::at::<f64>(&field, &vector![-2.0]), 2.0);
}

#[test]
fn a_function_with_a_state_is_refused() {
    let calls = Cell::new(0.0);
    let counted = record(&[1.0], |x| {
        calls.set(calls.get() + 1.0);
        vec![x[0] + 1.0 + x[0] * calls.get()]
    });
    assert_eq!(counted, Err(RecordingError::Differs { instruction: 1 }));
    let longer = record(&[1.0], |x| {
        calls.set(calls.get() + 1.0);
        vec![if calls.get() % 2.0 == 0.0 { x[0].sin() } else { x[0].sin() + x[0] }]
    });
    assert_eq!(longer, Err(RecordingError::Differs { instruction: 1 }));
    // Both recordings agree, and the closure is another function.
    let made = AtomicU32::new(0);
    let field = field!({
        let sign = if made.fetch_add(1, Ordering::Relaxed) == 0 { 1.0 } else { -1.0 };
        move |p: &Vector1<Real>| p.x * sign
    });
    let error = field.recorded(&Euclidean::<1>, &vector![2.0]).unwrap_err();
    let (recorded, closure) = (-2.0, 2.0);
    assert_eq!(error, RecordingError::Disagrees { quantity: "value", recorded, closure });
}

#[test]
fn numbers_of_another_recording_are_refused() {
    let kept = Cell::new(Recorded::from(0.0));
    record(&[1.0], |x| {
        kept.set(x[0]);
        vec![x[0]]
    })
    .unwrap();
    assert_eq!(record(&[1.0], |x| vec![x[0] + kept.get()]), Err(RecordingError::Foreign));
    // An operation with no recording, and one in another thread.
    let lost = kept.get() * 2.0;
    assert_eq!(record(&[1.0], |_| vec![lost]), Err(RecordingError::Foreign));
    let elsewhere = record(&[1.0], |x| {
        let x = x[0];
        let there = std::thread::spawn(move || x * x).join().unwrap();
        vec![there + x]
    });
    assert_eq!(elsewhere, Err(RecordingError::Foreign));
    // A recording within a recording, and a panic within one, leave the outer one as it was.
    let outer = record(&[1.0], |x| {
        let first = x[0] * 2.0;
        let inner = record(&[3.0], |y| vec![y[0].sin()]).unwrap();
        let panics = || record(&[3.0], |_| panic!("on purpose"));
        assert!(std::panic::catch_unwind(panics).is_err());
        vec![first * inner.value(&[0.5])]
    });
    let outer = outer.unwrap();
    assert_eq!(outer.value(&[1.0]), 2.0 * 0.5_f64.sin());
}

#[test]
fn threads_record_at_the_same_time() {
    let tapes: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4)
            .map(|k| {
                scope.spawn(move || {
                    let tapes = (0..50).map(|_| {
                        record(&[0.1, 0.2], |x| {
                            (0..100).fold(vec![x[0] * f64::from(k)], |sum, _| {
                                std::thread::yield_now();
                                vec![sum[0] + (x[1] * f64::from(k)).sin() * sum[0]]
                            })
                        })
                        .unwrap()
                    });
                    let tapes: Vec<_> = tapes.collect();
                    assert!(tapes.windows(2).all(|pair| pair[0] == pair[1]));
                    tapes[0].clone()
                })
            })
            .collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    for (k, tape) in (0..).zip(tapes) {
        let factor = 1.0 + (0.2 * f64::from(k)).sin();
        let expected = 0.1 * f64::from(k) * factor.powi(100);
        assert!((tape.value(&[0.1, 0.2]) - expected).abs() <= 1e-12 * expected);
    }
}
