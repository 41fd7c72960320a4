//! The heat of a step that damps, along its unknowns: as in the file of this name of [`collocated`](super::super::super::collocated),
//! whose formulas it has. On a vector space vectors need no map between the stages.

use metriplectic_equations::ENERGY;
use nalgebra::DVector;

use super::super::super::error::Unlinearised;
use super::along::{Along, Around, Number};
use super::stage::{Flat, Stage};
use crate::collocation::{STAGES, fraction};
use crate::implicit::{Matrix, OrthogonalJet, WithJacobian};
use crate::numbers::List as _;
use crate::step::{Directions, Entries};

/// A step that heats.
pub(super) struct Heating<'a> {
    pub(super) around: &'a Around<'a>,
    /// The entries that are not warmed.
    pub(super) still: &'a [bool],
    pub(super) flat: &'a Flat,
    /// The numbers `δ` by which the laws of energy and entropy are missed.
    pub(super) lost: [&'a Number; 2],
}

/// The heat of the stages.
pub(super) struct Heat {
    /// The displacements `h ρ u_i`.
    pub(super) displacements: Vec<Along>,
    /// The entropy that is gained beside the production of friction.
    pub(super) gain: Number,
}

impl Heating<'_> {
    /// The vector along which a stage is warmed.
    fn sharp(&self, stage: &Stage) -> Result<Along, Unlinearised> {
        let n = self.around.n();
        let [sharp] = stage.chained(self.around, |_, _, w| {
            let mut normals = OrthogonalJet::none();
            for i in (0..n).filter(|i| self.still[*i]) {
                let value = Directions::from_index(n, |j| if j == i { 1.0 } else { 0.0 });
                normals.push(&WithJacobian::new(value, Matrix::zeros(n)));
            }
            w.invariants.iter().for_each(|l| normals.push(l));
            Some([normals.covector(0, w.entropy.clone())])
        })?;
        Ok(sharp)
    }

    /// The fraction of the heat that goes in these directions.
    fn fraction(&self, sharp: &[Along], stages: &[Stage]) -> Result<f64, Unlinearised> {
        let largest = DVector::from_fn(self.around.n(), |c, _| {
            stages.iter().fold(0.0, |most: f64, stage| most.max(stage.w.energy.value[c].abs()))
        });
        let of_stages = sharp.iter().zip(stages).map(|(sharp, stage)| {
            let size = largest.dot(&sharp.value.abs());
            (stage.w.energy.value.dot(&sharp.value), size)
        });
        let (warmed, units): (Vec<_>, Vec<_>) = of_stages.unzip();
        let fraction = fraction(&warmed, &units);
        // Between the two the fraction follows sizes, which have no derivative.
        let follows = fraction > 0.0 && fraction < 1.0;
        if follows { Err(Unlinearised::Branch) } else { Ok(fraction) }
    }

    /// Says whether friction vanishes at every stage.
    fn is_reversible(&self, stages: &[Stage]) -> Result<bool, Unlinearised> {
        for stage in stages {
            let [_, friction] = stage.velocity(self.around)?;
            if friction.value.iter().any(|v| *v != 0.0) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Corrects the covectors of energy and entropy with heat.
    pub(super) fn add(&self, stages: &mut [Stage]) -> Result<Heat, Unlinearised> {
        let Self { around, flat, lost: [delta, left], .. } = self;
        let (n, columns) = (around.n(), around.columns());
        let weights = &around.tableau.weights;
        let is_reversible = self.is_reversible(stages)?;
        let sharp: Vec<_> =
            stages.iter().map(|stage| self.sharp(stage)).collect::<Result<_, _>>()?;
        let directed = self.fraction(&sharp, stages)?;
        let lost = if is_reversible || directed == 0.0 {
            Number::zero(columns)
        } else {
            self.transient(stages)?
        };
        let returned = lost.times(delta);
        let share = flat.share(&Number::sum([1.0, -1.0], [delta, &returned]));
        for (stage, flat) in stages.iter_mut().zip(&flat.flat) {
            stage.w.energy.add_times(&share, flat);
        }
        let mut displacements = vec![Along::zero(n, columns); stages.len()];
        let (mut gain, mut square) = ((*left).clone(), flat.square.clone());
        if directed > 0.0 {
            for (i, stage) in stages.iter().enumerate() {
                let rho = returned.scaled(-1.0).over(&stage.w.energy.dot(&sharp[i]));
                displacements[i].add_times(&rho, &sharp[i]);
                let added = stage.w.entropy.dot(&displacements[i]);
                gain = Number::sum([1.0, weights[i]], [&gain, &added]);
                let along = flat.flat[i].dot(&displacements[i]);
                square = Number::sum([1.0, -weights[i] / flat.unit], [&square, &along]);
            }
        }
        if (gain.value < 0.0 || is_reversible) && square.value != 0.0 {
            let share = gain.scaled(flat.unit.recip()).over(&square);
            for (stage, flat) in stages.iter_mut().zip(&flat.flat) {
                stage.w.entropy.add_times(&share, flat);
            }
        }
        if is_reversible || gain.value < 0.0 {
            gain = Number::zero(columns);
        }
        Ok(Heat { displacements, gain })
    }

    /// The fraction of what is lost that becomes heat.
    fn transient(&self, stages: &[Stage]) -> Result<Number, Unlinearised> {
        let Self { around, .. } = self;
        let (n, columns) = (around.n(), around.columns());
        let weights = &around.tableau.weights;
        let start = (ENERGY, &Entries::of(around.step.x));
        let start = around.covector(start, (1.0, &[0.0; STAGES]));
        let size = around.size();
        let mut moved = Vec::new();
        let mut means = [Along::zero(n, columns), Along::zero(n, columns)];
        for (i, stage) in stages.iter().enumerate() {
            let mut motion = Along::zero(n, columns);
            motion.add_times(&size, &stage.reversible(around)?);
            let mut friction = around.displacement(i);
            friction.add(-1.0, &motion);
            let both = [motion, friction];
            for (mean, part) in means.iter_mut().zip(&both) {
                mean.add(weights[i], part);
            }
            moved.push(both);
        }
        let mut sums = [Number::zero(columns), Number::zero(columns)];
        for (i, (both, stage)) in moved.iter_mut().zip(stages).enumerate() {
            for ((sum, part), mean) in sums.iter_mut().zip(both).zip(&means) {
                part.add(-1.0, mean);
                let paired = [stage.w.energy.dot(part), start.dot(part)];
                let paired = Number::sum([1.0, -1.0], [&paired[0], &paired[1]]);
                *sum = Number::sum([1.0, weights[i]], [sum, &paired.magnitude()]);
            }
        }
        let all = Number::sum([1.0, 1.0], [&sums[0], &sums[1]]);
        Ok(if all.value > 0.0 { sums[1].over(&all) } else { Number::zero(columns) })
    }
}
