//! Two rigs in memory, between which clips and poses are moved.

use std::sync::Arc;

use crate::{
    engine::{self, Transfer},
    formats::Limits,
    model::{Clip, Control, Reporter, Scene, Warning},
    retarget::{ContactTrack, Measures, RetargetSpec},
    rig::{Rig, SpecError, SpecErrorKind},
};

use super::{Config, Error, FrameRetargeter, Retargeter};

/// Two rigs that have been understood: roles, rest poses, axes and units.
#[derive(Debug)]
pub struct RigPair<'a> {
    spec: RetargetSpec,
    source: Rig<'a>,
    target: Rig<'a>,
    warnings: Vec<Warning>,
    limits: Limits,
    control: Arc<Control>,
}

/// A retargeted clip.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct SceneOutcome {
    /// The clip, of the target's skeleton.
    pub clip: Clip,
    /// The target with the custom properties that the clip animates, where it did not have them itself.
    pub scene: Option<Scene>,
    /// The spec with everything found out filled in; run again, it gives the same clip.
    pub resolved_spec: RetargetSpec,
    /// The quality of the result; nothing where the spec asks for no report.
    pub measures: Option<Measures>,
    /// When points of the source touch; empty without a `contacts` op.
    pub contacts: Vec<ContactTrack>,
    /// Deviations, guesses and losses.
    pub warnings: Vec<Warning>,
}

impl<'a> RigPair<'a> {
    pub(super) fn new(retargeter: &Retargeter, source: &'a Scene, target: &'a Scene) -> Result<Self, Error> {
        let spec = retargeter.config.as_ref().map_or_else(|| Ok(RetargetSpec::default()), Config::checked)?;
        let knowledge = retargeter.knowledge.parsed()?;
        let mut reporter = Reporter::new();
        let source = Rig::with_recognizer("source", source, None, &spec.source, knowledge.recognizer(), &mut reporter)
            .map_err(at("source"))?;
        let target = Rig::with_recognizer("target", target, None, &spec.target, knowledge.recognizer(), &mut reporter)
            .map_err(at("target"))?;
        let warnings = reporter.into_warnings();
        Ok(Self { spec, source, target, warnings, limits: retargeter.limits, control: retargeter.control.clone() })
    }

    /// What was guessed about the two rigs.
    #[must_use]
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// Retargets a clip of the source with everything that the config asks for, but for reading and writing files.
    ///
    /// # Errors
    /// When the config does not fit, nothing can be mapped, or the work is canceled.
    pub fn retarget(&self, clip: &Clip) -> Result<SceneOutcome, Error> {
        let mut reporter = Reporter::new();
        let rigs = (&self.source, &self.target);
        let transfer = engine::transfer(self.spec.clone(), rigs, clip, (&self.limits, &self.control), &mut reporter)?;
        let Transfer { clip, scene, resolved: resolved_spec, measures, contacts, .. } = transfer;
        Ok(SceneOutcome { clip, scene, resolved_spec, measures, contacts, warnings: reporter.into_warnings() })
    }

    /// Prepares retargeting of single poses, as a live stream has them.
    ///
    /// ```
    /// use retargetd::{Retargeter, samples};
    ///
    /// let (walk, hero) = (samples::walk_scene(), samples::mannequin_scene());
    /// let pair = Retargeter::new().scenes(&walk, &hero)?;
    /// let frames = pair.frames()?;
    /// for frame in 0..3 {
    ///     let pose = walk.clips[0].local_pose(&walk.skeleton, frame);
    ///     let moved = frames.retarget(&pose)?;
    ///     assert_eq!(moved.transforms().len(), hero.skeleton.len());
    /// }
    /// # Ok::<(), retargetd::Error>(())
    /// ```
    ///
    /// # Errors
    /// When the config has ops that look at more than one frame, does not fit, or nothing can be mapped.
    pub fn frames(&self) -> Result<FrameRetargeter<'_>, Error> {
        FrameRetargeter::new(&self.spec, &self.source, &self.target)
    }
}

fn at(side: &'static str) -> impl Fn(SpecError) -> Error {
    move |error| {
        let part = if error.kind == SpecErrorKind::NoSkeleton { side } else { "config" };
        engine::Failure::from(error).in_part(part).into()
    }
}
