//! Profiles along a lattice, row by row in a file.

use std::io::{self, Seek, SeekFrom, Write};

/// The bytes before the numbers of an array: the format asks for a multiple of 64.
const HEADER: u16 = 128;

/// A file in the format NPY (`numpy.load`) that grows: one row for each snapshot, one column for each site.
///
/// After each row the file is a whole array, so that a run that is interrupted leaves one that can be read.
///
/// ```
/// use std::io::Cursor;
/// use metriplectic_lattices::Profiles;
/// let mut file = Profiles::npy(Cursor::new(Vec::new()), 3)?;
/// file.row([1.0, 2.0, 3.0])?;
/// file.row([4.0, 5.0, 6.0])?;
/// let bytes = file.into_inner().into_inner();
/// assert!(bytes.len() == 128 + 2 * 3 * 8 && bytes[128..136] == 1.0_f64.to_le_bytes());
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct Profiles<W> {
    file: W,
    /// The place in the file at which the array begins.
    start: u64,
    columns: usize,
    rows: u64,
}

impl<W: Write + Seek> Profiles<W> {
    /// Begins an array with so many columns at the current position of the file.
    ///
    /// # Errors
    ///
    /// Returns the errors of the file.
    pub fn npy(mut file: W, columns: usize) -> io::Result<Self> {
        let start = file.stream_position()?;
        let mut profiles = Self { file, start, columns, rows: 0 };
        profiles.header()?;
        Ok(profiles)
    }

    /// Appends a row.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::InvalidInput`] if the row has another length, and those of the file; the row is then not
    /// counted.
    pub fn row(&mut self, numbers: impl IntoIterator<Item = f64>) -> io::Result<()> {
        // One number more than fits tells a row that is too long.
        let numbers: Vec<f64> = numbers.into_iter().take(self.columns.saturating_add(1)).collect();
        if numbers.len() != self.columns {
            let found = if numbers.len() > self.columns { "more" } else { "fewer" };
            let message = format!("{found} numbers than the {} columns", self.columns);
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        let bytes: Vec<u8> = numbers.into_iter().flat_map(f64::to_le_bytes).collect();
        let start = self.start + u64::from(HEADER) + self.rows * bytes.len() as u64;
        self.file.seek(SeekFrom::Start(start))?;
        self.file.write_all(&bytes)?;
        self.rows += 1;
        self.header()
    }

    /// The file.
    pub fn into_inner(self) -> W {
        self.file
    }

    /// The magic number, the version 1.0, the length of the rest, and the rest.
    fn header(&mut self) -> io::Result<()> {
        let shape = format!("({}, {})", self.rows, self.columns);
        let text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
        let rest = usize::from(HEADER - 10);
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((HEADER - 10).to_le_bytes());
        bytes.extend(format!("{text:width$}\n", width = rest - 1).into_bytes());
        self.file.seek(SeekFrom::Start(self.start))?;
        self.file.write_all(&bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn an_array_begins_where_its_file_stands() {
        let mut file = Cursor::new(b"a title".to_vec());
        file.set_position(7);
        let mut profiles = Profiles::npy(file, 2).unwrap();
        profiles.row([1.0, 2.0]).unwrap();
        profiles.row([3.0, 4.0]).unwrap();
        let bytes = profiles.into_inner().into_inner();
        assert!(bytes.starts_with(b"a title\x93NUMPY") && bytes.len() == 7 + 128 + 4 * 8);
        assert_eq!(bytes[7 + 128..7 + 136], 1.0_f64.to_le_bytes());
    }

    #[test]
    fn a_row_of_another_length_is_refused() {
        for (columns, numbers) in [(3, 2), (3, 4), (usize::MAX, 2), (usize::MAX / 8 + 1, 0)] {
            let mut profiles = Profiles::npy(Cursor::new(Vec::new()), columns).unwrap();
            let error = profiles.row(vec![1.0; numbers]).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{error}");
        }
        // A row without an end.
        let mut profiles = Profiles::npy(Cursor::new(Vec::new()), 3).unwrap();
        assert!(profiles.row(std::iter::repeat(1.0)).is_err());
    }
}
