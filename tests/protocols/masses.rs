//! Masses on springs that harden, with heat, in a field that depends on time, with a motor, air and an oven: as a lattice, as a system
//! of one's own in plain numbers, and two of them as a typed system.

use metriplectic::dynamics::SecondLaw;
use metriplectic::equations::{Apart, Covectors, ENERGY, ENTROPY, Equations, Part, Sizes};
use metriplectic::integrators::open::Ledger;
use metriplectic::integrators::{FromEquations, OpenEquations};
use metriplectic::lattices::OpenLattice;
use metriplectic::lattices::model::Model;
use metriplectic::prelude::*;
use nalgebra::{SMatrix, SVector};

/// Place, momentum and entropy of both masses of the typed system.
pub(crate) type X<T = f64> = SVector<T, 6>;
/// A site: place, momentum and entropy.
pub(crate) type Site = Euclidean<3>;

/// The units of energy, entropy and length; that of time is 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct World {
    pub(crate) units: [f64; 3],
    /// The energy of a mass that counts as zero.
    pub(crate) zero: f64,
    /// The amplitude of all that depends on time, and how much hotter the oven is than the air.
    pub(crate) drive: f64,
    /// The friction of the air.
    pub(crate) air: f64,
}

pub(crate) const ONE: World = World { units: [1.0; 3], zero: 0.0, drive: 1.0, air: 0.08 };

impl World {
    /// The units of place, momentum and entropy.
    pub(crate) fn of_entries(&self) -> [f64; 3] {
        let [energy, entropy, length] = self.units;
        [length, energy / length, entropy]
    }

    /// The entries of a start, site by site.
    pub(crate) fn start(&self, sites: &[[f64; 3]]) -> Vec<f64> {
        let units = self.of_entries();
        sites.iter().flat_map(|x| [0, 1, 2].map(|k| x[k] * units[k])).collect()
    }

    /// The numbers of entries and of a ledger, without units.
    pub(crate) fn numbers(&self, entries: &[f64], ledger: &Ledger) -> Vec<f64> {
        let [energy, entropy, _] = self.units;
        let units = self.of_entries().into_iter().cycle();
        let mut numbers: Vec<f64> = entries.iter().zip(units).map(|(x, unit)| x / unit).collect();
        numbers.push(ledger.parameter_work() / energy);
        numbers.push(ledger.work("motor").expect("a column of the ledger") / energy);
        for bath in ["air", "oven"] {
            numbers.push(ledger.heat(bath).expect("a column of the ledger") / energy);
            numbers.push(ledger.bath_entropy(bath).expect("a column of the ledger") / entropy);
        }
        numbers
    }

    /// The energy of the field at a mass, its derivatives along the place and along time.
    fn field(&self, t: f64, mass: usize, q: f64) -> [f64; 3] {
        let [slope, bend] = [0.4 + 0.2 * mass as f64, 0.15];
        let (sin, cos) = (1.3 * t).sin_cos();
        [
            (q * slope * sin + q * q * bend * t.cos()) * self.drive,
            (slope * sin + 2.0 * q * bend * t.cos()) * self.drive,
            (1.3 * q * slope * cos - q * q * bend * t.sin()) * self.drive,
        ]
    }

    fn real_field(&self, t: Real, mass: usize, q: Real) -> Real {
        let slope = 0.4 + 0.2 * mass as f64;
        (q * slope * (t * 1.3).sin() + q * q * 0.15 * t.cos()) * self.drive
    }

    fn still(&self, [q, p, s]: [Real; 3]) -> Real {
        p * p * 0.5 + q.powi(4) * 0.25 + s.exp() - self.zero
    }

    fn motor(&self, t: Real) -> Real {
        (t * 1.7 + 0.2).sin() * (0.3 * self.drive * self.of_entries()[1])
    }

    pub(crate) fn of_air(&self, t: Real) -> Real {
        (t.sin() * (0.1 * self.drive) + 1.0) * (self.units[0] / self.units[1])
    }

    pub(crate) fn of_oven(&self) -> f64 {
        (1.0 + 0.6 * self.drive) * self.units[0] / self.units[1]
    }

    fn rate_of_air(&self) -> f64 {
        self.air * self.units[0] / (self.units[2] * self.units[2])
    }

    /// The rate of the heat of the oven, at a temperature of the mass.
    fn rate_of_oven(&self, temperature: f64) -> f64 {
        let [e, k, _] = self.units;
        0.3 * k * k / e * (temperature * (k / e)).recip()
    }

    /// The rates of friction and of conduction in a bond, between masses of these temperatures.
    fn rates_of_bond(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [e, k, l] = self.units;
        [0.2 * e / (l * l) * u * v / (u + v), 0.1 * k * u * v]
    }
}

/// A lattice of so many masses.
pub(crate) fn on_lattice(count: usize, world: World) -> OpenLattice<impl Model<Manifold = Site>> {
    let [e, _, _] = world.units;
    let [l, m, k] = world.of_entries();
    let canonical = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    Lattice::on(Graph::chain(count), Euclidean::<3>)
        .bracket(Poisson::constant(canonical).expect("a skew matrix"))
        .energy(move |x: &Vector3<Real>| world.still([x.x / l, x.y / m, x.z / k]) * e)
        .bond_energy(move |(x, y): &(Vector3<Real>, Vector3<Real>)| {
            let r = (y.x - x.x) / l;
            (r * r * 0.5 + r.powi(4) * 0.25) * e
        })
        .entropy(|x: &Vector3<Real>| x.z)
        .bond_onsager(move |bond| {
            let [u, v] = bond.w;
            let (slip, [rub, conduct]) = (0.5 * (v.y - u.y), world.rates_of_bond([u.z, v.z]));
            [
                Onsager {
                    rate: rub,
                    b: [vector![0.0, -1.0, -slip / u.z], vector![0.0, 1.0, -slip / v.z]],
                },
                Onsager {
                    rate: conduct,
                    b: [vector![0.0, 0.0, 1.0 / u.z], vector![0.0, 0.0, -1.0 / v.z]],
                },
            ]
        })
        .build()
        .expect("it is a lattice")
        .opened()
        .energy_in_time(move |t, site, x: &Vector3<Real>| world.real_field(t, site, x.x / l) * e)
        .work("motor", [0], move |t, _, _: &Vector3<f64>| {
            vector![0.0, world.motor(t.into()).re, 0.0]
        })
        .bath(
            "air",
            move |t: Real| world.of_air(t),
            0..count,
            move |_, _: &SiteState<'_, Site>| {
                [Onsager { rate: world.rate_of_air(), b: vector![0.0, 1.0, 0.0] }]
            },
        )
        .bath("oven", world.of_oven(), [count - 1], move |_, at: &SiteState<'_, Site>| {
            [Onsager { rate: world.rate_of_oven(at.w.z), b: vector![0.0, 0.0, 1.0] }]
        })
}

/// So many masses in plain numbers, with derivatives by hand.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chain {
    pub(crate) count: usize,
    pub(crate) world: World,
    /// Whether it says that its energy depends on time.
    pub(crate) says: bool,
    /// A factor of the power that it answers.
    pub(crate) factor: f64,
}

impl Chain {
    fn at(&self, x: &[f64], mass: usize) -> [f64; 3] {
        let units = self.world.of_entries();
        [0, 1, 2].map(|k| x[3 * mass + k] / units[k])
    }

    fn spring(&self, x: &[f64], bond: usize) -> f64 {
        self.at(x, bond + 1)[0] - self.at(x, bond)[0]
    }

    /// Adds the terms of the friction in bonds, `Σ ρ b ⟨b, α⟩`.
    fn rub(&self, w: &[f64], alpha: &[f64], v: &mut [f64]) {
        for bond in 0..self.count - 1 {
            let (i, j) = (3 * bond, 3 * bond + 3);
            let (u, t) = (w[i + 2], w[j + 2]);
            let (slip, rates) = (0.5 * (w[j + 1] - w[i + 1]), self.world.rates_of_bond([u, t]));
            let terms: [[(usize, f64); 4]; 2] = [
                [(i + 1, -1.0), (i + 2, -slip / u), (j + 1, 1.0), (j + 2, -slip / t)],
                [(i + 2, u.recip()), (j + 2, -t.recip()), (i, 0.0), (j, 0.0)],
            ];
            for (rate, b) in rates.into_iter().zip(terms) {
                let force: f64 = b.iter().map(|&(k, b)| b * alpha[k]).sum();
                b.iter().for_each(|&(k, b)| v[k] += rate * force * b);
            }
        }
    }
}

impl Equations for Chain {
    fn sizes(&self) -> Sizes {
        Sizes { entries: 3 * self.count, directions: 3 * self.count, laws: 2 }
    }

    fn values(&self, t: f64, x: &[f64], values: &mut [f64]) {
        let mass = |i: usize| {
            let [q, p, s] = self.at(x, i);
            let still = 0.5 * p * p + 0.25 * q.powi(4) + s.exp() - self.world.zero;
            still + self.world.field(t, i, q)[0]
        };
        let spring = |bond: usize| {
            let r = self.spring(x, bond);
            0.5 * r * r + 0.25 * r.powi(4)
        };
        let springs: f64 = (0..self.count - 1).map(spring).sum();
        values[ENERGY] = self.world.units[0] * ((0..self.count).map(mass).sum::<f64>() + springs);
        values[ENTROPY] = (0..self.count).map(|i| x[3 * i + 2]).sum();
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        w.fill(0.0);
        let (units, e) = (self.world.of_entries(), self.world.units[0]);
        for i in 0..self.count {
            let [q, p, s] = self.at(x, i);
            let mut force = q.powi(3) + self.world.field(t, i, q)[1];
            let spring = |bond: usize| {
                let r = self.spring(x, bond);
                r + r.powi(3)
            };
            if i > 0 {
                force += spring(i - 1);
            }
            if i + 1 < self.count {
                force -= spring(i);
            }
            for (k, slope) in [force, p, s.exp()].into_iter().enumerate() {
                w[3 * i + k] = e / units[k] * slope;
            }
            w[3 * (self.count + i) + 2] = 1.0;
        }
    }

    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        let n = 3 * self.count;
        let (mut values, mut w) = (vec![0.0; 2], vec![0.0; 2 * n]);
        self.differentials(t, x, &mut values, &mut w);
        let (energy, entropy) = w.split_at(n);
        let mut heat = vec![0.0; n];
        self.rub(energy, entropy, &mut heat);
        v.copy_from_slice(&heat);
        for i in (0..n).step_by(3) {
            v[i] += energy[i + 1];
            v[i + 1] -= energy[i];
        }
        Some(heat.iter().zip(entropy).map(|(v, s)| v * s).sum())
    }

    fn second_law(&self) -> SecondLaw {
        SecondLaw::Exact
    }

    fn energy_depends_on_time(&self) -> bool {
        self.says
    }

    fn power(&self, t: f64, x: &[f64]) -> f64 {
        let rate = |i: usize| self.world.field(t, i, self.at(x, i)[0])[2];
        self.factor * self.world.units[0] * (0..self.count).map(rate).sum::<f64>()
    }

    fn is_vector_space(&self) -> bool {
        true
    }
}

impl Apart for Chain {
    fn is_zero(&self, part: Part) -> bool {
        part == Part::Gyroscopic
    }

    fn apply(&self, part: Part, _: f64, _: &[f64], w: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
        v.fill(0.0);
        if part == Part::Irreversible {
            return self.rub(w.energy, alpha, v);
        }
        for i in (0..v.len()).step_by(3) {
            (v[i], v[i + 1]) = (alpha[i + 1], -alpha[i]);
        }
    }
}

/// So many masses in plain numbers.
pub(crate) const fn chain(count: usize, world: World) -> Chain {
    Chain { count, world, says: true, factor: 1.0 }
}

/// The surroundings of masses in plain numbers.
pub(crate) fn surrounded<S: Equations>(system: S, world: World) -> OpenEquations<S> {
    let n = system.sizes().entries;
    FromEquations(system)
        .opened()
        .work("motor", move |t, _, v| v[1] = world.motor(t.into()).re)
        .bath(
            "air",
            move |t: Real| world.of_air(t),
            move |_, contact| {
                (0..n / 3).for_each(|i| contact(world.rate_of_air(), &[(3 * i + 1, 1.0)]));
            },
        )
        .bath("oven", world.of_oven(), move |at, contact| {
            contact(world.rate_of_oven(at.w[n - 1]), &[(n - 1, 1.0)]);
        })
}

/// The energy of two masses.
pub(crate) fn energy_of(world: &World, t: Real, x: &X<Real>) -> Real {
    let [l, m, k] = world.of_entries();
    let mass = |i: usize| {
        let (q, p, s) = (x[3 * i] / l, x[3 * i + 1] / m, x[3 * i + 2] / k);
        world.still([q, p, s]) + world.real_field(t, i, q)
    };
    let r = (x[3] - x[0]) / l;
    (mass(0) + mass(1) + r * r * 0.5 + r.powi(4) * 0.25) * world.units[0]
}

/// The friction between two masses.
pub(crate) fn friction_of(world: &World, w: &X<Real>) -> SMatrix<Real, 6, 6> {
    let [e, k, l] = world.units;
    let slip = (w[4] - w[1]) * 0.5;
    let mut b = X::repeat(Real::from(0.0));
    (b[1], b[2], b[4], b[5]) = ((-1.0).into(), -slip / w[2], 1.0.into(), -slip / w[5]);
    let mut c = X::repeat(Real::from(0.0));
    (c[2], c[5]) = (w[2].recip(), -w[5].recip());
    let rub = w[2] * w[5] / (w[2] + w[5]) * (0.2 * e / (l * l));
    b * b.transpose() * rub + c * c.transpose() * (w[2] * w[5] * (0.1 * k))
}

/// The velocity of the motor of two masses, and the contacts of the air and of the oven with them.
pub(crate) fn motor_of(world: &World, t: Real) -> X<Real> {
    X::ith(1, world.motor(t))
}

pub(crate) fn air_of(world: &World) -> [Contact<X<Real>>; 2] {
    let rate = world.rate_of_air().into();
    [1, 4].map(|i| Contact { rate, along: X::ith(i, 1.0.into()) })
}

pub(crate) fn oven_of(world: &World, w: &X<Real>) -> [Contact<X<Real>>; 1] {
    let [e, k, _] = world.units;
    let rate = (w[5] * (k / e)).recip() * (0.3 * k * k / e);
    [Contact { rate, along: X::ith(5, 1.0.into()) }]
}

/// The tensor of two masses.
pub(crate) fn canonical() -> SMatrix<f64, 6, 6> {
    let mut tensor = SMatrix::zeros();
    for i in [0, 3] {
        (tensor[(i, i + 1)], tensor[(i + 1, i)]) = (1.0, -1.0);
    }
    tensor
}

/// Two masses as a typed system.
macro_rules! typed {
    ($world:expr) => {{
        let world: World = $world;
        System::on(Euclidean::<6>)
            .bracket(Poisson::constant(masses::canonical()).expect("it is skew"))
            .energy_in_time(move |t: Real, x: &X<Real>| masses::energy_of(&world, t, x))
            .entropy(|x: &X<Real>| x[2] + x[5])
            .dissipation(FieldDissipation(move |_: &X<Real>, w: &X<Real>| {
                masses::friction_of(&world, w)
            }))
            .work("motor", move |t: Real, _: &X<Real>| masses::motor_of(&world, t))
            .bath(
                "air",
                Bath::in_time(move |t: Real| world.of_air(t))
                    .friction(move |_: Real, _: &X<Real>, _: &X<Real>| masses::air_of(&world)),
            )
            .bath(
                "oven",
                Bath::at(world.of_oven())
                    .friction(move |_: Real, _: &X<Real>, w: &X<Real>| masses::oven_of(&world, w)),
            )
            .build()
            .expect("it is a system")
    }};
}
pub(crate) use typed;
