//! Sweeps: the laws of their tables, under threads, shards, killed processes, full disks and bad rows.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use metriplectic::ensembles::{
    JournalError, PlanError, RowStatus, Runs, ShardError, SweepError, TableError, TableRow,
};
use metriplectic::integrators::{Schedule, Scheme};
use metriplectic::manifolds::metric::Canonical;
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee};

/// Records what a test of sweeps has measured.
#[track_caller]
fn claim(problem: &str, against: &str, figure: impl std::fmt::Display, bound: &str) {
    let claim = Claim::new(Guarantee::Sweeps, problem, "WeylMidpoint");
    claim.against(against).record(figure, bound);
}

/// A folder for the files of a test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ensembles").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// A body with a friction, from a spin, in steps of a size.
fn relaxing(row: &Row) -> Result<Trajectory<LieDual<3>>, Error> {
    relaxing_in(row, 40, 0.1)
}

fn relaxing_in(row: &Row, steps: usize, h: f64) -> Result<Trajectory<LieDual<3>>, Error> {
    let body = body(row["friction"])?;
    let start = vector![row["spin"], -1.0, 0.3];
    Ok(WeylMidpoint.run(&body, start, Span::steps(h, steps).every(steps / 4))?)
}

/// One type of body and one of oscillators, because each is compiled with its method.
fn body(
    friction: f64,
) -> Result<impl Metriplectic<Manifold = LieDual<3>, Metric = Canonical>, Error> {
    Ok(System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x.powi(2) * 0.05 + p.y.powi(2) * 0.1 + p.z.powi(2) * 0.5)
        .entropy(move |p: &Vector3<Real>| p.norm_squared() * (0.5 * friction))
        .build()?)
}

/// An oscillator in units of length and energy, or a mass that is attracted by the logarithm of its distance.
fn oscillator(
    [l, e]: [f64; 2],
    friction: f64,
    attracted: bool,
) -> Result<impl Metriplectic<Manifold = Euclidean<3>, Metric = Canonical>, Error> {
    Ok(System::on(Euclidean::<3>)
        .bracket(Poisson::constant(matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0])?)
        .energy(move |x: &Vector3<Real>| {
            let (q, p) = (x.x / l, x.y * l / e);
            let potential = if attracted { q.ln() * 2.0 } else { q * q };
            (potential + p * p) * (0.5 * e) + x.z
        })
        .entropy(|x: &Vector3<Real>| x.z)
        .dissipation(FieldDissipation(move |_: &Vector3<Real>, w: &Vector3<Real>| {
            let b = Vector3::new(Real::from(0.0), w.z, -w.y);
            b * b.transpose() * (w.z.recip() * (friction * e / (l * l)))
        }))
        .build()?)
}

/// A plan of 20 × 20 rows.
fn plan(name: &str) -> Sweep {
    Sweep::new(name)
        .grid("friction", linspace(0.05, 1.0, 20))
        .samples(20)
        .random("spin", |draw| draw.uniform(-1.0..1.0))
}

type Closure = fn(&Row) -> Result<Trajectory<LieDual<3>>, Error>;

fn runs(plan: Sweep, closure: Closure) -> Runs<'static, LieDual<3>, Closure> {
    plan.run(closure).observe("p₁", |p| p.x).measure("|p|", |run| run.last().point.norm()).quiet()
}

fn csv(table: &Table) -> String {
    let mut text = Vec::new();
    table.write_csv(&mut text).expect("memory takes it");
    String::from_utf8(text).expect("text")
}

fn column(table: &Table, name: &str) -> Vec<f64> {
    table.column(name).expect("the column")
}

/// Everything that is compared: the table, and what was observed in time.
fn bytes(table: &Table) -> String {
    let series = |row: TableRow<'_>| {
        row.series("p₁")
            .map_or(Vec::new(), Iterator::collect)
            .into_iter()
            .map(|(t, x): (f64, f64)| format!("{:x}{:x}", t.to_bits(), x.to_bits()))
            .collect::<String>()
    };
    csv(table) + &table.rows().map(series).collect::<Vec<_>>().join("\n")
}

#[test]
fn the_bytes_of_a_table_depend_on_neither_threads_nor_shards() {
    let folder = folder("threads");
    let alone = runs(plan("threads"), relaxing).threads(1).execute().expect("all rows");
    assert_eq!((alone.len(), alone.failed(), alone.missing().len()), (400, 0, 0));
    for threads in [2, 7] {
        let table = runs(plan("threads"), relaxing).threads(threads).execute().expect("all rows");
        assert!(bytes(&table) == bytes(&alone), "{threads} threads");
    }
    let journal = folder.join("sweep.journal");
    for index in 0..3 {
        let shard = Shard::new(index, 3).expect("a shard");
        let part = runs(plan("threads"), relaxing).journal(&journal).shard(shard);
        let part = part.execute().expect("the rows of a shard");
        assert_eq!(part.len(), 400_usize.div_ceil(3) - usize::from(index > 0));
        assert!(part.rows().all(|row| row.number() % 3 == index));
        if index < 2 {
            let merged = Table::merge(Table::journals(&journal).expect("files")).expect("a table");
            let missing = merged.missing();
            assert!(missing.iter().all(|row| row % 3 > index) && missing.len() > 132);
            assert_eq!(merged.complete().unwrap_err(), TableError::Missing { rows: missing });
        }
    }
    let names = Table::journals(&journal).expect("files");
    assert!(names.iter().all(|name| name.extension().is_some_and(|e| e == "journal")));
    let merged = Table::merge(names).expect("a table").complete().expect("all rows");
    assert!(bytes(&merged) == bytes(&alone));
    let threads = "the table of 1 thread, for 2 and 7 threads and for 3 shards that are merged";
    claim("400 relaxing bodies", threads, "the same bytes", "the same bytes");
    // The numbers are those of runs by hand.
    let row = plan("threads").row(217).expect("a row");
    let run = relaxing(&row).expect("a run");
    let entry = alone.row(217).expect("a row");
    assert_eq!(entry.end(), run.last().point.as_slice());
    let by_hand: Vec<(f64, f64)> = run.iter().map(|state| (state.time, state.point.x)).collect();
    assert_eq!(entry.series("p₁").expect("observed").collect::<Vec<_>>(), by_hand);
    assert_eq!(entry.get("run.energy_error"), {
        let certificate = run.certificate();
        Some(certificate.max_energy_error / certificate.energy_scale)
    });
    assert_eq!(entry.get("run.entropy_increment"), Some(run.certificate().min_entropy_increment));
    assert_eq!(entry.get("run.kept"), Some(1.0));
}

#[test]
fn a_row_alone_has_the_bits_of_the_table() {
    let all = runs(plan("alone"), relaxing).execute().expect("all rows");
    let alone = runs(plan("alone"), relaxing).only(17).expect("a row");
    assert_eq!(alone.len(), 1);
    let line = |table: &Table| csv(table).lines().find(|l| l.starts_with("17,")).map(str::to_owned);
    assert!(line(&alone).is_some() && line(&alone) == line(&all));
    let none = runs(plan("alone"), relaxing).only(400).unwrap_err();
    assert!(matches!(none, PlanError::NoSuchRow { row: 400, rows: 400 }), "{none}");
}

/// Eleven starts that are not a number, and a closure that panics in a row.
fn some_fail(row: &Row) -> Result<Trajectory<LieDual<3>>, Error> {
    assert!(row.number() != 200, "row 200 is bad");
    if row.number() % 37 == 5 {
        let plan = Sweep::new("nan").grid("friction", [0.1]).grid("spin", [f64::NAN]);
        return relaxing(&plan.row(0).expect("a row"));
    }
    relaxing(row)
}

#[test]
fn a_row_that_fails_or_panics_is_a_row_with_a_sentence() {
    let whole = runs(plan("failures"), relaxing).execute().expect("all rows");
    let table = runs(plan("failures"), some_fail).execute().expect("all rows");
    assert_eq!((table.len(), table.failed(), table.missing().len()), (400, 12, 0));
    for (row, right) in table.rows().zip(whole.rows()) {
        match row.number() {
            200 => assert_eq!(row.error(), Some(("panic", "panicked: row 200 is bad"))),
            n if n % 37 == 5 => {
                let (kind, sentence) = row.error().expect("a failure");
                assert_eq!(kind, "start");
                assert!(sentence.contains("entry 0 of the point is NaN"), "{sentence}");
            }
            _ => assert_eq!(row.end(), right.end()),
        }
    }
    let text = table.to_string();
    assert!(text.contains("400 rows, 12 failed (panic: 1, start: 11)"), "{text}");
}

#[test]
fn a_row_whose_step_fails_has_the_steps_before() {
    // A mass falls into the centre of its force after a time of √(π/2) q₀.
    let closure = |row: &Row| {
        let system = oscillator([1.0; 2], 0.0, true)?;
        let start = vector![row["q"], 0.0, 0.0];
        Ok(WeylMidpoint.run(&system, start, Span::steps(0.01, 500).at_most(2))?)
    };
    let table = Sweep::new("fall").grid("q", [1.0, 2.0]).run(closure).quiet().execute();
    let table = table.expect("two rows");
    assert_eq!(table.failed(), 2);
    for row in table.rows() {
        let fall = std::f64::consts::FRAC_PI_2.sqrt() * row.parameters()[0];
        let (kind, sentence) = row.error().expect("a failure");
        println!("{kind}: {sentence}");
        assert!(kind != "run" && sentence.contains("steps were taken"), "{kind}: {sentence}");
        let time = row.get("run.t").expect("a time");
        assert!((time - fall).abs() < 0.2 && time > 0.5, "{time} of {fall}");
        assert_eq!(row.get("run.steps"), Some((time / 0.01).round()));
        assert_eq!(row.end(), [0.0; 0]);
    }
}

// The children: this program again, with a task in its environment.

const TASK: &str = "METRIPLECTIC_TEST_TASK";
const FILE: &str = "METRIPLECTIC_TEST_FILE";
const ROWS: &str = "METRIPLECTIC_TEST_ROWS";

/// A child that does a task with a file.
fn child(task: &str, file: &Path) -> Command {
    let mut child = Command::new(std::env::current_exe().expect("a test has a path"));
    child.args(["--exact", "a_task_of_a_child", "--nocapture"]).env(TASK, task).env(FILE, file);
    child.stdout(Stdio::piped()).stderr(Stdio::piped());
    child
}

/// A row of two milliseconds.
fn slowly(row: &Row) -> Result<Trajectory<LieDual<3>>, Error> {
    std::thread::sleep(Duration::from_millis(2));
    relaxing(row)
}

/// Three rows of which end their process: at once, and after the others have begun.
const ABORTING: [usize; 3] = [0, 123, 399];

fn aborts(row: &Row) -> Result<Trajectory<LieDual<3>>, Error> {
    if ABORTING.contains(&row.number()) {
        std::process::abort();
    }
    relaxing(row)
}

/// A row of many steps with outputs and an event.
fn long_row(row: &Row) -> Result<metriplectic::ensembles::Record<LieDual<3>>, Error> {
    let span = Span::steps(0.05, 20_000).output_every(1.3).event("node", |p: &Vector3<f64>| p.y);
    // So little friction that the body turns over and over.
    let start = vector![row["spin"], -1.0, 0.3];
    row.run_long(Scheme::new(WeylMidpoint), &body(1e-9)?, start, span)
}

type LongClosure = fn(&Row) -> Result<metriplectic::ensembles::Record<LieDual<3>>, Error>;

fn long_runs() -> Runs<'static, LieDual<3>, LongClosure> {
    let plan = Sweep::new("long").grid("spin", [0.1, 0.2]);
    plan.run(long_row as LongClosure)
        .observe("p₁", |p| p.x)
        .measure("nodes", |run| run.events().len() as f64)
        .measure("last node", |run| run.events().last().map_or(f64::NAN, |e| e.state.time))
        .checkpoint_every(Duration::from_millis(1))
        .quiet()
}

fn long_rows(journal: Option<&Path>) -> Result<Table, SweepError> {
    match journal {
        Some(journal) => long_runs().journal(journal).retry_failed().execute(),
        None => long_runs().execute(),
    }
}

#[test]
fn a_task_of_a_child() {
    let Ok(task) = std::env::var(TASK) else { return };
    let file = PathBuf::from(std::env::var_os(FILE).expect("a file"));
    let outcome = match task.as_str() {
        "slow" => runs(plan("kill"), slowly).journal(&file).threads(2).execute(),
        "long" => long_rows(Some(&file)),
        "lasting" => {
            let lasting: Closure = |row| {
                std::thread::sleep(Duration::from_secs(30));
                relaxing(row)
            };
            runs(plan("kill"), lasting).journal(&file).threads(2).execute()
        }
        "abort" => runs(plan("abort"), aborts).journal(&file).threads(2).execute(),
        "abort again" => {
            let runs = runs(plan("abort"), aborts).journal(&file).threads(2);
            runs.retry_failed().execute()
        }
        "full" => runs(plan("full"), relaxing).journal(&file).execute(),
        "export" => {
            let table = runs(plan("full"), relaxing).execute().expect("all rows");
            let error = table.csv(&file).unwrap_err();
            println!("export failed: {error}");
            return;
        }
        "merge" => loop {
            let table = Table::merge(Table::journals(&file).expect("files")).expect("a table");
            table.csv(file.with_file_name("table.csv")).expect("a file");
        },
        "memory" => {
            let rows = std::env::var(ROWS).expect("a number").parse().expect("a number");
            many_rows(rows, &file);
            let status = fs::read_to_string("/proc/self/status").expect("a status");
            let line = status.lines().find(|line| line.starts_with("VmHWM:")).expect("a line");
            return println!("{line}");
        }
        other => panic!("no task {other}"),
    };
    match outcome {
        Ok(table) => println!("finished {}", table.len()),
        Err(SweepError::Interrupted { table, journal }) => {
            println!("interrupted after {} {journal}", table.len());
        }
        Err(error) => println!("error: {error}; rows {}", error.table().map_or(0, Table::len)),
    }
}

/// Rows of 400 recorded states, of which the table has the last.
fn many_rows(rows: usize, journal: &Path) {
    let body = body(0.4).expect("a body");
    let body = body.verified(&vector![0.4, -1.0, 0.3]).expect("a model");
    let plan = Sweep::new("many").samples(rows).random("spin", |draw| draw.uniform(-1.0..1.0));
    let closure = |row: &Row| {
        let start = vector![row["spin"], -1.0, 0.3];
        Ok(WeylMidpoint.run(&body, start, Span::steps(0.01, 400))?)
    };
    let runs = plan.run(closure).measure("p₁", |run| run.last().point.x).quiet();
    let table = runs.journal(journal).threads(2).execute().expect("all rows");
    assert_eq!((table.len(), table.failed()), (rows, 0));
}

/// Waits until a journal has so many lines.
fn wait_for(child: &mut Child, journal: &Path, lines: usize) {
    let begun = Instant::now();
    loop {
        let found = fs::read(journal).unwrap_or_default();
        if found.iter().filter(|&&byte| byte == b'\n').count() >= lines {
            return;
        }
        assert!(child.try_wait().expect("a child").is_none(), "the child has ended");
        assert!(begun.elapsed() < Duration::from_secs(60), "the child does nothing");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").args([name, &child.id().to_string()]).status();
    assert!(status.expect("kill starts").success());
}

#[test]
#[cfg(unix)]
fn a_killed_sweep_goes_on_and_has_the_same_bytes() {
    let journal = folder("killed").join("sweep.journal");
    let whole = runs(plan("kill"), relaxing).execute().expect("all rows");
    let mut killed = child("slow", &journal).spawn().expect("it starts");
    wait_for(&mut killed, &journal, 68);
    // Another process may not write to it meanwhile.
    let busy = runs(plan("kill"), relaxing).journal(&journal).execute().unwrap_err();
    assert!(matches!(busy, SweepError::Journal(JournalError::InUse { .. })), "{busy}");
    signal(&killed, "-KILL");
    killed.wait().expect("it ends");
    // The last line is torn.
    let left = fs::read(&journal).expect("a journal");
    fs::write(&journal, &left[..left.len() - 7]).expect("written");
    let known = Table::merge([&journal]).expect("a table");
    assert!((60..400).contains(&known.len()) && known.damaged_lines() == 1, "{}", known.len());
    // The rows in hand are passed over, since one of them might have killed the process.
    let passed = runs(plan("kill"), relaxing).journal(&journal).execute().expect("all rows");
    let rows = passed.passed_over();
    assert!(rows.len() <= 2 && passed.failed() == rows.len() && passed.len() == 400, "{passed}");
    let runs_again = || runs(plan("kill"), relaxing).journal(&journal).retry_failed();
    let resumed = runs_again().execute().expect("all rows");
    assert!(bytes(&resumed) == bytes(&whole));
    let killed = "the table without a kill, after `kill -9` and a torn line";
    claim("400 relaxing bodies", killed, "the same bytes", "the same bytes");
    let again = runs(plan("kill"), |_| panic!("no row is left")).journal(&journal).execute();
    assert!(bytes(&again.expect("all rows")) == bytes(&whole));
    let lines = fs::read_to_string(&journal).expect("text").lines().count();
    assert_eq!(
        lines,
        1 + 400 + 1 + rows.len(),
        "the header, the rows, those passed over, the torn line"
    );
}

/// Two signals end a process in an orderly way, although rows are in hand: nobody suspects them.
#[test]
#[cfg(unix)]
fn rows_that_a_second_signal_has_ended_are_run_the_next_time() {
    let folder = folder("twice");
    let journal = folder.join("sweep.journal");
    let running = folder.join("sweep.journal.running");
    let mut lasting = child("lasting", &journal).spawn().expect("it starts");
    let in_hand = || fs::read_to_string(&running).is_ok_and(|text| text.contains(" 1 "));
    let begun = Instant::now();
    while !in_hand() {
        assert!(begun.elapsed() < Duration::from_secs(60), "the child begins no row");
    }
    while lasting.try_wait().expect("a child").is_none() {
        assert!(begun.elapsed() < Duration::from_secs(25), "it is not ended");
        signal(&lasting, "-INT");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(lasting.wait().expect("it has ended").code(), Some(130));
    assert!(!running.exists());
    let resumed = runs(plan("kill"), relaxing).journal(&journal).execute().expect("all rows");
    assert_eq!((resumed.len(), resumed.failed()), (400, 0));
}

/// A process is ended by a row of its own, again and again: each start passes over it, and the others are run.
#[test]
fn a_row_that_ends_its_process_is_passed_over_and_named() {
    let folder = folder("abort");
    let journal = folder.join("sweep.journal");
    let whole = runs(plan("abort"), relaxing).execute().expect("all rows");
    let start = |task: &str| {
        let output = child(task, &journal).output().expect("it starts");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        text.lines().find(|line| line.starts_with("finished")).map(str::to_owned)
    };
    let begun = (0..20).find_map(|n| start("abort").map(|line| (n, line)));
    // Two threads: a row may be in hand beside the one that ends the process.
    let (deaths, line) = begun.expect("it finishes");
    assert!((1..=ABORTING.len()).contains(&deaths), "{deaths}");
    assert!(line.starts_with("finished 400"), "{line}");
    let table = Table::merge([&journal]).expect("a table").complete().expect("all rows");
    let passed = table.passed_over();
    assert!(ABORTING.iter().all(|row| passed.contains(row)) && passed.len() <= 6, "{passed:?}");
    assert_eq!(table.failed(), passed.len());
    for (row, right) in table.rows().zip(whole.rows()) {
        if passed.contains(&row.number()) {
            assert_eq!((row.status(), row.outcome()), (RowStatus::PassedOver, "killed"));
            assert_eq!((row.parameters(), row.end().len()), (right.parameters(), 0));
            assert!(row.error().is_some_and(|(_, sentence)| sentence.contains("retry_failed")));
        } else {
            assert_eq!((row.status(), row.end()), (RowStatus::Done, right.end()));
        }
    }
    let text = table.to_string();
    assert!(text.contains("passed over:") && text.contains("123"), "{text}");
    assert!(csv(&table).lines().any(|line| line.starts_with("123,") && line.contains(",killed,")));
    // They are tried again one at a time, those that have ended a process more often last: so the rows that were in hand by
    // chance are done after as many starts as there are others.
    for _ in ABORTING {
        assert_eq!(start("abort again"), None, "it is ended again");
    }
    let left = runs(plan("abort"), |_| panic!("no row is left")).journal(&journal).execute();
    let left = left.expect("the rows of the journal");
    assert_eq!((left.passed_over(), left.failed()), (ABORTING.to_vec(), 3));
    // A model that is mended has all rows, and no journal or file is left behind but one.
    let mended = runs(plan("abort"), relaxing).journal(&journal).retry_failed();
    assert!(bytes(&mended.execute().expect("all rows")) == bytes(&whole));
    let again = runs(plan("abort"), |_| panic!("no row is left")).journal(&journal);
    assert!(bytes(&again.retry_failed().execute().expect("all rows")) == bytes(&whole));
    assert_eq!(fs::read_dir(&folder).expect("a folder").count(), 1);
}

#[test]
fn rows_that_failed_are_run_again_on_demand_alone() {
    let journal = folder("retry").join("sweep.journal");
    let whole = runs(plan("retry"), relaxing).execute().expect("all rows");
    let failing = runs(plan("retry"), some_fail).journal(&journal).execute().expect("all rows");
    assert_eq!(failing.failed(), 12);
    let same = runs(plan("retry"), |_| panic!("no row is left")).journal(&journal).execute();
    assert!(bytes(&same.expect("all rows")) == bytes(&failing));
    // Those that fail again are rows that failed, and others that are mended are done.
    let half: Closure = |row| if row.number() < 200 { relaxing(row) } else { some_fail(row) };
    let half = runs(plan("retry"), half).journal(&journal).retry_failed().execute();
    assert_eq!(half.expect("all rows").failed(), 6);
    let merged = Table::merge([&journal, &journal]).expect("a table");
    assert_eq!((merged.len(), merged.failed(), merged.damaged_lines()), (400, 6, 0));
    // In shards too, each of which runs its own.
    for index in 0..3 {
        let shard = Shard::new(index, 3).expect("a shard");
        let sharded = |closure| runs(plan("retry"), closure).journal(&journal).shard(shard);
        let failed = sharded(some_fail as Closure).execute().expect("rows").failed();
        let again = sharded(relaxing).retry_failed().execute().expect("rows");
        assert!(failed > 0 && again.failed() == 0 && again.len() < 135);
    }
    let last = runs(plan("retry"), relaxing).journal(&journal).retry_failed().execute();
    assert!(bytes(&last.expect("all rows")) == bytes(&whole));
    let all = Table::merge(Table::journals(&journal).expect("files")).expect("a table");
    assert!(bytes(&all) == bytes(&whole));
}

#[test]
fn samples_are_added_and_the_rows_so_far_stay() {
    let folder = folder("more");
    let journal = folder.join("sweep.journal");
    let small = || {
        Sweep::new("more")
            .grid("friction", [0.1, 0.2, 0.3])
            .samples(4)
            .random("spin", |draw| draw.uniform(-1.0..1.0))
    };
    let first = runs(small(), relaxing).journal(&journal).execute().expect("rows");
    let before = fs::read_to_string(&journal).expect("text");
    let refuses: Closure = |row| {
        assert!(row.number() >= 12, "row {} is run again", row.number());
        relaxing(row)
    };
    let more = |n: usize| runs(small().more_samples(n), refuses).journal(&journal).execute();
    let [five, eight] = [more(5), more(8)].map(|table| table.expect("rows"));
    assert_eq!((five.len(), eight.len(), eight.planned(), eight.failed()), (27, 36, 36, 0));
    let lines = |table: &Table| csv(table).lines().map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(lines(&eight)[..28], lines(&five)[..]);
    assert_eq!(lines(&eight)[..13], lines(&first)[..]);
    assert!(fs::read_to_string(&journal).expect("text").starts_with(&before));
    // Each combination of the other factors has the new samples, and no two of them are the same.
    let spins: std::collections::BTreeSet<u64> =
        column(&eight, "spin").iter().map(|x| x.to_bits()).collect();
    assert_eq!(spins.len(), 36);
    for friction in [0.1_f64, 0.2, 0.3] {
        let same = |x: &&f64| x.to_bits() == friction.to_bits();
        assert_eq!(column(&eight, "friction").iter().filter(same).count(), 12);
    }
    // The bytes are those of a sweep that had them from its start, in shards that are merged too.
    let whole = runs(small().more_samples(3).more_samples(5), relaxing).execute().expect("rows");
    assert!(bytes(&whole) == bytes(&eight));
    let merged = Table::merge([&journal]).expect("a table").complete().expect("all rows");
    assert!(bytes(&merged) == bytes(&whole));
    let parts = folder.join("parts.journal");
    for (index, samples) in [(0, 8), (1, 0), (1, 8), (0, 2)] {
        let shard = Shard::new(index, 2).expect("a shard");
        let plan = small().more_samples(samples);
        runs(plan, relaxing).journal(&parts).shard(shard).execute().expect("rows");
    }
    let merged = Table::merge(Table::journals(&parts).expect("files")).expect("a table");
    assert!(bytes(&merged.complete().expect("all rows")) == bytes(&whole));
    // A plan of fewer samples has its own rows of the journal.
    let fewer = more(2).expect("rows");
    assert_eq!((fewer.len(), lines(&fewer)), (18, lines(&eight)[..19].to_vec()));
    // Other plans are refused as before.
    let other = runs(small().seed(1).more_samples(5), relaxing).journal(&journal).execute();
    assert!(matches!(other, Err(SweepError::Journal(JournalError::AnotherSweep { .. }))));
    let cube = Sweep::new("cube").latin_hypercube(4, [("a", 0.0..1.0)]).more_samples(1);
    assert!(matches!(cube.rows(), Err(PlanError::MoreOfAHypercube)));
    let many = Sweep::new("many").samples(2).more_samples(usize::MAX);
    assert!(matches!(many.rows(), Err(PlanError::TooManyRows)));
}

/// A long row ends at the event that stops it, as a run does.
#[test]
fn a_long_row_ends_where_its_run_ends() {
    let [free, fixed] = [Span::until(20.0).tolerance(1e-8).into(), Span::steps(0.05, 400).into()];
    let [every, at]: [fn(Schedule) -> Schedule; 2] =
        [|s| s.output_every(1.0), |s| s.output_at([0.5, 19.0])];
    let stop = |s: Schedule| -> Schedule { s.event("y", |p: &Vector3<f64>| p.y).stop().into() };
    let pass = |s: Schedule| -> Schedule { s.event("y", |p: &Vector3<f64>| p.y).into() };
    let schedules: Vec<Schedule> = [free, fixed]
        .into_iter()
        .flat_map(|span: Schedule| [every(span.clone()), at(span.clone()), span])
        .flat_map(|span| [stop(span.clone()), pass(span.clone()), span])
        .collect();
    let last = schedules.len() - 1;
    let plan = || Sweep::new("ends").grid("schedule", linspace(0.0, last as f64, last + 1));
    let start = vector![0.4, -1.0, 0.3];
    let schedule = |row: &Row| schedules[row.number()].clone();
    let runs = plan().run(|row| Ok(DormandPrince8.run(&body(0.05)?, start, schedule(row))?));
    let long = plan().run(|row| row.run_long(DormandPrince8, &body(0.05)?, start, schedule(row)));
    let [short, long] =
        [runs.quiet().execute(), long.quiet().execute()].map(|table| table.expect("all rows"));
    assert_eq!((short.failed(), long.failed()), (0, 0), "{long}");
    for (a, b) in short.rows().zip(long.rows()) {
        assert_eq!(a.outcome(), b.outcome());
        assert_eq!((a.get("run.t"), a.end()), (b.get("run.t"), b.end()), "row {}", a.number());
        assert!(a.outcome() != "event" || a.end()[1].abs() < 1e-12, "{:?}", a.end());
    }
    assert!(short.rows().filter(|row| row.outcome() == "event").count() == 6);
}

/// A checkpoint of another plan is refused before any row is run, and fails none.
#[test]
#[cfg(unix)]
fn a_checkpoint_of_another_plan_ends_the_sweep_and_no_row() {
    let folder = folder("stale");
    let journal = folder.join("sweep.journal");
    let mut killed = child("long", &journal).spawn().expect("it starts");
    let stale = folder.join("sweep.row-0.checkpoint");
    let begun = Instant::now();
    while !stale.is_file() {
        assert!(begun.elapsed() < Duration::from_secs(60), "the child writes nothing");
    }
    signal(&killed, "-KILL");
    killed.wait().expect("it ends");
    let _ = fs::remove_file(folder.join("sweep.row-1.checkpoint"));
    let bytes_of = fs::read(&stale).expect("a checkpoint");
    // A row that has written a checkpoint since it began goes on from there, and is not passed over.
    let copy = folder.join("copy");
    fs::create_dir(&copy).expect("a folder");
    for name in ["sweep.journal", "sweep.journal.running", "sweep.row-0.checkpoint"] {
        fs::copy(folder.join(name), copy.join(name)).expect("a copy");
    }
    let resumed = long_runs().journal(copy.join("sweep.journal")).execute().expect("all rows");
    assert!(!resumed.passed_over().contains(&0) && resumed.len() == 2, "{resumed}");
    // The model has changed, and the journal is moved away.
    fs::remove_file(&journal).expect("a journal");
    let begin = |tag: &str| {
        let plan = Sweep::new("long").tag(tag).grid("spin", [0.1, 0.2]);
        let short = |row: &Row| {
            let span = Span::steps(0.05, 20);
            row.run_long(
                Scheme::new(WeylMidpoint),
                &body(0.1)?,
                vector![row["spin"], -1.0, 0.3],
                span,
            )
        };
        plan.run(short).journal(&journal).quiet().execute()
    };
    match begin("model 2").unwrap_err() {
        SweepError::Journal(JournalError::Checkpoint { path, changed: false, .. }) => {
            assert_eq!(path, stale);
        }
        other => panic!("{other}"),
    }
    assert_eq!(fs::read(&stale).expect("it is left as it is"), bytes_of);
    assert_eq!(Table::merge([&journal]).expect("a journal").len(), 0, "no row has failed");
    // One that was changed is refused too, by the same plan.
    fs::write(&stale, &bytes_of[..bytes_of.len() / 2]).expect("written");
    let error = begin("model 2").unwrap_err();
    assert!(matches!(error, SweepError::Journal(JournalError::Checkpoint { changed: true, .. })));
    fs::remove_file(&stale).expect("it is there");
    let table = begin("model 2").expect("all rows");
    assert_eq!((table.len(), table.failed()), (2, 0), "{table}");
}

#[test]
#[cfg(unix)]
fn a_merge_that_is_killed_leaves_a_whole_table_or_none() {
    let folder = folder("merged");
    let (journal, file) = (folder.join("sweep.journal"), folder.join("table.csv"));
    for index in 0..3 {
        let shard = Shard::new(index, 3).expect("a shard");
        let runs = runs(plan("merged"), relaxing).journal(&journal).shard(shard);
        runs.execute().expect("the rows of a shard");
    }
    let merged = || Table::merge(Table::journals(&journal).expect("files")).expect("a table");
    let whole = csv(&merged());
    let parts = || {
        let names =
            fs::read_dir(&folder).expect("a folder").map(|entry| entry.expect("one").path());
        names.filter(|path| path.extension().is_some_and(|e| e == "part")).collect::<Vec<_>>()
    };
    for round in 0..20 {
        let mut killed = child("merge", &journal).spawn().expect("it starts");
        let begun = Instant::now();
        while parts().is_empty() {
            assert!(begun.elapsed() < Duration::from_secs(60), "the child writes nothing");
        }
        std::thread::sleep(Duration::from_micros(100 * (round % 4)));
        signal(&killed, "-KILL");
        killed.wait().expect("it ends");
        assert!(!file.exists() || fs::read_to_string(&file).expect("text") == whole);
        if !parts().is_empty() {
            break;
        }
    }
    // A part that a kill has left is no journal, and a process of its number writes over it.
    let left = parts().len();
    let own = folder.join(format!("table.csv.{}.part", std::process::id()));
    fs::write(&own, whole.repeat(2)).expect("written");
    fs::write(folder.join("sweep.1.journal.77.part"), "torn").expect("written");
    assert!(left > 0, "no kill has left a part");
    assert_eq!(csv(&merged()), whole);
    merged().csv(&file).expect("a file");
    assert_eq!(fs::read_to_string(&file).expect("text"), whole);
    assert!(!own.exists() && parts().len() == left + 1);
    assert_eq!(csv(&merged().complete().expect("all rows")), whole);
}

#[test]
#[cfg(target_os = "linux")]
fn the_memory_of_a_sweep_grows_by_the_rows_of_its_table_alone() {
    let folder = folder("memory");
    let [few, many] = [500, 3500].map(|rows: usize| {
        let mut child = child("memory", &folder.join(format!("{rows}.journal")));
        let output = child.env(ROWS, rows.to_string()).output().expect("it starts");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let line = text.lines().find(|line| line.contains("VmHWM:"));
        let line = line.unwrap_or_else(|| panic!("{text}{:?}", output.stderr));
        let number = line.split_whitespace().rev().nth(1).and_then(|n| n.parse::<f64>().ok());
        number.expect("kilobytes") * 1024.0
    });
    let row = (many - few) / 3000.0;
    println!("{few} bytes, and {row:.0} for each further row");
    let process = "the largest resident memory of the process, for 3500 rows and for 500";
    // The number itself is not the same in each run.
    claim("rows of 400 recorded states", process, "< 1000 bytes a row", "1000");
    // A trajectory of 400 states has more than thirty thousand bytes.
    assert!(row < 1000.0, "{row} bytes a row");
}

#[test]
#[cfg(unix)]
fn a_signal_ends_a_sweep_after_the_rows_in_hand() {
    for (name, stop) in [("interrupt", "-INT"), ("terminate", "-TERM")] {
        let journal = folder(name).join("sweep.journal");
        let mut asked = child("slow", &journal).spawn().expect("it starts");
        wait_for(&mut asked, &journal, 30);
        signal(&asked, stop);
        let output = asked.wait_with_output().expect("it ends");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{text}");
        let known = Table::merge([&journal]).expect("a table");
        assert_eq!(known.damaged_lines(), 0);
        assert!(text.contains(&format!("interrupted after {} true", known.len())), "{text}");
        let resumed = runs(plan("kill"), relaxing).journal(&journal).execute().expect("all rows");
        assert_eq!(resumed.len(), 400);
    }
}

#[test]
#[cfg(unix)]
fn a_long_row_goes_on_from_its_checkpoint_with_the_same_bits() {
    let folder = folder("long");
    let journal = folder.join("sweep.journal");
    let whole = long_rows(None).expect("all rows");
    assert!(column(&whole, "nodes").iter().all(|n| *n > 20.0));
    let is_there = || (0..2).any(|n| folder.join(format!("sweep.row-{n}.checkpoint")).is_file());
    let mut stopped = 0;
    for round in 0..200 {
        let mut run = child("long", &journal).spawn().expect("it starts");
        let begun = Instant::now();
        // It is put down by either signal once it has a checkpoint.
        let pause = Duration::from_millis(10);
        while run.try_wait().expect("a child").is_none() {
            if begun.elapsed() > pause && is_there() {
                signal(&run, if round % 2 == 0 { "-KILL" } else { "-INT" });
                stopped += 1;
                break;
            }
        }
        let output = run.wait_with_output().expect("it ends");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        if text.contains("finished 2") {
            break;
        }
        if stopped > 6 {
            break;
        }
    }
    let resumed = long_rows(Some(&journal)).expect("all rows");
    assert!(stopped > 0, "the child was too fast");
    assert!(csv(&resumed) == csv(&whole), "{}\n{}", csv(&resumed), csv(&whole));
    assert!(bytes(&resumed) == bytes(&whole));
    assert!(!is_there(), "the checkpoints of rows in the journal are removed");
}

#[test]
#[cfg(unix)]
fn a_full_disk_is_an_error_that_keeps_the_rows() {
    let folder = folder("full");
    let limited = |task: &str, file: &Path| {
        let child = child(task, file);
        let program = child.get_program().to_string_lossy().into_owned();
        let mut shell = Command::new("sh");
        // A file may have 32 blocks of 512 bytes, and a longer one is an error and no signal.
        let script = format!(
            "trap '' XFSZ; ulimit -f 32; exec '{program}' --exact a_task_of_a_child --nocapture"
        );
        shell.args(["-c", &script]).env(TASK, task).env(FILE, file);
        let output = shell.output().expect("sh starts");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let journal = folder.join("sweep.journal");
    let text = limited("full", &journal);
    let known = Table::merge([&journal]).expect("a table");
    println!("{text} {} rows", known.len());
    assert!(text.contains("error: the journal") && text.contains("rows are kept"), "{text}");
    assert!(known.len() > 5 && known.len() < 400 && known.damaged_lines() <= 1);
    // With room it goes on.
    let whole = runs(plan("full"), relaxing).execute().expect("all rows");
    let resumed = runs(plan("full"), relaxing).journal(&journal).execute().expect("all rows");
    assert!(bytes(&resumed) == bytes(&whole));
    // A table that cannot be written leaves the one that was there.
    let file = folder.join("table.csv");
    fs::write(&file, "precious").expect("written");
    let text = limited("export", &file);
    assert!(text.contains("export failed"), "{text}");
    assert_eq!(fs::read_to_string(&file).expect("text"), "precious");
    assert_eq!(fs::read_dir(&folder).expect("a folder").count(), 2);
}

#[test]
fn a_journal_of_another_sweep_is_refused_and_left_as_it_is() {
    let journal = folder("another").join("sweep.journal");
    let small = |values: [f64; 2]| Sweep::new("small").grid("friction", values).grid("spin", [0.1]);
    let first = runs(small([0.1, 0.2]), relaxing).journal(&journal).execute().expect("rows");
    assert_eq!(first.len(), 2);
    let before = fs::read(&journal).expect("a journal");
    let refused = |error: SweepError| match error {
        SweepError::Journal(JournalError::AnotherSweep { found, expected, .. }) => {
            assert_ne!(found, expected);
        }
        other => panic!("{other}"),
    };
    let with = |plan: Sweep| runs(plan, relaxing).journal(&journal).execute().unwrap_err();
    refused(with(small([0.1, 0.3])));
    refused(with(small([0.1, 0.2]).seed(7)));
    refused(with(small([0.1, 0.2]).tag("model 2")));
    refused(with(small([0.1, 0.2]).random("x", |draw| draw.uniform(0.0..1.0))));
    let other = runs(small([0.1, 0.2]), relaxing).observe("p₂", |p| p.y).journal(&journal);
    refused(other.execute().unwrap_err());
    // A random column that draws other numbers.
    let drawn = |end: f64| {
        Sweep::new("drawn")
            .samples(3)
            .random("spin", move |draw| draw.uniform(0.0..end))
            .grid("friction", [0.1])
    };
    let random = journal.with_file_name("random.journal");
    runs(drawn(1.0), relaxing).journal(&random).execute().expect("rows");
    refused(runs(drawn(2.0), relaxing).journal(&random).execute().unwrap_err());
    assert_eq!(fs::read(&journal).expect("a journal"), before);
    let mixed = Table::merge([&journal, &random]).unwrap_err();
    assert!(matches!(mixed, JournalError::AnotherSweep { .. }), "{mixed}");
    // Files that are no journals.
    let text = journal.with_file_name("notes.txt");
    fs::write(&text, "my notes\n").expect("written");
    let error = runs(small([0.1, 0.2]), relaxing).journal(&text).execute().unwrap_err();
    assert!(matches!(error, SweepError::Journal(JournalError::NotAJournal { .. })), "{error}");
    assert_eq!(fs::read_to_string(&text).expect("text"), "my notes\n");
    let error = runs(small([0.1, 0.2]), relaxing).journal("/dev/full").execute();
    assert!(matches!(error, Err(SweepError::Journal(JournalError::NotAFile { .. }))));
    assert!(matches!(Table::merge::<&Path>([]), Err(JournalError::None)));
}

#[test]
fn a_shortened_journal_loses_the_rows_of_its_bytes_and_no_other() {
    let folder = folder("shortened");
    let journal = folder.join("sweep.journal");
    let small = || Sweep::new("small").grid("friction", [0.1, 0.2, 0.3]).grid("spin", [0.1, 0.4]);
    let whole = runs(small(), relaxing).threads(1).journal(&journal).execute().expect("rows");
    let full = fs::read(&journal).expect("a journal");
    let part = folder.join("part.journal");
    for end in (0..full.len()).rev().step_by(3) {
        fs::write(&part, &full[..end]).expect("written");
        let ends = full[..end].iter().filter(|&&byte| byte == b'\n').count();
        match Table::merge([&part]) {
            Ok(table) => assert_eq!(table.len(), ends - 1, "{end} bytes"),
            Err(JournalError::NotAJournal { .. }) => assert_eq!(ends, 0),
            Err(other) => panic!("{other}"),
        }
        if end % 17 == 0 {
            let resumed = runs(small(), relaxing).journal(&part).execute().expect("rows");
            assert!(bytes(&resumed) == bytes(&whole), "{end} bytes");
        }
    }
}

#[test]
fn two_journals_that_contradict_each_other_are_named_with_the_row() {
    let folder = folder("contradiction");
    let [one, two] = ["one.journal", "two.journal"].map(|name| folder.join(name));
    let small = || Sweep::new("small").grid("friction", [0.1, 0.2, 0.3]).grid("spin", [0.1]);
    runs(small(), relaxing).journal(&one).execute().expect("rows");
    let closure: Closure =
        |row| relaxing_in(row, 40, if row.number() == 1 { 0.1_f64.next_up() } else { 0.1 });
    runs(small(), closure).journal(&two).execute().expect("rows");
    match Table::merge([&one, &two]) {
        Err(JournalError::Contradiction { row: 1, first, second }) => {
            assert_eq!((first, second), (one.clone(), two));
        }
        other => panic!("{other:?}"),
    }
    // The same rows twice agree, whatever time they took.
    let copy = folder.join("copy.journal");
    runs(small(), relaxing).journal(&copy).execute().expect("rows");
    assert_eq!(Table::merge([&one, &copy]).expect("a table").len(), 3);
}

#[test]
fn a_sweep_in_other_units_has_the_same_steps_and_scaled_bits() {
    // A molecule in units of length and energy that are powers of two: 2⁻³³ m, 2⁻⁶⁰ J and beyond.
    let closure = |row: &Row| {
        let (l, e) = (row["length"], row["energy"]);
        let system = oscillator([l, e], 0.2, false)?;
        let start = vector![l, row["kick"] * e / l, 0.0];
        Ok(DormandPrince5.run(&system, start, Span::until(5.0).tolerance(1e-6).at_most(2))?)
    };
    let sweep = Sweep::new("units")
        .listed(
            ["length", "energy"],
            [[1.0, 1.0], [2_f64.powi(-33), 2_f64.powi(-60)], [1024.0, 2_f64.powi(80)]],
        )
        .grid("kick", [0.1, 0.7, -0.4]);
    let table = sweep.run(closure).quiet().execute().expect("all rows");
    assert_eq!(table.failed(), 0, "{table}");
    let scaled = |row: TableRow<'_>| {
        let [l, e] = ["length", "energy"].map(|name| row.get(name).expect("a unit"));
        let [q, p, s] = *row.end() else { panic!("three entries") };
        let figures = [
            "run.steps",
            "run.rejected",
            "run.t",
            "run.energy_error",
            "run.local_error",
            "run.stiff",
        ];
        let figures = figures.map(|name| row.get(name).expect("a figure").to_bits());
        ([q / l, p * l / e, s / e].map(f64::to_bits), figures)
    };
    let rows: Vec<_> = table.rows().map(scaled).collect();
    assert_eq!(rows[..3], rows[3..6]);
    assert_eq!(rows[..3], rows[6..]);
    assert_ne!(rows[0], rows[1]);
}

#[test]
fn a_stiff_row_ends_and_says_so() {
    let closure = |row: &Row| {
        let system = oscillator([1.0; 2], row["friction"], false)?;
        Ok(WeylMidpoint.run(&system, vector![1.0, 0.5, 0.0], Span::steps(0.2, 50).at_most(2))?)
    };
    let sweep = Sweep::new("run.stiff").grid("friction", [0.1, 1.0, 1e7]);
    let table = sweep.run(closure).quiet().execute().expect("all rows");
    assert_eq!(column(&table, "run.stiff"), [0.0, 0.0, 1.0], "{table}");
    assert!(column(&table, "run.resolved")[2].abs() < 0.5);
    assert!(column(&table, "run.energy_error").iter().all(|error| *error <= 50.0 * f64::EPSILON));
    assert!(table.to_string().contains("friction is not damped in 1 rows: 2"), "{table}");
}

#[test]
fn means_and_quantiles_in_time_are_those_of_the_rows() {
    let table = runs(plan("time"), some_fail).execute().expect("all rows");
    let all: Vec<Vec<(f64, f64)>> =
        table.rows().filter_map(|row| Some(row.series("p₁")?.collect())).collect();
    assert_eq!(all.len(), 388);
    let quantiles = table.quantiles("p₁", [0.0, 0.05, 0.5, 1.0]).expect("in time");
    assert_eq!(quantiles.names(), ["t", "q0.0", "q0.05", "q0.5", "q1.0"]);
    let means = table.mean("p₁").expect("in time");
    assert_eq!((means.rows().len(), quantiles.rows().len()), (5, 5));
    for (k, (row, mean)) in quantiles.rows().iter().zip(means.rows()).enumerate() {
        let mut values: Vec<f64> = all.iter().map(|series| series[k].1).collect();
        values.sort_by(f64::total_cmp);
        let n = values.len() as f64;
        // 0.05 · 387 = 19.35 and 0.5 · 387 = 193.5.
        let expected = [
            all[0][k].0,
            values[0],
            0.65 * values[19] + 0.35 * values[20],
            0.5 * (values[193] + values[194]),
            values[387],
        ];
        assert!(row.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-13), "{row:?}");
        let average = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - average).powi(2)).sum::<f64>() / (n - 1.0);
        assert!((mean[1] - average).abs() < 1e-14 && mean[0].to_bits() == row[0].to_bits());
        assert!((mean[2] / (variance / n).sqrt() - 1.0).abs() < 1e-12, "{mean:?}");
    }
    assert!(matches!(table.mean("friction"), Err(TableError::NotInTime { .. })));
    assert!(matches!(table.mean("p₉"), Err(TableError::NoColumn { .. })));
    assert!(matches!(table.quantiles("p₁", [1.5]), Err(TableError::Probability { .. })));
    let closure: Closure = |row| relaxing_in(row, 40 + 4 * (row.number() % 2), 0.1);
    let uneven = runs(plan("time"), closure).execute().expect("all rows");
    let error = uneven.mean("p₁").unwrap_err();
    assert_eq!(error, TableError::Times { first: 0, second: 1 });
}

#[test]
fn a_table_is_read_back_from_its_files() {
    let folder = folder("files");
    let table = runs(plan("files"), some_fail).execute().expect("all rows");
    let [text, array, rows] = ["t.csv", "t.npy", "rows.csv"].map(|name| folder.join(name));
    table.csv(&text).expect("written");
    table.npy(&array).expect("written");
    let text = fs::read_to_string(&text).expect("text");
    let heads: Vec<&str> = text.lines().next().expect("names").split(',').collect();
    assert_eq!(heads[..4], ["row", "friction", "spin", "outcome"]);
    assert_eq!(heads[heads.len() - 3..], ["|p|", "p₁", "error"]);
    let numbers: Vec<u64> = text
        .lines()
        .skip(1)
        .map(|line| {
            line.split(',').nth(2).expect("a spin").parse::<f64>().expect("a number").to_bits()
        })
        .collect();
    assert!(numbers.into_iter().eq(column(&table, "spin").into_iter().map(f64::to_bits)));
    // An array has its rows after a header that is a multiple of 64 bytes.
    let bytes = fs::read(&array).expect("bytes");
    let names = table.names();
    let header = bytes.len() - 400 * names.len() * 8;
    assert!(header.is_multiple_of(64) && bytes.starts_with(b"\x93NUMPY"));
    let first = bytes[header + 16..header + 24].try_into().expect("eight bytes");
    assert_eq!(f64::from_le_bytes(first).to_bits(), column(&table, "spin")[0].to_bits());
    // The rows of a file are those of the plan.
    fs::write(&rows, "friction, \"spin\"\r\n0.1,-0.5\r\n\r\n1e-1,0.25\r\n").expect("written");
    let listed = Sweep::new("listed").rows_of(&rows).expect("rows");
    assert_eq!((listed.rows().expect("rows"), listed.row(1).expect("a row")["spin"]), (2, 0.25));
    for (bad, line) in [("a,b\n1\n", 2), ("a\n1\nx\n", 3), ("a,,b\n", 1), ("", 1)] {
        fs::write(&rows, bad).expect("written");
        let error = Sweep::new("bad").rows_of(&rows).unwrap_err();
        assert!(matches!(&error, PlanError::Cell { line: l, .. } if *l == line), "{error}");
    }
}

#[test]
fn a_plan_without_sense_is_refused() {
    let error = |plan: Sweep| runs(plan, relaxing).execute().unwrap_err().to_string();
    for (plan, says) in [
        (Sweep::new(""), "no name"),
        (Sweep::new("s").grid("friction", []), "`friction` has no values"),
        (Sweep::new("s").samples(0), "no values"),
        (Sweep::new("s").grid("a", [1.0]).grid("a", [2.0]), "two columns"),
        (Sweep::new("s").grid("run.steps", [1.0]), "two columns"),
        (Sweep::new("s").grid("p₁", [1.0]), "two columns"),
        (Sweep::new("s").samples(usize::MAX).samples(2), "more rows"),
        (Sweep::new("s").latin_hypercube(3, [("a", 1.0..0.0)]), "from 1 to 0"),
    ] {
        let found = error(plan);
        assert!(found.contains(says), "{found}");
    }
}

#[test]
fn a_latin_hypercube_has_one_sample_in_each_stratum() {
    let plan = Sweep::new("cube")
        .grid("cell", [0.0, 1.0])
        .latin_hypercube(50, [("a", 0.0..50.0), ("b", -25.0..25.0)]);
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for cell in 0..2 {
        for name in ["a", "b"] {
            let values = (0..50).map(|k| plan.row(50 * cell + k).expect("a row")[name]);
            columns.push(values.map(|x| if name == "b" { x + 25.0 } else { x }).collect());
        }
    }
    for values in &columns {
        let mut strata: Vec<f64> = values.iter().map(|x| x.floor()).collect();
        strata.sort_by(f64::total_cmp);
        assert!(strata.into_iter().eq((0..50).map(f64::from)));
    }
    // No two of them are in the same order.
    let order =
        |values: &Vec<f64>| values.iter().map(|x| x.floor()).map(f64::to_bits).collect::<Vec<_>>();
    for (i, one) in columns.iter().enumerate() {
        assert!(columns[..i].iter().all(|other| order(other) != order(one)));
    }
}

#[test]
fn each_launcher_says_which_shard_a_process_is() {
    let of = |line: &[&str], variables: &[(&str, &str)]| {
        let line: Vec<String> = line.iter().map(|word| (*word).to_owned()).collect();
        let variable = |name: &str| {
            variables.iter().find(|(other, _)| *other == name).map(|(_, value)| (*value).to_owned())
        };
        Shard::of(&line, &variable)
    };
    let shard = |index, count| Shard::new(index, count);
    assert_eq!(of(&["sweep"], &[]), Ok(Shard::WHOLE));
    assert_eq!(of(&["sweep", "--shard", "3/16"], &[("PMI_RANK", "1")]), shard(3, 16));
    assert_eq!(of(&["sweep", "--shard=15/16", "--json"], &[]), shard(15, 16));
    let slurm = [
        ("SLURM_ARRAY_TASK_ID", "7"),
        ("SLURM_ARRAY_TASK_MIN", "1"),
        ("SLURM_ARRAY_TASK_MAX", "16"),
        ("SLURM_ARRAY_TASK_COUNT", "16"),
    ];
    assert_eq!(of(&[], &slurm), shard(6, 16));
    let steps = [
        ("SLURM_ARRAY_TASK_ID", "14"),
        ("SLURM_ARRAY_TASK_MIN", "10"),
        ("SLURM_ARRAY_TASK_MAX", "17"),
        ("SLURM_ARRAY_TASK_STEP", "2"),
        ("SLURM_ARRAY_TASK_COUNT", "4"),
    ];
    assert_eq!(of(&[], &steps), shard(2, 4));
    // Some tasks of an array alone: their places are not known.
    let gaps = [
        ("SLURM_ARRAY_TASK_ID", "3"),
        ("SLURM_ARRAY_TASK_MIN", "3"),
        ("SLURM_ARRAY_TASK_MAX", "7"),
        ("SLURM_ARRAY_TASK_COUNT", "2"),
    ];
    assert!(matches!(
        of(&[], &gaps),
        Err(ShardError::Gaps { count: 2, first: 3, last: 7, step: 1 })
    ));
    // A batch script is rank 0 of all its tasks, but it is the only process.
    assert_eq!(of(&[], &[("SLURM_PROCID", "0"), ("SLURM_NTASKS", "16")]), Ok(Shard::WHOLE));
    assert_eq!(of(&[], &[("SLURM_PROCID", "5"), ("SLURM_STEP_NUM_TASKS", "16")]), shard(5, 16));
    let open = [("OMPI_COMM_WORLD_RANK", "2"), ("OMPI_COMM_WORLD_SIZE", "4"), ("PMI_RANK", "0")];
    assert_eq!(of(&[], &open), shard(2, 4));
    assert_eq!(of(&[], &[("PMI_RANK", "3"), ("PMI_SIZE", "8")]), shard(3, 8));
    assert!(matches!(of(&[], &[("PMI_RANK", "3")]), Err(ShardError::Missing { .. })));
    // An array of parallel programs.
    let both: Vec<_> = slurm.iter().chain(&open).copied().collect();
    assert_eq!(of(&[], &both), shard(6 * 4 + 2, 64));
    for name in ["PBS_ARRAY_INDEX", "PBS_ARRAYID"] {
        assert_eq!(of(&["sweep", "--shards", "16"], &[(name, "9")]), shard(9, 16));
        assert!(matches!(of(&[], &[(name, "9")]), Err(ShardError::NoCount { .. })));
        let last = of(&["--shards=16"], &[(name, "16")]);
        assert_eq!(last, Err(ShardError::Range { index: 16, count: 16 }));
    }
    let engine = [
        ("SGE_TASK_ID", "5"),
        ("SGE_TASK_FIRST", "1"),
        ("SGE_TASK_LAST", "16"),
        ("SGE_TASK_STEPSIZE", "4"),
    ];
    assert_eq!(of(&[], &engine), shard(1, 4));
    let alone = [("SGE_TASK_ID", "undefined"), ("SGE_TASK_FIRST", "undefined")];
    assert_eq!(of(&[], &alone), Ok(Shard::WHOLE));
    for text in ["3", "a/4", "4/4", "", "3/"] {
        assert!(of(&["--shard", text], &[]).is_err(), "{text}");
    }
    assert!(of(&["--shard"], &[]).is_err());
    assert!(matches!(
        of(&[], &[("PMI_RANK", "x"), ("PMI_SIZE", "8")]),
        Err(ShardError::Text { .. })
    ));
}
