//! Where a figure looks: between the turns of its eye joints and the weights of shapes that look up, down, left and right.
//!
//! A look is two angles, as seen from the head: yaw to the figure's left and pitch upward. (docs/algorithm/faces.md; VRM 1.0 `lookAt`.)

use glam::{DQuat, DVec3, Quat};

use crate::{
    model::{Clip, ClipError, LookAt, LookRange, Morph, MorphTrack, Track},
    rig::{Rig, morph_meaning},
};

/// An eye that turns by less, in radians, looks ahead.
const STILL: f64 = 0.005;

/// One eye in one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Look {
    /// Radians to the figure's left.
    pub yaw: f64,
    /// Radians upward.
    pub pitch: f64,
}

impl Look {
    /// Along a direction, in which +Z is ahead, +X to the left and +Y up.
    fn along(ahead: DVec3) -> Self {
        Self { yaw: ahead.x.atan2(ahead.z), pitch: ahead.y.atan2(ahead.x.hypot(ahead.z)) }
    }
}

/// Both eyes over the frames of a clip, left and right.
#[derive(Clone, Debug, PartialEq)]
pub struct Gaze {
    /// One entry per frame, left eye first.
    pub frames: Vec<[Look; 2]>,
}

/// The eye joints, left and right; one stands for both where a rig has no other.
fn eyes(rig: &Rig<'_>) -> Option<[usize; 2]> {
    let eye = |role| rig.role(role).first().copied();
    let (left, right) = (eye("left_eye"), eye("right_eye"));
    Some([left.or(right)?, right.or(left)?])
}

impl Gaze {
    /// Where the eye joints of a clip look; nothing where there are none, or they do not turn in their head.
    #[must_use]
    pub fn of_eyes(rig: &Rig<'_>, clip: &Clip) -> Option<Self> {
        let eyes = eyes(rig)?;
        let turns = eyes.map(|eye| InHead::new(rig, eye));
        let frames: Vec<[Look; 2]> = (0..clip.frame_count())
            .map(|frame| [0, 1].map(|side| turns[side].look(&clip.joints()[eyes[side]].rotation, frame)))
            .collect();
        Self { frames }.if_it_moves()
    }

    /// Where the clip of a file that has a gaze and no eyes looks; nothing where it has none, or looks ahead.
    #[must_use]
    pub fn of_gaze_joint(rig: &Rig<'_>, clip: &Clip) -> Option<Self> {
        let joint = rig.scene.gaze_joint?;
        let rest = rig.skeleton().joints()[joint].rest.rotation;
        let look = |frame: usize| {
            let turn = clip.joints()[joint].rotation.wide_at(frame, rest);
            [Look::along(turn * rest.conjugate() * DVec3::Z); 2]
        };
        Self { frames: (0..clip.frame_count()).map(look).collect() }.if_it_moves()
    }

    /// Where the shapes of a clip say that the eyes look; nothing where no such shape moves. `range` says what they mean.
    #[must_use]
    pub fn of_morphs(clip: &Clip, morphs: &[Morph], range: &LookAt) -> Option<Self> {
        let mut tracks: Vec<(&'static str, &MorphTrack)> = Vec::new();
        for track in clip.morphs() {
            // The meshes of one face have shapes of the same names; the first stands for all.
            if let Some(meaning) = morph_meaning(&morphs[track.morph].name).filter(|meaning| is_look(meaning))
                && tracks.iter().all(|(known, _)| *known != meaning)
            {
                tracks.push((meaning, track));
            }
        }
        if tracks.is_empty() {
            return None;
        }
        let frame = |frame: usize| {
            let weight = |name: &str| {
                let found = tracks.iter().find(|(meaning, _)| *meaning == name);
                found.map_or(0.0, |(_, track)| f64::from(track.weights.at(frame, morphs[track.morph].rest)))
            };
            let both = |one: &str, other: &str| weight(one).max(weight(other));
            let eye = |left: f64, right: f64, side: &str, is_left: bool| Look {
                yaw: range.horizontal(is_left, true).angle(left) - range.horizontal(is_left, false).angle(right),
                pitch: range.up.angle(both("lookup", &format!("eyelookup{side}")))
                    - range.down.angle(both("lookdown", &format!("eyelookdown{side}"))),
            };
            [
                eye(both("lookleft", "eyelookoutleft"), both("lookright", "eyelookinleft"), "left", true),
                eye(both("lookleft", "eyelookinright"), both("lookright", "eyelookoutright"), "right", false),
            ]
        };
        Self { frames: (0..clip.frame_count()).map(frame).collect() }.if_it_moves()
    }

    fn if_it_moves(self) -> Option<Self> {
        let moves = |look: &Look| look.yaw.abs() > STILL || look.pitch.abs() > STILL;
        self.frames.iter().flatten().any(moves).then_some(self)
    }

    /// The weights of shapes that look the same way: VRM's for both eyes, ARKit's for each.
    #[must_use]
    pub fn weights(&self, range: &LookAt) -> Vec<(&'static str, Vec<f32>)> {
        let of = |weight: &dyn Fn(&[Look; 2]) -> f64| self.frames.iter().map(|looks| weight(looks) as f32).collect();
        let mean = |looks: &[Look; 2], angle: fn(&Look) -> f64| (angle(&looks[0]) + angle(&looks[1])) / 2.0;
        let side = |eye: usize, to_left: bool, looks: &[Look; 2]| {
            let yaw = if to_left { looks[eye].yaw } else { -looks[eye].yaw };
            range.horizontal(eye == 0, to_left).weight(yaw)
        };
        let both = |to_left: bool, looks: &[Look; 2]| {
            let yaw = mean(looks, |look| look.yaw);
            range.outer.weight(if to_left { yaw } else { -yaw })
        };
        vec![
            ("lookLeft", of(&|looks| both(true, looks))),
            ("lookRight", of(&|looks| both(false, looks))),
            ("lookUp", of(&|looks| range.up.weight(mean(looks, |look| look.pitch)))),
            ("lookDown", of(&|looks| range.down.weight(-mean(looks, |look| look.pitch)))),
            ("eyeLookOutLeft", of(&|looks| side(0, true, looks))),
            ("eyeLookInLeft", of(&|looks| side(0, false, looks))),
            ("eyeLookInRight", of(&|looks| side(1, true, looks))),
            ("eyeLookOutRight", of(&|looks| side(1, false, looks))),
            ("eyeLookUpLeft", of(&|looks| range.up.weight(looks[0].pitch))),
            ("eyeLookUpRight", of(&|looks| range.up.weight(looks[1].pitch))),
            ("eyeLookDownLeft", of(&|looks| range.down.weight(-looks[0].pitch))),
            ("eyeLookDownRight", of(&|looks| range.down.weight(-looks[1].pitch))),
        ]
    }

    /// The clip with eye joints that look so; nothing where the rig has none, or the clip turns them already.
    ///
    /// # Errors
    /// When the result does not fit into the numbers of a track.
    pub fn onto_eyes(&self, rig: &Rig<'_>, clip: &Clip) -> Result<Option<Clip>, ClipError> {
        let Some(eyes) = eyes(rig).filter(|_| Self::of_eyes(rig, clip).is_none()) else { return Ok(None) };
        let mut joints = clip.joints().to_vec();
        for (side, eye) in eyes.into_iter().enumerate() {
            let in_head = InHead::new(rig, eye);
            let turns = self.frames.iter().map(|looks| in_head.turned(looks[side]).as_quat());
            joints[eye].rotation = Track::Sampled(turns.collect()).on_one_hemisphere().compacted();
        }
        clip.clone().with_joints(joints).map(Some)
    }
}

/// Whether a shape, by what its name means, looks somewhere.
#[must_use]
pub fn is_look(meaning: &str) -> bool {
    meaning.starts_with("look") || meaning.starts_with("eyelook")
}

/// How an eye turns below the joint above it, which is the head or moves with it.
struct InHead {
    local_rest: DQuat,
    /// `canonical_from_parent` at rest, and `canonical_from_eye`.
    canonical_from_parent: DQuat,
    canonical_from_eye: DQuat,
}

impl InHead {
    fn new(rig: &Rig<'_>, eye: usize) -> Self {
        let rest = |joint: usize| rig.canonical_from_scene * rig.rest.transforms()[joint].rotation;
        let parent = rig.skeleton().parent(eye);
        let canonical_from_parent = parent.map_or(rig.canonical_from_scene, rest);
        let canonical_from_eye = rest(eye);
        Self { local_rest: rig.skeleton().joints()[eye].rest.rotation, canonical_from_parent, canonical_from_eye }
    }

    fn look(&self, track: &Track<Quat>, frame: usize) -> Look {
        let local = track.wide_at(frame, self.local_rest);
        // With P and E at rest, a local rotation L turns what looks ahead by P · L · E⁻¹.
        let ahead = (self.canonical_from_parent * local * self.canonical_from_eye.conjugate()) * DVec3::Z;
        Look::along(ahead)
    }

    fn turned(&self, look: Look) -> DQuat {
        let turn = DQuat::from_rotation_y(look.yaw) * DQuat::from_rotation_x(-look.pitch);
        (self.canonical_from_parent.conjugate() * turn * self.canonical_from_eye).normalize()
    }
}

/// Whether an eye's look to a side is inward or outward.
trait Sides {
    fn horizontal(&self, is_left_eye: bool, to_left: bool) -> &LookRange;
}

impl Sides for LookAt {
    fn horizontal(&self, is_left_eye: bool, to_left: bool) -> &LookRange {
        if is_left_eye == to_left { &self.outer } else { &self.inner }
    }
}
