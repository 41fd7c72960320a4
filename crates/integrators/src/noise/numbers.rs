//! Random numbers by counter.
//!
//! One law gives all of them. A block of four words `(u₀, u₁, u₂, u₃)` belongs to a key and a counter, by
//! [`philox`](super::philox):
//!
//! | word | of the key | of the counter |
//! |---|---|---|
//! | 0 | the seed | the step, from 0 |
//! | 1 | the path | the term, or 0 |
//! | 2 | | what the number is [for](Purpose) |
//! | 3 | | 0, or a place of its own |
//!
//! All words have 64 bits, so no two numbers share a key and a counter, and none is beyond the range. With
//! `U(u) = (⌊u/2¹²⌋ + ½) 2⁻⁵²`, in `(0, 1)`, the number of a term is (Box and Muller 1958)
//!
//! ```math
//! \xi = \sqrt{-2 \ln U(u_0)}\, \cos 2\pi U(u_1) ,
//! ```
//!
//! or `−√3, √3, 0` where `⌊6 u₀/2⁶⁴⌋` is 0, 1, or larger. The coin of a step is the leading bit of `u₀`. Integers are the
//! same on each machine and on each device, and Gaussian numbers to the round-off of its logarithm and cosine.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::fmt::Debug;

use super::philox::philox;

/// The numbers of a path: a function of the step and of the term, with no state.
pub trait Numbers: Clone + Debug + Sync {
    /// The number `ξ` of a term in a step, with `E ξ = 0`, `E ξ² = 1`, and the moments of a Gaussian up to the fifth.
    fn number(&self, step: u64, term: usize) -> f64;

    /// Whether the noise fields of a step are followed in the opposite order: a fair coin.
    fn is_backward(&self, step: u64) -> bool;

    /// The number `ζ` of a place between the ends of a step, with the moments of [`number`](Self::number), for the Brownian path
    /// [inside it](super::levy()); `None` without such numbers: then no state between the ends is known.
    fn between(&self, step: u64, term: usize, place: u64) -> Option<f64> {
        let _ = (step, term, place);
        None
    }

    /// A number that is uniform in `(0, 1)`, for the [excursions](crate::Stepper::excursion) in a part of a step; `None` where numbers
    /// are not Gaussian, or there are no such numbers.
    fn uniform(&self, step: u64, part: u64) -> Option<f64> {
        let _ = (step, part);
        None
    }

    /// The name in a checkpoint; a run is resumed with numbers of its name.
    fn name(&self) -> String;
}

/// The purpose of a number: a word of its counter, so that no two purposes share numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[repr(u64)]
pub enum Purpose {
    /// The number of a term in a step.
    Term = 0,
    /// The coin of a step.
    Coin = 1,
    /// The directions in which a model is tried.
    Trial = 2,
    /// The number of a term at a place between the ends of a step.
    Between = 3,
    /// Whether a path has left a region and come back.
    Excursion = 4,
}

/// The numbers of `(seed, path, step, term)` by Philox4x64-10.
///
/// Seed and path are the key of [`philox`](super::philox()), and each step and term has a block of its own, up to `2⁶⁴` of both:
///
/// ```math
/// \xi = \sqrt{-2 \ln U(u_0)}\, \cos 2\pi U(u_1), \qquad
/// (u_0, u_1, u_2, u_3) = \mathrm{Philox}_{(\text{seed}, \text{path})}(\text{step}, \text{term}, 0, 0) ,
/// ```
///
/// with `U(u) = (⌊u/2¹²⌋ + ½) 2⁻⁵²` (Box and Muller 1958). Integers are the same on each machine and device, and Gaussian numbers
/// to the round-off of logarithm and cosine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counter {
    seed: u64,
    path: u64,
    is_three_point: bool,
    /// A step is that of `2^doublings` steps of the path.
    doublings: u32,
}

/// `2⁻⁵²`.
const UNIT: f64 = 1.0 / (1_u64 << 52) as f64;

impl Counter {
    /// The Gaussian numbers of a seed, on path 0.
    pub const fn new(seed: u64) -> Self {
        Self { seed, path: 0, is_three_point: false, doublings: 0 }
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

    /// Takes the Brownian path of steps of size `h` in steps of size `2^doublings h`: the number of two steps in one is
    /// `(ξ₁ + ξ₂)/√2`. Two runs on one path differ by the error of their steps, and hardly by chance.
    #[must_use]
    pub const fn coarsened(self, doublings: u32) -> Self {
        Self { doublings: self.doublings + doublings, ..self }
    }

    /// The numbers of steps of half the size.
    const fn halved(&self) -> Option<Self> {
        match self.doublings.checked_sub(1) {
            Some(doublings) => Some(Self { doublings, ..*self }),
            None => None,
        }
    }

    /// The block of a step and a term.
    const fn block(&self, step: u64, term: u64, purpose: Purpose) -> [u64; 4] {
        self.block_at(step, term, purpose, 0)
    }

    /// The block of a place of a step and a term.
    const fn block_at(&self, step: u64, term: u64, purpose: Purpose, place: u64) -> [u64; 4] {
        philox([self.seed, self.path], [step, term, purpose as u64, place])
    }

    /// The number of a block.
    fn of_block(&self, [first, second, ..]: [u64; 4]) -> f64 {
        if self.is_three_point {
            return three_point(first);
        }
        let [radius, angle] = [uniform(first), uniform(second)];
        (-2.0 * radius.ln()).sqrt() * (TAU * angle).cos()
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
        if let Some(halved) = self.halved() {
            let [first, second] = [0, 1].map(|half| halved.number(2 * step + half, term));
            return (first + second) * FRAC_1_SQRT_2;
        }
        self.of_block(self.block(step, term as u64, Purpose::Term))
    }

    fn is_backward(&self, step: u64) -> bool {
        self.block(step << self.doublings, 0, Purpose::Coin)[0] >> 63 == 1
    }

    fn between(&self, step: u64, term: usize, place: u64) -> Option<f64> {
        let Some(halved) = self.halved() else {
            return Some(self.of_block(self.block_at(step, term as u64, Purpose::Between, place)));
        };
        // The digits of a place after its first one say the way to it: 0 for an earlier half.
        let Some(last) = place.checked_ilog2()?.checked_sub(1) else {
            let [first, second] = [0, 1].map(|half| halved.number(2 * step + half, term));
            return Some((first - second) * FRAC_1_SQRT_2);
        };
        let half = (place >> last) & 1;
        halved.between(2 * step + half, term, (place & ((1 << last) - 1)) | (1 << last))
    }

    fn uniform(&self, step: u64, part: u64) -> Option<f64> {
        let number = || uniform(self.block(step, part, Purpose::Excursion)[0]);
        (!self.is_three_point).then(number)
    }

    fn name(&self) -> String {
        let law = if self.is_three_point { "three-point" } else { "Gaussian" };
        let steps = match self.doublings {
            0 => String::new(),
            doublings => format!(", 2^{doublings} steps in one"),
        };
        format!("seed {}, path {}, {law}{steps}", self.seed, self.path)
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
            // With 28 bits for the term these would be the numbers of another step, and the coin that of a term.
            Counter::new(1).number(4, (1 << 28) + 2),
            Counter::new(1).number(5, (1 << 28) - 1),
            Counter::new(1).number(5, 2 + (1 << 40)),
            Counter::new(1).number(5 + (1 << 53), 2),
        ];
        assert!(others.iter().all(|other| other.to_bits() != base.to_bits()));
        assert_eq!(Counter::new(1).number(5, 2).to_bits(), base.to_bits());
    }

    const PURPOSES: [Purpose; 5] =
        [Purpose::Term, Purpose::Coin, Purpose::Trial, Purpose::Between, Purpose::Excursion];

    #[test]
    fn no_counter_comes_twice() {
        // At the powers of two, where a word that is too narrow wraps, and beside them.
        let edges = || {
            let near = |k: u32| [(1_u64 << k) - 1, 1 << k, (1 << k) + 1];
            (0..64).step_by(4).flat_map(near).chain([u64::MAX])
        };
        let counter = Counter::new(1);
        let mut blocks: Vec<[u64; 4]> = Vec::new();
        for purpose in PURPOSES {
            for step in edges() {
                blocks.extend(edges().map(|term| counter.block(step, term, purpose)));
            }
        }
        blocks.sort_unstable();
        let count = blocks.len();
        blocks.dedup();
        assert!(
            count == PURPOSES.len() * 49 * 49 && blocks.len() == count,
            "{} of {count}",
            blocks.len()
        );
        let coins = (0..64).filter(|step| counter.is_backward(*step)).count();
        let leading =
            (0..64).filter(|step| counter.block(*step, 0, Purpose::Term)[0] >> 63 == 1).count();
        assert!((16..48).contains(&coins) && (16..48).contains(&leading), "{coins} {leading}");
    }

    #[test]
    fn the_law_does_not_change() {
        // By an implementation of the law in another language.
        let counter = Counter::new(7).path(3);
        let found =
            [(0, 0), (1, 2), (1 << 40, 1 << 36)].map(|(step, term)| counter.number(step, term));
        let numbers = [-0.899_156_670_235_990_4, 0.202_085_713_022_563_98, 0.528_280_379_878_660_2];
        for (found, expected) in found.into_iter().zip(numbers) {
            assert!((found - expected).abs() < 4.0 * f64::EPSILON, "{found} {expected}");
        }
        let coins: Vec<bool> = (0..8).map(|step| counter.is_backward(step)).collect();
        assert_eq!(coins, [true, true, false, false, true, true, true, false]);
        let (three, root) = (counter.three_point(), 3.0_f64.sqrt());
        let points: Vec<f64> = (0..8).map(|term| three.number(5, term)).collect();
        assert_eq!(points, [0.0, 0.0, 0.0, 0.0, root, 0.0, 0.0, root]);
    }

    #[test]
    fn the_ends_of_the_range_are_numbers() {
        assert!(uniform(0) > 0.0 && uniform(u64::MAX) < 1.0);
        // 2⁶⁴ is no multiple of six: the first number of the next sixth is above a sixth of the range.
        assert!(three_point(0) < 0.0 && three_point(u64::MAX / 6) < 0.0);
        assert!(three_point(u64::MAX / 6 + 1) > 0.0 && three_point(u64::MAX) == 0.0);
    }
}
