//! A chain of Fermi, Pasta, Ulam and Tsingou with heat: `x = (q, p, s)` at each site.

use metriplectic::lattices::{BondState, Model};
use metriplectic::prelude::*;

/// `Π` of `(q, p, s)`.
const CANONICAL: Matrix3<f64> = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);

pub(crate) type Pair = (Vector3<Real>, Vector3<Real>);

#[inline]
pub(crate) fn site(x: &Vector3<Real>) -> Real {
    x.y * x.y * 0.5 + (x.z * 0.5).exp() * 2.0
}

/// `½r² + r³/12 + ¼r⁴`, and a stress that depends on the temperature.
#[inline]
pub(crate) fn bond((x, y): &Pair) -> Real {
    let r = y.x - x.x;
    r * r * (r * r * 0.25 + r * (0.25 / 3.0) + 0.5) - r * (x.z + y.z) * 0.025
}

/// Friction of the relative velocity, whose heat goes to both sites in equal parts; and conduction.
#[inline]
pub(crate) fn onsager(bond: &BondState<'_, Euclidean<3>>) -> [Onsager<[Vector3<f64>; 2]>; 2] {
    let [u, v] = bond.w;
    let slip = 0.5 * (v.y - u.y);
    let friction = 0.2 * u.z * v.z / (u.z + v.z);
    [
        Onsager {
            rate: friction,
            b: [vector![0.0, -1.0, -slip / u.z], vector![0.0, 1.0, -slip / v.z]],
        },
        Onsager {
            rate: 0.1 * u.z * v.z,
            b: [vector![0.0, 0.0, 1.0 / u.z], vector![0.0, 0.0, -1.0 / v.z]],
        },
    ]
}

/// The lattice of these parts, on closures.
pub(crate) fn chain(graph: Graph) -> Lattice<impl Model<Manifold = Euclidean<3>>> {
    Lattice::on(graph, Euclidean::<3>)
        .bracket(Poisson::constant(CANONICAL).expect("a skew matrix"))
        .energy(site)
        .bond_energy(bond)
        .entropy(|x: &Vector3<Real>| x.z)
        .bond_onsager(onsager)
        .conserved(|x: &Vector3<Real>| x.y)
        .build()
        .expect("the parts make a lattice")
}

/// Waves without a mean momentum, and a wave of temperature, on a ring of a multiple of forty sites.
pub(crate) fn waves(i: usize) -> Vector3<f64> {
    let phase = std::f64::consts::TAU * (i % 40) as f64 / 40.0;
    vector![
        0.3 * phase.sin(),
        0.4 * (3.0 * phase).cos() + 0.1 * (7.0 * phase).sin(),
        0.2 * (2.0 * phase).sin()
    ]
}
