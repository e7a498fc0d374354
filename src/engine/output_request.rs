//! Which files are wanted, and with which options.

use crate::{
    formats::{Compression, EulerOrder, Format, Include, TargetClips, WriteOptions},
    model::Reporter,
    picture::Layout,
    retarget::{CompressionSpec, IncludeSpec, OutputChoice, OutputSpec, RetargetSpec, TargetClipsSpec},
    rig::{SpecErrorKind, SpecField},
};

use super::{
    Failure, FailureCode,
    files::{in_config, one_field},
};

/// One output with every question answered.
pub(super) struct OutputRequest {
    pub(super) format: Format,
    pub(super) options: OutputSpec,
}

impl OutputRequest {
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

pub(super) fn output_requests(spec: &RetargetSpec, formats: &[Format]) -> Result<Vec<OutputRequest>, Failure> {
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
            wanted.push(OutputRequest { format, options });
        }
        wanted
    } else {
        let options = specified.first().cloned().unwrap_or_default();
        formats.iter().map(|format| OutputRequest { format: *format, options: options.clone() }).collect()
    };
    if let Some(drawn) = wanted.iter().find(|wanted| wanted.format.info().is_drawn) {
        let detail = format!("{} is written of moving drawings only", drawn.format.info().name);
        return Err(Failure::new(FailureCode::UnsupportedFormat, detail)
            .with_hint("POST /v1/drawings and 'retargetd draw' have drawings move"));
    }
    match wanted.iter().find(|wanted| !wanted.format.info().writes) {
        Some(unwritable) => Err(unwritable_format(unwritable.format)),
        None => Ok(wanted),
    }
}

fn format_named(name: &str, index: usize) -> Result<Format, Failure> {
    Format::from_name(name).ok_or_else(|| {
        let writable = Format::ALL
            .into_iter()
            .filter(|format| format.info().writes && !format.info().is_drawn)
            .map(|format| format.info().name);
        let known: Vec<&str> = writable.collect();
        let detail = format!("there is no output format '{name}'; there are {}", known.join(", "));
        let field = SpecField::new(SpecErrorKind::InvalidValue, format!("/output/{index}/format"), detail);
        let field = field.with_nearest(name, known);
        in_config(one_field(field))
    })
}

fn unwritable_format(format: Format) -> Failure {
    let writable = Format::ALL
        .into_iter()
        .filter(|format| format.info().writes && !format.info().is_drawn)
        .map(|format| format.info().name);
    Failure::new(FailureCode::UnsupportedFormat, format.info().why_unwritten())
        .with_hint(format!("ask for one of {}", writable.collect::<Vec<_>>().join(", ")))
}
