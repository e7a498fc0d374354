//! The files that come out.

use crate::{
    formats::{self, Format, WriteOptions},
    model::{Clip, Control, Reporter},
    rig::Rig,
};

use super::{
    Failure, FailureCode, Output,
    bound_rest::bound_at_rest,
    keys::{KeysView, reduced},
    output_request::OutputRequest,
    pictures::{Sights, picture},
    provenance::Provenance,
    vrm_animation::to_vrm_humanoid,
};

/// The files, and how many keys those have that hold only what is needed.
pub(super) struct WrittenOutputs {
    pub(super) outputs: Vec<Output>,
    pub(super) keys: Vec<KeysView>,
}

pub(super) fn write_outputs(
    wanted: &[OutputRequest],
    target: &Rig<'_>,
    result: &Clip,
    (provenance, sights): (&Provenance<'_>, &Sights<'_>),
    control: &Control,
    reporter: &mut Reporter,
) -> Result<WrittenOutputs, Failure> {
    let extras = provenance.extras(result, target.skeleton());
    let (mut outputs, mut keys) = (Vec::with_capacity(wanted.len()), Vec::new());
    for output in wanted {
        control.check()?;
        let name = format!("{}.{}", file_stem(result.name()), output.format.info().endings[0]);
        if output.format.info().is_picture {
            let bytes = picture(output, target, result, sights, control, reporter)?;
            outputs.push(Output { format: output.format, name, bytes });
            control.advance(1);
            continue;
        }
        // An edit that has a name of its own is a clip beside the one that it was made of.
        let clip_name = output.options.clip_name.as_deref().unwrap_or(result.name());
        let has_its_name = |index: &usize| target.scene.clips[*index].name() == clip_name;
        let replaced_clip = provenance.edited_clip.filter(has_its_name);
        let options = WriteOptions { extras: Some(extras.clone()), replaced_clip, ..output.write_options(reporter) };
        let bound = bound_at_rest(target, result, &options);
        let bound = bound.map_err(|error| Failure::new(FailureCode::AssetMalformed, error.to_string()))?;
        let bound_rig = bound.as_ref().map(|(scene, _)| Rig::clone(target).with_scene(scene));
        let target = bound_rig.as_ref().unwrap_or(target);
        let result = bound.as_ref().map_or(result, |(_, clip)| clip);

        let reduced = reduced(target, result, output.format, &output.options, control, reporter)?;
        let result = reduced.as_ref().map_or(result, |(clip, _)| clip);
        keys.extend(reduced.as_ref().map(|(_, view)| view.clone()));
        let renamed = output.options.clip_name.as_ref().map(|name| result.clone().renamed(name.clone()));
        let clip = renamed.as_ref().unwrap_or(result);
        warn_of_losses(target, clip, &options, reporter);
        let bytes = encode(target, clip, &options, control, reporter)?;
        outputs.push(Output { format: output.format, name, bytes });
        control.advance(1);
    }
    Ok(WrittenOutputs { outputs, keys })
}

/// Says which curves and morphs of a clip a file does not hold.
fn warn_of_losses(target: &Rig<'_>, clip: &Clip, options: &WriteOptions, reporter: &mut Reporter) {
    let moved = clip.morphs().iter().map(|track| track.morph);
    let (properties, morphs): (Vec<usize>, Vec<usize>) =
        moved.partition(|morph| target.scene.morphs[*morph].is_property());
    let holds = |morph: &&usize| formats::holds_morph(target.scene, **morph, options.format, options.include);
    let lost = morphs.len() - morphs.iter().filter(holds).count();
    if !properties.is_empty() && !options.format.info().has_properties {
        reporter.warn(
            "curves_not_written",
            options.format.info().name,
            format!("{} custom properties are not in this output", properties.len()),
            "take pose arrays or a glTF format, or leave the curves op out",
        );
    }
    if lost > 0 {
        reporter.warn(
            "morphs_not_written",
            options.format.info().name,
            format!("the weights of {lost} morphs are not in this output"),
            "take pose arrays, or the format of the target with everything of it, or set morphs.enabled to false",
        );
    }
}

fn encode(
    target: &Rig<'_>,
    clip: &Clip,
    options: &WriteOptions,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, Failure> {
    let in_target = |error| Failure::from(error).in_part("target");
    if options.format == Format::Vrma {
        let (humanoid, clip) = to_vrm_humanoid(target, clip, control, reporter)?;
        return formats::write(&humanoid, &clip, options, control, reporter).map_err(in_target);
    }
    let space = (target.axes, target.unit_meters);
    formats::write_in_space(target.scene, &[], clip, space, options, control, reporter).map_err(in_target)
}

pub(super) fn file_stem(name: &str) -> String {
    let keep = |letter: char| if letter.is_alphanumeric() || "-_ .".contains(letter) { letter } else { '_' };
    let stem: String = name.chars().map(keep).take(80).collect();
    let stem = stem.trim_matches([' ', '.']).to_owned();
    if stem.is_empty() { "retargeted".to_owned() } else { stem }
}
