//! Laws made independent of each other, from the Gram matrix of their differentials alone.

use metriplectic_integrators::explicit::ProjectionError;

use crate::neighbours::Shared;

/// The independent fraction of a differential below which it is a combination of others. Products of differentials
/// have lost half of the digits.
const INDEPENDENT: f64 = 3e-7;

/// The products `⟨w_a, w_b⟩` of the differentials of the laws, and the sizes `Σ_i |∂_iF_a x_i|` of their terms.
#[derive(Clone, Debug)]
pub(crate) struct Gram {
    laws: usize,
    /// Row by row, of which only the entries with `b ≤ a` are set.
    pub(crate) products: Vec<f64>,
    pub(crate) slopes: Vec<f64>,
}

impl Gram {
    pub(crate) fn new(laws: usize) -> Self {
        Self { laws, products: vec![0.0; laws * laws], slopes: vec![0.0; laws] }
    }

    pub(crate) fn plus(mut self, other: &Self) -> Self {
        self.products.iter_mut().zip(&other.products).for_each(|(sum, part)| *sum += part);
        self.slopes.iter_mut().zip(&other.slopes).for_each(|(sum, part)| *sum += part);
        self
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.products.iter().chain(&self.slopes).all(|number| number.is_finite())
    }
}

impl Shared for Gram {
    fn list(&self) -> Vec<f64> {
        [&self.products[..], &self.slopes].concat()
    }

    fn of_list(&self, list: &[f64]) -> Self {
        let (products, slopes) = list.split_at(self.products.len());
        Self { laws: self.laws, products: products.to_vec(), slopes: slopes.to_vec() }
    }
}

/// A law at a state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Law {
    /// The target less the value.
    pub(crate) residual: f64,
    /// The sizes of its target and its terms.
    pub(crate) size: f64,
}

/// A law without the part that depends on the laws before it.
#[derive(Clone, Debug)]
struct Normal {
    /// Its share `l_b` of each law before it: `n = w − Σ_b l_b n_b`.
    shares: Vec<f64>,
    /// The square of the length of `n`.
    square: f64,
    residual: f64,
    round_off: f64,
    dependent: bool,
    /// Its residual and its round-off with the part that depends on others.
    whole: [f64; 2],
}

impl Normal {
    /// The residual in units of its round-off. What depends on other laws has their residual.
    fn excess(&self) -> f64 {
        if self.dependent { 0.0 } else { ratio(self.residual, self.round_off) }
    }
}

fn ratio(residual: f64, round_off: f64) -> f64 {
    if residual == 0.0 { 0.0 } else { residual.abs() / round_off }
}

/// The laws in their order: energy, further sums, entropy.
#[derive(Clone, Debug)]
pub(crate) struct Normals {
    all: Vec<Normal>,
    has_entropy: bool,
}

impl Normals {
    /// The decomposition `G = L D Lᵀ`, in which a dependent law has no part.
    pub(crate) fn new(gram: &Gram, laws: &[Law], has_entropy: bool) -> Self {
        let mut all: Vec<Normal> = Vec::with_capacity(laws.len());
        for (a, law) in laws.iter().enumerate() {
            let product = |b: usize| gram.products[a * gram.laws + b];
            let round_off = f64::EPSILON * (law.size + gram.slopes[a]);
            let mut normal = Normal {
                shares: Vec::with_capacity(a),
                square: product(a),
                residual: law.residual,
                round_off,
                dependent: false,
                whole: [law.residual, round_off],
            };
            for (b, before) in all.iter().enumerate() {
                let known = (0..b)
                    .fold(0.0, |sum, c| sum + normal.shares[c] * all[c].square * before.shares[c]);
                let share =
                    if before.dependent { 0.0 } else { (product(b) - known) / before.square };
                normal.square -= share * share * before.square;
                normal.residual -= share * before.residual;
                normal.round_off += share.abs() * before.round_off;
                normal.shares.push(share);
            }
            let independent = normal.square > INDEPENDENT * INDEPENDENT * product(a);
            normal.dependent = !independent;
            if normal.dependent {
                normal.square = 0.0;
            }
            all.push(normal);
        }
        Self { all, has_entropy }
    }

    fn of_entropy(&self) -> Option<&Normal> {
        self.all.last().filter(|_| self.has_entropy)
    }

    fn conserved(&self) -> &[Normal] {
        &self.all[..self.all.len() - usize::from(self.has_entropy)]
    }

    /// The residual of the entropy, less what the other laws make of it, and its round-off.
    pub(crate) fn entropy(&self) -> [f64; 2] {
        self.of_entropy().map_or([0.0; 2], |entropy| [entropy.residual, entropy.round_off])
    }

    /// The residual of the entropy in units of its round-off, if no other law has a larger one; zero otherwise.
    pub(crate) fn entropy_excess(&self) -> f64 {
        let entropy = self.of_entropy().map_or(0.0, Normal::excess);
        if self.conserved().iter().all(|law| law.excess() <= entropy) { entropy } else { 0.0 }
    }

    /// The residual of the entropy in units of its round-off, whatever it depends on.
    pub(crate) fn off(&self) -> f64 {
        self.of_entropy().map_or(0.0, |entropy| ratio(entropy.whole[0], entropy.whole[1]))
    }

    /// Returns whether a law is dependent and has another value than the laws on which it depends.
    pub(crate) fn leaves_out(&self, with_entropy: bool) -> bool {
        let asked = self.conserved().iter().chain(self.of_entropy().filter(|_| with_entropy));
        asked.into_iter().any(|law| law.dependent && law.residual.abs() > law.round_off)
    }

    /// The largest residual in units of its round-off.
    ///
    /// # Errors
    ///
    /// [`ProjectionError::NoEntropy`] if the entropy depends on the other laws, and has another value.
    pub(crate) fn excess(&self, with_entropy: bool) -> Result<f64, ProjectionError> {
        let conserved = self.conserved().iter().map(Normal::excess).fold(0.0, f64::max);
        match self.of_entropy() {
            Some(entropy) if with_entropy => {
                if entropy.dependent && entropy.residual.abs() > entropy.round_off {
                    return Err(ProjectionError::NoEntropy);
                }
                Ok(conserved.max(entropy.excess()))
            }
            _ => Ok(conserved),
        }
    }

    /// The coefficients `c_a` of the correction `Σ_a c_a w_a`.
    pub(crate) fn correction(&self, with_entropy: bool) -> Vec<f64> {
        let mut coefficients = vec![0.0; self.all.len()];
        for (a, normal) in self.all.iter().enumerate().rev() {
            let is_entropy = self.has_entropy && a + 1 == self.all.len();
            if normal.dependent || is_entropy && !with_entropy {
                continue;
            }
            // Those behind it have taken their shares of it already.
            coefficients[a] += normal.residual / normal.square;
            let own = coefficients[a];
            for (b, share) in normal.shares.iter().enumerate() {
                coefficients[b] -= share * own;
            }
        }
        coefficients
    }
}
