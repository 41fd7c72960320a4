//! A lattice that is cut into parts, each on a thread of its own, against the whole.

use std::collections::HashMap;
use std::sync::{Arc, Barrier, Mutex};
use std::thread;

use metriplectic_dynamics::Poisson;
use metriplectic_fields::Real;
use metriplectic_integrators::{Flow, StageFlow, Vector as _};
use metriplectic_manifolds::Euclidean;
use nalgebra::{Matrix3, Vector3, vector};
use num_dual::DualNum;

use crate::neighbours::{Alone, Edge, Edges, Neighbours, Node};
use crate::onsager::BondState;
use crate::parallel::CHUNK;
use crate::{Graph, Lattice, LatticeError, Model, Onsager, Points};

/// Board on which the parts put what they tell each other.
#[derive(Debug)]
struct Board {
    barrier: Barrier,
    numbers: Mutex<HashMap<u32, Vec<f64>>>,
    nodes: Mutex<Vec<Vec<Node<Vec<f64>>>>>,
}

/// A part that meets the others at a board.
#[derive(Clone, Debug)]
struct Meeting {
    number: usize,
    count: usize,
    board: Arc<Board>,
}

impl Meeting {
    fn of(count: usize) -> impl Iterator<Item = Self> {
        let board = Board {
            barrier: Barrier::new(count),
            numbers: Mutex::default(),
            nodes: Mutex::new(vec![Vec::new(); count]),
        };
        let board = Arc::new(board);
        (0..count).map(move |number| Self { number, count, board: Arc::clone(&board) })
    }
}

impl Neighbours for Meeting {
    fn count(&self) -> usize {
        self.count
    }

    fn exchange(&self, edges: &Edges, width: usize, numbers: &mut [f64]) {
        let Board { barrier, numbers: board, .. } = &*self.board;
        let at = |edge: &Edge| edge.place as usize * width..(edge.place as usize + 1) * width;
        for edge in &edges.sent {
            board.lock().unwrap().insert(edge.name, numbers[at(edge)].to_vec());
        }
        barrier.wait();
        for edge in &edges.received {
            numbers[at(edge)].copy_from_slice(&board.lock().unwrap()[&edge.name]);
        }
        if barrier.wait().is_leader() {
            board.lock().unwrap().clear();
        }
        barrier.wait();
    }

    fn gather(&self, nodes: Vec<Node<Vec<f64>>>) -> Vec<Node<Vec<f64>>> {
        let Board { barrier, nodes: board, .. } = &*self.board;
        board.lock().unwrap()[self.number] = nodes;
        barrier.wait();
        let all = board.lock().unwrap().concat();
        barrier.wait();
        all
    }
}

type Bond = (Vector3<Real>, Vector3<Real>);

/// Oscillators with heat: masses of their own, springs of their own, a density that is gathered over the bonds, friction
/// and conduction in the bonds, and a listed momentum.
fn part(
    graph: Graph,
    number: usize,
    neighbours: impl Neighbours + 'static,
) -> Result<Lattice<impl Model<Manifold = Euclidean<3>>>, LatticeError> {
    let canonical = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let masses = (0..graph.sites()).map(|i| 1.0 + 0.1 * (i % 7) as f64).collect();
    let springs = (0..graph.bonds().len()).map(|k| 1.0 + 0.2 * (k % 5) as f64).collect();
    let friction = |bond: &BondState<'_, Euclidean<3>, f64>| {
        let [u, v] = bond.w;
        let slip = 0.5 * (v.y - u.y);
        let viscous = [vector![0.0, -1.0, -slip / u.z], vector![0.0, 1.0, -slip / v.z]];
        let heat = [vector![0.0, 0.0, 1.0 / u.z], vector![0.0, 0.0, -1.0 / v.z]];
        let rate = u.z * v.z * bond.data;
        [Onsager { rate: 0.2 * rate / (u.z + v.z), b: viscous }, Onsager { rate, b: heat }]
    };
    Lattice::on(graph, Euclidean::<3>)
        .bracket(Poisson::constant(canonical).expect("a skew matrix"))
        .site_data(masses)
        .bond_data(springs)
        .energy_with(|x: &Vector3<Real>, mass: &f64| x.y * x.y / (2.0 * mass) + x.z.exp())
        .bond_energy_with(|(x, y): &Bond, k: &f64| (y.x - x.x).powi(2) * (0.5 * k))
        .gather(
            |(x, y): &Bond| (x.x - y.x).cos(),
            |x: &Vector3<Real>, sum: Real| sum * sum * 0.01 + sum * x.z * 0.01,
        )
        .entropy(|x: &Vector3<Real>| x.z)
        .bond_onsager(friction)
        .conserved(|x: &Vector3<Real>| x.y)
        .part(number, Box::new(neighbours))
}

fn at(site: usize) -> Vector3<f64> {
    let phase = site as f64;
    vector![0.3 * phase.sin(), (1.7 * phase).cos(), 0.2 * (0.1 * phase).sin()]
}

/// The bits of what a part knows: its velocity, then the laws, the production and the sizes of the terms of the whole.
fn bits<P: Model<Manifold = Euclidean<3>>>(lattice: &Lattice<P>) -> [Vec<u64>; 2] {
    let layout = &lattice.layout;
    let ghosts = layout.ghosts().map(|name| at(name as usize));
    let own = layout.sites_of_graph().map(at);
    let x = Points::from(own.chain(ghosts).collect::<Vec<_>>());
    let (v, production) = lattice.motion(&x).expect("numbers");
    let (laws, sizes) = (lattice.laws(&x), lattice.term_sizes(&x));
    let round_off = lattice.entropy_round_off([&x, &x]);
    assert_eq!(round_off.to_bits(), (4.0 * f64::EPSILON * sizes.entropy).to_bits());
    let totals = [laws, sizes].into_iter().flat_map(|laws| {
        [laws.energy, laws.entropy].into_iter().chain(laws.invariants).collect::<Vec<_>>()
    });
    let bits = |numbers: Vec<f64>| numbers.into_iter().map(f64::to_bits).collect();
    [bits(v.to_list()), bits(totals.chain([production]).collect())]
}

/// Bonds from site to site in no order, many of them between parts that are no neighbours in a row.
fn tangle(sites: usize) -> Graph {
    // The generator of Knuth's MMIX.
    let mut state = 3_u64;
    let mut site = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        usize::try_from(state >> 33).unwrap_or(0) % sites
    };
    let bonds = (0..3 * sites).map(|_| [site(), site()]).filter(|[from, to]| from != to);
    Graph::from_bonds(sites, bonds.collect::<Vec<_>>())
}

#[test]
fn parts_of_a_lattice_have_the_bits_of_the_whole() {
    use crate::Boundary::{Open, Periodic};
    let graphs = [
        Graph::ring(11 * CHUNK + 300),
        Graph::square([100, 60], Periodic),
        Graph::cubic([20, 20, 20], Open),
        tangle(7 * CHUNK),
    ];
    for graph in graphs {
        let [velocity, totals] = bits(&part(graph.clone(), 0, Alone).expect("a lattice"));
        for count in 1..=4 {
            let work = Meeting::of(count).map(|meeting| {
                let graph = graph.clone();
                thread::spawn(move || {
                    let part = part(graph, meeting.number, meeting.clone()).expect("a part");
                    bits(&part)
                })
            });
            let threads: Vec<_> = work.collect();
            let parts = threads.into_iter().map(|thread| thread.join().expect("a part"));
            let mut whole = Vec::new();
            for [velocity, known] in parts {
                whole.extend(velocity);
                assert_eq!(known, totals, "{count} parts of {} sites", graph.sites());
            }
            assert!(whole == velocity, "{count} parts of {} sites", graph.sites());
        }
    }
}

#[test]
fn there_are_no_more_parts_than_chunks() {
    let graph = Graph::ring(3 * CHUNK);
    let refused = |count: usize| {
        let first = Meeting::of(count).next().expect("there is one");
        part(graph.clone(), 0, first).err()
    };
    assert_eq!(refused(3), None);
    let error = refused(4).expect("a part would have no site");
    assert_eq!(error, LatticeError::TooManyParts { parts: 4, chunks: 3 });
    assert_eq!(
        error.to_string(),
        "4 parts of a lattice need as many chunks of 1024 sites, and the graph has 3; cut it into fewer"
    );
}
