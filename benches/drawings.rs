//! The sample drawing at 500 by 500 pixels: one frame of it, and a whole moving picture of the sample walk.

#![allow(missing_docs, reason = "criterion's macros make undocumented items")]

use std::{collections::BTreeMap, hint::black_box, time::Duration};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec2;
use retargetd::{
    drawing::{CharacterSpec, Deformation, Look, Performance, PlanarRig, Puppet, RetargetSpec, SceneSpec, ViewSection},
    engine::{DrawRequest, DrawSpec, Failure, FailureCode, Knowledge, Limits, NamedBytes, draw},
    formats::{Format, read_numbers, unpack_files},
    model::Control,
    picture::{Picture, read_picture},
};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

type Files = BTreeMap<String, Vec<u8>>;

fn sample() -> Files {
    let files = unpack_files(&retargetd::samples::drawing(), &["yaml", "png"], &Limits::default(), &Control::new());
    let named = |(path, bytes): (String, Vec<u8>)| (path.rsplit('/').next().unwrap_or_default().to_owned(), bytes);
    files.expect("its files").into_iter().map(named).collect()
}

/// What the sample walk makes of the sample drawing, in formats.
fn drawn(files: &Files, walk: &[u8], formats: &[Format]) -> retargetd::engine::Outcome {
    let mut read =
        |name: &str| files.get(name).cloned().ok_or_else(|| Failure::new(FailureCode::UnknownName, name.to_owned()));
    let request = DrawRequest {
        folder: Some(""),
        source: Some(NamedBytes { name: "walk.glb", bytes: walk }),
        spec: DrawSpec::default(),
        formats,
        ..DrawRequest::default()
    };
    draw(&request, &mut read, &Knowledge::default(), &Limits::default(), &Control::new()).expect("drawn")
}

/// The drawing, ready to be drawn, and what it does.
fn ready(files: &Files, walk: &[u8]) -> (Puppet, Performance) {
    let outcome = drawn(files, walk, &[Format::Poses2dNpz]);
    let numbers = |name: &str| {
        let found = read_numbers(&outcome.outputs[0].bytes, name, &Limits::default(), &Control::new());
        found.expect("an archive").expect("an array").1
    };
    let spec = CharacterSpec::read(std::str::from_utf8(&files["char_cfg.yaml"]).expect("text")).expect("a spec");
    let rig = PlanarRig::new(&spec).expect("a rig");
    let retarget = RetargetSpec::read(&outcome.resolved_spec["retarget"].to_string()).expect("what was found");
    let places = numbers("rig_joint_xy");
    let frames = places.len() / rig.rest.len() / 2;
    let groups = retarget.char_bodypart_groups.len();
    let performance = Performance {
        frames,
        frame_time: numbers("frame_time")[0],
        is_mirrored: vec![false; frames],
        pan: numbers("camera_pan"),
        start: retarget.char_starting_location,
        joints: places.chunks_exact(2).map(|at| DVec2::new(at[0], at[1])).collect(),
        order: numbers("bodypart_order").iter().map(|group| *group as usize).collect(),
        group_depths: vec![0.0; frames * groups],
        ..Performance::default()
    };
    let around = SceneSpec::of_bounds(performance.bounds(&rig, None), performance.start[2], [500, 500]);
    let view: ViewSection = around.view;
    let look = Look { deformation: Deformation::Bones, rigid: Vec::new(), smooth: true, keep_texture: false };
    let pictures = ["texture.png", "mask.png"].map(|name| read_picture(&files[name]).expect("a picture"));
    (Puppet::new(&spec, &rig, &retarget, &view, &look, pictures).expect("a puppet"), performance)
}

fn drawings(criterion: &mut Criterion) {
    let (files, walk) = (sample(), retargetd::samples::walk_clip());
    let (puppet, performance) = ready(&files, &walk);
    let (mut workspace, mut frame) = (puppet.workspace(), 0);
    let ground = Picture::filled(500, 500, [0; 4]);
    let mut picture = ground.clone();
    let mut group = criterion.benchmark_group("drawings");
    group.sample_size(20).measurement_time(Duration::from_secs(5));
    group.throughput(Throughput::Elements(1));
    group.bench_function("deform", |bencher| {
        bencher.iter(|| {
            frame = (frame + 1) % performance.frames;
            black_box(puppet.deformed(&performance, frame, &mut workspace)[0])
        });
    });
    group.bench_function("frame", |bencher| {
        bencher.iter(|| {
            frame = (frame + 1) % performance.frames;
            picture.pixels.copy_from_slice(&ground.pixels);
            black_box(puppet.draw(&performance, frame, &mut workspace, &mut picture))
        });
    });
    group.throughput(Throughput::Elements(performance.frames as u64));
    for (name, format) in [("gif", Format::Gif), ("mp4", Format::Mp4)].into_iter().filter(|(_, own)| own.info().writes)
    {
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            group.bench_function(format!("{name}_{threads}_threads"), |bencher| {
                pool.install(|| bencher.iter(|| black_box(drawn(&files, &walk, &[format]))));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, drawings);
criterion_main!(benches);
