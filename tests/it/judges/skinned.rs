//! What a result looks like, by a judge of its own: every vertex of the written GLB is skinned with all its weights in f64, and the
//! report must say the same. Nothing here is shared with the measures of the library.

use std::collections::BTreeMap;

use glam::{DMat4, DQuat, DVec3, Mat4, Quat, Vec3};
use gltf::animation::util::ReadOutputs;
use retargetd::{
    engine::{Format, OneOrMore},
    retarget::{Measures, MetricName, Verdict},
};

use super::retargeted;
use crate::{
    quality::figure::{Figure, value, world},
    support::corpus_file,
};

const SOURCES: [&str; 4] = [
    "mixamo/fbx/walking_noskin.fbx",
    "mixamo/bvh/mousey_salsa.bvh",
    "bvh/bandai-namco/dataset-1_walk_normal_001.bvh",
    "decentraland/walk.glb",
];
const TARGETS: [&str; 5] = [
    "mixamo/gltf/Xbot.glb",
    "unreal/ue4_names_apose.glb",
    "vrm0/makehuman_body_vrm0.vrm",
    "cc0-stylised/kaykit_knight.glb",
    "readyplayerme/rpm_avatar_a.glb",
];
const PLAIN: &str = r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#;
const SIDES: [&str; 2] = ["left", "right"];

/// The first animation of a GLB with the meshes that it moves.
struct Seen {
    names: Vec<String>,
    parents: Vec<Option<usize>>,
    order: Vec<usize>,
    rest: Vec<[DMat4; 3]>,
    times: Vec<f64>,
    /// Scale, rotation and translation of every node at every key.
    locals: Vec<Vec<Local>>,
    meshes: Vec<Mesh>,
}

#[derive(Clone, Copy)]
struct Local {
    translation: DVec3,
    rotation: DQuat,
    scale: DVec3,
}

impl Local {
    fn matrix(&self) -> DMat4 {
        DMat4::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
    }
}

/// Vertices, each with joints as nodes, weights, and where it is in the joint's space.
struct Mesh(Vec<Vec<(usize, f64, DVec3)>>);

impl Seen {
    fn read(bytes: &[u8]) -> Self {
        let file = gltf::Gltf::from_slice_without_validation(bytes).expect("a GLB");
        let blob = file.blob.clone().expect("a GLB with a buffer");
        let count = file.document.nodes().count();
        let (mut names, mut parents, mut still) = (Vec::new(), vec![None; count], Vec::new());
        for node in file.document.nodes() {
            names.push(node.name().unwrap_or_default().to_owned());
            node.children().for_each(|child| parents[child.index()] = Some(node.index()));
            let (translation, rotation, scale) = node.transform().decomposed();
            still.push(Local {
                translation: Vec3::from(translation).as_dvec3(),
                rotation: Quat::from_array(rotation).as_dquat().normalize(),
                scale: Vec3::from(scale).as_dvec3(),
            });
        }
        let mut order: Vec<usize> = Vec::new();
        let mut open: Vec<usize> = (0..count).filter(|node| parents[*node].is_none()).collect();
        while let Some(node) = open.pop() {
            order.push(node);
            open.extend((0..count).filter(|child| parents[*child] == Some(node)));
        }
        let animation = file.document.animations().next().expect("an animation");
        let mut times: Vec<f32> = Vec::new();
        for channel in animation.channels() {
            times.extend(channel.reader(|_| Some(&blob)).read_inputs().expect("keys"));
        }
        times.sort_by(f32::total_cmp);
        times.dedup();
        let mut locals = vec![still.clone(); times.len()];
        for channel in animation.channels() {
            let (node, reader) = (channel.target().node().index(), channel.reader(|_| Some(&blob)));
            let keys: Vec<f32> = reader.read_inputs().expect("keys").collect();
            let outputs = reader.read_outputs().expect("values");
            let mut set = |values: Vec<(DVec3, DQuat)>, apply: &dyn Fn(&mut Local, DVec3, DQuat)| {
                for (locals, time) in locals.iter_mut().zip(&times) {
                    let after = keys.partition_point(|key| key < time).min(keys.len() - 1);
                    let before = if keys[after] <= *time { after } else { after.saturating_sub(1) };
                    let way = f64::from(keys[after] - keys[before]);
                    let part = if way > 0.0 { (f64::from(*time - keys[before]) / way).clamp(0.0, 1.0) } else { 0.0 };
                    let (from, to) = (values[before], values[after]);
                    apply(&mut locals[node], from.0.lerp(to.0, part), from.1.slerp(to.1, part));
                }
            };
            let vector = |value: [f32; 3]| (Vec3::from(value).as_dvec3(), DQuat::IDENTITY);
            match outputs {
                ReadOutputs::Translations(values) => {
                    set(values.map(vector).collect(), &|local, value, _| local.translation = value);
                }
                ReadOutputs::Scales(values) => {
                    set(values.map(vector).collect(), &|local, value, _| local.scale = value);
                }
                ReadOutputs::Rotations(values) => {
                    let turn = |value| (DVec3::ZERO, Quat::from_array(value).as_dquat().normalize());
                    set(values.into_f32().map(turn).collect(), &|local, _, value| local.rotation = value);
                }
                ReadOutputs::MorphTargetWeights(_) => {}
            }
        }
        let rest = still.iter().map(|local| [local.matrix(), DMat4::IDENTITY, DMat4::IDENTITY]).collect();
        let meshes = meshes(&file.document, &blob);
        Self { names, parents, order, rest, times: times.into_iter().map(f64::from).collect(), locals, meshes }
    }

    /// The matrices of all nodes at a key, or at rest.
    fn world(&self, key: Option<usize>) -> Vec<DMat4> {
        let mut world = vec![DMat4::IDENTITY; self.names.len()];
        for &node in &self.order {
            let local = key.map_or(self.rest[node][0], |key| self.locals[key][node].matrix());
            world[node] = self.parents[node].map_or(local, |parent| world[parent] * local);
        }
        world
    }

    fn node(&self, name: &str) -> usize {
        self.names.iter().position(|other| other == name).unwrap_or_else(|| panic!("a node '{name}'"))
    }

    fn is_below(&self, node: usize, above: usize) -> bool {
        std::iter::successors(Some(node), |node| self.parents[*node]).any(|node| node == above)
    }

    /// The vertices that a foot and what is below it move by at least half.
    fn vertices_of(&self, foot: usize) -> Vec<&[(usize, f64, DVec3)]> {
        let is_own = |shares: &&Vec<(usize, f64, DVec3)>| {
            shares.iter().filter(|(joint, ..)| self.is_below(*joint, foot)).map(|(_, weight, _)| weight).sum::<f64>()
                >= 0.5
        };
        self.meshes.iter().flat_map(|mesh| mesh.0.iter().filter(is_own)).map(Vec::as_slice).collect()
    }
}

fn meshes(document: &gltf::Document, blob: &[u8]) -> Vec<Mesh> {
    let mut found = Vec::new();
    for node in document.nodes() {
        let (Some(mesh), Some(skin)) = (node.mesh(), node.skin()) else { continue };
        let joints: Vec<usize> = skin.joints().map(|joint| joint.index()).collect();
        let binds: Vec<DMat4> = skin
            .reader(|_| Some(blob))
            .read_inverse_bind_matrices()
            .expect("bind matrices")
            .map(|matrix| Mat4::from_cols_array_2d(&matrix).as_dmat4())
            .collect();
        for primitive in mesh.primitives() {
            let reader = primitive.reader(|_| Some(blob));
            let positions: Vec<[f32; 3]> = reader.read_positions().expect("positions").collect();
            let mut vertices = vec![Vec::new(); positions.len()];
            for set in 0..4 {
                let (Some(slots), Some(weights)) = (reader.read_joints(set), reader.read_weights(set)) else { break };
                for ((vertex, slots), (weights, position)) in
                    vertices.iter_mut().zip(slots.into_u16()).zip(weights.into_f32().zip(&positions))
                {
                    for (slot, weight) in slots.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0) {
                        let place = binds[usize::from(slot)].transform_point3(Vec3::from(*position).as_dvec3());
                        vertex.push((joints[usize::from(slot)], f64::from(weight), place));
                    }
                }
            }
            for vertex in &mut vertices {
                let sum: f64 = vertex.iter().map(|(_, weight, _)| weight).sum();
                vertex.iter_mut().for_each(|(_, weight, _)| *weight /= sum);
            }
            found.push(Mesh(vertices));
        }
    }
    found
}

fn lowest(vertices: &[&[(usize, f64, DVec3)]], world: &[DMat4]) -> f64 {
    let height = |shares: &&[(usize, f64, DVec3)]| {
        shares.iter().map(|(joint, weight, place)| world[*joint].transform_point3(*place).y * weight).sum::<f64>()
    };
    vertices.iter().map(height).fold(f64::INFINITY, f64::min)
}

/// All joints of a role.
fn names(figure: &Figure, role: &str) -> Vec<String> {
    match figure.inspection.rigs[0].roles.0.iter().find(|(name, _)| *name == role) {
        None => Vec::new(),
        Some((_, OneOrMore::One(name))) => vec![name.clone()],
        Some((_, OneOrMore::More(names))) => names.clone(),
    }
}

/// From the pelvis to the head.
fn line(figure: &Figure) -> Vec<String> {
    let mut line: Vec<String> = names(figure, "pelvis").into_iter().take(1).collect();
    line.extend(names(figure, "spine"));
    line.extend(names(figure, "neck"));
    line.extend(names(figure, "head").into_iter().take(1));
    line.dedup();
    line
}

/// How one side moves: matrices of all joints at rest and at every key, by name.
struct Moving {
    at: BTreeMap<String, usize>,
    rest: Vec<DMat4>,
    keys: Vec<Vec<DMat4>>,
}

impl Moving {
    fn of_source(figure: &Figure) -> Self {
        let (skeleton, clip) = (figure.skeleton(), figure.clip());
        Self {
            at: (0..skeleton.len()).rev().map(|joint| (skeleton.label(joint), joint)).collect(),
            rest: world(skeleton, None),
            keys: (0..clip.frame_count()).map(|frame| world(skeleton, Some((clip, frame)))).collect(),
        }
    }

    fn of_result(seen: &Seen) -> Self {
        Self {
            at: seen.names.iter().enumerate().rev().map(|(index, name)| (name.clone(), index)).collect(),
            rest: seen.world(None),
            keys: (0..seen.times.len()).map(|key| seen.world(Some(key))).collect(),
        }
    }

    /// The bends of a line's joints against the ones before, beyond the rest pose, degrees.
    fn bends(&self, line: &[String], key: usize) -> Vec<f64> {
        let turn = |world: &[DMat4], name: &String| world[self.at[name]].to_scale_rotation_translation().1;
        let bend = |pair: &[String]| {
            let [rest, now] =
                [&self.rest, &self.keys[key]].map(|world| turn(world, &pair[0]).conjugate() * turn(world, &pair[1]));
            let left = now * rest.conjugate();
            (2.0 * left.xyz().length().atan2(left.w.abs())).to_degrees()
        };
        line.windows(2).map(bend).collect()
    }

    /// The bends of a knee at all keys, degrees.
    fn knee(&self, names: &[String; 3]) -> Vec<f64> {
        let bend = |world: &Vec<DMat4>| {
            let [thigh, shin, foot] = [0, 1, 2].map(|index| world[self.at[&names[index]]].w_axis.truncate());
            (shin - thigh).angle_between(foot - shin).to_degrees()
        };
        self.keys.iter().map(bend).collect()
    }
}

fn knee_names(figure: &Figure, side: &str) -> [String; 3] {
    ["thigh", "shin", "foot"].map(|part| names(figure, &format!("{side}_{part}"))[0].clone())
}

/// The change of speed at every key but the ends, between frames of so many keys, less of them at the ends; degrees per frame², but of frames
/// longer than 1/24 s as much as of one of that length.
fn changes(values: &[f64], keys: usize, key_seconds: f64) -> Vec<f64> {
    let change = |key: usize| {
        let keys = keys.min(key).min(values.len() - 1 - key);
        let share = (1.0 / 24.0 / (key_seconds * keys as f64)).min(1.0);
        (values[key + keys] - 2.0 * values[key] + values[key - keys]).abs() * share * share
    };
    (1..values.len() - 1).map(change).collect()
}

/// What the judge finds, in centimeters at 1 m leg length and degrees.
#[derive(Debug)]
struct Found {
    depth_p99: f64,
    depth: f64,
    kink: f64,
    pop: f64,
    undriven: Vec<String>,
}

impl Found {
    fn of(source: &Figure, target: &Figure, bytes: &[u8]) -> Self {
        let seen = Seen::read(bytes);
        let (before, after) = (Moving::of_source(source), Moving::of_result(&seen));
        assert_eq!(before.keys.len(), after.keys.len(), "the source's keys are kept");
        let leg: f64 = {
            let [thigh, shin, foot] =
                knee_names(target, "left").map(|name| after.rest[after.at[&name]].w_axis.truncate());
            thigh.distance(shin) + shin.distance(foot)
        };
        let feet = SIDES.map(|side| seen.vertices_of(seen.node(&names(target, &format!("{side}_foot"))[0])));
        assert!(feet.iter().all(|vertices| vertices.len() > 20), "feet have vertices");
        let at_rest = feet.iter().map(|foot| lowest(foot, &after.rest)).fold(f64::INFINITY, f64::min);
        let floor = if at_rest.abs() < 0.05 * leg { 0.0 } else { at_rest };
        let depth = |foot: &Vec<&[(usize, f64, DVec3)]>| {
            after.keys.iter().map(|world| (floor - lowest(foot, world)).max(0.0) / leg * 100.0).collect::<Vec<f64>>()
        };
        let mut depths: Vec<f64> = feet.iter().flat_map(depth).collect();
        depths.sort_by(f64::total_cmp);
        let (source_line, target_line) = (line(source), line(target));
        let kink = |key: usize| {
            let excused: f64 = before.bends(&source_line, key).iter().sum();
            after.bends(&target_line, key).into_iter().fold(0.0, f64::max) - excused
        };
        let pop = |side: &str| {
            let key_seconds = source.clip().duration_seconds() / (source.clip().frame_count() - 1) as f64;
            let keys = (1.0 / 30.0 / key_seconds).round().max(1.0) as usize;
            let source = changes(&before.knee(&knee_names(source, side)), keys, key_seconds);
            let target = changes(&after.knee(&knee_names(target, side)), keys, key_seconds);
            let beyond = |index: usize| {
                let near = &source[index.saturating_sub(2 * keys)..(index + 2 * keys + 1).min(source.len())];
                target[index] - near.iter().copied().fold(0.0, f64::max)
            };
            (0..target.len()).map(beyond).fold(0.0, f64::max)
        };
        Self {
            depth_p99: depths[((depths.len() - 1) as f64 * 0.99).round() as usize],
            depth: *depths.last().expect("frames"),
            kink: (0..after.keys.len()).map(kink).fold(0.0, f64::max),
            pop: SIDES.iter().map(|side| pop(side)).fold(0.0, f64::max),
            undriven: undriven(source, target, &seen),
        }
    }

    /// Whether somebody who looks at it sees that it is wrong.
    fn is_bad(&self) -> bool {
        self.depth > 2.0 || self.kink > 20.0 || self.pop > 6.0 || !self.undriven.is_empty()
    }
}

/// Limbs whose nodes keep their rotation while the source's turn by more than 15 degrees.
fn undriven(source: &Figure, target: &Figure, seen: &Seen) -> Vec<String> {
    let (skeleton, clip) = (source.skeleton(), source.clip());
    let range = |rotations: Vec<DQuat>| {
        rotations.iter().map(|rotation| rotation.angle_between(rotations[0]).to_degrees()).fold(0.0, f64::max)
    };
    let mut found = Vec::new();
    for part in ["upper_arm", "forearm", "thigh", "shin"] {
        for role in SIDES.map(|side| format!("{side}_{part}")) {
            let moves = |name: &String| {
                let joint = (0..skeleton.len()).find(|joint| skeleton.label(*joint) == *name).expect("a joint");
                let tracks = &clip.joints()[joint].rotation;
                let frames = 0..clip.frame_count();
                range(frames.map(|frame| tracks.at(frame, Quat::IDENTITY).as_dquat().normalize()).collect()) > 15.0
            };
            let rests = |name: &String| {
                let node = seen.node(name);
                range(seen.locals.iter().map(|locals| locals[node].rotation).collect()) < 0.1
            };
            let own = names(target, &role);
            if names(source, &role).iter().any(moves) && !own.is_empty() && own.iter().all(rests) {
                found.push(role);
            }
        }
    }
    found
}

/// Where the report and the judge disagree. The judge knows no other rest pose than that of the file's nodes, so that it cannot say how
/// far a spine is bent where another one was found.
fn disagreements(measures: &Measures, found: &Found, knows_rest: bool) -> Vec<String> {
    let penetration = &measures.metrics[&MetricName::FloorPenetration];
    let pairs = [
        ("depth p99", value(measures, MetricName::FloorPenetration), found.depth_p99, 0.2),
        ("depth", penetration.absolute_value.expect("the deepest"), found.depth, 0.2),
        (
            "kink",
            value(measures, MetricName::SpineKink),
            found.kink.max(0.0),
            if knows_rest { 0.5 } else { f64::INFINITY },
        ),
        ("knee pop", value(measures, MetricName::KneePop), found.pop, 0.5),
    ];
    let mut wrong: Vec<String> = pairs
        .iter()
        .filter(|(_, told, seen, most)| (told - seen).abs() > *most)
        .map(|(what, told, seen, _)| format!("{what}: {told:.3} is told where {seen:.3} is seen"))
        .collect();
    if measures.verdict == Verdict::Pass && found.is_bad() {
        wrong.push(format!("it passes, and is {found:?}"));
    }
    wrong
}

#[test]
fn the_report_says_what_a_judge_of_its_own_sees() {
    let mut wrong = Vec::new();
    let mut pairs = 0;
    for (index, path) in SOURCES.iter().enumerate() {
        let Some(source) = corpus_file(path).map(|path| Figure::read(&path)) else { continue };
        // Rotations alone leave feet in the floor; one source with and one without a mesh shows it.
        let configs: &[&str] = if index % 3 == 0 { &["{}", PLAIN] } else { &["{}"] };
        for target in TARGETS.iter().filter_map(|path| corpus_file(path)).map(|path| Figure::read(&path)) {
            for config in configs {
                let from = (source.file_name.as_str(), source.bytes.as_slice());
                let outcome = retargeted(from, (&target.file_name, &target.bytes), config, &[Format::Glb]);
                let found = Found::of(&source, &target, &outcome.outputs[0].bytes);
                let knows_rest = ["nodes", "bind"].contains(&outcome.report.rigs.source.rest_pose_from);
                let measures = outcome.report.measures.expect("measures");
                let name = format!("{} on {} {config}", source.file_name, target.file_name);
                wrong.extend(disagreements(&measures, &found, knows_rest).iter().map(|text| format!("{name}: {text}")));
                pairs += 1;
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {pairs} results:\n{}", wrong.len(), wrong.join("\n"));
}

/// Two joints of a source move two of a character's.
const TWO_JOINTS: &str = "HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 20 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 40 0
    }
  }
}
MOTION
Frames: 4
Frame Time: 0.033333
0 95 0 0 0 0 0 0 0
0 95 0 0 5 0 0 10 0
0 95 0 0 10 0 0 20 0
0 95 0 0 15 0 0 30 0
";

#[test]
fn a_source_of_two_joints_does_not_pass() {
    let mannequin = retargetd::samples::mannequin();
    let outcome = retargeted(("two.bvh", TWO_JOINTS.as_bytes()), ("mannequin.glb", &mannequin), "{}", &[Format::Glb]);
    let measures = outcome.report.measures.expect("measures");
    let coverage = &measures.metrics[&MetricName::UndrivenBody];
    assert_eq!(coverage.verdict, Verdict::Fail, "{coverage:?}");
    assert_eq!(measures.verdict, Verdict::Fail, "a verdict is as bad as its worst measure");
    assert!(coverage.parts.contains_key("left_upper_arm"), "{coverage:?}");
    assert!(measures.verdict_reason.contains("undriven_body"), "{}", measures.verdict_reason);
}
