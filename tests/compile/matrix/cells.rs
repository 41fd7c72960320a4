//! The matrix: what a program of each kind of system and each verb does today.

/// A row for each verb and a column for each kind, in the order of [`KINDS`](crate::programs::KINDS).
///
/// - The name of one of the [`TESTS`]: the program compiles, and this test compares such a run with a reference.
/// - The codes of the compiler's errors: the program does not compile.
/// - `–`: the program makes no sense, or the kind has it already.
///
/// Whoever fills an empty cell names its test here.
pub(crate) const CELLS: &str = "
verb                                  | closed     | family    | open         | noisy     | noisy open | lattice  | open lattice | noisy lattice | own          | sizes

`WeylMidpoint`                        | promises   | promises  | promises     | promises  | promises   | dense    | dense open   | dense path    | by parts     | by parts
`Scheme` with `ItohAbe`               | promises   | promises  | promises     | promises  | promises   | dense    | dense open   | dense path    | by parts     | by parts
`Gauss`                               | promises   | promises  | promises     | promises  | promises   | dense    | dense open   | dense path    | by parts     | by parts
`Radau`                               | promises   | promises  | one bath     | no radau  | no radau   | dense    | dense bath   | no radau      | by parts     | by parts
`DormandPrince8`                      | promises   | promises  | promises     | promises  | promises   | promises | promises     | frozen        | numbers      | numbers
`RungeKuttaChebyshev`                 | promises   | promises  | promises     | promises  | promises   | promises | promises     | frozen        | numbers      | numbers
`NinomiyaVictoir`                     | –          | –         | –            | promises  | promises   | –        | –            | ring          | –            | –
a field of a struct: `Simulation`     | struct     | struct    | struct       | struct    | struct     | in lists | in lists     | in lists      | struct       | struct
energy and entropy in boxes: `erased` | erased     | members   | boxes        | boxes     | boxes      | site boxes | site boxes | noisy boxes   | own box      | own box

`tangent` of `WeylMidpoint`           | schemes    | default   | beside       | its path  | its path   | beside sites | beside sites | beside sites  | in numbers   | in numbers
`tangent` of `DormandPrince8`         | explicit   | explicit  | beside       | its path  | its path   | beside sites | beside sites | beside sites  | in numbers   | in numbers
`tangent` of `Gauss`                  | stages     | stages    | beside       | its path  | its path   | beside sites | beside sites | beside sites  | in numbers   | in numbers
`tangent` across a jump               | saltation  | saltation | bounces      | no passages | no passages | bounces | bounces     | no passages   | bounces      | bounces
`adjoint` of `DormandPrince8`         | transposed | adjoint   | beside       | its path  | its path   | beside sites | beside sites | beside sites  | in numbers   | in numbers
derivatives along parameters          | a family   | a family  | its ledger   | along its noise | along its noise | along sites | along sites | along sites | a ball  | a ball
`Fit`                                 | fit        | fit       | a tank       | a path    | a path     | a rod    | a rod        | a rod         | a row        | a row
`Loss`                                | loss       | loss      | a tank       | a path    | a path     | a rod    | a rod        | a rod         | a row        | a row

`verified`                            | verified   | member    | surroundings | its noise | its noise  | sites    | sites open   | its ring      | by numbers   | by numbers
`verify`                              | verify     | member    | surroundings | its noise | its noise  | sites    | sites open   | its ring      | by numbers   | by numbers
`report`                              | report     | columns   | surroundings | its noise | its noise  | sites    | sites open   | its ring      | by numbers   | by numbers

thermal noise in its builder          | promises   | rubbed    | books        | –         | –          | ring     | warm sites   | –             | terms        | terms
an energy that depends on time        | promises   | pushed    | –            | books     | books      | masses   | masses       | field         | masses       | masses
ports and baths                       | promises   | pushed    | –            | books     | –          | promises | –            | warm sites    | masses       | masses

events                                | events     | saltation | ledger       | passages  | passages   | helix    | quench       | sites pass    | numbers runs | numbers runs
jumps                                 | promises   | saltation | kicks        | resets    | resets     | helix    | quench       | sites pass    | numbers runs | numbers runs
outputs                               | outputs    | inside    | ledger       | on its path | on its path | helix  | quench      | on their path | numbers runs | numbers runs
checkpoints                           | resumed    | default   | ledger       | put down  | books      | helix    | quench       | frozen        | numbers runs | numbers runs
`Sweep`                               | sweeps     | member    | ledger       | put down  | books      | helix    | quench       | frozen        | numbers runs | numbers runs
`Observables`                         | tables     | member    | ledger       | put down  | books      | helix    | quench       | frozen        | numbers runs | numbers runs
";

/// The file and the function of a test, by its name in [`CELLS`], and what the book says where it is not all as it should be.
pub(crate) struct Reference {
    pub(crate) name: &'static str,
    pub(crate) file: &'static str,
    pub(crate) test: &'static str,
    pub(crate) limit: Limit,
}

/// The limit of a program that compiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Limit {
    /// None: it is the whole answer.
    None,
    /// It runs for some systems, or in part.
    Partly(&'static str),
    /// The run is refused.
    Refused(&'static str),
}

/// A test whose program is right.
const fn right(name: &'static str, file: &'static str, test: &'static str) -> Reference {
    Reference { name, file, test, limit: Limit::None }
}

const fn partly(
    name: &'static str,
    [file, test]: [&'static str; 2],
    sentence: &'static str,
) -> Reference {
    Reference { name, file, test, limit: Limit::Partly(sentence) }
}

const fn refused(
    name: &'static str,
    [file, test]: [&'static str; 2],
    sentence: &'static str,
) -> Reference {
    Reference { name, file, test, limit: Limit::Refused(sentence) }
}

const PROMISES: [&str; 2] =
    ["tests/promises/main.rs", "every_method_is_right_on_every_kind_of_flow_or_says_why_not"];

const BY_DIFFERENCES: &str = "`Fit::of_systems` and `Loss::of_systems`: derivatives are \
                              [differences of runs in the same steps](sensitivities.md#fits-of-any-kind-of-system)";

const BESIDE: &str = "derivatives of a step are \
                      [differences of steps beside it](sensitivities.md#derivatives-of-any-kind-of-system)";

const SITE_BOXES: &str = "the builder of a lattice takes them in boxes, `.energy(ErasedField::new(..))`; \
                          its other closures keep their types";

/// The tests that the matrix names.
pub(crate) const TESTS: &[Reference] = &[
    right("promises", PROMISES[0], PROMISES[1]),
    partly(
        "one bath",
        PROMISES,
        "`Radau` takes open systems [without an entropy of their own and with one bath]\
         (open_systems.md#what-is-not-promised); others are refused (`StepError::Method`)",
    ),
    refused("no radau", PROMISES, "refused when it runs: `NoiseError::NoiseWithRadau`"),
    right("ring", "tests/noise/lattice.rs", "orders_of_a_ring_of_three_bodies"),
    right(
        "struct",
        "crates/integrators/src/run/simulation.rs",
        "systems_of_all_kinds_run_from_a_struct_with_the_bits_of_their_types",
    ),
    right(
        "in lists",
        "tests/lattices/simulations.rs",
        "lattices_of_all_kinds_run_from_a_struct_with_the_bits_of_their_types",
    ),
    right(
        "erased",
        "tests/compile/doors.rs",
        "erased_closures_have_one_type_and_the_bits_of_the_closures",
    ),
    right(
        "members",
        "tests/erased.rs",
        "members_of_families_have_one_type_the_bits_of_their_closures_and_their_tangents",
    ),
    right(
        "boxes",
        "tests/erased.rs",
        "noisy_and_open_systems_have_one_type_and_the_bits_of_their_closures",
    ),
    partly(
        "site boxes",
        ["tests/erased.rs", "lattices_have_one_type_and_the_bits_of_their_closures"],
        SITE_BOXES,
    ),
    partly(
        "noisy boxes",
        ["tests/erased.rs", "noisy_lattices_have_one_type_and_the_bits_of_their_closures"],
        SITE_BOXES,
    ),
    partly(
        "own box",
        ["tests/erased.rs", "systems_of_ones_own_have_one_type_and_their_bits"],
        "the whole system is in one box",
    ),
    partly(
        "rubbed",
        ["tests/tangents/families.rs", "a_family_has_the_noise_of_its_friction"],
        BESIDE,
    ),
    partly(
        "pushed",
        [
            "tests/tangents/families.rs",
            "families_with_surroundings_are_the_systems_by_hand_with_derivatives",
        ],
        BESIDE,
    ),
    right("schemes", "tests/tangent/schemes.rs", "tangents_of_schemes_are_those_of_differences"),
    right("default", "tests/trust/noise.rs", "a_retraction_is_its_scheme"),
    right("explicit", "tests/tangent/explicit.rs", "explicit_tangents_are_those_of_differences"),
    right("stages", "tests/tangent/collocated.rs", "tangents_of_stages_are_those_of_differences"),
    right("saltation", "tests/tangent/jumps.rs", "tangents_across_jumps_are_those_of_differences"),
    partly(
        "beside",
        [
            "tests/tangents/beside.rs",
            "open_systems_have_tangents_of_their_points_and_of_their_ledgers",
        ],
        BESIDE,
    ),
    partly(
        "its path",
        [
            "tests/tangents/beside.rs",
            "paths_with_noise_have_the_tangents_of_their_own_random_numbers",
        ],
        BESIDE,
    ),
    partly("beside sites", ["tests/tangents/beside.rs", "lattices_have_tangents"], BESIDE),
    partly(
        "in numbers",
        [
            "tests/tangents/in_numbers.rs",
            "systems_of_ones_own_have_the_tangents_of_differences_of_runs",
        ],
        "as exact as the derivatives of the model on vector spaces; to some ten digits elsewhere, \
         [by differences](sensitivities.md#derivatives-of-any-kind-of-system)",
    ),
    right(
        "a family",
        "tests/tangents/parameters.rs",
        "derivatives_along_parameters_are_those_of_a_family",
    ),
    partly(
        "its ledger",
        [
            "tests/tangents/parameters.rs",
            "states_and_ledgers_of_open_systems_have_derivatives_along_parameters",
        ],
        BESIDE,
    ),
    partly(
        "along its noise",
        ["tests/tangents/parameters.rs", "noise_has_derivatives_along_parameters"],
        BESIDE,
    ),
    partly(
        "along sites",
        ["tests/tangents/parameters.rs", "lattices_have_derivatives_along_parameters"],
        BESIDE,
    ),
    partly("a ball", ["tests/tangents/parameters.rs", "jumps_depend_on_parameters"], BESIDE),
    right("bounces", "tests/tangents/beside.rs", "tangents_of_every_kind_of_system_cross_jumps"),
    right("transposed", "tests/tangent/adjoint.rs", "adjoints_are_transposed_tangents"),
    right("adjoint", "tests/tangent/adjoint.rs", "adjoints_have_parameters"),
    right("fit", "tests/tangent/fits.rs", "a_fit_finds_the_parameters_within_their_errors"),
    partly(
        "a tank",
        ["tests/fits.rs", "the_damping_of_a_tank_is_found_from_the_rate_of_its_spacecraft"],
        BY_DIFFERENCES,
    ),
    partly(
        "a path",
        ["tests/fits.rs", "noisy_paths_are_fitted_at_their_own_numbers"],
        BY_DIFFERENCES,
    ),
    partly(
        "a rod",
        ["tests/fits.rs", "the_conduction_of_lattices_is_found_from_temperatures_and_heat"],
        BY_DIFFERENCES,
    ),
    partly(
        "a row",
        ["tests/fits.rs", "a_system_of_ones_own_is_fitted_by_every_kind_of_method_in_any_unit"],
        BY_DIFFERENCES,
    ),
    right("loss", "tests/trust/fits.rs", "a_loss_pairs_states_with_its_terms_by_time"),
    right(
        "verified",
        "tests/verification.rs",
        "a_verified_system_runs_as_the_system_does_and_judges_its_start",
    ),
    right(
        "verify",
        "tests/verification.rs",
        "a_lost_derivative_of_every_part_of_a_model_is_refused",
    ),
    right(
        "sites",
        "tests/lattice_verification.rs",
        "a_lattice_is_verified_once_and_its_report_lists_every_law",
    ),
    right(
        "sites open",
        "tests/lattice_verification.rs",
        "an_open_lattice_is_verified_once_and_its_report_lists_its_surroundings",
    ),
    right(
        "its ring",
        "tests/lattice_verification.rs",
        "a_lattice_with_noise_is_verified_once_with_the_law_of_its_noise",
    ),
    partly(
        "dense",
        [
            "tests/lattices/implicit.rs",
            "implicit_methods_of_a_chain_have_their_orders_and_both_laws",
        ],
        "up to 1024 variables; others are refused (`NoImplicitSteps`)",
    ),
    partly(
        "dense open",
        ["tests/lattices/open_implicit.rs", "sites_and_ledger_have_the_order_of_each_method"],
        "up to 1024 variables; others are refused (`NoImplicitSteps`)",
    ),
    partly(
        "dense bath",
        [
            "tests/lattices/open_implicit.rs",
            "radau_gives_what_it_damps_to_the_only_bath_or_refuses",
        ],
        "up to 1024 variables (others: `NoImplicitSteps`), \
         [without an entropy of their own and with one bath](open_systems.md#what-is-not-promised) (others: `NotDamped`)",
    ),
    right("warm sites", "tests/lattices/open_noise.rs", "bodies_in_a_room_have_the_law_of_gibbs"),
    partly(
        "dense path",
        ["tests/noise/lattice.rs", "a_path_of_a_ring_is_that_of_every_method"],
        "up to 1024 variables; others are refused (`NoImplicitSteps`)",
    ),
    partly(
        "by parts",
        ["crates/integrators/src/implicit.rs", "a_system_in_numbers_takes_the_steps_of_its_types"],
        "if the parts of the system are [known apart](recipes.md#a-system-of-your-own), along \
         geodesics if these are known too, \
         and up to 1024 variables; others are refused (`NoImplicitSteps`)",
    ),
    right("masses", "tests/protocols.rs", "two_masses_run_alike_however_they_are_built"),
    right("field", "tests/protocols.rs", "a_field_on_masses_with_noise_does_work"),
    partly(
        "terms",
        ["tests/protocols.rs", "a_path_of_ones_own_is_that_of_a_typed_system"],
        "on vector spaces, if the system [lists the terms of its friction](recipes.md#surroundings-and-noise-of-your-own)",
    ),
    right("frozen", "tests/noise/lattice.rs", "a_path_of_a_ring_is_that_of_every_method"),
    right(
        "member",
        "tests/tangent/families.rs",
        "a_member_of_a_family_is_verified_and_has_its_tables",
    ),
    right("report", "tests/bad_input.rs", "a_model_is_judged_only_inside_its_domain"),
    right("columns", "tests/tangent/schemes.rs", "parameters_are_columns"),
    right("books", "tests/noise/baths.rs", "heat_and_work_of_each_path_balance"),
    right(
        "events",
        "tests/events.rs",
        "events_of_an_oscillator_are_at_the_times_of_its_closed_form",
    ),
    right("ledger", "tests/open/main.rs", "outputs_events_and_checkpoints_have_the_ledger"),
    right("kicks", "tests/jumps.rs", "an_open_system_has_the_jumps_in_its_ledger"),
    right("helix", "tests/lattices.rs", "runs_have_outputs_events_rest_and_checkpoints"),
    right("quench", "tests/open_lattices.rs", "outputs_jumps_and_checkpoints_of_an_open_lattice"),
    partly(
        "passages",
        ["tests/passages.rs", "first_passages_have_the_orders_one_half_and_one"],
        "seen at the ends of steps, and by the Brownian bridge between them: \
         [of the order 1/2 or 1 in the step](noise.md#events-and-outputs)",
    ),
    partly(
        "resets",
        ["tests/passages.rs", "a_particle_is_reset_at_each_passage"],
        "seen at the ends of steps, and by the Brownian bridge between them: \
         [of the order 1/2 or 1 in the step](noise.md#events-and-outputs)",
    ),
    partly(
        "sites pass",
        ["tests/passages.rs", "a_noisy_lattice_has_events_and_outputs_between_steps"],
        "seen at the ends of steps, and by the Brownian bridge between them: \
         [of the order 1/2 or 1 in the step](noise.md#events-and-outputs)",
    ),
    refused(
        "no passages",
        ["tests/passages.rs", "tangents_of_paths_have_no_events"],
        "refused: `TangentError::Broken`, since the end of a step is the time of an event",
    ),
    right("outputs", "tests/dense_output.rs", "outputs_are_as_accurate_as_the_steps"),
    right("inside", "tests/tangent/explicit.rs", "outputs_inside_steps_have_tangents"),
    right("on its path", "tests/passages.rs", "outputs_between_steps_are_on_the_path"),
    right(
        "on their path",
        "tests/passages.rs",
        "a_noisy_lattice_has_events_and_outputs_between_steps",
    ),
    right("resumed", "tests/checkpoint.rs", "a_resumed_run_is_the_run"),
    right("put down", "tests/noise/paths.rs", "a_path_that_is_put_down_goes_on_with_the_same_bits"),
    right("sweeps", "tests/ensembles.rs", "a_row_alone_has_the_bits_of_the_table"),
    right("tables", "crates/integrators/src/run/observables/tests.rs", "numbers_survive_a_csv"),
    right(
        "numbers",
        "crates/integrators/src/numbers.rs",
        "a_system_in_numbers_runs_with_the_bits_of_its_types",
    ),
    right(
        "by numbers",
        "crates/integrators/src/numbers.rs",
        "a_system_of_ones_own_is_judged_by_its_motion",
    ),
    right(
        "numbers runs",
        "tests/bring_your_own_method.rs",
        "a_system_in_numbers_has_all_that_a_run_has",
    ),
    right(
        "surroundings",
        "crates/integrators/src/open/verify.rs",
        "an_open_system_is_verified_once_and_its_report_lists_its_surroundings",
    ),
    right(
        "its noise",
        "crates/integrators/src/noise/verify.rs",
        "noisy_systems_are_verified_once_and_run_as_before",
    ),
];

/// A cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Cell {
    /// The program compiles, and a test compares such a run with a reference; its number in [`TESTS`].
    Tested(usize),
    /// It does not compile, with these codes.
    Errors(Vec<String>),
    /// A program makes no sense.
    NoSense,
}

impl Cell {
    /// Whether a program is compiled.
    pub(crate) const fn has_program(&self) -> bool {
        !matches!(self, Self::NoSense)
    }

    pub(crate) const fn compiles(&self) -> bool {
        matches!(self, Self::Tested(_))
    }

    fn of(word: &str) -> Self {
        match word {
            "–" => Self::NoSense,
            codes if codes.starts_with("E0") => {
                Self::Errors(codes.split_whitespace().map(str::to_owned).collect())
            }
            name => {
                let test = TESTS.iter().position(|test| test.name == name);
                Self::Tested(test.unwrap_or_else(|| panic!("`{name}` is no test of the matrix")))
            }
        }
    }
}

/// The lines of the matrix: a verb with its cells. Empty lines are left out.
pub(crate) fn rows() -> Vec<(&'static str, Vec<Cell>)> {
    let lines = CELLS.lines().filter(|line| !line.is_empty()).skip(1);
    let words = |line: &'static str| line.split('|').map(str::trim).collect::<Vec<_>>();
    let row = |words: Vec<&'static str>| {
        (words[0], words[1..].iter().map(|word| Cell::of(word)).collect())
    };
    lines.map(words).map(row).collect()
}

/// The names of the columns.
pub(crate) fn columns() -> Vec<&'static str> {
    let first = CELLS.lines().find(|line| !line.is_empty()).expect("it has a first line");
    first.split('|').skip(1).map(str::trim).collect()
}
