//! Parameters of a body model: rotations of its joints as axis angles or matrices, and where it is.

use std::collections::BTreeMap;
use std::slice::from_ref;

use glam::{DMat3, DQuat, DVec3};

use crate::{
    formats::{
        Budget, FormatError, Limit,
        numpy::{Archive, NumberArray, Values},
    },
    model::Reporter,
};

use super::{Capture, refused, single, skeleton::Body};

/// Keys that only such archives have.
pub(super) const TELLING_KEYS: [&str; 9] =
    ["poses", "smpl_poses", "fullpose", "pose", "smpl_thetas", "arr_0", "root_orient", "global_orient", "body_pose"];

/// One array for all joints, under any of its names.
const WHOLE: [&str; 6] = ["poses", "smpl_poses", "fullpose", "pose", "smpl_thetas", "arr_0"];
/// How many joints such an array may have.
const WHOLE_COUNTS: [usize; 4] = [22, 24, 52, 55];
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
/// Where the body is; `cam_trans` in the axes of a camera, as ROMP and BEV have it.
const PLACE: [&str; 4] = ["trans", "transl", "smpl_trans", "cam_trans"];
const SCALING: &str = "smpl_scaling";
const RATES: [&str; 5] = ["mocap_frame_rate", "mocap_framerate", "frame_rate", "framerate", "fps"];
/// AIST++ and most estimates from video.
const USUAL_RATE: f64 = 60.0;

pub(super) fn read(bytes: &[u8], budget: &mut Budget<'_>, reporter: &mut Reporter) -> Result<Capture, FormatError> {
    let arrays = decode(bytes, budget)?;
    let is_amass = arrays.contains_key(PLACE[0]);
    capture(&arrays, is_amass, budget, reporter)
}

/// What the arrays mean; `is_amass` where Z is up by the habit of the layout.
fn capture(
    arrays: &BTreeMap<String, NumberArray>,
    is_amass: bool,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Capture, FormatError> {
    let (body, rotations) = rotations(arrays, budget)?;
    let frames = rotations.first().map_or(0, Vec::len);
    let skeleton = body.skeleton();
    let rest = skeleton.joints()[0].rest.translation;
    let mut capture = Capture {
        skeleton,
        rotations,
        // The model turns about its pelvis, which stands off its origin by the same in every frame.
        pelvis: places(arrays, frames, reporter)?.into_iter().map(|place| place + rest).collect(),
        frames_per_second: frame_rate(arrays, reporter)?,
    };
    stand_upright(&mut capture, is_amass, reporter);
    Ok(capture)
}

/// A bare array of the rotations of a whole body: vectors of axis angles, one or many, with three numbers more for where the body is
/// or without, or matrices. Nothing where the shape says that it is something else: `(frames, 22 or 24, 3)` are positions.
pub(super) fn bare(
    array: &NumberArray,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Option<Capture>, FormatError> {
    let counted = |numbers: usize| numbers.is_multiple_of(3) && WHOLE_COUNTS.contains(&(numbers / 3));
    let (frames, numbers) = match *array.shape.as_slice() {
        [frames, joints @ (52 | 55), 3] => (frames, 3 * joints),
        [_, joints, 3, 3] if WHOLE_COUNTS.contains(&joints) => (0, 0),
        [joints, 3, 3] if WHOLE_COUNTS.contains(&joints) => (0, 0),
        [numbers] => (1, numbers),
        [frames, numbers] => (frames, numbers),
        _ => return Ok(None),
    };
    let is_whole = numbers == 0 || counted(numbers);
    let has_place = numbers > 3 && numbers != BODY_WITHOUT_ROOT && counted(numbers - 3);
    if !is_whole && !has_place && numbers != MOTION_X {
        return Ok(None);
    }
    let columns = |columns: &[std::ops::Range<usize>]| {
        let rows = (0..frames).flat_map(|frame| columns.iter().cloned().flatten().map(move |at| frame * numbers + at));
        let values: Vec<f64> = rows.map(|at| array.value(at)).collect();
        NumberArray {
            shape: vec![frames, columns.iter().map(ExactSizeIterator::len).sum()],
            values: Values::Double(values),
        }
    };
    budget.take_array(frames as u64, (numbers * size_of::<f64>()) as u64, "array")?;
    let mut arrays = BTreeMap::new();
    let (poses, place) = if numbers == MOTION_X {
        // Root, body, hands, jaw, expression, face shape, place, body shape; eyes are not there.
        let poses = columns(&[0..66, 156..159, 66..156]);
        (with_still_eyes(&poses), Some(columns(from_ref(&(309..312)))))
    } else if is_whole {
        let values = (0..array.shape.iter().product()).map(|at| array.value(at)).collect();
        (NumberArray { shape: array.shape.clone(), values: Values::Double(values) }, None)
    } else {
        (columns(from_ref(&(0..numbers - 3))), Some(columns(from_ref(&(numbers - 3..numbers)))))
    };
    arrays.insert(WHOLE[0].to_owned(), poses);
    arrays.extend(place.map(|place| (PLACE[0].to_owned(), place)));
    capture(&arrays, false, budget, reporter).map(Some)
}

/// Numbers of a vector of SMPL's body without its root, which is as long as one of 22 joints with a place.
const BODY_WITHOUT_ROOT: usize = 69;

/// Numbers of a vector as Motion-X has them.
const MOTION_X: usize = 322;

/// Axis angles of root, body, jaw and hands with those of two eyes that look ahead put between.
fn with_still_eyes(poses: &NumberArray) -> NumberArray {
    const BEFORE: usize = 69;
    const EYES: usize = 6;
    let (frames, numbers) = (poses.shape[0], poses.shape[1]);
    let mut values = Vec::with_capacity(frames * (numbers + EYES));
    for frame in 0..frames {
        values.extend((0..BEFORE).map(|at| poses.value(frame * numbers + at)));
        values.extend([0.0; EYES]);
        values.extend((BEFORE..numbers).map(|at| poses.value(frame * numbers + at)));
    }
    NumberArray { shape: vec![frames, numbers + EYES], values: Values::Double(values) }
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
        let (joints, rotations) = turns(array, key, &WHOLE_COUNTS, budget)?;
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
        let counts: &[usize] = if first == 1 { &[count, 23] } else { &[count] };
        let (joints, rotations) = turns(array, key, counts, budget)?;
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

/// How many joints an array turns, and how, joint by joint. `counts` are the numbers of joints that make sense, which tell apart shapes
/// that could mean several things.
fn turns(
    array: &NumberArray,
    key: &str,
    counts: &[usize],
    budget: &mut Budget<'_>,
) -> Result<(usize, Vec<Vec<DQuat>>), FormatError> {
    let is_known = |joints: usize| counts.contains(&joints);
    let (frames, joints, matrices) = match *array.shape.as_slice() {
        [frames, joints, 3, 3] => (frames, joints, true),
        [joints, 3, 3] if is_known(joints) && joints > 1 => (1, joints, true),
        [frames, 3, 3] if is_known(1) => (frames, 1, true),
        [joints, 3] if is_known(joints) && joints > 1 => (1, joints, false),
        [frames, joints, 3] => (frames, joints, false),
        [frames, numbers] if numbers % 9 == 0 && is_known(numbers / 9) => (frames, numbers / 9, true),
        [frames, numbers] if numbers % 3 == 0 => (frames, numbers / 3, false),
        [numbers] if numbers % 3 == 0 && is_known(numbers / 3) => (1, numbers / 3, false),
        ref shape => {
            let detail = format!(
                "the shape {shape:?} is none of (3 x joints), (frames, 3 x joints), (frames, joints, 3), (frames, joints, 3, 3), (frames, 9 x joints)"
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
    if matrices && let Some(row) = (0..frames * joints).find(|row| !is_rotation(&array.row::<9>(*row))) {
        let detail =
            format!("the matrix of joint {} at frame {} is not a rotation", row % joints.max(1), row / joints.max(1));
        return Err(refused(key, detail));
    }
    budget.take(Limit::FramesPerClip, frames as u64, key)?;
    budget.take_array((frames as u64).saturating_mul(joints as u64), size_of::<DQuat>() as u64, key)?;
    let mut tracks = Vec::with_capacity(joints);
    for joint in 0..joints {
        budget.check_canceled()?;
        tracks.push((0..frames).map(|frame| turn(frame * joints + joint)).collect());
    }
    Ok((joints, tracks))
}

/// Whether the rows of a matrix are at right angles, of length one and right-handed, but for what an estimate leaves over.
fn is_rotation(rows: &[f64; 9]) -> bool {
    const SLACK: f64 = 0.05;
    let matrix = DMat3::from_cols_array(rows);
    let product = matrix.transpose() * matrix - DMat3::IDENTITY;
    product.to_cols_array().into_iter().all(|value| value.abs() < SLACK) && matrix.determinant() > 0.0
}

/// Where the model's origin is; meters, in the axes of the file.
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
    let is_single = frames == 1 && array.shape == [3];
    if array.shape != [frames, 3] && !is_single {
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

/// Turns a capture in which Z is up, as AMASS has it, or Y is down, as estimates in the axes of a camera have it, into one in which Y is
/// up.
///
/// No key says which axis is up, but people are upright more often than not: the axis that the pelvis's own up follows most
/// wins. Where neither does, the habit of the layout decides.
fn stand_upright(capture: &mut Capture, is_amass: bool, reporter: &mut Reporter) {
    const CLEAR: f64 = 0.25;
    let turns = &capture.rotations[0];
    let mean = turns.iter().map(|turn| *turn * DVec3::Y).sum::<DVec3>() / (turns.len().max(1) as f64);
    if mean.y < -CLEAR && -mean.y > mean.z + CLEAR {
        turn(capture, DQuat::from_rotation_x(std::f64::consts::PI));
        return;
    }
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
    turn(capture, DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2));
}

/// Turns the whole capture about the origin.
fn turn(capture: &mut Capture, rotation: DQuat) {
    for turn in &mut capture.rotations[0] {
        *turn = rotation * *turn;
    }
    for place in &mut capture.pelvis {
        *place = rotation * *place;
    }
}
