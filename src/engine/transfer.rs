//! A clip moved from one rig to another, before anything is written: edit, tune, resolve, run, measure, faces, properties, layer.

use std::borrow::Cow;

use crate::{
    formats::Limits,
    model::{Clip, Control, Phase, Reporter, Scene},
    retarget::{ContactTrack, LimbReach, LimitedJoint, Measures, ReportDetail, ResolvedOps, RetargetSpec, measure},
    rig::{AlignedJoint, Rig},
};

use super::{
    FaceFitView, Failure, Timings, Tuning, curves::with_curves, edit::edited_clip, layer::laid_over,
    morphs::with_morphs, retarget_run::RetargetRun, tune::TuningProblem,
};

/// A clip on the target, with what was found out on the way.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Transfer<'a> {
    /// The result, a clip of the target's skeleton.
    pub clip: Clip,
    /// The target with the custom properties that the result animates, where it did not have them itself.
    pub scene: Option<Scene>,
    /// The clip of the source with its edits, which is what was moved.
    pub source_clip: Cow<'a, Clip>,
    /// The spec with everything found out filled in.
    pub resolved: RetargetSpec,
    /// What the search for better parameters found.
    pub tuning: Option<Tuning>,
    /// How the target's rest pose was turned.
    pub alignment: Vec<AlignedJoint>,
    /// When points of the source touch.
    pub contacts: Vec<ContactTrack>,
    /// How limbs reached their goals.
    pub reaches: Vec<LimbReach>,
    /// What joints were turned back by limits.
    pub limited: Vec<LimitedJoint>,
    /// The measures of the result; nothing where the spec asks for none.
    pub measures: Option<Measures>,
    /// How well the face was fitted.
    pub face_fit: Option<FaceFitView>,
    /// Joints of the target that forward kinematics drives.
    pub driven_joints: usize,
    /// Of its own phases only.
    pub timings: Timings,
}

/// The joints moved, before faces, custom properties and a layer.
pub(super) struct MovedJoints<'a> {
    spec: RetargetSpec,
    ops: ResolvedOps,
    pub(super) transfer: Transfer<'a>,
}

/// Moves a clip of the source onto the target.
///
/// # Errors
/// When the spec does not fit, nothing can be mapped, the result is out of range, or the work is canceled.
pub fn transfer<'a>(
    spec: RetargetSpec,
    rigs: (&Rig<'_>, &Rig<'_>),
    clip: &'a Clip,
    (limits, control): (&Limits, &Control),
    reporter: &mut Reporter,
) -> Result<Transfer<'a>, Failure> {
    MovedJoints::new(spec, rigs, clip, control, reporter)?.finished(rigs, (limits, control), reporter)
}

impl<'a> MovedJoints<'a> {
    /// Edits the clip, tunes, resolves, runs and measures.
    ///
    /// # Errors
    /// As [`transfer`].
    pub(super) fn new(
        spec: RetargetSpec,
        (source, target): (&Rig<'_>, &Rig<'_>),
        clip: &'a Clip,
        control: &Control,
        reporter: &mut Reporter,
    ) -> Result<Self, Failure> {
        let planning = control.seconds();
        let source_clip = edited_clip(source, clip, &spec, control, reporter)?;
        let clip = source_clip.as_ref();
        let tuning_begin = control.seconds();
        let (spec, tuning) = TuningProblem { source, target, clip, control }.settle(spec)?;
        let tune_seconds = control.seconds() - tuning_begin;
        control.enter(Phase::Retarget, clip.frame_count() as u64);
        let run = RetargetRun::run(&spec, source, target, clip, control, reporter)?;
        let plan_seconds = control.seconds() - planning - run.seconds - tune_seconds;

        let measuring = control.seconds();
        let measures = (spec.report.detail() != ReportDetail::None)
            .then(|| measure(&run.mapping, source, target, clip, &run.result, &spec.report, &run.reaches));
        let timings = Timings {
            plan_seconds,
            tune_seconds,
            retarget_seconds: run.seconds,
            measure_seconds: control.seconds() - measuring,
            ..Timings::default()
        };
        let transfer = Transfer {
            clip: run.result,
            scene: None,
            source_clip,
            resolved: run.resolved,
            tuning,
            alignment: run.alignment,
            contacts: run.contacts,
            reaches: run.reaches,
            limited: run.limited,
            measures,
            face_fit: None,
            driven_joints: run.stack.driven_joint_count(),
            timings,
        };
        Ok(Self { spec, ops: run.ops, transfer })
    }

    /// The same with the face, custom properties and the layer that the spec names.
    ///
    /// # Errors
    /// As [`transfer`].
    pub(super) fn finished(
        self,
        (source, target): (&Rig<'_>, &Rig<'_>),
        (limits, control): (&Limits, &Control),
        reporter: &mut Reporter,
    ) -> Result<Transfer<'a>, Failure> {
        let Self { spec, ops, mut transfer } = self;
        let clip = transfer.source_clip.as_ref();
        let (result, face_fit) =
            with_morphs(transfer.clip, clip, (source, target), &spec.morphs, (limits, control), reporter)?;
        let curves = with_curves(&result, clip, source.scene, target.scene, &ops.curves)?;
        let (scene, result) = curves.map_or((None, result), |(scene, result)| (Some(scene), result));
        transfer.clip = match &spec.layer {
            Some(layer) => {
                let with_properties = scene.as_ref().map(|scene| Rig::clone(target).with_scene(scene));
                let target = with_properties.as_ref().unwrap_or(target);
                laid_over(target, &spec.target, &result, layer, control, reporter)?
            }
            None => result,
        };
        Ok(Transfer { scene, face_fit, ..transfer })
    }
}
