//! A function of two values.

/// Applies `f` to both: what `array::map` does, in a text that is compiled a hundred times faster. Functions of a flow are compiled
/// for each flow.
#[inline]
pub(crate) fn both<T, U>([first, second]: [T; 2], mut f: impl FnMut(T) -> U) -> [U; 2] {
    [f(first), f(second)]
}
