//! Joints whose tracks follow from tracks of the source by constants, without any pose.
//!
//! Where a joint follows one source joint, and its parent follows one above that (nearly all joints of two like skeletons), the model
//! rotations above both cancel: `L_t = A · L_s · B` with constants A and B, into which static joints between the two are folded. Such
//! a track is one linear map of another, value by value, in one run through memory. Everything else takes the loop over frames.

mod active;
mod fill;
mod map;
mod wide;

use glam::{DMat3, DQuat, DVec3};

use super::plan::{Driver, ModelDriver, Parent, PelvisDriver, Plan, Sample, TargetStep, Translation};
use crate::model::{JointTracks, Track, Transform};

pub(super) use active::Active;
pub(super) use fill::Filled;

/// How one output's tracks follow from the source's.
#[derive(Debug)]
pub(super) struct Direct {
    pub(super) rotation: Product,
    /// Present where the output has a translation.
    pub(super) translation: Option<Affine>,
}

/// `first · L_1 · c_1 · L_2 · c_2 …`, of the rotations of source joints that turn.
#[derive(Clone, Debug)]
pub(super) struct Product {
    pub(super) first: DQuat,
    /// Source joints, each with what comes after it.
    pub(super) factors: Vec<(usize, DQuat)>,
}

impl Product {
    const fn constant(first: DQuat) -> Self {
        Self { first, factors: Vec::new() }
    }

    /// Followed by a constant.
    fn then(mut self, rotation: DQuat) -> Self {
        match self.factors.last_mut() {
            Some((_, after)) => *after *= rotation,
            None => self.first *= rotation,
        }
        self
    }
}

/// `matrix · T + offset`, of the translation of a source joint that moves; else the offset alone.
#[derive(Clone, Debug)]
pub(super) struct Affine {
    pub(super) moving: Option<(usize, DMat3)>,
    pub(super) offset: DVec3,
}

/// The model rotation of a target joint.
#[derive(Clone, Copy, Debug)]
enum Follows {
    Constant(DQuat),
    /// A source slot's, and then a constant.
    Source(usize, DQuat),
}

/// What every output of a plan follows from, for the tracks of one clip; nothing where it takes the loop over frames.
pub(super) fn find(plan: &Plan, tracks: &[JointTracks]) -> Vec<Option<Direct>> {
    if !plan.normalizes {
        // What is carried along counts as ikrigretarget does, which has its own rounding.
        return plan.outputs.iter().map(|_| None).collect();
    }
    let finder = Finder { plan, tracks };
    let mut follows: Vec<Option<Follows>> = Vec::with_capacity(plan.target_steps.len());
    for step in &plan.target_steps {
        let found = finder.follows(step, &follows);
        follows.push(found);
    }
    let direct = |slot: usize, has_translation: bool, has_scale: bool| {
        let step = &plan.target_steps[slot];
        let translation = match &step.driver {
            _ if has_scale => return None,
            Driver::Pelvis(driver) if has_translation => Some(finder.pelvis_translation(step, driver)?),
            _ if has_translation => return None,
            _ => None,
        };
        let above = match step.parent {
            Parent::Constant(above) => Follows::Constant(above.rotation),
            Parent::Slot(parent) => follows[parent]?,
        };
        Some(Direct { rotation: finder.between(above, follows[slot]?)?, translation })
    };
    plan.outputs.iter().map(|output| direct(output.slot, output.translation, output.scale)).collect()
}

struct Finder<'a> {
    plan: &'a Plan,
    /// Of the source.
    tracks: &'a [JointTracks],
}

impl Finder<'_> {
    #[expect(clippy::float_cmp, reason = "exactly one means the whole motion")]
    fn follows(&self, step: &TargetStep, before: &[Option<Follows>]) -> Option<Follows> {
        match &step.driver {
            Driver::Hold => {
                let (above, rotation) = match (&step.ride, step.parent) {
                    (Some(ride), _) => (before[ride.on]?, ride.rotation),
                    (None, Parent::Slot(parent)) => (before[parent]?, step.hold.rotation),
                    (None, Parent::Constant(above)) => (Follows::Constant(above.rotation), step.hold.rotation),
                };
                Some(match above {
                    Follows::Constant(above) => Follows::Constant(above * rotation),
                    Follows::Source(slot, after) => Follows::Source(slot, after * rotation),
                })
            }
            Driver::Model(ModelDriver {
                sample: Sample::At(slot),
                rotation,
                also,
                rotation_alpha,
                translation: Translation::Hold,
                chord: None,
                begin: None,
            }) if also.is_empty() && *rotation_alpha == 1.0 => Some(Follows::Source(*slot, *rotation)),
            Driver::Pelvis(pelvis) if pelvis.further.is_none() && pelvis.rotation_alpha == 1.0 => {
                Some(Follows::Source(pelvis.source_slot, pelvis.rotation))
            }
            _ => None,
        }
    }

    /// The rotation of a joint as seen from another.
    fn between(&self, above: Follows, joint: Follows) -> Option<Product> {
        match (above, joint) {
            (Follows::Constant(above), Follows::Constant(joint)) => Some(Product::constant(above.conjugate() * joint)),
            (Follows::Constant(above), Follows::Source(slot, after)) => {
                Some(self.path(above.conjugate(), None, slot)?.then(after))
            }
            (Follows::Source(from, before), Follows::Source(slot, after)) => {
                Some(self.path(before.conjugate(), Some(from), slot)?.then(after))
            }
            (Follows::Source(..), Follows::Constant(_)) => None,
        }
    }

    /// A constant, and then the local rotations of the source below a slot (or from the top) down to another; nothing where that does
    /// not lie below.
    fn path(&self, first: DQuat, from: Option<usize>, to: usize) -> Option<Product> {
        let mut below = Vec::new();
        let mut current = Some(to);
        let mut found = Product::constant(first);
        while current != from {
            let step = &self.plan.source_steps[current?];
            below.push(step);
            current = match step.parent {
                Parent::Slot(parent) => Some(parent),
                Parent::Constant(above) => {
                    if from.is_some() {
                        return None;
                    }
                    found = found.then(above.rotation);
                    None
                }
            };
        }
        for step in below.into_iter().rev() {
            match &self.tracks[step.joint].rotation {
                Track::Sampled(_) => found.factors.push((step.joint, DQuat::IDENTITY)),
                Track::Constant(value) => found = found.then(value.as_dquat()),
                Track::Rest => found = found.then(step.rest.rotation),
            }
        }
        Some(found)
    }

    /// Nothing where more moves than the pelvis of the source within what is still.
    fn pelvis_translation(&self, step: &TargetStep, driver: &PelvisDriver) -> Option<Affine> {
        let Parent::Constant(target_above) = step.parent else { return None };
        if step.ride.is_some() || driver.further.is_some() {
            return None;
        }
        let source = &self.plan.source_steps[driver.source_slot];
        let source_above = self.still(source.parent)?;
        let place = |translation: DVec3| {
            let position = source_above.then_child(&Transform { translation, ..Transform::IDENTITY }).translation;
            let placed = driver.rest_position.lerp(driver.matrix * position + driver.offset, driver.translation_alpha);
            let offset = target_above.rotation.conjugate() * (placed - target_above.translation);
            let scale = target_above.scale;
            DVec3::select(scale.cmpeq(DVec3::ZERO), offset, offset / scale)
        };
        let tracks = &self.tracks[source.joint];
        Some(match &tracks.translation {
            Track::Sampled(_) => {
                let offset = place(DVec3::ZERO);
                let matrix =
                    DMat3::from_cols(place(DVec3::X) - offset, place(DVec3::Y) - offset, place(DVec3::Z) - offset);
                Affine { moving: Some((source.joint, matrix)), offset }
            }
            Track::Constant(value) => Affine { moving: None, offset: place(value.as_dvec3()) },
            Track::Rest => Affine { moving: None, offset: place(source.rest.translation) },
        })
    }

    /// The model transform of a source parent that no track moves.
    fn still(&self, parent: Parent) -> Option<Transform> {
        let slot = match parent {
            Parent::Constant(above) => return Some(above),
            Parent::Slot(slot) => slot,
        };
        let step = &self.plan.source_steps[slot];
        let tracks = &self.tracks[step.joint];
        let local = Transform {
            translation: value(&tracks.translation, step.rest.translation, |value| value.as_dvec3())?,
            rotation: value(&tracks.rotation, step.rest.rotation, |value| value.as_dquat())?,
            scale: value(&tracks.scale, step.rest.scale, |value| value.as_dvec3())?,
        };
        Some(self.still(step.parent)?.then_child(&local))
    }
}

fn value<T: Copy, W>(track: &Track<T>, rest: W, widen: impl Fn(T) -> W) -> Option<W> {
    match track {
        Track::Sampled(_) => None,
        Track::Constant(value) => Some(widen(*value)),
        Track::Rest => Some(rest),
    }
}
