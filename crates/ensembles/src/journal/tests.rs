use super::line::{decode, escaped, unescaped};
use super::*;
use crate::entry::{Done, Failed, Outcome};

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

#[test]
fn a_line_gives_back_the_bits_of_its_row() {
    for entry in [done(17), failed(3)] {
        let line = encode(&entry);
        assert_eq!(line.iter().filter(|&&byte| byte == b'\n').count(), 1);
        let read = decode(&line, &header()).unwrap();
        assert!(same_numbers(&entry, &read), "{read:?}");
        assert_eq!((read.number, read.seconds.to_bits()), (entry.number, entry.seconds.to_bits()));
        assert_eq!(read.failed().map(|f| &f.message), entry.failed().map(|f| &f.message));
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
    let later = line.replace("journal 1 ", "journal 2 ");
    let error = Header::parse(later.as_bytes(), path).unwrap_err();
    assert!(matches!(error, JournalError::AnotherVersion { .. }), "{error}");
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
