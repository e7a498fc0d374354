//! Inputs that were given in each other's place: what went wrong told in the words of who did it.

use std::collections::BTreeSet;

use crate::{
    formats::{Format, sniff},
    model::Scene,
    retarget::parse_spec,
};

use super::{Failure, FailureCode, NamedBytes};

/// A model that was sent as the config.
pub(super) fn explain_config(failure: Failure, config: NamedBytes<'_>) -> Failure {
    match sniff(config.bytes, config.name) {
        // JSON is what a config is made of, so being some says nothing.
        Ok(Format::Gltf) | Err(_) => failure,
        Ok(format) => {
            let what = format.info().description;
            let detail = format!("this is not a config but a file with joints ({what})");
            Failure { detail, ..failure }.with_hint("send it as the source or the target; a config is JSON or YAML")
        }
    }
}

/// A config that was sent as a model.
pub(super) fn explain_model(failure: Failure, file: NamedBytes<'_>) -> Failure {
    /// Reading the whole of a large broken file as YAML is not worth a better hint.
    const LONGEST: usize = 1 << 20;
    let may_be = matches!(failure.code, FailureCode::UnsupportedFormat | FailureCode::AssetMalformed)
        && !file.bytes.trim_ascii().is_empty()
        && file.bytes.len() <= LONGEST;
    if may_be && parse_spec(file.bytes).is_ok() {
        let part = failure.part;
        return failure.with_hint(format!("this is a retarget config; send it as 'config', and a model as '{part}'"));
    }
    failure
}

/// A rest file that does not fit, perhaps that of the other side.
pub(super) fn explain_rest(
    failure: Failure,
    side: &'static str,
    own: &Scene,
    other: &Scene,
    rest: Option<&Scene>,
) -> Failure {
    let Some(rest) = rest.filter(|_| failure.code == FailureCode::SkeletonNotFound && !own.skeleton.is_empty()) else {
        return failure;
    };
    let part = if side == "source" { "source_rest" } else { "target_rest" };
    let (here, there) = (shared_names(own, rest), shared_names(other, rest));
    let failure = Failure { part, ..failure };
    if rest.skeleton.is_empty() {
        return failure.with_hint("the rest file has no joints; send the character itself, in its rest pose");
    }
    if here == 0 && there > 0 {
        let other = if side == "source" { "target" } else { "source" };
        let hint = format!("{there} of its joints have names of the {other}: are source_rest and target_rest swapped?");
        return failure.with_hint(hint);
    }
    failure
}

/// A rest file whose joints have names of the other side's, and not of its own.
pub(super) fn swapped_rest(
    side: &'static str,
    own: &Scene,
    other: &Scene,
    rest: Option<&Scene>,
) -> Result<(), Failure> {
    let Some(rest) = rest else { return Ok(()) };
    let (here, there) = (shared_names(own, rest), shared_names(other, rest));
    if here * 10 >= there {
        return Ok(());
    }
    let (part, other) = if side == "source" { ("source_rest", "target") } else { ("target_rest", "source") };
    let detail =
        format!("the rest file of the {side} is another character: {there} of its joints have names of the {other}");
    Err(Failure::new(FailureCode::SkeletonNotFound, detail)
        .in_part(part)
        .with_hint("are source_rest and target_rest swapped?"))
}

fn shared_names(scene: &Scene, rest: &Scene) -> usize {
    let names = |scene: &Scene| -> BTreeSet<String> {
        let joints = scene.skeleton.joints().iter();
        joints.filter(|joint| !joint.name.is_empty()).map(|joint| joint.name.clone()).collect()
    };
    names(scene).intersection(&names(rest)).count()
}

/// A source in which nothing moves; perhaps the animation was sent as the target.
pub(super) fn no_animation(source: &Scene, target: &Scene) -> Failure {
    let failure = nothing_moves(source);
    match target.clips.iter().find(|clip| clip.is_animated()) {
        None => failure,
        Some(clip) => {
            failure.with_hint(format!("the target file has one ('{}'): are source and target swapped?", clip.name()))
        }
    }
}

/// A source in which nothing moves.
pub(super) fn nothing_moves(source: &Scene) -> Failure {
    let detail = match source.clips.len() {
        0 => "the source file has no animation".to_owned(),
        1 => "the source file has a clip, but nothing moves in it".to_owned(),
        count => format!("the source file has {count} clips, but nothing moves in them"),
    };
    Failure::new(FailureCode::NoAnimation, detail)
        .in_part("source")
        .with_hint("send a file with an animation as the source")
}
