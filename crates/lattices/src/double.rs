//! Sums with twice the digits of a number.

/// An unevaluated sum `hi + lo`, exact to about 32 digits (Ogita, Rump, Oishi 2005, algorithm 4.4).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Double {
    hi: f64,
    lo: f64,
}

/// `a + b` and its rounding error (Knuth 1969, §4.2.2).
#[inline]
fn two_sum(a: f64, b: f64) -> [f64; 2] {
    let sum = a + b;
    let part = sum - a;
    [sum, (a - (sum - part)) + (b - part)]
}

impl Double {
    /// One more number.
    #[inline]
    pub(crate) fn add(&mut self, x: f64) {
        let [hi, error] = two_sum(self.hi, x);
        (self.hi, self.lo) = (hi, self.lo + error);
    }

    /// One more sum.
    #[inline]
    pub(crate) fn merge(&mut self, other: Self) {
        self.add(other.hi);
        self.lo += other.lo;
    }

    /// The two numbers whose sum it is.
    pub(crate) const fn parts(self) -> [f64; 2] {
        [self.hi, self.lo]
    }

    /// The sum of two such numbers.
    pub(crate) const fn of_parts([hi, lo]: [f64; 2]) -> Self {
        Self { hi, lo }
    }

    /// The number nearest to the sum.
    #[inline]
    pub(crate) fn value(self) -> f64 {
        self.hi + self.lo
    }

    /// `target − sum`, rounded once.
    #[inline]
    pub(crate) fn below(self, target: f64) -> f64 {
        let [difference, error] = two_sum(target, -self.hi);
        difference + (error - self.lo)
    }
}

#[cfg(test)]
mod tests {
    use super::Double;

    #[test]
    fn a_sum_has_twice_the_digits() {
        // Σ 0.1 over 10⁶ terms, whose exact value is 10⁶ times the number 0.1.
        let mut sum = Double::default();
        let mut chunk = Double::default();
        for k in 0..1_000_000 {
            chunk.add(0.1);
            if k % 1000 == 999 {
                sum.merge(std::mem::take(&mut chunk));
            }
        }
        // 0.1 = 3602879701896397 / 2⁵⁵, and 10⁶ times it is 10⁵ + 5.551115123125783e-12.
        assert!((sum.below(1e5) + 5.551_115_123_125_783e-12).abs() < 1e-24);
        let naive = (0..1_000_000).fold(0.0, |sum, _| sum + 0.1);
        assert!((naive - 1e5_f64).abs() > 1e-7);
    }
}
