//! Faces on their way from the source to the target.

use std::borrow::Cow;

use crate::{
    editing::{Gaze, is_look, moved_morphs},
    formats::Limits,
    model::{Clip, ClipError, Control, Morph, MorphPlace, MorphTrack, Reporter, Scene, Track},
    rig::{MorphMapping, MorphsSpec, Rig, map_morphs, morph_meaning},
};

use super::{FaceFitView, Failure, FailureCode, face_fit::fitted, files::in_config};

/// A weight that changes by less is noise.
const STILL: f32 = 0.01;

/// The result with the weights of the target's morphs that follow those of the clip, and how well they were fitted where they were.
pub(super) fn with_morphs(
    result: Clip,
    clip: &Clip,
    (source_rig, target_rig): (&Rig<'_>, &Rig<'_>),
    spec: &MorphsSpec,
    budget: (&Limits, &Control),
    reporter: &mut Reporter,
) -> Result<(Clip, Option<FaceFitView>), Failure> {
    let (source, target) = (source_rig.scene, target_rig.scene);
    // A file has weights for all morphs of a mesh where it has them for one. Custom properties are no part of a face.
    let faces = clip.morphs().iter().filter(|track| !source.morphs[track.morph].is_property());
    let moving = faces.filter(|track| moves(&track.weights, source.morphs[track.morph].rest));
    let mut face = Face {
        animated: moving.map(|track| track.morph).collect(),
        morphs: Cow::Borrowed(&source.morphs),
        clip: Cow::Borrowed(clip),
    };
    if spec.enabled && spec.by_name {
        face.look_by_shapes(source_rig, target_rig).map_err(not_a_clip)?;
    }
    if face.animated.is_empty() && spec.rows.is_empty() && source.gaze_joint.is_none() {
        return Ok((result, None));
    }
    let rows_only = MorphsSpec { by_name: false, ..spec.clone() };
    let fit = match spec.fit.filter(|_| spec.enabled) {
        Some(fit) => {
            let by_rows = map_morphs(&face.morphs, &face.animated, &target.morphs, &rows_only).map_err(in_config)?;
            let is_taken = |morph| by_rows.drives.iter().any(|drive| drive.target == morph);
            fitted(&face.clip, (source_rig, target_rig), &fit, is_taken, budget, reporter)?
        }
        None => None,
    };
    let fitted_looks = fit
        .iter()
        .flat_map(|(tracks, _)| tracks)
        .any(|track| looks(&target.morphs, track.morph) && moves(&track.weights, target.morphs[track.morph].rest));
    let eyes_may_turn = spec.enabled && spec.by_name && !fitted_looks;
    let spec = if fit.is_some() { &rows_only } else { spec };
    let mut mapping = map_morphs(&face.morphs, &face.animated, &target.morphs, spec).map_err(in_config)?;
    // What stands for eyes that turn is not lost with them.
    mapping.unused.retain(|morph| *morph < source.morphs.len());
    let mut result = result;
    if eyes_may_turn && !mapping.drives.iter().any(|drive| looks(&target.morphs, drive.target)) {
        let range = source.look_at.unwrap_or_default();
        let gaze = Gaze::of_morphs(clip, &source.morphs, &range).or_else(|| Gaze::of_gaze_joint(source_rig, clip));
        if let Some(turned) =
            gaze.map(|gaze| gaze.onto_eyes(target_rig, &result)).transpose().map_err(not_a_clip)?.flatten()
        {
            result = turned;
            mapping.unused.retain(|morph| !looks(&source.morphs, *morph));
        }
    }
    let mut moved = moved_morphs(&face.clip, &mapping, &face.morphs, &target.morphs);
    let Some((mut tracks, view)) = fit else {
        report_lost(source, target, &mapping, spec, reporter);
        return Ok((result.with_morphs(moved).map_err(not_a_clip)?, None));
    };
    // Rows of expressions move shapes as well, and win.
    tracks.retain(|track| moved.iter().all(|other| other.morph != track.morph));
    moved.append(&mut tracks);
    moved.sort_by_key(|track| track.morph);
    Ok((result.with_morphs(moved).map_err(not_a_clip)?, Some(view)))
}

fn not_a_clip(error: ClipError) -> Failure {
    Failure::new(FailureCode::Internal, error.to_string())
}

/// Whether a morph, by its name, looks somewhere.
fn looks(morphs: &[Morph], morph: usize) -> bool {
    morph_meaning(&morphs[morph].name).is_some_and(is_look)
}

/// What the source's face does.
struct Face<'a> {
    /// Morphs that move, of `morphs`.
    animated: Vec<usize>,
    /// Those of the file, and behind them those that stand for its eyes.
    morphs: Cow<'a, [Morph]>,
    clip: Cow<'a, Clip>,
}

impl Face<'_> {
    /// Adds shapes that look where the eye joints do, for a target that looks by shapes.
    fn look_by_shapes(&mut self, source: &Rig<'_>, target: &Rig<'_>) -> Result<(), ClipError> {
        let has_eyes = ["left_eye", "right_eye"].iter().any(|role| !target.role(role).is_empty());
        let by_joints = has_eyes && !target.scene.look_at.is_some_and(|look_at| look_at.by_shapes);
        if by_joints || self.animated.iter().any(|morph| looks(&self.morphs, *morph)) {
            return Ok(());
        }
        let gaze = Gaze::of_eyes(source, &self.clip).or_else(|| Gaze::of_gaze_joint(source, &self.clip));
        let Some(gaze) = gaze else { return Ok(()) };
        let mut tracks = self.clip.morphs().to_vec();
        for (name, weights) in gaze.weights(&target.scene.look_at.unwrap_or_default()) {
            self.animated.push(self.morphs.len());
            tracks.push(MorphTrack { morph: self.morphs.len(), weights: Track::Sampled(weights) });
            self.morphs.to_mut().push(Morph { name: name.to_owned(), rest: 0.0, place: MorphPlace::Weight });
        }
        self.clip = Cow::Owned(self.clip.clone().into_owned().with_morphs(tracks)?);
        Ok(())
    }
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
    const MAX: usize = 12;
    let mut lost: Vec<&str> = mapping.unused.iter().map(|morph| source.morphs[*morph].name.as_str()).collect();
    lost.sort_unstable();
    lost.dedup();
    if lost.is_empty() || !spec.enabled {
        return;
    }
    let shown = lost[..lost.len().min(MAX)].join(", ");
    let more = if lost.len() > MAX { format!(" and {} more", lost.len() - MAX) } else { String::new() };
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
