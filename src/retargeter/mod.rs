//! The crate for Rust programs: one builder over the engine, for files, for scenes in memory and for single poses.

mod asset;
mod config;
mod error;
mod frames;
mod rig_pair;

pub use asset::Asset;
pub use config::Config;
pub use error::Error;
pub use frames::FrameRetargeter;
pub use rig_pair::{RigPair, SceneOutcome};

use std::sync::Arc;

use crate::{
    engine::{self, EditInputs, Inputs, Inspection, Knowledge, Outcome, PoseInputs, Proposal, Task},
    formats::{self, Format, Limits, WriteOptions},
    model::{Clip, Control, Reporter, Scene, Warning},
    rig::PoseChoice,
};

/// Moves animation from one rig to another.
///
/// ```
/// use retargetd::{Asset, Format, Retargeter, samples};
///
/// let (walk, hero) = (samples::walk_clip(), samples::mannequin());
/// let outcome = Retargeter::new()
///     .config(r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#)
///     .output(Format::Glb)
///     .retarget(Asset::new("walk.glb", &walk), Asset::new("hero.glb", &hero))?;
/// assert_eq!(outcome.report.counts.frames, 121);
/// assert!(outcome.outputs[0].bytes.starts_with(b"glTF"));
/// # Ok::<(), retargetd::Error>(())
/// ```
#[derive(Clone, Debug, Default)]
#[must_use]
pub struct Retargeter {
    limits: Limits,
    knowledge: Knowledge,
    config: Option<Config>,
    formats: Vec<Format>,
    control: Arc<Control>,
}

impl Retargeter {
    /// One with the default limits that finds everything out.
    pub fn new() -> Self {
        Self::default()
    }

    /// What one file may cost; for files of strangers. Default: [`Limits::default`].
    pub fn limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// Rig templates of your own, tried before the built-in ones.
    pub fn knowledge(self, knowledge: Knowledge) -> Self {
        Self { knowledge, ..self }
    }

    /// What is to be done: a [`RetargetSpec`](crate::RetargetSpec), or JSON or YAML text. Default: everything is found out.
    ///
    /// ```
    /// use retargetd::{Asset, Op, PelvisOp, FkOp, RetargetSpec, Retargeter, samples};
    ///
    /// let (walk, hero) = (samples::walk_clip(), samples::mannequin());
    /// let ops = Some(vec![Op::Pelvis(PelvisOp::default()), Op::Fk(FkOp::default())]);
    /// let spec = RetargetSpec { ops, ..RetargetSpec::default() };
    /// let outcome = Retargeter::new().config(spec).retarget(Asset::new("a.glb", &walk), Asset::new("b.glb", &hero))?;
    /// assert_eq!(outcome.resolved_spec["ops"].as_array().map(Vec::len), Some(2));
    /// # Ok::<(), retargetd::Error>(())
    /// ```
    pub fn config(self, config: impl Into<Config>) -> Self {
        Self { config: Some(config.into()), ..self }
    }

    /// Adds an output format. The formats given here win over the `output` of the config; with neither, the output is GLB.
    pub fn output(mut self, format: Format) -> Self {
        self.formats.push(format);
        self
    }

    /// Reports progress to this control and stops when it is canceled, from another thread for instance. A control
    /// [with a clock](Control::with_clock) fills the timings of the report.
    pub fn control(self, control: Arc<Control>) -> Self {
        Self { control, ..self }
    }

    /// Puts the source's clip onto the target.
    ///
    /// # Errors
    /// When a file cannot be read, the config does not fit, nothing can be mapped, or the work is canceled.
    pub fn retarget(&self, source: Asset<'_>, target: Asset<'_>) -> Result<Outcome, Error> {
        let text = self.config_text()?;
        self.run(Task::Retarget(self.inputs(source, target, text.as_ref())))
    }

    /// Edits the source's clip as the `edit` of the config says, on its own rig.
    ///
    /// ```
    /// use retargetd::{Asset, Format, Retargeter, samples};
    ///
    /// let walk = samples::walk_clip();
    /// let half = Retargeter::new().config(r#"{"edit": {"fps": 15}}"#).output(Format::Bvh).edit(Asset::new("walk.glb", &walk))?;
    /// assert_eq!(half.report.counts.frames, 61);
    /// # Ok::<(), retargetd::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Self::retarget`].
    pub fn edit(&self, source: Asset<'_>) -> Result<Outcome, Error> {
        let text = self.config_text()?;
        self.run(Task::Edit(EditInputs {
            source: source.file,
            source_rest: source.rest,
            unread_target: false,
            config: text.as_ref().map(Config::file),
            formats: &self.formats,
        }))
    }

    /// Puts a character into a pose, such as a T pose.
    ///
    /// # Errors
    /// As [`Self::retarget`].
    pub fn pose(&self, character: Asset<'_>, to: PoseChoice) -> Result<Outcome, Error> {
        let text = self.config_text()?;
        self.run(Task::Pose(PoseInputs {
            target: character.file,
            target_rest: character.rest,
            source: None,
            source_rest: None,
            to: Some(to),
            config: text.as_ref().map(Config::file),
            formats: &self.formats,
        }))
    }

    /// Says what a file holds: skeletons, clips, recognized rigs, findings.
    ///
    /// # Errors
    /// When the file cannot be read, or the work is canceled.
    pub fn inspect(&self, file: Asset<'_>) -> Result<Inspection, Error> {
        Ok(engine::inspect_with(file.file, &self.knowledge, &self.limits, &self.control)?)
    }

    /// Suggests a mapping: what would drive what, and how certain that is. Nothing is retargeted.
    ///
    /// # Errors
    /// As [`Self::retarget`].
    pub fn suggest(&self, source: Asset<'_>, target: Asset<'_>) -> Result<Proposal, Error> {
        let text = self.config_text()?;
        let inputs = self.inputs(source, target, text.as_ref());
        Ok(engine::propose(&inputs, &self.knowledge, &self.limits, &self.control)?)
    }

    /// Reads a file of any format, with what was guessed and repaired in it.
    ///
    /// # Errors
    /// When the file cannot be read, or the work is canceled.
    pub fn read(&self, file: Asset<'_>) -> Result<(Scene, Vec<Warning>), Error> {
        let mut reporter = Reporter::new();
        let (format, bytes) = formats::open(file.file.bytes, file.file.name, &self.limits, &self.control)?;
        let scene = formats::read(&bytes, format, &self.limits, &self.control, &mut reporter)?;
        Ok((scene, reporter.into_warnings()))
    }

    /// Writes a clip of a scene's skeleton as a file, with what the format cannot hold. The scene keeps everything else that its own
    /// file had, where the format is the same.
    ///
    /// # Errors
    /// When the format cannot be written, or not from such a scene; or when the work is canceled.
    pub fn write(&self, scene: &Scene, clip: &Clip, format: Format) -> Result<(Vec<u8>, Vec<Warning>), Error> {
        let mut reporter = Reporter::new();
        let bytes = formats::write(scene, clip, &WriteOptions::new(format), &self.control, &mut reporter)?;
        Ok((bytes, reporter.into_warnings()))
    }

    /// Understands two rigs in memory, whose clips and poses can then be retargeted without files.
    ///
    /// ```
    /// use retargetd::{Format, Retargeter, samples};
    ///
    /// let (walk, hero) = (samples::walk_scene(), samples::mannequin_scene());
    /// let retargeter = Retargeter::new();
    /// let outcome = retargeter.scenes(&walk, &hero)?.retarget(&walk.clips[0])?;
    /// assert_eq!(outcome.clip.frame_count(), walk.clips[0].frame_count());
    /// let (bytes, _warnings) = retargeter.write(&hero, &outcome.clip, Format::Bvh)?;
    /// assert!(bytes.starts_with(b"HIERARCHY"));
    /// # Ok::<(), retargetd::Error>(())
    /// ```
    ///
    /// # Errors
    /// When a scene has no joints, or the config does not fit one of them.
    pub fn scenes<'a>(&self, source: &'a Scene, target: &'a Scene) -> Result<RigPair<'a>, Error> {
        RigPair::new(self, source, target)
    }

    fn inputs<'a>(&'a self, source: Asset<'a>, target: Asset<'a>, config: Option<&'a Config>) -> Inputs<'a> {
        Inputs {
            source: source.file,
            target: target.file,
            source_rest: source.rest,
            target_rest: target.rest,
            config: config.map(Config::file),
            formats: &self.formats,
        }
    }

    fn run(&self, task: Task<'_>) -> Result<Outcome, Error> {
        Ok(engine::run(&task, &self.knowledge, &self.limits, &self.control)?)
    }

    fn config_text(&self) -> Result<Option<Config>, Error> {
        self.config.as_ref().map(Config::as_text).transpose()
    }
}
