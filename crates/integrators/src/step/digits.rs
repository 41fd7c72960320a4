//! Numbers in messages.

use std::fmt;

/// A number with seven significant digits, in powers of ten where it is very large or very small: a
/// state may be measured in nanometres or in astronomical units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Digits(pub(crate) f64);

/// The number in a message about a field of this name.
pub(crate) const fn digits(number: &f64) -> Digits {
    Digits(*number)
}

impl fmt::Display for Digits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.0.abs();
        if size == 0.0 || (1e-3..1e6).contains(&size) {
            write!(f, "{:.6}", self.0)
        } else {
            write!(f, "{:.6e}", self.0)
        }
    }
}

/// A number with its noun.
pub(crate) fn counted(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_and_large_numbers_keep_their_digits() {
        let shown = [0.0, 0.5, -12.25, 2.5e-16, -3e11].map(|x| Digits(x).to_string());
        assert_eq!(shown, ["0.000000", "0.500000", "-12.250000", "2.500000e-16", "-3.000000e11"]);
    }
}
