//! Auto-tune: a search for parameters with a lower score.
//!
//! Coordinate by coordinate with steps that halve, from the parameters as they are: the same inputs give the same result, every
//! step either lowers the score or is taken back, and there are at most as many retargets as the spec allows.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::{
    model::{Clip, Control, Phase, Reporter},
    retarget::{Op, ReportChoice, ReportDetail, RetargetSpec, TuneChoice, TuneParameter, TuneSpec, measure},
    rig::Rig,
};

use super::{Failure, retarget_run::RetargetRun};

/// Parts of the bounds that the first step is long, and the last.
const FIRST_STEP: f64 = 0.125;
const LAST_STEP: f64 = 0.002;
/// What is found is rounded to this, so that a spec which is written and read again says the same.
const GRAIN: f64 = 1e4;
/// A gain of less is none.
const MIN_GAIN: f64 = 1e-6;

/// What a search found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Tuning {
    /// Score with the parameters as they were.
    pub score_before: f64,
    /// Score with those that were found; never higher.
    pub score_after: f64,
    /// Retargets that were tried.
    pub evaluations: u32,
    /// Every parameter that was searched.
    pub parameters: BTreeMap<&'static str, TunedParameter>,
}

/// One parameter before and after.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct TunedParameter {
    /// As it was.
    pub from: f64,
    /// As it was found.
    pub to: f64,
}

/// A parameter with its bounds.
struct Dimension {
    parameter: TuneParameter,
    low: f64,
    high: f64,
}

/// What is tuned.
pub(super) struct TuningProblem<'a> {
    pub(super) source: &'a Rig<'a>,
    pub(super) target: &'a Rig<'a>,
    pub(super) clip: &'a Clip,
    pub(super) control: &'a Control,
}

impl TuningProblem<'_> {
    /// The spec with what tuning finds, where it asks for tuning.
    pub(super) fn settle(&self, spec: RetargetSpec) -> Result<(RetargetSpec, Option<Tuning>), Failure> {
        match spec.tune.as_ref().and_then(TuneChoice::spec) {
            None => Ok((RetargetSpec { tune: None, ..spec }, None)),
            Some(tune) => self.tune(&spec, &tune).map(|(spec, tuning)| (spec, Some(tuning))),
        }
    }

    /// Finds the ops with the lowest score. The spec that is given back no longer asks for tuning.
    fn tune(&self, spec: &RetargetSpec, tune: &TuneSpec) -> Result<(RetargetSpec, Tuning), Failure> {
        let frames = self.clip.frame_count() as u64;
        self.control.enter(Phase::Tune, u64::from(tune.max_evaluations) * frames);
        let report = spec.report.clone().with_detail(ReportDetail::Summary);
        let (score_before, resolved) = self.score(spec, &report)?;
        let start = resolved.ops.unwrap_or_default();
        let dimensions = dimensions(&start, tune);
        let mut search = Search {
            subject: self,
            spec,
            report: &report,
            left: tune.max_evaluations.saturating_sub(1),
            best: (score_before, start.clone()),
        };
        search.run(&dimensions)?;
        let evaluations = tune.max_evaluations - search.left;
        let (score_after, ops) = search.best;
        let parameters = dimensions.iter().map(|Dimension { parameter, .. }| {
            let of = |ops: &[Op]| read(ops, *parameter).unwrap_or_default();
            (parameter.name(), TunedParameter { from: of(&start), to: of(&ops) })
        });
        let tuning = Tuning { score_before, score_after, evaluations, parameters: parameters.collect() };
        Ok((RetargetSpec { ops: Some(ops), tune: None, ..spec.clone() }, tuning))
    }

    fn score(&self, spec: &RetargetSpec, report: &ReportChoice) -> Result<(f64, RetargetSpec), Failure> {
        let Self { source, target, clip, control } = self;
        let pass = RetargetRun::run(spec, source, target, clip, control, &mut Reporter::new())?;
        let measures = measure(&pass.mapping, source, target, clip, &pass.result, report, &pass.reaches);
        Ok((measures.score, pass.resolved))
    }
}

struct Search<'a> {
    subject: &'a TuningProblem<'a>,
    spec: &'a RetargetSpec,
    report: &'a ReportChoice,
    /// Retargets that may still be tried.
    left: u32,
    best: (f64, Vec<Op>),
}

impl Search<'_> {
    fn run(&mut self, dimensions: &[Dimension]) -> Result<(), Failure> {
        let mut step = FIRST_STEP;
        while step >= LAST_STEP && !dimensions.is_empty() {
            let mut any = false;
            for dimension in dimensions {
                for direction in [1.0, -1.0] {
                    // On in the same direction for as long as it helps.
                    let mut helped = false;
                    while self.try_step(dimension, direction * step)? {
                        helped = true;
                    }
                    any |= helped;
                    if helped {
                        break;
                    }
                }
            }
            if self.left == 0 {
                break;
            }
            if !any {
                step /= 2.0;
            }
        }
        Ok(())
    }

    /// Whether a step lowers the score; it is kept then.
    fn try_step(&mut self, dimension: &Dimension, step: f64) -> Result<bool, Failure> {
        let Dimension { parameter, low, high } = dimension;
        let Some(before) = read(&self.best.1, *parameter) else { return Ok(false) };
        let value = ((before + step * (high - low)).clamp(*low, *high) * GRAIN).round() / GRAIN;
        if (value - before).abs() < 0.5 / GRAIN || self.left == 0 {
            return Ok(false);
        }
        self.left -= 1;
        let mut ops = self.best.1.clone();
        write(&mut ops, *parameter, value);
        let spec = RetargetSpec { ops: Some(ops.clone()), ..self.spec.clone() };
        let (score, _) = self.subject.score(&spec, self.report)?;
        let is_better = score < self.best.0 - MIN_GAIN;
        if is_better {
            self.best = (score, ops);
        }
        Ok(is_better)
    }
}

/// What the ops that run have, of what may be searched.
fn dimensions(ops: &[Op], tune: &TuneSpec) -> Vec<Dimension> {
    let bounds = |parameter: TuneParameter| match &tune.bounds {
        None => Some(parameter.usual_bounds()),
        Some(bounds) => bounds.get(&parameter).copied(),
    };
    let searched = TuneParameter::ALL.into_iter().filter(|parameter| read(ops, *parameter).is_some());
    searched.filter_map(|parameter| bounds(parameter).map(|[low, high]| Dimension { parameter, low, high })).collect()
}

/// A parameter of the first op that has it and runs.
fn read(ops: &[Op], parameter: TuneParameter) -> Option<f64> {
    let mut ops = ops.to_vec();
    place(&mut ops, parameter).map(|place| *place)
}

fn write(ops: &mut [Op], parameter: TuneParameter, value: f64) {
    if let Some(place) = place(ops, parameter) {
        *place = value;
    }
}

fn place(ops: &mut [Op], parameter: TuneParameter) -> Option<&mut f64> {
    ops.iter_mut().find_map(|op| match op {
        Op::Pelvis(op) if op.enabled => match parameter {
            TuneParameter::PelvisScaleHorizontal => Some(&mut op.scale_horizontal),
            TuneParameter::PelvisScaleVertical => Some(&mut op.scale_vertical),
            TuneParameter::PelvisRotationAlpha => Some(&mut op.rotation_alpha),
            TuneParameter::PlantBlendSeconds | TuneParameter::FloorFalloffHeight => None,
        },
        Op::Plant(op) if op.scope.enabled && parameter == TuneParameter::PlantBlendSeconds => {
            Some(&mut op.blend_seconds)
        }
        Op::Floor(op) if op.scope.enabled && parameter == TuneParameter::FloorFalloffHeight => {
            Some(&mut op.falloff_height)
        }
        _ => None,
    })
}
