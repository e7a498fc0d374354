//! Reading and writing files of tens of megabytes, beside the readers of others and beside loops that only touch the same bytes.
//!
//! The files are left in `target/tmp`, where tests/tools/three_reader/speed.mjs can read them too.

#![allow(missing_docs, reason = "criterion's macros make undocumented items")]

mod busy;

use std::{hint::black_box, time::Duration};

use busy::busy_clip;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main, measurement::WallTime};
use retargetd::{
    formats::{self, Format, Limits, WriteOptions},
    model::{Clip, Control, Reporter, Scene},
    samples,
};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Of 65 joints, which makes files of 20 to 40 MB.
const FRAMES: usize = 20_000;

fn read(bytes: &[u8], format: Format) -> Scene {
    formats::read(bytes, format, &Limits::default(), &Control::new(), &mut Reporter::new()).expect("readable")
}

fn write(scene: &Scene, clip: &Clip, format: Format) -> Vec<u8> {
    let options = WriteOptions::new(format);
    formats::write(scene, clip, &options, &Control::new(), &mut Reporter::new()).expect("writable")
}

/// What the `gltf` crate makes of a file when every key of it is asked for.
fn read_with_gltf_crate(bytes: &[u8]) -> (Vec<f32>, Vec<[f32; 4]>, Vec<[f32; 3]>) {
    use gltf::animation::util::ReadOutputs;
    let file = gltf::Gltf::from_slice(bytes).expect("readable");
    let (mut times, mut rotations, mut vectors) = (Vec::new(), Vec::new(), Vec::new());
    for channel in file.animations().flat_map(|animation| animation.channels()) {
        let reader = channel.reader(|_| file.blob.as_deref());
        times.extend(reader.read_inputs().into_iter().flatten());
        match reader.read_outputs() {
            Some(ReadOutputs::Rotations(keys)) => rotations.extend(keys.into_f32()),
            Some(ReadOutputs::Translations(keys) | ReadOutputs::Scales(keys)) => vectors.extend(keys),
            Some(ReadOutputs::MorphTargetWeights(_)) | None => {}
        }
    }
    (times, rotations, vectors)
}

fn parse_with_ufbx(bytes: &[u8]) -> ufbx::SceneRoot {
    ufbx::load_memory(bytes, ufbx::LoadOpts::default()).expect("readable")
}

/// A group whose figures are bytes per second of a file.
fn group<'a>(criterion: &'a mut Criterion, name: &str, bytes: &[u8]) -> BenchmarkGroup<'a, WallTime> {
    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Bytes(bytes.len() as u64)).sample_size(10).measurement_time(Duration::from_secs(8));
    group
}

fn reading(criterion: &mut Criterion) {
    let scene = samples::walk_scene();
    let clip = busy_clip(&scene.skeleton, FRAMES);
    let file = |format: Format| {
        let bytes = write(&scene, &clip, format);
        let path = format!("{}/reading.{}", env!("CARGO_TARGET_TMPDIR"), format.info().endings[0]);
        std::fs::write(path, &bytes).expect("a file in the target folder");
        bytes
    };
    let [glb, fbx, bvh] = [Format::Glb, Format::Fbx, Format::Bvh].map(file);

    let mut glb_group = group(criterion, "glb", &glb);
    glb_group.bench_function("ours", |bencher| bencher.iter(|| black_box(read(&glb, Format::Glb))));
    glb_group.bench_function("gltf_crate", |bencher| bencher.iter(|| black_box(read_with_gltf_crate(&glb))));
    glb_group.bench_function("write", |bencher| bencher.iter(|| black_box(write(&scene, &clip, Format::Glb))));
    glb_group.bench_function("copy", |bencher| bencher.iter(|| black_box(glb.clone())));
    glb_group.finish();

    let mut fbx_group = group(criterion, "fbx", &fbx);
    fbx_group.bench_function("ours", |bencher| bencher.iter(|| black_box(read(&fbx, Format::Fbx))));
    fbx_group.bench_function("ufbx_parse", |bencher| bencher.iter(|| black_box(parse_with_ufbx(&fbx))));
    fbx_group.bench_function("ufbx_bake", |bencher| {
        bencher.iter(|| {
            let scene = parse_with_ufbx(&fbx);
            black_box(ufbx::bake_anim(&scene, &scene.anim_stacks[0].anim, ufbx::BakeOpts::default()).expect("baked"))
        });
    });
    fbx_group.bench_function("write", |bencher| bencher.iter(|| black_box(write(&scene, &clip, Format::Fbx))));
    fbx_group.finish();

    let npz = write(&scene, &clip, Format::PosesNpz);
    let mut npz_group = group(criterion, "npz", &npz);
    npz_group.bench_function("write", |bencher| bencher.iter(|| black_box(write(&scene, &clip, Format::PosesNpz))));
    npz_group.bench_function("copy", |bencher| bencher.iter(|| black_box(npz.clone())));
    npz_group.finish();

    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let mut bvh_group = group(criterion, "bvh", &bvh);
    bvh_group.bench_function("ours", |bencher| {
        bencher.iter(|| one_thread.install(|| black_box(read(&bvh, Format::Bvh))));
    });
    bvh_group.bench_function("bytes", |bencher| {
        bencher.iter(|| black_box(&bvh).iter().fold(0_u64, |sum, byte| sum.wrapping_mul(31) + u64::from(*byte)));
    });
    bvh_group.finish();
}

criterion_group!(benches, reading);
criterion_main!(benches);
