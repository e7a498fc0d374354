//! Feet stand where they rest above the floor: on slopes and stairs, and in captures whose height drifts.

use glam::{DQuat, DVec3, Quat, Vec3};
use retargetd::{
    model::{Scene, Track},
    retarget::{Measures, MetricName, StackResult, parse_spec},
    samples,
};

use crate::support::corpus_file;

use super::figure::{
    Figure, agreement, measured, moved, moved_with, position, rig_of, rotation, value, with_roots_moved, with_tracks,
    world,
};

/// A walk turned about where it begins: up a slope.
fn up_a_slope(walk: &Scene, degrees: f32) -> Scene {
    let clip = &walk.clips[0];
    let Track::Sampled(way) = &clip.joints()[rig_of("walk", walk).role("pelvis")[0]].translation else {
        panic!("a pelvis that moves")
    };
    let level = |place: Vec3| Vec3::new(place.x, 0.0, place.z);
    let (begin, end) = (level(way[0]), level(*way.last().expect("frames")));
    let turn = Quat::from_axis_angle((end - begin).cross(Vec3::Y).normalize(), degrees.to_radians());
    let mut joints = clip.joints().to_vec();
    for (joint, tracks) in walk.skeleton.joints().iter().zip(&mut joints) {
        if joint.parent.is_none()
            && let (Track::Sampled(places), Track::Sampled(turns)) = (&mut tracks.translation, &mut tracks.rotation)
        {
            places.iter_mut().for_each(|place| *place = begin + turn * (*place - begin));
            turns.iter_mut().for_each(|own| *own = turn * *own);
        }
    }
    with_tracks(walk, joints)
}

/// The walk over stairs that rise by so much for every meter of the way: each step of a foot is on a tread of its own, and the pelvis goes along.
fn up_stairs(walk: &Scene, rise: f64) -> Scene {
    let rig = rig_of("walk", walk);
    let clip = &walk.clips[0];
    let parents: Vec<Option<usize>> = walk.skeleton.joints().iter().map(|joint| joint.parent).collect();
    let mut joints = clip.joints().to_vec();
    let pelvis = rig.role("pelvis")[0];
    for frame in 0..clip.frame_count() {
        let pose = world(&walk.skeleton, Some((clip, frame)));
        let lift = |joint: usize| DVec3::Y * rise * position(&pose, joint).z;
        if let Track::Sampled(places) = &mut joints[pelvis].translation {
            places[frame] += lift(pelvis).as_vec3();
        }
        for side in ["left", "right"] {
            let [thigh, shin, foot, toe] =
                ["thigh", "shin", "foot", "toe"].map(|part| rig.role(&format!("{side}_{part}"))[0]);
            let [hip, knee, ankle] = [thigh, shin, foot].map(|joint| position(&pose, joint));
            let (hip, to) = (hip + lift(pelvis), ankle + lift(toe));
            let turns = [thigh, shin, foot].map(|joint| rotation(&pose, joint));
            let (upper, lower) = (knee.distance(position(&pose, thigh)), ankle.distance(knee));
            let reach = hip.distance(to).min((upper + lower) * 0.9999);
            let along = (to - hip).normalize();
            let front = (knee + lift(pelvis) - hip).reject_from_normalized(along).normalize();
            let share = (upper * upper + reach * reach - lower * lower) / (2.0 * upper * reach);
            let bent = hip + (along * share + front * (1.0 - share * share).max(0.0).sqrt()) * upper;
            let end = hip + along * reach;
            let arc = |from: DVec3, to: DVec3| DQuat::from_rotation_arc(from.normalize(), to.normalize());
            let of_thigh = arc(knee - position(&pose, thigh), bent - hip) * turns[0];
            let of_shin = arc(ankle - knee, end - bent) * turns[1];
            let above = rotation(&pose, parents[thigh].expect("a parent"));
            for (joint, above, turn) in [(thigh, above, of_thigh), (shin, of_thigh, of_shin), (foot, of_shin, turns[2])]
            {
                if let Track::Sampled(turns) = &mut joints[joint].rotation {
                    turns[frame] = (above.conjugate() * turn).normalize().as_quat();
                }
            }
        }
    }
    with_tracks(walk, joints)
}

fn toes(target: &Scene, result: &StackResult, frame: usize) -> [DVec3; 2] {
    let roles = rig_of("target", target);
    let pose = world(&target.skeleton, Some((&result.clip, frame)));
    ["left_toe", "right_toe"].map(|role| position(&pose, roles.role(role)[0]))
}

/// A walk, and the same on other ground, both retargeted: the share of frames in which contacts of the source agree, and what the report says of
/// the second.
struct OnOtherGround {
    even: StackResult,
    other: StackResult,
    agreement: f64,
    measures: Measures,
}

impl OnOtherGround {
    fn of(walk: &Scene, other: &Scene, target: &Scene) -> Self {
        let (from, onto) = (rig_of("source", other), rig_of("target", target));
        let [even, result] = [&rig_of("source", walk), &from].map(|from| moved(from, &onto));
        let agreement = agreement(&even.contacts, &result.contacts);
        let measures = measured(&from, &onto, &result);
        Self { even, other: result, agreement, measures }
    }

    /// What feet may do there.
    fn check(&self, what: &str, least_agreement: f64) {
        assert!(self.agreement > least_agreement, "{what}: contacts agree in {} of the frames", self.agreement);
        let feet = [
            (MetricName::FootSlide, 1.0),
            (MetricName::ContactDisagreement, 0.05),
            (MetricName::FloorPenetration, 2.0),
            (MetricName::FloorFloat, 3.5),
            (MetricName::BendFlips, 0.0),
        ];
        for (name, most) in feet {
            let found = value(&self.measures, name);
            assert!(found <= most, "{what}: {name:?} is {found}");
        }
    }

    /// How much higher a foot stands at some frames than on the walk, meters.
    fn raised_by(&self, target: &Scene, foot: usize, frames: [usize; 3]) -> [f64; 3] {
        let height = |result: &StackResult, frame: usize| toes(target, result, frame)[foot].y;
        frames.map(|frame| height(&self.other, frame) - height(&self.even, frame))
    }
}

#[test]
fn feet_stand_in_a_capture_whose_height_drifts() {
    let (walk, target) = (samples::walk_scene(), samples::mannequin_scene());
    let drifting = with_roots_moved(&walk, |time| Vec3::Y * 0.06 * time as f32);
    let found = OnOtherGround::of(&walk, &drifting, &target);
    found.check("a drift", 0.95);
    // The left foot stands at 1.3 s, 2.3 s and 3.3 s.
    let raised = found.raised_by(&target, 0, [40, 70, 100]);
    let steps = [raised[1] - raised[0], raised[2] - raised[1]];
    assert!(steps.iter().all(|step| (step - 0.06).abs() < 0.01), "with the drift: {raised:?} m");
}

#[test]
fn feet_stand_on_a_slope() {
    let (walk, target) = (samples::walk_scene(), samples::mannequin_scene());
    for degrees in [10.0, -10.0] {
        let found = OnOtherGround::of(&walk, &up_a_slope(&walk, degrees), &target);
        found.check(&format!("{degrees}°"), 0.85);
        let back = DQuat::from_rotation_x(f64::from(degrees).to_radians());
        for frame in 0..90 {
            let [even, sloping] = [&found.even, &found.other].map(|result| toes(&target, result, frame));
            for (even, sloping) in even.into_iter().zip(sloping) {
                let off = (back * sloping).distance(even);
                assert!(off < 0.06, "{degrees}°, frame {frame}: {off} m from where the walk has it");
            }
        }
    }
}

#[test]
fn feet_stand_on_stairs() {
    let (walk, target) = (samples::walk_scene(), samples::mannequin_scene());
    for rise in [0.25, -0.25] {
        let found = OnOtherGround::of(&walk, &up_stairs(&walk, rise), &target);
        found.check(&format!("stairs that rise by {rise}"), 0.8);
        for (foot, frames) in [(0, [40, 70, 100]), (1, [24, 54, 84])] {
            let raised = found.raised_by(&target, foot, frames);
            let wanted = frames.map(|frame| toes(&target, &found.even, frame)[foot].z * rise);
            for tread in 0..2 {
                let [step, wanted] = [&raised, &wanted].map(|heights| heights[tread + 1] - heights[tread]);
                assert!((step - wanted).abs() < 0.01, "foot {foot}: a tread of {step} m instead of {wanted} m");
            }
        }
    }
}

/// Captured walks, turned.
#[test]
fn feet_of_captured_walks_stand_on_slopes() {
    let walks = [
        "bvh/cmu/12_01_walk.bvh",
        "bvh/misc/walk01_24fps.bvh",
        "bvh/misc/meredith_8walk_vicon.bvh",
        "mixamo/fbx/walking_noskin.fbx",
        "bvh/fair1/zombie_zup.bvh",
        "bvh/xsens/aitviewer_sample.bvh",
    ];
    let target = samples::mannequin_scene();
    for walk in walks {
        let Some(path) = corpus_file(walk) else { continue };
        let scene = Figure::read(&path).scene;
        for degrees in [8.0, -8.0] {
            let found = OnOtherGround::of(&scene, &up_a_slope(&scene, degrees), &target);
            let what = format!("{walk} on {degrees}°");
            assert!(found.agreement > 0.9, "{what}: contacts agree in {} of the frames", found.agreement);
            let depth = value(&found.measures, MetricName::FloorPenetration);
            assert!(depth < 3.6, "{what}: feet are {depth} cm in the ground");
        }
    }
}

/// A `contacts` op whose mask names no point looks at none.
#[test]
fn contacts_of_no_point_are_none() {
    let (walk, target) = (samples::walk_scene(), samples::mannequin_scene());
    let spec =
        br#"{"ops": [{"op": "pelvis"}, {"op": "fk"}, {"op": "contacts", "mask": []}, {"op": "ik"}, {"op": "plant"}]}"#;
    let spec = parse_spec(spec).expect("a config");
    let result = moved_with(&rig_of("source", &walk), &rig_of("target", &target), &spec);
    assert!(result.contacts.is_empty(), "{} points", result.contacts.len());
    assert_eq!(result.clip.frame_count(), walk.clips[0].frame_count(), "all frames");
}
