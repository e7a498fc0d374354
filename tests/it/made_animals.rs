//! Animals made by code: where their joints are, and what each of them means.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};
use retargetd::{
    model::{Axes, Joint, Scene, Skeleton, Transform},
    rig::{Part, Role, Side},
};

/// Numbers that look random and are the same everywhere (SplitMix64).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(crate) fn count(&mut self, low: usize, high: usize) -> usize {
        low + (self.unit() * (high - low + 1) as f64) as usize
    }

    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let vector = DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0));
            if (0.1..=1.0).contains(&vector.length()) {
                return vector.normalize();
            }
        }
    }
}

/// An animal in meters, +Y up, facing +Z.
#[derive(Clone, Debug, Default)]
pub(crate) struct Beast {
    parents: Vec<Option<usize>>,
    places: Vec<DVec3>,
    /// What its joints mean, from the body outward.
    pub(crate) roles: BTreeMap<Role, Vec<usize>>,
}

/// Points of a chain.
type Points<'a> = &'a [[f64; 3]];

impl Beast {
    fn push(&mut self, parent: Option<usize>, place: DVec3) -> usize {
        self.parents.push(parent);
        self.places.push(place);
        self.places.len() - 1
    }

    fn chain(&mut self, mut parent: Option<usize>, points: Points<'_>, mirror: f64) -> Vec<usize> {
        let mut joints = Vec::new();
        for [x, y, z] in points {
            let joint = self.push(parent, DVec3::new(x * mirror, *y, *z));
            joints.push(joint);
            parent = Some(joint);
        }
        joints
    }

    /// A chain in the middle; its last joint.
    fn center(&mut self, part: Part, parent: Option<usize>, points: Points<'_>) -> usize {
        let joints = self.chain(parent, points, 1.0);
        let last = joints[joints.len() - 1];
        self.roles.insert(Role::center(part), joints);
        last
    }

    /// A chain on both sides, given for the left; the last joint of each.
    fn both(&mut self, part: Part, number: u8, parent: usize, points: Points<'_>) -> [usize; 2] {
        Side::BOTH.map(|side| {
            let joints = self.chain(Some(parent), points, if side == Side::Left { 1.0 } else { -1.0 });
            let last = joints[joints.len() - 1];
            self.roles.insert(Role::numbered(side, part, number), joints);
            last
        })
    }

    /// A jaw of two joints, of which the first has the role, and eyes.
    fn face(&mut self, head: usize, jaw: Points<'_>, eye: Points<'_>) {
        let jaw = self.chain(Some(head), jaw, 1.0);
        self.roles.insert(Role::center(Part::Jaw), jaw[..1].to_vec());
        self.both(Part::Eye, 1, head, eye);
    }

    /// Chains on both sides that mean nothing.
    fn nameless(&mut self, parents: [usize; 2], points: Points<'_>) {
        self.chain(Some(parents[0]), points, 1.0);
        self.chain(Some(parents[1]), points, -1.0);
    }

    /// The animal as a skeleton, in another space and unit, with joints that are turned at random and say nothing by their names.
    pub(crate) fn skeleton(&self, turn: DQuat, scale: f64, random: &mut Random) -> Skeleton {
        let mut model: Vec<Transform> = Vec::new();
        let mut joints = Vec::new();
        for (index, parent) in self.parents.iter().enumerate() {
            let rotation = DQuat::from_axis_angle(random.direction(), random.between(0.0, 3.0));
            let own = Transform { translation: turn * self.places[index] * scale, rotation, scale: DVec3::ONE };
            let rest = parent.map_or(own, |parent| model[parent].relative(&own));
            model.push(own);
            joints.push(Joint { name: format!("joint_{index}"), parent: *parent, rest, is_joint: true, node: index });
        }
        Skeleton::new(joints).expect("parents come first")
    }

    /// The same as a file would have it, in meters.
    pub(crate) fn scene(&self, turn: DQuat, scale: f64, random: &mut Random) -> Scene {
        let skeleton = self.skeleton(turn, scale, random);
        Scene { skeleton, axes: Some(Axes::default()), unit_meters: Some(1.0), ..Scene::default() }
    }
}

/// Four pairs of legs from one plate, feelers, and an abdomen of two joints.
pub(crate) fn spider() -> Beast {
    let mut beast = Beast::default();
    let pelvis = beast.center(Part::Pelvis, None, &[[0.0, 0.3, -0.15]]);
    let chest = beast.center(Part::Spine, Some(pelvis), &[[0.0, 0.3, 0.1]]);
    let head = beast.center(Part::Head, Some(chest), &[[0.0, 0.3, 0.25]]);
    beast.nameless([head; 2], &[[0.05, 0.28, 0.3], [0.06, 0.2, 0.36]]);
    beast.center(Part::Tail, Some(pelvis), &[[0.0, 0.32, -0.3], [0.0, 0.36, -0.6]]);
    for (number, (start, ahead)) in [(0.16, 0.7), (0.08, 0.3), (0.0, -0.2), (-0.06, -0.7)].into_iter().enumerate() {
        let leg = [
            [0.08, 0.3, start],
            [0.4, 0.6, start + 0.3 * ahead],
            [0.8, 0.3, start + 0.7 * ahead],
            [1.0, 0.0, start + ahead],
        ];
        beast.both(Part::Leg, number as u8 + 1, chest, &leg);
    }
    beast
}

/// Three pairs of legs along a thorax, a head with feelers and jaws, and an abdomen.
pub(crate) fn ant() -> Beast {
    let mut beast = Beast::default();
    let pelvis = beast.center(Part::Pelvis, None, &[[0.0, 0.5, -0.2]]);
    let chest = beast.center(Part::Spine, Some(pelvis), &[[0.0, 0.52, 0.0], [0.0, 0.53, 0.2]]);
    let middle = beast.roles[&Role::center(Part::Spine)][0];
    beast.center(Part::Neck, Some(chest), &[[0.0, 0.55, 0.35]]);
    let neck = beast.roles[&Role::center(Part::Neck)][0];
    let head = beast.center(Part::Head, Some(neck), &[[0.0, 0.6, 0.5]]);
    beast.nameless([head; 2], &[[0.05, 0.68, 0.6], [0.2, 0.8, 0.8], [0.3, 0.7, 1.0]]);
    beast.nameless([head; 2], &[[0.06, 0.5, 0.65], [0.02, 0.48, 0.75]]);
    beast.center(Part::Tail, Some(pelvis), &[[0.0, 0.5, -0.35], [0.0, 0.45, -0.6], [0.0, 0.4, -0.9]]);
    for (number, (from, start, ahead)) in
        [(chest, 0.2, 0.45), (middle, 0.0, 0.0), (pelvis, -0.2, -0.55)].into_iter().enumerate()
    {
        let leg = [
            [0.08, 0.48, start],
            [0.4, 0.6, start + 0.4 * ahead],
            [0.65, 0.2, start + 0.8 * ahead],
            [0.75, 0.0, start + ahead],
        ];
        beast.both(Part::Leg, number as u8 + 1, from, &leg);
    }
    beast
}

fn four_legs(beast: &mut Beast, pelvis: usize, chest: usize) {
    beast.both(
        Part::HindLeg,
        1,
        pelvis,
        &[[0.15, 0.95, -0.5], [0.2, 0.6, -0.4], [0.2, 0.35, -0.65], [0.2, 0.08, -0.6], [0.2, 0.0, -0.45]],
    );
    beast.both(
        Part::FrontLeg,
        1,
        chest,
        &[[0.18, 0.95, 0.5], [0.2, 0.6, 0.4], [0.2, 0.25, 0.5], [0.2, 0.06, 0.5], [0.2, 0.0, 0.62]],
    );
}

fn trunk(beast: &mut Beast) -> (usize, usize) {
    let pelvis = beast.center(Part::Pelvis, None, &[[0.0, 1.0, -0.5]]);
    let chest = beast.center(Part::Spine, Some(pelvis), &[[0.0, 1.05, -0.2], [0.0, 1.05, 0.15], [0.0, 1.02, 0.45]]);
    beast.center(Part::Tail, Some(pelvis), &[[0.0, 1.0, -0.7], [0.0, 0.9, -1.0], [0.0, 0.8, -1.3], [0.0, 0.7, -1.6]]);
    (pelvis, chest)
}

const NECK: [[f64; 3]; 3] = [[0.0, 1.15, 0.65], [0.0, 1.35, 0.85], [0.0, 1.6, 1.0]];

/// Four legs, a tail, and three necks.
pub(crate) fn hydra() -> Beast {
    let mut beast = Beast::default();
    let (pelvis, chest) = trunk(&mut beast);
    four_legs(&mut beast, pelvis, chest);
    let neck = beast.center(Part::Neck, Some(chest), &NECK);
    let head = beast.center(Part::Head, Some(neck), &[[0.0, 1.7, 1.15]]);
    beast.face(head, &[[0.0, 1.65, 1.25], [0.0, 1.6, 1.45]], &[[0.06, 1.78, 1.25]]);
    let sides = beast.both(Part::Neck, 1, chest, &[[0.1, 1.14, 0.62], [0.25, 1.3, 0.8], [0.4, 1.5, 0.95]]);
    for (side, neck) in Side::BOTH.into_iter().zip(sides) {
        let mirror = if side == Side::Left { 1.0 } else { -1.0 };
        let joints = beast.chain(Some(neck), &[[0.45, 1.6, 1.1]], mirror);
        beast.roles.insert(Role::new(side, Part::Head), joints.clone());
        beast.chain(Some(joints[0]), &[[0.45, 1.55, 1.2], [0.45, 1.5, 1.4]], mirror);
        for aside in [0.39, 0.51] {
            beast.chain(Some(joints[0]), &[[aside, 1.68, 1.2]], mirror);
        }
    }
    beast
}

/// Four legs, two wings with three fingers each, a neck and a tail.
pub(crate) fn dragon() -> Beast {
    let mut beast = Beast::default();
    let (pelvis, chest) = trunk(&mut beast);
    four_legs(&mut beast, pelvis, chest);
    let neck = beast.center(Part::Neck, Some(chest), &NECK);
    let head = beast.center(Part::Head, Some(neck), &[[0.0, 1.7, 1.15]]);
    beast.face(head, &[[0.0, 1.62, 1.25], [0.0, 1.55, 1.5]], &[[0.06, 1.78, 1.3]]);
    let wing = [[0.12, 1.15, 0.3], [0.7, 1.6, 0.2], [1.3, 1.5, 0.3], [2.0, 1.4, -0.2], [2.6, 1.3, -0.8]];
    let ends = beast.both(Part::Wing, 1, chest, &wing);
    let hands = ends.map(|end| {
        let knuckle = beast.parents[end].expect("a chain");
        beast.parents[knuckle].expect("a chain")
    });
    beast.nameless(hands, &[[1.5, 1.35, -0.3], [1.7, 1.2, -0.9]]);
    beast.nameless(hands, &[[1.2, 1.3, -0.3], [1.1, 1.15, -0.9]]);
    beast
}

/// Two legs with three toes ahead and one behind, spread wings, a neck, a beak and a tail.
pub(crate) fn bird() -> Beast {
    let mut beast = Beast::default();
    let pelvis = beast.center(Part::Pelvis, None, &[[0.0, 0.30, -0.05]]);
    let chest = beast.center(Part::Spine, Some(pelvis), &[[0.0, 0.33, 0.0], [0.0, 0.36, 0.08]]);
    let neck = beast.center(Part::Neck, Some(chest), &[[0.0, 0.4, 0.13], [0.0, 0.46, 0.16], [0.0, 0.52, 0.18]]);
    let head = beast.center(Part::Head, Some(neck), &[[0.0, 0.57, 0.21]]);
    beast.face(head, &[[0.0, 0.565, 0.23], [0.0, 0.55, 0.3]], &[[0.015, 0.59, 0.235]]);
    beast.center(Part::Tail, Some(pelvis), &[[0.0, 0.3, -0.12], [0.0, 0.29, -0.2], [0.0, 0.27, -0.3]]);
    let mut above = beast.both(Part::Thigh, 1, pelvis, &[[0.05, 0.28, -0.02]]);
    for (part, place) in
        [(Part::Shin, [0.06, 0.19, 0.05]), (Part::Foot, [0.06, 0.08, -0.04]), (Part::Toe, [0.06, 0.015, -0.01])]
    {
        above = Side::BOTH.map(|side| {
            let (index, mirror) = if side == Side::Left { (0, 1.0) } else { (1, -1.0) };
            let joints = beast.chain(Some(above[index]), &[place], mirror);
            beast.roles.insert(Role::new(side, part), joints.clone());
            joints[0]
        });
    }
    for (aside, ahead) in [(0.06, 0.06), (0.08, 0.05), (0.04, 0.05), (0.06, -0.05)] {
        beast.nameless(above, &[[aside, 0.0, ahead]]);
    }
    let wing = [[0.05, 0.38, 0.08], [0.2, 0.41, 0.03], [0.38, 0.41, 0.09], [0.5, 0.4, 0.05], [0.62, 0.39, -0.03]];
    let tips = beast.both(Part::Wing, 1, chest, &wing);
    let wrists = tips.map(|tip| beast.parents[beast.parents[tip].expect("a chain")].expect("a chain"));
    beast.nameless(wrists, &[[0.42, 0.39, -0.05], [0.44, 0.38, -0.1]]);
    beast
}
