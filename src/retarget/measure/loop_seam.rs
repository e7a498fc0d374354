//! Clips that are played over and over: how far the target jumps where they begin again.

use glam::DVec3;

use super::{
    body::{Size, first_joint},
    metric::{Finding, Reading},
    motion::{Both, Compared, Frames, Performer, Wanted, compare},
};
use crate::{
    model::{Transform, Travel},
    retarget::{looped::Loops, mapping::Mapping},
    rig::Rig,
};

/// A joint that the source moves there, in a clip that ends a frame before it begins again, moves as far on the target, or so much farther.
const SHARE_OF_SOURCE: f64 = 1.25;
const CENTIMETERS: f64 = 100.0;
const NO_LOOP: &str = "the source's clip does not end where it begins";
const NO_PELVIS: &str = "no pelvis was recognized on both sides";

/// How far a joint jumps from the last frame to the first, beyond what the source's does, centimeters at 1 m leg length; largest. Where the
/// figure gets on, it goes on from where it is.
pub(super) fn loop_seam(mapping: &Mapping, performers: &Both<Performer<'_>>, sizes: &Both<Size>) -> Finding {
    let Performer { rig, clip, .. } = performers.source;
    let found = Loops::new(rig.skeleton(), mapping, rig.up()).and_then(|loops| loops.find(clip)).ok_or(NO_LOOP)?;
    let rigs = performers.map(|performer| performer.rig);
    let mut wanted = Wanted::default();
    let pelvis = first_joint(&rigs, "pelvis").ok_or(NO_PELVIS)?;
    let legs = sizes.map(|size| size.leg.unwrap_or(1.0));
    let far = |joint: &Both<usize>| {
        let from_pelvis = |rig: &Rig<'_>, pelvis: usize, joint: usize| {
            let rest = rig.rest.transforms();
            rest[pelvis].translation.distance(rest[joint].translation) * rig.unit_meters
        };
        let source = from_pelvis(rigs.source, pelvis.source, joint.source);
        if source > 0.0 { from_pelvis(rigs.target, pelvis.target, joint.target) / source } else { 0.0 }
    };
    // What the pelvis hangs from is not seen, and may stay where the source's gets on.
    let skeleton = rigs.target.skeleton();
    let is_seen = |joint: &Both<usize>| {
        joint.target == pelvis.target || !skeleton.is_ancestor_or_self(joint.target, pelvis.target)
    };
    let roles = rigs.target.roles.keys().filter_map(|role| Some((role, first_joint(&rigs, role)?)));
    let roles = roles.filter(|(_, joint)| is_seen(joint));
    let points: Vec<Point<'_>> = roles
        .map(|(role, joint)| Point {
            role,
            joint: joint.target,
            slot: wanted.joint(joint),
            // A longer arm swings farther.
            size: far(&joint).max(legs.target / legs.source),
        })
        .collect();
    let carrier = (wanted.joint(pelvis), wanted.turn(pelvis));
    let last = clip.frame_count().min(performers.target.clip.frame_count()) - 1;
    let ends = Frames { indices: vec![0, last], runs: std::iter::once(0..2).collect() };
    let compared = compare(performers, &wanted, ends);

    let travel = |is_target: bool| if found.is_on_spot { Travel::NONE } else { travel(&compared, is_target, carrier) };
    let travels = Both { source: travel(false), target: travel(true) };
    let mut reading = Reading::default();
    for Point { role, joint, slot, size } in points {
        let jump = |is_target: bool, travel: &Travel| {
            let [first, last] = [0, 1].map(|frame| compared.side(is_target).position(frame, slot));
            travel.place(first).distance(last)
        };
        let beyond = jump(true, &travels.target) - SHARE_OF_SOURCE * size * jump(false, &travels.source);
        let value = beyond.max(0.0) / legs.target * CENTIMETERS;
        reading.value = reading.value.max(value);
        reading.parts.insert(role.to_owned(), value);
        reading.worst.push((last, joint, role.to_owned(), value));
    }
    Ok(reading)
}

/// A joint of both sides.
struct Point<'a> {
    role: &'a str,
    joint: usize,
    slot: usize,
    /// How large the target is there, for a source of 1.
    size: f64,
}

/// How far the pelvis gets, over the floor and about the vertical.
fn travel(compared: &Compared, is_target: bool, (point, turn): (usize, usize)) -> Travel {
    let side = compared.side(is_target);
    let [start, end] = [0, 1].map(|frame| Transform {
        translation: side.position(frame, point),
        rotation: side.turn(frame, turn),
        ..Transform::IDENTITY
    });
    Travel::between(&start, &end, DVec3::Y)
}
