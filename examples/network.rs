//! A network of bodies, springs, dampers and heat links from a text file: the number of variables is known when it is read.
//!
//! A body has a position, a momentum and an energy `u` of its own, at the temperature `T = u/C` with the entropy `C ln u`:
//!
//! ```text
//! H = Σ p²/2m + Σ ½k (q_j − q_i − l)² + Σ u ,   S = Σ C ln u ,   P = Σ p .
//! ```
//!
//! A damper takes the power `c (v_j − v_i)²` from the motion of its ends and gives half of it to each of them as heat. In a
//! link the heat `κ (T_j − T_i)` flows. The program writes laws and velocities in slices of numbers: a system of its own answers
//! `Equations`, and a run by an explicit method keeps `H` and `P` to round-off, while `S` never falls. With its bracket and its friction
//! apart (`Apart`) implicit methods run it too, which its stiff links may need.
//!
//! `NETWORK=my_network.txt cargo run --release --example network` reads another file.

use std::error::Error;

use metriplectic::equations::{
    Apart, Covectors, Differences, ENERGY, ENTROPY, Equations, Kind, Part, Sizes,
};
use metriplectic::integrators::{FromEquations, PlainNumbers};
use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

/// The file beside this program.
const LADDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/network.txt");

/// A connection of two bodies, with its numbers.
type Connection<const N: usize> = ([usize; 2], [f64; N]);

#[derive(Debug, Default)]
struct Network {
    masses: Vec<f64>,
    capacities: Vec<f64>,
    springs: Vec<Connection<2>>,
    dampers: Vec<Connection<1>>,
    links: Vec<Connection<1>>,
}

impl Network {
    /// Reads a network and its state `(q, p, u)`.
    fn read(text: &str) -> Result<(Self, Vec<f64>), String> {
        let mut network = Self::default();
        let [mut positions, mut momenta, mut energies] = [0; 3].map(|_| Vec::new());
        for (number, line) in text.lines().enumerate() {
            let mut words = line.split('#').next().unwrap_or_default().split_whitespace();
            let Some(kind) = words.next() else { continue };
            let bad = || format!("line {} is no line of a network: {line:?}", number + 1);
            let number = |word: &str| word.parse::<f64>().map_err(|_| bad());
            let body = |word: &str| {
                let index = word.parse().ok().filter(|index| *index < network.masses.len());
                index.ok_or_else(bad)
            };
            match (kind, &words.collect::<Vec<_>>()[..]) {
                ("body", &[mass, position, momentum, capacity, temperature]) => {
                    let capacity = number(capacity)?;
                    positions.push(number(position)?);
                    momenta.push(number(momentum)?);
                    energies.push(capacity * number(temperature)?);
                    network.capacities.push(capacity);
                    network.masses.push(number(mass)?);
                }
                ("spring", &[i, j, stiffness, length]) => {
                    let spring = ([body(i)?, body(j)?], [number(stiffness)?, number(length)?]);
                    network.springs.push(spring);
                }
                ("damper", &[i, j, coefficient]) => {
                    let damper = ([body(i)?, body(j)?], [number(coefficient)?]);
                    network.dampers.push(damper);
                }
                ("link", &[i, j, conductance]) => {
                    let link = ([body(i)?, body(j)?], [number(conductance)?]);
                    network.links.push(link);
                }
                _ => return Err(bad()),
            }
        }
        Ok((network, [positions, momenta, energies].concat()))
    }

    fn bodies(&self) -> usize {
        self.masses.len()
    }

    /// Positions, momenta and energies.
    fn split<'a>(&self, x: &'a [f64]) -> [&'a [f64]; 3] {
        let (q, rest) = x.split_at(self.bodies());
        let (p, u) = rest.split_at(self.bodies());
        [q, p, u]
    }
}

impl Equations for Network {
    fn sizes(&self) -> Sizes {
        let n = 3 * self.bodies();
        Sizes { entries: n, directions: n, laws: 3 }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        let [q, p, u] = self.split(x);
        let kinetic = p.iter().zip(&self.masses).map(|(p, m)| p * p / (2.0 * m));
        let springs =
            self.springs.iter().map(|&([i, j], [k, l])| 0.5 * k * (q[j] - q[i] - l).powi(2));
        values[ENERGY] = kinetic.chain(springs).chain(u.iter().copied()).sum();
        values[ENTROPY] = u.iter().zip(&self.capacities).map(|(u, c)| c * u.ln()).sum();
        values[2] = p.iter().sum();
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        let (k, [q, p, u]) = (self.bodies(), self.split(x));
        w.fill(0.0);
        for &([i, j], [stiffness, length]) in &self.springs {
            let tension = stiffness * (q[j] - q[i] - length);
            w[i] -= tension;
            w[j] += tension;
        }
        for i in 0..k {
            w[k + i] = p[i] / self.masses[i];
            w[2 * k + i] = 1.0;
            w[3 * k + 2 * k + i] = self.capacities[i] / u[i];
            w[6 * k + k + i] = 1.0;
        }
    }

    fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        let (k, [q, p, u]) = (self.bodies(), self.split(x));
        let temperature = |i: usize| u[i] / self.capacities[i];
        let mut production = 0.0;
        v.fill(0.0);
        (0..k).for_each(|i| v[i] = p[i] / self.masses[i]);
        for &([i, j], [stiffness, length]) in &self.springs {
            let tension = stiffness * (q[j] - q[i] - length);
            v[k + i] += tension;
            v[k + j] -= tension;
        }
        for &([i, j], [coefficient]) in &self.dampers {
            let speed = p[j] / self.masses[j] - p[i] / self.masses[i];
            let force = coefficient * speed;
            v[k + i] += force;
            v[k + j] -= force;
            for end in [i, j] {
                v[2 * k + end] += 0.5 * force * speed;
                production += 0.5 * force * speed / temperature(end);
            }
        }
        for &([i, j], [conductance]) in &self.links {
            let [from, to] = [temperature(j), temperature(i)];
            let heat = conductance * (from - to);
            v[2 * k + i] += heat;
            v[2 * k + j] -= heat;
            production += heat * (from - to) / (from * to);
        }
        Some(production)
    }

    fn second_law(&self) -> SecondLaw {
        SecondLaw::Exact
    }

    fn kind(&self, _: usize) -> Kind {
        Kind::Momentum
    }
}

impl Apart for Network {
    fn is_zero(&self, part: Part) -> bool {
        part == Part::Gyroscopic
    }

    fn apply(&self, part: Part, _: f64, x: &[f64], w: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
        let (k, [_, _, u]) = (self.bodies(), self.split(x));
        let [along_q, along_p, along_u] = self.split(alpha);
        let [_, speed, warmth] = self.split(w.energy);
        let temperature = |i: usize| u[i] / self.capacities[i];
        v.fill(0.0);
        if part == Part::Reversible {
            v[..k].copy_from_slice(along_p);
            return (0..k).for_each(|i| v[k + i] = -along_q[i]);
        }
        // Terms ρ b bᵀ with ⟨dH, b⟩ = 0: the momentum that a damper moves, with the heat that one of its ends takes.
        for &([i, j], [coefficient]) in &self.dampers {
            for end in [i, j] {
                let heat = (speed[j] - speed[i]) / warmth[end];
                let along = along_p[i] - along_p[j] + heat * along_u[end];
                let rate = 0.5 * coefficient * temperature(end) * along;
                v[k + i] += rate;
                v[k + j] -= rate;
                v[2 * k + end] += rate * heat;
            }
        }
        for &([i, j], [conductance]) in &self.links {
            let along = along_u[i] / warmth[i] - along_u[j] / warmth[j];
            let rate = conductance * temperature(i) * temperature(j) * along;
            v[2 * k + i] += rate / warmth[i];
            v[2 * k + j] -= rate / warmth[j];
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let about = "A network of bodies, springs, dampers and heat links from a text file.";
    let example = Example::new(about, 2000, 0.05);
    let file = std::env::var("NETWORK").unwrap_or_else(|_| LADDER.to_owned());
    let (network, start) = Network::read(&std::fs::read_to_string(file)?)?;
    let (bodies, network) = (network.bodies(), FromEquations(Differences(network)));
    let end = example.steps as f64 * example.step_size;
    let span = Span::until(end).tolerance(1e-8).output_every(example.step_size);
    let run = DormandPrince8.run(&network, start.clone().into(), span)?;
    let implicit = Span::until(end).tolerance(1e-6).at_most(2);
    let implicit = Radau::<3>.run(&network, start.into(), implicit)?;

    let series = |value: &dyn Fn(&State<PlainNumbers>) -> f64| -> Vec<(f64, f64)> {
        run.iter().map(|state| (state.time, value(state))).collect()
    };
    let [mut positions, mut temperatures] =
        [Panel::new("position q", "t"), Panel::new("temperature T", "t")];
    for i in 0..bodies {
        positions = positions.line(format!("{i}"), series(&|s| s.point[i]));
        let capacity = network.0.0.capacities[i];
        temperatures =
            temperatures.line(format!("{i}"), series(&|s| s.point[2 * bodies + i] / capacity));
    }
    let first = &run.states()[0];
    let entropy = Panel::new("S − S₀", "t").line("S", series(&|s| s.entropy - first.entropy));
    let energy = Panel::new("H − H₀", "t").line("H", series(&|s| s.energy - first.energy));
    let title = format!("A network of {bodies} bodies, {} variables", 3 * bodies);
    let panels = [positions, temperatures, entropy, energy];
    let figure = panels.into_iter().fold(Panels::new(title), Panels::panel);
    let last = run.last();
    let ends = last.point.iter().zip(&implicit.last().point);
    let apart = ends.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    example
        .report_of(run.certificate(), last.time, last.point.to_vec())
        .with("entropy_gained", last.entropy - first.entropy)
        .with("implicit_end_apart", apart)
        .figure(figure)
        .print()
}
