//! Damped Newton iterations `x ← x + λ δ`, `F'(x) δ = −F(x)`, for unknowns of any kind.

/// A root-finding problem, as [`solve`] asks for it.
pub trait Problem {
    /// An iterate: the unknown, and what is evaluated there.
    type Iterate;
    /// A correction `δ` of an iterate.
    type Correction;
    /// The root.
    type Root;
    /// The reason why there is no root.
    type Error;

    /// Computes the correction at an iterate, or accepts a root.
    ///
    /// # Errors
    ///
    /// If there is no correction: the Jacobian is singular, or the iterate is of no use.
    fn correct(
        &self,
        here: &Self::Iterate,
    ) -> Result<Progress<Self::Root, Self::Correction>, Self::Error>;

    /// Evaluates the iterate `x + λ δ` with `λ = length`; `None` if it has no value, or is no better than
    /// `here`. A shorter correction is tried then.
    fn advance(
        &self,
        here: &Self::Iterate,
        correction: &Self::Correction,
        length: f64,
    ) -> Option<Self::Iterate>;

    /// Decides on the last iterate, if it cannot be improved.
    ///
    /// # Errors
    ///
    /// If the last iterate is not a root.
    fn stop(
        &self,
        last: Self::Iterate,
        cause: Cause,
        iterations: usize,
    ) -> Result<Self::Root, Self::Error>;
}

/// The outcome of one linearisation.
#[derive(Clone, Copy, Debug)]
pub enum Progress<R, C> {
    /// The root.
    Root(R),
    /// A correction, and the first length at which it is tried.
    Correction(C, f64),
}

/// The reason why an iteration stops without a root.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// No length of the last correction improves the iterate.
    Stagnation,
    /// The iterations are used up.
    Limit,
}

/// How long Newton's method may try.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Corrections.
    pub iterations: usize,
    /// Halvings of one correction.
    pub halvings: usize,
}

/// Solves a problem by Newton's method from a start. A correction that does not improve the iterate is
/// halved.
///
/// # Errors
///
/// The errors of the problem.
pub fn solve<P: Problem>(
    problem: &P,
    start: P::Iterate,
    limits: Limits,
) -> Result<P::Root, P::Error> {
    let mut here = start;
    for iterations in 0..limits.iterations {
        let (correction, mut length) = match problem.correct(&here)? {
            Progress::Root(root) => return Ok(root),
            Progress::Correction(correction, length) => (correction, length),
        };
        let next = (0..=limits.halvings).find_map(|_| {
            let next = problem.advance(&here, &correction, length);
            length *= 0.5;
            next
        });
        match next {
            Some(next) => here = next,
            None => return problem.stop(here, Cause::Stagnation, iterations),
        }
    }
    problem.stop(here, Cause::Limit, limits.iterations)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `arctan x = 0`, for which Newton's method without damping diverges from `|x| > 1.39`.
    struct Arctangent;

    impl Problem for Arctangent {
        type Iterate = f64;
        type Correction = f64;
        type Root = f64;
        type Error = (Cause, usize);

        fn correct(&self, x: &f64) -> Result<Progress<f64, f64>, Self::Error> {
            let correction = -x.atan() * (1.0 + x * x);
            let solved = correction.abs() <= f64::EPSILON;
            Ok(if solved { Progress::Root(*x) } else { Progress::Correction(correction, 1.0) })
        }

        fn advance(&self, x: &f64, correction: &f64, length: f64) -> Option<f64> {
            let next = x + correction * length;
            (next.atan().abs() < x.atan().abs()).then_some(next)
        }

        fn stop(&self, _: f64, cause: Cause, iterations: usize) -> Result<f64, Self::Error> {
            Err((cause, iterations))
        }
    }

    #[test]
    fn damping_finds_a_root_from_afar() {
        let patient = Limits { iterations: 20, halvings: 20 };
        assert!(solve(&Arctangent, 20.0, patient).unwrap().abs() < 1e-15);
        let undamped = Limits { halvings: 0, ..patient };
        assert_eq!(solve(&Arctangent, 20.0, undamped), Err((Cause::Stagnation, 0)));
        let hasty = Limits { iterations: 2, ..patient };
        assert_eq!(solve(&Arctangent, 20.0, hasty), Err((Cause::Limit, 2)));
    }
}
