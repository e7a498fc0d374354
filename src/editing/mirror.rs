//! Swapping left and right, whatever way the joints' axes lie.
//!
//! For twins A and B, with Δ_A = G_A · (G_A^R)⁻¹ the turn of A from its rest pose in model space and M the reflection on the middle
//! plane, B gets G_B' = M(Δ_A) · G_B^R, and A gets the same from B; a joint of the middle is its own twin. On a symmetric rig this mirrors
//! positions exactly; no axis convention is asked for. Translations and scales are mirrored as changes from the rest pose, so bone lengths
//! stay. (The reflection of a quaternion is that of its axis as a pseudovector.)

use std::borrow::Cow;

use glam::{DQuat, DVec3, Quat, Vec3};

use crate::{
    model::{
        Clip, ClipError, JointContacts, JointTracks, ModelPose, MorphTrack, Skeleton, Track, Transform,
        rotation::next_to,
    },
    retarget::MirrorPlane,
    rig::{Rig, Role, Side},
};

use super::mirror_rest::zero_pose;

/// A joint's mirror image is found within this share of the figure's size.
const NEAR_SHARE: f64 = 0.02;
/// A pose whose joints are nearer than this to their mirror images is symmetric; a share of the figure's size.
const SYMMETRIC_SHARE: f64 = 0.01;

/// Which joint is whose mirror image.
#[derive(Clone, Debug, PartialEq)]
pub struct Twins {
    /// For every joint its twin: itself on the middle.
    twin: Vec<usize>,
    /// Joints that have no twin; they are their own, and move as if they were on the middle.
    pub lonely: Vec<usize>,
    /// Largest distance of a joint from where its twin's mirror image is at rest, as a share of the figure's size; and that joint.
    pub asymmetry: Option<(usize, f64)>,
}

/// Left and right of one rig.
#[derive(Debug)]
pub struct Mirror<'a> {
    skeleton: &'a Skeleton,
    rest: Cow<'a, ModelPose>,
    /// Unit vector to the figure's left, in model space.
    lateral: DVec3,
    /// A point of the middle plane.
    middle: DVec3,
    up: DVec3,
    pelvis: Option<usize>,
    twins: Twins,
    steps: Vec<Step>,
    /// For each morph of the scene the one that it changes sides with.
    morph_twins: Vec<usize>,
}

impl<'a> Mirror<'a> {
    /// Finds out which joints belong together: by `pairs`, by roles, by names that differ in their side only, by places in the rest pose.
    #[must_use]
    pub fn new(rig: &'a Rig<'a>, pairs: &[(usize, usize)]) -> Self {
        let mirror = Self::about(rig, Cow::Borrowed(&rig.rest), pairs);
        let crookedness = |mirror: &Self| mirror.twins.asymmetry.map_or(0.0, |(_, share)| share);
        if crookedness(&mirror) <= SYMMETRIC_SHARE {
            return mirror;
        }
        // A frame of a motion is hardly ever symmetric; the file's zero pose often is, though nobody could stand in it.
        let zero = zero_pose(rig).map(|pose| Self::about(rig, Cow::Owned(pose), pairs));
        zero.filter(|zero| crookedness(zero) <= SYMMETRIC_SHARE).unwrap_or(mirror)
    }

    /// About one pose of the rig.
    fn about(rig: &'a Rig<'a>, rest: Cow<'a, ModelPose>, pairs: &[(usize, usize)]) -> Self {
        let lateral = (rig.canonical_from_scene.conjugate() * DVec3::X).normalize();
        let pelvis = rig.role("pelvis").first().copied();
        let middle = pelvis.map_or(DVec3::ZERO, |pelvis| rest.transforms()[pelvis].translation);
        let mut mirror = Self {
            skeleton: rig.skeleton(),
            rest,
            lateral,
            middle,
            up: rig.up(),
            pelvis,
            twins: Twins { twin: Vec::new(), lonely: Vec::new(), asymmetry: None },
            steps: Vec::new(),
            morph_twins: super::morphs::twins(&rig.scene.morphs, other_side),
        };
        mirror.twins = mirror.find_twins(rig, pairs);
        let step = |joint| Step::new(rig.skeleton(), mirror.rest.transforms(), joint, mirror.twins.of(joint));
        mirror.steps = (0..rig.skeleton().len()).map(step).collect();
        mirror
    }

    /// Which joint is whose mirror image.
    #[must_use]
    pub const fn twins(&self) -> &Twins {
        &self.twins
    }

    /// The pose that turns are measured from.
    pub(super) fn rest(&self) -> &ModelPose {
        &self.rest
    }

    /// The figure's left, in model space.
    pub(super) const fn lateral(&self) -> DVec3 {
        self.lateral
    }

    /// The clip with left and right swapped. Joints that neither side animates stay as they are.
    ///
    /// # Errors
    /// When the result does not fit into the numbers of a track.
    pub fn apply(&self, clip: &Clip, plane: MirrorPlane) -> Result<Clip, ClipError> {
        let frames = clip.frame_count();
        let animated = |joint: usize| {
            let tracks = &clip.joints()[joint];
            tracks.translation.is_animated() || tracks.rotation.is_animated() || tracks.scale.is_animated()
        };
        let count = self.skeleton.len();
        let touched: Vec<bool> = (0..count).map(|joint| animated(joint) || animated(self.twins.twin[joint])).collect();
        let moves = |joint: usize| clip.joints()[self.twins.twin[joint]].translation.is_animated();
        let grows = |joint: usize| clip.joints()[self.twins.twin[joint]].scale.is_animated();
        let mut joints: Vec<Sampled> =
            touched.iter().map(|touched| Sampled::new(if *touched { frames } else { 0 })).collect();
        let onto_start = match plane {
            MirrorPlane::Rest => Transform::IDENTITY,
            MirrorPlane::Start => self.onto_start(clip),
        };
        let mut before = vec![Quat::IDENTITY; count];
        let mut mirrored = MirroredPose::default();
        for frame in 0..frames {
            let pose = clip.local_pose(self.skeleton, frame).to_model(self.skeleton);
            self.mirror_pose(pose.transforms(), &onto_start, &mut mirrored);
            for joint in (0..count).filter(|joint| touched[*joint]) {
                let local = &mirrored.local[joint];
                let rotation = next_to(local.rotation.normalize().as_quat(), (frame > 0).then_some(before[joint]));
                before[joint] = rotation;
                let sampled = &mut joints[joint];
                sampled.rotations.push(rotation);
                sampled.translations.push(local.translation.as_vec3());
                sampled.scales.push(local.scale.as_vec3());
            }
        }
        let tracks = joints.into_iter().enumerate().map(|(joint, sampled)| {
            if !touched[joint] {
                return JointTracks::default();
            }
            JointTracks {
                rotation: Track::Sampled(sampled.rotations).compacted(),
                translation: if moves(joint) { Track::Sampled(sampled.translations).compacted() } else { Track::Rest },
                scale: if grows(joint) { Track::Sampled(sampled.scales).compacted() } else { Track::Rest },
            }
        });
        self.with_other_sides(clip, tracks.collect())
    }

    /// The clip with mirrored tracks, and everything beside them on the other side: contacts on the twins' joints, weights on the twins'
    /// morphs.
    pub(super) fn with_other_sides(&self, clip: &Clip, joints: Vec<JointTracks>) -> Result<Clip, ClipError> {
        let morph = |track: &MorphTrack| MorphTrack {
            morph: self.morph_twins.get(track.morph).copied().unwrap_or(track.morph),
            weights: track.weights.clone(),
        };
        let contacts =
            |track: &JointContacts| JointContacts { joint: self.twins.of(track.joint), touches: track.touches.clone() };
        clip.clone()
            .with_joints(joints)?
            .with_contacts(clip.contacts().iter().map(contacts).collect())?
            .with_morphs(clip.morphs().iter().map(morph).collect())
    }

    /// Fills in the local and model transforms of a mirrored pose.
    fn mirror_pose(&self, now: &[Transform], onto_start: &Transform, mirrored: &mut MirroredPose) {
        mirrored.local.clear();
        mirrored.model.clear();
        for step in &self.steps {
            let turn = now[step.twin].rotation * step.twin_from_rest;
            let rotation = onto_start.rotation * self.reflect_rotation(turn) * step.rest_rotation;
            let twin_local = step.twin_parent.map_or(now[step.twin], |parent| now[parent].relative(&now[step.twin]));
            let moved = step.rest_axes_of_twin.rotation
                * (step.rest_axes_of_twin.scale * (twin_local.translation - step.twin_rest_local.translation));
            let mut local = Transform {
                translation: step.rest_local.translation
                    + (step.rest_axes.rotation.conjugate() * self.reflect(moved)) / step.rest_axes.scale,
                rotation,
                scale: step.rest_local.scale * (twin_local.scale / step.twin_rest_local.scale),
            };
            let model = match step.parent {
                Some(parent) => {
                    local.rotation = (mirrored.model[parent].rotation.conjugate() * rotation).normalize();
                    mirrored.model[parent].then_child(&local)
                }
                None => {
                    local.translation = onto_start.transform_point(local.translation);
                    local
                }
            };
            mirrored.model.push(model);
            mirrored.local.push(local);
        }
    }

    /// Takes the mirrored path to where the first frame stood and faced.
    fn onto_start(&self, clip: &Clip) -> Transform {
        let Some(pelvis) = self.pelvis else { return Transform::IDENTITY };
        let pose = clip.local_pose(self.skeleton, 0).to_model(self.skeleton);
        let first = pose.transforms()[pelvis];
        let mut mirrored = MirroredPose::default();
        self.mirror_pose(pose.transforms(), &Transform::IDENTITY, &mut mirrored);
        let image = mirrored.model[pelvis];
        let rest = self.rest.transforms()[pelvis].rotation;
        let front = self.up.cross(self.lateral) * -1.0;
        let level = |rotation: DQuat| {
            let direction = (rotation * rest.conjugate()) * front;
            (direction - self.up * direction.dot(self.up)).try_normalize().unwrap_or(front)
        };
        let turn = DQuat::from_rotation_arc(level(image.rotation), level(first.rotation));
        let way = first.translation - turn * image.translation;
        Transform { translation: way - self.up * way.dot(self.up), rotation: turn, scale: DVec3::ONE }
    }

    fn reflect(&self, vector: DVec3) -> DVec3 {
        vector - self.lateral * (2.0 * vector.dot(self.lateral))
    }

    fn reflect_rotation(&self, rotation: DQuat) -> DQuat {
        let axis = -self.reflect(DVec3::new(rotation.x, rotation.y, rotation.z));
        DQuat::from_xyzw(axis.x, axis.y, axis.z, rotation.w)
    }

    fn find_twins(&self, rig: &Rig<'_>, pairs: &[(usize, usize)]) -> Twins {
        let count = self.skeleton.len();
        let mut twin: Vec<Option<usize>> = vec![None; count];
        let mut join = |first: usize, second: usize| {
            if twin[first].is_none() && twin[second].is_none() {
                (twin[first], twin[second]) = (Some(second), Some(first));
            }
        };
        for (first, second) in pairs {
            join(*first, *second);
        }
        for (name, joints) in &rig.roles {
            let Ok(role) = name.parse::<Role>() else { continue };
            let others =
                if role.side == Side::Center { joints.as_slice() } else { rig.role(&role.mirrored().to_string()) };
            if others.len() == joints.len() {
                joints.iter().zip(others).for_each(|(joint, other)| join(*joint, *other));
            }
        }
        self.join_by_name(&mut join);
        let size = self.size();
        let place = |joint: usize| self.rest.transforms()[joint].translation;
        let image = |joint: usize| place(joint) - self.lateral * (2.0 * (place(joint) - self.middle).dot(self.lateral));
        let depth = |joint: usize| std::iter::successors(Some(joint), |joint| self.skeleton.parent(*joint)).count();
        for joint in 0..count {
            if twin[joint].is_some() {
                continue;
            }
            let wanted = image(joint);
            let free = (0..count).filter(|other| twin[*other].is_none() && depth(*other) == depth(joint));
            let distance = |other: &usize| place(*other).distance(wanted);
            let parents_fit = |other: &usize| match (self.skeleton.parent(joint), self.skeleton.parent(*other)) {
                (Some(own), Some(others)) => twin[own] == Some(others),
                (own, others) => own == others,
            };
            let nearest = free.filter(parents_fit).min_by(|first, second| distance(first).total_cmp(&distance(second)));
            if let Some(other) = nearest.filter(|other| distance(other) <= NEAR_SHARE * size) {
                (twin[joint], twin[other]) = (Some(other), Some(joint));
            }
        }
        let lonely: Vec<usize> = (0..count).filter(|joint| twin[*joint].is_none()).collect();
        let twin: Vec<usize> = twin.iter().enumerate().map(|(joint, twin)| twin.unwrap_or(joint)).collect();
        let distances = (0..count)
            .filter(|joint| !lonely.contains(joint))
            .map(|joint| (joint, place(twin[joint]).distance(image(joint)) / size));
        let asymmetry = distances.max_by(|first, second| first.1.total_cmp(&second.1));
        Twins { twin, lonely, asymmetry }
    }

    /// Names that are the same but for a side.
    fn join_by_name(&self, join: &mut impl FnMut(usize, usize)) {
        let names: std::collections::BTreeMap<&str, usize> =
            self.skeleton.joints().iter().enumerate().map(|(index, joint)| (joint.name.as_str(), index)).collect();
        for (name, joint) in &names {
            if let Some(other) = other_side(name).and_then(|other| names.get(other.as_str()).copied()) {
                join(*joint, other);
            }
        }
    }

    fn size(&self) -> f64 {
        let places = self.rest.transforms().iter().map(|transform| transform.translation);
        let (low, high) =
            places.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), place| (low.min(place), high.max(place)));
        let size = (high - low).length();
        if size.is_finite() && size > 0.0 { size } else { 1.0 }
    }
}

impl Twins {
    /// The joint's twin; itself on the middle.
    #[must_use]
    pub fn of(&self, joint: usize) -> usize {
        self.twin[joint]
    }
}

/// One joint's share of the mirroring: constants of the two rest poses.
#[derive(Debug)]
struct Step {
    twin: usize,
    parent: Option<usize>,
    twin_parent: Option<usize>,
    /// `(G_A^R)⁻¹` and `G_B^R` of the module's formula.
    twin_from_rest: DQuat,
    rest_rotation: DQuat,
    rest_local: Transform,
    twin_rest_local: Transform,
    /// What lies above the joint and above its twin at rest.
    rest_axes: Transform,
    rest_axes_of_twin: Transform,
}

impl Step {
    fn new(skeleton: &Skeleton, rest: &[Transform], joint: usize, twin: usize) -> Self {
        let above = |joint: usize| skeleton.parent(joint).map_or(Transform::IDENTITY, |parent| rest[parent]);
        Self {
            twin,
            parent: skeleton.parent(joint),
            twin_parent: skeleton.parent(twin),
            twin_from_rest: rest[twin].rotation.conjugate(),
            rest_rotation: rest[joint].rotation,
            rest_local: above(joint).relative(&rest[joint]),
            twin_rest_local: above(twin).relative(&rest[twin]),
            rest_axes: above(joint),
            rest_axes_of_twin: above(twin),
        }
    }
}

/// The transforms of one frame; made once, filled in frame after frame.
#[derive(Default)]
struct MirroredPose {
    local: Vec<Transform>,
    model: Vec<Transform>,
}

/// What one joint's tracks become.
struct Sampled {
    rotations: Vec<Quat>,
    translations: Vec<Vec3>,
    scales: Vec<Vec3>,
}

impl Sampled {
    fn new(frames: usize) -> Self {
        Self {
            rotations: Vec::with_capacity(frames),
            translations: Vec::with_capacity(frames),
            scales: Vec::with_capacity(frames),
        }
    }
}

/// The name with its first word for a side swapped for the other side's; nothing where it has none.
fn other_side(name: &str) -> Option<String> {
    const WORDS: [(&str, &str); 3] = [("Left", "Right"), ("left", "right"), ("LEFT", "RIGHT")];
    for (left, right) in WORDS {
        for (from, to) in [(left, right), (right, left)] {
            if name.contains(from) {
                return Some(name.replacen(from, to, 1));
            }
        }
    }
    let bytes = name.as_bytes();
    let is_break =
        |index: Option<usize>| index.is_none_or(|index| bytes.get(index).is_none_or(|byte| b"_.- :|".contains(byte)));
    let other = |byte: u8| match byte {
        b'l' => Some('r'),
        b'r' => Some('l'),
        b'L' => Some('R'),
        b'R' => Some('L'),
        _ => None,
    };
    for (index, byte) in bytes.iter().enumerate() {
        if let Some(other) = other(*byte)
            && is_break(index.checked_sub(1))
            && is_break(Some(index + 1))
        {
            let mut swapped = name.to_owned();
            swapped.replace_range(index..=index, other.encode_utf8(&mut [0; 4]));
            return Some(swapped);
        }
    }
    None
}
