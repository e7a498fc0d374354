//! Four-legged animals of other proportions stand on both pairs of their legs.

use glam::DVec3;
use retargetd::{
    model::{Axes, Clip, Reporter, Scene},
    rig::{RetargetSpec, Rig},
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
