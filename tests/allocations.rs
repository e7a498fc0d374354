//! A retarget allocates for its tracks and for its stages, never for a frame. A test of its own, because a program has one
//! allocator only.

#![expect(unsafe_code, reason = "whoever counts what an allocator is asked for has to be one")]

use glam::Vec3;
use std::{
    alloc::{GlobalAlloc, Layout, System},
    sync::atomic::{AtomicUsize, Ordering},
};

use retargetd::{
    model::{Clip, Control, JointTracks, Reporter, Track},
    retarget::{Stack, parse_spec, resolve},
    rig::Rig,
    samples,
};

struct Counting;

static COUNT: AtomicUsize = AtomicUsize::new(0);

// SAFETY: everything is handed on to the system's allocator as it comes.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller promises a layout that is not empty.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the pointer came from `alloc` with this layout.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// More than this per frame is an allocation in the loop; a chunk of hundreds of frames may take a few.
const MAX_PER_FRAME: f64 = 0.2;

/// The walk over and over; each time it goes on from where it got to.
fn repeated(clip: &Clip, times: usize) -> Clip {
    let onward = |track: &Track<Vec3>| match track {
        Track::Sampled(values) => {
            let way = *values.last().expect("frames") - values[0];
            Track::Sampled(
                (0..times).flat_map(|time| values.iter().map(move |value| *value + way * time as f32)).collect(),
            )
        }
        other => other.clone(),
    };
    fn repeat<T: Copy>(track: &Track<T>, times: usize) -> Track<T> {
        match track {
            Track::Sampled(values) => Track::Sampled(values.repeat(times)),
            other => other.clone(),
        }
    }
    let tracks = clip.joints().iter().map(|joint| JointTracks {
        translation: onward(&joint.translation),
        rotation: repeat(&joint.rotation, times),
        scale: repeat(&joint.scale, times),
    });
    let seconds = (0..clip.frame_count() * times).map(|frame| frame as f64 / 30.0).collect();
    Clip::new("walk".into(), seconds, tracks.collect()).expect("a valid clip")
}

#[test]
fn no_frame_allocates() {
    let (source, target) = (samples::walk_scene(), samples::mannequin_scene());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let all = r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}, {"op": "contacts"}, {"op": "ik"}, {"op": "plant"}, {"op": "floor"},
        {"op": "arm_clearance"}, {"op": "hand_contact"}, {"op": "self_contact"}, {"op": "filter"}]}"#;
    for text in [r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#, "{}", all] {
        let spec = parse_spec(text.as_bytes()).expect("a spec");
        let mut reporter = Reporter::new();
        let source_rig = Rig::new("source", &source, None, &spec.source, &mut reporter).expect("a rig");
        let target_rig = Rig::new("target", &target, None, &spec.target, &mut reporter).expect("a rig");
        let count = |times: usize| {
            let clip = repeated(&source.clips[0], times);
            let resolved = resolve(&spec, &source_rig, &target_rig, &clip, &mut Reporter::new()).expect("it maps");
            let stack = Stack::new(source_rig.skeleton(), target_rig.skeleton(), &resolved.mapping, &resolved.ops);
            let control = Control::new();
            let before = COUNT.load(Ordering::Relaxed);
            let result = pool.install(|| stack.run(&clip, &control)).expect("it runs");
            let counted = COUNT.load(Ordering::Relaxed) - before;
            (result.clip.frame_count(), counted)
        };
        let (few, many) = (count(4), count(20));
        let per_frame = many.1.saturating_sub(few.1) as f64 / (many.0 - few.0) as f64;
        assert!(per_frame < MAX_PER_FRAME, "{text}: {per_frame:.3} allocations per frame: {few:?}, {many:?}");
    }
}
