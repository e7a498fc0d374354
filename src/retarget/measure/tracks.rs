//! What the result's own keys say: bone lengths, hemispheres, jumps.

use glam::Quat;

use super::{
    metric::{Finding, Reading},
    motion::LONGEST_FRAME_SECONDS,
};
use crate::{
    model::{Clip, Skeleton, Track},
    retarget::mapping::{Mapping, TwistAgainst},
    rig::Rig,
};

/// A change of a local rotation from one frame to the next that counts as a jump, where the frame is no longer than
/// [`LONGEST_FRAME_SECONDS`]; in proportion to its length where it is.
const JUMP_DEGREES: f64 = 20.0;
/// A jump that the source has at least this share of is the source's.
const SHARE_OF_SOURCE: f64 = 0.5;
const NO_ROTATIONS: &str = "no joint of the result turns";

/// The largest change of a driven bone's length, as a share of it. The pelvis and roots have none.
pub(super) fn bone_length_drift(mapping: &Mapping, skeleton: &Skeleton, result: &Clip, frames: &[usize]) -> Finding {
    let pelvis = mapping.pelvis.map(|pelvis| pelvis.target);
    let mut reading = Reading::default();
    // Joints that ride another joint than their parent stay as far from that one as they were, not from their parent.
    let mut driven = mapping.driven();
    mapping.rides.iter().for_each(|ride| driven[ride.joint] = false);
    let bones = skeleton.joints().iter().enumerate().filter(|(index, joint)| {
        driven[*index] && joint.parent.is_some() && Some(*index) != pelvis && joint.rest.translation.length() > 1e-9
    });
    for (index, joint) in bones {
        let rest = joint.rest.translation.length();
        let drift = |frame: usize| {
            let now = result.joints()[index].translation.at(frame, joint.rest.translation.as_vec3());
            (now.as_dvec3().length() - rest).abs() / rest
        };
        if !result.joints()[index].translation.is_animated() {
            continue;
        }
        let worst = frames.iter().map(|&frame| (frame, drift(frame))).max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((frame, value)) = worst {
            reading.value = reading.value.max(value);
            reading.worst.push((frame, index, String::new(), value));
        }
    }
    Ok(reading)
}

/// Keys on opposite hemispheres, and jumps that the source does not have. Whoever is elsewhere behind a cut has not jumped; `cuts` are the frames
/// behind them.
pub(super) fn rotation_steps(
    mapping: &Mapping,
    (source, source_clip): (&Skeleton, &Clip),
    (target, result): (&Rig<'_>, &Clip),
    cuts: &[usize],
) -> (Finding, Finding) {
    let (mut continuity, mut jumps) = (Reading::default(), Reading::default());
    let mut drivers: Option<Vec<Vec<usize>>> = None;
    let mut any = false;
    let is_visible = visible(mapping, target);
    #[expect(clippy::cast_possible_truncation, reason = "a cosine")]
    let least_cosine = (JUMP_DEGREES / 2.0).to_radians().cos() as f32;
    let (times, tempo) = (result.times_seconds(), source_clip.tempo());
    for (joint, tracks) in result.joints().iter().enumerate() {
        let Track::Sampled(rotations) = &tracks.rotation else { continue };
        any = true;
        let mut flips = 0_usize;
        for (frame, pair) in rotations.windows(2).enumerate() {
            let cosine = pair[0].dot(pair[1]);
            if cosine < 0.0 {
                flips += 1;
                if flips == 1 {
                    continuity.worst.push((frame + 1, joint, String::new(), 1.0));
                }
            }
            if cosine.abs() >= least_cosine || !is_visible[joint] || cuts.contains(&(frame + 1)) {
                continue;
            }
            let own = step_degrees(rotations, frame);
            if own <= JUMP_DEGREES * ((times[frame + 1] - times[frame]) * tempo / LONGEST_FRAME_SECONDS).max(1.0) {
                continue;
            }
            let drivers = drivers.get_or_insert_with(|| drivers_of(mapping, source, target));
            let of_source: f64 = drivers[joint]
                .iter()
                .map(|&driver| match &source_clip.joints()[driver].rotation {
                    Track::Sampled(rotations) if frame + 1 < rotations.len() => step_degrees(rotations, frame),
                    _ => 0.0,
                })
                .sum();
            if of_source < own * SHARE_OF_SOURCE {
                jumps.value += 1.0;
                jumps.worst.push((frame + 1, joint, String::new(), own));
            }
        }
        continuity.value += flips as f64;
    }
    if any { (Ok(continuity), Ok(jumps)) } else { (Err(NO_ROTATIONS), Err(NO_ROTATIONS)) }
}

/// Joints whose turns show: that a chain drives or that move a skin, and all above these. A helper that follows a hand, seen from
/// another helper that follows the other hand, turns fast and moves nothing. Where there is no skin, nobody can say, and all count.
fn visible(mapping: &Mapping, target: &Rig<'_>) -> Vec<bool> {
    let (skeleton, points) = (target.skeleton(), &target.scene.skin_points);
    let mut visible = mapping.driven();
    for joint in (0..skeleton.len()).rev() {
        visible[joint] |= points.is_empty() || !points.of(joint).is_empty();
        if let Some(parent) = skeleton.parent(joint).filter(|_| visible[joint]) {
            visible[parent] = true;
        }
    }
    visible
}

fn step_degrees(rotations: &[Quat], frame: usize) -> f64 {
    let step = rotations[frame].as_dquat().conjugate() * rotations[frame + 1].as_dquat();
    (2.0 * step.xyz().length().atan2(step.w.abs())).to_degrees()
}

/// The source joints whose turns a target joint may show: its chain's, and those above that drive nothing themselves; of a joint that takes a share
/// of a twist, those of what twists; of toes, which stay flat while the heel rises, those of the foot; of one that rides another than its parent,
/// those of all that lie between.
fn drivers_of(mapping: &Mapping, source: &Skeleton, target: &Rig<'_>) -> Vec<Vec<usize>> {
    let skeleton = target.skeleton();
    let mut drives = vec![false; source.len()];
    for chain in &mapping.chains {
        let further = chain.also.iter().flat_map(|further| &further.source);
        chain.source.iter().chain(further).for_each(|&joint| drives[joint] = true);
    }
    if let Some(pelvis) = &mapping.pelvis {
        drives[pelvis.source] = true;
    }
    let with_idle_above = |joints: &[usize]| {
        let mut found = joints.to_vec();
        let mut above = joints.first().and_then(|&joint| source.parent(joint));
        while let Some(joint) = above.filter(|joint| !drives[*joint]) {
            found.push(joint);
            above = source.parent(joint);
        }
        found
    };
    let mut drivers = vec![Vec::new(); skeleton.len()];
    for chain in &mapping.chains {
        let mut found = with_idle_above(&chain.source);
        found.extend(chain.also.iter().flat_map(|further| with_idle_above(&further.source)));
        chain.target.iter().for_each(|&joint| drivers[joint].clone_from(&found));
    }
    if let Some(pelvis) = &mapping.pelvis {
        drivers[pelvis.target] = with_idle_above(&[pelvis.source]);
    }
    let own = drivers.clone();
    let mut add = |joint: usize, from: usize| {
        let missing: Vec<usize> = own[from].iter().copied().filter(|driver| !drivers[joint].contains(driver)).collect();
        drivers[joint].extend(missing);
    };
    for twist in &mapping.twists {
        let (TwistAgainst::Carrier { joint: end, .. } | TwistAgainst::End { joint: end, .. }) = twist.against;
        add(twist.joint, twist.segment);
        add(twist.joint, end);
    }
    for side in ["left", "right"] {
        let toe = target.role(&format!("{side}_toe")).first().copied();
        if let Some((toe, foot)) = toe.zip(toe.and_then(|toe| skeleton.parent(toe))) {
            add(toe, foot);
        }
    }
    let carries = |joint: usize| {
        let ride = mapping.rides.iter().find(|ride| ride.joint == joint);
        ride.map_or_else(|| skeleton.parent(joint), |ride| Some(ride.on))
    };
    for ride in &mapping.rides {
        let is_above = |joint: usize| {
            std::iter::successors(skeleton.parent(ride.joint), |above| skeleton.parent(*above))
                .any(|above| above == joint)
        };
        for joint in std::iter::successors(Some(ride.on), |joint| carries(*joint)).take_while(|joint| !is_above(*joint))
        {
            add(ride.joint, joint);
        }
    }
    drivers
}
