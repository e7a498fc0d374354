//! The walk: a plan of where the feet are, legs that reach them, and a body that goes along.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3, dvec3};

use crate::model::{
    Clip, JointTracks, LocalPose, ModelPose, Track, Transform,
    rotation::{next_to, smoothstep},
};

use super::figure::{Figure, y_along_toward};

/// Frames per second of the walk.
pub const WALK_FPS: u32 = 30;
/// Length of the walk; a whole number of cycles, so it loops but for the distance traveled.
pub const WALK_SECONDS: u32 = 4;
/// Meters per second forward.
pub const WALK_SPEED: f64 = 1.2;

const CYCLE_SECONDS: f64 = 1.0;
/// Parts of a foot's cycle: the heel strikes at 0, the foot is flat until the heel leaves, then the toe leaves.
const FLAT_FROM: f64 = 0.09;
const HEEL_OFF: f64 = 0.34;
const TOE_OFF: f64 = 0.62;
/// How far before the hips a heel strikes.
const REACH: f64 = 0.31;
/// Pitch of the foot, positive with the toes down.
const STRIKE_PITCH: f64 = -0.33;
const PUSH_PITCH: f64 = 0.85;
/// The heel's place seen from the ankle, the foot flat.
const HEEL: DVec3 = dvec3(0.0, -0.085, -0.055);
/// How far a hanging upper arm is turned down from the T pose.
const ARM_DOWN: f64 = 1.34;

/// The walk of a figure that has the walker's names.
pub(super) fn walk(figure: &Figure) -> Clip {
    let walker = Walker::new(figure);
    let skeleton = figure.skeleton();
    let frames = WALK_SECONDS * WALK_FPS + 1;
    let times: Vec<f64> = (0..frames).map(|frame| f64::from(frame) / f64::from(WALK_FPS)).collect();
    let poses: Vec<LocalPose> = times.iter().map(|time| walker.pose(*time).to_local(&skeleton)).collect();
    let track = |joint: usize| {
        let mut rotations: Vec<glam::Quat> = Vec::with_capacity(poses.len());
        for pose in &poses {
            let rotation = pose.transforms()[joint].rotation.as_quat().normalize();
            rotations.push(next_to(rotation, rotations.last().copied()));
        }
        let translations = poses.iter().map(|pose| pose.transforms()[joint].translation.as_vec3()).collect();
        // Only the hips travel; the length of a bone is no animation.
        let translation = if skeleton.parent(joint).is_none() { Track::Sampled(translations) } else { Track::Rest };
        JointTracks { translation, rotation: Track::Sampled(rotations).compacted(), scale: Track::Rest }
    };
    Clip::new("Walk".into(), times, (0..figure.len()).map(track).collect())
        .expect("times rise and every value is the result of finite arithmetic")
}

/// Where a foot is: the ankle, and the pitch of the foot and of the toes.
struct FootPlan {
    ankle: DVec3,
    pitch: f64,
    toe_pitch: f64,
}

struct Walker<'a> {
    figure: &'a Figure,
    left: Side,
    right: Side,
}

/// The joints of one side.
struct Side {
    /// +1 on the left, −1 on the right.
    sign: f64,
    /// Part of the cycle by which this side is ahead.
    ahead: f64,
    upper_leg: usize,
    lower_leg: usize,
    foot: usize,
    toes: usize,
    upper_arm: usize,
    forearm: usize,
    hand: usize,
    fingers: Vec<usize>,
}

impl<'a> Walker<'a> {
    fn new(figure: &'a Figure) -> Self {
        let side = |name: &str, sign: f64, ahead: f64| {
            let joint = |part: &str| index(figure, &format!("mixamorig:{name}{part}"));
            let fingers = ["Thumb", "Index", "Middle", "Ring", "Pinky"];
            let finger = |finger: &str| [1, 2, 3].map(|segment| joint(&format!("Hand{finger}{segment}")));
            Side {
                sign,
                ahead,
                upper_leg: joint("UpLeg"),
                lower_leg: joint("Leg"),
                foot: joint("Foot"),
                toes: joint("ToeBase"),
                upper_arm: joint("Arm"),
                forearm: joint("ForeArm"),
                hand: joint("Hand"),
                fingers: fingers.into_iter().skip(1).flat_map(finger).collect(),
            }
        };
        Self { figure, left: side("Left", 1.0, 0.0), right: side("Right", -1.0, 0.5) }
    }

    fn pose(&self, seconds: f64) -> ModelPose {
        let mut turns = vec![DQuat::IDENTITY; self.figure.len()];
        let cycle = seconds / CYCLE_SECONDS;
        let hips = self.trunk(cycle, &mut turns);
        for side in [&self.left, &self.right] {
            self.arm(side, cycle, &mut turns);
        }
        let mut pose = self.place(&turns, hips);
        for side in [&self.left, &self.right] {
            self.leg(side, cycle, &mut pose);
        }
        pose
    }

    /// Turns of the trunk relative to the parent's, in model axes; gives the place of the hips.
    fn trunk(&self, cycle: f64, turns: &mut [DQuat]) -> DVec3 {
        let (sway, yaw) = ((cycle * TAU).sin(), (cycle * TAU).cos());
        let mut turn = |name: &str, rotation: DQuat| turns[index(self.figure, name)] = rotation;
        // At 0 the left heel strikes: the left hip is in front, so the pelvis is turned to the right.
        let pelvis =
            DQuat::from_rotation_y(-0.09 * yaw) * DQuat::from_rotation_z(0.05 * sway) * DQuat::from_rotation_x(0.04);
        turn("mixamorig:Hips", pelvis);
        let counter = DQuat::from_rotation_y(0.075 * yaw) * DQuat::from_rotation_z(-0.025 * sway);
        for name in ["mixamorig:Spine", "mixamorig:Spine1", "mixamorig:Spine2"] {
            turn(name, counter * DQuat::from_rotation_x(-0.008));
        }
        for name in ["mixamorig:Neck", "mixamorig:Head"] {
            turn(name, DQuat::from_rotation_y(-0.0675 * yaw) * DQuat::from_rotation_z(0.012 * sway));
        }
        // Highest over the standing leg, lowest while both feet are down shortly after a heel strike.
        let height = 0.958 - 0.016 * ((cycle - 0.045) * 2.0 * TAU).cos();
        let surge = 0.008 * ((cycle - 0.2) * 2.0 * TAU).sin();
        dvec3(0.018 * sway, height, WALK_SPEED * CYCLE_SECONDS * cycle + surge)
    }

    fn arm(&self, side: &Side, cycle: f64, turns: &mut [DQuat]) {
        // An arm swings with the other side's leg.
        let swing = ((cycle + side.ahead) * TAU).cos();
        let down = DQuat::from_rotation_z(-side.sign * ARM_DOWN);
        // Front is a negative turn about +X for an arm that hangs.
        let upper = DQuat::from_rotation_x(0.36 * swing + 0.04) * down;
        let bend = 0.3 - 0.12 * swing;
        turns[side.upper_arm] = upper;
        // A turn of the hanging arm's sagittal plane, said in the axes of the T pose.
        turns[side.forearm] = down.conjugate() * DQuat::from_rotation_x(-bend) * down;
        turns[side.hand] = down.conjugate() * DQuat::from_rotation_x(-0.06) * down;
        for finger in &side.fingers {
            turns[*finger] = DQuat::from_rotation_z(-side.sign * 0.3);
        }
    }

    /// Puts every joint where its parent carries it; `turns` are in model axes, on top of the rest pose.
    fn place(&self, turns: &[DQuat], hips: DVec3) -> ModelPose {
        let mut turned: Vec<DQuat> = Vec::with_capacity(turns.len());
        let mut placed: Vec<Transform> = Vec::with_capacity(turns.len());
        for (joint, own) in turns.iter().enumerate() {
            let rest = self.figure.model(joint);
            let (turn, translation) = match self.figure.parent(joint) {
                None => (*own, hips),
                Some(parent) => {
                    let bone = rest.translation - self.figure.model(parent).translation;
                    (turned[parent] * *own, placed[parent].translation + turned[parent] * bone)
                }
            };
            turned.push(turn);
            placed.push(Transform { translation, rotation: turn * rest.rotation, scale: DVec3::ONE });
        }
        ModelPose::new(placed)
    }

    /// Reaches the planned foot with hip and knee.
    fn leg(&self, side: &Side, cycle: f64, pose: &mut ModelPose) {
        let plan = self.foot_plan(side, cycle + side.ahead, side.ahead);
        let rest = |joint: usize| self.figure.model(joint);
        let bone = |from: usize, to: usize| rest(from).translation.distance(rest(to).translation);
        let (upper, lower) = (bone(side.upper_leg, side.lower_leg), bone(side.lower_leg, side.foot));
        let pelvis = index(self.figure, "mixamorig:Hips");
        let forward = pose.transforms()[pelvis].rotation * DVec3::Z;
        let hip = pose.transforms()[side.upper_leg].translation;
        let knee = knee(hip, plan.ankle, upper, lower, forward);

        let foot_turn = DQuat::from_rotation_x(plan.pitch);
        let toe_turn = DQuat::from_rotation_x(plan.toe_pitch);
        let toes = plan.ankle + foot_turn * (rest(side.toes).translation - rest(side.foot).translation);
        let transforms = pose.transforms_mut();
        transforms[side.upper_leg].rotation = y_along_toward((knee - hip).normalize(), forward);
        transforms[side.lower_leg].translation = knee;
        transforms[side.lower_leg].rotation = y_along_toward((plan.ankle - knee).normalize(), forward);
        transforms[side.foot].translation = plan.ankle;
        transforms[side.foot].rotation = foot_turn * rest(side.foot).rotation;
        transforms[side.toes].translation = toes;
        transforms[side.toes].rotation = toe_turn * rest(side.toes).rotation;
        // The toes' end hangs on them rigidly; it is the joint that follows in the table.
        let end = side.toes + 1;
        transforms[end].translation = toes + toe_turn * (rest(end).translation - rest(side.toes).translation);
        transforms[end].rotation = toe_turn * rest(end).rotation;
    }

    /// Where a foot is at a time in its own cycles. While it stands, the heel, the sole or the ball is at rest.
    fn foot_plan(&self, side: &Side, cycle: f64, ahead: f64) -> FootPlan {
        let stride = WALK_SPEED * CYCLE_SECONDS;
        let phase = cycle.rem_euclid(1.0);
        let step = cycle.floor();
        let rest = self.figure.model(side.foot).translation;
        // The ankle of the flat foot after the strike of this cycle.
        let planted = |step: f64| dvec3(rest.x * 0.75, rest.y, (step - ahead) * stride + REACH);
        let ball = self.figure.model(side.toes).translation - rest;
        let about = |pivot: DVec3, pitch: f64| pivot - DQuat::from_rotation_x(pitch) * pivot;
        let strike = |step: f64, pitch: f64| planted(step) + about(HEEL, pitch);
        let push = |pitch: f64| planted(step) + about(ball, pitch);

        if phase < FLAT_FROM {
            let pitch = STRIKE_PITCH * (1.0 - smoothstep(phase / FLAT_FROM));
            FootPlan { ankle: strike(step, pitch), pitch, toe_pitch: pitch }
        } else if phase < TOE_OFF {
            let part = ((phase - HEEL_OFF) / (TOE_OFF - HEEL_OFF)).max(0.0);
            let pitch = PUSH_PITCH * part * part;
            FootPlan { ankle: push(pitch), pitch, toe_pitch: 0.0 }
        } else {
            let part = (phase - TOE_OFF) / (1.0 - TOE_OFF);
            let (from, to) = (push(PUSH_PITCH), strike(step + 1.0, STRIKE_PITCH));
            let lift = 0.045 * (part * std::f64::consts::PI).sin();
            // Leaves slowly, arrives slowly, as the foot's speed must match the ground's at both ends.
            let ankle = from.lerp(to, smoothstep(part)) + DVec3::Y * lift;
            let pitch = PUSH_PITCH + (STRIKE_PITCH - PUSH_PITCH) * smoothstep((part * 1.15).min(1.0));
            FootPlan { ankle, pitch, toe_pitch: pitch * smoothstep((part * 2.5).min(1.0)) }
        }
    }
}

/// The knee of a leg from `hip` to `ankle` that bends towards `forward`.
fn knee(hip: DVec3, ankle: DVec3, upper: f64, lower: f64, forward: DVec3) -> DVec3 {
    let reach = (ankle - hip).length().min((upper + lower) * 0.999_9);
    let axis = (ankle - hip).normalize();
    let along = (reach * reach + upper * upper - lower * lower) / (2.0 * reach);
    let aside = (upper * upper - along * along).max(0.0).sqrt();
    hip + axis * along + forward.reject_from_normalized(axis).normalize() * aside
}

fn index(figure: &Figure, name: &str) -> usize {
    figure.index(name).expect("the walker's own table has this joint")
}
