//! Trees of mirrored branches that are no bodies: how often is one taken for a body, and how sure is that said to be?

use glam::DVec3;
use retargetd::{
    model::{Joint, Skeleton, Transform},
    rig::{Hints, RigKind, recognize},
};

use crate::made_animals::Random;

const TREES: u64 = 600;
/// Least and most pairs of branches of a tree, and the share of such trees that may be taken for a biped at all, or for another
/// body. Among many pairs there are more that happen to lie like arms and legs.
const KINDS: [((usize, usize), f64); 2] = [((2, 5), 0.02), ((4, 9), 0.03)];
/// Share of all trees that may be taken for a body.
const MAX_BODIES: f64 = 0.02;
/// Where the seeds begin that thresholds were looked for with, and of those that are held.
const SEEDS: [u64; 2] = [0, 1_000_000];
/// Share of the trees that may be taken for a body of any kind with a confidence of a half or more.
const MAX_SURE: f64 = 0.01;

/// A trunk in the middle plane, and pairs of branches that are mirrored at it.
fn tree(seed: u64, pairs: (usize, usize)) -> Skeleton {
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
    for _ in 0..random.count(pairs.0, pairs.1) {
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
    for first in SEEDS {
        let bodies: usize = KINDS.into_iter().map(|(pairs, most)| bodies_of(first, pairs, most)).sum();
        let trees = TREES * KINDS.len() as u64;
        println!("{bodies} bodies of {trees} from seed {first}");
        assert!(bodies as f64 <= MAX_BODIES * trees as f64, "{bodies} of {trees} trees from seed {first} are bodies");
    }
}

/// How many of the trees with that many pairs are taken for bodies.
#[expect(clippy::print_stdout, reason = "the figures are for people, where they ask for them")]
fn bodies_of(first: u64, pairs: (usize, usize), most_taken: f64) -> usize {
    let (mut bipeds, mut quadrupeds, mut crawlers, mut sure) = (0, 0, 0, 0);
    let mut confidences = Vec::new();
    for seed in first..first + TREES {
        let skeleton = tree(seed, pairs);
        let recognition = recognize(&skeleton, &skeleton.rest_pose().to_model(&skeleton), &Hints::default());
        match recognition.kind {
            RigKind::Biped => bipeds += 1,
            RigKind::Quadruped => quadrupeds += 1,
            RigKind::Other if recognition.is_body() => crawlers += 1,
            RigKind::Other => continue,
        }
        sure += usize::from(recognition.confidence >= 0.5);
        confidences.push((recognition.confidence * 100.0).round() as i64);
    }
    confidences.sort_unstable();
    println!(
        "{pairs:?} pairs: {bipeds} bipeds, {quadrupeds} quadrupeds, {crawlers} on more legs of {TREES}, {sure} sure: \
         {confidences:?}"
    );
    let share = |count: usize| count as f64 / TREES as f64;
    assert!(share(bipeds) <= most_taken, "{bipeds} of {TREES} trees are bipeds");
    assert!(share(quadrupeds + crawlers) <= most_taken, "{quadrupeds} and {crawlers} of {TREES} are other bodies");
    assert!(share(sure) <= MAX_SURE, "{sure} of {TREES} trees are bodies for sure: {confidences:?}");
    bipeds + quadrupeds + crawlers
}
