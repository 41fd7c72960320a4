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
    columns: usize,
    rows: u64,
}

impl<W: Write + Seek> Profiles<W> {
    /// Begins an array with so many columns.
    ///
    /// # Errors
    ///
    /// Those of the file.
    pub fn npy(file: W, columns: usize) -> io::Result<Self> {
        let mut profiles = Self { file, columns, rows: 0 };
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
        let bytes: Vec<u8> = numbers.into_iter().flat_map(f64::to_le_bytes).collect();
        if bytes.len() != 8 * self.columns {
            let message = format!("{} numbers for {} columns", bytes.len() / 8, self.columns);
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        let start = u64::from(HEADER) + self.rows * bytes.len() as u64;
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
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(&bytes)
    }
}
