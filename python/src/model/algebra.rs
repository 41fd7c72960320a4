//! Structure constants of a Lie algebra whose dimension is known at run time.

use std::collections::HashMap;

use metriplectic_manifolds::lie_algebra::{AlgebraError, StructureConstant};

use super::error::DefinitionError;

/// Checks that constants are finite and antisymmetric and satisfy the Jacobi identity, and leaves out those that are zero. The tolerance
/// is that of [`metriplectic_manifolds::LieAlgebra::new`].
///
/// # Errors
///
/// The first one that is not, as an [`AlgebraError`], or an index beyond the dimension.
pub(super) fn checked(
    n: usize,
    constants: Vec<StructureConstant>,
) -> Result<Vec<StructureConstant>, DefinitionError> {
    let mut rows: HashMap<(usize, usize), Vec<(usize, f64)>> = HashMap::new();
    let mut largest = 0.0_f64;
    for &StructureConstant { a, b, d, value } in &constants {
        if let Some(index) = [a, b, d].into_iter().find(|index| *index >= n) {
            return Err(DefinitionError::Index { index, n });
        }
        if !value.is_finite() {
            return Err(AlgebraError::NotFinite { a, b, d, value }.into());
        }
        largest = largest.max(value.abs());
        if value != 0.0 {
            let row = rows.entry((a, b)).or_default();
            match row.iter_mut().find(|(other, _)| *other == d) {
                Some((_, sum)) => *sum += value,
                None => row.push((d, value)),
            }
        }
    }
    let none = Vec::new();
    let row = |a: usize, b: usize| rows.get(&(a, b)).unwrap_or(&none);
    let entry = |a: usize, b: usize, d: usize| {
        row(a, b).iter().find(|(other, _)| *other == d).map_or(0.0, |(_, value)| *value)
    };
    let tolerance = 6.0 * n as f64 * f64::EPSILON;
    let mut pairs: Vec<(usize, usize)> = rows.keys().copied().collect();
    pairs.sort_unstable();
    for &(a, b) in &pairs {
        for &(d, value) in row(a, b) {
            let size = f64::abs(value + entry(b, a, d));
            if size > tolerance * largest {
                return Err(AlgebraError::NotAntisymmetric { a, b, d, size }.into());
            }
        }
    }
    for &(a, b) in &pairs {
        for c in 0..n {
            let mut sum: HashMap<usize, f64> = HashMap::new();
            for (a, b, c) in [(a, b, c), (b, c, a), (c, a, b)] {
                for &(e, value) in row(a, b) {
                    for &(d, other) in row(e, c) {
                        *sum.entry(d).or_default() += value * other;
                    }
                }
            }
            let worst = sum.into_iter().max_by(|(_, x), (_, y)| x.abs().total_cmp(&y.abs()));
            if let Some((d, value)) = worst
                && value.abs() > tolerance * largest * largest
            {
                return Err(AlgebraError::NoJacobiIdentity { a, b, c, d, size: value.abs() }.into());
            }
        }
    }
    let listed = |&(a, b): &(usize, usize)| {
        let mut row = row(a, b).clone();
        row.sort_by_key(|(d, _)| *d);
        row.into_iter().map(move |(d, value)| StructureConstant { a, b, d, value })
    };
    Ok(pairs.iter().flat_map(listed).filter(|constant| constant.value != 0.0).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use metriplectic_manifolds::LieDual;

    #[test]
    fn constants_are_judged_as_those_of_the_library() {
        let so4 = LieDual::so4().algebra().constants().to_vec();
        assert_eq!(checked(6, so4.clone()).unwrap().len(), so4.len());
        let mut bad = so4.clone();
        bad[3].value *= 1.5;
        let error = checked(6, bad).unwrap_err();
        assert!(matches!(error, DefinitionError::Algebra(AlgebraError::NotAntisymmetric { .. })));
        // [e0, e1] = e2 and [e2, e0] = e0 with their mirror images.
        let mut broken = Vec::new();
        for (a, b, d) in [(0, 1, 2), (2, 0, 0)] {
            broken.push(StructureConstant { a, b, d, value: 1.0 });
            broken.push(StructureConstant { a: b, b: a, d, value: -1.0 });
        }
        let error = checked(3, broken).unwrap_err();
        assert!(matches!(error, DefinitionError::Algebra(AlgebraError::NoJacobiIdentity { .. })));
        let beyond = vec![StructureConstant { a: 0, b: 3, d: 1, value: 1.0 }];
        assert_eq!(checked(3, beyond), Err(DefinitionError::Index { index: 3, n: 3 }));
    }
}
