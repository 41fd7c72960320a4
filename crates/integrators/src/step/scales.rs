//! The sizes of the entries of a state in the course of a run.
//!
//! The entries of a state have units of their own: lengths of 10⁻⁹ stand beside temperatures of 300. An
//! error is judged entry by entry, relative to a size `s_i` for each direction: the largest `|x_i|` of the run
//! so far, or what an entry that starts at zero [reaches soon](crate::Flow::reach).
//!
//! An entry may also stay at zero because its forces cancel, and has no size then. Its velocity is noise of
//! the size `ε t_i`, where `t_i` is the size of the terms that it is summed of. Noise is no error of a step,
//! and no speed.
//!
//! No number with a unit stands in these formulas: if each entry is written in another unit that is a power
//! of two, the sizes are the same numbers in these units.

use super::Vector;

/// The sizes of the entries so far, and those of the terms of their velocities.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Scales<V> {
    /// The sizes of the entries.
    pub sizes: V,
    /// The sizes of the terms of their velocities.
    pub terms: V,
}

impl<V: Vector> Scales<V> {
    /// These sizes, or the ones of another state where they are larger.
    pub(crate) fn or(&self, sizes: &V) -> Self {
        Self { sizes: larger(&self.sizes, sizes), terms: self.terms.clone() }
    }

    /// The larger ones of two.
    pub(crate) fn and(&self, other: &Self) -> Self {
        Self { terms: larger(&self.terms, &other.terms), ..self.or(&other.sizes) }
    }

    /// The rounding of a displacement in the time `h`.
    pub(crate) fn rounding(&self, h: f64) -> V {
        self.terms.map(|terms| rounding(terms, h))
    }

    /// The norm of the velocity relative to the sizes, without what is noise.
    pub(crate) fn speed(&self, v: &V) -> f64 {
        let noise = self.rounding(1.0);
        let above = V::zip([v, &noise], |[v, noise]| if v.abs() <= noise { 0.0 } else { v });
        relative(&above, &self.sizes)
    }
}

/// The rounding of a displacement in the time `h`, of a velocity with terms of this size.
pub(crate) fn rounding(terms: f64, h: f64) -> f64 {
    terms * (16.0 * f64::EPSILON * h.abs())
}

/// The larger one of two sizes, entry by entry.
pub(crate) fn larger<V: Vector>(a: &V, b: &V) -> V {
    V::zip([a, b], |[a, b]| a.max(b))
}

/// The [norm](Vector::relative_to) of the ratios `v_i/s_i`, without a unit.
pub(crate) fn relative<V: Vector>(v: &V, sizes: &V) -> f64 {
    v.relative_to(sizes)
}

#[cfg(test)]
mod tests {
    use super::super::Components;
    use super::*;
    use nalgebra::vector;

    #[test]
    fn a_norm_of_ratios_has_no_unit() {
        let cases = [
            (vector![3.0, 4.0], vector![1.0, 1.0], 5.0),
            (vector![3e-200, 4e200], vector![1e-200, 1e200], 5.0),
            (vector![3e-300, 4e-300], vector![1.0, 1.0], 5e-300),
            (vector![0.0, 0.0], vector![0.0, 1.0], 0.0),
            (vector![1.0, 0.0], vector![0.0, 1.0], f64::INFINITY),
        ];
        for (v, sizes, expected) in cases {
            approx::assert_relative_eq!(
                relative(&Components(v), &Components(sizes)),
                expected,
                max_relative = 1e-15
            );
        }
        assert!(relative(&vec![1.0, f64::NAN], &vec![1.0, 1.0]).is_nan());
    }
}
