//! Closures with their tapes: which one answers, and that both give the same.

use std::sync::atomic::{AtomicUsize, Ordering};

use metriplectic_fields::{ChartPoint, Scalar, ScalarField, differential};
use metriplectic_manifolds::Euclidean;
use metriplectic_recording::{RecordedField, RecordingError, field};
use nalgebra::SVector;
use num_dual::Dual64;

/// A ring of sites with two variables, `Σ p²/2 + exp(q_{i+1} − q_i)`.
fn ring<D: Scalar, const N: usize>(x: &SVector<D, N>) -> D {
    let sites = N / 2;
    (0..sites).fold(D::zero(), |sum, i| {
        let (q, p, next) = (x[2 * i], x[2 * i + 1], x[2 * ((i + 1) % sites)]);
        sum + p * p * 0.5 + (next - q).exp()
    })
}

fn state<const N: usize>() -> SVector<f64, N> {
    SVector::from_fn(|k, _| (k as f64 + 0.3).sin())
}

#[test]
fn each_derivative_comes_from_the_faster_one() {
    macro_rules! calls {
        ($n:literal) => {{
            let count = AtomicUsize::new(0);
            let count = &count;
            let field = field!(move |x: &SVector<Real, $n>| {
                count.fetch_add(1, Ordering::Relaxed);
                ring(x)
            });
            let x = state::<$n>();
            let field = field.recorded(&Euclidean::<$n>, &x).unwrap();
            let calls = |f: &dyn Fn(&RecordedField<Euclidean<$n>, _>)| {
                count.store(0, Ordering::Relaxed);
                f(&field);
                count.load(Ordering::Relaxed)
            };
            let gradient = calls(&|field| assert!(field.jet1(&x).is_finite()));
            let hessian = calls(&|field| assert!(field.jet2(&x).is_finite()));
            let value = calls(&|field| assert!(field.at::<f64>(&x).is_finite()));
            let dual = calls(&|field| assert!(field.at(&x.map(Dual64::from)).re.is_finite()));
            let off = calls(&|field| {
                assert!(metriplectic_fields::Column::is_finite(&field.differential_at(&x, &x)));
            });
            let bend = calls(&|field| assert!(field.hessian_at(&x, &x).norm().is_finite()));
            assert_eq!((value, off, bend), (1, gradient, hessian));
            assert_eq!(dual, gradient);
            (gradient, hessian)
        }};
    }
    assert_eq!(calls!(2), (1, 3));
    assert_eq!(calls!(6), (3, 21));
    assert_eq!(calls!(8), (4, 0));
    assert_eq!(calls!(10), (0, 0));
    assert_eq!(calls!(24), (0, 0));
}

#[test]
fn both_give_the_same() {
    macro_rules! same {
        ($($n:literal)*) => {$({
            let field = field!(|x: &SVector<Real, $n>| ring(x));
            let recorded = field.recorded(&Euclidean::<$n>, &state()).unwrap();
            let x = state::<$n>() * 0.7;
            let (a, b) = (recorded.jet2(&x), ScalarField::<Euclidean<$n>>::jet2(&field, &x));
            assert!((a.value - b.value).abs() < 1e-13 * b.value);
            assert!((a.df - b.df).norm() < 1e-13 && (recorded.jet1(&x).df - b.df).norm() < 1e-13);
            assert!((a.hf - b.hf).norm() < 1e-13);
            // A scalar that is none of the library's own.
            let at = ChartPoint { base: x, q: SVector::<Dual64, $n>::repeat(Dual64::new(0.0, 1.0)) };
            let df = differential::<Euclidean<$n>, Dual64>(&recorded, &at);
            let along = b.hf * SVector::<f64, $n>::repeat(1.0);
            assert!((df.map(|d| d.re) - b.df).norm() < 1e-13);
            assert!((df.map(|d| d.eps) - along).norm() < 1e-12);
            assert!(format!("{recorded:?}").contains("inputs"));
        })*};
    }
    same!(2 6 8 12 24 48);
}

#[test]
fn threads_share_a_field() {
    let field =
        field!(|x: &SVector<Real, 24>| ring(x)).recorded(&Euclidean::<24>, &state()).unwrap();
    let expected = field.jet2(&state());
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..200 {
                    let jet = field.jet2(&state());
                    assert_eq!(
                        (jet.value, jet.df, jet.hf),
                        (expected.value, expected.df, expected.hf)
                    );
                }
            });
        }
    });
}

#[test]
fn a_closure_that_differs_is_refused() {
    // The closure captures a number that both copies see, and that changes between the recording and the check.
    let calls = AtomicUsize::new(0);
    let calls = &calls;
    let field = field!(move |x: &SVector<Real, 12>| {
        let call = calls.fetch_add(1, Ordering::Relaxed);
        ring(x) * if call < 2 { 1.0 } else { 2.0 }
    });
    let error = field.recorded(&Euclidean::<12>, &state()).unwrap_err();
    assert!(matches!(error, RecordingError::Disagrees { quantity: "value", .. }), "{error}");
}
