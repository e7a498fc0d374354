//! Contacts of walks against a criterion that knows nothing of floors and speeds: heels strike where the foot is farthest before the
//! pelvis, toes leave where it is farthest behind (Zeni, Richards and Higginson 2008).

use glam::{DVec3, Vec3};
use retargetd::{
    model::{Control, JointTracks, Reporter, Scene, Track},
    retarget::{Stack, parse_spec, resolve},
    rig::Rig,
};

use super::figure::{Figure, position, world};
use crate::support::corpus_file;

const WALKS: [&str; 3] = [
    "bvh/cmu/12_01_walk.bvh",
    "bvh/bandai-namco/dataset-1_walk_normal_001.bvh",
    "mixamo/bvh/beta_walking_mixed_orders.bvh",
];
/// Never looked at while thresholds were chosen.
const HELD_WALKS: [&str; 4] = [
    "bvh/misc/walk01_24fps.bvh",
    "bvh/misc/meredith_8walk_vicon.bvh",
    "misc-rigs/17_keypoints_walk.fbx",
    "humanik-unity/viverse_walk.glb",
];

const MIN_F1: f64 = 0.95;
/// A walk that slows down and speeds up is not quite on the spot where it is taken back evenly.
const MIN_F1_ON_SPOT: f64 = 0.9;
const MAX_SECONDS: f64 = 0.05;
/// A stride is at least this long, in legs, from before the pelvis to behind it.
const MIN_SWING: f64 = 0.25;
/// Slower than this, in legs a second, nobody walks.
const MIN_SPEED: f64 = 0.3;
/// Over so many seconds the pelvis is averaged for the direction of the walk, and feet for their extremes.
const DIRECTION_SECONDS: f64 = 0.3;
const FOOT_SECONDS: f64 = 0.02;

#[test]
fn walks_touch_from_heel_strike_to_toe_off() {
    judge(&WALKS);
}

#[test]
#[ignore = "long, and for a last look only"]
fn walks_that_nobody_looked_at_touch_from_heel_strike_to_toe_off() {
    judge(&HELD_WALKS);
}

/// The same walks on the spot, which have no way for the criterion to go by: their contacts are those over the floor.
#[test]
fn walks_on_the_spot_touch_when_the_walks_do() {
    let mut problems = Vec::new();
    for file in WALKS {
        let Some(path) = corpus_file(file) else { return };
        let figure = Figure::read(&path);
        let over_floor = contacts(&figure);
        let on_spot = contacts(&on_the_spot(figure));
        let (mut right, mut wrong) = (0.0, 0.0);
        for ((point, own), (_, other)) in over_floor.iter().zip(&on_spot) {
            assert!(point.contains("foot") || point.contains("toe"), "{point}");
            for (own, other) in own.iter().zip(other) {
                right += f64::from(u8::from(*own && *other));
                wrong += f64::from(u8::from(own != other));
            }
        }
        let f1 = 2.0 * right / (2.0 * right + wrong);
        if f1 < MIN_F1_ON_SPOT {
            problems.push(format!("{file}: {f1}"));
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// The figure taken back by how fast it gets on, on average.
fn on_the_spot(figure: Figure) -> Figure {
    let clip = figure.clip();
    let rig = Rig::new("source", &figure.scene, None, &Default::default(), &mut Reporter::new()).expect("a rig");
    let pelvis = figure.roles["pelvis"];
    let [begin, end] = [0, clip.frame_count() - 1].map(|frame| {
        let pose = world(figure.skeleton(), Some((clip, frame)));
        position(&pose, pelvis)
    });
    let way = end - begin - rig.up() * (end - begin).dot(rig.up());
    let velocity = way / clip.duration_seconds();
    let back = |place: Vec3, time: f64| (place.as_dvec3() - velocity * time).as_vec3();
    let joints = figure.skeleton().joints().iter().zip(clip.joints()).map(|(joint, tracks)| {
        let Track::Sampled(places) = &tracks.translation else { return tracks.clone() };
        if joint.parent.is_some() {
            return tracks.clone();
        }
        let moved = places.iter().zip(clip.times_seconds()).map(|(place, time)| back(*place, *time)).collect();
        JointTracks { translation: Track::Sampled(moved), ..tracks.clone() }
    });
    let clip = clip.clone().with_joints(joints.collect()).expect("a clip");
    let scene = Scene { clips: vec![clip], ..figure.scene.clone() };
    Figure { scene, ..figure }
}

fn judge(walks: &[&str]) {
    let mut problems = Vec::new();
    let mut judged = 0;
    for file in walks {
        let Some(path) = corpus_file(file) else { return };
        let Some(found) = Found::of(&Figure::read(&path)) else { continue };
        judged += 1;
        if found.f1 < MIN_F1 || found.begin.abs() > MAX_SECONDS || found.end.abs() > MAX_SECONDS {
            problems.push(format!("{file}: {found:?}"));
        }
    }
    assert!(judged > 0, "some of them walk");
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// How well contacts fit; seconds are medians, later is more.
#[derive(Debug)]
struct Found {
    f1: f64,
    begin: f64,
    end: f64,
}

/// When one foot stands by the criterion.
struct Steps {
    strikes: Vec<usize>,
    leaves: Vec<usize>,
    stands: Vec<bool>,
    is_known: Vec<bool>,
}

impl Found {
    /// Nothing of a clip without steps.
    fn of(figure: &Figure) -> Option<Self> {
        let clip = figure.clip();
        let times = clip.times_seconds();
        let contacts = contacts(figure);
        let (mut right, mut wrong) = (0.0, 0.0);
        let (mut begins, mut ends) = (Vec::new(), Vec::new());
        for side in ["left", "right"] {
            let Some(steps) = Steps::of(figure, side) else { continue };
            let mut touches = vec![false; times.len()];
            for (_, own) in contacts.iter().filter(|(point, _)| point.starts_with(side)) {
                touches.iter_mut().zip(own).for_each(|(touches, own)| *touches |= own);
            }
            for frame in (0..times.len()).filter(|frame| steps.is_known[*frame]) {
                right += f64::from(u8::from(touches[frame] && steps.stands[frame]));
                wrong += f64::from(u8::from(touches[frame] != steps.stands[frame]));
            }
            let is_touching = |frame: usize| touches[frame];
            let first = |frame: usize| is_touching(frame) && (frame == 0 || !touches[frame - 1]);
            let last = |frame: usize| is_touching(frame) && (frame + 1 == times.len() || !touches[frame + 1]);
            let nearest = |wanted: usize, is_border: &dyn Fn(usize) -> bool| {
                let borders =
                    (0..times.len()).filter(|frame| is_border(*frame)).map(|frame| times[frame] - times[wanted]);
                borders.min_by(|one, other| one.abs().total_cmp(&other.abs()))
            };
            begins.extend(steps.strikes.iter().filter_map(|frame| nearest(*frame, &first)));
            ends.extend(steps.leaves.iter().filter_map(|frame| nearest(*frame, &last)));
        }
        let f1 = 2.0 * right / (2.0 * right + wrong);
        (right > 0.0).then(|| Self { f1, begin: median(begins), end: median(ends) })
    }
}

impl Steps {
    fn of(figure: &Figure, side: &str) -> Option<Self> {
        let joint = |role: &str| figure.roles.get(role).copied();
        let (pelvis, foot) = (joint("pelvis")?, joint(&format!("{side}_foot"))?);
        let toe = joint(&format!("{side}_toe")).unwrap_or(foot);
        let (thigh, shin) = (joint(&format!("{side}_thigh"))?, joint(&format!("{side}_shin"))?);
        let clip = figure.clip();
        let times = clip.times_seconds();
        let poses: Vec<_> = (0..times.len()).map(|frame| world(figure.skeleton(), Some((clip, frame)))).collect();
        let track = |joint: usize| poses.iter().map(|pose| position(pose, joint)).collect::<Vec<DVec3>>();
        let first = &poses[0];
        let leg = position(first, thigh).distance(position(first, shin))
            + position(first, shin).distance(position(first, foot));
        let rig = Rig::new("source", &figure.scene, None, &Default::default(), &mut Reporter::new()).expect("a rig");
        let up = rig.up();
        let travel = directions(&smooth(&track(pelvis), times, DIRECTION_SECONDS), times, up);
        let ahead = |joint: usize| -> Vec<f64> {
            let place = |(place, pelvis): (DVec3, DVec3)| place - pelvis;
            let along = track(joint).into_iter().zip(track(pelvis)).map(place).zip(&travel);
            let along: Vec<DVec3> = along.map(|(place, (way, _))| DVec3::X * place.dot(*way)).collect();
            smooth(&along, times, FOOT_SECONDS).iter().map(|place| place.x).collect()
        };
        let strikes = peaks(&ahead(foot), MIN_SWING * leg);
        let behind: Vec<f64> = ahead(toe).iter().map(|place| -place).collect();
        let leaves = peaks(&behind, MIN_SWING * leg);
        let mut events: Vec<(usize, bool)> = strikes.iter().map(|frame| (*frame, true)).collect();
        events.extend(leaves.iter().map(|frame| (*frame, false)));
        events.sort_unstable();
        let (begin, end) = (events.first()?.0, events.last()?.0);
        let is_known =
            (0..times.len()).map(|frame| (begin..=end).contains(&frame) && travel[frame].1 > MIN_SPEED * leg);
        let is_known: Vec<bool> = is_known.collect();
        let mut stands = vec![false; times.len()];
        for pair in events.windows(2).filter(|pair| pair[0].1) {
            stands[pair[0].0..=pair[1].0].fill(true);
        }
        let known = |frames: Vec<usize>| frames.into_iter().filter(|frame| is_known[*frame]).collect();
        (events.len() > 2).then(|| Self {
            strikes: known(strikes),
            leaves: known(leaves),
            stands,
            is_known: is_known.clone(),
        })
    }
}

/// Which way the pelvis goes over the floor, and how fast.
fn directions(places: &[DVec3], times: &[f64], up: DVec3) -> Vec<(DVec3, f64)> {
    let last = places.len() - 1;
    let direction = |frame: usize| {
        let (before, after) = (frame.saturating_sub(1), (frame + 1).min(last));
        let velocity = (places[after] - places[before]) / (times[after] - times[before]);
        let velocity = velocity - up * velocity.dot(up);
        (velocity.normalize_or_zero(), velocity.length())
    };
    (0..places.len()).map(direction).collect()
}

/// Under a normal distribution.
fn smooth(values: &[DVec3], times: &[f64], deviation: f64) -> Vec<DVec3> {
    let mean = |time: &f64| {
        let weights = times.iter().map(|other| (-0.5 * ((other - time) / deviation).powi(2)).exp());
        let (sum, weight) = weights
            .zip(values)
            .fold((DVec3::ZERO, 0.0), |(sum, all), (weight, value)| (sum + *value * weight, all + weight));
        sum / weight
    };
    times.iter().map(mean).collect()
}

/// Frames that are higher than all up to where it goes up again, by at least so much.
fn peaks(values: &[f64], prominence: f64) -> Vec<usize> {
    let is_peak = |frame: &usize| {
        let value = values[*frame];
        let lowest = |side: &mut dyn Iterator<Item = &f64>| {
            side.take_while(|other| **other <= value).fold(value, |low, other| low.min(*other))
        };
        let before = lowest(&mut values[..*frame].iter().rev());
        let after = lowest(&mut values[frame + 1..].iter());
        value > values[frame - 1] && value >= values[frame + 1] && value - before.max(after) > prominence
    };
    (1..values.len().saturating_sub(1)).filter(is_peak).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The contacts of a clip, point by point, as retargeting it onto its own rig finds them.
fn contacts(figure: &Figure) -> Vec<(String, Vec<bool>)> {
    let spec = parse_spec(br#"{"ops": [{"op": "pelvis"}, {"op": "fk"}, {"op": "contacts"}]}"#).expect("a spec");
    let mut reporter = Reporter::new();
    let source = Rig::new("source", &figure.scene, None, &spec.source, &mut reporter).expect("a rig");
    let target = Rig::new("target", &figure.scene, None, &spec.target, &mut reporter).expect("a rig");
    let resolved = resolve(&spec, &source, &target, figure.clip(), &mut reporter).expect("a mapping");
    let stack = Stack::new(source.skeleton(), target.skeleton(), &resolved.mapping, &resolved.ops);
    let result = stack.run(figure.clip(), &Control::new()).expect("a result");
    result.contacts.into_iter().map(|track| (track.point, track.touches)).collect()
}
