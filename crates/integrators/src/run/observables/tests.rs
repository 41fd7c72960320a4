use std::io::SeekFrom;

use super::*;
use metriplectic_manifolds::Euclidean;
use nalgebra::Vector1;

type Line = Euclidean<1>;

fn state(step: usize, x: f64) -> State<Line> {
    let point = Vector1::new(x);
    State { step, time: step as f64, point, energy: 0.0, entropy: -x }
}

const NUMBERS: [f64; 7] =
    [0.1 + 0.2, f64::MIN_POSITIVE, -0.0, 1e300 / 3.0, 5e-324, f64::INFINITY, f64::NAN];

#[test]
fn numbers_survive_a_csv() {
    let watch = Observables::<Line>::new()
        .of("x, \"x\"", |x: &Vector1<f64>| x.x)
        .of_state("S", |state| state.entropy);
    let mut table = watch.csv(Vec::new()).unwrap();
    for (step, x) in NUMBERS.into_iter().enumerate() {
        table.write(&state(step, x)).unwrap();
    }
    let text = String::from_utf8(table.finish().unwrap()).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("t,\"x, \"\"x\"\"\",S"));
    for (step, x) in NUMBERS.into_iter().enumerate() {
        let row: Vec<f64> = lines.next().unwrap().split(',').map(|x| x.parse().unwrap()).collect();
        assert_eq!(row[0].to_bits(), (step as f64).to_bits());
        assert!(
            row[1].to_bits() == x.to_bits() && row[2].to_bits() == (-x).to_bits() || x.is_nan()
        );
    }
    assert_eq!(lines.next(), None);
}

/// The header and the numbers of an array, read by the description of the format
/// (numpy.lib.format).
fn read(bytes: &[u8]) -> (String, Vec<f64>) {
    assert_eq!(&bytes[..6], b"\x93NUMPY");
    let (start, len) = match bytes[6] {
        1 => (10, usize::from(u16::from_le_bytes([bytes[8], bytes[9]]))),
        3 => (12, u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]) as usize),
        other => panic!("version {other}"),
    };
    assert_eq!((start + len) % 64, 0);
    let header = String::from_utf8(bytes[start..start + len].to_vec()).unwrap();
    let numbers = bytes[start + len..].chunks(8);
    (header, numbers.map(|x| f64::from_le_bytes(x.try_into().unwrap())).collect())
}

#[test]
fn an_array_counts_its_rows() {
    for (name, python, version) in [("it's", "it\\'s", 1), ("ω", "ω", 3)] {
        let watch = Observables::<Line>::new().of(name, |x: &Vector1<f64>| x.x);
        let mut table = watch.npy(io::Cursor::new(Vec::new())).unwrap();
        for (step, x) in NUMBERS.into_iter().enumerate() {
            table.write(&state(step, x)).unwrap();
            if step == 2 {
                table.flush().unwrap();
            }
        }
        let bytes = table.finish().unwrap().into_inner();
        assert_eq!(bytes[6], version);
        let (header, numbers) = read(&bytes);
        let expected = format!(
            "{{'descr': [('t', '<f8'), ('{python}', '<f8')], 'fortran_order': False, \
             'shape': (7,), }}"
        );
        assert_eq!(header.trim_end(), expected);
        assert!(header.ends_with('\n'));
        let xs: Vec<_> = numbers.iter().skip(1).step_by(2).map(|x| x.to_bits()).collect();
        assert_eq!(xs, NUMBERS.map(f64::to_bits));
    }
}

/// A writer that shares what it has been given.
#[derive(Clone, Default)]
struct Shared(std::rc::Rc<std::cell::RefCell<Vec<u8>>>);

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn what_is_written_are_whole_rows_at_any_time() {
    let (file, watch) = (Shared::default(), Observables::<Line>::new().of("x", |x| x.x));
    let mut table = watch.csv(file.clone()).unwrap();
    assert_eq!(*file.0.borrow(), b"t,x\n");
    let (mut longest, mut writes) = (0, 0);
    for step in 0..20_000 {
        table.write(&state(step, 0.1 * step as f64)).unwrap();
        let len = file.0.borrow().len();
        assert_eq!(file.0.borrow().last(), Some(&b'\n'));
        (longest, writes) = (len, writes + usize::from(len > longest));
    }
    assert!(writes > 2 && writes < 20, "{writes}");
    drop(table);
    assert_eq!(file.0.borrow().iter().filter(|&&byte| byte == b'\n').count(), 20_001);
}

/// A disk with room for so many bytes.
#[derive(Debug, Default)]
struct Disk {
    file: io::Cursor<Vec<u8>>,
    room: usize,
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let at = usize::try_from(self.file.position()).unwrap_or(usize::MAX);
        let left = self.room.saturating_sub(at);
        match left.min(bytes.len()) {
            0 if !bytes.is_empty() => Err(io::ErrorKind::StorageFull.into()),
            some => self.file.write(&bytes[..some]),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Disk {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// How many rows an error says are in the file.
fn rows_of(error: &io::Error) -> usize {
    assert_eq!(error.kind(), io::ErrorKind::StorageFull, "{error}");
    match error.get_ref().and_then(|source| source.downcast_ref()) {
        Some(ObservablesError::Write { rows, .. }) => *rows,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_full_disk_leaves_rows_that_can_be_read_and_room_to_go_on() {
    let watch = Observables::<Line>::new().of("x", |x: &Vector1<f64>| x.x);
    let whole = |rows: usize| {
        let mut csv = watch.csv(Vec::new()).unwrap();
        let mut npy = watch.npy(io::Cursor::new(Vec::new())).unwrap();
        for step in 0..rows {
            csv.write(&state(step, 0.1 * step as f64)).unwrap();
            npy.write(&state(step, 0.1 * step as f64)).unwrap();
        }
        (csv.finish().unwrap(), npy.finish().unwrap().into_inner())
    };
    let (lines, array) = whole(20);
    for room in 0..array.len() {
        let mut table = match watch.npy(Disk { room, ..Disk::default() }) {
            Ok(table) => table,
            Err(error) => {
                assert!(rows_of(&error) == 0 && room < 128, "{error}");
                continue;
            }
        };
        for step in 0..20 {
            table.write(&state(step, 0.1 * step as f64)).unwrap();
            if step % 7 == 6 {
                let _ = table.flush();
            }
        }
        let error = table.flush().unwrap_err();
        let rows = rows_of(&error);
        let there = table.to.as_ref().unwrap().file.get_ref();
        let (header, numbers) = read(&there[..128 + 16 * rows]);
        assert!(header.contains(&format!("'shape': ({rows},)")), "{header}");
        assert_eq!(numbers.len(), 2 * rows);
        assert_eq!(there[128..128 + 16 * rows], array[128..128 + 16 * rows]);
        // Somebody makes room.
        table.to.as_mut().unwrap().room = usize::MAX;
        assert!(*table.finish().unwrap().file.get_ref() == array, "{room}");
    }
    for room in 0..lines.len() {
        let Ok(mut table) = watch.csv(Disk { room, ..Disk::default() }) else {
            assert!(room < 4);
            continue;
        };
        for step in 0..20 {
            table.write(&state(step, 0.1 * step as f64)).unwrap();
            if step % 7 == 6 {
                let _ = table.flush();
            }
        }
        let rows = rows_of(&table.flush().unwrap_err());
        let there = table.to.as_ref().unwrap().file.get_ref();
        assert_eq!(*there, lines[..room]);
        assert_eq!(there.iter().filter(|&&byte| byte == b'\n').count(), rows + 1);
        table.to.as_mut().unwrap().room = usize::MAX;
        assert!(*table.finish().unwrap().file.get_ref() == lines, "{room}");
    }
}

/// A buffer takes rows for which its disk has no room.
#[test]
fn a_full_disk_behind_a_buffer_does_not_have_the_rows_of_the_buffer() {
    let watch = Observables::<Line>::new().of("x", |x: &Vector1<f64>| x.x);
    let mut csv = watch.csv(Vec::new()).unwrap();
    let rows: Vec<_> = (0..201).map(|step| state(step, 0.1 * step as f64)).collect();
    rows.iter().for_each(|row| csv.write(row).unwrap());
    let lines = csv.finish().unwrap();
    let rooms = [4, lines.len() / 3, lines.len() / 3 + 1, lines.len() / 2, lines.len() - 1];
    for (room, capacity) in rooms.into_iter().zip([1 << 16, 100, 4096, 8, 1]) {
        let buffer = io::BufWriter::with_capacity(capacity, Disk { room, ..Disk::default() });
        let mut table = watch.csv(buffer).unwrap();
        let mut most = 0;
        for (index, row) in rows.iter().enumerate() {
            table.write(row).unwrap();
            if index % 50 == 49
                && let Err(error) = table.flush()
            {
                most = most.max(rows_of(&error));
            }
        }
        let claimed = rows_of(&table.flush().unwrap_err());
        let there = table.to.as_ref().unwrap().get_ref().file.get_ref();
        let whole = there.iter().filter(|&&byte| byte == b'\n').count() - 1;
        assert!(most <= claimed && claimed <= whole, "{claimed} of {whole} rows");
        assert!(whole < 50 || claimed >= 50, "{claimed} of {whole} rows");
        table.to.as_mut().unwrap().get_mut().room = usize::MAX;
        let buffer = table.finish().unwrap();
        assert!(*buffer.get_ref().file.get_ref() == lines, "{room}");
    }
}

#[test]
fn two_columns_of_one_name_are_refused() {
    let twice = Observables::<Line>::new().of("x", |x| x.x).of_state("x", |s| s.entropy);
    let time = Observables::<Line>::new().of("t", |x: &Vector1<f64>| x.x);
    for (watch, name) in [(twice, "x"), (time, "t")] {
        let csv = watch.csv(Vec::new()).map(|_| ()).unwrap_err();
        let npy = watch.npy(io::Cursor::new(Vec::new())).map(|_| ()).unwrap_err();
        for error in [csv, npy] {
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
            let source = error.get_ref().and_then(|source| source.downcast_ref());
            assert!(
                matches!(source, Some(ObservablesError::SameName { name: other }) if other == name)
            );
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_device_without_room_is_an_error() {
    let watch = Observables::<Line>::new().of("x", |x: &Vector1<f64>| x.x);
    let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    assert_eq!(rows_of(&watch.csv(full()).unwrap_err()), 0);
    assert_eq!(rows_of(&watch.npy(full()).unwrap_err()), 0);
}
