//! A clip moved from one rig to another, before anything is written: edit, tune, resolve, run, measure, faces, properties, layer.

use std::borrow::Cow;

use crate::{
    formats::Limits,
    model::{Clip, Control, Phase, Reporter, Scene},
    retarget::{ContactTrack, LimbReach, LimitedJoint, Measures, ReportDetail, RetargetSpec, measure},
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

/// Moves a clip of the source onto the target.
///
/// # Errors
/// When the spec does not fit, nothing can be mapped, the result is out of range, or the work is canceled.
pub fn transfer<'a>(
    spec: RetargetSpec,
    (source, target): (&Rig<'_>, &Rig<'_>),
    clip: &'a Clip,
    (limits, control): (&Limits, &Control),
    reporter: &mut Reporter,
) -> Result<Transfer<'a>, Failure> {
    let planning = control.seconds();
    let source_clip = edited_clip(source, clip, &spec, control, reporter)?;
    let clip = source_clip.as_ref();
    let tuning_begin = control.seconds();
    let (spec, tuning) = TuningProblem { source, target, clip, control }.settle(spec)?;
    let tune_seconds = control.seconds() - tuning_begin;
    control.enter(Phase::Retarget, clip.frame_count() as u64);
    let RetargetRun {
        mapping,
        resolved,
        alignment,
        stack,
        result,
        contacts,
        reaches,
        limited,
        seconds: retarget_seconds,
    } = RetargetRun::run(&spec, source, target, clip, control, reporter)?;
    let plan_seconds = control.seconds() - planning - retarget_seconds - tune_seconds;

    let measuring = control.seconds();
    let measures = (spec.report.detail() != ReportDetail::None)
        .then(|| measure(&mapping, source, target, clip, &result, &spec.report, &reaches));
    let measure_seconds = control.seconds() - measuring;

    let (result, face_fit) = with_morphs(result, clip, (source, target), &spec.morphs, (limits, control), reporter)?;
    let curves = with_curves(&result, clip, source.scene, target.scene, &mapping.stages.curves)?;
    let (scene, result) = curves.map_or((None, result), |(scene, result)| (Some(scene), result));
    let result = match &spec.layer {
        Some(layer) => {
            let with_properties = scene.as_ref().map(|scene| Rig { scene, ..target.clone() });
            let target = with_properties.as_ref().unwrap_or(target);
            laid_over(target, &spec.target, &result, layer, control, reporter)?
        }
        None => result,
    };
    Ok(Transfer {
        clip: result,
        scene,
        resolved,
        tuning,
        alignment,
        contacts,
        reaches,
        limited,
        measures,
        face_fit,
        driven_joints: stack.driven_joint_count(),
        timings: Timings { plan_seconds, tune_seconds, retarget_seconds, measure_seconds, ..Timings::default() },
        source_clip,
    })
}
