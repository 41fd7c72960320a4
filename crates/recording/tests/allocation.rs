//! Sweeps allocate once. A program of its own, because the allocator counts for the whole process.

use metriplectic_fields::{Real, ScalarField};
use metriplectic_manifolds::{Euclidean, Product, Sphere};
use metriplectic_recording::field;
use nalgebra::{SVector, Vector3, vector};
use num_dual::DualNum;

#[global_allocator]
static ALLOCATOR: dhat::Alloc = dhat::Alloc;

#[test]
fn a_second_sweep_allocates_nothing() {
    let _profiler = dhat::Profiler::builder().testing().build();
    type Spin = Product<Sphere<2>, Euclidean<9>>;
    let spin = field!(|(n, x): &(Vector3<Real>, SVector<Real, 9>)| {
        n.x * x.norm_squared() + (n.y * x[3]).sin() * n.z
    });
    let at = (vector![0.0, 0.6, 0.8], SVector::<f64, 9>::from_fn(|k, _| (k as f64).sin()));
    let field = spin.recorded(&Product(Sphere::<2>, Euclidean::<9>), &at).unwrap();
    let tape = field.tape().clone();
    let entries = [vec![0.0, 0.6, 0.8], at.1.as_slice().to_vec()].concat();
    let (mut df, mut hf, mut column) = (vec![0.0; 12], vec![0.0; 144], vec![0.0; 12]);
    let seeded = (at.0.map(Real::from), at.1.map(Real::from));
    let mut sweep = || {
        let before = dhat::HeapStats::get().total_blocks;
        let jet = ScalarField::<Spin>::jet2(&field, &at);
        assert!(jet.is_finite() && ScalarField::<Spin>::jet1(&field, &at).is_finite());
        assert!(field.at(&seeded).re.is_finite() && field.at::<f64>(&at).is_finite());
        tape.gradient(&entries, &mut df);
        tape.gradient_along(&entries, &entries, &mut df, &mut column);
        tape.hessian(&entries, &mut df, &mut hf);
        dhat::HeapStats::get().total_blocks - before
    };
    assert!(sweep() > 0);
    assert_eq!((sweep(), sweep()), (0, 0));
}
