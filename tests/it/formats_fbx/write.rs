//! FBX as it is written, read back by ourselves and by the parser.

use glam::{DQuat, DVec3, Quat, Vec3};
use retargetd::{
    formats::{self, Format, Limits, TargetClips, WriteOptions},
    model::{Axes, Clip, Control, Joint, JointTracks, MorphTrack, Reporter, Scene, Skeleton, Track, Transform},
    samples,
};

use super::{
    made::{Document, deformer, node_id, number, shape, table, triangle, vector},
    records::{Record, Value},
};
use crate::support::corpus_file;

fn read(bytes: &[u8], format: Format) -> Scene {
    formats::read(bytes, format, &Limits::default(), &Control::new(), &mut Reporter::new()).expect("it can be read")
}

fn write(scene: &Scene, clip: &Clip) -> (Vec<u8>, Vec<&'static str>) {
    // The clip that is written is the scene's own already.
    let options = WriteOptions { target_clips: TargetClips::Drop, ..WriteOptions::new(Format::Fbx) };
    let mut reporter = Reporter::new();
    let bytes = formats::write(scene, clip, &options, &Control::new(), &mut reporter).expect("it can be written");
    (bytes, reporter.into_warnings().iter().map(|warning| warning.code).collect())
}

/// The largest distance, in meters, and angle, in degrees, between joints of the same name over all frames.
fn apart(one: &Scene, clip: &Clip, other: &Scene) -> (f64, f64) {
    let pairs: Vec<(usize, usize)> = (0..one.skeleton.len())
        .filter(|joint| one.skeleton.joints()[*joint].is_joint)
        .map(|joint| {
            let name = &one.skeleton.joints()[joint].name;
            (joint, other.skeleton.find(name).unwrap_or_else(|| panic!("'{name}' is there")))
        })
        .collect();
    let (mut farthest, mut widest) = (0.0_f64, 0.0_f64);
    for frame in 0..clip.frame_count() {
        let here = clip.local_pose(&one.skeleton, frame).to_model(&one.skeleton);
        let there = other.clips[0].local_pose(&other.skeleton, frame).to_model(&other.skeleton);
        for (joint, same) in &pairs {
            let (here, there) = (&here.transforms()[*joint], &there.transforms()[*same]);
            farthest = farthest.max(here.translation.distance(there.translation));
            widest = widest.max(here.rotation.angle_between(there.rotation).to_degrees());
        }
    }
    (farthest, widest)
}

#[test]
fn a_sample_comes_back_as_it_was() {
    let scene = read(&samples::walk_clip(), Format::Glb);
    let clip = &scene.clips[0];
    let (bytes, _) = write(&scene, clip);
    assert_eq!(formats::sniff(&bytes, "walk.fbx"), Ok(Format::Fbx));
    assert_eq!(bytes, write(&scene, clip).0, "the same every time");
    let back = read(&bytes, Format::Fbx);
    assert_eq!(back.clips.len(), 1, "one take");
    assert_eq!(back.clips[0].frame_count(), clip.frame_count(), "every frame");
    assert_eq!(back.clips[0].name(), clip.name(), "its name");
    let late = (back.clips[0].duration_seconds() - clip.duration_seconds()).abs();
    assert!(late < 1e-6, "{late} seconds longer");
    let (farthest, widest) = apart(&scene, clip, &back);
    assert!(farthest < 1e-5 && widest < 0.001, "{farthest} m and {widest} degrees apart");
}

#[test]
fn turning_on_and_on_makes_no_jump() {
    let rest = Transform {
        translation: DVec3::Y,
        rotation: DQuat::from_euler(glam::EulerRot::XYZ, 0.5, 1.4, -0.3),
        scale: DVec3::splat(2.0),
    };
    let joint = |name: &str, parent, rest| Joint { name: name.to_owned(), parent, rest, is_joint: true, node: 0 };
    let joints = vec![joint("root", None, rest), joint("tip: 1", Some(0), rest)];
    let skeleton = Skeleton::new(joints).expect("a skeleton");
    let turn = |frame: usize| {
        let about = DVec3::new(0.3, 1.0, 0.2).normalize();
        (DQuat::from_axis_angle(about, frame as f64 * 0.3) * rest.rotation).as_quat()
    };
    let tracks = JointTracks {
        translation: Track::Sampled((0..90).map(|frame| Vec3::X * frame as f32 * 0.1).collect()),
        rotation: Track::Sampled((0..90).map(turn).collect::<Vec<Quat>>()),
        scale: Track::Sampled((0..90).map(|frame| Vec3::splat(1.0 + frame as f32 * 0.01)).collect()),
    };
    let times = (0..90).map(|frame| f64::from(frame) / 30.0).collect();
    let clip = Clip::new("a \"b\" é".to_owned(), times, vec![tracks, JointTracks::default()]).expect("a clip");
    let scene = Scene { skeleton, axes: Some(Axes::default()), unit_meters: Some(1.0), ..Scene::default() };
    let back = read(&write(&scene, &clip).0, Format::Fbx);
    let (farthest, widest) = apart(&scene, &clip, &back);
    assert!(farthest < 1e-4 && widest < 0.01, "{farthest} m and {widest} degrees apart");
    assert_eq!(back.clips[0].name(), clip.name(), "whatever its letters");
}

#[test]
fn real_skeletons_come_back_as_they_were() {
    for file in ["unreal/mannequiny.glb", "mixamo/gltf/Xbot.glb"] {
        let Some(path) = corpus_file(file) else { continue };
        let scene = read(&std::fs::read(path).expect("a file"), Format::Glb);
        let clip = &scene.clips[0];
        let (bytes, warnings) = write(&scene, clip);
        assert!(warnings.contains(&"fbx_mesh_left_out"), "{file}: what is left out is said");
        let (farthest, widest) = apart(&scene, clip, &read(&bytes, Format::Fbx));
        assert!(farthest < 1e-4 && widest < 0.01, "{file}: {farthest} m and {widest} degrees apart");
    }
}

/// Skinned meshes of an FBX come back as they were: their polygons, and where every vertex lies about the joints that move it.
#[test]
fn real_meshes_come_back_as_they_were() {
    for file in [
        "mixamo/fbx/samba_dancing_skin.fbx",
        "mixamo/fbx/ybot_prerotation_skin.fbx",
        "mixamo/cc0/makehuman_mixamo_names_rest_leafbones.fbx",
    ] {
        let Some(path) = corpus_file(file) else { continue };
        let scene = read(&std::fs::read(path).expect("a file"), Format::Fbx);
        let clip = turning(&scene);
        let (bytes, warnings) = write(&scene, &clip);
        assert!(!warnings.contains(&"fbx_mesh_left_out"), "{file}: {warnings:?}");
        let back = read(&bytes, Format::Fbx);
        let (farthest, widest) = apart(&scene, &clip, &back);
        assert!(farthest < 1e-4 && widest < 0.01, "{file}: {farthest} m and {widest} degrees apart");
        assert_eq!(back.skeleton.len(), scene.skeleton.len(), "{file}: every node");
        assert_eq!(back.skins.len(), scene.skins.len(), "{file}: skins");
        for (one, other) in scene.skins.iter().zip(&back.skins) {
            assert_eq!((&one.name, one.most_influences), (&other.name, other.most_influences), "{file}");
            let names = |scene: &Scene, joints: &[usize]| -> Vec<String> {
                joints.iter().map(|joint| scene.skeleton.joints()[*joint].name.clone()).collect()
            };
            assert_eq!(names(&scene, &one.joints), names(&back, &other.joints), "{file}: bound joints");
        }
        let mut points = 0;
        for joint in 0..scene.skeleton.len() {
            let (here, there) = (scene.skin_points.of(joint), back.skin_points.of(joint));
            assert_eq!(here.len(), there.len(), "{file}: vertices of joint {joint}");
            points += here.len();
            for (one, other) in here.iter().zip(there) {
                assert!(one.position.distance(other.position) < 1e-5, "{file}: {one:?} is at {other:?}");
                assert!((one.weight - other.weight).abs() < 1e-5, "{file}: {one:?} weighs {other:?}");
            }
            let bind = |scene: &Scene| scene.bind_pose.get(joint).copied().flatten();
            assert_eq!(bind(&scene).is_some(), bind(&back).is_some(), "{file}: joint {joint} is bound");
            if let Some((one, other)) = bind(&scene).zip(bind(&back)) {
                assert!(one.translation.distance(other.translation) < 1e-5, "{file}: bound elsewhere");
            }
        }
        assert!(points > 1000, "{file}: {points} vertices");
    }
}

/// A clip of a few frames in which every joint turns.
pub(super) fn turning(scene: &Scene) -> Clip {
    let joints = scene.skeleton.joints().iter().enumerate().map(|(index, joint)| {
        let turn = |frame: usize| {
            let about = DVec3::new(1.0, index as f64 % 3.0, 0.5).normalize();
            (joint.rest.rotation * DQuat::from_axis_angle(about, frame as f64 * 0.05)).as_quat()
        };
        let rotation = if joint.is_joint { Track::Sampled((0..5).map(turn).collect()) } else { Track::Rest };
        JointTracks { rotation, ..JointTracks::default() }
    });
    Clip::new("turning".to_owned(), (0..5).map(|frame| f64::from(frame) / 30.0).collect(), joints.collect())
        .expect("a clip")
}

/// What lies on the materials of a file: material, property, name of the image, its bytes.
fn textures(bytes: &[u8]) -> Vec<(String, String, String, Vec<u8>)> {
    let file = ufbx::load_memory(bytes, ufbx::LoadOpts::default()).expect("the parser reads it");
    let mut found = Vec::new();
    for material in &file.materials {
        for on in &material.textures {
            let of_file = &on.texture;
            let image = of_file.relative_filename.to_string();
            found.push((
                material.element.name.to_string(),
                on.material_prop.to_string(),
                image,
                of_file.content.to_vec(),
            ));
        }
    }
    found.sort();
    found
}

/// A head with a mesh of one triangle that can smile, its material, and an image on that.
fn painted() -> Document {
    let named =
        |kind: &'static str, id: i64, name: &str| Record::new(kind).with(id).with(Value::Name(kind, name.to_owned()));
    let texture = named("Texture", 51, "Paint")
        .with("")
        .field("Type", "TextureVideoClip")
        .field("Version", 202)
        .field("FileName", "C:\\\\art\\\\paint.png")
        .field("RelativeFilename", "paint.png")
        .holding([table(&[vector("Scaling", [2.0, 2.0, 1.0])], 7400)]);
    let video = named("Video", 52, "Image")
        .with("Clip")
        .field("Type", "Clip")
        .field("Filename", "C:\\\\art\\\\paint.png")
        .field("RelativeFilename", "paint.png")
        .field("Content", Value::Bytes(b"not really a PNG".to_vec()));
    let material = named("Material", 50, "Skin")
        .with("")
        .field("Version", 102)
        .field("ShadingModel", "phong")
        .holding([table(&[vector("DiffuseColor", [0.8, 0.5, 0.25])], 7400)]);
    let channel = deformer(41, "Face.Smile", "BlendShapeChannel")
        .field("DeformPercent", 25.0)
        .field("FullWeights", Value::Numbers(vec![100.0]))
        .holding([table(&[number("DeformPercent", 25.0)], 7400)]);
    Document::chain(&[("Head", &[])])
        .node("Mask", "Mesh", Some(0), &[])
        .object(triangle(20), 20, node_id(1))
        .object(deformer(40, "Face", "BlendShape"), 40, 20)
        .object(channel, 41, 40)
        .object(shape(42), 42, 41)
        .object(material, 50, node_id(1))
        .object(video, 52, 51)
        .on_property(texture, 51, 50, "DiffuseColor")
}

#[test]
fn images_stay_on_their_materials() {
    let bytes = painted().binary_of(7400);
    let scene = read(&bytes, Format::Fbx);
    let before = textures(&bytes);
    assert_eq!(before.len(), 1, "as it was made");
    assert_eq!((&*before[0].2, &*before[0].3), ("paint.png", b"not really a PNG".as_slice()));
    let (written, warnings) = write(&scene, &turning(&scene));
    assert!(warnings.is_empty(), "nothing is lost: {warnings:?}");
    assert_eq!(textures(&written), before);
    let file = ufbx::load_memory(&written, ufbx::LoadOpts::default()).expect("the parser reads it");
    let material = &file.materials[0];
    let color = &material.fbx.diffuse_color;
    assert_eq!([color.value_vec4.x, color.value_vec4.y, color.value_vec4.z], [0.8, 0.5, 0.25]);
    let texture = color.texture.as_ref().expect("on its color");
    assert_eq!(texture.uv_transform.scale.x, 2.0, "as large as it was");
}

#[test]
fn images_of_real_files_stay_on_their_materials() {
    for file in ["readyplayerme/rpm_avatar.fbx", "biped/rocketbox_male_adult_01.fbx"] {
        let Some(path) = corpus_file(file) else { continue };
        let bytes = std::fs::read(path).expect("a file");
        let scene = read(&bytes, Format::Fbx);
        let (written, warnings) = write(&scene, &turning(&scene));
        let (before, after) = (textures(&bytes), textures(&written));
        assert!(before.len() > 1, "{file}: {before:?}");
        assert_eq!(after, before, "{file}: {warnings:?}");
    }
}

#[test]
fn faces_of_a_target_move() {
    let scene = read(&painted().binary_of(7400), Format::Fbx);
    let names: Vec<(&str, f32)> = scene.morphs.iter().map(|morph| (morph.name.as_str(), morph.rest)).collect();
    assert_eq!(names, [("Smile", 0.25)], "shapes that nothing moves are there to be moved");
    let weights = Track::Sampled(vec![0.0, 0.5, 1.0, 0.75, 0.25]);
    let clip = turning(&scene).with_morphs(vec![MorphTrack { morph: 0, weights: weights.clone() }]).expect("a clip");
    let (written, _) = write(&scene, &clip);
    let back = read(&written, Format::Fbx);
    assert_eq!(back.morphs, scene.morphs);
    let Track::Sampled(found) = &back.clips[0].morphs()[0].weights else { panic!("it moves") };
    let Track::Sampled(expected) = &weights else { panic!("it moves") };
    assert!(found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-6), "{found:?}");
    let file = ufbx::load_memory(&written, ufbx::LoadOpts::default()).expect("the parser reads it");
    let shape = file.blend_channels[0].target_shape.as_ref().expect("its shape");
    assert_eq!((shape.offset_vertices[0], shape.position_offsets[0].z), (1, 3.0), "and it is what it was");
}

#[test]
fn clips_of_the_target_follow_the_new_one() {
    let scene = samples::walk_scene();
    let clip = scene.clips[0].clone().renamed("new".to_owned());
    for format in [Format::Fbx, Format::Glb] {
        let target = Scene { payload: Default::default(), ..scene.clone() };
        let control = Control::new();
        let write = |options: &WriteOptions| {
            let bytes = formats::write(&target, &clip, options, &control, &mut Reporter::new()).expect("a file");
            let read = formats::read(&bytes, format, &Limits::default(), &control, &mut Reporter::new());
            read.expect("it reads").clips
        };
        let kept = write(&WriteOptions::new(format));
        let names: Vec<&str> = kept.iter().map(Clip::name).collect();
        assert_eq!(names, ["new", scene.clips[0].name()], "{format:?}: kept");
        assert_eq!(kept[0].frame_count(), kept[1].frame_count(), "{format:?}: whole");
        let dropped = write(&WriteOptions { target_clips: TargetClips::Drop, ..WriteOptions::new(format) });
        assert_eq!(dropped.len(), 1, "{format:?}: left out");
    }
}
