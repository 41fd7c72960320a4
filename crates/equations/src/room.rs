//! Room for numbers that costs no allocation where a state is small.

/// Calls `f` with so many zeros.
pub fn with_numbers<T>(count: usize, f: impl FnOnce(&mut [f64]) -> T) -> T {
    match count {
        0..=64 => f(&mut [0.0; 64][..count]),
        65..=512 => f(&mut [0.0; 512][..count]),
        513..=4096 => f(&mut [0.0; 4096][..count]),
        _ => f(&mut vec![0.0; count]),
    }
}
