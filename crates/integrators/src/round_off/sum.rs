//! Sums in two numbers.

/// The sum of a number of two parts and another one, without a rounding of the sum of all three.
pub(crate) fn plus([high, low]: [f64; 2], x: f64) -> [f64; 2] {
    let sum = high + x;
    let part = sum - high;
    let error = (high - (sum - part)) + (x - part);
    let low = low + error;
    let whole = sum + low;
    [whole, low - (whole - sum)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_keep_the_digits_that_flow_through() {
        // 10⁵ in and out again, a million times, with a millionth of 1 left each time.
        let mut sum = [1.0, 0.0];
        for _ in 0..1_000_000 {
            for x in [1e5, 1e-6, -1e5] {
                sum = plus(sum, x);
            }
        }
        let exact = (0..1_000_000).fold([1.0, 0.0], |sum, _| plus(sum, 1e-6))[0];
        assert!((sum[0] - exact).abs() <= f64::EPSILON * exact, "{sum:?}");
    }
}
