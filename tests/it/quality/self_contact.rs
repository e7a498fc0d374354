//! Hands that touch the body: clips made by code whose contacts are known, onto bodies of other thickness and other proportions.
//!
//! Both bodies get a skin of rings about their bones, so that it is known how thick they are; gaps are measured here.

use glam::{DQuat, DVec3, Quat};
use retargetd::{
    model::{Clip, Control, JointTracks, Reporter, Scene, SkinPoint, SkinPoints, Track},
    retarget::{MetricName, Resolved, Stack, parse_spec, resolve},
    rig::Rig,
    samples,
};

use super::figure::{Figure, measured as report_of, moved_with, position, rig_of, value, world};
use crate::support::corpus_file;

const PLAIN: &str = r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#;
const TOUCHING: &str = r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}, {"op": "self_contact"}]}"#;
const FRAMES: usize = 90;
/// Share of the height within which surfaces touch.
const TOUCH: f64 = 0.02;
const MIN_RECALL: f64 = 0.9;
/// Share of the height by which a hand may be deeper in the body than the source's: not at all, but for the noise of the measure. Radii
/// that are found from the points of a skin are that precise, 0.4 mm of a man: hands on heads are 0.0002 deeper by the measure here
/// however often they are brought out.
const MAX_DEEPER: f64 = 2.5e-4;

/// Names of the joints of a body.
pub(super) struct Names {
    pelvis: &'static str,
    chest: &'static str,
    head: &'static str,
    /// Left and right: upper arm, forearm, hand, middle finger, thigh, shin, foot.
    arms: [[&'static str; 4]; 2],
    legs: [[&'static str; 3]; 2],
}

pub(super) const MIXAMO: Names = Names {
    pelvis: "mixamorig:Hips",
    chest: "mixamorig:Spine2",
    head: "mixamorig:Head",
    arms: [
        ["mixamorig:LeftArm", "mixamorig:LeftForeArm", "mixamorig:LeftHand", "mixamorig:LeftHandMiddle1"],
        ["mixamorig:RightArm", "mixamorig:RightForeArm", "mixamorig:RightHand", "mixamorig:RightHandMiddle1"],
    ],
    legs: [
        ["mixamorig:LeftUpLeg", "mixamorig:LeftLeg", "mixamorig:LeftFoot"],
        ["mixamorig:RightUpLeg", "mixamorig:RightLeg", "mixamorig:RightFoot"],
    ],
};

pub(super) const UNREAL: Names = Names {
    pelvis: "pelvis",
    chest: "spine_05",
    head: "head",
    arms: [
        ["upperarm_l", "lowerarm_l", "hand_l", "middle_01_l"],
        ["upperarm_r", "lowerarm_r", "hand_r", "middle_01_r"],
    ],
    legs: [["thigh_l", "calf_l", "foot_l"], ["thigh_r", "calf_r", "foot_r"]],
};

/// A body of known thickness.
pub(super) struct Body {
    pub(super) scene: Scene,
    names: &'static Names,
    hips: f64,
    upper_arm: f64,
    head: f64,
    leg: f64,
}

impl Body {
    /// `stout` is how many times as thick as usual it is.
    pub(super) fn new(mut scene: Scene, names: &'static Names, stout: f64) -> Self {
        let rest = world(&scene.skeleton, None);
        let joint =
            |name: &str| (0..scene.skeleton.len()).find(|&joint| scene.skeleton.label(joint) == name).expect(name);
        let place = |name: &str| position(&rest, joint(name));
        let [thigh, shin, foot] = names.legs[0].map(place);
        let leg = thigh.distance(shin) + shin.distance(foot);
        let (hips, upper_arm, head) = (0.14 * leg * stout, 0.06 * leg * stout, 0.12 * leg * stout);
        let mut points = Vec::new();
        let mut ring = |joint: usize, from: DVec3, to: DVec3, radius: f64| {
            let line = (to - from).normalize();
            let side = line.any_orthonormal_vector();
            for step in 0..64_u32 {
                let turn = DQuat::from_axis_angle(line, f64::from(step) * 0.8);
                let place = from + (to - from) * (f64::from(step) / 63.0) + turn * side * radius;
                let local = rest[joint].inverse().transform_point3(place).as_vec3();
                points.push((u32::try_from(joint).expect("few"), SkinPoint { position: local, weight: 1.0 }));
            }
        };
        ring(joint(names.pelvis), place(names.legs[0][0]), place(names.legs[1][0]), hips);
        for arm in names.arms {
            ring(joint(arm[0]), place(arm[0]), place(arm[1]), upper_arm);
        }
        let skull = place(names.head) + DVec3::Y * (0.07 * leg);
        ring(joint(names.head), skull, skull + DVec3::Y * (0.06 * leg), head);
        let chest = (place(names.arms[0][0]) + place(names.arms[1][0])) / 2.0 - DVec3::Y * (0.12 * leg);
        ring(joint(names.chest), chest - DVec3::X * 0.05, chest + DVec3::X * 0.05, hips);
        scene.skin_points = SkinPoints::new(scene.skeleton.len(), &points);
        Self { scene, names, hips, upper_arm, head, leg }
    }

    fn joint(&self, name: &str) -> usize {
        (0..self.scene.skeleton.len())
            .find(|&joint| self.scene.skeleton.label(joint) == name)
            .expect("a joint of that name")
    }

    fn height(&self) -> f64 {
        let rest = world(&self.scene.skeleton, None);
        position(&rest, self.joint(self.names.head)).y + 0.2 * self.leg
    }

    fn hand_radius(&self) -> f64 {
        0.025 * self.leg
    }

    fn palm(&self, pose: &[glam::DMat4], arm: usize) -> DVec3 {
        let (wrist, knuckle) = (self.joint(self.names.arms[arm][2]), self.joint(self.names.arms[arm][3]));
        position(pose, wrist).lerp(position(pose, knuckle), 0.8)
    }

    /// Between the surface of a hand and of what it is to touch.
    fn gap(&self, contact: Contact, pose: &[glam::DMat4], arm: usize) -> f64 {
        let palm = self.palm(pose, arm);
        let place = |name: &str| position(pose, self.joint(name));
        let other = 1 - arm;
        let (from, to, radius) = match contact {
            Contact::Hips => (place(self.names.legs[0][0]), place(self.names.legs[1][0]), self.hips),
            Contact::Clap => (self.palm(pose, other), self.palm(pose, other), self.hand_radius()),
            Contact::CrossedArms => {
                (place(self.names.arms[other][0]), place(self.names.arms[other][1]), self.upper_arm)
            }
            Contact::Head => {
                let head = pose[self.joint(self.names.head)];
                let rest = world(&self.scene.skeleton, None)[self.joint(self.names.head)];
                let up = (head * rest.inverse()).transform_vector3(DVec3::Y) * self.leg;
                let at = place(self.names.head);
                (at + up * 0.07, at + up * 0.13, self.head)
            }
        };
        let share = ((palm - from).dot(to - from) / (to - from).length_squared().max(1e-12)).clamp(0.0, 1.0);
        palm.distance(from.lerp(to, share)) - radius - self.hand_radius()
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Contact {
    Hips,
    Clap,
    CrossedArms,
    Head,
}

/// How near hands come to where they touch: 0 far away, 1 there; there for a second in the middle.
fn nearness(frame: usize) -> f64 {
    let seconds = frame as f64 / 30.0;
    let rise = |time: f64| {
        let time = time.clamp(0.0, 1.0);
        time * time * (3.0 - 2.0 * time)
    };
    rise(seconds / 0.9).min(rise((3.0 - seconds) / 0.9))
}

/// A clip in which both hands go to where they touch, stay and come back.
pub(super) fn clip_of(body: &Body, contact: Contact) -> Clip {
    let skeleton = &body.scene.skeleton;
    let rest = world(skeleton, None);
    let mut rotations: Vec<Vec<Quat>> = vec![Vec::new(); skeleton.len()];
    for frame in 0..FRAMES {
        for (arm, names) in body.names.arms.iter().enumerate() {
            let [upper, lower, hand, _] = names.map(|name| body.joint(name));
            let side = if arm == 0 { 1.0 } else { -1.0 };
            let shoulder = position(&rest, upper);
            let away = shoulder + DVec3::new(0.1 * side, -0.35, 0.3);
            let palm = away.lerp(touching(body, contact, arm, &rest), nearness(frame));
            let lengths = (shoulder.distance(position(&rest, lower)), {
                let palm = body.palm(&rest, arm);
                position(&rest, lower).distance(palm)
            });
            let (elbow, palm) = bent(shoulder, palm, lengths, pole(arm));
            let turned = |joint: usize, rest_line: DVec3, line: DVec3| {
                DQuat::from_rotation_arc(rest_line.normalize(), line.normalize())
                    * super::figure::rotation(&rest, joint)
            };
            let upper_world = turned(upper, position(&rest, lower) - shoulder, elbow - shoulder);
            let lower_world = turned(lower, body.palm(&rest, arm) - position(&rest, lower), palm - elbow);
            let above = super::figure::rotation(&rest, skeleton.parent(upper).expect("a clavicle"));
            rotations[upper].push((above.inverse() * upper_world).normalize().as_quat());
            rotations[lower].push((upper_world.inverse() * lower_world).normalize().as_quat());
            rotations[hand].push(skeleton.joints()[hand].rest.rotation.as_quat());
        }
    }
    let tracks = rotations.into_iter().map(|rotations| JointTracks {
        rotation: if rotations.is_empty() { Track::Rest } else { Track::Sampled(rotations) },
        ..JointTracks::default()
    });
    let times = (0..FRAMES).map(|frame| frame as f64 / 30.0).collect();
    Clip::new("touching".into(), times, tracks.collect()).expect("a valid clip")
}

/// Where a palm is when it touches.
fn touching(body: &Body, contact: Contact, arm: usize, rest: &[glam::DMat4]) -> DVec3 {
    let place = |name: &str| position(rest, body.joint(name));
    let side = if arm == 0 { 1.0 } else { -1.0 };
    let ball = body.hand_radius();
    match contact {
        Contact::Hips => {
            place(body.names.legs[arm][0]) + DVec3::new(0.9 * side, 0.3, 0.3).normalize() * (body.hips + ball)
        }
        Contact::Clap => {
            let middle = (place(body.names.arms[0][0]) + place(body.names.arms[1][0])) / 2.0;
            middle + DVec3::new(0.0, -0.15, 0.42) + DVec3::X * (side * ball)
        }
        Contact::CrossedArms => crossed(body, rest)[arm],
        Contact::Head => {
            let head = place(body.names.head) + DVec3::Y * (0.1 * body.leg);
            head + DVec3::new(side, 0.1, 0.35).normalize() * (body.head + ball)
        }
    }
}

/// Where the palms are when each lies on the other upper arm, one above the other.
fn crossed(body: &Body, rest: &[glam::DMat4]) -> [DVec3; 2] {
    let joints = body.names.arms.map(|names| [body.joint(names[0]), body.joint(names[1])]);
    let shoulders = joints.map(|arm| position(rest, arm[0]));
    let lengths = [0, 1].map(|arm| {
        let elbow = position(rest, joints[arm][1]);
        (shoulders[arm].distance(elbow), elbow.distance(body.palm(rest, arm)))
    });
    let mut palms = [shoulders[1] - DVec3::Y * 0.2, shoulders[0] - DVec3::Y * 0.2];
    // Where a palm lies decides where the elbow is that the other palm lies beside.
    for _ in 0..100 {
        let elbows = [0, 1].map(|arm| bent(shoulders[arm], palms[arm], lengths[arm], pole(arm)).0);
        palms = [0, 1].map(|arm| {
            let other = 1 - arm;
            let place = shoulders[other].lerp(elbows[other], 0.55 + 0.2 * arm as f64);
            let line = (elbows[other] - shoulders[other]).normalize();
            let front = DVec3::new(if arm == 0 { 0.5 } else { -0.5 }, 0.0, 1.0);
            place + (front - line * front.dot(line)).normalize() * (body.upper_arm + body.hand_radius())
        });
    }
    palms
}

/// Which way an elbow points.
fn pole(arm: usize) -> DVec3 {
    DVec3::new(if arm == 0 { 0.7 } else { -0.7 }, -0.6, -0.4)
}

/// Elbow and end of an arm that reaches for a place.
fn bent(start: DVec3, goal: DVec3, (upper, lower): (f64, f64), pole: DVec3) -> (DVec3, DVec3) {
    let line = (goal - start).normalize();
    let distance = start.distance(goal).clamp((upper - lower).abs() + 1e-6, upper + lower - 1e-6);
    let along = (distance * distance + upper * upper - lower * lower) / (2.0 * distance);
    let off = (pole - line * pole.dot(line)).normalize();
    (start + line * along + off * (upper * upper - along * along).max(0.0).sqrt(), start + line * distance)
}

fn retargeted(spec: &str, source: &Scene, clip: &Clip, target: &Scene) -> Clip {
    let spec = parse_spec(spec.as_bytes()).expect("a spec");
    let mut reporter = Reporter::new();
    let source = Rig::new("source", source, None, &spec.source, &mut reporter).expect("a source");
    let target = Rig::new("target", target, None, &spec.target, &mut reporter).expect("a target");
    let Resolved { mapping, ops, .. } = resolve(&spec, &source, &target, clip, &mut reporter).expect("a mapping");
    let stack = Stack::new(source.skeleton(), target.skeleton(), &mapping, &ops);
    stack.run(clip, &Control::new()).expect("a result").clip
}

/// The gaps of both hands at all frames, as shares of the height.
pub(super) fn gaps(body: &Body, contact: Contact, clip: &Clip) -> Vec<f64> {
    let of_frame = |frame: usize| {
        let pose = world(&body.scene.skeleton, Some((clip, frame)));
        [0, 1].map(|arm| body.gap(contact, &pose, arm) / body.height())
    };
    (0..FRAMES).flat_map(of_frame).collect()
}

/// Share of the source's contacts that the target has, how many there are, and how much deeper the target's hands come.
fn measured(contact: Contact, source: &Body, clip: &Clip, target: &Body, result: &Clip) -> (f64, usize, f64) {
    let (mut kept, mut all, mut deeper) = (0_usize, 0_usize, 0.0_f64);
    for frame in 0..FRAMES {
        let before = world(&source.scene.skeleton, Some((clip, frame)));
        let after = world(&target.scene.skeleton, Some((result, frame)));
        for arm in 0..2 {
            let own = source.gap(contact, &before, arm) / source.height();
            let theirs = target.gap(contact, &after, arm) / target.height();
            if own.abs() < TOUCH {
                all += 1;
                kept += usize::from(theirs.abs() < TOUCH);
            }
            deeper = deeper.max((-theirs).max(0.0) - (-own).max(0.0));
        }
    }
    (kept as f64 / all.max(1) as f64, all, deeper)
}

#[test]
#[expect(clippy::print_stderr, reason = "the figures are worth seeing even when they pass")]
fn hands_touch_what_they_touched() {
    let source = Body::new(samples::walk_scene(), &MIXAMO, 1.0);
    let targets = [
        ("the same body", Body::new(samples::walk_scene(), &MIXAMO, 1.0)),
        ("a stout one", Body::new(samples::walk_scene(), &MIXAMO, 1.5)),
        ("a slim one", Body::new(samples::walk_scene(), &MIXAMO, 0.7)),
        ("another skeleton", Body::new(samples::mannequin_scene(), &UNREAL, 1.0)),
        ("another skeleton, stout", Body::new(samples::mannequin_scene(), &UNREAL, 1.4)),
    ];
    let mut problems = Vec::new();
    for contact in [Contact::Hips, Contact::Clap, Contact::CrossedArms, Contact::Head] {
        let clip = clip_of(&source, contact);
        for (name, target) in &targets {
            let [plain, touching] = [PLAIN, TOUCHING].map(|spec| retargeted(spec, &source.scene, &clip, &target.scene));
            let (without, all, sunk) = measured(contact, &source, &clip, target, &plain);
            let (with, _, deeper) = measured(contact, &source, &clip, target, &touching);
            eprintln!(
                "{contact:?} onto {name}: of {all} contacts {:.0} % without, {:.0} % with; deeper by {:.2} % -> {:.2} % of the height",
                without * 100.0,
                with * 100.0,
                sunk * 100.0,
                deeper * 100.0
            );
            if all < 30 {
                problems.push(format!("{contact:?}: the clip has {all} contacts only"));
            }
            if with < MIN_RECALL {
                problems.push(format!("{contact:?} onto {name}: {:.0} % of {all} contacts", with * 100.0));
            }
            if deeper > MAX_DEEPER {
                problems.push(format!("{contact:?} onto {name}: hands sink by {:.2} % of the height", deeper * 100.0));
            }
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// A stack with a share of the op: hands go so much of the way.
#[test]
fn a_share_of_the_op_is_that_share_of_the_way() {
    let source = Body::new(samples::walk_scene(), &MIXAMO, 1.0);
    let target = Body::new(samples::walk_scene(), &MIXAMO, 1.5);
    let clip = clip_of(&source, Contact::Hips);
    let middle = FRAMES / 2;
    let palms = |spec: &str| {
        let result = retargeted(spec, &source.scene, &clip, &target.scene);
        let pose = world(&target.scene.skeleton, Some((&result, middle)));
        [0, 1].map(|arm| target.palm(&pose, arm))
    };
    let (plain, whole) = (palms(PLAIN), palms(TOUCHING));
    let half = palms(r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}, {"op": "self_contact", "alpha": 0.5}]}"#);
    for arm in 0..2 {
        let way = plain[arm].distance(whole[arm]);
        assert!(way > 0.02, "a hand is led by {way} m");
        let expected = plain[arm].midpoint(whole[arm]);
        assert!(half[arm].distance(expected) < 0.02 * way, "{} of {way} m off", half[arm].distance(expected));
    }
}

/// Walks, jumps and jumping jacks whose hands pass the thighs with nearly straight arms: elbows snapped by 22 to 48 degrees within a frame.
#[test]
fn elbows_do_not_snap_where_hands_pass_the_body() {
    for (file, onto) in [
        ("bvh/cmu/12_01_walk.bvh", "cc0-stylised/kaykit_knight.glb"),
        ("bvh/cmu/01_01_motionbuilder.bvh", "vrm1/makehuman_body_vrm1.vrm"),
        ("bvh/cmu/jumping_jacks_max_names.bvh", "unreal/mannequiny.glb"),
    ] {
        let (Some(source), Some(target)) = (corpus_file(file), corpus_file(onto)) else { return };
        let (source, target) = (Figure::read(&source), Figure::read(&target));
        let (from, to) = (rig_of("source", &source.scene), rig_of("target", &target.scene));
        let result = moved_with(&from, &to, &serde_json::from_str(TOUCHING).expect("a spec"));
        let pop = value(&report_of(&from, &to, &result), MetricName::ElbowPop);
        assert!(pop < 15.0, "{file} onto {onto}: {pop} degrees");
    }
}
