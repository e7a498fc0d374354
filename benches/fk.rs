//! The frame loop, in joint transforms per second, beside a loop that only streams the same tracks through memory.

#![allow(missing_docs, reason = "criterion's macros make undocumented items")]

mod busy;

use busy::busy_clip;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{DVec3, Quat};
use retargetd::{
    model::{Clip, Control, Joint, Reporter, Scene, Skeleton, Track, Transform},
    retarget::{Plan, RetargetSpec, resolve, run},
    rig::Rig,
    samples,
};
use std::hint::black_box;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const FRAMES: usize = 3600;
/// Twenty minutes at 30 frames per second: 37 MB of rotations.
const LONG_FRAMES: usize = 36_000;

/// The same skeleton a tenth larger, with other proportions of the arms.
fn other_proportions(skeleton: &Skeleton) -> Skeleton {
    let joints = skeleton.joints().iter().map(|joint| {
        let factor = if joint.name.contains("Arm") { 1.3 } else { 1.1 };
        let rest = Transform { translation: joint.rest.translation * DVec3::splat(factor), ..joint.rest };
        Joint { rest, ..joint.clone() }
    });
    Skeleton::new(joints.collect()).expect("the same order")
}

fn stream(clip: &Clip, into: &mut [Vec<Quat>]) {
    for (joint, values) in clip.joints().iter().zip(into) {
        if let Track::Sampled(rotations) = &joint.rotation {
            for (value, rotation) in values.iter_mut().zip(rotations) {
                *value = -*rotation;
            }
        }
    }
}

/// One clip that is in the processor's caches, and one that is not.
fn fk(criterion: &mut Criterion) {
    of_clip(criterion, "fk", FRAMES);
    of_clip(criterion, "fk_long", LONG_FRAMES);
}

fn of_clip(criterion: &mut Criterion, name: &str, frames: usize) {
    let skeleton = samples::walk_scene().skeleton;
    let clip = busy_clip(&skeleton, frames);
    let source = Scene { axes: Some(Default::default()), unit_meters: Some(1.0), skeleton, ..Scene::default() };
    let target = Scene {
        skeleton: other_proportions(&source.skeleton),
        axes: source.axes,
        unit_meters: source.unit_meters,
        ..Scene::default()
    };
    let mut reporter = Reporter::new();
    let spec = RetargetSpec::default();
    let source_rig = Rig::new("source", &source, None, &spec.source, &mut reporter).expect("a rig");
    let target_rig = Rig::new("target", &target, None, &spec.target, &mut reporter).expect("a rig");
    let resolved = resolve(&spec, &source_rig, &target_rig, &clip, &mut reporter).expect("it maps");
    let plan = Plan::new(&source.skeleton, &target.skeleton, &resolved.mapping);
    let driven = plan.driven_joint_count();
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let two_threads = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a pool");
    let control = Control::new();

    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements((driven * frames) as u64));
    group.bench_function("one_thread", |bencher| {
        bencher.iter(|| one_thread.install(|| black_box(run(&plan, &clip, &control).expect("it runs"))));
    });
    group.bench_function("two_threads", |bencher| {
        bencher.iter(|| two_threads.install(|| black_box(run(&plan, &clip, &control).expect("it runs"))));
    });
    let mut copies = vec![vec![Quat::IDENTITY; frames]; driven];
    group.bench_function("memory_baseline", |bencher| {
        bencher.iter(|| {
            stream(&clip, &mut copies);
            black_box(&copies);
        });
    });
    group.finish();
}

criterion_group!(benches, fk);
criterion_main!(benches);
