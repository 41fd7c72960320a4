//! The differentials of energy and entropy, site by site.

use metriplectic_fields::Column;

use super::dimension;
use crate::model::{Model, VectorOf};
use crate::pool::Buffer;

/// The differentials of energy and entropy at each site. A differential of the entropy that is the same at all sites, as of
/// an entropy that is a variable, stands there once.
#[derive(Clone, Debug)]
pub(crate) struct Differentials {
    pub(super) numbers: Buffer<f64>,
    /// The differential of the entropy at all sites; `None` if each site has its own, behind the one of the energy.
    pub(super) entropy: Option<Vec<f64>>,
}

/// Differentials that are read site by site.
pub(crate) struct AtSites<'a, P: Model> {
    rows: &'a [<VectorOf<P> as Column<f64>>::Row],
    /// The differential of the entropy, if it is the same at all sites.
    entropy: Option<VectorOf<P>>,
}

impl Differentials {
    #[inline]
    pub(crate) fn reader<P: Model>(&self) -> AtSites<'_, P> {
        let same = self.entropy.as_ref();
        let same = same.map(|numbers| VectorOf::<P>::from_index(|k| numbers[k]));
        let entropy = if P::ENTROPY { same } else { Some(VectorOf::<P>::zero()) };
        AtSites { rows: VectorOf::<P>::rows(&self.numbers), entropy }
    }
}

impl<P: Model> Copy for AtSites<'_, P> {}

impl<P: Model> Clone for AtSites<'_, P> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<P: Model> AtSites<'_, P> {
    /// Reads the differentials of energy and entropy at a site.
    #[inline(always)]
    pub(crate) fn at(&self, site: usize) -> [VectorOf<P>; 2] {
        match self.entropy {
            Some(entropy) => [VectorOf::<P>::of_row(&self.rows[site]), entropy],
            None => [2 * site, 2 * site + 1].map(|row| VectorOf::<P>::of_row(&self.rows[row])),
        }
    }
}

/// The differentials of energy and entropy at a site.
#[inline]
pub(crate) fn differentials_at<P: Model>(all: &Differentials, site: usize) -> [VectorOf<P>; 2] {
    all.reader::<P>().at(site)
}

/// The numbers of a site among the differentials.
pub(super) const fn width<P: Model>(same_entropy: bool) -> usize {
    if P::ENTROPY && !same_entropy { 2 * dimension::<P>() } else { dimension::<P>() }
}
