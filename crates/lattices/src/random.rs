//! Random numbers that are the same in each run.

use metriplectic_fields::Column;

/// The generator `SplitMix64` (Steele, Lea, Flood 2014).
pub(crate) struct Random(u64);

impl Random {
    pub(crate) const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A number between −1 and 1.
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        // The 53 leading bits make a number between 0 and 2⁵³.
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// A vector with entries up to these sizes.
    pub(crate) fn vector<V: Column<f64>>(&mut self, sizes: &V) -> V {
        V::from_index(|k| sizes[k] * self.next())
    }
}
