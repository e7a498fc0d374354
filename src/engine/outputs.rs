//! The files that come out: which are wanted, with which options, and their bytes.

use crate::{
    formats::{self, Compression, EulerOrder, Format, Include, TargetClips, WriteOptions},
    model::{Clip, Control, Reporter},
    picture::Layout,
    rig::{
        CompressionSpec, IncludeSpec, OutputChoice, OutputSpec, RetargetSpec, Rig, SpecErrorKind, SpecField,
        TargetClipsSpec,
    },
};

use super::{
    Failure, FailureCode, Output,
    files::{in_config, one_field},
    keys::{KeysView, reduced},
    performance::performance,
    pictures::{Sights, picture},
    provenance::Provenance,
};

/// One output with every question answered.
pub(super) struct Wanted {
    pub(super) format: Format,
    pub(super) options: OutputSpec,
}

impl Wanted {
    /// Whether it is a picture that has the source in it.
    pub(super) fn shows_source(&self) -> bool {
        let layout = self.options.view.as_ref().map_or(Layout::Single, |view| view.layout);
        self.format.info().is_picture && layout != Layout::Single
    }

    /// What a writer is told, but for what the output was made from.
    pub(super) fn write_options(&self, reporter: &mut Reporter) -> WriteOptions {
        let options = &self.options;
        let compression = match options.compression {
            CompressionSpec::None => Compression::None,
            CompressionSpec::Quantized => Compression::Quantized,
            CompressionSpec::Meshopt => Compression::Meshopt,
        };
        if compression != Compression::None && !self.format.info().has_compression {
            reporter.warn(
                "field_without_effect",
                "/output/compression",
                format!("{} files are not compressed", self.format.info().name),
                "leave it out, or take a glTF format",
            );
        }
        WriteOptions {
            include: match options.include {
                IncludeSpec::Full => Include::Everything,
                IncludeSpec::SkeletonAndAnimation => Include::SkeletonAndAnimation,
            },
            target_clips: match options.target_clips {
                TargetClipsSpec::Keep => TargetClips::Keep,
                TargetClipsSpec::Drop => TargetClips::Drop,
            },
            rotation_order: options.rotation_order.name().and_then(EulerOrder::from_name),
            compression,
            ..WriteOptions::new(self.format)
        }
    }
}

pub(super) fn wanted_outputs(spec: &RetargetSpec, formats: &[Format]) -> Result<Vec<Wanted>, Failure> {
    let specified = match &spec.output {
        None => vec![OutputSpec::default()],
        Some(OutputChoice::One(output)) => vec![output.clone()],
        Some(OutputChoice::Many(outputs)) => outputs.clone(),
    };
    let wanted = if formats.is_empty() {
        let mut wanted = Vec::new();
        for (index, options) in specified.into_iter().enumerate() {
            let format = match options.format.as_deref() {
                None => Format::Glb,
                Some(name) => format_named(name, index)?,
            };
            wanted.push(Wanted { format, options });
        }
        wanted
    } else {
        let options = specified.first().cloned().unwrap_or_default();
        formats.iter().map(|format| Wanted { format: *format, options: options.clone() }).collect()
    };
    match wanted.iter().find(|wanted| !wanted.format.info().writes) {
        Some(unwritable) => Err(unwritable_format(unwritable.format)),
        None => Ok(wanted),
    }
}

fn format_named(name: &str, index: usize) -> Result<Format, Failure> {
    Format::from_name(name).ok_or_else(|| {
        let writable = Format::ALL.into_iter().filter(|format| format.info().writes).map(|format| format.info().name);
        let known: Vec<&str> = writable.collect();
        let detail = format!("there is no output format '{name}'; there are {}", known.join(", "));
        let field = SpecField::new(SpecErrorKind::InvalidValue, format!("/output/{index}/format"), detail);
        let field = field.with_nearest(name, known);
        in_config(one_field(field))
    })
}

fn unwritable_format(format: Format) -> Failure {
    let writable = Format::ALL.into_iter().filter(|format| format.info().writes).map(|format| format.info().name);
    Failure::new(FailureCode::UnsupportedFormat, format!("{} files can be read but not written", format.info().name))
        .with_hint(format!("ask for one of {}", writable.collect::<Vec<_>>().join(", ")))
}

/// The files, and how many keys those have that hold only what is needed.
pub(super) struct Written {
    pub(super) outputs: Vec<Output>,
    pub(super) keys: Vec<KeysView>,
}

pub(super) fn write_outputs(
    wanted: &[Wanted],
    target: &Rig<'_>,
    result: &Clip,
    (provenance, sights): (&Provenance<'_>, &Sights<'_>),
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Written, Failure> {
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
        let reduced = reduced(target, result, output.format, &output.options, control, reporter)?;
        let result = reduced.as_ref().map_or(result, |(clip, _)| clip);
        keys.extend(reduced.as_ref().map(|(_, view)| view.clone()));
        let renamed = output.options.clip_name.as_ref().map(|name| result.clone().renamed(name.clone()));
        let clip = renamed.as_ref().unwrap_or(result);
        let options = WriteOptions { extras: Some(extras.clone()), ..output.write_options(reporter) };
        let moved = clip.morphs().iter().map(|track| track.morph);
        let (properties, morphs): (Vec<usize>, Vec<usize>) =
            moved.partition(|morph| target.scene.morphs[*morph].is_property());
        let holds = |morph: &&usize| formats::holds_morph(target.scene, **morph, output.format, options.include);
        let lost = morphs.len() - morphs.iter().filter(holds).count();
        if !properties.is_empty() && !output.format.info().has_properties {
            reporter.warn(
                "curves_not_written",
                output.format.info().name,
                format!("{} custom properties are not in this output", properties.len()),
                "take pose arrays or a glTF format, or leave the curves op out",
            );
        }
        if lost > 0 {
            reporter.warn(
                "morphs_not_written",
                output.format.info().name,
                format!("the weights of {lost} morphs are not in this output"),
                "take pose arrays, or the format of the target with everything of it, or set morphs.enabled to false",
            );
        }
        let bytes = encode(target, clip, &options, control, reporter)?;
        outputs.push(Output { format: output.format, name, bytes });
        control.advance(1);
    }
    Ok(Written { outputs, keys })
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
        let (humanoid, clip) = performance(target, clip, control, reporter)?;
        return formats::write(&humanoid, &clip, options, control, reporter).map_err(in_target);
    }
    let space = (target.axes, target.unit_metres);
    formats::write_in_space(target.scene, None, clip, space, options, control, reporter).map_err(in_target)
}

pub(super) fn file_stem(name: &str) -> String {
    let keep = |letter: char| if letter.is_alphanumeric() || "-_ .".contains(letter) { letter } else { '_' };
    let stem: String = name.chars().map(keep).take(80).collect();
    let stem = stem.trim_matches([' ', '.']).to_owned();
    if stem.is_empty() { "retargeted".to_owned() } else { stem }
}
