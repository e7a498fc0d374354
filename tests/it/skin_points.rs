//! Where the vertices of real characters are: a figure's points must fill the figure.

use glam::DVec3;
use retargetd::model::{Scene, Skeleton};

use crate::{
    quality::figure::{Figure, read_scene},
    support::corpus_file,
};

/// All points of some joints in the pose of the nodes, model space.
fn points_of(scene: &Scene, joints: impl Iterator<Item = usize>) -> Vec<DVec3> {
    let pose = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let of_joint = |joint: usize| {
        let transform = pose.transforms()[joint];
        scene.skin_points.of(joint).iter().map(move |point| transform.transform_point(point.position.as_dvec3()))
    };
    joints.flat_map(of_joint).collect()
}

fn below(skeleton: &Skeleton, joint: usize) -> impl Iterator<Item = usize> + '_ {
    (0..skeleton.len()).filter(move |other| skeleton.is_ancestor_or_self(joint, *other))
}

fn height(points: &[DVec3]) -> (f64, f64) {
    points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), point| (low.min(point.y), high.max(point.y)))
}

#[test]
fn the_points_of_real_characters_reach_from_the_sole_to_the_crown() {
    let files = [
        "mixamo/gltf/Soldier.glb",
        "mixamo/fbx/ybot_prerotation_skin.fbx",
        "mixamo/fbx/samba_dancing_skin.fbx",
        "biped/rocketbox_male_adult_01.fbx",
        "vrm1/makehuman_body_vrm1.vrm",
        "vrm0/makehuman_body_vrm0.vrm",
        "readyplayerme/rpm_avatar.fbx",
        "unreal/ue4_names_apose_zup_xfwd.fbx",
        "mixamo/gltf/joe_meshopt_9skins.glb",
        "mixamo/gltf/michelle_meshopt.glb",
        "unreal/m2m_human_male.glb",
        "readyplayerme/rpm_avatar_a.glb",
    ];
    for path in files.iter().filter_map(|path| corpus_file(path)) {
        let figure = Figure::read(&path);
        let (scene, skeleton) = (&figure.scene, figure.skeleton());
        let name = &figure.file_name;
        let all = points_of(scene, 0..skeleton.len());
        let (low, high) = height(&all);
        let joints: Vec<DVec3> =
            skeleton.rest_pose().to_model(skeleton).transforms().iter().map(|one| one.translation).collect();
        let head = joints[figure.roles["head"]].y;
        let foot = joints[figure.roles["left_foot"]].y;
        let tall = head - foot;
        assert!(high > head && high < head + 0.4 * tall, "{name}: the crown is above the head joint: {high} {head}");
        assert!(low < foot && low > foot - 0.2 * tall, "{name}: the sole is below the ankle: {low} {foot}");
        let (sole, _) = height(&points_of(scene, below(skeleton, figure.roles["left_foot"])));
        assert!((sole - low).abs() < 0.03 * tall, "{name}: the left foot stands: {sole} {low}");
        let hand = points_of(scene, below(skeleton, figure.roles["left_hand"]));
        let wrist = joints[figure.roles["left_hand"]];
        let reach = hand.iter().map(|point| point.distance(wrist)).fold(0.0, f64::max);
        assert!(reach > 0.05 * tall && reach < 0.25 * tall, "{name}: a hand is as long as a hand: {reach} of {tall}");
    }
}

#[test]
fn one_body_in_two_formats_has_the_same_points() {
    let Some(glb) = corpus_file("mixamo/cc0/makehuman_mixamo_names_rest.glb") else { return };
    let Some(fbx) = corpus_file("mixamo/cc0/makehuman_mixamo_names_rest_leafbones.fbx") else { return };
    let read = |path: &std::path::Path| {
        read_scene(&std::fs::read(path).expect("readable"), &path.file_name().expect("a file").to_string_lossy())
    };
    let extent = |scene: &Scene| {
        let (low, high) = height(&points_of(scene, 0..scene.skeleton.len()));
        high - low
    };
    let (glb, fbx) = (extent(&read(&glb)), extent(&read(&fbx)));
    assert!((glb / fbx - 1.0).abs() < 0.001, "the same body twice: {glb} {fbx}");
}
