//! The programs of the cells: a system of a kind, and a verb that is asked of it.

/// A kind of system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A system of the builder.
    Closed,
    /// A member of a family, at values of its parameters.
    Family,
    /// With a clock, a port and a bath.
    Open,
    /// With thermal noise.
    Noisy,
    /// With a port, a bath and their noise.
    NoisyOpen,
    /// Many sites.
    Lattice,
    /// Many sites with a port and a bath.
    OpenLattice,
    /// Many sites with noise.
    NoisyLattice,
    /// A type of the user's that implements `Equations`.
    Own,
    /// With a number of variables that is read at run time.
    Sizes,
}

use Kind::{
    Closed, Family, Lattice, Noisy, NoisyLattice, NoisyOpen, Open, OpenLattice, Own, Sizes,
};

/// The kinds, in the order of the columns.
pub(crate) const KINDS: [Kind; 10] =
    [Closed, Family, Open, Noisy, NoisyOpen, Lattice, OpenLattice, NoisyLattice, Own, Sizes];

impl Kind {
    /// The heading of its column.
    pub(crate) const fn heading(self) -> &'static str {
        match self {
            Closed => "closed",
            Family => "family",
            Open => "open",
            Noisy => "noisy",
            NoisyOpen => "noisy open",
            Lattice => "lattice",
            OpenLattice => "open lattice",
            NoisyLattice => "noisy lattice",
            Own => "own",
            Sizes => "sizes",
        }
    }

    /// An expression: a system and the state in which its runs start.
    const fn system(self) -> &'static str {
        match self {
            Closed => include_str!("kinds/closed.rs"),
            Family => include_str!("kinds/family.rs"),
            Open => include_str!("kinds/open.rs"),
            Noisy => include_str!("kinds/noisy.rs"),
            NoisyOpen => include_str!("kinds/noisy_open.rs"),
            Lattice => include_str!("kinds/lattice.rs"),
            OpenLattice => include_str!("kinds/open_lattice.rs"),
            NoisyLattice => include_str!("kinds/noisy_lattice.rs"),
            // Any number of variables of a system of one's own is read.
            Own | Sizes => include_str!("kinds/own.rs"),
        }
    }

    /// The type of its states.
    const fn point(self) -> &'static str {
        match self {
            Closed | Family | Noisy => "Vector3<f64>",
            Open | NoisyOpen => "OpenState<Vector3<f64>>",
            Lattice => "Points<LieDual<3>>",
            OpenLattice => "OpenState<Points<LieDual<3>>>",
            NoisyLattice => "Points<Euclidean<1>>",
            Own | Sizes => "Entries",
        }
    }

    const fn is_noisy(self) -> bool {
        matches!(self, Noisy | NoisyOpen | NoisyLattice)
    }

    /// A method as runs of this kind take it.
    fn method(self, method: &str) -> String {
        if self.is_noisy() { format!("RandomFlow({method}).seed(1)") } else { method.to_owned() }
    }
}

const STEPS: &str = "Span::steps(0.1, 10)";
const ENERGY: &str = ".energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)";
const ENTROPY: &str = ".entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)";
const CLOCK: &str =
    ".energy_in_time(|t: Real, p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.x * t.sin())";
const PORT: &str = ".work(\"torque\", |t: Real, p: &Vector3<Real>| p * t.sin())";
const BATH: &str = ".bath(\"air\", Bath::at(1.0).isotropic(0.1))";
const NOISE: &str = ".noise(Boltzmann(0.1))";
/// The surroundings of a lattice.
const SITES: &str = ".opened()
    .work(\"torque\", [0], |t, _, p: &Vector3<f64>| p * t.sin())
    .bath(\"air\", 1.0, [1], |_, _: &SiteState<'_, LieDual<3>>| [Onsager { rate: 0.1, b: vector![0.0, 1.0, 0.0] }])";
/// The surroundings of a lattice of bodies with heat.
const ROOM: &str = ".opened()
    .work(\"nothing\", [0], |t, _, u: &Vector1<f64>| u * 0.0)
    .bath(\"room\", 1.0, [1], |_, at: &SiteState<'_, Euclidean<1>>| [Onsager { rate: at.x.x, b: vector![1.0] }])";

/// An energy of each site of a lattice that depends on time.
const FIELD: &str = ".energy_in_time(|t, _, p: &Vector3<Real>| p.x * t.sin())";
/// A bath of a system of one's own, of `n` entries.
const AIR: &str = ".bath(\"air\", 1.0, move |_, contact| contact(0.1, &[(n - 2, 1.0)]))";

const OF_ENERGY: &str =
    ".energy(|p: &Vector3<Real>, a: &Vector1<Real>| p.x * p.x * a.x + p.y * p.y + p.z * p.z * 1.5)";
const OF_CLOCK: &str = ".energy_in_time(|t: Real, p: &Vector3<Real>, a: &Vector1<Real>| p.x * p.x * a.x + p.y * p.y + p.x * t.sin())";
/// The surroundings of a family.
const OF_ROOM: &str =
    ".work(\"torque\", |t: Real, p: &Vector3<Real>, a: &Vector1<Real>| p * t.sin() * a.x)
    .bath(\"air\", Bath::at(1.0).isotropic(0.1))
    .bath(\"oil\", |a: &Vector1<f64>| Bath::at(1.0).isotropic(a.x))";

/// The builder of a family with these parts.
fn family(parts: &str) -> String {
    let entropy = ".entropy(|p: &Vector3<Real>, _: &Vector1<Real>| p.norm_squared() * 0.5)";
    format!("Family::on(LieDual::so3()).parameters([\"a\"]){entropy}{parts}.build()?")
}

/// A statement that runs a member of a family with these parts, with its derivatives.
fn member(parts: &str, method: &str, start: &str) -> String {
    format!(
        "let f = {};
    let s = f.at(vector![1.0]);
    let _ = {method}.run(&s, {start}, {STEPS})?;
    let _ = {method}.tangent(&s, {start}, {STEPS})?.last().along(\"a\");",
        family(parts)
    )
}

/// A statement that builds a family, as `f`.
fn with_parameters() -> String {
    format!("let f = {};", family(OF_ENERGY))
}

/// A statement that says how a system of this kind is built at values of parameters.
fn built(kind: Kind) -> String {
    let system = kind.system().trim_end();
    format!(
        "let build = |_: &Vector1<f64>| Ok::<_, metriplectic::fitting::Failure>({{ let s = {system}; s.0 }});"
    )
}

/// A statement that builds two lattices of one type, with their surroundings or their noise.
fn boxed_sites(around: &str) -> String {
    format!(
        "let on = |energy| Lattice::on(Graph::ring(4), LieDual::so3()).energy(energy);
    let soft = on(ErasedField::new(|p: &Vector3<Real>| p.norm_squared())).build()?{around};
    let _ = [soft, on(ErasedField::new(|p: &Vector3<Real>| p.x.exp())).build()?{around}];"
    )
}

/// A statement that builds a system of this kind with one part more, which its kind does not have.
fn with(kind: Kind, part: &str) -> String {
    let built =
        |parts: &str| format!("let _ = System::on(LieDual::so3()){ENTROPY}{parts}.build()?;");
    match (part, kind) {
        ("noise", Closed) => built(&format!("{ENERGY}{NOISE}")),
        ("noise", Family) => {
            let method = Noisy.method("DormandPrince8");
            member(&format!("{OF_ENERGY}{NOISE}"), &method, "x")
        }
        ("noise", Open) => built(&format!("{CLOCK}{PORT}{BATH}{NOISE}")),
        ("noise", Lattice | OpenLattice) => "let _ = s.with_noise(Boltzmann(0.1));".to_owned(),
        ("noise", _) => format!(
            "let n = s.with_noise(Boltzmann(0.1));
    let _ = RandomFlow(DormandPrince8).seed(1).run(&n, x, {STEPS})?;"
        ),
        ("clock", Closed) => built(CLOCK),
        ("clock", Family) => member(OF_CLOCK, "DormandPrince8", "s.start(x)"),
        ("clock", Noisy) => built(&format!("{CLOCK}{NOISE}")),
        ("clock", NoisyOpen) => built(&format!("{CLOCK}{PORT}{BATH}{NOISE}")),
        ("clock", Lattice) => format!("let _ = s.opened(){FIELD};"),
        ("clock", OpenLattice) => format!("let _ = s{FIELD};"),
        ("clock", NoisyLattice) => {
            "let _ = s.energy_in_time(|t, _, u: &Vector1<Real>| u.x * t.sin() * 0.1);".to_owned()
        }
        ("clock", Own | Sizes) => format!(
            "let mut s = s;
    s.0.drive = 0.1;
    let o = s.opened();
    let _ = DormandPrince8.run(&o, o.start(x), {STEPS})?;"
        ),
        ("ports", Own | Sizes) => format!(
            "let n = x.len();
    let o = s.opened().work(\"motor\", |t, _, v| v[1] = t.sin()){AIR};
    let _ = DormandPrince8.run(&o, o.start(x), {STEPS})?;"
        ),
        ("ports", Closed) => built(&format!("{ENERGY}{PORT}{BATH}")),
        ("ports", Family) => {
            member(&format!("{OF_ENERGY}{OF_ROOM}"), "DormandPrince8", "s.start(x)")
        }
        ("ports", Noisy) => built(&format!("{ENERGY}{PORT}{BATH}{NOISE}")),
        (_, NoisyLattice) => format!("let _ = s{ROOM};"),
        (_, _) => format!("let _ = s{SITES};"),
    }
}

/// The statements that ask a verb, by its name in the matrix, of the system `s` from the start `x`.
fn verb(kind: Kind, name: &str) -> String {
    let (point, dp8) = (kind.point(), kind.method("DormandPrince8"));
    let run = |method: &str| format!("let _ = {}.run(&s, x, {STEPS})?;", kind.method(method));
    let tangent =
        |method: &str| format!("let _ = {}.tangent(&s, x, {STEPS})?;", kind.method(method));
    let event = format!("{STEPS}.event(\"e\", |_: &{point}| 1.0)");
    let jump = format!("{event}.jump(|_, x: &{point}| x.clone())");
    match name {
        "`WeylMidpoint`" => run("WeylMidpoint"),
        "`Scheme` with `ItohAbe`" => run("Scheme::new(WeylMidpoint).gradient(ItohAbe)"),
        "`Gauss`" => run("Gauss::<2>"),
        "`Radau`" => run("Radau::<2>"),
        "`DormandPrince8`" => run("DormandPrince8"),
        "`RungeKuttaChebyshev`" => run("RungeKuttaChebyshev"),
        "`NinomiyaVictoir`" => {
            format!("let _ = NinomiyaVictoir(DormandPrince5).seed(1).run(&s, x, {STEPS})?;")
        }
        "a field of a struct: `Simulation`" => format!(
            "struct Case {{ simulation: Simulation }}
    let case = Case {{ simulation: Simulation::new({dp8}, s) }};
    let _ = case.simulation.run(&[0.4, 0.5, 0.3], {STEPS});"
        ),
        "energy and entropy in boxes: `erased`" => match kind {
            Lattice => boxed_sites(""),
            OpenLattice => boxed_sites(".opened()"),
            NoisyLattice => boxed_sites(".with_noise(Boltzmann(0.1))"),
            _ => "let _ = s.erased();".to_owned(),
        },
        "`tangent` of `WeylMidpoint`" => tangent("WeylMidpoint"),
        "`tangent` of `DormandPrince8`" => tangent("DormandPrince8"),
        "`tangent` of `Gauss`" => tangent("Gauss::<2>"),
        "`tangent` across a jump" => format!("let _ = {dp8}.tangent(&s, x, {jump})?;"),
        "`adjoint` of `DormandPrince8`" => format!("let _ = {dp8}.adjoint(&s, x, {STEPS})?;"),
        "derivatives along parameters" if matches!(kind, Closed | Family) => format!(
            "{}
    let _ = {dp8}.tangent(&f.at(vector![1.0]), x, {STEPS})?.last().along(\"a\");",
            with_parameters()
        ),
        "derivatives along parameters" => format!(
            "{}
    let systems = Systems::new([\"a\"], build);
    let at = systems.at(vector![1.0]).map_err(|error| error.to_string())?;
    let _ = {dp8}.tangent(&at, x, {STEPS})?.last().along(\"a\");",
            built(kind)
        ),
        "`Fit`" if matches!(kind, Closed | Family) => format!(
            "{}
    let fit = Fit::of(&f).observe(|p| p.clone()).data(&[0.5], &[vector![0.0, 0.0, 0.0]]);
    let _ = fit.start_at(x).run({dp8}, {STEPS}, vector![1.0])?;",
            with_parameters()
        ),
        "`Fit`" => format!(
            "{}
    let fit = Fit::of_systems([\"a\"], build).observe(|_: &{point}| vector![1.0]);
    let fit = fit.data(&[0.5, 1.0], &[vector![1.0], vector![1.0]]);
    let _ = fit.start_at(x).run({dp8}, {STEPS}, vector![1.0])?;",
            built(kind)
        ),
        "`Loss`" if matches!(kind, Closed | Family) => format!(
            "{}
    let loss = metriplectic::fitting::Loss::of(&f).starts(&[x]).times(&[0.5]);
    let _ = loss.term(|_, _, _| Real::from(0.0)).over({dp8}, {STEPS});",
            with_parameters()
        ),
        "`Loss`" => format!(
            "{}
    let loss = metriplectic::fitting::Loss::of_systems([\"a\"], build).starts(&[x]).times(&[0.5]);
    let _ = loss.term(|_, _, _: &{point}| 0.0).over({dp8}, {STEPS}).gradient_at(&vector![1.0]);",
            built(kind)
        ),
        "`verified`" => {
            format!("let v = s.verified(&x)?;\n    let _ = {dp8}.run(&v, x.clone(), {STEPS})?;")
        }
        "`verify`" => match kind {
            Lattice | OpenLattice => "let _ = s.verify(&x);",
            NoisyLattice => "let _ = s.verify(&x, 0.01);",
            _ => "let _ = s.verify(&x, 0.1);",
        }
        .to_owned(),
        "`report`" => "println!(\"{}\", s.report(&x));".to_owned(),
        "thermal noise in its builder" => with(kind, "noise"),
        "an energy that depends on time" => with(kind, "clock"),
        "ports and baths" => with(kind, "ports"),
        "events" => format!("let _ = {dp8}.run(&s, x, {event})?;"),
        "jumps" => format!("let _ = {dp8}.run(&s, x, {jump})?;"),
        "outputs" => format!("let _ = {dp8}.run(&s, x, {STEPS}.output_at([0.5]))?;"),
        "checkpoints" => format!(
            "let mut steps = {dp8}.steps(&s, x, {STEPS})?;
    steps.advance()?;
    let checkpoint = steps.checkpoint();
    let _ = {dp8}.resume(&s, &checkpoint)?.run()?;"
        ),
        "`Sweep`" => format!(
            "let sweep = Sweep::new(\"one\").grid(\"k\", [1.0]);
    let _ = sweep.run(|_| Ok({dp8}.run(&s, x.clone(), {STEPS})?)).execute()?;"
        ),
        "`Observables`" => {
            "let watch = Observables::on(&s).of(\"one\", |_| 1.0);\n    let _ = watch.csv(Vec::new())?;"
                .to_owned()
        }
        other => panic!("`{other}` has no program"),
    }
}

/// The lines in front of each program.
const HEAD: &str = "#![allow(unused)]
use metriplectic::equations::{Covectors, ENERGY, ENTROPY, Equations, FrictionTerms, Sizes, Terms};
use metriplectic::integrators::{Entries, FromEquations};
use metriplectic::prelude::*;
";

/// The program of a cell.
pub(crate) fn program(kind: Kind, name: &str) -> String {
    let (system, verb) = (kind.system().trim_end(), verb(kind, name));
    format!(
        "{HEAD}
fn main() -> Result<(), Box<dyn std::error::Error>> {{
    let (s, x) = {system};
    {verb}
    Ok(())
}}
"
    )
}
