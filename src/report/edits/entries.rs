//! Which edits the page shows, with which config, and by which curve.

use crate::{
    model::{Clip, JointTracks, Track},
    rig::Rig,
};

/// One figure.
pub(super) struct Entry {
    /// The field of the config that it is about; what follows a dot is one of its ways.
    pub(super) name: &'static str,
    pub(super) text: &'static str,
    pub(super) config: &'static str,
    pub(super) shown: Shown,
}

const fn entry(name: &'static str, config: &'static str, shown: Shown, text: &'static str) -> Entry {
    Entry { name, text, config, shown }
}

use Shown::{Height, Lead, Travel};

pub(super) const ENTRIES: [Entry; 24] = [
    entry("range", r#"{"edit": {"range": [1.0, 2.5]}}"#, Height, "A part of the clip, which then begins at 0."),
    entry(
        "range.cycle",
        r#"{"edit": {"range": {"cycles": 1}, "loop": {"times": 3, "blend_seconds": 0.1}}}"#,
        Height,
        "One cycle of the walk, found by where its poses come back, and played three times.",
    ),
    entry("every", r#"{"edit": {"every": 6}}"#, Height, "Every sixth frame; straight lines between them."),
    entry(
        "warp",
        r#"{"edit": {"warp": [[0, 0], [1, 2], [2, 2.5], [4, 4]]}}"#,
        Height,
        "Time runs along a smooth curve through pairs of times: slow at first, then fast.",
    ),
    entry("speed", r#"{"edit": {"speed": 2.0}}"#, Height, "Twice as fast."),
    entry("reverse", r#"{"edit": {"reverse": true}}"#, Travel, "Backward."),
    entry("ping_pong", r#"{"edit": {"range": [0, 2], "ping_pong": true}}"#, Travel, "There and back."),
    entry(
        "loop",
        r#"{"edit": {"range": [0.0, 1.3], "loop": {"times": 3, "blend_seconds": 0.3}}}"#,
        Lead,
        "The end bends toward the start over the last 0.3 s, and the clip is played three times.",
    ),
    entry(
        "loop.root",
        r#"{"edit": {"range": [0.0, 1.3], "loop": {"times": 3, "root": "restart"}}}"#,
        Travel,
        "The same, going back to where it began each time.",
    ),
    entry(
        "hold",
        r#"{"edit": {"range": [0, 2], "hold": {"before_seconds": 1.0, "after_seconds": 1.0}}}"#,
        Height,
        "Stands still before and after.",
    ),
    entry("fps", r#"{"edit": {"fps": 6}}"#, Height, "Six frames per second; what lies between frames is averaged."),
    entry(
        "interpolation",
        r#"{"edit": {"range": [0, 0.5], "interpolation": "cubic", "fps": 240}}"#,
        Height,
        "Eight times as many frames, on a smooth curve through the keys.",
    ),
    entry("start_seconds", r#"{"edit": {"start_seconds": 1.5}}"#, Height, "The first frame is at 1.5 s."),
    entry("mirror", r#"{"edit": {"mirror": true}}"#, Lead, "Left and right swapped: the other foot leads."),
    entry(
        "filter",
        r#"{"edit": {"filter": {"kind": "bell", "seconds": 0.4}}}"#,
        Height,
        "Rotations smoothed over time, here far more than noise needs.",
    ),
    entry(
        "filter.savitzky_golay",
        r#"{"edit": {"filter": {"kind": "savitzky_golay", "reach_frames": 12}}}"#,
        Height,
        "A polynomial of the third degree through twelve frames to each side: peaks keep more of their height.",
    ),
    entry(
        "filter.butterworth",
        r#"{"edit": {"filter": {"kind": "butterworth", "cutoff_hertz": 2.0}}}"#,
        Height,
        "What swings faster than twice a second goes.",
    ),
    entry(
        "filter.median",
        r#"{"edit": {"filter": {"kind": "median", "reach_frames": 3}}}"#,
        Height,
        "The median of seven frames: spikes vanish, and turning points become a little flat.",
    ),
    entry(
        "margin_seconds",
        r#"{"edit": {"range": [1.0, 2.5], "margin_seconds": 1.0, "filter": {"kind": "bell", "seconds": 0.4}}}"#,
        Height,
        "A part of the clip, filtered as if the whole clip were: its ends do not bend.",
    ),
    entry(
        "additive",
        r#"{"edit": {"additive": "first_frame"}}"#,
        Height,
        "What the clip changes against its first frame, as changes of the rest pose.",
    ),
    entry(
        "layer",
        r#"{"edit": {"range": [0, 1]}, "layer": {"mask": ["left_leg"], "at_seconds": 1.5, "seam_seconds": 0.25}}"#,
        Height,
        "The clip's first second over it again at 1.5 s, on one leg; jumps at the seams die away.",
    ),
    entry(
        "layer.weight",
        r#"{"edit": {"mirror": true}, "layer": {"weight": 0.5}}"#,
        Lead,
        "Half of the mirrored walk mixed with half of the walk: both feet stay together.",
    ),
    entry(
        "layer.add",
        r#"{"edit": {"range": [0, 4]}, "layer": {"mode": "add", "weight": 0.5, "mask": ["left_leg"]}}"#,
        Height,
        "Half of what the walk changes against its first frame on top of the walk, on one leg.",
    ),
    entry(
        "keys",
        r#"{"output": {"keys": "needed"}}"#,
        Height,
        "The keys that the thigh still has where a file holds only those that are needed.",
    ),
];

/// What a curve is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shown {
    /// How high the left foot is.
    Height,
    /// How far the left foot is ahead of the right one.
    Lead,
    /// How far forward the pelvis is.
    Travel,
}

impl Shown {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Height => "height of the left ankle",
            Self::Lead => "how far the left foot is ahead of the right one",
            Self::Travel => "how far forward the pelvis is",
        }
    }

    #[expect(clippy::unused_self, reason = "every curve is a length, and the caller need not know")]
    pub(super) const fn unit(self) -> &'static str {
        "m"
    }

    /// The value at each frame; 0 where the rig lacks the parts.
    pub(super) fn of(self, rig: &Rig<'_>, clip: &Clip) -> Vec<f64> {
        let joint = |role: &str| rig.role(role).first().copied();
        let (left, right, pelvis) = (joint("left_foot"), joint("right_foot"), joint("pelvis"));
        let value = |frame: usize| {
            let pose = clip.local_pose(rig.skeleton(), frame).to_model(rig.skeleton());
            let place = |joint: Option<usize>| {
                joint.map_or(glam::DVec3::ZERO, |joint| rig.canonical_from_scene * pose.transforms()[joint].translation)
            };
            match self {
                Self::Height => place(left).y,
                Self::Lead => place(left).z - place(right).z,
                Self::Travel => place(pelvis).z,
            }
        };
        (0..clip.frame_count()).map(value).collect()
    }
}

/// The joint whose keys the page shows.
pub(super) fn left_thigh(rig: &Rig<'_>) -> Option<usize> {
    rig.role("left_thigh").first().copied()
}

/// The clip at these of its frames only; as it is where there are none.
pub(super) fn only(clip: &Clip, frames: &[usize]) -> Clip {
    fn taken<T: Copy>(track: &Track<T>, frames: &[usize]) -> Track<T> {
        match track {
            Track::Sampled(values) => Track::Sampled(frames.iter().map(|frame| values[*frame]).collect()),
            other => other.clone(),
        }
    }
    let tracks = clip.joints().iter().map(|joint| JointTracks {
        translation: taken(&joint.translation, frames),
        rotation: taken(&joint.rotation, frames),
        scale: taken(&joint.scale, frames),
    });
    let times = frames.iter().map(|frame| clip.times_seconds()[*frame]).collect();
    Clip::new(clip.name().to_owned(), times, tracks.collect()).unwrap_or_else(|_| clip.clone())
}
