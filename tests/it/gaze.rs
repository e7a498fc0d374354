//! Gaze: from eye joints to shapes and back, on real avatars.

use glam::{DQuat, DVec3};
use retargetd::{
    editing::{Gaze, Look},
    engine::{self, Inputs, Limits, NamedBytes},
    formats::{self, Format, TargetClips, WriteOptions},
    model::{Clip, Control, JointTracks, LookAt, MorphTrack, Reporter, Scene, Track},
    retarget::RetargetSpec,
    rig::Rig,
};

use crate::support::corpus_file;

const FRAMES: usize = 11;

fn read(name: &str) -> Option<(Vec<u8>, Scene)> {
    let bytes = std::fs::read(corpus_file(name)?).expect("the file");
    let scene = crate::quality::figure::read_scene(&bytes, name);
    Some((bytes, scene))
}

fn rig(scene: &Scene) -> Rig<'_> {
    Rig::new("source", scene, None, &RetargetSpec::default().source, &mut Reporter::new()).expect("a rig")
}

fn still(scene: &Scene) -> Clip {
    let tracks = vec![JointTracks::default(); scene.skeleton.len()];
    Clip::new("look".into(), (0..FRAMES).map(|frame| frame as f64 / 30.0).collect(), tracks).expect("a clip")
}

fn written(scene: &Scene, clip: &Clip) -> Vec<u8> {
    let options = WriteOptions { target_clips: TargetClips::Drop, ..WriteOptions::new(Format::Glb) };
    formats::write(scene, clip, &options, &Control::new(), &mut Reporter::new()).expect("it is written")
}

fn retargeted(source: &[u8], target: (&str, &[u8])) -> (Scene, Vec<(&'static str, String)>) {
    let inputs = Inputs {
        source: NamedBytes { name: "source.glb", bytes: source },
        target: NamedBytes { name: target.0, bytes: target.1 },
        source_rest: None,
        target_rest: None,
        config: None,
        formats: &[],
    };
    let outcome = engine::retarget(&inputs, &Limits::default(), &Control::new()).expect("an outcome");
    let warnings = outcome.report.warnings.iter().map(|warning| (warning.code, warning.detail.clone())).collect();
    (crate::quality::figure::read_scene(&outcome.outputs[0].bytes, "out.glb"), warnings)
}

/// A clip in which both eyes turn to the figure's left, from ahead to so many degrees, by hand: about the vertical of the model.
fn looking_left(scene: &Scene, degrees: f64) -> Option<Clip> {
    let rig = rig(scene);
    let mut joints = still(scene).joints().to_vec();
    for role in ["left_eye", "right_eye"] {
        let eye = *rig.role(role).first()?;
        let above = scene.skeleton.parent(eye).map_or(DQuat::IDENTITY, |parent| rig.rest.transforms()[parent].rotation);
        let own = rig.rest.transforms()[eye].rotation;
        let turned = (0..FRAMES).map(|frame| {
            let angle = (degrees * frame as f64 / (FRAMES - 1) as f64).to_radians();
            (above.conjugate() * DQuat::from_axis_angle(DVec3::Y, angle) * own).normalize().as_quat()
        });
        joints[eye].rotation = Track::Sampled(turned.collect());
    }
    still(scene).with_joints(joints).ok()
}

#[test]
fn eyes_that_turn_are_looks() {
    let Some((_, scene)) = read("readyplayerme/rpm_avatar_a.glb") else { return };
    let clip = looking_left(&scene, 20.0).expect("an avatar with eyes");
    let rig = rig(&scene);
    let gaze = Gaze::of_eyes(&rig, &clip).expect("they move");
    for (frame, looks) in gaze.frames.iter().enumerate() {
        for look in looks {
            let wanted = 20.0 * frame as f64 / (FRAMES - 1) as f64;
            assert!((look.yaw.to_degrees() - wanted).abs() < 1e-3, "frame {frame}: {} degrees", look.yaw.to_degrees());
            assert!(look.pitch.abs() < 1e-5, "frame {frame}: level");
        }
    }
    assert_eq!(Gaze::of_eyes(&rig, &still(&scene)), None, "eyes that rest say nothing");
    let up = Gaze { frames: vec![[Look { yaw: -0.1, pitch: 0.2 }, Look { yaw: 0.15, pitch: -0.05 }]; FRAMES] };
    let turned = up.onto_eyes(&rig, &still(&scene)).expect("a clip").expect("it has eyes");
    let back = Gaze::of_eyes(&rig, &turned).expect("they move");
    for (ours, wanted) in back.frames.iter().flatten().zip(up.frames.iter().flatten()) {
        assert!((ours.yaw - wanted.yaw).abs() < 1e-5 && (ours.pitch - wanted.pitch).abs() < 1e-5, "{ours:?}");
    }
}

#[test]
fn looks_become_weights_and_weights_looks() {
    let range = LookAt::default();
    let gaze = Gaze { frames: vec![[Look { yaw: 0.3, pitch: 0.2 }, Look { yaw: 0.3, pitch: 0.2 }]] };
    let weights = gaze.weights(&range);
    let of = |name: &str| weights.iter().find(|(known, _)| *known == name).expect("a shape").1[0];
    let share = (0.3_f64.to_degrees() / 30.0) as f32;
    for (name, wanted) in [
        ("lookLeft", share),
        ("lookRight", 0.0),
        ("eyeLookOutLeft", share),
        ("eyeLookInRight", share),
        ("eyeLookInLeft", 0.0),
        ("eyeLookOutRight", 0.0),
        ("lookUp", (0.2_f64.to_degrees() / 25.0) as f32),
        ("lookDown", 0.0),
    ] {
        assert!((of(name) - wanted).abs() < 1e-6, "{name}: {} for {wanted}", of(name));
    }
}

#[test]
fn eyes_of_an_avatar_move_a_vrm_that_looks_by_shapes() {
    let (Some((_, source)), Some((target, _))) = (read("readyplayerme/rpm_avatar_a.glb"), read("vrm0/godette.vrm"))
    else {
        return;
    };
    let clip = looking_left(&source, 6.0).expect("an avatar with eyes");
    let (made, _) = retargeted(&written(&source, &clip), ("godette.vrm", &target));
    let clip = &made.clips[0];
    let look = made.morphs.iter().find(|morph| morph.name == "lookLeft").expect("its expression");
    let retargetd::model::MorphPlace::Expression(binds) = &look.place else { panic!("an expression: {look:?}") };
    let (shape, share) = binds[0];
    let track = clip.morphs().iter().find(|track| track.morph == shape).expect("its shape moves");
    for frame in 0..FRAMES {
        // The avatar's lookAt: 90 degrees outward are 7.1.
        let wanted = 6.0 * frame as f32 / (FRAMES - 1) as f32 / 90.0 * 7.1 * share;
        let weight = track.weights.at(frame, 0.0);
        assert!((weight - wanted).abs() < 2e-3, "frame {frame}: {weight} where lookAt says {wanted}");
    }
}

#[test]
fn shapes_that_look_turn_the_eyes_of_a_vrm_that_looks_by_joints() {
    let (Some((_, source)), Some((target, _))) = (read("readyplayerme/rpm_avatar_a.glb"), read("vrm1/debug_robot.vrm"))
    else {
        return;
    };
    // An avatar without moving eyes, two of whose shapes are called as ARKit does.
    let mut source = source;
    let names = [("viseme_PP", "eyeLookOutLeft"), ("viseme_FF", "eyeLookInRight")];
    for morph in &mut source.morphs {
        if let Some((_, name)) = names.iter().find(|(old, _)| morph.name == *old) {
            morph.name = (*name).to_owned();
        }
    }
    let rising = || Track::Sampled((0..FRAMES).map(|frame| frame as f32 / (FRAMES - 1) as f32).collect());
    let looks = (0..source.morphs.len()).filter(|morph| source.morphs[*morph].name.starts_with("eyeLook"));
    let tracks: Vec<MorphTrack> = looks.map(|morph| MorphTrack { morph, weights: rising() }).collect();
    assert!(!tracks.is_empty(), "the avatar has those shapes");
    let clip = still(&source).with_morphs(tracks).expect("a clip");
    let gaze = Gaze::of_morphs(&clip, &source.morphs, &LookAt::default()).expect("it looks");
    let target = crate::quality::figure::read_scene(&target, "debug_robot.vrm");
    let rig = rig(&target);
    let turned = gaze.onto_eyes(&rig, &still(&target)).expect("a clip").expect("it has eyes");
    let back = Gaze::of_eyes(&rig, &turned).expect("they turn");
    let last = back.frames[FRAMES - 1];
    for look in last {
        assert!((look.yaw.to_degrees() - 30.0).abs() < 0.1, "a shape at 1 looks as far as eyes can: {look:?}");
    }
}

#[test]
fn the_gaze_of_a_vrm_animation_turns_eyes() {
    let (Some((_, animation)), Some((_, avatar))) = (read("vrma/test_small.vrma"), read("vrm1/debug_robot.vrm")) else {
        return;
    };
    let joint = animation.gaze_joint.expect("it has a gaze");
    let turn =
        |frame: usize| DQuat::from_rotation_y(0.02 * frame as f64) * DQuat::from_rotation_x(-0.01 * frame as f64);
    let mut joints = still(&animation).joints().to_vec();
    joints[joint].rotation = Track::Sampled((0..FRAMES).map(|frame| turn(frame).as_quat()).collect());
    let clip = still(&animation).with_joints(joints).expect("a clip");
    let gaze = Gaze::of_gaze_joint(&rig(&animation), &clip).expect("it moves");
    let rig = rig(&avatar);
    let turned = gaze.onto_eyes(&rig, &still(&avatar)).expect("a clip").expect("it has eyes");
    let last = Gaze::of_eyes(&rig, &turned).expect("they turn").frames[FRAMES - 1];
    for look in last {
        assert!((look.yaw - 0.2).abs() < 1e-4 && (look.pitch - 0.1).abs() < 1e-4, "left and up: {look:?}");
    }
    assert_eq!(gaze.onto_eyes(&rig, &turned).expect("a clip"), None, "eyes that turn already are left alone");
}
