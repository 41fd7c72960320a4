//! Random numbers by counter.

use std::f64::consts::TAU;
use std::fmt::Debug;

use rand::rngs::ChaCha8Rng;
use rand::{Rng as _, SeedableRng as _};

/// The numbers of a path: a function of the step and of the term, with no state.
pub trait Numbers: Clone + Debug + Sync {
    /// The number `ξ` of a term in a step, with `E ξ = 0`, `E ξ² = 1`, and the moments of a Gaussian up to the fifth.
    fn number(&self, step: u64, term: usize) -> f64;

    /// Whether the noise fields of a step are followed in the opposite order: a fair coin.
    fn is_backward(&self, step: u64) -> bool;

    /// The name in a checkpoint; a run is resumed with numbers of its name.
    fn name(&self) -> String;
}

/// The numbers of `(seed, path, step, term)` by ChaCha8: a named algorithm, the same on each machine.
///
/// The seed is its key and the path its stream. A step and a term have a block of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counter {
    seed: u64,
    path: u64,
    is_three_point: bool,
}

/// `2⁻⁵²`.
const UNIT: f64 = 1.0 / (1_u64 << 52) as f64;
/// The numbers of bits for the term in the counter of blocks.
const TERM_BITS: u32 = 28;
/// The words in a block of the generator.
const WORDS: u128 = 16;
/// The place of the coin, after all terms.
const COIN: u64 = (1 << TERM_BITS) - 1;

impl Counter {
    /// The Gaussian numbers of a seed, on path 0.
    pub const fn new(seed: u64) -> Self {
        Self { seed, path: 0, is_three_point: false }
    }

    /// Takes another path of the same seed.
    #[must_use]
    pub const fn path(self, path: u64) -> Self {
        Self { path, ..self }
    }

    /// Takes `−√3, 0, √3` with the probabilities `1/6, 2/3, 1/6`, which have the first five moments of a Gaussian: bounded,
    /// and the same bits with every mathematical library. Means have the same weak order. Paths visit few places.
    #[must_use]
    pub const fn three_point(self) -> Self {
        Self { is_three_point: true, ..self }
    }

    /// The generator of a step and a place in it.
    fn block(&self, step: u64, place: u64) -> ChaCha8Rng {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&self.seed.to_le_bytes());
        let mut rng = ChaCha8Rng::from_seed(key);
        rng.set_stream(self.path);
        let block = (u128::from(step) << TERM_BITS) + u128::from(place);
        rng.set_word_pos(block * WORDS);
        rng
    }
}

/// A number that is uniform in `(0, 1)`.
fn uniform(u: u64) -> f64 {
    ((u >> 12) as f64 + 0.5) * UNIT
}

/// One of `−√3, 0, √3`, by the sixth of the range in which `u` is.
fn three_point(u: u64) -> f64 {
    match (u128::from(u) * 6) >> 64 {
        0 => -3.0_f64.sqrt(),
        1 => 3.0_f64.sqrt(),
        _ => 0.0,
    }
}

impl Numbers for Counter {
    fn number(&self, step: u64, term: usize) -> f64 {
        let mut rng = self.block(step, term as u64);
        if self.is_three_point {
            return three_point(rng.next_u64());
        }
        // Box and Muller (1958).
        let [radius, angle] = [(); 2].map(|()| uniform(rng.next_u64()));
        (-2.0 * radius.ln()).sqrt() * (TAU * angle).cos()
    }

    fn is_backward(&self, step: u64) -> bool {
        self.block(step, COIN).next_u64() >> 63 == 1
    }

    fn name(&self) -> String {
        let law = if self.is_three_point { "three-point" } else { "Gaussian" };
        format!("seed {}, path {}, {law}", self.seed, self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_moments_of_a_gaussian() {
        let count = 200_000;
        for counter in [Counter::new(7), Counter::new(7).three_point()] {
            let mut moments = [0.0; 5];
            for step in 0..count / 4 {
                for term in 0..4 {
                    let xi = counter.number(step, term);
                    for (k, moment) in (1..).zip(&mut moments) {
                        *moment += xi.powi(k) / count as f64;
                    }
                }
            }
            // Five standard errors of the means: those of ξ^k are √(E ξ^{2k} − (E ξ^k)²).
            let error = |deviation: f64| 5.0 * deviation / (count as f64).sqrt();
            let expected = [(0.0, 1.0), (1.0, 1.5), (0.0, 4.0), (3.0, 10.0), (0.0, 31.0)];
            for (moment, (mean, deviation)) in moments.into_iter().zip(expected) {
                assert!((moment - mean).abs() < error(deviation), "{moment} is not {mean}");
            }
            let backward = (0..count).filter(|step| counter.is_backward(*step)).count();
            assert!((backward as f64 / count as f64 - 0.5).abs() < error(0.5), "{backward}");
        }
    }

    #[test]
    fn each_number_is_its_own() {
        let base = Counter::new(1).number(5, 2);
        let others = [
            Counter::new(2).number(5, 2),
            Counter::new(1).path(1).number(5, 2),
            Counter::new(1).number(6, 2),
            Counter::new(1).number(5, 3),
        ];
        assert!(others.iter().all(|other| other.to_bits() != base.to_bits()));
        assert_eq!(Counter::new(1).number(5, 2).to_bits(), base.to_bits());
    }

    #[test]
    fn the_ends_of_the_range_are_numbers() {
        assert!(uniform(0) > 0.0 && uniform(u64::MAX) < 1.0);
        // 2⁶⁴ is no multiple of six: the first number of the next sixth is above a sixth of the range.
        assert!(three_point(0) < 0.0 && three_point(u64::MAX / 6) < 0.0);
        assert!(three_point(u64::MAX / 6 + 1) > 0.0 && three_point(u64::MAX) == 0.0);
    }
}
