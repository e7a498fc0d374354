//! Parameters of a body model: rotations of its joints as axis angles or matrices, and where it is.

use std::collections::BTreeMap;

use glam::{DMat3, DQuat, DVec3};

use crate::{
    formats::{
        Budget, FormatError, Limit,
        numpy::{Archive, NumberArray},
    },
    model::Reporter,
};

use super::{Capture, refused, single, skeleton::Body};

/// Keys that only such archives have.
pub(super) const TELLING_KEYS: [&str; 6] =
    ["poses", "smpl_poses", "fullpose", "root_orient", "global_orient", "body_pose"];

/// One array for all joints, under any of its names.
const WHOLE: [&str; 4] = ["poses", "smpl_poses", "fullpose", "pose"];
/// Arrays for some joints: their names, the first joint in the order of SMPL-X, and how many.
const PARTS: [([&str; 2], usize, usize); 8] = [
    (["root_orient", "global_orient"], 0, 1),
    (["pose_body", "body_pose"], 1, 21),
    (["pose_jaw", "jaw_pose"], 22, 1),
    (["pose_eye", "eye_pose"], 23, 2),
    (["leye_pose", "left_eye_pose"], 23, 1),
    (["reye_pose", "right_eye_pose"], 24, 1),
    (["pose_hand", "hand_pose"], 25, 30),
    (["left_hand_pose", ""], 25, 15),
];
const RIGHT_HAND: (&str, usize, usize) = ("right_hand_pose", 40, 15);
const PLACE: [&str; 3] = ["trans", "transl", "smpl_trans"];
const SCALING: &str = "smpl_scaling";
const RATES: [&str; 5] = ["mocap_frame_rate", "mocap_framerate", "frame_rate", "framerate", "fps"];
/// AIST++ and most estimates from video.
const USUAL_RATE: f64 = 60.0;

pub(super) fn read(bytes: &[u8], budget: &mut Budget<'_>, reporter: &mut Reporter) -> Result<Capture, FormatError> {
    let arrays = decode(bytes, budget)?;
    let (body, rotations) = rotations(&arrays, budget)?;
    let frames = rotations.first().map_or(0, Vec::len);
    let skeleton = body.skeleton();
    let rest = skeleton.joints()[0].rest.translation;
    let mut capture = Capture {
        skeleton,
        rotations,
        // The model turns about its pelvis, which stands off its origin by the same in every frame.
        pelvis: places(&arrays, frames, reporter)?.into_iter().map(|place| place + rest).collect(),
        frames_per_second: frame_rate(&arrays, reporter)?,
    };
    stand_upright(&mut capture, arrays.contains_key(PLACE[0]), reporter);
    Ok(capture)
}

/// The arrays of numbers that matter, by their names in the file.
fn decode(bytes: &[u8], budget: &mut Budget<'_>) -> Result<BTreeMap<String, NumberArray>, FormatError> {
    let mut archive = Archive::open(bytes, budget)?;
    let keys = archive.keys().to_vec();
    let has_whole = keys.iter().any(|key| WHOLE.contains(&key.as_str()));
    let mut arrays = BTreeMap::new();
    for (index, key) in keys.into_iter().enumerate() {
        let name = key.as_str();
        let is_part = PARTS.iter().any(|(names, ..)| names.contains(&name)) || name == RIGHT_HAND.0;
        let matters = WHOLE.contains(&name) || PLACE.contains(&name) || RATES.contains(&name) || name == SCALING;
        // Where one array has all joints, the parts say the same again.
        if matters || (is_part && !has_whole) {
            let array = archive.numbers(index)?;
            array.require_finite(name)?;
            arrays.insert(key, array);
        }
    }
    Ok(arrays)
}

/// The family, and the rotations joint by joint.
fn rotations(
    arrays: &BTreeMap<String, NumberArray>,
    budget: &mut Budget<'_>,
) -> Result<(Body, Vec<Vec<DQuat>>), FormatError> {
    if let Some((key, array)) = WHOLE.iter().find_map(|key| Some((*key, arrays.get(*key)?))) {
        let (joints, rotations) = turns(array, key, budget)?;
        let body = Body::of_joint_count(joints).ok_or_else(|| {
            let shape = &array.shape;
            refused(
                key,
                format!(
                    "the shape {shape:?} means {joints} joints; 22, 24 (SMPL), 52 (SMPL+H) and 55 (SMPL-X) are known"
                ),
            )
        })?;
        return Ok((body, rotations));
    }
    let mut known: BTreeMap<usize, Vec<DQuat>> = BTreeMap::new();
    let named = PARTS.iter().flat_map(|(names, first, count)| names.map(|name| (name, *first, *count)));
    for (key, first, count) in named.chain([RIGHT_HAND]) {
        let Some(array) = arrays.get(key) else { continue };
        let (joints, rotations) = turns(array, key, budget)?;
        // SMPL's own body has the two hands at its end, which the other families have not.
        if joints != count && !(first == 1 && joints == 23) {
            let shape = &array.shape;
            return Err(refused(key, format!("the shape {shape:?} means {joints} joints where {count} are needed")));
        }
        known.extend(rotations.into_iter().take(count).enumerate().map(|(index, track)| (first + index, track)));
    }
    let Some(frames) = known.get(&0).map(Vec::len) else {
        return Err(refused("root_orient", "there is neither an array of all joints nor one for the root"));
    };
    if let Some((joint, track)) = known.iter().find(|(_, track)| track.len() != frames) {
        let detail = format!("joint {joint} has {} frames where the root has {frames}", track.len());
        return Err(refused("pose_body", detail));
    }
    let body = if known.keys().any(|joint| *joint >= 22) { Body::SmplX } else { Body::Plain };
    let still = || vec![DQuat::IDENTITY; frames];
    let rotations = (0..body.joints().len()).map(|joint| known.remove(&joint).unwrap_or_else(still)).collect();
    Ok((body, rotations))
}

/// How many joints an array turns, and how, joint by joint.
fn turns(array: &NumberArray, key: &str, budget: &mut Budget<'_>) -> Result<(usize, Vec<Vec<DQuat>>), FormatError> {
    let (frames, joints, matrices) = match *array.shape.as_slice() {
        [frames, joints, 3, 3] => (frames, joints, true),
        [frames, joints, 3] => (frames, joints, false),
        [frames, numbers] if numbers % 3 == 0 => (frames, numbers / 3, false),
        ref shape => {
            let detail = format!(
                "the shape {shape:?} is none of (frames, 3 x joints), (frames, joints, 3), (frames, joints, 3, 3)"
            );
            return Err(refused(key, detail));
        }
    };
    let turn = |row: usize| {
        if matrices {
            // Row by row in the file, column by column here.
            DQuat::from_mat3(&DMat3::from_cols_array(&array.row::<9>(row)).transpose()).normalize()
        } else {
            DQuat::from_scaled_axis(DVec3::from_array(array.row(row)))
        }
    };
    budget.take(Limit::FramesPerClip, frames as u64, key)?;
    budget.take_array((frames as u64).saturating_mul(joints as u64), size_of::<DQuat>() as u64, key)?;
    let mut tracks = Vec::with_capacity(joints);
    for joint in 0..joints {
        budget.check_canceled()?;
        tracks.push((0..frames).map(|frame| turn(frame * joints + joint)).collect());
    }
    Ok((joints, tracks))
}

/// Where the model's origin is; metres, in the axes of the file.
fn places(
    arrays: &BTreeMap<String, NumberArray>,
    frames: usize,
    reporter: &mut Reporter,
) -> Result<Vec<DVec3>, FormatError> {
    let Some((key, array)) = PLACE.iter().find_map(|key| Some((*key, arrays.get(*key)?))) else {
        reporter.warn(
            "poses_channel_absent",
            PLACE[0],
            "the file has no 'trans': the body turns on the spot",
            "add 'trans' (frames, 3) if it should travel",
        );
        return Ok(vec![DVec3::ZERO; frames]);
    };
    if array.shape != [frames, 3] {
        return Err(refused(key, format!("the shape is {:?} where [{frames}, 3] is needed", array.shape)));
    }
    let scaling = match arrays.get(SCALING) {
        None => 1.0,
        Some(scaling) => single(scaling)
            .filter(|scaling| *scaling > 1e-6)
            .ok_or_else(|| refused(SCALING, "the scaling must be one number above zero"))?,
    };
    Ok((0..frames).map(|frame| DVec3::from_array(array.row(frame)) / scaling).collect())
}

fn frame_rate(arrays: &BTreeMap<String, NumberArray>, reporter: &mut Reporter) -> Result<f64, FormatError> {
    let Some((key, array)) = RATES.iter().find_map(|key| Some((*key, arrays.get(*key)?))) else {
        reporter.warn(
            "frame_rate_assumed",
            "",
            format!("the file does not say its frame rate; {USUAL_RATE} a second were taken"),
            "set `edit.fps` or `edit.speed` in the config where the motion is too slow or too fast",
        );
        return Ok(USUAL_RATE);
    };
    single(array)
        .filter(|rate| *rate > 1e-3 && *rate < 1e6)
        .ok_or_else(|| refused(key, "the frame rate must be one number above zero"))
}

/// Turns a capture in which Z is up, as AMASS has it, into one in which Y is.
///
/// No key says which axis is up, but people are upright more often than not: the axis that the pelvis's own up follows most
/// wins. Where neither does, the habit of the layout decides.
fn stand_upright(capture: &mut Capture, is_amass: bool, reporter: &mut Reporter) {
    const CLEAR: f64 = 0.25;
    let turns = &capture.rotations[0];
    let mean = turns.iter().map(|turn| *turn * DVec3::Y).sum::<DVec3>() / (turns.len().max(1) as f64);
    let is_z_up = if (mean.z - mean.y).abs() > CLEAR {
        mean.z > mean.y
    } else {
        reporter.warn(
            "up_axis_assumed",
            "",
            format!("the body is upright along no axis; {} was taken as up", if is_amass { "Z" } else { "Y" }),
            "turn the capture upright before sending it where that is wrong",
        );
        is_amass
    };
    if !is_z_up {
        return;
    }
    let y_up_from_z_up = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    for turn in &mut capture.rotations[0] {
        *turn = y_up_from_z_up * *turn;
    }
    for place in &mut capture.pelvis {
        *place = y_up_from_z_up * *place;
    }
}
