//! How good moving drawings are.

use serde::Serialize;

use crate::{
    drawing::{DrawingMeasures, measure},
    engine::{Failure, FailureCode, FieldError, WarningView, check_strict as check_warnings},
    model::Control,
    retarget::Verdict,
};

use super::{CHOICES, DrawRequest, Scenery, film::Shown};

/// What was found of moving drawings, as it goes to users.
#[derive(Clone, Debug, Serialize)]
pub struct DrawnReport {
    /// The worst verdict of all measures; `not_applicable` with `compat`, whose faults are wanted.
    pub verdict: Verdict,
    /// What the verdict is about, for people.
    pub verdict_reason: String,
    /// The share of the driven bones among those that could be.
    pub coverage: f64,
    /// What was chosen, in sentences.
    pub choices: Vec<String>,
    /// Each drawing.
    pub characters: Vec<DrawnCharacterView>,
}

/// What was found of one moving drawing.
#[derive(Clone, Debug, Serialize)]
pub struct DrawnCharacterView {
    /// The joints of the drawing that the motion turns.
    pub driven_joints: Vec<String>,
    /// How many vertices its mesh has.
    pub vertices: usize,
    /// What was measured.
    pub measures: DrawingMeasures,
}

/// Measures every character.
pub(super) fn measured(
    scenery: &Scenery,
    shown: Option<&Shown<'_>>,
    request: &DrawRequest<'_>,
    control: &Control,
) -> Result<DrawnReport, Failure> {
    let mut characters = Vec::new();
    let (mut driven, mut drivable) = (0, 0);
    for (index, character) in scenery.characters.iter().enumerate() {
        let puppet = shown.and_then(|shown| shown.puppets.get(index));
        control.check()?;
        let performance = &character.performance;
        driven += performance.driven.len();
        drivable += character.retarget.char_joint_bvh_joints_mapping.0.len().max(performance.driven.len());
        characters.push(DrawnCharacterView {
            driven_joints: performance.driven.clone(),
            vertices: puppet.map_or(0, |puppet| puppet.rest().0.len()),
            measures: measure(puppet, &character.rig, performance, scenery.foreshortens),
        });
    }
    let (verdict, verdict_reason) = match request.spec.compat {
        Some(_) => (Verdict::NotApplicable, "the numbers of another program are wanted, faults and all".to_owned()),
        None => judged(&characters),
    };
    let choices = scenery.notes.iter().filter(|(code, _)| CHOICES.contains(code)).map(|(_, text)| text.clone());
    let coverage = driven as f64 / f64::from(u32::try_from(drivable.max(1)).unwrap_or(u32::MAX));
    Ok(DrawnReport { verdict, verdict_reason, coverage, choices: choices.collect(), characters })
}

fn judged(characters: &[DrawnCharacterView]) -> (Verdict, String) {
    let mut worst = (Verdict::Pass, "every measure passes".to_owned());
    let mut most = 1.0;
    for (name, measured) in characters.iter().flat_map(|character| character.measures.bounded()) {
        let share = measured.value / measured.pass_up_to;
        if share > most {
            most = share;
            let verdict = if measured.value > measured.fail_above { Verdict::Fail } else { Verdict::Warn };
            if verdict == Verdict::Fail || worst.0 != Verdict::Fail {
                worst = (verdict, format!("{name} is {:.3}; {} passes", measured.value, measured.pass_up_to));
            }
        }
    }
    worst
}

/// Refuses warnings, and measures that fail.
pub(super) fn check_strict(warnings: &[WarningView], report: &DrawnReport) -> Result<(), Failure> {
    check_warnings(warnings, None)?;
    if report.verdict != Verdict::Fail {
        return Ok(());
    }
    let failed = report.characters.iter().flat_map(|character| character.measures.bounded());
    let failed = failed.filter(|(_, measured)| measured.value > measured.fail_above);
    let errors: Vec<FieldError> = failed
        .map(|(name, measured)| FieldError {
            pointer: format!("/drawing/measures/{name}"),
            code: name.into(),
            detail: format!("{} where {} is the most", measured.value, measured.fail_above),
            did_you_mean: Vec::new(),
        })
        .collect();
    let detail = format!("strict was asked for and {} measures fail: {}", errors.len(), report.verdict_reason);
    Err(Failure::new(FailureCode::StrictMeasures, detail)
        .with_hint("look at the report without strict")
        .with_errors(errors))
}
