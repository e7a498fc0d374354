//! Four-legged animals of other proportions stand on both pairs of their legs.

use glam::DVec3;
use retargetd::{
    model::{Axes, Clip, Control, Reporter, Scene},
    retarget::{RetargetSpec, Stack, resolve},
    rig::Rig,
};

use super::{
    figure::{Figure, world},
    made_rigs::{clip_of, retargeted},
};
use crate::support::corpus_file;

const FOXES: [[&str; 2]; 2] =
    [["creatures/Fox.glb", "creatures/m2m_fox_model.glb"], ["creatures/m2m_fox_clips.glb", "creatures/Fox.glb"]];

/// An animal, and the joints of its paws.
struct Animal {
    figure: Figure,
    /// In front, then behind.
    paws: [Vec<usize>; 2],
    hips: f64,
}

impl Animal {
    fn read(path: &str) -> Option<Self> {
        let figure = Figure::read(&corpus_file(path)?);
        let scene = &figure.scene;
        let rig =
            Rig::new("source", scene, None, &RetargetSpec::default().source, &mut Reporter::new()).expect("a rig");
        let skeleton = &scene.skeleton;
        let paws = ["front_leg", "hind_leg"].map(|pair| {
            let ends = ["left", "right"].map(|side| *rig.role(&format!("{side}_{pair}")).last().expect("a leg"));
            let is_paw = |joint: &usize| ends.iter().any(|end| skeleton.is_ancestor_or_self(*end, *joint));
            (0..skeleton.len()).filter(is_paw).collect()
        });
        let hips = rig.rest_height(rig.role("pelvis")[0]);
        Some(Self { paws, hips, figure })
    }

    fn scene(&self) -> &Scene {
        &self.figure.scene
    }

    /// How low the front paws and the hind paws are, as shares of the height of the hips: of their mesh, else of their joints.
    fn lowest(&self, clip: &Clip, frame: usize) -> [f64; 2] {
        assert_eq!(self.scene().axes, Some(Axes::Y_UP_Z_FRONT), "as glTF is");
        let posed = world(&self.scene().skeleton, Some((clip, frame)));
        let lowest = |joints: &Vec<usize>| {
            let heights = joints.iter().flat_map(|&joint| {
                let points = self.scene().skin_points.of(joint).iter().map(|point| point.position.as_dvec3());
                let origin = if self.scene().skin_points.of(joint).is_empty() { Some(DVec3::ZERO) } else { None };
                points.chain(origin).map(|point| posed[joint].transform_point3(point).y).collect::<Vec<f64>>()
            });
            heights.fold(f64::INFINITY, f64::min) / self.hips
        };
        [lowest(&self.paws[0]), lowest(&self.paws[1])]
    }
}

/// How paws stand, frame by frame, as shares of the height of the hips: how low they are, and how fast what is lowest of them goes over
/// the floor, per second.
struct Standing {
    lowest: Vec<f64>,
    speeds: Vec<f64>,
}

/// What is within this share of the height of the hips above the lowest point of a paw touches the floor with it.
const SOLE: f64 = 0.02;
/// A vertex that hangs on one joint by more than this is where that joint alone puts it.
const WHOLLY: f32 = 0.9;
/// A paw that is lower and slower than this stands.
const LOW: f64 = 0.03;
const SLOW: f64 = 0.05;

impl Animal {
    /// Where the mesh of the paws of one pair is.
    fn vertices(&self, clip: &Clip, pair: usize, frame: usize) -> Vec<DVec3> {
        let posed = world(&self.scene().skeleton, Some((clip, frame)));
        let of_joint = |&joint: &usize| {
            let points = self.scene().skin_points.of(joint).iter().filter(|point| point.weight > WHOLLY);
            points.map(|point| posed[joint].transform_point3(point.position.as_dvec3())).collect::<Vec<DVec3>>()
        };
        self.paws[pair].iter().flat_map(of_joint).collect()
    }

    fn standing(&self, clip: &Clip, pair: usize) -> Standing {
        let vertices: Vec<_> = (0..clip.frame_count()).map(|frame| self.vertices(clip, pair, frame)).collect();
        let times = clip.times_seconds();
        let low = |places: &[DVec3]| places.iter().map(|place| place.y).fold(f64::INFINITY, f64::min);
        let speed = |frame: usize| {
            let (now, next) = (&vertices[frame], &vertices[frame + 1]);
            let bottom = low(now) + SOLE * self.hips;
            let steps: Vec<DVec3> =
                now.iter().zip(next).filter(|(now, _)| now.y < bottom).map(|(now, next)| *next - *now).collect();
            let mean = steps.iter().sum::<DVec3>() / steps.len() as f64;
            mean.with_y(0.0).length() / (times[frame + 1] - times[frame]) / self.hips
        };
        Standing {
            lowest: vertices.iter().map(|places| low(places) / self.hips).collect(),
            speeds: (0..clip.frame_count() - 1).map(speed).collect(),
        }
    }
}

/// The clip with all that is done by default, contacts and all.
fn planted(source: &Animal, clip: &Clip, target: &Animal) -> Clip {
    let spec = RetargetSpec::default();
    let mut reporter = Reporter::new();
    let from = Rig::new("source", source.scene(), None, &spec.source, &mut reporter).expect("a rig");
    let to = Rig::new("target", target.scene(), None, &spec.target, &mut reporter).expect("a rig");
    let resolved = resolve(&spec, &from, &to, clip, &mut reporter).expect("a mapping");
    let stack = Stack::new(from.skeleton(), to.skeleton(), &resolved.mapping, &resolved.ops);
    stack.run(clip, &Control::new()).expect("a result").clip
}

/// Clips in which animals stand: what is seen of the mesh of the paws is what counts.
#[test]
fn paws_that_stand_neither_slide_nor_sink() {
    let pairs = [
        ("creatures/Fox.glb", "Survey", "creatures/m2m_fox_model.glb"),
        ("creatures/m2m_fox_clips.glb", "Idle", "creatures/Fox.glb"),
        ("creatures/m2m_fox_clips.glb", "Bark", "creatures/Fox.glb"),
    ];
    for (from, name, to) in pairs {
        let (Some(source), Some(target)) = (Animal::read(from), Animal::read(to)) else { return };
        let clip = source.scene().clips.iter().find(|clip| clip.name() == name).expect("a clip");
        let result = planted(&source, clip, &target);
        for pair in 0..2 {
            let (wanted, found) = (source.standing(clip, pair), target.standing(&result, pair));
            let stands = |&frame: &usize| wanted.lowest[frame] < LOW && wanted.speeds[frame] < SLOW;
            let frames: Vec<usize> = (0..wanted.speeds.len()).filter(stands).collect();
            assert!(frames.len() * 2 > wanted.speeds.len(), "{from} {name}: the animal stands");
            let slide = |speeds: &[f64]| frames.iter().map(|frame| speeds[*frame]).sum::<f64>() / frames.len() as f64;
            let (own, slides) = (slide(&wanted.speeds), slide(&found.speeds));
            assert!(slides < own + 0.01, "{from} {name} onto {to}, pair {pair}: {slides:.4} and not {own:.4} a second");
            for &frame in &frames {
                let height = found.lowest[frame];
                assert!(
                    (-0.01..0.02).contains(&height),
                    "{from} {name} onto {to}, pair {pair}, frame {frame}: {height:.4}"
                );
            }
        }
    }
}

#[test]
fn an_animal_that_stands_makes_another_stand() {
    for [from, to] in FOXES {
        let (Some(source), Some(target)) = (Animal::read(from), Animal::read(to)) else { return };
        let still = clip_of(source.scene(), 1, |_, _| None);
        let (result, ..) =
            retargeted(&RetargetSpec::default(), source.scene(), &still, target.scene()).expect("a retarget");
        let (wanted, found) = (source.lowest(&still, 0), target.lowest(&result, 0));
        for (wanted, found) in wanted.iter().zip(found) {
            assert!(
                (found - wanted).abs() < 0.015,
                "{from} onto {to}: {found:.3} and not {wanted:.3} of the hips' height"
            );
        }
    }
}

#[test]
fn an_animal_that_walks_makes_another_walk_on_the_floor() {
    for [from, to] in FOXES {
        let (Some(source), Some(target)) = (Animal::read(from), Animal::read(to)) else { return };
        let clip = source.scene().clips.iter().find(|clip| clip.name() == "Walk").expect("a walk");
        let (result, ..) =
            retargeted(&RetargetSpec::default(), source.scene(), clip, target.scene()).expect("a retarget");
        for pair in 0..2 {
            let over = |animal: &Animal, clip: &Clip| {
                (0..clip.frame_count()).map(|frame| animal.lowest(clip, frame)[pair]).fold(f64::INFINITY, f64::min)
            };
            let (wanted, found) = (over(&source, clip), over(&target, &result));
            assert!(
                (found - wanted).abs() < 0.04,
                "{from} onto {to}: {found:.3} and not {wanted:.3} of the hips' height"
            );
        }
    }
}

/// A fox that sneaks lowers its hips, and the tail of another is longer.
#[test]
fn tails_stay_above_the_floor() {
    let (from, to) = ("creatures/m2m_fox_clips.glb", "creatures/Fox.glb");
    let (Some(source), Some(target)) = (Animal::read(from), Animal::read(to)) else { return };
    let clip = source.scene().clips.iter().find(|clip| clip.name() == "Sneak").expect("a clip");
    let result = planted(&source, clip, &target);
    let skeleton = &target.scene().skeleton;
    let tail: Vec<usize> =
        (0..skeleton.len()).filter(|joint| skeleton.joints()[*joint].name.contains("Tail")).collect();
    for frame in 0..result.frame_count() {
        let posed = world(skeleton, Some((&result, frame)));
        let points = tail.iter().flat_map(|&joint| {
            let points = target.scene().skin_points.of(joint).iter().filter(|point| point.weight > WHOLLY);
            points.map(move |point| (joint, point.position.as_dvec3()))
        });
        let lowest = points.map(|(joint, point)| posed[joint].transform_point3(point).y).fold(f64::INFINITY, f64::min);
        assert!(lowest > -0.01 * target.hips, "frame {frame}: the tail is at {:.3}", lowest / target.hips);
    }
}
