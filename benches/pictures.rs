//! Pictures of a figure of 50,000 triangles on two joints, at 512 by 512 pixels with four samples each.
//!
//! The figure is a tube that bends, made here. What drawing a frame takes is `still` without `png_alone`.

#![allow(missing_docs, reason = "criterion's macros make undocumented items")]
#![allow(clippy::print_stderr, reason = "the sizes of the files are figures, too")]

use std::{hint::black_box, time::Duration};

use criterion::{Criterion, criterion_group, criterion_main};
use glam::{DVec3, Mat4, Quat, Vec3};
use retargetd::{
    model::{
        Appearance, Carrier, Clip, Control, FourInfluences, Joint, JointTracks, Paint, Skeleton, Surface, Track,
        Transform,
    },
    picture::{CameraKind, Cast, Figure, PictureFormat, Subject, View, read_picture, render, write_png},
};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const RINGS: usize = 250;
const SIDES: usize = 100;
/// Two seconds at 30 frames per second.
const FRAMES: usize = 60;

/// A tube 2 m high, the upper half on a joint of its own.
fn tube() -> Figure {
    let (mut positions, mut normals, mut influences) = (Vec::new(), Vec::new(), Vec::new());
    for ring in 0..=RINGS {
        let up = ring as f32 / RINGS as f32;
        for side in 0..=SIDES {
            let (sine, cosine) = (side as f32 / SIDES as f32 * std::f32::consts::TAU).sin_cos();
            let radius = 0.25 + 0.05 * (up * 20.0).sin();
            positions.push(Vec3::new(radius * cosine, 2.0 * up, radius * sine));
            normals.push(Vec3::new(cosine, 0.0, sine));
            let share = ((up - 0.4) * 5.0).clamp(0.0, 1.0);
            influences.push(FourInfluences { joints: [0, 1, 0, 0], shares: [1.0 - share, share, 0.0, 0.0] });
        }
    }
    let corner = |ring: usize, side: usize| (ring * (SIDES + 1) + side) as u32;
    let quad = |ring: usize, side: usize| {
        let [a, b, c, d] =
            [corner(ring, side), corner(ring, side + 1), corner(ring + 1, side + 1), corner(ring + 1, side)];
        [a, c, b, a, d, c]
    };
    let indices = (0..RINGS).flat_map(|ring| (0..SIDES).flat_map(move |side| quad(ring, side))).collect();
    let joints = vec![(0, Mat4::IDENTITY), (1, Mat4::from_translation(Vec3::new(0.0, -1.0, 0.0)))];
    let surface = Surface {
        positions,
        normals,
        texture_coordinates: Vec::new(),
        colors: Vec::new(),
        indices,
        paint: Some(0),
        carrier: Carrier::Skin { joints, influences: vec![influences] },
        shapes: Vec::new(),
    };
    let appearance = Appearance { surfaces: vec![surface], paints: vec![Paint::default()], images: Vec::new() };
    assert_eq!(appearance.triangle_count(), 50_000, "what the figures are about");
    Figure::new(appearance).expect("a figure").0
}

fn skeleton() -> Skeleton {
    let joint = |name: &str, parent: Option<usize>, height: f64, node: usize| Joint {
        name: name.into(),
        parent,
        rest: Transform { translation: DVec3::new(0.0, height, 0.0), ..Transform::IDENTITY },
        is_joint: true,
        node,
    };
    Skeleton::new(vec![joint("lower", None, 0.0, 0), joint("upper", Some(0), 1.0, 1)]).expect("parents first")
}

/// The upper joint bends forward and back.
fn bending() -> Clip {
    let times: Vec<f64> = (0..FRAMES).map(|frame| frame as f64 / 30.0).collect();
    let bent = |frame: usize| Quat::from_rotation_x(0.6 * (frame as f32 / FRAMES as f32 * std::f32::consts::TAU).sin());
    let upper = JointTracks { rotation: Track::Sampled((0..FRAMES).map(bent).collect()), ..JointTracks::default() };
    Clip::new("bend".into(), times, vec![JointTracks::default(), upper]).expect("a clip")
}

fn pictures(criterion: &mut Criterion) {
    let (figure, skeleton, clip) = (tube(), skeleton(), bending());
    let bones = Figure::new(Appearance::default()).expect("nothing").0;
    let subject = Subject {
        name: String::new(),
        figure: &figure,
        bones: &bones,
        skeleton: &skeleton,
        clip: Some(&clip),
        rest_weights: Vec::new(),
        shown_joints: vec![0, 1],
        root: Some(0),
        picture_from_scene: Mat4::IDENTITY,
        units_per_meter: Some(1.0),
        floor: Some(0.0),
    };
    let (cast, control) = (Cast::alone(&subject), Control::new());
    let film = |view: &View, format| render(&cast, view, format, &control).expect("a film");
    let (still, turntable) = (View::default(), View { camera: CameraKind::Orbit, ..View::default() });
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let two_threads = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a pool");

    let mut group = criterion.benchmark_group("pictures");
    group.sample_size(20).measurement_time(Duration::from_secs(10));
    group.bench_function("still", |bencher| {
        one_thread.install(|| bencher.iter(|| black_box(film(&still, PictureFormat::Png))));
    });
    let picture = read_picture(&film(&still, PictureFormat::Png).bytes).expect("readable");
    group.bench_function("png_alone", |bencher| bencher.iter(|| black_box(write_png(&picture).expect("writable"))));
    for (name, format) in [("webp", PictureFormat::Webp), ("gif", PictureFormat::Gif)] {
        eprintln!("{name}: {} bytes, {FRAMES} frames", film(&turntable, format).bytes.len());
        for (threads, pool) in [("one_thread", &one_thread), ("two_threads", &two_threads)] {
            group.bench_function(format!("{name}_turntable_{threads}"), |bencher| {
                pool.install(|| bencher.iter(|| black_box(film(&turntable, format))));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, pictures);
criterion_main!(benches);
