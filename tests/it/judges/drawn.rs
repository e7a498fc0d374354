//! Drawings as models, played by three.js, against the mesh of the moving picture.

use std::{collections::BTreeMap, process::Command};

use glam::DVec2;
use retargetd::{
    drawing::{CharacterSpec, Deformation, Look, Performance, PlanarRig, Puppet, RetargetSpec, ViewSection},
    engine::{DrawRequest, DrawSpec, Failure, FailureCode, Knowledge, Limits, NamedBytes, draw},
    formats::{Format, read_numbers, unpack_files},
    model::Control,
    picture::read_picture,
};

use crate::support::{corpus_file, three_script};

/// Moments of a clip that are looked at.
const MOMENTS: usize = 6;

/// The files of a drawing by their names.
type Files = BTreeMap<String, Vec<u8>>;

fn sample() -> Files {
    let files = unpack_files(&retargetd::samples::drawing(), &["yaml", "png"], &Limits::default(), &Control::new());
    let named = |(path, bytes): (String, Vec<u8>)| (path.rsplit('/').next().unwrap_or_default().to_owned(), bytes);
    files.expect("its files").into_iter().map(named).collect()
}

/// What three.js makes of a model at some moments: its vertices at rest, and where they are then.
fn played(model: &[u8], moments: &[f64]) -> Option<(Vec<DVec2>, Vec<Vec<DVec2>>)> {
    let script = three_script("played.mjs")?;
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("drawn.glb");
    std::fs::write(&file, model).expect("written");
    let moments = moments.iter().map(f64::to_string);
    let output = Command::new("node").arg(script).arg(&file).args(moments).output().expect("node runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let places = |value: &serde_json::Value| -> Vec<DVec2> {
        let number = |value: &serde_json::Value| value.as_f64().expect("a number");
        value.as_array().expect("places").iter().map(|at| DVec2::new(number(&at[0]), number(&at[1]))).collect()
    };
    Some((places(&said["rest"]), said["frames"].as_array().expect("frames").iter().map(places).collect()))
}

fn corners(places: &[DVec2]) -> [DVec2; 2] {
    places.iter().fold([DVec2::MAX, DVec2::MIN], |[low, high], place| [low.min(*place), high.max(*place)])
}

/// How far the model that three.js plays is from the picture's mesh, on average, in percent of the drawing's width.
fn apart(files: &Files, source: NamedBytes<'_>) -> Option<f64> {
    let mut read = |name: &str| {
        let name = name.rsplit('/').next().unwrap_or_default();
        files.get(name).cloned().ok_or_else(|| Failure::new(FailureCode::UnknownName, name.to_owned()))
    };
    let formats = [Format::Glb, Format::Poses2dNpz];
    let request = DrawRequest {
        folder: Some(""),
        source: Some(source),
        spec: DrawSpec::default(),
        formats: &formats,
        ..DrawRequest::default()
    };
    let outcome = draw(&request, &mut read, &Knowledge::default(), &Limits::default(), &Control::new()).expect("drawn");
    let arrays = &outcome.outputs[1].bytes;
    let numbers = |name: &str| {
        let found = read_numbers(arrays, name, &Limits::default(), &Control::new()).expect("an archive");
        found.unwrap_or_else(|| panic!("there is no {name}")).1
    };
    let text = std::str::from_utf8(&files["char_cfg.yaml"]).expect("text");
    let spec = CharacterSpec::read(text).expect("a spec");
    let rig = PlanarRig::new(&spec).expect("a rig");
    let retarget = RetargetSpec::read(&outcome.resolved_spec["retarget"].to_string()).expect("what was found");
    let pictures = ["texture.png", "mask.png"].map(|name| read_picture(&files[name]).expect("a picture"));
    let look = Look { deformation: Deformation::Bones, rigid: Vec::new(), smooth: true, keep_texture: true };
    let puppet = Puppet::new(&spec, &rig, &retarget, &ViewSection::default(), &look, pictures).expect("a puppet");
    let performance = performance(&numbers, rig.rest.len());
    let frames: Vec<usize> = (0..MOMENTS).map(|at| at * (performance.frames - 1) / (MOMENTS - 1)).collect();
    let moments: Vec<f64> = frames.iter().map(|frame| *frame as f64 * performance.frame_time).collect();
    let (rest, seen) = played(&outcome.outputs[0].bytes, &moments)?;
    // Both at rest have the same corners, up to a length and a place.
    let (own, _) = puppet.rest();
    let ([low, high], [own_low, own_high]) = (corners(&rest), corners(own));
    let scale = (high.y - low.y) / (own_high.y - own_low.y);
    let own_of = |place: &DVec2| {
        let at = (*place - low) / scale + own_low;
        let nearest = (0..own.len()).min_by(|one, other| own[*one].distance(at).total_cmp(&own[*other].distance(at)));
        nearest.filter(|vertex| own[*vertex].distance(at) < 1e-3).expect("a vertex of the picture's mesh")
    };
    let vertices: Vec<usize> = rest.iter().map(own_of).collect();
    let mut workspace = puppet.workspace();
    let ways: Vec<DVec2> = frames
        .iter()
        .zip(&seen)
        .flat_map(|(frame, seen)| {
            let mesh = puppet.deformed(&performance, *frame, &mut workspace);
            vertices.iter().zip(seen).map(|(vertex, seen)| *seen / scale - mesh[*vertex]).collect::<Vec<_>>()
        })
        .collect();
    // The model stands somewhere else, in all frames alike.
    let middle = ways.iter().sum::<DVec2>() / ways.len() as f64;
    let mean = ways.iter().map(|way| way.distance(middle)).sum::<f64>() / ways.len() as f64;
    Some(100.0 * mean / (own_high.x - own_low.x))
}

/// What moves the mesh of the picture, of the arrays.
fn performance(numbers: &impl Fn(&str) -> Vec<f64>, joints: usize) -> Performance {
    let places = numbers("rig_joint_xy");
    let frames = places.len() / joints / 2;
    Performance {
        frames,
        frame_time: numbers("frame_time")[0],
        is_mirrored: numbers("mirrored").iter().map(|mirrored| *mirrored > 0.0).collect(),
        pan: vec![0.0; frames],
        joints: places.chunks_exact(2).map(|at| DVec2::new(at[0], at[1])).collect(),
        ..Performance::default()
    }
}

#[test]
fn three_plays_a_drawn_model_as_it_is_in_the_picture() {
    let walk = retargetd::samples::walk_clip();
    let Some(apart) = apart(&sample(), NamedBytes { name: "walk.glb", bytes: &walk }) else { return };
    assert!(apart <= 1.0, "{apart} % of the width");
}

#[test]
fn three_plays_real_drawings_as_they_are_in_the_picture() {
    for (drawing, motion) in [("char1", "bvh/fair1/zombie_zup.bvh"), ("char4", "bvh/fair1/dab_zup.bvh")] {
        let mut files = Files::new();
        for name in ["char_cfg.yaml", "texture.png", "mask.png"] {
            let Some(path) = corpus_file(&format!("animated-drawings/{drawing}/{name}")) else { return };
            files.insert(name.to_owned(), std::fs::read(path).expect("readable"));
        }
        let Some(path) = corpus_file(motion) else { return };
        let bytes = std::fs::read(path).expect("readable");
        let Some(apart) = apart(&files, NamedBytes { name: motion, bytes: &bytes }) else { return };
        assert!(apart <= 1.0, "{drawing} with {motion}: {apart} % of the width");
    }
}
