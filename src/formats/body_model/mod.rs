//! Captures of people as body-model parameters or joint positions: SMPL, SMPL+H, SMPL-X, AMASS, AIST++, HumanML3D.
//!
//! Such files hold numbers and no skeleton. The skeleton is the mean body's, from published tables ([`skeleton`]); the shape
//! of the very person would need the licensed model. What is read:
//!
//! | file | arrays |
//! |---|---|
//! | `.npz` | `poses`, `smpl_poses`, `fullpose`, `pose`, `smpl_thetas` (ROMP, BEV) or `arr_0`: F×3J axis angles (J = 22, 24, 52, 55), F×J×3, or matrices F×J×3×3 or F×9J; a single pose without F |
//! | | or in parts: `root_orient`/`global_orient`, `pose_body`/`body_pose`, `pose_jaw`, `pose_eye`, `pose_hand` |
//! | | `trans`, `transl` or `smpl_trans`: F×3; `smpl_scaling`; `mocap_frame_rate`, `mocap_framerate`, `fps` |
//! | `.npy` | F×22×3 or F×24×3 joint positions, or F×263 features as HumanML3D has them; vectors 3J, F×3J, F×(3J + 3) with the place at the
//!            end, F×322 (Motion-X), or matrices F×J×3×3 and J×3×3, of a body model |
//!
//! The scene is in meters with Y up and Z to the front, whichever axis of the file was up. Pickled arrays are refused.

mod features;
mod parameters;
mod positions;
mod skeleton;

use glam::{DQuat, DVec3, Quat, Vec3};

use crate::{
    formats::{
        Budget, FormatError, Limit,
        numpy::{NumberArray, npy},
    },
    model::{Axes, Clip, JointTracks, Reporter, Scene, Track},
};

/// Positions are of 22 joints, or of 24 with one for each hand.
const MAX_JOINTS_SEEN: u64 = 24;

/// Whether an archive with these keys holds parameters of a body model and no skeleton of its own.
pub(super) fn is_parameter_archive(key: impl Fn(&str) -> bool) -> bool {
    !key("joint_names") && parameters::TELLING_KEYS.into_iter().any(key)
}

/// Reads an archive of parameters.
///
/// # Errors
/// When an array has a shape that no body model has, holds a value that is not finite, or is larger than the budget allows.
pub(super) fn read_archive(
    bytes: &[u8],
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Scene, FormatError> {
    parameters::read(bytes, budget, reporter)?.into_scene(budget, reporter)
}

/// Reads a single array of positions or features.
///
/// # Errors
/// As [`read_archive`].
pub(super) fn read_array(bytes: &[u8], budget: &mut Budget<'_>, reporter: &mut Reporter) -> Result<Scene, FormatError> {
    const PLACE: &str = "array";
    let mut rest = bytes;
    let header = npy::read_header(&mut rest, PLACE)?;
    let too_large = || refused(PLACE, format!("the shape {:?} is larger than any memory", header.shape));
    let data_bytes = header.data_bytes().ok_or_else(too_large)?;
    budget.take(Limit::DecodedBytes, header.decoded_bytes().ok_or_else(too_large)? as u64, PLACE)?;
    let Some(data) = rest.get(..data_bytes) else {
        let (shape, held) = (&header.shape, rest.len());
        return Err(refused(
            PLACE,
            format!("the shape {shape:?} asks for {data_bytes} bytes, but the file holds {held}"),
        ));
    };
    let frames = header.shape.first().copied().unwrap_or(0) as u64;
    budget.take(Limit::FramesPerClip, frames, PLACE)?;
    let array = npy::numbers(&header, data, PLACE)?;
    array.require_finite(PLACE)?;
    if let Some(capture) = parameters::bare(&array, budget, reporter)? {
        return capture.into_scene(budget, reporter);
    }
    reporter.warn(
        "frame_rate_assumed",
        "",
        format!("an array of positions has no frame rate; {} a second were taken", features::FRAMES_PER_SECOND),
        "set `edit.fps` or `edit.speed` in the config where the motion is too slow or too fast",
    );
    // Where every joint is seen, and how it turns.
    let joints = frames.saturating_mul(MAX_JOINTS_SEEN);
    budget.take_array(joints, (size_of::<DVec3>() + size_of::<DQuat>()) as u64, PLACE)?;
    let places = match array.shape.as_slice() {
        [_, features::WIDTH] => features::places(&array),
        [frames, joints @ (22 | 24), 3] => {
            let place = |row| DVec3::from_array(array.row(row));
            (0..*frames).map(|frame| (0..*joints).map(|joint| place(frame * joints + joint)).collect()).collect()
        }
        shape => {
            return Err(refused(PLACE, format!("an array of shape {shape:?} is neither joint positions nor features"))
                .with_hint(
                    "positions have the shape (frames, 22 or 24, 3), features of HumanML3D (frames, 263), body-model vectors (frames, 66, 72, \
                     156 or 165), matrices (frames, joints, 3, 3); other joints can be \
                     sent as pose arrays with joint_names and parents",
                ));
        }
    };
    positions::solve(&places, budget, reporter)?.into_scene(budget, reporter)
}

/// A capture, understood: which joints there are, and how they turn.
struct Capture {
    skeleton: crate::model::Skeleton,
    /// `parent_from_joint`, joint by joint.
    rotations: Vec<Vec<DQuat>>,
    /// Where the pelvis is; meters.
    pelvis: Vec<DVec3>,
    frames_per_second: f64,
}

impl Capture {
    fn into_scene(self, budget: &mut Budget<'_>, reporter: &mut Reporter) -> Result<Scene, FormatError> {
        let frames = self.pelvis.len();
        if frames == 0 {
            return Err(refused("frames", "there is no frame"));
        }
        budget.take(Limit::Nodes, self.skeleton.len() as u64, "joints")?;
        budget.take(Limit::Samples, (frames as u64).saturating_mul(self.skeleton.len() as u64), "frames")?;
        budget.take_array((frames * self.skeleton.len()) as u64, size_of::<Quat>() as u64, "frames")?;
        reporter.warn(
            "body_shape_ignored",
            "",
            "the file says how a body moves, not how long its bones are in numbers that can be used; it is read on the mean body",
            "directions of limbs are those of the capture; send a file with a skeleton where lengths matter",
        );
        let mut tracks: Vec<JointTracks> = self
            .rotations
            .iter()
            .map(|rotations| JointTracks { rotation: continuous(rotations), ..JointTracks::default() })
            .collect();
        let pelvis: Vec<Vec3> = self.pelvis.iter().map(|place| place.as_vec3()).collect();
        tracks[0].translation = Track::Sampled(pelvis).compacted();
        let times = (0..frames).map(|frame| frame as f64 / self.frames_per_second).collect();
        let clip = Clip::new(String::new(), times, tracks).map_err(|error| refused("frames", error.to_string()))?;
        Ok(Scene {
            skeleton: self.skeleton,
            clips: vec![clip],
            axes: Some(Axes::default()),
            unit_meters: Some(1.0),
            ..Scene::default()
        })
    }
}

/// A track of them, each on the hemisphere of the one before.
fn continuous(rotations: &[DQuat]) -> Track<Quat> {
    Track::Sampled(rotations.iter().map(|rotation| rotation.as_quat()).collect()).on_one_hemisphere().compacted()
}

fn refused(place: impl Into<String>, detail: impl Into<String>) -> FormatError {
    FormatError::malformed("arrays", place, detail).with_hint(
        "compare the file with the layouts of AMASS and HumanML3D, or send pose arrays with joint_names and parents",
    )
}

/// The number in an array of one.
fn single(array: &NumberArray) -> Option<f64> {
    (array.shape.iter().product::<usize>() == 1).then(|| array.value(0)).filter(|value| value.is_finite())
}

#[cfg(test)]
mod tests;
