//! The default stack with contacts, planting and inverse kinematics, and the same with self-contact, in frames per second, beside
//! forward kinematics alone.

#![allow(missing_docs, reason = "criterion's macros make undocumented items")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{DVec3, Vec3};
use retargetd::{
    model::{Clip, Control, Joint, Reporter, Scene, Skeleton, Transform},
    retarget::{Stack, parse_spec, resolve},
    rig::Rig,
    samples,
};
use std::hint::black_box;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const REPETITIONS: usize = 30;
const FK: &str = r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#;
const DEFAULT: &str = "{}";
const SELF_CONTACT: &str = r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}, {"op": "contacts"}, {"op": "ik"}, {"op": "plant"},
    {"op": "floor"}, {"op": "self_contact"}]}"#;

/// The walk over and over; each time it goes on from where it got to.
fn long_walk(clip: &Clip) -> Clip {
    use retargetd::model::{JointTracks, Track};
    let onward = |track: &Track<Vec3>| match track {
        Track::Sampled(values) => {
            let way = *values.last().expect("frames") - values[0];
            let again = |time: usize| values.iter().map(move |value| *value + way * time as f32);
            Track::Sampled((0..REPETITIONS).flat_map(again).collect())
        }
        other => other.clone(),
    };
    fn repeat<T: Copy>(track: &Track<T>) -> Track<T> {
        match track {
            Track::Sampled(values) => Track::Sampled(values.repeat(REPETITIONS)),
            other => other.clone(),
        }
    }
    let tracks = clip.joints().iter().map(|joint| JointTracks {
        translation: onward(&joint.translation),
        rotation: repeat(&joint.rotation),
        scale: repeat(&joint.scale),
    });
    let times = (0..clip.frame_count() * REPETITIONS).map(|frame| frame as f64 / 30.0).collect();
    Clip::new("walk".into(), times, tracks.collect()).expect("a valid clip")
}

/// The same skeleton with longer legs.
fn longer_legs(skeleton: &Skeleton) -> Skeleton {
    let joints = skeleton.joints().iter().map(|joint| {
        let factor = if joint.name.contains("Leg") || joint.name.contains("Foot") { 1.2 } else { 1.0 };
        let rest = Transform { translation: joint.rest.translation * DVec3::splat(factor), ..joint.rest };
        Joint { rest, ..joint.clone() }
    });
    Skeleton::new(joints.collect()).expect("the same order")
}

fn stack(criterion: &mut Criterion) {
    let source = samples::walk_scene();
    let clip = long_walk(&source.clips[0]);
    let target = Scene {
        skeleton: longer_legs(&source.skeleton),
        axes: source.axes,
        unit_meters: source.unit_meters,
        ..Scene::default()
    };
    let mut reporter = Reporter::new();
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let two_threads = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a pool");
    let control = Control::new();
    let mut group = criterion.benchmark_group("stack");
    group.throughput(Throughput::Elements(clip.frame_count() as u64));
    for (name, spec) in [("fk", FK), ("default", DEFAULT), ("self_contact", SELF_CONTACT)] {
        let spec = parse_spec(spec.as_bytes()).expect("a spec");
        let source_rig = Rig::new("source", &source, None, &spec.source, &mut reporter).expect("a rig");
        let target_rig = Rig::new("target", &target, None, &spec.target, &mut reporter).expect("a rig");
        let resolved = resolve(&spec, &source_rig, &target_rig, &clip, &mut reporter).expect("it maps");
        let stack = Stack::new(&source.skeleton, &target.skeleton, &resolved.mapping, &resolved.ops);
        for (threads, pool) in [("one_thread", &one_thread), ("two_threads", &two_threads)] {
            group.bench_function(format!("{name}_{threads}"), |bencher| {
                bencher.iter(|| pool.install(|| black_box(stack.run(&clip, &control).expect("it runs"))));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, stack);
criterion_main!(benches);
