//! Systems whose friction is known as a sum of terms.

use std::rc::Rc;
use std::sync::Arc;

use crate::{Apart, Covectors, Differences, Equations, VerifiedEquations};

/// Takes a term `ρ b bᵀ` of a friction: its rate `ρ`, and the entries of `b` that are not zero, as pairs of a direction and a number.
pub type Terms<'a> = dyn FnMut(f64, &[(usize, f64)]) + 'a;

/// A system whose friction is known as a sum of terms, `K = Σ_r ρ_r b_r b_rᵀ` with `ρ_r ≥ 0` and `⟨dH, b_r⟩ = 0`. Its thermal noise is
/// made of them, `√(2 k_B ρ_r) b_r` for each.
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not say the terms of its friction, of which its thermal noise is made",
    label = "this system has no `FrictionTerms`",
    note = "a term `ρ b bᵀ` of the friction has the noise `√(2 k_B ρ) b`: implement `FrictionTerms`, which says how many terms there are \
            and lists them"
)]
pub trait FrictionTerms: Equations {
    /// Returns how many terms there are, at every state.
    fn term_count(&self) -> usize;

    /// Lists the terms at a state with these covectors of energy and entropy, always in the same order: calls `term` with the rate `ρ` of
    /// each, and with the entries of `b` that are not zero, as pairs of a direction and a number.
    fn terms(&self, t: f64, x: &[f64], w: Covectors<'_>, term: &mut Terms<'_>);
}

macro_rules! passed_on {
    ($($type:ty: [$($bounds:tt)*] $this:ident => $other:expr;)+) => {$(
        impl<S: FrictionTerms $($bounds)*> FrictionTerms for $type {
            fn term_count(&self) -> usize {
                let $this = self;
                $other.term_count()
            }

            fn terms(
                &self,
                t: f64,
                x: &[f64],
                w: Covectors<'_>,
                term: &mut Terms<'_>,
            ) {
                let $this = self;
                $other.terms(t, x, w, term);
            }
        }
    )+};
}

passed_on! {
    &S: [+ ?Sized] this => (**this);
    Box<S>: [+ ?Sized] this => (**this);
    Rc<S>: [+ ?Sized] this => (**this);
    Arc<S>: [+ ?Sized] this => (**this);
    Differences<S>: [+ Apart] this => this.0;
    VerifiedEquations<S>: [] this => this.inner();
}
