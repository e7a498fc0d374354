//! What every use of a source and a target begins with: reading the config and the files, and making rigs of them.

use std::sync::Arc;

use crate::{
    formats::{self, Budget, Limits},
    model::{Clip, Control, Payload, Reporter, Scene},
    retarget::{RetargetSpec, parse_spec},
    rig::{ClipChoice, Rig, RigSpec, SpecError, SpecErrorKind, SpecField, find_clip},
};

use super::{
    Failure, Inputs, Knowledge, NamedBytes,
    memory::{LastFile, LoadedFile, Memory, RigMemories},
    swapped_inputs,
};

/// Reads one input; its warnings carry the part's name.
pub(super) fn load(
    file: NamedBytes<'_>,
    part: &'static str,
    limits: &Limits,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<LoadedFile, Failure> {
    let loaded = read(file, part, limits, control)?;
    reporter.absorb(part, loaded.warnings.clone());
    Ok(loaded)
}

/// Reads one input. Out of an archive comes the model that it holds.
fn read(file: NamedBytes<'_>, part: &'static str, limits: &Limits, control: &Control) -> Result<LoadedFile, Failure> {
    let mut warnings = Reporter::new();
    let mut budget = Budget::new(limits, control);
    let refused = |error| swapped_inputs::explain_model(Failure::from(error).in_part(part), file);
    let (format, bytes) = formats::open(file.bytes, file.name, limits, control).map_err(refused)?;
    let scene = formats::read_within(&bytes, format, &mut budget, &mut warnings).map_err(refused)?;
    let (decoded_bytes, rigs) = (budget.decoded_bytes(), RigMemories::default());
    Ok(LoadedFile { scene, format, decoded_bytes, warnings, rigs })
}

/// Reads one input, or finds it read before.
fn load_or_recall(
    file: NamedBytes<'_>,
    part: &'static str,
    last: Option<&LastFile>,
    (limits, control): (&Limits, &Control),
    reporter: &mut Reporter,
) -> Result<Arc<LoadedFile>, Failure> {
    let loaded = match last.and_then(|last| last.recall(file, limits)) {
        Some(known) => known,
        None => {
            let loaded = Arc::new(read(file, part, limits, control)?);
            if let Some(last) = last {
                last.keep(file, limits, &loaded);
            }
            loaded
        }
    };
    reporter.absorb(part, loaded.warnings.clone());
    Ok(loaded)
}

/// The files of a retarget, read.
pub(super) struct Files {
    pub(super) source: Arc<LoadedFile>,
    pub(super) target: Arc<LoadedFile>,
    source_rest: Option<LoadedFile>,
    target_rest: Option<LoadedFile>,
}

/// Both rigs, and the spec that they were made by.
pub(super) struct RigPair<'a> {
    pub(super) spec: RetargetSpec,
    pub(super) source: Rig<'a>,
    pub(super) target: Rig<'a>,
}

/// The spec; an empty one where no config was given.
pub(super) fn read_spec(config: Option<NamedBytes<'_>>) -> Result<RetargetSpec, Failure> {
    let Some(config) = config else { return Ok(RetargetSpec::default()) };
    parse_spec(config.bytes).map_err(|error| swapped_inputs::explain_config(in_config(error), config))
}

/// The rig of a file, beside the file on the other side; without a rest file, what was worked out about it before is kept.
fn made_rig<'a>(
    name: &'static str,
    (own, other): (&'a LoadedFile, &LoadedFile),
    rest: Option<&Scene>,
    (spec, knowledge): (&RigSpec, &Knowledge),
    reporter: &mut Reporter,
) -> Result<Rig<'a>, Failure> {
    let recognizer = knowledge.recognizer();
    let mut rig = Rig::with_recognizer(name, &own.scene, rest, spec, recognizer, reporter).map_err(|error| {
        swapped_inputs::explain_rest(in_config_or(error, name), name, &own.scene, &other.scene, rest)
    })?;
    if rest.is_none() {
        own.rigs.share(&mut rig, spec, recognizer.templates);
    }
    Ok(rig)
}

impl Files {
    pub(super) fn load(
        inputs: &Inputs<'_>,
        is_source_shown: bool,
        knowledge: &Knowledge,
        (limits, control): (&Limits, &Control),
        reporter: &mut Reporter,
    ) -> Result<Self, Failure> {
        let bounds = (limits, control);
        let last = |pick: fn(&Memory) -> &LastFile| knowledge.memory().map(pick);
        let mut source = load_or_recall(inputs.source, "source", last(|memory| &memory.source), bounds, reporter)?;
        // A source is not written back: of its document nothing is looked at again but the meshes of its morphs, and all of them for a
        // picture. It is as large as the file, and the longest files are sources, which nobody keeps.
        if let Some(own) = Arc::get_mut(&mut source).filter(|own| own.scene.morphs.is_empty() && !is_source_shown) {
            own.scene.payload = Payload::default();
        }
        let target = load_or_recall(inputs.target, "target", last(|memory| &memory.target), bounds, reporter)?;
        let mut read = |file, part| load(file, part, limits, control, reporter);
        Ok(Self {
            source,
            target,
            source_rest: inputs.source_rest.map(|file| read(file, "source_rest")).transpose()?,
            target_rest: inputs.target_rest.map(|file| read(file, "target_rest")).transpose()?,
        })
    }

    /// Makes rigs of both.
    pub(super) fn sides(
        &self,
        spec: RetargetSpec,
        knowledge: &Knowledge,
        reporter: &mut Reporter,
    ) -> Result<RigPair<'_>, Failure> {
        let (source, target) = (&*self.source, &*self.target);
        let [source_rest, target_rest] = [&self.source_rest, &self.target_rest].map(scene_of);
        swapped_inputs::swapped_rest("source", &source.scene, &target.scene, source_rest)?;
        swapped_inputs::swapped_rest("target", &target.scene, &source.scene, target_rest)?;
        let mut made = |name, files, rest, rig_spec| made_rig(name, files, rest, (rig_spec, knowledge), reporter);
        let source_rig = made("source", (source, target), source_rest, &spec.source)?;
        let target_rig = made("target", (target, source), target_rest, &spec.target)?;
        Ok(RigPair { spec, source: source_rig, target: target_rig })
    }

    /// The clip that the spec names, else the first in which something moves.
    pub(super) fn choose_clip(&self, spec: &RetargetSpec, reporter: &mut Reporter) -> Result<&Clip, Failure> {
        let scene = &self.source.scene;
        chosen_clip(spec, scene, reporter, || swapped_inputs::no_animation(scene, &self.target.scene))
    }
}

/// The clip that the spec names, else the first in which something moves, else the failure that is given.
pub(super) fn chosen_clip<'a>(
    spec: &RetargetSpec,
    scene: &'a Scene,
    reporter: &mut Reporter,
    no_animation: impl FnOnce() -> Failure,
) -> Result<&'a Clip, Failure> {
    if let Some(choice) = &spec.clip {
        return named_clip(scene, choice);
    }
    let Some((clip, more)) = first_moving(&scene.clips) else { return Err(no_animation()) };
    if more > 0 {
        reporter.warn(
            "clip_chosen",
            "source",
            format!("the source has {} clips that move; the first, '{}', is taken", more + 1, clip.name()),
            format!("give one in \"clip\": {}", clip_choices(&scene.clips)),
        );
    }
    Ok(clip)
}

/// The first clip that moves something, and how many more there are.
pub(super) fn first_moving(clips: &[Clip]) -> Option<(&Clip, usize)> {
    let mut moving = clips.iter().filter(|clip| clip.is_animated());
    moving.next().map(|first| (first, moving.count()))
}

/// What a config can name clips by, for people: names, and indices of those that have none of their own.
pub(super) fn clip_choices(clips: &[Clip]) -> String {
    let choice = |(index, clip): (usize, &Clip)| {
        let is_own = !clip.name().is_empty() && clips.iter().filter(|other| other.name() == clip.name()).count() == 1;
        if is_own { clip.name().to_owned() } else { index.to_string() }
    };
    clips.iter().enumerate().map(choice).collect::<Vec<String>>().join(", ")
}

fn named_clip<'a>(scene: &'a Scene, choice: &ClipChoice) -> Result<&'a Clip, Failure> {
    let found = find_clip(scene, choice, "source", "/clip").map_err(|field| in_config(one_field(field)))?;
    Ok(&scene.clips[found])
}

fn scene_of(loaded: &Option<LoadedFile>) -> Option<&Scene> {
    loaded.as_ref().map(|loaded| &loaded.scene)
}

/// An error about one field of the spec.
pub(super) fn one_field(field: SpecField) -> SpecError {
    let (kind, detail) = (field.kind, field.detail.clone());
    SpecError::from_fields(vec![field]).unwrap_or_else(|| SpecError::new(kind, detail, ""))
}

/// A spec that does not fit: mostly the config is to blame, sometimes both files are.
pub(super) fn in_config(error: SpecError) -> Failure {
    let is_about_rigs = matches!(error.kind, SpecErrorKind::NothingToMap | SpecErrorKind::NoSkeleton);
    Failure::from(error).in_part(if is_about_rigs { "" } else { "config" })
}

pub(super) fn in_config_or(error: SpecError, part: &'static str) -> Failure {
    let is_about_file = error.kind == SpecErrorKind::NoSkeleton;
    Failure::from(error).in_part(if is_about_file { part } else { "config" })
}
