//! A model by differences is judged as one with derivatives by hand, at starts with entries of any size.

use metriplectic_equations::judge::Judge;
use metriplectic_equations::{
    Apart, Covectors, Differences, ENERGY, ENTROPY, Equations, ModelError, Part, SecondLaw, Sizes,
};

const N: usize = 4;

/// Masses `m` in a row with springs `k` to walls and neighbours, each of which warms by its drag: `q, p, u` with the temperature `u/C`.
struct Row {
    mass: f64,
    stiffness: f64,
    drag: f64,
    capacity: f64,
    /// The sign of the friction, which is to be positive.
    sign: f64,
}

impl Row {
    fn stretch(&self, x: &[f64], i: usize) -> f64 {
        let at = |i: usize| if i == 0 || i > N { 0.0 } else { x[i - 1] };
        at(i + 1) - at(i)
    }
}

impl Equations for Row {
    fn sizes(&self) -> Sizes {
        Sizes { entries: 3 * N, directions: 3 * N, laws: 2 }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        let springs = (0..=N).map(|i| 0.5 * self.stiffness * self.stretch(x, i).powi(2));
        let motion = x[N..2 * N].iter().map(|p| 0.5 * p * p / self.mass);
        values[ENERGY] = springs.chain(motion).chain(x[2 * N..].iter().copied()).sum();
        values[ENTROPY] = x[2 * N..].iter().map(|u| self.capacity * u.ln()).sum();
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        w.fill(0.0);
        for i in 0..N {
            w[i] = -self.stiffness * (self.stretch(x, i + 1) - self.stretch(x, i));
            w[N + i] = x[N + i] / self.mass;
            w[2 * N + i] = 1.0;
            w[5 * N + i] = self.capacity / x[2 * N + i];
        }
    }

    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        let (mut values, mut w, mut friction) = ([0.0; 2], [0.0; 6 * N], [0.0; 3 * N]);
        self.differentials(t, x, &mut values, &mut w);
        let (energy, entropy) = w.split_at(3 * N);
        let covectors = Covectors { energy, entropy };
        self.apply(Part::Reversible, t, x, covectors, energy, v);
        self.apply(Part::Irreversible, t, x, covectors, entropy, &mut friction);
        v.iter_mut().zip(friction).for_each(|(v, friction)| *v += friction);
        Some(entropy.iter().zip(friction).map(|(s, v)| s * v).sum())
    }

    fn second_law(&self) -> SecondLaw {
        SecondLaw::Exact
    }
}

impl Apart for Row {
    fn is_zero(&self, part: Part) -> bool {
        part == Part::Gyroscopic
    }

    fn apply(&self, part: Part, _: f64, x: &[f64], w: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
        v.fill(0.0);
        for i in 0..N {
            if part == Part::Reversible {
                (v[i], v[N + i]) = (alpha[N + i], -alpha[i]);
                continue;
            }
            // ρ b bᵀ with b = (−1 at p, w_p/w_u at u).
            let heat = w.energy[N + i] / w.energy[2 * N + i];
            let rate = self.sign * self.drag * x[2 * N + i] / self.capacity;
            let along = rate * (heat * alpha[2 * N + i] - alpha[N + i]);
            (v[N + i], v[2 * N + i]) = (-along, along * heat);
        }
    }
}

fn verify(row: Row, [q, p, u]: [f64; 3]) -> Result<(), ModelError> {
    let turn = |size: f64, i: usize| size * (1.0 + i as f64).sin();
    let start: Vec<f64> = (0..3 * N)
        .map(|i| {
            if i < N {
                turn(q, i)
            } else if i < 2 * N {
                turn(p, i)
            } else {
                u
            }
        })
        .collect();
    Judge::of(&Differences(row), 0.0).verify(&start, 0.1)
}

#[test]
fn starts_with_entries_of_any_size_are_judged() {
    let row = |mass, stiffness, drag, capacity| Row { mass, stiffness, drag, capacity, sign: 1.0 };
    for (row, start) in [
        (row(1.0, 1.0, 0.1, 1.0), [0.5, 0.3, 1.0]),
        (row(1.0, 1.0, 0.1, 1.0), [0.5, 1e-3, 1.0]),
        (row(1.0, 1.0, 0.1, 1.0), [0.5, 0.0, 1.0]),
        (row(1.0, 1.0, 0.1, 1.0), [0.5, 0.3, 1e6]),
        (row(1.0, 1.0, 0.1, 1.0), [1e-14, 1.0, 1.0]),
        // Atoms.
        (row(1e-26, 10.0, 1e-13, 1e-23), [1e-11, 0.0, 4e-21]),
        (row(1e-26, 10.0, 1e-13, 1e-23), [1e-11, 3e-24, 4e-21]),
    ] {
        assert_eq!(verify(row, start), Ok(()), "from {start:?}");
    }
    let negative = Row { sign: -1.0, ..row(1.0, 1.0, 0.1, 1.0) };
    assert!(verify(negative, [0.5, 0.3, 1.0]).is_err());
}
