//! Loops over the numbers of a chunk in blocks of whole sites that stay in the first cache.

use std::ops::Range;

/// The numbers of a block, unless one site has more.
pub(crate) const BLOCK: usize = 240;

/// The sites of a block, of so many numbers each.
pub(crate) const fn sites_of(stride: usize) -> usize {
    match BLOCK.checked_div(stride) {
        None | Some(0) => 1,
        Some(sites) => sites,
    }
}

/// Room for a block.
pub(crate) struct Room<T> {
    few: [T; BLOCK],
    many: Vec<T>,
}

impl<T: Copy> Room<T> {
    /// For blocks of sites with so many items each.
    #[inline]
    pub(crate) fn of(stride: usize, zero: T) -> Self {
        let many = if stride > BLOCK { vec![zero; stride] } else { Vec::new() };
        Self { few: [zero; BLOCK], many }
    }

    #[inline]
    pub(crate) fn items(&mut self, count: usize) -> &mut [T] {
        if self.many.is_empty() { &mut self.few[..count] } else { &mut self.many[..count] }
    }
}

/// The sites of a range, block by block.
pub(crate) fn blocks(sites: Range<usize>, stride: usize) -> impl Iterator<Item = Range<usize>> {
    let (count, end) = (sites_of(stride), sites.end);
    sites.step_by(count).map(move |first| first..end.min(first + count))
}

/// Writes `h Σ_j w_j v_j` for the numbers from `start` on, the terms one after the other.
#[inline]
pub(crate) fn combine(out: &mut [f64], start: usize, h: f64, terms: &[(f64, &[f64])]) {
    let end = start + out.len();
    let Some((&(w, v), mut left)) = terms.split_first() else { return out.fill(0.0) };
    let factor = if left.is_empty() { h } else { 1.0 };
    for (out, v) in out.iter_mut().zip(&v[start..end]) {
        *out = factor * (w * v);
    }
    while let Some((some, rest)) = left.split_first_chunk::<3>() {
        let factor = if rest.is_empty() { h } else { 1.0 };
        add(out, some.map(|(w, v)| (w, &v[start..end])), factor);
        left = rest;
    }
    match left {
        [] => {}
        [(w, v)] => add(out, [(*w, &v[start..end])], h),
        [(a, v), (b, w), ..] => add(out, [(*a, &v[start..end]), (*b, &w[start..end])], h),
    }
}

/// Adds a few terms `w_j v_j`, one after the other, and multiplies by a factor, in one pass.
#[inline]
fn add<const K: usize>(out: &mut [f64], terms: [(f64, &[f64]); K], factor: f64) {
    let terms = terms.map(|(w, v)| (w, &v[..out.len()]));
    for (i, out) in out.iter_mut().enumerate() {
        *out = factor * terms.iter().fold(*out, |sum, (w, v)| sum + w * v[i]);
    }
}
