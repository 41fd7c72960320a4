use super::line::{decode, escaped, unescaped};
use super::*;
use crate::entry::{Done, Failed, Outcome, RowStatus};

fn header() -> Header {
    let names = |list: &[&str]| list.iter().map(|name| (*name).to_owned()).collect();
    Header {
        version: "0.1.0".into(),
        plan: 0x1234,
        rows: 100,
        name: "a sweep, of 50 %".into(),
        about: "a sweep: x (3) × y (4), seed 0".into(),
        parameters: names(&["x", "a=b, c"]),
        measures: names(&["flip time"]),
        observables: names(&["p₁", "|p|"]),
    }
}

fn done(number: usize) -> Entry {
    let numbers = [0.0, -0.0, 1.0, f64::NAN, f64::INFINITY, 5e-324, -f64::MAX, 0.1 + 0.2];
    Entry {
        number,
        parameters: [0.1, f64::from_bits(0x7ff8_0000_0000_0001)].into(),
        outcome: Outcome::Done(Done {
            ending: "rest",
            figures: std::array::from_fn(|k| numbers[k % numbers.len()]),
            end: numbers.into(),
            measures: [17.0].into(),
            times: [0.0, 0.5].into(),
            series: [1.0, 2.0, 3.0, 4.0].into(),
        }),
        seconds: 0.25,
    }
}

fn failed(number: usize) -> Entry {
    let message = "entry 0 is NaN | 100 % ~ #7\nand a second line".to_owned();
    let outcome = Outcome::Failed(Failed { kind: "start".into(), message, figures: None });
    Entry { number, parameters: [f64::NAN, 2.0].into(), outcome, seconds: 1e-3 }
}

fn passed_over(number: usize) -> Entry {
    let outcome = Outcome::PassedOver(number);
    Entry { number, parameters: [0.5, -0.0].into(), outcome, seconds: 0.0 }
}

#[test]
fn the_last_line_of_a_row_that_failed_counts_and_a_row_that_is_done_is_not_replaced() {
    let path = std::env::temp_dir().join(format!("settled-{}.journal", std::process::id()));
    let [one, two] = ["1", "2"].map(|n| path.with_extension(n));
    let numbers = |paths: &[&PathBuf]| {
        let paths: Vec<PathBuf> = paths.iter().map(|path| (*path).clone()).collect();
        let content = merged(&paths)?;
        let rows = content.rows.iter().map(|entry| (entry.number, entry.status()));
        assert_eq!(content.damaged, 0);
        Ok::<_, JournalError>(rows.collect::<Vec<_>>())
    };
    let write = |path: &Path, entries: &[Entry]| {
        let lines = entries.iter().flat_map(encode);
        let text: Vec<u8> = header().line().into_bytes().into_iter().chain(lines).collect();
        std::fs::write(path, text).unwrap();
    };
    write(&one, &[failed(1), passed_over(2), done(3), done(1), done(2), done(3), failed(5)]);
    use RowStatus::{Done, Failed, PassedOver};
    let settled = [(1, Done), (2, Done), (3, Done), (5, Failed)];
    assert_eq!(numbers(&[&one]).unwrap(), settled);
    // What one process has passed over another has run; a row that failed here and not there is a contradiction.
    write(&two, &[passed_over(1), passed_over(5), passed_over(7), passed_over(7)]);
    let both = [(1, Done), (2, Done), (3, Done), (5, Failed), (7, PassedOver)];
    assert_eq!(numbers(&[&one, &two]).unwrap(), both);
    assert_eq!(numbers(&[&two, &one]).unwrap(), both);
    write(&two, &[failed(1)]);
    let error = numbers(&[&one, &two]).unwrap_err();
    assert!(matches!(error, JournalError::Contradiction { row: 1, .. }), "{error}");
    write(&two, &[done(1), failed(1)]);
    let error = numbers(&[&two]).unwrap_err();
    assert!(matches!(error, JournalError::Contradiction { row: 1, .. }), "{error}");
    for path in [one, two] {
        std::fs::remove_file(path).unwrap();
    }
}

#[test]
fn a_journal_of_a_plan_that_has_grown_has_its_rows() {
    let path = std::env::temp_dir().join(format!("grown-{}.journal", std::process::id()));
    let grown = Header { rows: 200, about: "more samples".into(), ..header() };
    let (mut journal, _) = Journal::open(&path, &header()).unwrap();
    journal.append(&encode(&done(99))).unwrap();
    drop(journal);
    let (mut journal, content) = Journal::open(&path, &grown).unwrap();
    assert_eq!((content.rows.len(), content.header.rows, content.damaged), (1, 200, 0));
    journal.append(&encode(&done(199))).unwrap();
    drop(journal);
    // The plan as it was before finds its journal too.
    for header in [header(), grown] {
        let (_, content) = Journal::open(&path, &header).unwrap();
        assert_eq!((content.rows.len(), content.header.rows, content.damaged), (2, 200, 0));
    }
    std::fs::remove_file(path).unwrap();
}

#[test]
fn a_line_gives_back_the_bits_of_its_row() {
    for entry in [done(17), failed(3), passed_over(4)] {
        let line = encode(&entry);
        assert_eq!(line.iter().filter(|&&byte| byte == b'\n').count(), 1);
        let read = decode(&line, &header()).unwrap();
        assert!(same_numbers(&entry, &read), "{read:?}");
        assert_eq!((read.number, read.seconds.to_bits()), (entry.number, entry.seconds.to_bits()));
        assert_eq!((read.status(), read.error()), (entry.status(), entry.error()));
    }
}

#[test]
fn a_closed_journal_is_free_though_its_file_is_open_elsewhere() {
    let path = std::env::temp_dir().join(format!("free-{}.journal", std::process::id()));
    let (journal, _) = Journal::open(&path, &header()).unwrap();
    // A process that is just being started shares the open file in this way.
    let elsewhere = journal.file.try_clone().unwrap();
    let busy = Journal::open(&path, &header()).unwrap_err();
    assert!(matches!(busy, JournalError::InUse { .. }), "{busy}");
    journal.finish().unwrap();
    let (journal, _) = Journal::open(&path, &header()).unwrap();
    // A journal that is refused after its lock leaves none either.
    drop(journal);
    let other = Header { plan: 0x4321, ..header() };
    let refused = Journal::open(&path, &other).unwrap_err();
    assert!(matches!(refused, JournalError::AnotherSweep { .. }), "{refused}");
    Journal::open(&path, &header()).unwrap();
    drop(elsewhere);
    std::fs::remove_file(path).unwrap();
}

#[test]
fn no_part_of_a_line_is_a_row() {
    let line = encode(&done(17));
    for end in 0..line.len() {
        assert!(decode(&line[..end], &header()).is_none(), "{end}");
        let mut ended = line[..end].to_vec();
        ended.push(b'\n');
        assert!(decode(&ended, &header()).is_none() || end + 1 == line.len(), "{end}");
    }
}

#[test]
fn a_header_is_read_back_with_its_names() {
    let line = header().line();
    let path = Path::new("a.journal");
    assert_eq!(Header::parse(line.as_bytes(), path).unwrap(), header());
    for end in 0..line.len() {
        let part = Header::parse(&line.as_bytes()[..end], path);
        assert!(matches!(
            part,
            Err(JournalError::NotAJournal { .. } | JournalError::AnotherVersion { .. })
        ));
    }
    for other in ["journal 1 ", "journal 3 "] {
        let other = line.replace("journal 2 ", other);
        let error = Header::parse(other.as_bytes(), path).unwrap_err();
        assert!(matches!(error, JournalError::AnotherVersion { .. }), "{error}");
    }
}

#[test]
fn texts_survive_their_escapes() {
    for text in ["", "plain", "a b,c=d|e#f~g%h\n\t", "%41 %zz %", "Ω → ∞"] {
        let code = escaped(text);
        assert!(!code.contains([' ', ',', '=', '|', '#', '~', '\n']), "{code}");
        assert_eq!(unescaped(&code), text);
    }
}

/// A disk with room for so many bytes.
struct Disk {
    room: usize,
    bytes: Vec<u8>,
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match bytes.len().min(self.room - self.bytes.len()) {
            0 => Err(io::ErrorKind::StorageFull.into()),
            some => self.bytes.write(&bytes[..some]),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_is_an_error_and_keeps_the_whole_rows() {
    let lines: Vec<Vec<u8>> = (0..5).map(|number| encode(&done(number))).collect();
    for room in 0..lines.concat().len() {
        let mut disk = Disk { room, bytes: Vec::new() };
        let taken = lines.iter().take_while(|line| append(&mut disk, line).is_ok()).count();
        assert!(taken < 5);
        let rows = disk.bytes.split_inclusive(|&byte| byte == b'\n');
        let whole = rows.filter(|line| decode(line, &header()).is_some()).count();
        assert_eq!(whole, taken, "room for {room} bytes");
    }
}
