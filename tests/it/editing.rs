//! Edits of a clip: their properties on the sample and on real clips, and the command line.

mod command;
mod commute;
mod contacts;
mod cycles;
mod euler;
mod keys;
mod layers;
mod mirror;
mod page;
mod time;

use glam::{DVec3, Quat, Vec3};
use retargetd::{
    editing::edit_time,
    engine::{Format, Limits},
    formats,
    model::{Clip, Control, Reporter, Scene, Track},
    retarget::EditSpec,
};
use serde_json::Value;

use crate::support::corpus_file;

/// Real clips of several formats, rates and key spacings.
const CLIPS: [&str; 5] = [
    "mixamo/fbx/walking_noskin.fbx",
    "bvh/cmu/12_01_walk.bvh",
    "bvh/bandai-namco/dataset-1_walk_normal_001.bvh",
    "vrma/idle_loop.vrma",
    "creatures/Fox.glb",
];

fn spec(edit: Value) -> EditSpec {
    serde_json::from_value(edit).expect("an edit")
}

fn edited(scene: &Scene, clip: &Clip, edit: Value) -> Clip {
    edit_time(clip, &scene.skeleton, DVec3::Y, &spec(edit), &Control::new()).expect("it can be edited")
}

fn read(path: &std::path::Path) -> Scene {
    let bytes = std::fs::read(path).expect("the file");
    let name = path.file_name().expect("a name").to_string_lossy();
    let format = Format::from_file_name(&name).expect("a format");
    formats::read(&bytes, format, &Limits::default(), &Control::new(), &mut Reporter::new()).expect("it reads")
}

/// Every real clip that is there, with a name for messages.
fn real_clips() -> Vec<(&'static str, Scene)> {
    CLIPS.iter().filter_map(|name| corpus_file(name).map(|path| (*name, read(&path)))).collect()
}

fn rotations(clip: &Clip, joint: usize) -> &[Quat] {
    match &clip.joints()[joint].rotation {
        Track::Sampled(values) => values,
        Track::Rest | Track::Constant(_) => panic!("joint {joint} has no sampled rotation"),
    }
}

fn translations(clip: &Clip, joint: usize) -> &[Vec3] {
    match &clip.joints()[joint].translation {
        Track::Sampled(values) => values,
        Track::Rest | Track::Constant(_) => panic!("joint {joint} has no sampled translation"),
    }
}
