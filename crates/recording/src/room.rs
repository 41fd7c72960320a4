//! Room for the registers of a sweep, which each thread keeps for the next one.

use std::any::{Any, TypeId};
use std::cell::RefCell;

/// The registers of a sweep and their weights.
pub(crate) struct Room<D> {
    pub(crate) values: Vec<D>,
    pub(crate) weights: Vec<D>,
}

thread_local! {
    /// The room for each scalar: a few of them, so that a list is faster than a map.
    static ROOMS: RefCell<Vec<(TypeId, Box<dyn Any>)>> = const { RefCell::new(Vec::new()) };
}

/// Lends the room of this thread. A call within `f` for the same scalar gets another one.
#[inline]
pub(crate) fn with<D: 'static, R>(f: impl FnOnce(&mut Room<D>) -> R) -> R {
    let id = TypeId::of::<D>();
    let kept = ROOMS.with_borrow_mut(|rooms| {
        let place = rooms.iter().position(|(kept, _)| *kept == id)?;
        Some(rooms.swap_remove(place).1)
    });
    let kept = kept.and_then(|room| room.downcast::<Room<D>>().ok());
    let mut room =
        kept.unwrap_or_else(|| Box::new(Room { values: Vec::new(), weights: Vec::new() }));
    let result = f(&mut room);
    // A room that a call within `f` has left is replaced, so that there is one of each kind.
    ROOMS.with_borrow_mut(|rooms| {
        rooms.retain(|(kept, _)| *kept != id);
        rooms.push((id, room));
    });
    result
}
