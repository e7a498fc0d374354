//! Labeled rigs, changed by rule and by chance, with the truth about them changed along.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};
use retargetd::{
    model::{Joint, ModelPose, Reporter, Skeleton, Transform},
    rig::{Part, Rig, RigKind, RigSpec, Role, Side},
};

use super::{real_files::truth, spoken::Language, stripped::Sample};
use crate::made_animals::Random;

/// Files that nothing is tuned on: parts of their paths.
const HELD: &[&str] = &[
    "michelle_meshopt",
    "Soldier",
    "joe_meshopt",
    "gdquest_sophia",
    "cc_base_idle",
    "makehuman_body_vrm1",
    "catbot",
    "godette",
    "cryptovoxels",
    "mannequiny",
    "godot_robot",
    "m2m_human_male",
    "rocketbox",
    "kenney_medium_maya",
    "ortiz_salsa",
    "beta_walking",
    "walk01_24fps",
    "meredith_8walk",
    "momask",
    "kate_sign",
    "dragposer",
    "viverse_walk",
    "17_keypoints_walk",
    "xia_angry",
    "text2motion",
    "samba_dancing",
    "mocapbank",
];

/// Roles that are counted.
pub(super) const COUNTED: [Part; 12] = [
    Part::Pelvis,
    Part::Spine,
    Part::Neck,
    Part::Head,
    Part::Clavicle,
    Part::UpperArm,
    Part::Forearm,
    Part::Hand,
    Part::Thigh,
    Part::Shin,
    Part::Foot,
    Part::Toe,
];

pub(super) const ARM: [Part; 4] = [Part::Clavicle, Part::UpperArm, Part::Forearm, Part::Hand];
pub(super) const LEG: [Part; 4] = [Part::Thigh, Part::Shin, Part::Foot, Part::Toe];

/// A joint of a rig that is changed: where it is in model space, not relative to its parent.
#[derive(Clone, Debug)]
pub(super) struct Bone {
    pub(super) name: String,
    pub(super) parent: Option<usize>,
    pub(super) place: DVec3,
    is_joint: bool,
}

/// A rig of which the core roles are known.
#[derive(Clone, Debug)]
pub(super) struct Labeled {
    pub(super) path: String,
    pub(super) is_held: bool,
    pub(super) bones: Vec<Bone>,
    pub(super) truth: BTreeMap<Role, Vec<usize>>,
    pub(super) forward: DVec3,
}

/// The bipeds among the labeled files that rest in a pose. What is no label is taken over from the names, where they agree with
/// all labels.
pub(super) fn labeled(samples: &[Sample]) -> Vec<Labeled> {
    let mut found = Vec::new();
    for Sample { path, scene } in samples {
        let Some(labels) = truth(path) else { continue };
        let rig = Rig::new("source", scene, None, &RigSpec::default(), &mut Reporter::new()).expect("a rig");
        let names = |joints: &[usize]| -> Vec<String> {
            joints.iter().map(|joint| scene.skeleton.joints()[*joint].name.clone()).collect()
        };
        let agrees = labels.iter().all(|(role, expected)| {
            rig.recognition.roles.get(role).is_some_and(|finding| names(&finding.joints) == *expected)
        });
        let Some(body) = rig.recognition.body.filter(|_| agrees && rig.recognition.kind == RigKind::Biped) else {
            continue;
        };
        let bone = |(index, joint): (usize, &Joint)| Bone {
            name: joint.name.clone(),
            parent: joint.parent,
            place: rig.rest.transforms()[index].translation,
            is_joint: joint.is_joint,
        };
        let counted = rig.recognition.roles.iter().filter(|(role, _)| COUNTED.contains(&role.part));
        found.push(Labeled {
            path: path.clone(),
            is_held: HELD.iter().any(|part| path.contains(part)),
            bones: scene.skeleton.joints().iter().enumerate().map(bone).collect(),
            truth: counted.map(|(role, finding)| (*role, finding.joints.clone())).collect(),
            forward: body.forward,
        });
    }
    found
}

impl Labeled {
    pub(super) fn skeleton(&self) -> (Skeleton, ModelPose) {
        let joint = |(index, bone): (usize, &Bone)| {
            let above = bone.parent.map_or(DVec3::ZERO, |parent| self.bones[parent].place);
            let rest = Transform::from_translation(bone.place - above);
            Joint { name: bone.name.clone(), parent: bone.parent, rest, is_joint: bone.is_joint, node: index }
        };
        let skeleton = Skeleton::new(self.bones.iter().enumerate().map(joint).collect()).expect("parents come first");
        let rest = skeleton.rest_pose().to_model(&skeleton);
        (skeleton, rest)
    }

    pub(super) fn first(&self, side: Side, part: Part) -> Option<usize> {
        self.truth.get(&Role::new(side, part)).map(|joints| joints[0])
    }

    fn limb(&self, side: Side, parts: [Part; 4]) -> Vec<usize> {
        parts.iter().filter_map(|part| self.first(side, *part)).collect()
    }

    fn is_below(&self, joint: usize, above: usize) -> bool {
        let mut current = Some(joint);
        while let Some(here) = current {
            if here == above {
                return true;
            }
            current = self.bones[here].parent;
        }
        false
    }

    /// Every joint and all below it, moved.
    fn carry(&mut self, top: usize, change: impl Fn(DVec3) -> DVec3) {
        for joint in 0..self.bones.len() {
            if self.is_below(joint, top) {
                self.bones[joint].place = change(self.bones[joint].place);
            }
        }
    }

    pub(super) fn without_names(mut self) -> Self {
        for (index, bone) in self.bones.iter_mut().enumerate() {
            bone.name = format!("joint_{index}");
        }
        self
    }

    /// Every joint of the limb is called as the next one, or with a negative step as the one before.
    pub(super) fn shifted(mut self, parts: [Part; 4], step: i32) -> Self {
        for side in Side::BOTH {
            let joints = self.limb(side, parts);
            let names: Vec<String> = joints.iter().map(|joint| self.bones[*joint].name.clone()).collect();
            for (place, joint) in joints.iter().enumerate() {
                let from = place as i32 + step;
                let other = usize::try_from(from).ok().and_then(|from| names.get(from));
                self.bones[*joint].name = other.cloned().unwrap_or_else(|| format!("extra_{joint}"));
            }
        }
        self
    }

    /// The names of a limb's joints in another order.
    pub(super) fn shuffled(mut self, parts: [Part; 4], random: &mut Random) -> Self {
        let mut order: Vec<usize> = (0..4).collect();
        for place in (1..4).rev() {
            order.swap(place, random.count(0, place));
        }
        for side in Side::BOTH {
            let joints = self.limb(side, parts);
            let names: Vec<String> = joints.iter().map(|joint| self.bones[*joint].name.clone()).collect();
            let order: Vec<usize> = order.iter().copied().filter(|place| *place < joints.len()).collect();
            for (place, joint) in joints.iter().enumerate() {
                self.bones[*joint].name.clone_from(&names[order[place]]);
            }
        }
        self
    }

    /// Names in another language; joints without a role are called nothing that means something.
    pub(super) fn translated(mut self, language: &Language) -> Self {
        for (index, bone) in self.bones.iter_mut().enumerate() {
            bone.name = format!("{}{index}", language.joint);
        }
        for (role, joints) in &self.truth {
            let Some(place) = COUNTED.iter().position(|part| *part == role.part) else { continue };
            let sided = match role.side {
                Side::Center => language.words[place].to_owned(),
                Side::Left => language.pattern.replace('@', language.sides[0]).replace('#', language.words[place]),
                Side::Right => language.pattern.replace('@', language.sides[1]).replace('#', language.words[place]),
            };
            for (number, joint) in joints.iter().enumerate() {
                let number = if number == 0 { String::new() } else { format!("_{number}") };
                self.bones[*joint].name = format!("{sided}{number}");
            }
        }
        self
    }

    /// Other lengths of arms, legs, neck and trunk, other shoulders, another rest pose of the arms, other axes and another unit.
    pub(super) fn reshaped(mut self, random: &mut Random) -> Self {
        let factors = [0; 8].map(|_| random.between(0.75, 1.35));
        let angle = random.between(-0.35, 1.45);
        let left = self.left();
        let up = left.cross(self.forward).normalize_or_zero() * -1.0;
        let arms_now = |rig: &Self, side: Side| {
            let (upper, hand) = rig.first(side, Part::UpperArm).zip(rig.first(side, Part::Forearm))?;
            let arm = (rig.bones[hand].place - rig.bones[upper].place).normalize_or_zero();
            Some((-arm.dot(up)).clamp(-1.0, 1.0).asin())
        };
        for side in Side::BOTH {
            let segments = [
                (Part::UpperArm, Part::Forearm, factors[0]),
                (Part::Forearm, Part::Hand, factors[0] * (0.8 + 0.2 * factors[1])),
                (Part::Thigh, Part::Shin, factors[2]),
                (Part::Shin, Part::Foot, factors[2] * (0.8 + 0.2 * factors[3])),
            ];
            for (part, next, factor) in segments {
                self.stretch(self.first(side, part), self.first(side, next), factor);
            }
            if let Some((upper, down)) = self.first(side, Part::UpperArm).zip(arms_now(&self, side)) {
                let sign = if side == Side::Left { 1.0 } else { -1.0 };
                let turn = DQuat::from_axis_angle(self.forward, -sign * (angle - down));
                let center = self.bones[upper].place;
                self.carry(upper, |place| center + turn * (place - center));
            }
        }
        let center = |part: Part| self.first(Side::Center, part);
        let (pelvis, spine, neck, head) =
            (center(Part::Pelvis), center(Part::Spine), center(Part::Neck), center(Part::Head));
        self.stretch(pelvis, spine, factors[4]);
        self.stretch(neck, head, factors[5]);
        let turn = DQuat::from_euler(
            glam::EulerRot::YXZ,
            (random.count(0, 3) as f64) * std::f64::consts::FRAC_PI_2,
            (random.count(0, 1) as f64) * std::f64::consts::FRAC_PI_2,
            0.0,
        );
        let scale = [0.01, 1.0, 39.37][random.count(0, 2)];
        for bone in &mut self.bones {
            bone.place = turn * bone.place * scale;
        }
        self.forward = turn * self.forward;
        self
    }

    fn left(&self) -> DVec3 {
        let at = |side: Side| self.first(side, Part::Thigh).or_else(|| self.first(side, Part::UpperArm));
        let (Some(left), Some(right)) = (at(Side::Left), at(Side::Right)) else { return DVec3::X };
        (self.bones[left].place - self.bones[right].place).normalize_or_zero()
    }

    /// Makes a segment longer: what is below its end moves along, what lies on it moves in proportion.
    fn stretch(&mut self, start: Option<usize>, end: Option<usize>, factor: f64) {
        let Some((start, end)) = start.zip(end).filter(|(start, end)| self.is_below(*end, *start)) else { return };
        let (from, to) = (self.bones[start].place, self.bones[end].place);
        let axis = to - from;
        if axis.length_squared() <= 0.0 {
            return;
        }
        self.carry(start, |place| {
            let share = ((place - from).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
            place + axis * (share * (factor - 1.0))
        });
    }

    /// Twist helpers on the limbs and beside them, and something in a hand.
    pub(super) fn with_helpers(mut self, random: &mut Random) -> Self {
        let share = random.between(0.3, 0.7);
        let segments = [(Part::UpperArm, Part::Forearm), (Part::Forearm, Part::Hand), (Part::Thigh, Part::Shin)];
        for (part, next) in segments {
            if random.count(0, 1) == 0 {
                continue;
            }
            for side in Side::BOTH {
                let Some((start, end)) = self.first(side, part).zip(self.first(side, next)) else { continue };
                let place = self.bones[start].place.lerp(self.bones[end].place, share);
                let name = format!("{}_twist", self.bones[start].name);
                self.bones.push(Bone { name, parent: Some(start), place, is_joint: true });
            }
        }
        if let Some(hand) = self.first(Side::Right, Part::Hand) {
            let mut parent = hand;
            for (name, reach) in [("weapon", 0.05), ("weapon_end", 0.4)] {
                let place = self.bones[hand].place + self.forward * (reach * self.leg());
                self.bones.push(Bone { name: name.to_owned(), parent: Some(parent), place, is_joint: true });
                parent = self.bones.len() - 1;
            }
        }
        self
    }

    fn leg(&self) -> f64 {
        let ends = self.first(Side::Left, Part::Thigh).zip(self.first(Side::Left, Part::Foot));
        ends.map_or(1.0, |(hip, foot)| self.bones[hip].place.distance(self.bones[foot].place))
    }

    /// The rig without the joints of a role; what hangs from them hangs from the joint above.
    pub(super) fn lacking(mut self, sides: &[Side], part: Part, with_all_below: bool) -> Option<Self> {
        // A helper above a limb that lacks its first segment is its first segment.
        let is_helped = |side: &Side| {
            let above = self.first(*side, part).and_then(|joint| self.bones[joint].parent);
            part == Part::Thigh && !with_all_below && above != self.first(Side::Center, Part::Pelvis)
        };
        if sides.iter().any(is_helped) {
            return None;
        }
        let mut gone = vec![false; self.bones.len()];
        for side in sides {
            let joints = self.truth.get(&Role::new(*side, part))?.clone();
            for (joint, is_gone) in gone.iter_mut().enumerate() {
                *is_gone |= joints.contains(&joint) || (with_all_below && self.is_below(joint, joints[0]));
            }
        }
        let mut place = vec![None; self.bones.len()];
        let mut bones: Vec<Bone> = Vec::new();
        for joint in 0..self.bones.len() {
            let above = self.bones[joint].parent.and_then(|parent| place[parent]);
            if gone[joint] {
                place[joint] = above;
            } else {
                place[joint] = Some(bones.len());
                bones.push(Bone { parent: above, ..self.bones[joint].clone() });
            }
        }
        for joints in self.truth.values_mut() {
            joints.retain(|joint| !gone[*joint]);
            joints.iter_mut().for_each(|joint| *joint = place[*joint].expect("it stayed"));
        }
        self.truth.retain(|_, joints| !joints.is_empty());
        self.bones = bones;
        Some(self)
    }
}
