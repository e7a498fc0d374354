//! What soles look like on the floor: every vertex of the feet is skinned with all its weights, and nothing of the code that plants
//! them is used.

use glam::{DMat4, DVec3, Mat4, Vec3};
use retargetd::{
    model::{Clip, Control, Reporter},
    retarget::{Stack, parse_spec, resolve},
    rig::Rig,
};

use super::figure::{Figure, frames_of, percentile, position, world};
use crate::support::corpus_file;

/// What may go on in centimeters at a leg of 1 m, and in degrees: 99 % of the depths of the lowest vertex, and the 95th percentile of
/// what knees change by against rotations alone.
struct Bounds {
    depth: f64,
    knee: f64,
}

/// Feet as people have them.
const ORDINARY: Bounds = Bounds { depth: 0.5, knee: 5.0 };
/// Feet half as long as the leg.
const LARGE: Bounds = Bounds { depth: 1.3, knee: 25.0 };
/// Rotations alone.
const PLAIN: &str = r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#;
const FRAMES: usize = 60;
/// Share of a vertex that moves with the foot from which on it is the foot's.
const OF_FOOT: f64 = 0.5;

#[test]
fn skinned_soles_stay_out_of_the_floor() {
    let targets = [("mixamo/gltf/Xbot.glb", ORDINARY), ("cc0-stylised/kaykit_knight.glb", LARGE)];
    judge(&["bvh/cmu/12_01_walk.bvh", "mixamo/fbx/walking_noskin.fbx", "decentraland/walk.glb"], &targets);
}

#[test]
#[ignore = "long"]
fn skinned_soles_stay_out_of_the_floor_on_many_figures() {
    let targets = [
        ("mixamo/gltf/Xbot.glb", ORDINARY),
        ("unreal/ue4_names_apose.glb", ORDINARY),
        ("vrm0/makehuman_body_vrm0.vrm", ORDINARY),
        ("readyplayerme/rpm_avatar_a.glb", ORDINARY),
        ("poser-daz/daz_g8_names_apose.glb", ORDINARY),
        ("cc0-stylised/kaykit_knight.glb", LARGE),
    ];
    let clips = [
        "bvh/cmu/12_01_walk.bvh",
        "mixamo/fbx/walking_noskin.fbx",
        "bvh/bandai-namco/dataset-1_walk_normal_001.bvh",
        "bvh/fair1/zombie_zup.bvh",
        "bvh/xsens/aitviewer_sample.bvh",
        "decentraland/walk.glb",
    ];
    judge(&clips, &targets);
}

/// Figures and clips that nothing was tuned on.
#[test]
#[ignore = "long, and for a last look only"]
fn skinned_soles_of_figures_that_nothing_was_tuned_on() {
    let targets = [
        ("mixamo/gltf/Soldier.glb", ORDINARY),
        ("unreal/makehuman_game_engine_tpose.glb", ORDINARY),
        ("cmu-rig/makehuman_cmu_names_rest.glb", ORDINARY),
        ("unreal/m2m_human_male.glb", ORDINARY),
        ("unreal/m2m_human_zombie.glb", ORDINARY),
        ("unreal/mannequiny.glb", ORDINARY),
        ("vrm1/makehuman_body_vrm1.vrm", ORDINARY),
        ("rigify-blender/gdquest_sophia.glb", ORDINARY),
        ("odd-transforms/armature_nonuniform_scale.glb", ORDINARY),
        ("vrm0/godette.vrm", LARGE),
        ("vrm0/cryptovoxels.vrm", LARGE),
        ("cc0-stylised/godot_robot.glb", LARGE),
        ("khronos/CesiumMan.glb", LARGE),
    ];
    let clips = [
        "bvh/cmu/xia_angry_inches.bvh",
        "bvh/cmu/jumping_jacks_max_names.bvh",
        "bvh/fair1/wave_hello_zup.bvh",
        "bvh/misc/walk01_24fps.bvh",
        "bvh/misc/meredith_8walk_vicon.bvh",
        "bvh/misc/makehuman_zombie_walk.bvh",
        "bvh/bandai-namco/dataset-1_bow_active_001.bvh",
        "mixamo/fbx/zombie_walk_noprefix_noskin.fbx",
        "mixamo/fbx/turn_left_45_noskin.fbx",
        "mixamo/bvh/ortiz_salsa.bvh",
        "poser-daz/pirouette_daz_friendly.bvh",
        "mixamo/bvh/freebvh_mixamorig.bvh",
    ];
    judge(&clips, &targets);
}

/// A walk on the spot has no contacts, or a toe that rests for a moment: feet keep their roll, and the pelvis its height.
#[test]
fn walks_on_the_spot_keep_their_steps() {
    let bounds = Bounds { depth: 0.6, knee: 6.5 };
    judge(&["humanik-unity/viverse_walk.glb"], &[("mixamo/gltf/Xbot.glb", bounds)]);
}

/// The floor of this capture is off by up to 4 cm, and otherwise under either foot. Feet were turned flat for that before they landed, by
/// 18 and 25 degrees at the 95th percentile.
#[test]
fn feet_of_captures_whose_floor_is_off_land_on_their_heels() {
    let Some(path) = corpus_file("bvh/misc/meredith_8walk_vicon.bvh") else { return };
    let source = Figure::read(&path);
    for (name, most_degrees) in [("unreal/mannequiny.glb", 12.5), ("vrm1/makehuman_body_vrm1.vrm", 19.0)] {
        let Some(path) = corpus_file(name) else { return };
        let target = Figure::read(&path);
        let [plain, stack] = [PLAIN, "{}"].map(|spec| pitches(&target, &retargeted(&source, &target, spec)));
        let turned = percentile(plain.iter().zip(&stack).map(|(plain, stack)| (plain - stack).abs()).collect(), 0.95);
        assert!(turned < most_degrees, "{name}: feet are turned up or down by {turned:.1}° at the 95th percentile");
    }
}

/// How far the line from ankle to toes points down, in degrees; of both feet, frame by frame.
fn pitches(target: &Figure, result: &Clip) -> Vec<f64> {
    let pitch = |pose: &[DMat4], side: &str| {
        let [ankle, toe] = ["foot", "toe"].map(|part| position(pose, target.roles[&format!("{side}_{part}")]));
        let line = toe - ankle;
        (-line.y).atan2(line.x.hypot(line.z)).to_degrees()
    };
    let poses = (0..result.frame_count()).map(|frame| world(target.skeleton(), Some((result, frame))));
    poses.flat_map(|pose| ["left", "right"].map(|side| pitch(&pose, side))).collect()
}

#[expect(clippy::print_stderr, reason = "the figures are worth seeing even when they pass")]
fn judge(clips: &[&str], targets: &[(&str, Bounds)]) {
    let mut problems = Vec::new();
    for (target, bounds) in targets {
        let Some(path) = corpus_file(target) else { return };
        let target_figure = Figure::read(&path);
        let soles = Soles::of(&target_figure);
        for clip in clips {
            let Some(path) = corpus_file(clip) else { return };
            let source = Figure::read(&path);
            let [plain, stack] = [PLAIN, "{}"].map(|spec| soles.seen(&source, &target_figure, spec));
            let knees = plain.knees.iter().zip(&stack.knees).map(|(plain, stack)| (plain - stack).abs());
            let knee = percentile(knees.collect(), 0.95);
            eprintln!("{clip} onto {target}: {:.2} -> {:.2} cm deep, knees {knee:.1}°", plain.depth, stack.depth);
            if stack.depth > bounds.depth || knee > bounds.knee {
                problems.push(format!("{clip} onto {target}: {:.2} cm, {knee:.1}°", stack.depth));
            }
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// What a result looks like.
struct Seen {
    /// 99 % of frames are no deeper, in centimeters at a leg of 1 m.
    depth: f64,
    /// Both knees, frame by frame, in degrees.
    knees: Vec<f64>,
}

/// The vertices of the feet of a file, each with the joints that move it, their weights, and where it is in their spaces.
struct Soles {
    vertices: Vec<Vec<(usize, f64, DVec3)>>,
}

impl Soles {
    fn of(figure: &Figure) -> Self {
        let file = gltf::Gltf::from_slice_without_validation(&figure.bytes).expect("a glTF");
        let blob = file.blob.clone();
        let skeleton = figure.skeleton();
        let joint_of = |node: usize| skeleton.joints().iter().position(|joint| joint.node == node).expect("a joint");
        let feet: Vec<usize> = ["left_foot", "right_foot"].map(|role| figure.roles[role]).to_vec();
        let is_foot = |joint: usize| feet.iter().any(|foot| skeleton.is_ancestor_or_self(*foot, joint));
        let mut vertices = Vec::new();
        for node in file.document.nodes() {
            let (Some(mesh), Some(skin)) = (node.mesh(), node.skin()) else { continue };
            let joints: Vec<usize> = skin.joints().map(|joint| joint_of(joint.index())).collect();
            let binds = skin.reader(|_| blob.as_deref()).read_inverse_bind_matrices().expect("binds");
            let binds: Vec<DMat4> = binds.map(|bind| Mat4::from_cols_array_2d(&bind).as_dmat4()).collect();
            for primitive in mesh.primitives() {
                let reader = primitive.reader(|_| blob.as_deref());
                let places = reader.read_positions().expect("positions");
                let slots = reader.read_joints(0).expect("joints").into_u16();
                let weights = reader.read_weights(0).expect("weights").into_f32();
                for ((place, slots), weights) in places.zip(slots).zip(weights) {
                    let place = Vec3::from(place).as_dvec3();
                    let sum: f64 = weights.iter().map(|weight| f64::from(*weight)).sum();
                    let moved = slots.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0);
                    let moved = moved.map(|(slot, weight)| {
                        let slot = usize::from(slot);
                        (joints[slot], f64::from(weight) / sum, binds[slot].transform_point3(place))
                    });
                    let moved: Vec<_> = moved.collect();
                    let of_foot: f64 = moved.iter().filter(|part| is_foot(part.0)).map(|part| part.1).sum();
                    if of_foot >= OF_FOOT {
                        vertices.push(moved);
                    }
                }
            }
        }
        assert!(vertices.len() > 20, "the feet have meshes");
        Self { vertices }
    }

    fn lowest(&self, pose: &[DMat4]) -> f64 {
        let height = |moved: &Vec<(usize, f64, DVec3)>| {
            moved.iter().map(|(joint, weight, place)| pose[*joint].transform_point3(*place).y * weight).sum::<f64>()
        };
        self.vertices.iter().map(height).fold(f64::INFINITY, f64::min)
    }

    fn seen(&self, source: &Figure, target: &Figure, spec: &str) -> Seen {
        let result = retargeted(source, target, spec);
        let joint = |side: &str, part: &str| target.roles[&format!("{side}_{part}")];
        let rest = world(target.skeleton(), None);
        let leg = |pose: &[DMat4], side: &str| ["thigh", "shin", "foot"].map(|part| position(pose, joint(side, part)));
        let [hip, knee, ankle] = leg(&rest, "left");
        let length = hip.distance(knee) + knee.distance(ankle);
        let frames = frames_of(&result, FRAMES);
        let (mut depths, mut knees) = (Vec::new(), Vec::new());
        for frame in frames {
            let pose = world(target.skeleton(), Some((&result, frame)));
            depths.push((-self.lowest(&pose) / length * 100.0).max(0.0));
            for side in ["left", "right"] {
                let [hip, knee, ankle] = leg(&pose, side);
                knees.push((knee - hip).angle_between(ankle - knee).to_degrees());
            }
        }
        // The first frames of a capture are often its calibration pose, which jumps.
        depths.drain(..2);
        Seen { depth: percentile(depths, 0.99), knees }
    }
}

fn retargeted(source: &Figure, target: &Figure, spec: &str) -> Clip {
    let spec = parse_spec(spec.as_bytes()).expect("a spec");
    let mut reporter = Reporter::new();
    let from = Rig::new("source", &source.scene, None, &spec.source, &mut reporter).expect("a rig");
    let onto = Rig::new("target", &target.scene, None, &spec.target, &mut reporter).expect("a rig");
    let resolved = resolve(&spec, &from, &onto, source.clip(), &mut reporter).expect("a mapping");
    let stack = Stack::new(from.skeleton(), onto.skeleton(), &resolved.mapping, &resolved.ops);
    stack.run(source.clip(), &Control::new()).expect("a result").clip
}
