//! Trees of mirrored branches that are no bodies: how often is one taken for a body, and how sure is that said to be?

use glam::DVec3;
use retargetd::{
    model::{Joint, Skeleton, Transform},
    rig::{Hints, RigKind, recognise},
};

const TREES: u64 = 600;
/// Share of the trees that may be taken for a biped at all.
const MOST_TAKEN: f64 = 0.03;
/// Share of the trees that may be taken for a body of any kind with a confidence of a half or more.
const MOST_SURE: f64 = 0.01;

/// Numbers that look random and are the same everywhere (SplitMix64).
pub(super) struct Random(pub(super) u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    fn count(&mut self, low: usize, high: usize) -> usize {
        low + (self.unit() * (high - low + 1) as f64) as usize
    }

    pub(super) fn direction(&mut self) -> DVec3 {
        loop {
            let vector = DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0));
            if (0.1..=1.0).contains(&vector.length()) {
                return vector.normalize();
            }
        }
    }
}

/// A trunk in the middle plane, and pairs of branches that are mirrored at it.
fn tree(seed: u64) -> Skeleton {
    let mut random = Random(seed);
    let mut joints: Vec<Joint> = Vec::new();
    let mut push = |parent: Option<usize>, bone: DVec3| {
        let rest = Transform::from_translation(bone);
        joints.push(Joint { name: String::new(), parent, rest, is_joint: true, node: joints.len() });
        joints.len() - 1
    };
    let mut trunk = vec![push(None, DVec3::Y)];
    for _ in 0..random.count(1, 7) {
        let bone = random.direction() * random.between(0.05, 0.4);
        let parent = trunk[random.count(0, trunk.len() - 1)];
        trunk.push(push(Some(parent), DVec3::new(0.0, bone.y, bone.z)));
    }
    for _ in 0..random.count(2, 5) {
        let center = trunk[random.count(0, trunk.len() - 1)];
        let mut ends = [center; 2];
        let (mut heading, bend) = (random.direction(), random.between(0.0, 1.0));
        for _ in 0..random.count(2, 6) {
            heading = (heading + random.direction() * bend).normalize_or_zero();
            let bone = heading * random.between(0.05, 0.4);
            ends = [push(Some(ends[0]), bone), push(Some(ends[1]), bone * DVec3::new(-1.0, 1.0, 1.0))];
        }
    }
    Skeleton::new(joints).expect("parents come first")
}

#[test]
#[expect(clippy::print_stdout, reason = "the figures are for people, where they ask for them")]
fn few_random_trees_are_taken_for_bodies() {
    let (mut bipeds, mut others, mut sure) = (0, 0, 0);
    let mut confidences = Vec::new();
    for seed in 0..TREES {
        let skeleton = tree(seed);
        let recognition = recognise(&skeleton, &skeleton.rest_pose().to_model(&skeleton), &Hints::default());
        match recognition.kind {
            RigKind::Biped => bipeds += 1,
            RigKind::Other => continue,
            RigKind::Quadruped => others += 1,
        }
        sure += usize::from(recognition.confidence >= 0.5);
        confidences.push((recognition.confidence * 100.0).round() as i64);
    }
    confidences.sort_unstable();
    println!("{bipeds} bipeds and {others} others of {TREES}, {sure} sure: {confidences:?}");
    let share = |count: usize| count as f64 / TREES as f64;
    assert!(share(bipeds) <= MOST_TAKEN, "{bipeds} of {TREES} trees are bipeds");
    assert!(share(sure) <= MOST_SURE, "{sure} of {TREES} trees are bodies for sure: {confidences:?}");
}
