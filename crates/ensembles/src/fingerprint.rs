//! A hash that tells plans, and lines of a journal, from each other.

/// A hash of 64 bits. Each word is mixed in by a bijection, so a change of one word changes it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fingerprint(u64);

impl Default for Fingerprint {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fingerprint {
    pub(crate) const fn word(&mut self, word: u64) {
        // The multiplier of FNV-1a; the rotation brings the high bits down.
        self.0 = (self.0 ^ word).wrapping_mul(0x0000_0100_0000_01b3).rotate_left(29);
    }

    pub(crate) fn text(&mut self, text: &str) {
        self.bytes(text.as_bytes());
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        let (words, rest) = bytes.as_chunks::<8>();
        for word in words {
            self.word(u64::from_le_bytes(*word));
        }
        let mut last = [0; 8];
        last[..rest.len()].copy_from_slice(rest);
        self.word(u64::from_le_bytes(last));
        self.word(bytes.len() as u64);
    }

    pub(crate) const fn finish(self) -> u64 {
        crate::draw::mixed(self.0)
    }
}

/// The check sum of a line.
pub(crate) fn of_line(line: &[u8]) -> u64 {
    let mut hash = Fingerprint::default();
    hash.bytes(line);
    hash.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_and_a_shortened_line_have_other_sums() {
        let line = b"17 ok span|3fe|40a 3ff|".repeat(7);
        let sum = of_line(&line);
        for at in 0..line.len() {
            assert_ne!(of_line(&line[..at]), sum);
            for bit in 0..8 {
                let mut changed = line.clone();
                changed[at] ^= 1 << bit;
                assert_ne!(of_line(&changed), sum, "bit {bit} of byte {at}");
            }
        }
    }
}
