//! Bodies that lie: on the floor, however thick they are for their legs.

use glam::{DQuat, DVec3, Vec3};
use retargetd::{
    model::{Clip, JointTracks, Scene, SkinPoint, SkinPoints, Track},
    retarget::{MetricName, RetargetSpec, StackResult, Verdict},
    samples,
};

use super::figure::{
    Figure, measured, measured_in_corpus, moved, moved_with, position, read_scene, rig_of, with_clip, world,
};

const TRUNK: [&str; 2] = ["pelvis", "spine"];

fn trunk(scene: &Scene) -> Vec<usize> {
    let rig = rig_of("figure", scene);
    TRUNK.into_iter().flat_map(|role| rig.role(role).to_vec()).collect()
}

/// The lowest place of the trunk's mesh at a frame.
pub(super) fn lowest(scene: &Scene, clip: &Clip, frame: usize) -> f64 {
    let pose = world(&scene.skeleton, Some((clip, frame)));
    let heights = trunk(scene).into_iter().flat_map(|joint| {
        let points = scene.skin_points.of(joint).iter().map(move |point| (joint, point.position));
        points.map(|(joint, place)| pose[joint].transform_point3(place.as_dvec3()).y)
    });
    heights.fold(f64::INFINITY, f64::min)
}

/// The mannequin with a trunk so many times as thick.
pub(super) fn with_trunk(thickness: f32) -> Scene {
    let mut scene = read_scene(&samples::mannequin(), "mannequin.glb");
    let trunk = trunk(&scene);
    let mut points = Vec::new();
    for joint in 0..scene.skeleton.len() {
        let by = if trunk.contains(&joint) { thickness } else { 1.0 };
        let point = |point: &SkinPoint| SkinPoint { position: point.position * by, ..*point };
        let joint_number = u32::try_from(joint).expect("few joints");
        points.extend(scene.skin_points.of(joint).iter().map(|one| (joint_number, point(one))));
    }
    scene.skin_points = SkinPoints::new(scene.skeleton.len(), &points);
    scene
}

/// The same, which lies on its back for a second.
pub(super) fn lying(thickness: f32) -> Scene {
    let mut scene = with_trunk(thickness);
    let pelvis = trunk(&scene)[0];
    let at_rest = world(&scene.skeleton, None)[pelvis].to_scale_rotation_translation();
    let clip = |height: f64| {
        let tracks = (0..scene.skeleton.len()).map(|joint| {
            if joint != pelvis {
                return JointTracks::default();
            }
            let turned = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2) * at_rest.1;
            let breath = |frame: u32| DVec3::Z * 0.002 * f64::from(frame).sin();
            let places: Vec<Vec3> = (0..30).map(|frame| (DVec3::Y * height + breath(frame)).as_vec3()).collect();
            JointTracks {
                rotation: Track::Sampled(vec![turned.as_quat(); 30]),
                translation: Track::Sampled(places),
                ..JointTracks::default()
            }
        });
        let times = (0..30).map(|frame| f64::from(frame) / 30.0).collect();
        Clip::new("lies".into(), times, tracks.collect()).expect("a clip")
    };
    let depth = -lowest(&scene, &clip(0.0), 0);
    scene.clips = vec![clip(depth)];
    scene
}

fn measured_verdict(source: &Scene, target: &Scene, result: &StackResult) -> (f64, Verdict) {
    let measures = measured(&rig_of("source", source), &rig_of("target", target), result);
    let float = &measures.metrics[&MetricName::TrunkFloat];
    (float.value.expect("it lies"), measures.verdict)
}

/// How far the knees are from straight, at most; radians.
fn knee_bend(scene: &Scene, clip: &Clip) -> f64 {
    let rig = rig_of("figure", scene);
    let pose = world(&scene.skeleton, Some((clip, clip.frame_count() / 2)));
    let bend = |side: &str| {
        let [hip, knee, ankle] =
            ["thigh", "shin", "foot"].map(|part| position(&pose, rig.role(&format!("{side}_{part}"))[0]));
        (knee - hip).angle_between(ankle - knee)
    };
    bend("left").max(bend("right"))
}

#[test]
fn a_trunk_that_lies_is_on_the_floor_however_thick_it_is() {
    for (of_source, of_target) in [(2.5, 1.0), (1.0, 2.5)] {
        let (source, target) = (lying(of_source), lying(of_target));
        assert!(lowest(&source, &source.clips[0], 0).abs() < 1e-5, "the source lies");
        let result = moved(&rig_of("source", &source), &rig_of("target", &target));
        let height = lowest(&target, &result.clip, 15);
        assert!(height.abs() < 0.03, "{of_source} onto {of_target}: the trunk is {height} m over the floor");
        let bend = knee_bend(&target, &result.clip).to_degrees();
        assert!(bend < 8.0, "{of_source} onto {of_target}: legs are bent by {bend} degrees");
        let (float, verdict) = measured_verdict(&source, &target, &result);
        assert!(float < 4.0 && verdict < Verdict::Fail, "{of_source} onto {of_target}: {float} cm, {verdict:?}");
    }
}

#[test]
fn a_body_that_hovers_fails() {
    let (source, target) = (lying(2.5), lying(1.0));
    let spec =
        serde_json::json!({"ops": [{"op": "pelvis"}, {"op": "fk"}, {"op": "ik"}, {"op": "floor", "trunk": false}]});
    let spec: RetargetSpec = serde_json::from_value(spec).expect("a spec");
    let result = moved_with(&rig_of("source", &source), &rig_of("target", &target), &spec);
    let height = lowest(&target, &result.clip, 15);
    let (float, verdict) = measured_verdict(&source, &target, &result);
    let leg = 0.84;
    assert!(height > 0.1 && (float - height / leg * 100.0).abs() < 4.0, "{height} m, told as {float} cm");
    assert_eq!(verdict, Verdict::Fail);
}

/// A boxer who sits down with his feet set up before him.
#[test]
fn feet_stay_where_they_stand_while_a_body_sits_down() {
    let files = ["bvh/cmu/boxing_toes_row_mismatch.bvh", "mixamo/fbx/ybot_prerotation_skin.fbx"];
    let Some([source, target]) = Figure::of_corpus(files) else { return };
    let (from, onto) = (rig_of("source", &source.scene), rig_of("target", &target.scene));
    let result = moved(&from, &onto);
    let foot = onto.role("right_foot")[0];
    let ankle = |frame: usize| position(&world(target.skeleton(), Some((&result.clip, frame))), foot);
    let way = (2360..2410).map(|frame| (ankle(frame + 1) - ankle(frame)).with_y(0.0)).sum::<DVec3>().length();
    assert!(way < 0.02, "the right foot goes {way} m along the floor");
}

/// The same boxer squats as he gets up, with his trunk a tenth of a leg over the floor: figures that are slimmer sank onto their knees.
#[test]
fn a_body_that_squats_stands_on_its_feet() {
    let files = ["bvh/cmu/boxing_toes_row_mismatch.bvh", "unreal/mannequiny.glb"];
    let Some(measures) = measured_in_corpus(files) else { return };
    for limb in ["left_thigh", "left_shin", "right_thigh", "right_shin"] {
        let off = measures.limb_directions[limb].max_degrees;
        assert!(off < 20.0, "{limb} is off by {off} degrees");
    }
}

/// A figure with a trunk as thick as its legs are long.
#[test]
fn a_chibi_that_lies_lays_others_down() {
    let files = ["cc0-stylised/kaykit_knight.glb", "mixamo/gltf/Soldier.glb"];
    let Some([source, target]) = Figure::of_corpus(files) else { return };
    let source = with_clip(source.scene, "Lie_Idle");
    let result = moved(&rig_of("source", &source), &rig_of("target", &target.scene));
    let (float, verdict) = measured_verdict(&source, &target.scene, &result);
    assert!(float < 4.0 && verdict < Verdict::Fail, "{float} cm, {verdict:?}");
    let pelvis = target.roles["pelvis"];
    let height = position(&world(target.skeleton(), Some((&result.clip, 40))), pelvis).y;
    assert!(height < 0.3, "the pelvis is {height} m over the floor");
}
