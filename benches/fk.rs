//! The frame loop, in joint transforms per second, beside a loop that only streams the same tracks through memory.

#![allow(missing_docs, reason = "criterion's macros make undocumented items")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{DVec3, Quat, Vec3};
use retargetd::{
    model::{Clip, Control, Joint, JointTracks, Reporter, Scene, Skeleton, Track, Transform},
    retarget::{Plan, run},
    rig::{RetargetSpec, Rig, resolve},
    samples,
};
use std::hint::black_box;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const FRAMES: usize = 3600;

/// The walk's skeleton with every joint turning, so that no track is constant.
fn busy_clip(skeleton: &Skeleton) -> Clip {
    let turning = |joint: usize| -> Vec<Quat> {
        let rest = skeleton.joints()[joint].rest.rotation.as_quat();
        let axis = Vec3::new(1.0, joint as f32 * 0.37, 0.5).normalize();
        (0..FRAMES).map(|frame| rest * Quat::from_axis_angle(axis, (frame as f32 * 0.05).sin() * 0.5)).collect()
    };
    let tracks = (0..skeleton.len()).map(|joint| {
        let root = skeleton.parent(joint).is_none();
        let path = |frame: usize| Vec3::new(0.0, 0.95, frame as f32 * 0.02);
        JointTracks {
            rotation: Track::Sampled(turning(joint)),
            translation: if root { Track::Sampled((0..FRAMES).map(path).collect()) } else { Track::Rest },
            scale: Track::Rest,
        }
    });
    let times = (0..FRAMES).map(|frame| frame as f64 / 60.0).collect();
    Clip::new("bench".into(), times, tracks.collect()).expect("a valid clip")
}

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

fn fk(criterion: &mut Criterion) {
    let skeleton = samples::walk_scene().skeleton;
    let clip = busy_clip(&skeleton);
    let source = Scene { axes: Some(Default::default()), unit_metres: Some(1.0), skeleton, ..Scene::default() };
    let target = Scene {
        skeleton: other_proportions(&source.skeleton),
        axes: source.axes,
        unit_metres: source.unit_metres,
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

    let mut group = criterion.benchmark_group("fk");
    group.throughput(Throughput::Elements((driven * FRAMES) as u64));
    group.bench_function("one_thread", |bencher| {
        bencher.iter(|| one_thread.install(|| black_box(run(&plan, &clip, &control).expect("it runs"))));
    });
    group.bench_function("two_threads", |bencher| {
        bencher.iter(|| two_threads.install(|| black_box(run(&plan, &clip, &control).expect("it runs"))));
    });
    let mut copies = vec![vec![Quat::IDENTITY; FRAMES]; driven];
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
