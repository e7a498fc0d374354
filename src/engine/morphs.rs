//! Faces on their way from the source to the target.

use crate::{
    editing::moved_morphs,
    model::{Clip, Reporter, Scene, Track},
    rig::{MorphMapping, MorphsSpec, map_morphs},
};

use super::{Failure, FailureCode, files::in_config};

/// A weight that changes by less is noise.
const STILL: f32 = 0.01;

/// The result with the weights of the target's morphs that follow those of the clip.
pub(super) fn with_morphs(
    result: Clip,
    clip: &Clip,
    (source, target): (&Scene, &Scene),
    spec: &MorphsSpec,
    reporter: &mut Reporter,
) -> Result<Clip, Failure> {
    // A file has weights for all morphs of a mesh where it has them for one.
    let moving = clip.morphs().iter().filter(|track| moves(&track.weights, source.morphs[track.morph].rest));
    let animated: Vec<usize> = moving.map(|track| track.morph).collect();
    if animated.is_empty() && spec.rows.is_empty() {
        return Ok(result);
    }
    let mapping = map_morphs(&source.morphs, &animated, &target.morphs, spec).map_err(in_config)?;
    report_lost(source, target, &mapping, spec, reporter);
    let moved = moved_morphs(clip, &mapping, &source.morphs, &target.morphs);
    result.with_morphs(moved).map_err(|error| Failure::new(FailureCode::Internal, error.to_string()))
}

fn moves(weights: &Track<f32>, rest: f32) -> bool {
    match weights {
        Track::Rest => false,
        Track::Constant(weight) => (weight - rest).abs() > STILL,
        Track::Sampled(weights) => weights.iter().any(|weight| (weight - rest).abs() > STILL),
    }
}

/// Says which motion of the face goes nowhere.
fn report_lost(source: &Scene, target: &Scene, mapping: &MorphMapping, spec: &MorphsSpec, reporter: &mut Reporter) {
    const MOST: usize = 12;
    let mut lost: Vec<&str> = mapping.unused.iter().map(|morph| source.morphs[*morph].name.as_str()).collect();
    lost.sort_unstable();
    lost.dedup();
    if lost.is_empty() || !spec.enabled {
        return;
    }
    let shown = lost[..lost.len().min(MOST)].join(", ");
    let more = if lost.len() > MOST { format!(" and {} more", lost.len() - MOST) } else { String::new() };
    let (detail, hint) = if target.morphs.is_empty() {
        let detail = format!("the target has no morphs, so the motion of {} of the source is lost", lost.len());
        (detail, "send a target with morph targets or expressions, or set morphs.enabled to false")
    } else {
        let detail =
            format!("nothing on the target follows {} morphs of the source that move: {shown}{more}", lost.len());
        (detail, "name what follows them in morphs.rows")
    };
    reporter.warn("morphs_lost", "target", detail, hint);
}
