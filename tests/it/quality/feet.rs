//! Feet on figures of other proportions: real walks, runs and dances onto the same figure with legs of 0.6 to 1.6 times the
//! length. Feet do not slide where the source's do not, soles stay above the floor, knees do not flip and nothing jerks.

use glam::DVec3;
use retargetd::{
    model::{Clip, Control, Joint, Reporter, Scene, Skeleton},
    retarget::{
        Ground, LimbPair, Mapping, Metric, MetricName, ReportChoice, Resolved, Stack, measure, parse_spec, resolve,
    },
    rig::{RestSource, Rig},
};

use super::figure::{Figure, measured_in_corpus, percentile, position, value, world};
use crate::support::corpus_file;

/// File, and clip where the file has several.
const CLIPS: [(&str, Option<&str>); 10] = [
    ("bvh/cmu/12_01_walk.bvh", None),
    ("mixamo/bvh/beta_walking_mixed_orders.bvh", None),
    ("mixamo/fbx/walking_noskin.fbx", None),
    ("bvh/bandai-namco/dataset-1_walk_normal_001.bvh", None),
    ("bvh/misc/walk01_24fps.bvh", None),
    ("mixamo/gltf/Soldier.glb", Some("Run")),
    ("bvh/rokoko/jesse_dance.bvh", None),
    ("mixamo/bvh/mousey_salsa.bvh", None),
    ("mixamo/bvh/ortiz_salsa.bvh", None),
    ("mixamo/fbx/samba_dancing_skin.fbx", None),
];
const LEGS: [(f64, bool); 6] = [(0.6, true), (0.8, true), (1.25, true), (1.6, true), (0.6, false), (1.6, false)];

/// At a leg of one meter.
const MAX_SLIDE: f64 = 0.005;
const MAX_PENETRATION: f64 = 0.005;
const MAX_JERK: f64 = 1.15;
/// Longer or shorter limbs alone make nothing rougher.
const MAX_JERK_OF_ROTATIONS: f64 = 0.01;
/// Share of a leg by which a heel may be off its height above the ball while a foot stands flat.
const MAX_TILT: f64 = 0.02;
/// Share of a leg by which a clip may change on its own rig.
const MAX_CHANGE: f64 = 1e-4;
/// Share by which measures may be off: joints are looked at here, and the soles below them are what is held.
const SLACK: f64 = 0.05;
/// Leg lengths by which a slide may be, too: what touches for a few frames by the thresholds here does not by those of `contacts`, so
/// a foot of another size that shuffles between two contacts is not held there. One of 870 contacts needs it; all others stay within
/// 0.0012.
const LITTLE_SLIDE: f64 = 0.0027;
/// The same of feet of another size beside the legs: what a point moves by because its foot turns is scaled with the leg and not with the
/// foot. The worst is a foot of which nobody knows how thick it is, half as large beside its leg: 0.0119, and 0.023 without planting.
const LITTLE_SLIDE_OF_OTHER_FEET: f64 = 0.0125;
/// Leg lengths above its height at rest from which a joint is in the air, however slow it is: a heel above a foot on tiptoe.
const MAX_RAISED: f64 = 0.08;

const FK_ONLY: &str = r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#;
/// What is done when nobody says.
const STACK: &str = "{}";

#[test]
fn feet_of_other_legs() {
    let problems = problems();
    assert!(problems.is_empty(), "{}:\n{}", problems.len(), problems.join("\n"));
}

#[test]
fn a_clip_onto_its_own_rig_comes_back_through_all_ops() {
    for (file, clip) in CLIPS {
        let Some(path) = corpus_file(file) else { return };
        let scene = standing(Figure::read(&path).scene);
        let clip = clip_of(&scene, clip);
        let legs = Feet::legs(&scene, clip, &scene, STACK);
        for leg in &legs {
            let pairs = [(&leg.source.hips, &leg.target.hips), (&leg.source.knees, &leg.target.knees)];
            let points =
                leg.source.points.iter().zip(&leg.target.points).map(|(source, target)| (&source.0, &target.0));
            for (source, target) in pairs.into_iter().chain(points) {
                let worst =
                    source.iter().zip(target).map(|(source, target)| source.distance(*target)).fold(0.0, f64::max);
                assert!(worst < MAX_CHANGE, "{file}: a leg is moved by {worst:.2e} of its length");
            }
        }
    }
}

/// A skeleton of points has ankles and no feet: nothing says when heels lift.
#[test]
fn feet_that_nothing_is_known_of_stand_flat() {
    let files = ["misc-rigs/17_keypoints_walk.fbx", "mixamo/gltf/Xbot.glb"];
    let Some([source, target]) = Figure::of_corpus(files) else { return };
    let clip = source.clip();
    // How much higher than at rest the ankle is above the ball.
    let tilted = |spec: &str| -> f64 {
        let tilts = Feet::legs(&source.scene, clip, &target.scene, spec).into_iter().flat_map(|leg| {
            let above_rest = |point: usize, frame: usize| {
                let (places, rest) = &leg.target.points[point];
                places[frame].y - rest
            };
            let contacts = leg.source.contacts(0, clip.times_seconds());
            let standing = contacts.into_iter().flat_map(|(first, last)| first..=last);
            standing.map(|frame| (above_rest(0, frame) - above_rest(1, frame)).abs()).collect::<Vec<f64>>()
        });
        percentile(tilts.collect(), 0.95)
    };
    let (plain, stack) = (tilted(FK_ONLY), tilted(STACK));
    assert!(plain > 2.0 * MAX_TILT, "rotations alone stand on tiptoe: {plain}");
    assert!(stack < MAX_TILT, "feet stand flat: {stack}, and {plain} without");
}

/// The shins of this capture turn by 60 degrees above a foot that stands, as the walker goes round a corner; the toes swept the floor by that.
#[test]
fn feet_that_nothing_is_known_of_stand_while_the_shin_turns() {
    let files = ["misc-rigs/17_keypoints_walk.fbx", "mixamo/gltf/Xbot.glb"];
    let Some([source, target]) = Figure::of_corpus(files) else { return };
    let clip = source.clip();
    // How far the ball gets in a contact, in legs, of the contact in the middle of the worse half.
    let swept = |spec: &str| -> f64 {
        let ways = Feet::legs(&source.scene, clip, &target.scene, spec).into_iter().flat_map(|leg| {
            let ball = &leg.target.points[1].0;
            let contacts = leg.source.contacts(0, clip.times_seconds());
            contacts.into_iter().map(|(first, last)| ball[first].distance(ball[last])).collect::<Vec<f64>>()
        });
        percentile(ways.collect(), 0.75)
    };
    let (plain, stack) = (swept(FK_ONLY), swept(STACK));
    assert!(plain > 0.08 && stack < 0.05, "the ball gets {stack} legs far, and {plain} by rotations alone");
}

/// A sole that rolls on its edge is in the floor by a millimeter now and then, at a point right below the ankle. All of its tilt would not bring
/// that out, and the foot snapped flat, and back.
#[test]
fn feet_do_not_snap_flat_for_a_millimeter() {
    let files = ["bvh/bandai-namco/dataset-1_walk_normal_001.bvh", "mixamo/gltf/michelle_meshopt.glb"];
    let Some(measures) = measured_in_corpus(files) else { return };
    let [turned, deep] = [MetricName::EndOrientation, MetricName::FloorPenetration].map(|name| value(&measures, name));
    assert!(turned < 8.0 && deep < 0.3, "feet are turned by {turned} degrees, and {deep} in the floor");
}

/// The soles of this capture are guessed from its ankles, and stand 5 cm off the floor of the file throughout.
#[test]
fn a_capture_whose_floor_is_off_as_a_whole_stands_on_the_floor() {
    let files = ["bvh/cmu/01_01_motionbuilder.bvh", "mixamo/gltf/Soldier.glb"];
    let Some(measures) = measured_in_corpus(files) else { return };
    let hover = value(&measures, MetricName::FloorFloat);
    assert!(hover < 1.0, "soles hover by {hover} cm");
}

fn clip_of<'a>(scene: &'a Scene, name: Option<&str>) -> &'a Clip {
    let is_wanted = |clip: &&Clip| name.map_or(clip.is_animated(), |name| clip.name().contains(name));
    scene.clips.iter().find(is_wanted).expect("the clip")
}

#[expect(clippy::print_stderr, reason = "the figures are worth seeing even when they pass")]
pub(crate) fn problems() -> Vec<String> {
    let mut problems = Vec::new();
    eprintln!("clip, legs: FK slide / penetration / jerk -> stack (cm at a leg of 1 m)");
    for (file, clip) in CLIPS {
        let Some(path) = corpus_file(file) else { return problems };
        let scene = standing(Figure::read(&path).scene);
        let clip = clip_of(&scene, clip);
        for (legs, with_feet) in LEGS {
            let target = Scene {
                skeleton: with_legs(&scene, legs, with_feet),
                axes: scene.axes,
                unit_meters: scene.unit_meters,
                ..Scene::default()
            };
            let feet_beside_legs = if with_feet { 1.0 } else { legs.recip() };
            let [plain, stack] =
                [FK_ONLY, STACK].map(|spec| Feet::measure(&scene, clip, &target, feet_beside_legs, spec));
            let name = format!("{file} x{legs}{}", if with_feet { "" } else { ", same feet" });
            eprintln!("{name}: {plain} -> {stack}");
            problems.extend(stack.problems(&plain, with_feet).into_iter().map(|problem| format!("{name}: {problem}")));
        }
    }
    problems
}

/// The same file with the pose that a retarget would measure from as its rest pose.
fn standing(mut scene: Scene) -> Scene {
    let rig = Rig::new("source", &scene, None, &Default::default(), &mut Reporter::new()).expect("a rig");
    let pose = (rig.rest_source == RestSource::StandingFrame).then(|| rig.rest_local.clone());
    if let Some(pose) = pose {
        let joints = scene.skeleton.joints().iter().zip(pose.transforms());
        let joints = joints.map(|(joint, rest)| Joint { rest: *rest, ..joint.clone() }).collect();
        scene.skeleton = Skeleton::new(joints).expect("valid");
    }
    scene
}

/// The same figure with thighs and shins (and feet) of another length, standing as it stood.
fn with_legs(scene: &Scene, factor: f64, with_feet: bool) -> Skeleton {
    let mut reporter = Reporter::new();
    let rig = Rig::new("target", scene, None, &Default::default(), &mut reporter).expect("a rig");
    let role = |role: &str| rig.role(role)[0];
    let skeleton = &scene.skeleton;
    let mut joints: Vec<Joint> = skeleton.joints().to_vec();
    for side in ["left", "right"] {
        let [thigh, shin, foot] = ["thigh", "shin", "foot"].map(|part| role(&format!("{side}_{part}")));
        for end in [shin, foot] {
            let start = if end == shin { thigh } else { shin };
            let mut joint = end;
            while joint != start {
                joints[joint].rest.translation *= factor;
                joint = skeleton.parent(joint).expect("below");
            }
        }
    }
    let feet: Vec<usize> = (0..skeleton.len())
        .filter(|&joint| {
            ["left_foot", "right_foot"]
                .iter()
                .any(|&foot| role(foot) != joint && skeleton.is_ancestor_or_self(role(foot), joint))
        })
        .collect();
    let pelvis = role("pelvis");
    let (hip, ankle) = (rig.rest_height(role("left_thigh")), rig.rest_height(role("left_foot")));
    let mut raise = (hip - ankle) * (factor - 1.0);
    if with_feet {
        feet.iter().for_each(|&joint| joints[joint].rest.translation *= factor);
        let lowest = feet.iter().map(|&joint| rig.rest_height(joint)).fold(ankle, f64::min);
        let stands = lowest.abs() < 0.15 * (hip - lowest);
        raise += (ankle - if stands { lowest.min(0.0) } else { lowest }) * (factor - 1.0);
    }
    let parent = skeleton.parent(pelvis).map(|parent| rig.rest.transforms()[parent]).unwrap_or_default();
    let lift = |joints: &mut [Joint], raise: f64| {
        joints[pelvis].rest.translation += parent.rotation.conjugate() * (rig.up() * raise) / parent.scale;
    };
    lift(&mut joints, raise);
    if !with_feet {
        // Feet of the same size stand where they stood, whichever of them does in that pose.
        let lowest = |skeleton: &Skeleton| {
            let rest = world(skeleton, None);
            feet.iter().map(|&joint| position(&rest, joint).dot(rig.up())).fold(f64::INFINITY, f64::min)
        };
        let sunk = lowest(skeleton) - lowest(&Skeleton::new(joints.clone()).expect("valid"));
        lift(&mut joints, sunk);
    }
    Skeleton::new(joints).expect("valid")
}

/// What is measured of both feet.
struct Feet {
    /// Path along the floor of the worst contact, of the target and what the source itself has there; leg lengths.
    slide: f64,
    source_slide: f64,
    mean_slide: f64,
    source_mean_slide: f64,
    contacts: usize,
    /// 99th percentile of the depth of the lowest foot joint below where it stands, beyond the source's own.
    penetration: f64,
    own_penetration: f64,
    /// Of the report: every end, and the worst of them.
    jerk: Metric,
    flips: usize,
    elbow_flips: usize,
}

impl std::fmt::Display for Feet {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { slide, source_slide, mean_slide, contacts, penetration, own_penetration, flips, .. } = self;
        let jerk = self.jerk();
        write!(
            formatter,
            "slide {:.2} (own {:.2}, mean {:.2}, {contacts} contacts) pen {:.2} (own {:.2}) jerk {jerk:.2} flips {flips}",
            slide * 100.0,
            source_slide * 100.0,
            mean_slide * 100.0,
            penetration * 100.0,
            own_penetration * 100.0,
        )
    }
}

impl Feet {
    /// `feet_beside_legs` is how large the target's feet are beside its legs, for a source of 1.
    fn measure(source: &Scene, clip: &Clip, target: &Scene, feet_beside_legs: f64, spec: &str) -> Self {
        let (limbs, jerk) = Self::limbs(source, clip, target, spec);
        let more_flips = |limb: &Leg| limb.target.flips().saturating_sub(limb.source.flips());
        let elbow_flips = limbs.iter().filter(|(is_leg, _)| !is_leg).map(|(_, arm)| more_flips(arm)).sum();
        let legs: Vec<Leg> = limbs.into_iter().filter(|(is_leg, _)| *is_leg).map(|(_, leg)| leg).collect();
        let feet = Self::of(&legs, clip.times_seconds(), feet_beside_legs);
        Self { elbow_flips, jerk, ..feet }
    }

    fn legs(source: &Scene, clip: &Clip, target: &Scene, spec: &str) -> Vec<Leg> {
        let (limbs, _) = Self::limbs(source, clip, target, spec);
        limbs.into_iter().filter(|(is_leg, _)| *is_leg).map(|(_, leg)| leg).collect()
    }

    /// Legs and arms, and which are legs; and how smooth the report finds the result.
    fn limbs(source: &Scene, clip: &Clip, target: &Scene, spec: &str) -> (Vec<(bool, Leg)>, Metric) {
        let spec = parse_spec(spec.as_bytes()).expect("a spec");
        let mut reporter = Reporter::new();
        let source_rig = Rig::new("source", source, None, &spec.source, &mut reporter).expect("a rig");
        let target_rig = Rig::new("target", target, None, &spec.target, &mut reporter).expect("a rig");
        let stack = parse_spec(STACK.as_bytes()).expect("a spec");
        let Resolved { mapping: with_ground, .. } =
            resolve(&stack, &source_rig, &target_rig, clip, &mut reporter).expect("a mapping");
        let Resolved { mapping, ops, .. } =
            resolve(&spec, &source_rig, &target_rig, clip, &mut reporter).expect("a mapping");
        let stack = Stack::new(source_rig.skeleton(), target_rig.skeleton(), &mapping, &ops);
        let result = stack.run(clip, &Control::new()).expect("a result").clip;
        let read = |pair| Leg::read(pair, &with_ground, (&source_rig, clip), (&target_rig, &result));
        let limbs = with_ground.limbs.iter().map(|pair| (pair.limb.is_leg(), read(pair))).collect();
        let detail = ReportChoice::default();
        let mut measures = measure(&mapping, &source_rig, &target_rig, clip, &result, &detail, &[]);
        (limbs, measures.metrics.remove(&MetricName::JerkRatio).expect("every metric"))
    }

    fn of(legs: &[Leg], times: &[f64], feet_beside_legs: f64) -> Self {
        // Both feet are made alike: in a rest pose that is a frame of a capture one of them may hover.
        let rest = |track: fn(&Leg) -> &Track, point: usize| {
            legs.iter().filter_map(|leg| Some(track(leg).points.get(point)?.1)).fold(f64::INFINITY, f64::min)
        };
        let rests = |track: fn(&Leg) -> &Track| -> Vec<f64> { (0..3).map(|point| rest(track, point)).collect() };
        let (source_rests, target_rests) = (rests(|leg| &leg.source), rests(|leg| &leg.target));
        let mut worst = (f64::MIN, 0.0, 0.0);
        let (mut slides, mut source_slides, mut depths, mut own_depths) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let mut flips = 0;
        for leg in legs {
            for point in 0..leg.source.points.len() {
                for (first, last) in leg.source.contacts(point, times) {
                    if leg.source.is_raised(point, first, last) {
                        continue;
                    }
                    let target = leg.target.path(point, first, last);
                    let source = leg.source.path(point, first, last);
                    slides.push(target);
                    source_slides.push(source);
                    let over = target - source.max(MAX_SLIDE);
                    if over > worst.0 {
                        worst = (over, target, source);
                    }
                }
            }
            // Rest poses may hover over the floor: nothing is in it that is as high as where it stands in the clip.
            let stands: Vec<f64> = (0..leg.source.points.len()).map(|point| leg.source.stands(point, times)).collect();
            let target_stands: Vec<f64> = stands.iter().map(|height| height * feet_beside_legs).collect();
            for frame in 0..times.len() {
                let (own, depth) = (
                    leg.source.depth(frame, &source_rests, &stands),
                    leg.target.depth(frame, &target_rests, &target_stands),
                );
                own_depths.push(own);
                depths.push((depth - own).max(0.0));
            }
            flips += leg.target.flips().saturating_sub(leg.source.flips());
        }
        Self {
            slide: worst.1,
            source_slide: worst.2,
            mean_slide: mean(&slides),
            source_mean_slide: mean(&source_slides),
            contacts: slides.len(),
            penetration: percentile(depths, 0.99),
            own_penetration: percentile(own_depths, 0.99),
            jerk: Metric::default(),
            flips,
            elbow_flips: 0,
        }
    }

    fn jerk(&self) -> f64 {
        self.jerk.value.unwrap_or_default()
    }

    fn problems(&self, without: &Self, has_same_feet: bool) -> Vec<String> {
        let mut problems = Vec::new();
        let (own, slide) = (self.source_slide * 100.0, self.slide * 100.0);
        let little = if has_same_feet { LITTLE_SLIDE } else { LITTLE_SLIDE_OF_OTHER_FEET };
        if self.slide > MAX_SLIDE.max(self.source_slide + little.max(self.source_slide * SLACK)) {
            problems.push(format!("slides by {slide:.2} cm, the source by {own:.2}"));
        }
        if self.mean_slide > without.mean_slide.max(self.source_mean_slide) * (1.0 + SLACK) {
            problems
                .push(format!("slides more than without IK and than the source, by {:.2} cm", self.mean_slide * 100.0));
        }
        if self.penetration > MAX_PENETRATION {
            problems.push(format!("sinks by {:.2} cm", self.penetration * 100.0));
        }
        if self.jerk() > MAX_JERK {
            problems.push(format!("jerks {:?} times as much, and {:.2} without IK", self.jerk.parts, without.jerk()));
        }
        if (without.jerk() - 1.0).abs() > MAX_JERK_OF_ROTATIONS {
            problems.push(format!("rotations alone jerk {:?} times as much", without.jerk.parts));
        }
        if self.flips > 0 {
            problems.push(format!("{} knee flips", self.flips));
        }
        if self.elbow_flips > 0 {
            problems.push(format!("{} elbow flips", self.elbow_flips));
        }
        problems
    }
}

struct Leg {
    source: Track,
    target: Track,
}

/// A leg over time, in leg lengths, up the second axis, above the floor.
struct Track {
    hips: Vec<DVec3>,
    knees: Vec<DVec3>,
    /// Ankle, ball and tip of the toes, each with its height at rest.
    points: Vec<(Vec<DVec3>, f64)>,
    /// The places of the sole below them: what rolls over the floor does not slide.
    soles: Vec<Vec<DVec3>>,
}

impl Leg {
    fn read(pair: &LimbPair, mapping: &Mapping, source: (&Rig<'_>, &Clip), target: (&Rig<'_>, &Clip)) -> Self {
        let Ground { source_rest_floor, source_floor, target_rest_floor, target_floor, .. } = mapping.ground;
        let unit = mapping.plan_from_source.scale.x;
        let joints = |joints: &retargetd::rig::LimbJoints| {
            let beyond = joints.ball.into_iter().chain(joints.tip);
            [joints.start, joints.middle, joints.end].into_iter().chain(beyond).collect::<Vec<_>>()
        };
        let (from, onto) = (joints(&pair.source), joints(&pair.target));
        Self {
            source: Track::read(source, &from, source_rest_floor / unit, source_floor / unit),
            target: Track::read(target, &onto, target_rest_floor, target_floor),
        }
    }
}

impl Track {
    fn read((rig, clip): (&Rig<'_>, &Clip), joints: &[usize], rest_floor: f64, floor: f64) -> Self {
        let place = |joint: usize| rig.rest.transforms()[joint].translation;
        let leg = place(joints[0]).distance(place(joints[1])) + place(joints[1]).distance(place(joints[2]));
        let mut tracks = vec![Vec::new(); joints.len()];
        let lowest = joints[2..].iter().map(|&joint| rig.rest_height(joint)).fold(f64::INFINITY, f64::min);
        let down = |joint: usize| {
            let rest = rig.canonical_from_scene * rig.rest.transforms()[joint].rotation;
            rest.conjugate() * DVec3::NEG_Y * (rig.rest_height(joint) - lowest)
        };
        let mut soles = vec![Vec::new(); joints.len() - 2];
        for frame in 0..clip.frame_count() {
            let pose = clip.local_pose(rig.skeleton(), frame).to_model(rig.skeleton());
            for (track, &joint) in tracks.iter_mut().zip(joints) {
                let place = rig.canonical_from_scene * pose.transforms()[joint].translation;
                track.push((place - DVec3::Y * floor) / leg);
            }
            for (sole, &joint) in soles.iter_mut().zip(&joints[2..]) {
                let placed = pose.transforms()[joint];
                let turned = rig.canonical_from_scene * placed.rotation;
                sole.push(
                    (rig.canonical_from_scene * placed.translation + turned * down(joint) - DVec3::Y * floor) / leg,
                );
            }
        }
        let mut points = tracks.split_off(2);
        let points = joints[2..].iter().map(|&joint| (points.remove(0), (rig.rest_height(joint) - rest_floor) / leg));
        let points = points.collect();
        let knees = tracks.remove(1);
        Self { hips: tracks.remove(0), knees, points, soles }
    }

    /// Runs of frames in which a point is slow and low.
    fn contacts(&self, point: usize, times: &[f64]) -> Vec<(usize, usize)> {
        let places = &self.points[point].0;
        let floor = percentile(places.iter().map(|place| place.y).collect(), 0.1);
        let touches = |frame: usize| {
            let (before, after) = (frame.saturating_sub(1), (frame + 1).min(times.len() - 1));
            let speed = places[after].distance(places[before]) / (times[after] - times[before]);
            speed < 0.15 && places[frame].y - floor < 0.03
        };
        let mut runs = Vec::new();
        let mut first = None;
        for frame in 0..=times.len() {
            let is_on = frame < times.len() && touches(frame);
            match (first, is_on) {
                (None, true) => first = Some(frame),
                (Some(begin), false) => {
                    if times[frame - 1] - times[begin] > 0.1 {
                        runs.push((begin, frame - 1));
                    }
                    first = None;
                }
                _ => {}
            }
        }
        runs
    }

    /// Whether a point that is slow is in the air.
    fn is_raised(&self, point: usize, first: usize, last: usize) -> bool {
        let (places, rest) = &self.points[point];
        places[first..=last].iter().all(|place| place.y - rest > MAX_RAISED)
    }

    /// Way along the floor.
    fn path(&self, point: usize, first: usize, last: usize) -> f64 {
        let places = &self.soles[point][first..=last];
        places.windows(2).map(|pair| (pair[1] - pair[0]).with_y(0.0).length()).sum()
    }

    /// The height at which a point stands in its contacts, and at rest where it has none.
    fn stands(&self, point: usize, times: &[f64]) -> f64 {
        let (places, rest) = &self.points[point];
        let frames = self.contacts(point, times).into_iter().flat_map(|(first, last)| first..=last);
        let heights: Vec<f64> = frames.map(|frame| places[frame].y).collect();
        if heights.is_empty() { *rest } else { percentile(heights, 0.5) }
    }

    /// How deep the foot is below where it stands.
    fn depth(&self, frame: usize, rests: &[f64], stands: &[f64]) -> f64 {
        let depth =
            |(((places, _), rest), stands): ((&(Vec<DVec3>, f64), &f64), &f64)| rest.min(*stands) - places[frame].y;
        self.points.iter().zip(rests).zip(stands).map(depth).fold(0.0, f64::max)
    }

    /// How often the bend turns over from one frame to the next.
    fn flips(&self) -> usize {
        let normal = |frame: usize| {
            let (upper, lower) = (self.knees[frame] - self.hips[frame], self.points[0].0[frame] - self.knees[frame]);
            let normal = upper.normalize_or_zero().cross(lower.normalize_or_zero());
            (normal.length() > 0.1).then(|| normal.normalize())
        };
        let flips = |frame: &usize| match (normal(*frame), normal(frame + 1)) {
            (Some(before), Some(after)) => before.dot(after) < 0.0,
            _ => false,
        };
        (0..self.hips.len() - 1).filter(flips).count()
    }
}
