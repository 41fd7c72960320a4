//! Numbers of a row that look random, from the seed and the number of the row alone.

use std::convert::Infallible;
use std::ops::Range;

use rand::rngs::ChaCha8Rng;
use rand::{Rng as _, SeedableRng as _, TryRng};

/// A stream of random numbers that belongs to one column of one row.
///
/// It is ChaCha8 with the key `(seed, column)` and the stream `row`, so a row has the same numbers on each machine,
/// whatever ran before it. It is a generator of the crate `rand` too.
///
/// ```
/// use metriplectic_ensembles::Sweep;
/// let sweep = Sweep::new("spins").samples(50).random("spin", |draw| draw.uniform(-1.0..1.0));
/// assert_eq!(sweep.row(7)?.get("spin"), sweep.row(7)?.get("spin"));
/// assert_ne!(sweep.row(7)?.get("spin"), sweep.row(8)?.get("spin"));
/// # Ok::<(), metriplectic_ensembles::PlanError>(())
/// ```
#[derive(Debug)]
pub struct Draw(ChaCha8Rng);

/// `2⁻⁵³`, the distance of two neighbouring draws from `[0, 1)`.
const UNIT: f64 = 1.0 / (1_u64 << 53) as f64;

/// The column of the numbers that a closure draws by itself.
pub(crate) const OF_THE_ROW: u64 = u64::MAX;

impl Draw {
    /// The stream of a column in a row.
    pub(crate) fn of(seed: u64, column: u64, row: usize) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&column.to_le_bytes());
        let mut rng = ChaCha8Rng::from_seed(key);
        rng.set_stream(row as u64);
        Self(rng)
    }

    /// A number that is uniform in `[0, 1)`.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * UNIT
    }

    /// Draws a number that is uniform in a range.
    pub fn uniform(&mut self, range: Range<f64>) -> f64 {
        within(&range, self.unit())
    }

    /// Draws a positive number whose logarithm is uniform in a range of positive numbers.
    pub fn log_uniform(&mut self, range: Range<f64>) -> f64 {
        self.uniform(range.start.ln()..range.end.ln()).exp()
    }

    /// Draws a number of the normal distribution (Box, Muller 1958).
    pub fn normal(&mut self, mean: f64, deviation: f64) -> f64 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        mean + deviation * radius * (std::f64::consts::TAU * self.unit()).cos()
    }
}

impl TryRng for Draw {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        self.0.try_next_u32()
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        self.0.try_next_u64()
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        self.0.try_fill_bytes(bytes)
    }
}

/// The number at the fraction `u < 1` of a range, below its end.
pub(crate) fn within(range: &Range<f64>, u: f64) -> f64 {
    let value = range.start + (range.end - range.start) * u;
    if value < range.end || range.end <= range.start { value } else { range.end.next_down() }
}

/// The place of `index` in a permutation of `0..count` that belongs to a key: a Feistel network of four rounds on the
/// next even number of bits, applied until it ends below `count` (Black, Rogaway 2002). It needs no memory, so each
/// row knows its stratum alone.
pub(crate) fn permuted(index: usize, count: usize, key: u64) -> usize {
    let bits = (usize::BITS - count.saturating_sub(1).leading_zeros()).div_ceil(2).max(1);
    let mask = (1_u64 << bits) - 1;
    let mut value = index as u64;
    loop {
        let [mut left, mut right] = [value >> bits, value & mask];
        for round in 0..4 {
            (left, right) = (right, left ^ (mixed(key ^ mixed(right + (round << 40))) & mask));
        }
        value = (left << bits) | right;
        // The cycle through `index < count` comes back below `count`.
        if let Ok(place) = usize::try_from(value)
            && place < count
        {
            return place;
        }
    }
}

/// SplitMix64's finaliser (Steele, Lea, Flood 2014).
pub(crate) const fn mixed(z: u64) -> u64 {
    let z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_permutation_takes_each_place_once_and_is_not_the_identity() {
        for count in [1, 2, 3, 7, 50, 64, 65, 1000] {
            for key in 0..5 {
                let places: Vec<usize> = (0..count).map(|i| permuted(i, count, key)).collect();
                let mut sorted = places.clone();
                sorted.sort_unstable();
                assert!(sorted.into_iter().eq(0..count), "{count}, {key}");
                assert!(count < 7 || !places.is_sorted(), "{count}, {key}");
            }
        }
    }

    #[test]
    fn draws_have_their_mean_and_deviation() {
        let n = 20_000;
        let sample = |f: &dyn Fn(&mut Draw) -> f64| {
            let values: Vec<f64> = (0..n).map(|row| f(&mut Draw::of(3, 1, row))).collect();
            let mean = values.iter().sum::<f64>() / n as f64;
            (mean, values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n as f64)
        };
        // Four standard errors.
        let bound = 4.0 / (n as f64).sqrt();
        let (mean, variance) = sample(&|draw| draw.uniform(-1.0..1.0));
        assert!(mean.abs() < bound && (3.0 * variance - 1.0).abs() < bound, "{mean}, {variance}");
        let (mean, variance) = sample(&|draw| draw.normal(2.0, 1.0));
        assert!((mean - 2.0).abs() < bound && (variance - 1.0).abs() < 2.0 * bound);
        let (mean, _) = sample(&|draw| draw.log_uniform(1e-9..1e-3).log10());
        assert!((mean + 6.0).abs() < 2.0 * bound, "{mean}");
    }

    #[test]
    fn a_draw_stays_below_the_end_of_its_range() {
        let range = 1.0..1.0 + f64::EPSILON;
        assert!(within(&range, 1.0 - UNIT) < range.end);
        assert!(within(&(-1.0..0.0), 1.0 - UNIT) < 0.0);
    }
}
