//! Joints that are placed by another joint than their parent go where that one went.
//!
//! A file may hang a thigh from the armature, or a foot from the root: the body carries them all the same (see
//! [`Ride`](crate::rig::Ride)). What moves the pelvis or bends a limb moves its skeleton's children only, so what rides is placed
//! anew after it.

use super::stage::Stage;
use crate::{
    model::{Canceled, Skeleton, Transform},
    rig::{
        Ride,
        anatomy::{by_joint, carried_order},
    },
};

use super::{
    posing::{Pose, Posing},
    work::{Change, Changed, Work},
};

/// Places what rides.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct RideStage {
    posing: Posing,
    /// All slots of the posing, each after its parent and after what it rides; those that ride with their place on it.
    steps: Vec<Step>,
    /// One per ride, in the order of the steps that ride.
    changed: Vec<Changed>,
}

#[derive(Clone, Copy, Debug)]
struct Step {
    slot: usize,
    ride: Option<RideOn>,
}

#[derive(Clone, Copy, Debug)]
struct RideOn {
    slot: usize,
    on_from_joint: Transform,
    /// Whether the joint turns with what it rides; else it is driven and stays as it is turned.
    turns: bool,
}

impl RideStage {
    /// `posing` makes a posing of the target in which some joints are looked at. Nothing where nothing rides.
    pub(in crate::retarget) fn new(
        skeleton: &Skeleton,
        rides: &[Ride],
        driven: &[bool],
        posing: impl Fn(&[usize]) -> Posing,
    ) -> Option<Self> {
        let wanted: Vec<usize> = rides.iter().flat_map(|ride| [ride.joint, ride.on]).collect();
        if wanted.is_empty() {
            return None;
        }
        let posing = posing(&wanted);
        let (mut steps, mut changed) = (Vec::new(), Vec::new());
        let rides = by_joint(skeleton.len(), rides);
        for joint in carried_order(skeleton, &rides).into_iter().filter(|joint| posing.has(*joint)) {
            let ride = rides[joint].map(|ride| {
                changed.push(Changed { joint, rotates: !driven[joint], moves: true });
                RideOn { slot: posing.slot(ride.on), on_from_joint: ride.on_from_joint, turns: !driven[joint] }
            });
            steps.push(Step { slot: posing.slot(joint), ride });
        }
        Some(Self { posing, steps, changed })
    }
}

impl Stage for RideStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Change]| {
            self.posing.fill(pose, &work.target, frame);
            let mut row = row.iter_mut();
            for step in &self.steps {
                let above = self.posing.parent_of(pose, step.slot);
                if let Some(ride) = step.ride {
                    let on = pose.model[ride.slot];
                    let place = on.transform_point(ride.on_from_joint.translation);
                    let place = above.relative(&Transform { translation: place, ..above }).translation;
                    let local = &mut pose.local[step.slot];
                    local.translation = place;
                    if ride.turns {
                        let turned = on.rotation * ride.on_from_joint.rotation;
                        local.rotation = (above.rotation.conjugate() * turned).normalize();
                    }
                    if let Some(change) = row.next() {
                        *change = Change { rotation: local.rotation.as_quat(), translation: place.as_vec3() };
                    }
                }
                pose.model[step.slot] = above.then_child(&pose.local[step.slot]);
            }
        };
        let rows = work.rows(self.changed.len(), || self.posing.pose(), fill)?;
        work.write(&self.changed, &rows);
        Ok(())
    }
}
