//! Files and configs to begin with, all made by code: every format, and in them what readers treat on its own.

mod bvh;
mod config;
mod drawings;
mod fbx;
mod gltf;
mod image;
mod numpy;

use retargetd::{
    engine::{self, EditInputs, NamedBytes},
    formats::{self, Compression, Format, Limits, WriteOptions},
    model::{Clip, Control, Joint, JointTracks, Reporter, Scene, Skeleton, Track},
    picture::{Picture, write_png},
    samples,
};

use super::{
    Target,
    container::{Part, archive},
};

/// A file, and a name for it.
pub(crate) type Seed = (String, Vec<u8>);

/// Frames of the walk that are kept.
const FRAMES: usize = 4;
/// Words in the names of joints that are left out: fingers of both sample figures.
const LEFT_OUT: [&str; 10] = ["Thumb", "Index", "Middle", "Ring", "Pinky", "thumb", "index", "middle", "ring", "pinky"];

/// What the fuzzer begins with.
pub(crate) fn seeds(target: Target) -> Vec<Seed> {
    match target {
        Target::Fbx => fbx::all(),
        Target::Glb => glbs(),
        Target::Gltf => documents(),
        Target::Vrma => vec![("made".to_owned(), gltf::vrm_animation()), ("walk".to_owned(), humanoid_clip())],
        Target::Zip => archives(),
        Target::PosesNpz => {
            [written("walk", Format::PosesNpz, Compression::None)].into_iter().chain(numpy::poses()).collect()
        }
        Target::PosesJson => {
            let small = br#"{"joint_names": ["a", "b"], "parents": [-1, 0], "rest_translations": [[0,0,0],[0,1,0]], "times": [0, 0.5],
                "rotations": [[[0,0,0,1],[0,0,0,1]],[[0,1,0,0],[0,0,0,1]]], "morph_names": ["smile"], "morph_weights": [[0],[1]],
                "contact_joints": ["b"], "contacts": [[0],[1]], "meta": {"name": "n", "fps": 2, "axes": "+z-y", "unit": 0.01}}"#;
            [written("walk", Format::PosesJson, Compression::None), ("small".to_owned(), small.to_vec())].into()
        }
        Target::BodyModel => numpy::body_models(),
        Target::JointPositions => numpy::joint_positions(),
        Target::Bvh => [written("walk", Format::Bvh, Compression::None)].into_iter().chain(bvh::dialects()).collect(),
        Target::Image => image::all(),
        Target::Annotation => vec![("figure".to_owned(), drawn_figure())],
        Target::Sniff => sniffed(),
        Target::Engine => {
            let mut all = vec![("clip".to_owned(), clip()), ("figure".to_owned(), figure())];
            all.extend(sniffed());
            all
        }
        Target::Spec | Target::Retarget | Target::Proposal => config::all(),
        Target::RigTemplate => config::rig_templates(),
        Target::Edit => config::edits(),
        Target::Pose => config::poses(),
        Target::Drawing => drawings::all(),
        Target::Draw => drawings::configs(),
    }
}

pub(crate) use drawings::small as drawing;

/// The first steps of the sample walk, without fingers.
pub(crate) fn clip() -> Vec<u8> {
    written("walk", Format::Glb, Compression::None).1
}

/// A figure of a few strokes.
///
/// # Panics
/// When it cannot be encoded.
pub(crate) fn drawn_figure() -> Vec<u8> {
    let (width, height) = (40, 52);
    let is_drawn = |column: i32, row: i32| {
        let head = (column - 20).pow(2) + (row - 10).pow(2);
        let arm = (6..35).contains(&column) && (20..23).contains(&row);
        let trunk = (19..22).contains(&column) && (16..34).contains(&row);
        let leg = (33..50).contains(&row) && ((column - 20).abs() - (row - 33) / 2).abs() < 2;
        head <= 49 || arm || trunk || leg
    };
    let gray = |pixel: i32| if is_drawn(pixel % width, pixel / width) { 30 } else { 230 };
    let pixels = (0..width * height).map(|pixel| [gray(pixel), gray(pixel), gray(pixel), 255]).collect();
    write_png(&Picture { width: width as usize, height: height as usize, pixels }).expect("it can be encoded")
}

/// The sample figure without mesh and fingers.
pub(crate) fn figure() -> Vec<u8> {
    write(&without_fingers(samples::mannequin_scene()), Format::Glb, Compression::None)
}

/// The clip as an animation of a humanoid.
///
/// # Panics
/// When the sample is not recognized.
fn humanoid_clip() -> Vec<u8> {
    let clip = clip();
    let source = NamedBytes { name: "clip.glb", bytes: &clip };
    let inputs = EditInputs { source, source_rest: None, unread_target: false, config: None, formats: &[Format::Vrma] };
    let outcome = engine::edit(&inputs, &Limits::default(), &Control::new()).expect("the sample is a humanoid");
    outcome.outputs.into_iter().map(|output| output.bytes).next().unwrap_or_default()
}

/// One of each format.
fn sniffed() -> Vec<Seed> {
    let readers = Target::ALL.into_iter().take_while(|target| *target != Target::Sniff);
    readers
        .flat_map(|target| {
            seeds(target).into_iter().take(2).map(move |(name, bytes)| (format!("{}_{name}", target.name()), bytes))
        })
        .collect()
}

fn glbs() -> Vec<Seed> {
    let mut all: Vec<Seed> = [Compression::None, Compression::Quantized, Compression::Meshopt]
        .map(|compression| written(&format!("walk_{compression:?}"), Format::Glb, compression))
        .into();
    all.extend(gltf::documents().into_iter().map(|(name, document)| (name, document.into_glb())));
    all
}

fn documents() -> Vec<Seed> {
    let mut all: Vec<Seed> =
        gltf::documents().into_iter().map(|(name, document)| (name, document.into_json())).collect();
    all.push(written("walk", Format::Gltf, Compression::Meshopt));
    all
}

fn archives() -> Vec<Seed> {
    let mut all = vec![written("walk", Format::Zip, Compression::None)];
    let (json, binary) = gltf::features().into_two("part%20one.bin");
    let parts =
        [Part::new("a/model.gltf", &json), Part::new("a/part one.bin", &binary), Part::new("a/b.png", b"no image")];
    all.push(("beside".to_owned(), archive(&parts)));
    all.push(("bvh".to_owned(), archive(&[Part::new("walk.bvh", &bvh::dialects()[0].1)])));
    let inner = archive(&[Part::new("x.bvh", b"HIERARCHY")]);
    all.push(("archive_in_archive".to_owned(), archive(&[Part::new("x.zip.glb", &inner)])));
    all
}

fn written(name: &str, format: Format, compression: Compression) -> Seed {
    (name.to_owned(), write(&without_fingers(samples::walk_scene()), format, compression))
}

/// # Panics
/// When a sample cannot be written.
fn write(scene: &Scene, format: Format, compression: Compression) -> Vec<u8> {
    let still = || JointTracks { rotation: Track::Rest, ..JointTracks::default() };
    let still = || Clip::new("still".to_owned(), vec![0.0], (0..scene.skeleton.len()).map(|_| still()).collect());
    let clip = scene.clips.first().cloned().map_or_else(still, Ok).expect("a clip of one frame");
    let options = WriteOptions { compression, ..WriteOptions::new(format) };
    formats::write(scene, &clip, &options, &Control::new(), &mut Reporter::new()).expect("samples can be written")
}

/// # Panics
/// When what is left is no skeleton.
fn without_fingers(scene: Scene) -> Scene {
    let kept: Vec<usize> = (0..scene.skeleton.len())
        .filter(|joint| !LEFT_OUT.iter().any(|word| scene.skeleton.joints()[*joint].name.contains(word)))
        .collect();
    let new_index = |joint: usize| kept.iter().position(|kept| *kept == joint);
    let joints = kept.iter().enumerate().map(|(node, joint)| {
        let joint = scene.skeleton.joints()[*joint].clone();
        Joint { parent: joint.parent.and_then(new_index), node, ..joint }
    });
    let skeleton = Skeleton::new(joints.collect()).expect("parents are before their children as they were");
    let clips = scene.clips.iter().map(|clip| {
        let tracks = kept.iter().map(|joint| {
            let tracks = &clip.joints()[*joint];
            JointTracks {
                translation: begun(&tracks.translation),
                rotation: begun(&tracks.rotation),
                scale: begun(&tracks.scale),
            }
        });
        let times = clip.times_seconds().iter().take(FRAMES).copied().collect();
        Clip::new(clip.name().to_owned(), times, tracks.collect()).expect("a clip that is only shorter")
    });
    Scene { skeleton, clips: clips.collect(), axes: scene.axes, unit_meters: scene.unit_meters, ..Scene::default() }
}

fn begun<T: Copy>(track: &Track<T>) -> Track<T> {
    match track {
        Track::Rest => Track::Rest,
        Track::Constant(value) => Track::Constant(*value),
        Track::Sampled(values) => Track::Sampled(values.iter().take(FRAMES).copied().collect()),
    }
}
