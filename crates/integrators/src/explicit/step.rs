//! One explicit step.

use metriplectic_dynamics::SecondLaw;

use super::chebyshev;
use super::creep;
use super::dormand_prince::{EIGHT, FIVE};
use super::estimates::{is_at_the_edge, of_the_ledger};
use super::flow::StageFlow;
use super::landing::{Landed, Onto};
use super::memory::{LastStep, MemoryOf, Produced};
use super::refused::Refused;
use super::rest::{self, is_hardly};
use super::stage::{Here, combined, produced, stage};
use super::tableau::{Compiled, Row, STAGES, Stages, Tableau};
use super::trial::{Kind, Trial};
use crate::step::failure::HALVES;
use crate::step::{
    Effort, Element, EntropyStep, Evidence, Memory as _, MethodError, Refusal, StepError,
    StepStart, Taken, Vector,
};

/// Falls of the entropy in a row after which a state that hardly moves is held.
/// A factor of four fails `tests/dense_output.rs::the_states_inside_a_step_in_parts_are_those_of_the_motion`.
const FALLS: u32 = 5;
/// Falls in a row after which a model is wrong, even if its friction produces entropy. A step beyond the edge of stability
/// falls too, and a smaller one does not: the first steps of a stiff model may be 10³ times too long.
const MANY_FALLS: u32 = 24;

/// Tries a step.
#[inline]
pub(super) fn attempt<F: StageFlow, K: Kind>(
    trial: &Trial<'_, F>,
    memory: &mut MemoryOf<F>,
) -> Result<Taken<F>, Refusal> {
    let refused = match try_step::<F, K>(trial, memory) {
        Ok(taken) => return Ok(taken),
        Err(refused) => refused,
    };
    // What the state misses is judged as the error of the step.
    match waited(trial, &refused, memory) {
        Some(waited) => Ok(waited),
        None => Err(refused.into_refusal(trial.start.time, trial.h)),
    }
}

/// Takes a step of a fixed size, in halves where it is refused.
pub(super) fn with_halves<F: StageFlow, K: Kind>(
    trial: &Trial<'_, F>,
    memory: &mut MemoryOf<F>,
) -> Result<Taken<F>, StepError> {
    let first = match try_step::<F, K>(trial, memory) {
        Ok(whole) => return Ok(whole),
        Err(Refused::Never(error)) => return Err(error),
        Err(refused) => refused,
    };
    let kept = memory.clone();
    halves::<F, K>(trial, memory, HALVES).map_err(|refused| {
        // What the parts that were taken have left belongs to no state of the run.
        *memory = kept;
        let tried = Effort { splits: HALVES as usize, ..Effort::default() };
        let (time, h) = (trial.start.time, trial.h);
        // A site that leaves in the whole step says more than a small part that finds no end.
        let refused = if let Refused::Outside(Some(_)) = first { first } else { refused };
        match refused {
            Refused::Outside(Some(site)) => StepError::SiteOutOfDomain { time, h, site, tried },
            Refused::Outside(None) => StepError::OutOfDomain { time, h, tried },
            Refused::Far => StepError::NotProjected { time, h, tried },
            Refused::Falls(rise) => StepError::EntropyFalls { time, h, rise },
            Refused::Never(error) => error,
        }
    })
}

fn halves<F: StageFlow, K: Kind>(
    trial: &Trial<'_, F>,
    memory: &mut MemoryOf<F>,
    left: u32,
) -> Result<Taken<F>, Refused> {
    match try_step::<F, K>(trial, memory) {
        Err(Refused::Outside(_) | Refused::Far | Refused::Falls(_)) if left > 0 => {}
        Err(refused) => return waited(trial, &refused, memory).ok_or(refused),
        taken => return taken,
    }
    let (start, h) = (trial.start, 0.5 * trial.h);
    let first = halves::<F, K>(&Trial { h, ..*trial }, memory, left - 1)?;
    let mut reference = start.reference.clone();
    if first.evidence.dissipates {
        reference.entropy = first.values.entropy;
    }
    let (flow, x, values, time) = (start.flow, &first.x, first.values.clone(), start.time + h);
    let middle = StepStart { flow, x, time, values, reference, allowed: start.allowed.clone() };
    let second = Trial { tableau: trial.tableau, start: &middle, h };
    let mut second = halves::<F, K>(&second, memory, left - 1)?;
    second.effort += first.effort;
    second.effort.splits += 1;
    second.evidence = first.evidence.and(second.evidence);
    // The stages are those of the second half.
    memory.last = None;
    Ok(second)
}

/// The velocity at the start of a step, relative to that at its end, up to which a motion begins in it.
/// A factor of four fails `explicit/step.rs::a_motion_begins_where_its_velocity_is_nothing_beside_the_next`.
const BEGINS: f64 = 1e-3;

/// The step in which a state waits for what will move it, after one that was refused.
///
/// A force that grows from zero moves a state by a power of time, and does work by twice this power. Where this is beyond the
/// order of a method, it sees the motion and no work, and no state near by has this balance, however short the step.
#[cold]
fn waited<F: StageFlow>(
    trial: &Trial<'_, F>,
    refused: &Refused,
    memory: &mut MemoryOf<F>,
) -> Option<Taken<F>> {
    let &Trial { start, h, .. } = trial;
    let flow = start.flow;
    if !(flow.depends_on_time() && matches!(refused, Refused::Far | Refused::Falls(_))) {
        return None;
    }
    let Here { velocity, .. } = memory.here.clone()?;
    if !begins(flow, start.x, &velocity, h) {
        return None;
    }
    let x = flow.clocked(start.x, start.time + h)?;
    let values = flow.laws(&x);
    memory.clocked();
    memory.last = None;
    let (evidence, effort) = (Evidence::default(), Effort::default());
    Some(Taken { x, values, evidence, effort })
}

/// Returns whether the velocity at the start of a step is nothing beside the one at its end, to which the time leads.
fn begins<F: StageFlow>(flow: &F, x: &Element<F>, velocity: &F::Vector, h: f64) -> bool {
    let ahead = |v: &F::Vector| flow.rates(x, &v.map(|v| h * v));
    let Some(last) = ahead(velocity).and_then(|there| ahead(&there)) else { return false };
    (0..velocity.len()).all(|i| velocity.get(i).abs() <= BEGINS * last.get(i).abs())
}

/// Stages, end, projection, decision.
#[inline]
fn try_step<F: StageFlow, K: Kind>(
    trial: &Trial<'_, F>,
    memory: &mut MemoryOf<F>,
) -> Result<Taken<F>, Refused> {
    let &Trial { tableau, start, .. } = trial;
    let flow = start.flow;
    if let Some(fault) = tableau.fault {
        return Err(Refused::Never(StepError::Method {
            time: start.time,
            error: MethodError::new(fault),
        }));
    }
    // The stages of the step before it serve nobody any more, and leave their room.
    let room = memory.take_own_room();
    let here = match memory.here.take() {
        Some(here) => here,
        None => {
            let gradients = flow.gradients(start.x).ok_or(Refused::Outside(None))?;
            memory.round_off = flow.entropy_round_off_of(&gradients);
            here_at(flow, start.x, gradients).ok_or(Refused::Outside(None))?
        }
    };
    let mut last = room.unwrap_or_else(|| Box::new(LastStep::empty(&here.velocity)));
    match tableau.stages {
        // A constant, so that other methods are compiled without these stages.
        Stages::Chebyshev if const { K::IS_CHEBYSHEV } => {
            *last = chebyshev::stages(trial, here, memory)?;
        }
        Stages::Chebyshev | Stages::Rows(_) => stages::<F, K>(trial, here, &mut last)?,
    }
    let taken = finished(trial, &mut last, memory);
    if memory.here.is_some() {
        memory.last = Some(last);
    } else {
        // The state has stayed where it was.
        memory.here = Some(last.stages[0].clone());
        memory.room = Some(last);
    }
    taken
}

/// The end of a step from its stages: projection, decision.
#[inline]
fn finished<F: StageFlow>(
    trial: &Trial<'_, F>,
    last: &mut LastStep<F::Vector>,
    memory: &mut MemoryOf<F>,
) -> Result<Taken<F>, Refused> {
    let &Trial { tableau, start, h } = trial;
    let flow = start.flow;
    let x = start.x;
    // Friction may vanish at the start alone, as for a body at rest.
    let dissipates = last.stages[0].production != 0.0 || last.rise != 0.0;
    if let Some(lost) = &memory.lost {
        last.end = Vector::zip([&last.end, lost], |[end, lost]| end + lost);
    } else if !memory.read.is_empty() {
        let lost = |i| <[f64]>::get(&memory.read, i).copied().unwrap_or(0.0);
        last.end = last.end.with(|i| last.end.get(i) + lost(i));
    }
    let y = flow.stage(x, &last.end).ok_or_else(|| Refused::outside(flow, x, &last.end))?;
    let lost = flow.stage_rounding(x, (&last.end, &y));

    let produced = memory.entropy.unwrap_or_else(|| Produced::from(start.values.entropy));
    let round_off = memory.round_off;
    let projection = Onto { trial, last: &*last, produced, round_off };
    let Landed { end, produced, how } = match projection.decide(y) {
        Ok(landed) => landed,
        Err(Refused::Falls(rise)) => {
            memory.falls += 1;
            let velocity = &last.stages[0].velocity;
            let often = memory.falls > FALLS;
            let by_round_off = || {
                often
                    || (rest::is_short(flow, start, velocity, h)
                        && rest::is_reached(flow, start, velocity))
            };
            if is_hardly(flow, start, &last.end) && by_round_off() {
                if !often || rest::is_reached(flow, start, velocity) {
                    memory.falls = 0;
                    return Ok(held(start));
                }
                let round_off = flow.entropy_round_off([x, x]);
                if rise < -round_off || memory.falls > MANY_FALLS {
                    let time = start.time;
                    return Err(Refused::Never(StepError::EntropyFalls { time, h, rise }));
                }
            }
            return Err(Refused::Falls(rise));
        }
        Err(Refused::Outside(_)) => return Err(Refused::outside(flow, x, &last.end)),
        Err(refused) => return Err(refused),
    };
    let taken = memory.taken.wrapping_add(1);
    if taken.is_multiple_of(creep::PATIENCE)
        && let Some(rate) = creep::energy_rate(flow, start, &last.stages[0].velocity, &last.end)
    {
        let time = start.time;
        return Err(Refused::Never(StepError::WrongDerivative { time, h, rate }));
    }
    let values = flow.values(&end.gradients);
    let round_off = flow.entropy_round_off_of(&end.gradients);
    // Arrays of many sites are given up before the next ones are made.
    last.end = last.end.zero();
    let Some(next) = here_at(flow, &end.x, end.gradients) else {
        return Err(Refused::outside(flow, x, &flow.stage_coordinates(x, &end.x)));
    };
    memory.lost = Some(lost);
    memory.read = Vec::new();
    last.end = flow.stage_coordinates(x, &end.x);
    let rates = flow.stage_rates(x, (&last.end, &end.x), &next.velocity);
    let rests = end.x == *x && is_zero(&last.stages[0].velocity);
    let stability =
        tableau.stability.is_finite() && is_at_the_edge((tableau, h), &flow.sizes(x), last, &rates);
    last.at_the_edge = stability;
    last.before = last.before.zero();
    last.stages[last.known] = Here { velocity: rates, production: next.production };
    last.known += 1;

    let entropy_step = (flow.entropy_law() == SecondLaw::Exact).then_some(how);
    let ledger = if flow.has_ledger() { of_the_ledger(tableau, flow, h, last) } else { None };
    let evidence =
        Evidence { dissipates, rests, entropy_step, stability, ledger, ..Evidence::default() };
    memory.entropy = Some(produced);
    memory.falls = 0;
    memory.taken = taken;
    memory.round_off = round_off;
    memory.here = Some(next);
    Ok(Taken { x: end.x, values, evidence, effort: Effort::default() })
}

/// The step that leaves the state where it is.
fn held<F: StageFlow>(start: &StepStart<'_, F>) -> Taken<F> {
    let evidence = Evidence { entropy_step: Some(EntropyStep::Held), ..Evidence::default() };
    let (x, values) = (start.x.clone(), start.values.clone());
    Taken { x, values, evidence, effort: Effort::default() }
}

/// Evaluates the velocity and the production at a state.
#[inline]
fn here_at<F: StageFlow>(
    flow: &F,
    x: &Element<F>,
    gradients: F::Gradients,
) -> Option<Here<F::Vector>> {
    let (velocity, production) = flow.velocity(x, &gradients)?;
    Some(Here { velocity, production })
}

/// The stages of a step, and the coordinates of its end, into the room for them.
#[inline]
fn stages<F: StageFlow, K: Kind>(
    trial: &Trial<'_, F>,
    here: Here<F::Vector>,
    last: &mut LastStep<F::Vector>,
) -> Result<(), Refused> {
    let &Trial { tableau, start, h } = trial;
    let rows = tableau.rows();
    let flow = start.flow;
    // A copy of plain numbers, which the compiler knows not to change: what all stages need of the start is computed once.
    let copy;
    let x = if std::mem::needs_drop::<Element<F>>() {
        start.x
    } else {
        copy = start.x.clone();
        &copy
    };
    let at = (flow, x, h);
    last.stages[0] = here;
    last.known = rows.len() + 1;
    /// With the rows as constants, whose sums the compiler writes out.
    macro_rules! compiled {
        ($tableau:ident: $($i:literal)*) => {{
            const COUNT: usize = $tableau.rows().len();
            $({
                const ROW: Row = $tableau.rows()[$i];
                add_stage(at, ROW, ($i, COUNT), last)?;
                release(tableau, &rows[$i + 1..], last);
            })*
            const END: Row = $tableau.end;
            last.end = combined(h, END, &last.stages);
            last.rise = h * produced(END, &last.stages);
        }};
    }
    match tableau.compiled {
        Some(Compiled::Eight) if const { K::MAY_BE_EIGHT } => {
            compiled!(EIGHT: 0 1 2 3 4 5 6 7 8 9 10);
        }
        Some(Compiled::Five) if const { K::MAY_BE_FIVE } => {
            compiled!(FIVE: 0 1 2 3 4);
        }
        _ => {
            for (i, row) in rows.iter().enumerate() {
                add_stage(at, row, (i, rows.len()), last)?;
                release(tableau, &rows[i + 1..], last);
            }
            last.end = combined(h, tableau.end, &last.stages);
            last.rise = h * produced(tableau.end, &last.stages);
        }
    }
    Ok(())
}

/// Gives up the arrays of stages that neither the rows to come nor the rest of the step need, if they are those of sites.
#[inline(always)]
fn release<V: Vector>(tableau: &Tableau, to_come: &[Row], last: &mut LastStep<V>) {
    if last.stages[0].velocity.sites().is_none() {
        return;
    }
    let needed = |stage: usize| to_come.iter().any(|row| row.iter().any(|&(j, _)| j == stage));
    for stage in tableau.passed().filter(|&stage| !needed(stage)) {
        last.stages[stage].velocity = last.stages[0].velocity.zero();
    }
}

/// The stage that row `i` makes, of so many. The estimate of stability needs the coordinates of the last one.
#[inline(always)]
fn add_stage<F: StageFlow>(
    (flow, x, h): (&F, &Element<F>, f64),
    row: Row,
    (i, count): (usize, usize),
    last: &mut LastStep<F::Vector>,
) -> Result<(), Refused> {
    let before = if i + 1 == count { Some(&mut last.before) } else { None };
    let Some((velocity, production)) = stage_of(flow, x, (h, row, &last.stages), before) else {
        return Err(Refused::outside(flow, x, &combined(h, row, &last.stages)));
    };
    last.stages[i + 1] = Here { velocity, production };
    Ok(())
}

/// The stage with these weights of those that are known.
#[inline(always)]
fn stage_of<F: StageFlow>(
    flow: &F,
    x: &Element<F>,
    (h, row, stages): (f64, Row, &[Here<F::Vector>; STAGES]),
    coordinates: Option<&mut F::Vector>,
) -> Option<(F::Vector, f64)> {
    if row.is_empty() {
        let q = stages[0].velocity.zero();
        let Here { velocity, production } = stage(flow, x, &q)?;
        if let Some(coordinates) = coordinates {
            *coordinates = q;
        }
        return Some((velocity, production));
    }
    let term = |j: usize| {
        let (stage, w) = row[j];
        (w, &stages[stage].velocity)
    };
    flow.stage_along(x, (h, row.len()), term, coordinates)
}

fn is_zero(v: &impl Vector) -> bool {
    (0..v.len()).all(|i| v.get(i) == 0.0)
}

#[cfg(test)]
mod tests {
    use metriplectic_dynamics::{Symplectic, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Vector2, vector};

    use super::*;
    use crate::step::Flow as _;

    #[test]
    fn a_motion_begins_where_its_velocity_is_nothing_beside_the_next() {
        // Beside the top of a hill, p' = κq from p = 0: after two steps of 1 by Euler's method p' is 1 + κ times as large.
        let is_beginning = |kappa: f64| {
            let system = System::on(Euclidean::<2>)
                .bracket(Symplectic)
                .energy(move |x: &Vector2<Real>| (x.y * x.y - x.x * x.x * kappa) * 0.5)
                .build()
                .unwrap();
            let x = vector![1.0, 0.0];
            let v = system.rates(&x, &system.sizes(&x).zero()).unwrap();
            begins(&system, &x, &v, 1.0)
        };
        assert!(is_beginning(2e3) && !is_beginning(5e2));
    }
}
