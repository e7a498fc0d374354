//! What was made, over a clip that the file has already.

use crate::{
    editing::{Layer, LayerError, branch_weights, layered},
    model::{Clip, Control, Reporter},
    retarget::LayerSpec,
    rig::{Rig, RigSpec, SpecErrorKind, SpecField, find_clip, named_joints},
};

use super::{
    Failure, FailureCode,
    files::{clip_choices, first_moving, in_config, one_field},
};

/// Lays a clip over one of the rig's own.
///
/// # Errors
/// When the spec does not fit the rig or its clips, or the work is canceled.
pub fn laid_over(
    rig: &Rig<'_>,
    rig_spec: &RigSpec,
    motion: &Clip,
    spec: &LayerSpec,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Clip, Failure> {
    let base = base(rig, spec, reporter)?;
    let skeleton = rig.skeleton();
    let weights = match &spec.mask {
        None => vec![spec.weight; skeleton.len()],
        Some(names) => {
            let joints = named_joints(rig, rig_spec, names, "/layer/mask").map_err(in_config)?;
            branch_weights(skeleton, &joints, spec.feather_joints, spec.weight)
        }
    };
    let layer = Layer {
        mode: spec.mode,
        reference: spec.reference,
        morph_weight: match (&spec.mask, rig.role("head").first()) {
            (None, _) => spec.weight,
            // Faces go along with the head.
            (Some(_), head) => head.map_or(0.0, |head| weights[*head]),
        },
        morph_rests: morph_rests(rig),
        weights,
        at_seconds: spec.at_seconds,
        seam_seconds: spec.seam_seconds,
    };
    let end = spec.at_seconds.map(|at| (at, at + motion.duration_seconds()));
    if let Some((begin, end)) = end.filter(|(begin, end)| *end < 0.0 || *begin > base.duration_seconds()) {
        let detail = format!(
            "the new motion would play from {begin} to {end} s, and the clip below lasts {} s",
            base.duration_seconds()
        );
        return Err(in_config(one_field(SpecField::new(SpecErrorKind::InvalidValue, "/layer/at_seconds", detail))));
    }
    layered(base, motion, skeleton, &layer, control).map_err(|error| match error {
        LayerError::Canceled(canceled) => canceled.into(),
        LayerError::Clip(error) => Failure::new(FailureCode::AssetMalformed, error.to_string()).in_part(rig.name),
    })
}

/// The weights that morphs have where nothing animates them.
pub(super) fn morph_rests(rig: &Rig<'_>) -> Vec<f32> {
    rig.scene.morphs.iter().map(|morph| morph.rest).collect()
}

fn base<'a>(rig: &Rig<'a>, spec: &LayerSpec, reporter: &mut Reporter) -> Result<&'a Clip, Failure> {
    let clips = &rig.scene.clips;
    if let Some(choice) = &spec.over {
        let found = find_clip(rig.scene, choice, rig.name, "/layer/over");
        return found.map(|index| &clips[index]).map_err(|field| in_config(one_field(field)));
    }
    let Some((base, more)) = first_moving(clips) else {
        let detail = format!("the {} file has no animation that something could be laid over", rig.name);
        let field = SpecField::new(SpecErrorKind::InvalidValue, "/layer", detail);
        let failure = in_config(one_field(field));
        return Err(
            failure.with_hint(format!("send a {} with an animation of its own, or leave 'layer' out", rig.name))
        );
    };
    if more > 0 {
        reporter.warn(
            "layer_base_chosen",
            rig.name,
            format!("the {} has {} clips that move; the first, '{}', is below", rig.name, more + 1, base.name()),
            format!("give one in layer.over: {}", clip_choices(clips)),
        );
    }
    Ok(base)
}
