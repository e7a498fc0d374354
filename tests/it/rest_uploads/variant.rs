//! One character as other programs would write it: other bone axes, space, unit, order, names, joints.

use std::collections::BTreeSet;

use glam::{DQuat, DVec3, EulerRot};
use retargetd::model::{Axes, Joint, ModelPose, Scene, Skeleton, Transform};

/// One joint: where it is in the model, and what carries it.
#[derive(Clone, Debug)]
struct Made {
    name: String,
    parent: Option<usize>,
    model: Transform,
    is_joint: bool,
}

/// A character in a pose, to be changed.
#[derive(Clone, Debug)]
pub(super) struct Variant {
    /// Parents before children.
    joints: Vec<Made>,
    axes: Option<Axes>,
    unit_meters: Option<f64>,
}

/// Numbers that look random and are the same in every run, from 0 to 1.
pub(super) fn hashed(seed: u64) -> f64 {
    let mut bits = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    (bits ^ (bits >> 31)) as f64 / u64::MAX as f64
}

impl Variant {
    /// A scene's skeleton in a pose.
    pub(super) fn of(scene: &Scene, pose: &ModelPose) -> Self {
        let made = |(joint, model): (&Joint, &Transform)| Made {
            name: joint.name.clone(),
            parent: joint.parent,
            model: *model,
            is_joint: joint.is_joint,
        };
        let joints = scene.skeleton.joints().iter().zip(pose.transforms()).map(made).collect();
        Self { joints, axes: scene.axes, unit_meters: scene.unit_meters }
    }

    /// Every joint with axes of its own, any that there are.
    pub(super) fn with_random_axes(mut self, seed: u64) -> Self {
        for (index, joint) in self.joints.iter_mut().enumerate() {
            let angle = |number| (hashed(seed * 1000 + index as u64 * 3 + number) - 0.5) * std::f64::consts::TAU;
            joint.model.rotation *= DQuat::from_euler(EulerRot::XYZ, angle(0), angle(1), angle(2));
        }
        self
    }

    /// All joints with the axes of the model, as in a BVH.
    pub(super) fn without_axes(mut self) -> Self {
        self.joints.iter_mut().for_each(|joint| joint.model.rotation = DQuat::IDENTITY);
        self
    }

    /// Every bone rolled about itself: joints keep where their bones point in their axes.
    pub(super) fn with_rolls(mut self, along: DVec3, degrees: f64) -> Self {
        let roll = DQuat::from_axis_angle(along, degrees.to_radians());
        self.joints.iter_mut().for_each(|joint| joint.model.rotation *= roll);
        self
    }

    /// The whole file turned, and said to be in other axes or not at all.
    pub(super) fn turned(mut self, turn: DQuat, axes: Option<Axes>) -> Self {
        for joint in &mut self.joints {
            joint.model.translation = turn * joint.model.translation;
            joint.model.rotation = turn * joint.model.rotation;
        }
        self.axes = axes;
        self
    }

    pub(super) fn scaled(mut self, factor: f64, unit_meters: Option<f64>) -> Self {
        self.joints.iter_mut().for_each(|joint| joint.model.translation *= factor);
        self.unit_meters = unit_meters;
        self
    }

    pub(super) fn moved(mut self, by: DVec3) -> Self {
        self.joints.iter_mut().for_each(|joint| joint.model.translation += by);
        self
    }

    pub(super) fn renamed(mut self, name: impl Fn(&str) -> String) -> Self {
        self.joints.iter_mut().for_each(|joint| joint.name = name(&joint.name));
        self
    }

    /// Left and right in each other's place, and the names where they were.
    pub(super) fn mirrored(mut self) -> Self {
        for joint in &mut self.joints {
            joint.model.translation.x = -joint.model.translation.x;
            let DQuat { x, y, z, w } = joint.model.rotation;
            joint.model.rotation = DQuat::from_xyzw(x, -y, -z, w);
        }
        self
    }

    /// Every bone longer or shorter by up to a share, by its length alone: directions stay.
    pub(super) fn with_other_lengths(mut self, seed: u64, share: f64) -> Self {
        let before = self.joints.clone();
        let side_less = |name: &str| {
            let name = name.to_lowercase().replace("left", "").replace("right", "");
            name.trim_end_matches("_l").trim_end_matches("_r").to_owned()
        };
        for index in 0..self.joints.len() {
            let Some(parent) = self.joints[index].parent else { continue };
            let name = side_less(&before[index].name);
            let number = name.bytes().fold(seed, |sum, byte| sum.wrapping_mul(31).wrapping_add(u64::from(byte)));
            let factor = 1.0 + share * (hashed(number) * 2.0 - 1.0);
            let bone = before[index].model.translation - before[parent].model.translation;
            self.joints[index].model.translation = self.joints[parent].model.translation + bone * factor;
        }
        self
    }

    /// Another order, as random as parents allow.
    pub(super) fn shuffled(self, seed: u64) -> Self {
        let mut order: Vec<usize> = Vec::new();
        let mut open: BTreeSet<usize> = (0..self.joints.len()).collect();
        while !open.is_empty() {
            let ready = |joint: &&usize| self.joints[**joint].parent.is_none_or(|parent| !open.contains(&parent));
            let ready: Vec<usize> = open.iter().filter(ready).copied().collect();
            let next = ready[(hashed(seed + order.len() as u64) * ready.len() as f64) as usize % ready.len()];
            open.remove(&next);
            order.push(next);
        }
        let place = |joint: usize| order.iter().position(|other| *other == joint);
        let joints = order.iter().map(|joint| {
            let made = self.joints[*joint].clone();
            Made { parent: made.parent.and_then(place), ..made }
        });
        Self { joints: joints.collect(), ..self }
    }

    /// Without some joints; what hangs from them hangs from their parents.
    pub(super) fn without(self, is_left_out: impl Fn(&str) -> bool) -> Self {
        let mut places: Vec<Option<usize>> = Vec::new();
        let mut joints: Vec<Made> = Vec::new();
        for made in &self.joints {
            let parent = made.parent.and_then(|parent| places[parent]);
            if is_left_out(&made.name) {
                places.push(parent);
            } else {
                places.push(Some(joints.len()));
                joints.push(Made { parent, ..made.clone() });
            }
        }
        Self { joints, ..self }
    }

    /// A joint in the middle of every bone that leads to one of these, and a leaf on each of them.
    pub(super) fn with_more_joints(self, names: &[&str]) -> Self {
        let mut places: Vec<usize> = Vec::new();
        let mut joints: Vec<Made> = Vec::new();
        for made in &self.joints {
            let mut parent = made.parent.map(|parent| places[parent]);
            if let (Some(above), true) = (parent, names.contains(&made.name.as_str())) {
                let middle = joints[above].model.translation.midpoint(made.model.translation);
                let model = Transform { translation: middle, ..made.model };
                joints.push(Made { name: format!("extra_before_{}", made.name), parent, model, is_joint: true });
                parent = Some(joints.len() - 1);
            }
            places.push(joints.len());
            joints.push(Made { parent, ..made.clone() });
            if names.contains(&made.name.as_str()) {
                let translation = made.model.translation + made.model.rotation * DVec3::new(0.03, 0.02, 0.05);
                let model = Transform { translation, ..made.model };
                let parent = Some(joints.len() - 1);
                joints.push(Made { name: format!("extra_on_{}", made.name), parent, model, is_joint: true });
            }
        }
        Self { joints, ..self }
    }

    /// Below a node that is turned and scaled, as exporters put one.
    pub(super) fn below_armature(mut self, turn: DQuat, scale: f64) -> Self {
        for joint in &mut self.joints {
            joint.parent = Some(joint.parent.map_or(0, |parent| parent + 1));
            joint.model.scale *= scale;
        }
        let model = Transform { rotation: turn, scale: DVec3::splat(scale), ..Transform::IDENTITY };
        self.joints.insert(0, Made { name: "Armature".into(), parent: None, model, is_joint: false });
        self
    }

    pub(super) fn scene(&self) -> Scene {
        let joint = |(node, made): (usize, &Made)| {
            let rest = made.parent.map_or(made.model, |parent| self.joints[parent].model.relative(&made.model));
            Joint { name: made.name.clone(), parent: made.parent, rest, is_joint: made.is_joint, node }
        };
        let joints = self.joints.iter().enumerate().map(joint).collect();
        Scene {
            skeleton: Skeleton::new(joints).expect("a skeleton"),
            axes: self.axes,
            unit_meters: self.unit_meters,
            ..Scene::default()
        }
    }
}
