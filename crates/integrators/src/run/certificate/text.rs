//! The text of a certificate, line by line.

use std::fmt;

use metriplectic_dynamics::SecondLaw;
use metriplectic_equations::Evaluated;

use super::{
    Certificate, EventCount, InvariantBalance, MisjudgedSize, ProjectedSteps, RestInTime,
    StageBalance, UNRESOLVED, UnsureEvent,
};
use crate::round_off::bound::of_a_law;
use crate::run::jump::JumpBalance;
use crate::step::digits::{Digits, counted};
use crate::step::evidence::RESOLVED;
use crate::step::{Effort, LedgerErrors, LedgerSummary, LimitingSites, NoiseSummary};

/// The local error from which on a hundred steps may be off by what a picture shows: about 27 steps of the midpoint rule
/// in a turn.
/// A factor of four fails `run/certificate/tests.rs::one_is_no_plural`.
const COARSE: f64 = 1e-3;
/// This bound inside a step with stages, whose end is more accurate.
/// A factor of four fails `run/certificate/tests.rs::one_is_no_plural`.
const COARSE_INSIDE: f64 = 1e-2;

impl fmt::Display for Certificate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let steps = counted(self.steps, "step", "steps");
        let (error, relative) = (self.max_energy_error, self.relative_to());
        let law = match (&self.exchange, self.jumps.is_empty()) {
            (None, true) => "|H − H₀|",
            _ => "|ΔH − W − Q|",
        };
        if !self.promises.energy {
            writeln!(f, "first law:   not promised; {law} ≤ {error:.1e}{relative}, over {steps}")?;
        } else if self.keeps_energy() {
            writeln!(f, "first law:   {law} ≤ {error:.1e}{relative}, over {steps}")?;
        } else {
            let allowed = of_a_law(self.energy_scale);
            writeln!(
                f,
                "first law:   BROKEN: {law} = {error:.1e}{relative}, round-off is {allowed:.1e}, over {steps}"
            )?;
        }
        self.exchanged(f)?;
        self.jumped(f)?;
        self.looked(f)?;
        match self.second_law {
            SecondLaw::NoEntropy => writeln!(f, "second law:  no entropy"),
            _ if let Some(noise) = &self.noise => self.fluctuation(noise, f),
            _ if !self.promises.entropy => {
                writeln!(f, "second law: not promised; {}", self.entropy_line())
            }
            _ => writeln!(f, "second law:  {}", self.entropy_line()),
        }?;
        if let Some(size) = self.default_friction {
            writeln!(
                f,
                "friction:    of the metric, by default: κ = 1, |K| = |dH|² = {size:.1e} at the start"
            )?;
        }
        if self.projected {
            writeln!(f, "friction:    projected so that K dH = 0, not quite the tensor given")?;
        }
        if self.noise.is_some() && self.friction > RESOLVED {
            writeln!(
                f,
                "friction not resolved: h|K'| = {:.1e} in the worst step; the law is off by its square where it exceeds 1",
                self.friction
            )?;
        } else if self.is_stiff() {
            writeln!(f, "friction not damped: h|K'| = {:.1e}; `Radau` damps it", self.friction)?;
        }
        for (index, kept) in self.invariants.iter().enumerate() {
            let InvariantBalance { kind, initial, max_error, .. } = kept;
            writeln!(
                f,
                "{:<13}{}|L − L₀| ≤ {max_error:.1e}, L₀ = {}",
                format!("{kind} {}:", index + 1),
                if !self.promises.invariants {
                    "not promised; "
                } else if kept.is_kept() {
                    ""
                } else {
                    "BROKEN: "
                },
                Digits(*initial)
            )?;
        }
        writeln!(f, "manifold:    defect ≤ {:.1e}", self.max_manifold_defect)?;
        if self.checked_states > 0 {
            let states = counted(self.checked_states, "state", "states");
            let before = if self.verified_before { "verified before the run; " } else { "" };
            writeln!(f, "model:       {before}its laws were checked at {states}")?;
        }
        if !self.evaluated.is_empty() {
            let fields: Vec<_> = self.evaluated.iter().map(Evaluated::to_string).collect();
            writeln!(f, "fields:      {}", fields.join("; "))?;
        }
        if self.smallest_step < self.largest_step || self.rejected > 0 {
            write!(
                f,
                "step sizes:  {:.1e} to {:.1e}, {} rejected",
                self.smallest_step, self.largest_step, self.rejected
            )?;
            if let Some(site) = self.limiting_sites.error
                && !self.is_limited_by_stability()
            {
                write!(f, "; the largest error is at site {site}")?;
            }
            if self.exchange.is_some() && self.refuses_often() {
                write!(f, "; if what drives it has a corner, name its time by `.corners([..])`")?;
            }
            writeln!(f)?;
        }
        if let Some(RestInTime { steps, time, longest }) = self.rest_in_time {
            let steps = counted(steps, "step", "steps");
            writeln!(
                f,
                "at rest:     nothing changed the motion in {steps} of up to {longest:.1e}, a time of {time:.1e}; a shorter pulse may \
                 lie between the times that were looked at: name its `.corners`, or a `.largest_step`"
            )?;
        }
        self.accuracy(f)?;
        if let Some(MisjudgedSize { direction, judged, reached }) = self.misjudged_size {
            write!(f, "sizes:       ")?;
            if reached > judged {
                writeln!(
                    f,
                    "direction {direction} was estimated to have the size {judged:.1e} soon, and has grown to {reached:.1e}"
                )?;
            } else {
                writeln!(
                    f,
                    "errors in direction {direction} are relative to the size {judged:.1e}, and it has not exceeded \
                     {reached:.1e}; give it a smaller one by `.scale`"
                )?;
            }
        }
        if let Some(StageBalance { defect, surplus }) = self.stages {
            write!(f, "stages:      laws off by {defect:.1e} of their terms in the worst step")?;
            if surplus > 0.0 {
                write!(f, ", damping added {surplus:.1e} to S")?;
            }
            if self.skips_a_transient() {
                write!(
                    f,
                    ", {:.1e} of its gain: a transient is not resolved, and its heat may have warmed a wrong entry; let \
                     steps follow a tolerance",
                    surplus / self.entropy_gained.abs()
                )?;
            }
            writeln!(f)?;
        }
        self.projections(f)?;
        if self.effort == Effort::default() {
            return write!(f, "solver:      explicit steps, none split");
        }
        if self.effort.iterations == 0 {
            let splits = counted(self.effort.splits, "split", "splits");
            return write!(f, "solver:      explicit steps, {splits}");
        }
        write!(
            f,
            "solver:      {} ({} in the worst step), {}",
            counted(self.effort.iterations, "Newton iteration", "Newton iterations"),
            self.worst_iterations,
            counted(self.effort.splits, "retry", "retries")
        )?;
        if self.effort.continued > 0 {
            let steps = counted(self.effort.continued, "continuation", "continuations");
            write!(f, ", {steps} in the step size")?;
        }
        Ok(())
    }
}

impl Certificate {
    /// Says of the noise what it is, and that the second law holds in the mean.
    fn fluctuation(&self, noise: &NoiseSummary, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let NoiseSummary { k_b, terms, weak_order, numbers } = noise;
        let terms = counted(*terms, "term", "terms");
        writeln!(f, "noise:       k_B = {k_b:?}, {terms}, {numbers}; weak order {weak_order}")?;
        let name = if self.exchange.is_some() { "S + S of the baths" } else { "S" };
        let fall = -self.min_entropy_increment.min(0.0) / k_b;
        writeln!(
            f,
            "second law:  in the mean: {name} fluctuates; it fell on {} of {}, by at most {fall:.1} k_B",
            self.entropy_falls, self.steps
        )
    }

    /// Lists the work and the heat of an open system.
    fn exchanged(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(LedgerSummary { parameter, work, heat, .. }) = &self.exchange else {
            return Ok(());
        };
        let mut entries: Vec<String> =
            parameter.iter().map(|work| format!("parameter {work:.1e}")).collect();
        let named = |list: &[(std::sync::Arc<str>, f64)]| -> Vec<String> {
            list.iter().map(|(name, number)| format!("{name} {number:.1e}")).collect()
        };
        entries.extend(named(work));
        if !entries.is_empty() {
            writeln!(f, "work:        {}", entries.join(", "))?;
        }
        if !heat.is_empty() {
            writeln!(f, "heat:        {}", named(heat).join(", "))?;
        }
        let Some(LedgerErrors { work: of_work, heat: of_heat, entropy }) = self.exchange_errors
        else {
            return Ok(());
        };
        let errors = [("work", of_work), ("heat", of_heat), ("the entropy of a bath", entropy)];
        let known: Vec<String> = errors
            .iter()
            .filter(|(_, error)| *error != 0.0)
            .map(|(kind, error)| format!("{kind} {error:.1e}"))
            .collect();
        if !known.is_empty() {
            writeln!(f, "ledger:      estimated errors: {}", known.join(", "))?;
        }
        Ok(())
    }

    /// Lists the events at which the state has jumped.
    fn jumped(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for JumpBalance { name, count, work, heat, least_rise } in &self.jumps {
            write!(f, "jumps:       {name} {}, work {work:.1e}", counted(*count, "time", "times"))?;
            if *heat != 0.0 {
                write!(f, ", heat {heat:.1e}")?;
            }
            if *least_rise != 0.0 {
                write!(f, ", ΔS ≥ {least_rise:.1e}")?;
            }
            writeln!(f)?;
        }
        Ok(())
    }

    /// Says how often events have happened, and which were looked for where their function tells nothing.
    fn looked(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for EventCount { name, count } in &self.event_counts {
            writeln!(f, "events:      {name} {}", counted(*count, "time", "times"))?;
        }
        for UnsureEvent { name, steps, first } in &self.unsure_events {
            let steps = counted(*steps, "step", "steps");
            writeln!(
                f,
                "events:      {name} varies faster than looks at it tell, in {steps}, first at t = {}; some may be missing, \
                 ask for `.resolution(dt)`",
                Digits(*first)
            )?;
        }
        for name in &self.events_at_start {
            writeln!(
                f,
                "events:      {name} is zero at the start, and the state does not jump there"
            )?;
        }
        Ok(())
    }

    /// Says how coarse the steps are for the motion.
    fn accuracy(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let has_stages = self.stages.is_some();
        match self.local_error {
            Some(f64::INFINITY) => {
                writeln!(f, "accuracy:    not known: a step is longer than a chart of the space")
            }
            // Where friction is stiff the estimate is far too large, and the line above says so.
            Some(error) if error > UNRESOLVED && !self.is_stiff() => writeln!(
                f,
                "accuracy:    the motion is not resolved: local errors up to {error:.1e} of the state in a step"
            ),
            Some(error) if error > COARSE_INSIDE && !self.is_stiff() && has_stages => writeln!(
                f,
                "accuracy:    inside a step errors up to {error:.1e} of the state, smaller ones at its end"
            ),
            Some(error) if error > COARSE && !self.is_stiff() && !has_stages => writeln!(
                f,
                "accuracy:    local errors up to {error:.1e} of the state in a step, and they add up"
            ),
            _ => Ok(()),
        }
    }

    /// How the steps of an explicit method found the entropy, and what has set their size.
    fn projections(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ProjectedSteps { targeted, free, held, stability } = self.projected_steps;
        // A step that hits the entropy of its production is the rule, and needs no line.
        if free + held + self.falls_avoided > 0 {
            let falls = counted(self.falls_avoided, "fall", "falls");
            writeln!(
                f,
                "entropy:     {targeted} steps targeted, {free} free, {held} held; {falls} avoided by a smaller step"
            )?;
        }
        if self.is_limited_by_stability() {
            let steps = counted(self.steps, "step", "steps");
            let LimitingSites { stiffness, .. } = self.limiting_sites;
            let site = stiffness.map_or_else(String::new, |site| format!(" at site {site}"));
            writeln!(
                f,
                "stability:   it sets the size of {stability} of {steps}{site}, and not the tolerance; an implicit \
                 method, such as `Radau`, takes larger ones, and so does `RungeKuttaChebyshev` if friction sets it"
            )?;
        } else if let (0, Some(site)) = (stability, self.limiting_sites.stiffness) {
            // Few steps at the edge are no stiffness; a method without an edge has looked for it.
            writeln!(f, "stiffness:   the motion is stiffest at site {site}")?;
        }
        Ok(())
    }

    /// The energy at the start, and the error relative to it where it is not zero.
    fn relative_to(&self) -> String {
        let start = self.initial_energy;
        if start.abs() > 0.0 {
            format!(", {:.1e} of H₀ = {}", self.max_relative_energy_error(), Digits(start))
        } else {
            " from H₀ = 0".to_owned()
        }
    }

    fn entropy_line(&self) -> String {
        let falls = match self.entropy_falls {
            0 => "it never fell".to_owned(),
            n => format!("it fell on {}", counted(n, "step", "steps")),
        };
        let slope = if self.min_entropy_slope.is_finite() {
            format!(", |w_S| ≥ {:.1e}", self.min_entropy_slope)
        } else {
            String::new()
        };
        match &self.exchange {
            Some(LedgerSummary { heat, system_entropy, .. }) if !heat.is_empty() => format!(
                "Δ(S + S of the baths) ≥ {:.1e} on every step, {falls}; rose by {:.6e}, S is {system_entropy:.6e}{slope}",
                self.min_entropy_increment, self.entropy_gained
            ),
            _ => format!(
                "ΔS ≥ {:.1e} on every step, {falls}; S rose by {:.6e}{slope}",
                self.min_entropy_increment, self.entropy_gained
            ),
        }
    }
}
