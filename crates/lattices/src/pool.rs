//! Arrays that are used again, so that steps allocate none.

use std::fmt;
use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex, PoisonError};

/// Arrays that nobody uses at the moment.
pub(crate) struct Pool<T>(Arc<Mutex<Vec<Vec<T>>>>);

impl<T> Clone for Pool<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T> Default for Pool<T> {
    fn default() -> Self {
        Self(Arc::default())
    }
}

impl<T> Pool<T> {
    /// An array of this length, with numbers that mean nothing if it was used before; a new one is `fresh()`.
    pub(crate) fn take(&self, length: usize, fresh: impl FnOnce() -> Vec<T>) -> Buffer<T> {
        let used = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let items = used.filter(|items| items.len() == length).unwrap_or_else(fresh);
        Buffer { items, pool: self.clone() }
    }

    /// Gives up the arrays that nobody uses.
    pub(crate) fn clear(&self) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }

    /// Puts an array in place of those that come from elsewhere.
    pub(crate) fn adopt(&self, items: Vec<T>) -> Buffer<T> {
        Buffer { items, pool: self.clone() }
    }
}

impl Pool<f64> {
    pub(crate) fn numbers(&self, length: usize) -> Buffer<f64> {
        self.take(length, || vec![0.0; length])
    }
}

/// An array that goes back to its pool.
pub(crate) struct Buffer<T> {
    items: Vec<T>,
    pool: Pool<T>,
}

impl<T> Buffer<T> {
    pub(crate) const fn pool(&self) -> &Pool<T> {
        &self.pool
    }
}

impl<T> Drop for Buffer<T> {
    fn drop(&mut self) {
        let items = std::mem::take(&mut self.items);
        if items.capacity() > 0 {
            self.pool.0.lock().unwrap_or_else(PoisonError::into_inner).push(items);
        }
    }
}

impl<T: Clone> Clone for Buffer<T> {
    fn clone(&self) -> Self {
        let mut copy = self.pool.take(self.items.len(), || self.items.clone());
        copy.items.clone_from_slice(&self.items);
        copy
    }
}

impl<T: fmt::Debug> fmt::Debug for Buffer<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(&self.items).finish()
    }
}

impl<T: PartialEq> PartialEq for Buffer<T> {
    fn eq(&self, other: &Self) -> bool {
        self.items == other.items
    }
}

impl<T> Deref for Buffer<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        &self.items
    }
}

impl<T> DerefMut for Buffer<T> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.items
    }
}
