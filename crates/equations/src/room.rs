//! Room for numbers that costs no allocation where a state is small.

/// Calls `f` with so many zeros.
#[allow(clippy::missing_panics_doc, reason = "the function is called once, and leaves its result")]
pub fn with_numbers<T>(count: usize, f: impl FnOnce(&mut [f64]) -> T) -> T {
    let (mut f, mut result) = (Some(f), None);
    with_room(count, &mut |numbers| result = f.take().map(|f| f(numbers)));
    result.expect("the function is called once")
}

/// Calls `f` once: compiled once, and not with each function.
fn with_room(count: usize, f: &mut dyn FnMut(&mut [f64])) {
    match count {
        0..=64 => f(&mut [0.0; 64][..count]),
        65..=512 => f(&mut [0.0; 512][..count]),
        513..=4096 => f(&mut [0.0; 4096][..count]),
        _ => f(&mut vec![0.0; count]),
    }
}
