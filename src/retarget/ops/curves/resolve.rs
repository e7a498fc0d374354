//! Which curves of the source's clip are carried over.

use crate::model::{Clip, Scene};

use super::drive::CurveDrive;
use crate::{
    retarget::ops::{CurveRow, CurvesOp, OtherCurves, schedule::Schedule, source_curves::find},
    rig::error::{SpecErrorKind, SpecField},
};

/// Whether a clip animates a custom property, so that there is something to carry over.
pub(in crate::retarget) fn has_properties(scene: &Scene, clip: &Clip) -> bool {
    clip.morphs().iter().any(|track| scene.morphs[track.morph].is_property())
}

/// What a `curves` op carries over, in the order of the rows, then that of the file. `index` is that of the op in the spec.
pub(in crate::retarget) fn curve_drives(
    op: &CurvesOp,
    index: usize,
    schedule: &Schedule,
    scene: &Scene,
    clip: &Clip,
    fields: &mut Vec<SpecField>,
) -> Vec<CurveDrive> {
    let pointer = format!("/ops/{index}");
    let mask: Option<Vec<usize>> = op.scope.mask.as_ref().map(|mask| {
        let named = mask.iter().enumerate();
        named
            .filter_map(|(position, name)| find(name, format!("{pointer}/mask/{position}"), &scene.morphs, fields))
            .collect()
    });
    let is_wanted = |morph: usize| mask.as_ref().is_none_or(|mask| mask.contains(&morph));
    let mut drives = Vec::new();
    let mut named = Vec::new();
    for (position, row) in op.rows.iter().enumerate() {
        let pointer = format!("{pointer}/rows/{position}");
        check_row(row, &pointer, fields);
        let Some(source) = find(&row.source, format!("{pointer}/source"), &scene.morphs, fields) else { continue };
        named.push(source);
        if row.drop || !is_wanted(source) {
            continue;
        }
        let name = row.target.clone().unwrap_or_else(|| row.source.clone());
        if drives.iter().any(|drive: &CurveDrive| drive.name == name) {
            let detail = format!("two rows make a curve '{name}'");
            fields.push(SpecField::new(SpecErrorKind::InvalidValue, format!("{pointer}/target"), detail));
        }
        let CurveRow { points, gain, offset, clamp, .. } = row.clone();
        let clamp = clamp.unwrap_or([f64::MIN, f64::MAX]);
        drives.push(CurveDrive { name, source, points, gain, offset, clamp, schedule: schedule.clone() });
    }
    let animated = clip.morphs().iter().map(|track| track.morph);
    let others = animated.filter(|morph| {
        let is_free = scene.morphs[*morph].is_property() && !named.contains(morph);
        op.others == OtherCurves::Keep && is_free && is_wanted(*morph)
    });
    for source in others {
        let name = &scene.morphs[source].name;
        // A row that makes a curve of that name says what it is.
        if !drives.iter().any(|drive| drive.name == *name) {
            drives.push(CurveDrive::unchanged(name.clone(), source, schedule.clone()));
        }
    }
    drives
}

fn check_row(row: &CurveRow, pointer: &str, fields: &mut Vec<SpecField>) {
    let mut wrong = |field: &str, detail: String| {
        fields.push(SpecField::new(SpecErrorKind::InvalidValue, format!("{pointer}/{field}"), detail));
    };
    for (field, value) in [("gain", row.gain), ("offset", row.offset)] {
        if !value.is_finite() {
            wrong(field, format!("{value} is no number"));
        }
    }
    if let Some([least, most]) =
        row.clamp.filter(|[least, most]| !(least.is_finite() && most.is_finite() && least <= most))
    {
        wrong("clamp", format!("[{least}, {most}] is no range; the least comes first"));
    }
    let are_finite = row.points.iter().flatten().all(|value| value.is_finite());
    if !are_finite || !row.points.windows(2).all(|pair| pair[0][0] < pair[1][0]) {
        wrong("points", "points are pairs of a value and what it becomes, by rising value".to_owned());
    }
    if row.target.as_ref().is_some_and(String::is_empty) {
        wrong("target", "a curve needs a name".to_owned());
    }
}
