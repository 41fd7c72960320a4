//! Instructions of one step, counted by callgrind, against a snapshot.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use metriplectic_studies::LogLog;

use crate::{Row, callgrind};

/// A count that differs by more than this fraction from the snapshot is an error.
const ALLOWED: f64 = 0.03;
/// A count is the difference of two runs, so that the start of the program drops out.
const RUNS: [usize; 2] = [100, 300];

/// Takes the steps of one row, alone in its process.
pub(crate) fn count(rows: &[Row], name: &str, steps: usize) {
    for row in rows.iter().filter(|row| row.name == name) {
        std::hint::black_box((row.run)(steps));
    }
}

/// The instructions that callgrind counts in a run of one row.
fn collected(name: &str, steps: usize) -> Option<f64> {
    callgrind::collected(&["--row", name, &steps.to_string()])
}

/// Counts every row and compares the counts with the snapshot, or writes it.
pub(crate) fn compare(rows: &[Row], bless: bool) {
    if !callgrind::is_there() {
        println!("valgrind is not installed: the instructions are not counted");
        return;
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("step/snapshot.txt");
    let known: BTreeMap<String, f64> = std::fs::read_to_string(&path)
        .unwrap_or_default()
        .lines()
        .filter_map(|line| {
            let mut words = line.split_whitespace();
            Some((words.next()?.to_owned(), words.next()?.parse().ok()?))
        })
        .collect();
    let head = "# row, instructions, Newton iterations, calls of the closure: each in one step\n";
    let (mut table, mut worse) = (String::from(head), false);
    let mut rings = Vec::new();
    for row in rows {
        let [few, many] = RUNS.map(|steps| collected(&row.name, steps).expect("callgrind counts"));
        let each = (many - few) / (RUNS[1] - RUNS[0]) as f64;
        let iterations = (row.run)(RUNS[1]).iterations as f64 / RUNS[1] as f64;
        let calls = row.calls.map_or("-".to_owned(), |calls| format!("{calls:.1}"));
        let line = format!("{:32} {each:10.0} {iterations:6.2} {calls:>6}", row.name);
        writeln!(table, "{line}").expect("a string takes it all");
        if let Some(n) = row.name.strip_prefix("step/ring/") {
            rings.push((n.parse::<f64>().expect("a dimension"), each));
        }
        let change = known.get(&row.name).map(|before| each / before - 1.0);
        let change_text = change.map_or("new".to_owned(), |c| format!("{:+.1} %", 100.0 * c));
        println!("{line}  {change_text}");
        worse |= change.is_none_or(|change| change.abs() > ALLOWED);
    }
    if bless {
        std::fs::write(&path, table).expect("the snapshot is written");
        let figure = LogLog::new("A step on Rⁿ", "dimension n", "instructions")
            .series("ring of oscillators", &rings)
            .guide(3.0);
        let figure = figure.save(path.with_file_name("../../docs/gallery/dimension.svg"));
        figure.expect("the figure is written");
    } else {
        assert!(
            !worse,
            "a count has left its band of 3 %: if it should, `just instructions --bless`"
        );
    }
}
