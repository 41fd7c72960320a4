//! Lattices with closed forms.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use metriplectic::lattices::Model;
use metriplectic::prelude::*;

/// The chain of Toda (1967) with the soliton `q_n = ln((1 + e^{2κ(n−1−c) − 2ωt}) / (1 + e^{2κ(n−c) − 2ωt}))`,
/// `ω = sinh κ`, far from both ends.
pub(crate) mod toda {
    use super::*;

    const KAPPA: f64 = 1.0;

    pub(crate) fn lattice(n: usize) -> Lattice<impl Model<Manifold = Euclidean<2>>> {
        Lattice::on(Graph::chain(n), Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.y * x.y * 0.5)
            .bond_energy(|(x, y): &(Vector2<Real>, Vector2<Real>)| {
                let r = y.x - x.x;
                (-r).exp() + r - 1.0
            })
            .build()
            .expect("the parts make a lattice")
    }

    /// `(q_i, p_i)` at the time `t`.
    pub(crate) fn at(i: usize, t: f64) -> Vector2<f64> {
        let omega = KAPPA.sinh();
        // With s = 1/(1 + e^{−z}), ln(1 + e^z)' = s z'.
        let z = |n: f64| 2.0 * (KAPPA * (n - 24.0) - omega * t);
        let [before, here] = [z(i as f64 - 1.0), z(i as f64)];
        let logistic = |z: f64| (1.0 + (-z).exp()).recip();
        let q = before.exp().ln_1p() - here.exp().ln_1p();
        vector![q, -2.0 * omega * (logistic(before) - logistic(here))]
    }
}

/// A ring of classical spins with heat, `H = −J Σ n·n' − K Σ n_z² + C Σ e^{s/C}`, whose friction is
/// `n' = −λ w_tan`: a helix of the wave number `k` keeps its form.
pub(crate) mod helix {
    use super::*;

    pub(crate) type Spin = (Vector3<f64>, Vector1<f64>);
    type SpinSpace = Product<Sphere<2>, Euclidean<1>>;
    type Dual = (Vector3<Real>, Vector1<Real>);

    const EXCHANGE: f64 = 1.0;
    const ANISOTROPY: f64 = 0.3;
    const CAPACITY: f64 = 2.0;
    const FRICTION: f64 = 0.1;

    /// With energies in units of `joule`, entropies in units of `boltzmann`, and times in units of one over the energy.
    pub(crate) fn lattice(
        n: usize,
        [joule, boltzmann]: [f64; 2],
    ) -> Lattice<impl Model<Manifold = SpinSpace>> {
        Lattice::on(Graph::ring(n), Product(Sphere::<2>::round(), Euclidean::<1>))
            .bracket((AreaForm, Zero))
            .energy(move |(n, s): &Dual| {
                let heat = (s.x / (CAPACITY * boltzmann)).exp() * CAPACITY;
                (heat - n.z * n.z * ANISOTROPY) * joule
            })
            .bond_energy(move |(x, y): &(Dual, Dual)| x.0.dot(&y.0) * (-EXCHANGE * joule))
            .entropy(|(_, s): &Dual| s.x)
            .site_onsager(|site| {
                let w = site.w;
                let term = |k: usize| {
                    let mut b = Vector3::zeros();
                    (b[k], b[2]) = (1.0, -w[k] / w[2]);
                    Onsager { rate: FRICTION * w[2], b }
                };
                [term(0), term(1)]
            })
            .build()
            .expect("the parts make a lattice")
    }

    /// `tan θ = tan θ₀ e^{−at}` and `φ = ki + (2b/a) [artanh cos θ]`, with `b = J (1 − cos k) + K` and `a = 2λb`; the
    /// energy that the spins lose is heat.
    pub(crate) fn at(n: usize, i: usize, t: f64) -> Spin {
        let k = 3.0 * std::f64::consts::TAU / n as f64;
        let b = EXCHANGE * (1.0 - k.cos()) + ANISOTROPY;
        let a = 2.0 * FRICTION * b;
        let start: f64 = 1.2;
        let theta = (start.tan() * (-a * t).exp()).atan();
        let turned = (2.0 * b / a) * (theta.cos().atanh() - start.cos().atanh());
        let phi = k * i as f64 + turned;
        // The energy of a site is const − b cos²θ + C e^{s/C}.
        let heat = b * (theta.cos().powi(2) - start.cos().powi(2));
        let s = CAPACITY * (1.0 + heat / CAPACITY).ln();
        let up = theta.cos();
        (vector![theta.sin() * phi.cos(), theta.sin() * phi.sin(), up], vector![s])
    }
}

/// Conduction on a ring of cells with the internal energies `e = cT`: `θ = 1 + A cos(ki) e^{−2κ(1 − cos k)t/c}`.
pub(crate) mod conduction {
    use super::*;

    /// The lattice, and how often a bond was evaluated.
    pub(crate) fn lattice(
        n: usize,
        [c, kappa]: [f64; 2],
        count: Arc<AtomicUsize>,
    ) -> Lattice<impl Model<Manifold = Euclidean<1>>> {
        of_bonds(c, vec![kappa; n], count)
    }

    /// The same with a conductivity for each bond, which starts at the site of this number.
    pub(crate) fn of_bonds(
        c: f64,
        kappa: Vec<f64>,
        count: Arc<AtomicUsize>,
    ) -> Lattice<impl Model<Manifold = Euclidean<1>>> {
        Lattice::on(Graph::ring(kappa.len()), Euclidean::<1>)
            .bond_data(kappa)
            .energy(|e: &Vector1<Real>| e.x)
            .entropy(move |e: &Vector1<Real>| e.x.ln() * c)
            .bond_onsager(move |bond| {
                count.fetch_add(1, Ordering::Relaxed);
                let [x, y] = bond.x.map(|e| e.x / c);
                [Onsager { rate: bond.data * x * y, b: [vector![1.0], vector![-1.0]] }]
            })
            .build()
            .expect("the parts make a lattice")
    }

    /// The energy of cell `i` at the time `t`, with a temperature of `theta` in the mean and so many waves.
    pub(crate) fn at(
        [n, i]: [usize; 2],
        waves: f64,
        [c, kappa, theta]: [f64; 3],
        t: f64,
    ) -> Vector1<f64> {
        let k = waves * std::f64::consts::TAU / n as f64;
        let decay = (-2.0 * kappa * (1.0 - k.cos()) * t / c).exp();
        vector![c * theta * (1.0 + 0.4 * (k * i as f64).cos() * decay)]
    }
}

/// Embedded atoms (Daw, Baskes 1984) in a ring with heat: the energy of a site is `−√ρ` of the density `ρ = Σ e^{−2r}`
/// of its neighbours, beside the parts of the chain.
pub(crate) mod embedded_atoms {
    use super::*;
    use crate::chain::{CANONICAL, Pair, bond, onsager, site};

    pub(crate) fn lattice(n: usize) -> Lattice<impl Model<Manifold = Euclidean<3>>> {
        Lattice::on(Graph::ring(n), Euclidean::<3>)
            .bracket(Poisson::constant(CANONICAL).expect("a skew matrix"))
            .energy(site)
            .gather(
                |(x, y): &Pair| ((x.x - y.x) * 2.0).exp(),
                // The bond of an atom is weaker where it is hot.
                |x, density| -density.sqrt() * (-x.z * 0.02).exp(),
            )
            .bond_energy(bond)
            .entropy(|x: &Vector3<Real>| x.z)
            .bond_onsager(onsager)
            .conserved(|x: &Vector3<Real>| x.y)
            .build()
            .expect("the parts make a lattice")
    }
}

/// Masses on springs with internal energies, `x = (q, p, u)`, whose entropy depends on their neighbours:
/// `S = Σ ln u_i + Σ a ln(u_i) ρ_i`, `ρ_i = Σ_j √(u_i u_j)`. Friction and conduction take the temperatures `1/s` of this
/// entropy.
pub(crate) mod warm_neighbours {
    use super::*;
    use crate::chain::{CANONICAL, Pair};

    const COUPLING: f64 = 0.05;

    /// With energies in units of `joule`, entropies in units of `boltzmann`, and lengths and times in units of one.
    pub(crate) fn lattice(
        n: usize,
        [joule, boltzmann]: [f64; 2],
    ) -> Lattice<impl Model<Manifold = Euclidean<3>>> {
        Lattice::on(Graph::ring(n), Euclidean::<3>)
            .bracket(Poisson::constant(CANONICAL).expect("a skew matrix"))
            .energy(move |x: &Vector3<Real>| x.y * x.y * (0.5 / joule) + x.z)
            .bond_energy(move |(x, y): &Pair| {
                let r = y.x - x.x;
                r * r * (r * r * 0.5 + 0.5) * joule
            })
            .entropy(move |x: &Vector3<Real>| (x.z / joule).ln() * boltzmann)
            .gather_entropy(
                move |(x, y): &Pair| (x.z * y.z).sqrt() / joule,
                move |x, density| (x.z / joule).ln() * density * (COUPLING * boltzmann),
            )
            .bond_onsager(move |bond| {
                let slip = 0.5 * (bond.w[1].y - bond.w[0].y);
                let [s, t] = bond.s.map(|s| s.z);
                [
                    Onsager {
                        rate: 0.2 * joule / (s + t),
                        b: [vector![0.0, -1.0, -slip], vector![0.0, 1.0, -slip]],
                    },
                    Onsager {
                        rate: 0.1 * boltzmann / (s * t),
                        b: [vector![0.0, 0.0, 1.0], vector![0.0, 0.0, -1.0]],
                    },
                ]
            })
            .conserved(|x: &Vector3<Real>| x.y)
            .build()
            .expect("the parts make a lattice")
    }

    pub(crate) fn at(i: usize, joule: f64) -> Vector3<f64> {
        let x = crate::chain::waves(i);
        vector![x.x, x.y * joule, (1.0 + x.z) * joule]
    }

    /// The velocity in units of one, with derivatives by hand.
    pub(crate) fn velocity(x: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let n = x.len();
        let ends = || (0..n).map(|i| [i, (i + 1) % n]);
        let phi = |[i, j]: [usize; 2]| (x[i].z * x[j].z).sqrt();
        let mut density = vec![0.0; n];
        for [i, j] in ends() {
            density[i] += phi([i, j]);
            density[j] += phi([i, j]);
        }
        let mut s: Vec<_> =
            x.iter().zip(&density).map(|(x, rho)| (1.0 + COUPLING * rho) / x.z).collect();
        for [i, j] in ends() {
            // ∂φ/∂u_i = φ/2u_i, with λ_i + λ_j in front.
            let both = COUPLING * (x[i].z * x[j].z).ln() * 0.5 * phi([i, j]);
            s[i] += both / x[i].z;
            s[j] += both / x[j].z;
        }
        let mut v: Vec<_> = x.iter().map(|x| vector![x.y, 0.0, 0.0]).collect();
        for [i, j] in ends() {
            let r = x[j].x - x[i].x;
            let force = r + 2.0 * r * r * r;
            // Friction −0.2 slip, whose heat is shared, and conduction by the difference of 1/T.
            let slip = 0.5 * (x[j].y - x[i].y);
            let (heat, flux) = (0.2 * slip * slip, 0.1 * (s[i] - s[j]) / (s[i] * s[j]));
            v[i] += vector![0.0, force + 0.2 * slip, heat + flux];
            v[j] += vector![0.0, -force - 0.2 * slip, heat - flux];
        }
        v
    }
}

/// A gas in mass coordinates on a ring of cells with friction and conduction: the equations of Navier, Stokes and Fourier in
/// one dimension, as in the example `viscous_shock`.
pub(crate) mod gas {
    use metriplectic::nalgebra::Complex;

    use super::*;
    use crate::chain::{CANONICAL, Pair};

    const GAMMA: f64 = 1.4;
    const HEAT: f64 = 1.0 / (GAMMA - 1.0);
    const VISCOSITY: f64 = 0.8;
    const CONDUCTION: f64 = 1.5;

    /// With lengths in units of `metre`, energies in units of `joule`, entropies in units of `boltzmann`, and times in
    /// units of one.
    pub(crate) fn lattice(
        n: usize,
        [metre, joule, boltzmann]: [f64; 3],
    ) -> Lattice<impl Model<Manifold = Euclidean<3>>> {
        Lattice::on(Graph::ring(n), Euclidean::<3>)
            .bracket(Poisson::constant(CANONICAL).expect("a skew matrix"))
            .energy(move |x: &Vector3<Real>| x.y * x.y * (0.5 * metre * metre / joule))
            .bond_energy(move |(x, y): &Pair| {
                let volume = (y.x - x.x) / metre + 1.0;
                volume.powf(1.0 - GAMMA) * (x.z / (HEAT * boltzmann)).exp() * (HEAT * joule)
            })
            .entropy(|x: &Vector3<Real>| x.z)
            .bond_onsager(move |bond| {
                let ([x, y], [u, v]) = (bond.x, bond.w);
                let volume = (y.x - x.x) / metre + 1.0;
                [
                    Onsager {
                        rate: VISCOSITY * joule / (metre * metre) * u.z / volume,
                        b: [vector![0.0, -1.0, (u.y - v.y) / u.z], vector![0.0, 1.0, 0.0]],
                    },
                    Onsager {
                        rate: CONDUCTION * boltzmann / (volume * u.z * v.z),
                        b: [vector![0.0, 0.0, v.z], vector![0.0, 0.0, -u.z]],
                    },
                ]
            })
            .conserved(|x: &Vector3<Real>| x.y)
            .build()
            .expect("the parts make a lattice")
    }

    /// The wave number of so many waves, `K = 2(1 − cos k)`, and the rate `g = κK(γ − 1)` of conduction.
    fn wave(n: usize, waves: f64) -> [f64; 3] {
        let k = waves * std::f64::consts::TAU / n as f64;
        let square = 2.0 * (1.0 - k.cos());
        [k, square, CONDUCTION * square * (GAMMA - 1.0)]
    }

    /// The eigenvalue of sound of the linearised lattice. With the amplitudes `V` of a volume and `s` of an entropy,
    ///
    /// ```text
    /// V'' = K (−γV + (γ − 1)s) − μK V',   s' = −g (s − V),   so  λ² + μKλ + γK = K(γ − 1) g/(λ + g) .
    /// ```
    pub(crate) fn eigenvalue(n: usize, waves: f64) -> Complex<f64> {
        let [_, square, g] = wave(n, waves);
        let mut lambda = Complex::new(0.0, (GAMMA * square).sqrt());
        for _ in 0..50 {
            let heat = square * (GAMMA - 1.0) * g / (lambda + g);
            let off = lambda * lambda + lambda * (VISCOSITY * square) + GAMMA * square - heat;
            let slope = lambda * 2.0 + VISCOSITY * square + heat / (lambda + g);
            lambda -= off / slope;
        }
        lambda
    }

    /// `(q, p, s)` of a cell at the time `t`, in a wave of sound of this amplitude.
    pub(crate) fn at([n, i]: [usize; 2], waves: f64, amplitude: f64, t: f64) -> Vector3<f64> {
        let ([k, _, g], lambda) = (wave(n, waves), eigenvalue(n, waves));
        let turn = Complex::new(0.0, k * i as f64).exp() * (lambda * t).exp() * amplitude;
        // V = (e^{ik} − 1) q and s = gV/(λ + g).
        let q = turn / (Complex::new(0.0, k).exp() - 1.0);
        vector![q.re, (q * lambda).re, (turn * g / (lambda + g)).re]
    }
}
