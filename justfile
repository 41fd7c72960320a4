# `just` lists these recipes; `just ci` is everything a change has to pass.

set shell := ["bash", "-euo", "pipefail", "-c"]

# The oldest supported compiler, `rust-version` in Cargo.toml.
msrv := `sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml`

# list the recipes
default:
    @just --list --unsorted

# check the formatting (`cargo fmt --all` repairs it)
fmt:
    cargo fmt --all -- --check

# clippy on every target and feature, warnings are errors
lint:
    cargo clippy --workspace --all-targets --all-features -- -D warnings

# unit tests, integration tests, examples and doctests; the random cases are the same in each run
test:
    PROPTEST_RNG_SEED=2401 cargo test --workspace --all-features

# what verification refuses, and that it accepts the models of the tests that build many, and of the examples
verification: examples
    cargo test --package metriplectic-tests --package metriplectic-quick-tests --test verification --test problems --test laws --test second_law --test hard_corpus --test random_systems --test dissipations --test invariants --test equations --test errata --test euler_poincare --test metrics --test bad_input --test refusals --test fuzz

# build the documentation with rendered formulas, warnings are errors
doc:
    RUSTDOCFLAGS="-D warnings --html-in-header {{ justfile_directory() / "docs/katex.html" }}" cargo doc --workspace --no-deps --all-features

# build the book into target/book, warnings are errors; `test` compiles and runs its programs
book: (need "mdbook --version" "cargo install mdbook --locked --no-default-features")
    #!/usr/bin/env bash
    set -euo pipefail
    log=$(mdbook build book 2>&1) || { echo "$log" >&2; exit 1; }
    echo "$log"
    # mdbook has no option that makes its warnings errors.
    if grep -qwE 'WARN|ERROR' <<< "$log"; then
        echo 'the book has warnings' >&2
        exit 1
    fi

# build and run every example in release mode; one that fails fails the recipe
examples:
    #!/usr/bin/env bash
    set -euo pipefail
    shopt -s nullglob
    for file in examples/*.rs; do
        example=$(basename "$file" .rs)
        echo "example $example"
        cargo run --quiet --release --example "$example" -- --json > /dev/null
    done

# the slow studies, which `test` leaves out
study:
    cargo test --release --workspace -- --ignored

# run the shards of the example `sweep` by mpirun, GNU parallel and the variables of schedulers, and compare the bytes
cluster:
    #!/usr/bin/env bash
    set -euo pipefail
    target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
    CARGO_TARGET_DIR=$target cargo build --quiet --release --example sweep
    sweep=$target/release/examples/sweep
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
    # Each way has a folder for its journals, and the gallery of its table in there.
    in_folder() { mkdir -p "$work/$1"; cd "$work/$1"; export CARGO_TARGET_DIR=$work/$1; }
    compare() { (
        in_folder "$1"
        "$sweep" --merge --json > /dev/null
        cmp gallery/sweep.csv "$work/alone/gallery/sweep.csv"
        echo "$1: the same bytes from $(ls -- *.journal | wc -l) journals"
    ) }
    (in_folder alone; "$sweep" --json > /dev/null)
    if command -v mpirun > /dev/null; then
        flags=()
        if mpirun --version | grep -q 'Open MPI'; then
            flags+=(--oversubscribe)
            if [[ $(id -u) == 0 ]]; then flags+=(--allow-run-as-root); fi
        fi
        (in_folder mpirun; RAYON_NUM_THREADS=1 mpirun "${flags[@]}" -n 3 "$sweep" > /dev/null)
        compare mpirun
    else
        echo 'mpirun is missing (openmpi-bin in Debian): not tried'
    fi
    if command -v parallel > /dev/null; then
        (in_folder parallel; seq 0 3 | RAYON_NUM_THREADS=1 parallel -j 2 "$sweep" --shard {}/4 > /dev/null)
        compare parallel
    else
        echo 'GNU parallel is missing (parallel in Debian): not tried'
    fi
    # The schedulers themselves are not needed to see that their variables are read.
    for task in 1 4 7; do
        (
            in_folder slurm
            export SLURM_ARRAY_TASK_ID=$task SLURM_ARRAY_TASK_MIN=1 SLURM_ARRAY_TASK_MAX=7
            SLURM_ARRAY_TASK_STEP=3 SLURM_ARRAY_TASK_COUNT=3 "$sweep" > /dev/null
        )
        (
            in_folder gridengine
            export SGE_TASK_ID=$task SGE_TASK_FIRST=1 SGE_TASK_LAST=7
            SGE_TASK_STEPSIZE=3 "$sweep" > /dev/null
        )
        (in_folder pbs; PBS_ARRAY_INDEX=$((task / 3)) "$sweep" --shards 3 > /dev/null)
    done
    compare slurm; compare gridengine; compare pbs

# write docs/verification.md: what the tests measure of each guarantee; it takes ten minutes after `just test`
report:
    #!/usr/bin/env bash
    set -euo pipefail
    rm -rf target/report
    export METRIPLECTIC_REPORT={{ justfile_directory() / "target/report" }}
    tests=$(grep -rl --include='*.rs' 'Claim::new' tests | sed 's|^tests/||; s|/.*||; s|\.rs$||' | sort -u)
    run() { PROPTEST_RNG_SEED=2401 cargo test --package metriplectic-tests --package metriplectic-quick-tests --all-features "$@"; }
    run $(sed '/^examples$/d; s/^/--test /' <<< "$tests")
    cargo build --quiet --profile test --all-features --example convergence --example learning_data --example fit_metric
    run --test examples -- orders training_data of_a_metric
    run --test long_runs -- --ignored
    cargo run --quiet --profile test --package metriplectic-studies --bin report -- target/report .
    # The figures that it links; the programs are those of the tests.
    for figure in $(grep -o 'gallery/[a-z_]*\.svg' docs/verification.md | xargs -n 1 basename --suffix .svg | sort -u); do
        cargo build --quiet --profile test --all-features --example "$figure"
        CARGO_TARGET_DIR=target/report "${CARGO_TARGET_DIR:-target}/debug/examples/$figure" --json > /dev/null
        mv "target/report/gallery/$figure.svg" docs/gallery
    done

# compare the bits of many runs with benches/golden, or write it with `--bless`: for this machine and compiler
golden *flags:
    {{ if flags == "--bless" { "BLESS=1" } else { "" } }} cargo bench --package metriplectic-benches --bench golden

# random input without sense for ten minutes: a third of the seconds for each of six searches, two at a time
fuzz seconds="600":
    FUZZ_SECONDS=$(({{ seconds }} / 3)) cargo test --release --package metriplectic-tests --test fuzz -- --nocapture --test-threads 2

# change the integrators and the dynamics in small ways, some thirty of 7900 in an hour, and list what four tests miss
mutants shard="0/256": (need "cargo mutants --version" "cargo install cargo-mutants --locked")
    cargo mutants --package metriplectic-integrators --package metriplectic-dynamics \
        --shard {{ shard }} --sharding round-robin --all-features --output target --timeout 300 \
        --test-package metriplectic-tests --exclude-re 'impl (fmt::)?(Debug|Display)' \
        --cargo-arg=--package=metriplectic-tests \
        --cargo-arg=--test=mutations --cargo-arg=--test=conservation \
        --cargo-arg=--test=explicit --cargo-arg=--test=collocation

# time steps, and print the table of orders
bench:
    cargo bench --package metriplectic-benches

# count the instructions of a step in each row with callgrind, against benches/step/snapshot.txt (±3 %)
instructions *flags:
    #!/usr/bin/env bash
    set -euo pipefail
    wanted=$(sed -n 's/^channel = "\(.*\)"/\1/p' rust-toolchain.toml)
    if [[ $(rustc --version) != "rustc $wanted "* ]]; then
        echo "the counts belong to rustc $wanted: skipped"
    elif ! command -v valgrind > /dev/null; then
        echo "valgrind is not installed: skipped"
    else
        cargo bench --package metriplectic-benches --bench step -- --instructions {{ flags }}
    fi

# count the instructions of a step against the same one by hand, for 3 to 192 variables: docs/peers.md; a part of `peers`
growth:
    cargo bench --package metriplectic-benches --bench growth

# compare with other solvers, tables and docs/gallery/peers.svg: a package of its own, see docs/peers.md
peers *options: growth
    cd benches/peers && cargo run --release --bin peers -- {{ justfile_directory() }}/docs/gallery/peers.svg {{ options }}

# compare with the methods of the literature that keep laws, a table of docs/peers.md
neighbours:
    cd benches/peers && cargo run --release --no-default-features --bin neighbours

# draw work against precision on six problems, for the book, and print its table
precision:
    cd benches/peers && cargo run --release --bin peers -- {{ justfile_directory() }}/book/src/precision.svg --precision

# check every combination of features
features: (need "cargo hack --version" "cargo install cargo-hack --locked")
    cargo hack check --workspace --feature-powerset

# check the sets of features that `lint` leaves out: none, the default, and the default in a browser, where its target is installed
sets:
    #!/usr/bin/env bash
    set -euo pipefail
    check() { cargo check --quiet --package metriplectic "$@"; }
    check --no-default-features
    check
    if [[ -d $(rustc --print target-libdir --target wasm32-unknown-unknown) ]]; then
        check --target wasm32-unknown-unknown
    else
        echo 'sets: without wasm32-unknown-unknown, which is not installed'
    fi

# check with the oldest supported compiler
msrv: (need ("rustup run " + msrv + " cargo --version") ("rustup toolchain install " + msrv + " --profile minimal"))
    cargo +{{ msrv }} check --workspace --all-features

# check spelling and vocabulary: `_typos.toml` has the words to avoid and what to write instead
words: docstrings (need "typos --version" "cargo install typos-cli --locked")
    typos

# find docstrings that begin with a clause instead of a verb or a noun
docstrings:
    #!/usr/bin/env bash
    set -euo pipefail
    if grep -rnE '^\s*//[/!] (What|Those|That|The same|Nothing)\b' crates/{equations,fields,manifolds,dynamics,recording,integrators,lattices,ensembles,fitting,models,studies}/src python/src; then
        echo 'begin these docstrings with a verb in the third person or with a noun' >&2
        exit 1
    fi

# build the Python package and run its tests, in an environment of its own; what this machine lacks is said and left out
python:
    #!/usr/bin/env bash
    set -euo pipefail
    work=$(realpath -m "${CARGO_TARGET_DIR:-target}")/python
    not_tried() { echo "python: not tried, because $1"; exit 0; }
    python3 -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2> /dev/null || not_tried 'there is no Python 3.10 or newer'
    python3 -m venv "$work/env" 2> /dev/null || not_tried 'python3 -m venv does not work'
    "$work/env/bin/pip" install --quiet --disable-pip-version-check \
        'maturin>=1.9,<2' 'numpy>=1.26' scipy matplotlib pandas tqdm pytest mypy sympy joblib \
        || not_tried 'its packages cannot be installed'
    for module in jax dask ray; do
        "$work/env/bin/python" -c "import $module" 2> /dev/null || echo "python: without $module, whose tests are left out"
    done
    cd python
    export CARGO_TARGET_DIR=$work/target VIRTUAL_ENV=$work/env PATH="$work/env/bin:$PATH"
    maturin develop --quiet --profile quick --skip-install
    python -m pytest -q

# check licenses, advisories and duplicate dependencies
deny: (need "cargo deny --version" "cargo install cargo-deny --locked")
    cargo deny check

# what would be published, in its order, without publishing it
package:
    cargo publish --workspace --dry-run

# everything a change has to pass; ends on the closing line of `test`
ci: fmt lint doc sets python test

# stop, saying how to install it, where a tool is missing
[no-exit-message]
[private]
need tool install:
    @{{ tool }} > /dev/null 2>&1 || { echo 'this recipe needs `{{ tool }}` to work; run `{{ install }}` first' >&2; exit 1; }
