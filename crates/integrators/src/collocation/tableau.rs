//! The coefficients of collocation methods, computed from their nodes when the program is compiled.
//!
//! With the Lagrange polynomials `ℓ_j` of the nodes `c`, `a_ij = ∫₀^{c_i} ℓ_j` and `b_j = ∫₀¹ ℓ_j` (Hairer,
//! Lubich, Wanner 2006, §II.1).

/// The most stages of a method.
pub(crate) const STAGES: usize = 4;
/// The most nodes of the rule that integrates along a step, two more than there are stages.
const POINTS: usize = STAGES + 2;

/// A number for each stage; those beyond the last one are zero.
pub(crate) type Numbers = [f64; STAGES];

/// The coefficients of a collocation method.
#[derive(Debug)]
pub(crate) struct Tableau {
    /// How many stages there are.
    pub(crate) stages: usize,
    /// The order of convergence.
    pub(crate) order: u32,
    /// Whether the entropy is corrected on one side only.
    pub(crate) one_sided: bool,
    /// The nodes `c_i`.
    pub(crate) nodes: Numbers,
    /// The weights `b_j`.
    pub(crate) weights: Numbers,
    /// The matrix `a_ij`.
    pub(crate) matrix: [Numbers; STAGES],
    /// Its inverse.
    pub(crate) inverse: [Numbers; STAGES],
    /// The least modulus of its eigenvalues, the parameter of the blended iteration.
    pub(crate) gamma: f64,
    /// The Gauss rule with two more nodes than there are stages, at which the polynomial of the step is evaluated.
    pub(super) points: [Point; POINTS],
}

/// A node of the Gauss rule along a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    /// The fraction of the step.
    pub(crate) node: f64,
    /// Its weight.
    pub(crate) weight: f64,
    /// The coefficients `∫₀^τ ℓ_j − b_j/2` of the position from the middle of the step.
    pub(crate) position: Numbers,
    /// The coefficients `ℓ_j(τ)` of the velocity.
    pub(crate) velocity: Numbers,
}

/// A Gauss rule on `[0, 1]`.
struct Rule<const N: usize> {
    nodes: [f64; N],
    weights: [f64; N],
}

const THREE: Rule<3> = Rule {
    nodes: [0.112_701_665_379_258_31, 0.5, 0.887_298_334_620_741_7],
    weights: [0.277_777_777_777_777_8, 0.444_444_444_444_444_4, 0.277_777_777_777_777_8],
};
const FOUR: Rule<4> = Rule {
    nodes: [
        0.069_431_844_202_973_71,
        0.330_009_478_207_571_87,
        0.669_990_521_792_428_1,
        0.930_568_155_797_026_3,
    ],
    weights: [
        0.173_927_422_568_726_93,
        0.326_072_577_431_273_07,
        0.326_072_577_431_273_07,
        0.173_927_422_568_726_93,
    ],
};
const FIVE: Rule<5> = Rule {
    nodes: [
        0.046_910_077_030_668_004,
        0.230_765_344_947_158_45,
        0.5,
        0.769_234_655_052_841_5,
        0.953_089_922_969_332,
    ],
    weights: [
        0.118_463_442_528_094_54,
        0.239_314_335_249_683_23,
        0.284_444_444_444_444_45,
        0.239_314_335_249_683_23,
        0.118_463_442_528_094_54,
    ],
};
const SIX: Rule<6> = Rule {
    nodes: [
        0.033_765_242_898_423_99,
        0.169_395_306_766_867_74,
        0.380_690_406_958_401_55,
        0.619_309_593_041_598_5,
        0.830_604_693_233_132_3,
        0.966_234_757_101_576,
    ],
    weights: [
        0.085_662_246_189_585_17,
        0.180_380_786_524_069_3,
        0.233_956_967_286_345_52,
        0.233_956_967_286_345_52,
        0.180_380_786_524_069_3,
        0.085_662_246_189_585_17,
    ],
};

/// Gauss methods of 1 to 4 stages.
pub(crate) static GAUSS: [Tableau; 4] = [
    Tableau::new([0.5], &THREE, 0.5, 2),
    Tableau::new(
        [0.211_324_865_405_187_13, 0.788_675_134_594_812_9],
        &FOUR,
        0.288_675_134_594_812_87,
        4,
    ),
    Tableau::new(THREE.nodes, &FIVE, 0.196_731_007_326_674_6, 6),
    Tableau::new(FOUR.nodes, &SIX, 0.147_520_223_716_694_6, 8),
];

/// Radau IIA methods of 2 to 4 stages.
pub(crate) static RADAU: [Tableau; 3] = [
    Tableau::new([1.0 / 3.0, 1.0], &FOUR, 0.408_248_290_463_863, 3),
    Tableau::new(
        [0.155_051_025_721_682_2, 0.644_948_974_278_317_8, 1.0],
        &FIVE,
        0.246_232_757_526_440_72,
        5,
    ),
    Tableau::new(
        [0.088_587_959_512_703_95, 0.409_466_864_440_734_7, 0.787_659_461_760_847_1, 1.0],
        &SIX,
        0.173_802_707_401_796_62,
        7,
    ),
];

impl Tableau {
    const fn new<const S: usize, const M: usize>(
        nodes: [f64; S],
        rule: &Rule<M>,
        gamma: f64,
        order: u32,
    ) -> Self {
        let mut tableau = Self {
            stages: S,
            order,
            one_sided: order % 2 == 1,
            nodes: [0.0; STAGES],
            weights: [0.0; STAGES],
            matrix: [[0.0; STAGES]; STAGES],
            inverse: [[0.0; STAGES]; STAGES],
            gamma,
            points: [Point {
                node: 0.0,
                weight: 0.0,
                position: [0.0; STAGES],
                velocity: [0.0; STAGES],
            }; POINTS],
        };
        let mut i = 0;
        while i < S {
            tableau.nodes[i] = nodes[i];
            i += 1;
        }
        i = 0;
        while i < S {
            let mut j = 0;
            while j < S {
                tableau.matrix[i][j] = integral(&nodes, j, nodes[i]);
                j += 1;
            }
            tableau.weights[i] = integral(&nodes, i, 1.0);
            i += 1;
        }
        tableau.inverse = inverse(&tableau.matrix, S);
        tableau.along(rule)
    }

    /// Fills in what belongs to the nodes of a rule along the step.
    const fn along<const M: usize>(mut self, rule: &Rule<M>) -> Self {
        let mut i = 0;
        while i < M {
            let (mut position, mut j) = ([0.0; STAGES], 0);
            while j < self.stages {
                position[j] = self.integral(j, rule.nodes[i]) - 0.5 * self.weights[j];
                j += 1;
            }
            let (node, weight) = (rule.nodes[i], rule.weights[i]);
            self.points[i] = Point { node, weight, position, velocity: self.velocity(node) };
            i += 1;
        }
        self
    }

    /// The points of the rule along the step.
    pub(crate) fn points(&self) -> &[Point] {
        &self.points[..self.stages + 2]
    }

    /// The coefficients `ℓ_j(τ)` of the velocity at the fraction `τ` of the step, inside or outside.
    pub(crate) const fn velocity(&self, tau: f64) -> Numbers {
        let (mut coefficients, mut j) = ([0.0; STAGES], 0);
        while j < self.stages {
            coefficients[j] = lagrange(&self.nodes, self.stages, j, tau);
            j += 1;
        }
        coefficients
    }

    const fn integral(&self, j: usize, tau: f64) -> f64 {
        integral_of(&self.nodes, self.stages, j, tau)
    }
}

/// The Lagrange polynomial of the `j`-th of the first `len` nodes at `τ`.
const fn lagrange(nodes: &[f64], len: usize, j: usize, tau: f64) -> f64 {
    let (mut product, mut m) = (1.0, 0);
    while m < len {
        if m != j {
            product *= (tau - nodes[m]) / (nodes[j] - nodes[m]);
        }
        m += 1;
    }
    product
}

/// Its integral from 0 to `τ`, by a rule that is exact to degree 11.
const fn integral_of(nodes: &[f64], len: usize, j: usize, tau: f64) -> f64 {
    let (mut sum, mut m) = (0.0, 0);
    while m < SIX.nodes.len() {
        sum += SIX.weights[m] * lagrange(nodes, len, j, tau * SIX.nodes[m]);
        m += 1;
    }
    tau * sum
}

const fn integral<const S: usize>(nodes: &[f64; S], j: usize, tau: f64) -> f64 {
    integral_of(nodes, S, j, tau)
}

/// The inverse of the leading block of a matrix, by the algorithm of Gauss and Jordan with row pivoting.
const fn inverse(matrix: &[Numbers; STAGES], len: usize) -> [Numbers; STAGES] {
    let (mut a, mut inverse) = (*matrix, [[0.0; STAGES]; STAGES]);
    let mut i = 0;
    while i < len {
        inverse[i][i] = 1.0;
        i += 1;
    }
    let mut k = 0;
    while k < len {
        let (mut pivot, mut row) = (k, k);
        while row < len {
            if a[row][k].abs() > a[pivot][k].abs() {
                pivot = row;
            }
            row += 1;
        }
        let (upper, upper_inverse) = (a[k], inverse[k]);
        (a[k], inverse[k]) = (a[pivot], inverse[pivot]);
        (a[pivot], inverse[pivot]) = (upper, upper_inverse);
        let (scale, mut j) = (1.0 / a[k][k], 0);
        while j < len {
            a[k][j] *= scale;
            inverse[k][j] *= scale;
            j += 1;
        }
        row = 0;
        while row < len {
            if row != k {
                let factor = a[row][k];
                j = 0;
                while j < len {
                    a[row][j] -= factor * a[k][j];
                    inverse[row][j] -= factor * inverse[k][j];
                    j += 1;
                }
            }
            row += 1;
        }
        k += 1;
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> impl Iterator<Item = &'static Tableau> {
        GAUSS.iter().chain(&RADAU)
    }

    /// `Σ b_i c_i^{k−1} = 1/k` up to the order and no further, and `Σ a_ij c_j^{k−1} = c_i^k/k` for `k ≤ s`.
    #[test]
    fn the_conditions_of_order_hold() {
        for tableau in all() {
            let s = tableau.stages;
            let quadrature = |k: i32| {
                let sum: f64 =
                    (0..s).map(|i| tableau.weights[i] * tableau.nodes[i].powi(k - 1)).sum();
                (sum - f64::from(k).recip()).abs()
            };
            let order = tableau.order.cast_signed();
            assert!((1..=order).all(|k| quadrature(k) < 4e-16), "{tableau:?}");
            assert!(quadrature(order + 1) > 1e-6, "{tableau:?}");
            for k in 1..=i32::try_from(s).unwrap() {
                for i in 0..s {
                    let row: f64 =
                        (0..s).map(|j| tableau.matrix[i][j] * tableau.nodes[j].powi(k - 1)).sum();
                    let off = row - tableau.nodes[i].powi(k) / f64::from(k);
                    assert!(off.abs() < 4e-16, "{s} stages, row {i}, degree {k}: {off:e}");
                }
            }
        }
    }

    #[test]
    fn the_inverse_is_one() {
        for tableau in all() {
            for i in 0..tableau.stages {
                for j in 0..tableau.stages {
                    let product: f64 = (0..tableau.stages)
                        .map(|k| tableau.inverse[i][k] * tableau.matrix[k][j])
                        .sum();
                    assert!((product - f64::from(u8::from(i == j))).abs() < 4e-15);
                }
            }
        }
    }

    /// `γ²` is the least of the products of an eigenvalue with its conjugate: `det(A² − 2 Re λ A + γ²) = 0` is
    /// singular for some real part. Here by the norm of large negative powers, which grows like `γ^{−k}`.
    #[test]
    fn gamma_is_the_least_modulus_of_an_eigenvalue() {
        for tableau in all() {
            let s = tableau.stages;
            let norm_after = |powers: i32| {
                let mut v = [1.0, 0.3, -0.7, 0.4];
                for _ in 0..powers {
                    let mut next = [0.0; STAGES];
                    for (next, row) in next.iter_mut().zip(&tableau.inverse).take(s) {
                        *next = tableau.gamma * (0..s).map(|j| row[j] * v[j]).sum::<f64>();
                    }
                    v = next;
                }
                v[..s].iter().map(|v| v * v).sum::<f64>().sqrt()
            };
            let (early, late) = (norm_after(400), norm_after(2400));
            assert!((late / early).ln().abs() < 6.0, "{s} stages: {early}, {late}");
        }
    }

    /// The rule along the step is the Gauss rule, at the positions `∫₀^τ u'` for `u' = 1`.
    #[test]
    fn the_rule_along_a_step_has_its_degree() {
        for tableau in all() {
            let s = tableau.stages;
            for power in 0..i32::try_from(2 * s + 4).unwrap() {
                let sum = tableau.points().iter().fold(0.0, |sum, point| {
                    let rates: f64 = point.velocity.iter().sum();
                    let position: f64 = point.position.iter().sum();
                    sum + point.weight * rates * (position + 0.5).powi(power)
                });
                let exact = f64::from(power + 1).recip();
                assert!((sum - exact).abs() < 1e-15, "{s} stages, degree {power}: {sum}");
            }
        }
    }
}
