//! A compiled retarget: the plan, and what is done behind forward kinematics.
//!
//! A [`Stack`] is compiled once. Its stages hold indices and constants only and run one after the other over the whole clip: in
//! parallel over frames where a frame depends on itself only, in one go where something is looked at over time. The result does not
//! depend on the number of threads. Ops that move goals (`ik`, `plant`, `floor`) are solved once, when the last of them in a row is
//! done.

use std::sync::Arc;

use super::{
    Plan,
    cuts::Cuts,
    joined::joined,
    looped::{Loops, Surrounded},
    mapping::{LimbPair, Mapping},
    ops::{resolved::ResolvedOps, scale_source::ScaledSource},
    run::{RunError, run},
    stages::{
        builder::StackBuilder,
        clock::Clock,
        contact_points::ContactPoints,
        result::{ContactTrack, StackResult, tell},
        stage::Stage,
        work::Work,
    },
};
use crate::model::{Clip, Control, JointContacts, Skeleton, Transform};

/// A compiled retarget with all its ops: forward kinematics, then stages.
#[derive(Clone, Debug)]
pub struct Stack {
    plan: Plan,
    source: Option<ScaledSource>,
    stages: Vec<Arc<dyn Stage>>,
    limbs: Vec<&'static str>,
    /// Points of contact and the joints of the target that they are.
    contact_joints: Vec<(&'static str, usize)>,
    meters_per_unit: f64,
    /// Nothing where no stage looks at more than a frame.
    loops: Option<Loops>,
    cuts: Option<Cuts>,
    /// Of the target's joints.
    rest: Vec<Transform>,
}

impl Stack {
    /// Compiles a mapping and its ops. The skeletons are those that the mapping's indices are about.
    #[must_use]
    pub fn new(source: &Skeleton, target: &Skeleton, mapping: &Mapping, ops: &ResolvedOps) -> Self {
        let faded = ops.ops.iter().flat_map(|op| op.work.faded().iter().copied()).collect();
        let mut builder = StackBuilder::new(source, target, mapping, faded);
        for (index, op) in ops.ops.iter().enumerate() {
            op.work.compile(op, &ops.ops[index + 1..], &mut builder);
        }
        builder.close();
        let up = mapping.plan_from_source.rotation.conjugate() * mapping.ground.up;
        let loops = if builder.stages.is_empty() { None } else { Loops::new(source, mapping, up) };
        let cuts = if ops.work_in_parts() { Cuts::new(source, mapping) } else { None };
        Self {
            loops,
            cuts,
            rest: target.joints().iter().map(|joint| joint.rest).collect(),
            plan: Plan::new(source, target, mapping),
            source: ops.source_scale.map(|scale| ScaledSource::new(scale, source)),
            stages: builder.stages,
            limbs: mapping.limbs.iter().map(|pair| pair.limb.name()).collect(),
            contact_joints: mapping.limbs.iter().flat_map(contact_joints).collect(),
            meters_per_unit: mapping.ground.units_per_meter.recip(),
        }
    }

    /// How many target joints forward kinematics drives.
    #[must_use]
    pub fn driven_joint_count(&self) -> usize {
        self.plan.driven_joint_count()
    }

    /// Retargets a clip; see [`run`] for its shape.
    ///
    /// # Errors
    /// When the work is canceled, or the result does not fit into the numbers of a track.
    pub fn run(&self, clip: &Clip, control: &Control) -> Result<StackResult, RunError> {
        let scaled = self.source.as_ref().map(|source| source.apply(clip, control)).transpose()?;
        let clip = scaled.as_ref().unwrap_or(clip);
        let cuts = self.cuts.as_ref().map_or_else(Vec::new, |cuts| cuts.find(clip));
        if !cuts.is_empty() {
            return self.run_parts(clip, &cuts, control);
        }
        let loops = self.loops.as_ref().and_then(|loops| Some((loops, loops.find(clip)?)));
        if let Some(Surrounded { clip, clock }) = loops.and_then(|(loops, found)| loops.around(clip, &found).ok()) {
            match self.run_on(&clip, clock, control) {
                // A figure that gets out of reach in further passes does not do so in its own.
                Err(RunError::OutOfRange(_)) => {}
                done => return done,
            }
        }
        self.run_on(clip, Clock::of_clip(clip.frame_count()), control)
    }

    /// Retargets what is between cuts as if the rest were not there.
    fn run_parts(&self, clip: &Clip, cuts: &[usize], control: &Control) -> Result<StackResult, RunError> {
        let ends = cuts.iter().copied().chain([clip.frame_count()]);
        let mut first = 0;
        let mut parts = Vec::with_capacity(cuts.len() + 1);
        for end in ends {
            let frames = std::mem::replace(&mut first, end)..end;
            parts.push(self.run_on(&clip.section(frames.clone()), Clock::of_part(&frames), control)?);
        }
        let result = joined(parts, &self.rest)?;
        let touching = self.touching(&result.contacts);
        Ok(StackResult { clip: result.clip.with_contacts(touching)?, ..result })
    }

    /// Retargets the frames of a clip that a clock says.
    fn run_on(&self, clip: &Clip, clock: Clock, control: &Control) -> Result<StackResult, RunError> {
        let result = run(&self.plan, clip, control)?;
        if self.stages.is_empty() {
            let (contacts, reaches, limited) = (Vec::new(), Vec::new(), Vec::new());
            return Ok(StackResult { clip: result, contacts, reaches, limited });
        }
        let performed = clip.performed_seconds();
        let (name, times, target) = result.into_parts();
        let mut work = Work {
            control,
            clock,
            times: &times,
            performed: &performed,
            source: clip.joints(),
            target,
            contacts: ContactPoints::default(),
            goals: Vec::new(),
            source_soles: Vec::new(),
            resting: None,
            pelvis_moves: Vec::new(),
            residuals: Vec::new(),
            limited: Vec::new(),
        };
        for stage in &self.stages {
            control.check()?;
            stage.run(&mut work)?;
        }
        let (contacts, reaches) = tell(&work, &self.limbs, self.meters_per_unit);
        let (own, target, limited) = (work.clock.own(), work.target, work.limited);
        let touching = self.touching(&contacts);
        let clip = Clip::new(name, times, target)?;
        let clip = if own.len() < clip.frame_count() { clip.section(own) } else { clip };
        let clip = clip.with_contacts(touching)?;
        Ok(StackResult { clip, contacts, reaches, limited })
    }

    /// What touches, as joints of the target; points that it does not have are left out.
    fn touching(&self, contacts: &[ContactTrack]) -> Vec<JointContacts> {
        let joint = |track: &ContactTrack| {
            let (_, joint) = self.contact_joints.iter().find(|(point, _)| *point == track.point)?;
            Some(JointContacts { joint: *joint, touches: track.touches.clone() })
        };
        contacts.iter().filter_map(joint).collect()
    }
}

/// The points of contact of a limb, and the joints of the target that they are.
fn contact_joints(pair: &LimbPair) -> Vec<(&'static str, usize)> {
    let joints = [Some(pair.target.end), pair.target.ball, pair.target.tip];
    pair.limb.contact_points().into_iter().zip(joints).filter_map(|(point, joint)| Some((point, joint?))).collect()
}
