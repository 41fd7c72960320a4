//! The generator of all random numbers.

/// The rounds.
/// A factor of four fails `noise/philox.rs::the_published_answers_are_met`.
const ROUNDS: u32 = 10;
/// The factors of a round.
const FACTORS: [u64; 2] = [0xD2E7_470E_E14C_6C93, 0xCA5A_8263_9512_1157];
/// The numbers that are added to the words of the key from one round to the next.
const WEYL: [u64; 2] = [0x9E37_79B9_7F4A_7C15, 0xBB67_AE85_84CA_A73B];

/// Computes the four words that Philox4x64-10 makes of a key and a counter (Salmon, Moraes, Dror, Shaw 2011).
///
/// For each key it is a permutation of the counters: two of them never have the same block. It takes twenty products of
/// 64 bits and has no state.
#[must_use]
#[inline]
pub const fn philox(key: [u64; 2], counter: [u64; 4]) -> [u64; 4] {
    let ([mut k0, mut k1], [mut a, mut b, mut c, mut d]) = (key, counter);
    let mut round = 0;
    while round < ROUNDS {
        let [high_a, low_a] = product(FACTORS[0], a);
        let [high_c, low_c] = product(FACTORS[1], c);
        (a, b, c, d) = (high_c ^ b ^ k0, low_c, high_a ^ d ^ k1, low_a);
        (k0, k1) = (k0.wrapping_add(WEYL[0]), k1.wrapping_add(WEYL[1]));
        round += 1;
    }
    [a, b, c, d]
}

/// The high and the low word of a product.
#[allow(clippy::cast_possible_truncation, reason = "the words of a number of 128 bits")]
const fn product(a: u64, b: u64) -> [u64; 2] {
    let product = a as u128 * b as u128;
    [(product >> 64) as u64, product as u64]
}

#[cfg(test)]
mod tests {
    use super::philox;

    #[test]
    fn the_published_answers_are_met() {
        // The lines `philox4x64 10` of `kat_vectors` in Random123, of the authors.
        let ones = u64::MAX;
        let pi = [
            0x243f_6a88_85a3_08d3,
            0x1319_8a2e_0370_7344,
            0xa409_3822_299f_31d0,
            0x082e_fa98_ec4e_6c89,
            0x4528_21e6_38d0_1377,
            0xbe54_66cf_34e9_0c6c,
        ];
        for (input, answer) in [
            (
                [0; 6],
                [
                    0x1655_4d9e_ca36_314c,
                    0xdb20_fe9d_672d_0fdc,
                    0xd7e7_72ce_e186_176b,
                    0x7e68_b68a_ec7b_a23b,
                ],
            ),
            (
                [ones; 6],
                [
                    0x87b0_92c3_013f_e90b,
                    0x438c_3c67_be8d_0224,
                    0x9cc7_d7c6_9cd7_77b6,
                    0xa09c_aebf_594f_0ba0,
                ],
            ),
            (
                pi,
                [
                    0xa528_f454_03e6_1d95,
                    0x38c7_2dbd_566e_9788,
                    0xa5a1_610e_72fd_18b5,
                    0x57bd_43b5_e52b_7fe6,
                ],
            ),
        ] {
            let [a, b, c, d, k0, k1] = input;
            assert_eq!(philox([k0, k1], [a, b, c, d]), answer);
        }
    }
}
