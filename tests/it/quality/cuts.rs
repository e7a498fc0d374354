//! Clips that are cut: what is on one side of a cut is as if the other one were not there.

use glam::Vec3;
use retargetd::{
    model::{Clip, JointTracks, Reporter, Scene, Track},
    retarget::{MetricName, RetargetSpec, StackResult, resolve},
    samples,
};

use super::figure::{measured_in_corpus, moved_with, position, rig_of, value, world};

/// Frames of the sample walk, which is no cycle then.
const FRAMES: usize = 80;

fn walk() -> Scene {
    let mut scene = samples::walk_scene();
    scene.clips = vec![scene.clips[0].section(0..FRAMES)];
    scene
}

/// The walk, with its rest pose as the first frame.
fn behind_rest_pose() -> Scene {
    let mut scene = walk();
    let clip = &scene.clips[0];
    let step = clip.times_seconds()[1] - clip.times_seconds()[0];
    let times = (0..=FRAMES).map(|frame| frame as f64 * step).collect();
    let joints = clip.joints().iter().zip(scene.skeleton.joints()).map(|(tracks, joint)| {
        let frames = || 0..FRAMES;
        let (place, turn) = (joint.rest.translation.as_vec3(), joint.rest.rotation.as_quat());
        let places = frames().map(|frame| tracks.translation.at(frame, place));
        let turns = frames().map(|frame| tracks.rotation.at(frame, turn));
        JointTracks {
            translation: Track::Sampled(std::iter::once(place).chain(places).collect()),
            rotation: Track::Sampled(std::iter::once(turn).chain(turns).collect()),
            scale: Track::Rest,
        }
    });
    scene.clips = vec![Clip::new("walk".into(), times, joints.collect()).expect("a clip")];
    scene
}

/// The walk, whose second half is so far to the side.
fn put_elsewhere(way: Vec3) -> Scene {
    let mut scene = walk();
    let mut joints = scene.clips[0].joints().to_vec();
    let hips = scene.skeleton.find("mixamorig:Hips").expect("a pelvis");
    let Track::Sampled(places) = &mut joints[hips].translation else { panic!("the pelvis moves") };
    places.iter_mut().skip(FRAMES / 2).for_each(|place| *place += way);
    scene.clips = vec![scene.clips[0].clone().with_joints(joints).expect("a clip")];
    scene
}

fn onto_mannequin(source: &Scene, spec: &str) -> StackResult {
    let target = samples::mannequin_scene();
    let (from, onto) = (rig_of("source", source), rig_of("target", &target));
    moved_with(&from, &onto, &serde_json::from_str(spec).expect("a spec"))
}

/// The largest distance of joints of the body between frames of two results on the mannequin, meters; the second one's is moved by a way.
fn apart(frames: impl Iterator<Item = [usize; 2]>, [one, other]: [&StackResult; 2], way: Vec3) -> f64 {
    let target = samples::mannequin_scene();
    let pelvis = target.skeleton.find("pelvis").expect("a pelvis");
    let of_frame = |[frame, same]: [usize; 2]| {
        let [one, other] =
            [(one, frame), (other, same)].map(|(result, frame)| world(&target.skeleton, Some((&result.clip, frame))));
        let joints = (0..target.skeleton.len()).filter(|joint| target.skeleton.is_ancestor_or_self(pelvis, *joint));
        joints.map(|joint| position(&one, joint).distance(position(&other, joint) + way.as_dvec3())).fold(0.0, f64::max)
    };
    frames.map(of_frame).fold(0.0, f64::max)
}

fn warnings(source: &Scene) -> Vec<String> {
    let target = samples::mannequin_scene();
    let (from, onto, mut reporter) = (rig_of("source", source), rig_of("target", &target), Reporter::new());
    resolve(&RetargetSpec::default(), &from, &onto, &source.clips[0], &mut reporter).expect("it maps");
    let told = reporter.warnings().iter().filter(|warning| warning.code == "clip_cut");
    told.map(|warning| warning.detail.clone()).collect()
}

#[test]
fn a_rest_pose_in_the_first_frame_changes_nothing_behind_it() {
    let (with, without) = (onto_mannequin(&behind_rest_pose(), "{}"), onto_mannequin(&walk(), "{}"));
    let most = apart((0..FRAMES).map(|frame| [frame + 1, frame]), [&with, &without], Vec3::ZERO);
    // Soles of the rest pose say where the floor is, too.
    assert!(most < 0.005, "{most} m");
    let told = warnings(&behind_rest_pose());
    assert!(told.len() == 1 && told[0].contains("from frame 0 to frame 1"), "{told:?}");
    assert!(warnings(&walk()).is_empty());
}

#[test]
fn a_figure_that_is_put_elsewhere_is_moved_as_it_was() {
    let way = Vec3::new(3.0, 0.0, 0.0);
    let (source, scale) = (put_elsewhere(way), 0.5);
    let (result, other) = (onto_mannequin(&source, "{}"), onto_mannequin(&put_elsewhere(way * (1.0 + scale)), "{}"));
    let half = FRAMES / 2;
    assert_eq!(apart((0..half).map(|frame| [frame; 2]), [&result, &other], Vec3::ZERO), 0.0, "before the cut");
    let pelvis = |result: &StackResult| {
        let target = samples::mannequin_scene();
        let joint = target.skeleton.find("pelvis").expect("a pelvis");
        position(&world(&target.skeleton, Some((&result.clip, half))), joint)
    };
    let moved = (pelvis(&result) - pelvis(&other)).as_vec3();
    assert!(moved.length() > 1.0, "by {moved}");
    let most = apart((half..FRAMES).map(|frame| [frame; 2]), [&result, &other], moved);
    assert!(most < 1e-5, "behind the cut all is moved by the same way, but for {most} m");
    for track in &result.contacts {
        assert_eq!(track.touches.len(), FRAMES);
        assert!(!(track.touches[half - 1] && track.touches[half]), "{} does not stand on both sides", track.point);
    }
}

#[test]
fn frames_of_the_config_are_those_of_the_whole_clip() {
    let stack = |more: &str| {
        format!(
            r#"{{"ops": [{{"op": "pelvis"}}, {{"op": "fk"}}, {{"op": "contacts"}}, {{"op": "ik"}}, {{"op": "plant"}}{more}]}}"#
        )
    };
    let source = put_elsewhere(Vec3::new(3.0, 0.0, 0.0));
    let turned = r#", {"op": "additive_pose", "degrees": {"neck": [0, 0, 20]}, "frames": [50, 60]}"#;
    let [plain, turned] = ["", turned].map(|more| onto_mannequin(&source, &stack(more)));
    let is_changed = |frame: usize| apart(std::iter::once([frame; 2]), [&plain, &turned], Vec3::ZERO) > 1e-3;
    let changed: Vec<usize> = (0..FRAMES).filter(|frame| is_changed(*frame)).collect();
    assert_eq!(changed, (50..=60).collect::<Vec<usize>>());
}

/// The way of a figure is counted from the first frame of the clip, on both sides of a cut.
#[test]
fn a_root_goes_along_with_a_figure_that_is_put_elsewhere() {
    let source = put_elsewhere(Vec3::new(3.0, 0.0, 0.0));
    let result = onto_mannequin(
        &source,
        r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}, {"op": "contacts"}, {"op": "root_motion", "action": "extract"}]}"#,
    );
    let target = samples::mannequin_scene();
    let root = target.skeleton.find("root").expect("a root");
    let place = |frame: usize| position(&world(&target.skeleton, Some((&result.clip, frame))), root);
    let jump = place(FRAMES / 2).distance(place(FRAMES / 2 - 1));
    assert!(jump > 1.0, "the root is put elsewhere, too: it goes {jump} m");
}

/// A capture whose first frame is a rest pose a meter below the others.
#[test]
fn knees_of_a_real_capture_do_not_fall_out_of_its_rest_pose() {
    let files = ["misc-rigs/17_keypoints_walk.fbx", "mixamo/gltf/Xbot.glb"];
    let Some(measures) = measured_in_corpus(files) else { return };
    let pop = value(&measures, MetricName::KneePop);
    assert!(pop < 5.0, "a knee changes its speed by {pop} degrees a frame more than the source's");
    assert_eq!(value(&measures, MetricName::RotationJumps), 0.0);
}
