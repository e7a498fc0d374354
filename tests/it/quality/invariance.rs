//! What must not matter: how the joints' own axes lie, the unit, which axis is up, which way the file faces, how large the
//! actor is, and where the clip was cut.

use glam::{DMat4, DQuat, DVec3, Quat, Vec3};
use retargetd::{
    model::{Axes, Clip, Control, Joint, JointTracks, Reporter, Scene, Skeleton, Track},
    retarget::{Resolved, RetargetSpec, Stack, parse_spec, resolve},
    rig::Rig,
    samples,
};

use super::{
    figure::{Figure, degrees_between, position, rotation, world},
    made_rigs::{MadeRig, roles_of},
};
use crate::support::corpus_file;

/// Forward kinematics alone: what comes out of a frame depends on that frame only.
const PLAIN: &[u8] = br#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#;
const MAX_DEGREES: f64 = 0.01;
const MAX_METERS: f64 = 1e-4;

/// A scene in another guise, and how to see through it.
struct Guise {
    scene: Scene,
    /// Per joint: the rotation between its old and its new own axes.
    own_axes: Vec<DQuat>,
    scene_from_canonical: DQuat,
    units_per_meter: f64,
}

impl Guise {
    fn plain(scene: Scene) -> Self {
        let own_axes = vec![DQuat::IDENTITY; scene.skeleton.len()];
        Self { scene, own_axes, scene_from_canonical: DQuat::IDENTITY, units_per_meter: 1.0 }
    }

    /// Every joint's own axes are turned at random; where joints are does not change.
    fn with_other_joint_axes(mut self, seed: u64) -> Self {
        let mut state = seed;
        let turns: Vec<DQuat> = self.own_axes.iter().map(|_| random_rotation(&mut state)).collect();
        let above = |parent: Option<usize>| parent.map_or(DQuat::IDENTITY, |parent| turns[parent].conjugate());
        self.change(
            |parent, translation| above(parent) * translation,
            |joint, parent, rotation| above(parent) * rotation * turns[joint],
        );
        self.own_axes = turns;
        self
    }

    /// The whole scene is turned; the file says which axes it has, or leaves it to be found out.
    fn turned(mut self, scene_from_canonical: DQuat, axes: Option<Axes>) -> Self {
        let turn = |parent: Option<usize>| if parent.is_none() { scene_from_canonical } else { DQuat::IDENTITY };
        self.change(|parent, translation| turn(parent) * translation, |_, parent, rotation| turn(parent) * rotation);
        self.scene.axes = axes;
        self.scene_from_canonical = scene_from_canonical;
        self
    }

    /// All lengths are multiplied, and the file says so.
    fn in_units(mut self, units_per_meter: f64) -> Self {
        self.change(|_, translation| translation * units_per_meter, |_, _, rotation| rotation);
        self.scene.unit_meters = Some(units_per_meter.recip());
        self.units_per_meter = units_per_meter;
        self
    }

    /// All lengths are multiplied, and the file does not say so: a giant.
    fn grown(mut self, factor: f64) -> Self {
        self.change(|_, translation| translation * factor, |_, _, rotation| rotation);
        self
    }

    fn change(
        &mut self,
        translate: impl Fn(Option<usize>, DVec3) -> DVec3,
        rotate: impl Fn(usize, Option<usize>, DQuat) -> DQuat,
    ) {
        let skeleton = &self.scene.skeleton;
        let joints = skeleton.joints().iter().enumerate().map(|(index, joint)| {
            let mut rest = joint.rest;
            rest.translation = translate(joint.parent, rest.translation);
            rest.rotation = rotate(index, joint.parent, rest.rotation);
            Joint { rest, ..joint.clone() }
        });
        let clips = self.scene.clips.iter().map(|clip| {
            let tracks = clip.joints().iter().enumerate().map(|(index, tracks)| {
                let parent = skeleton.parent(index);
                let place = |value: Vec3| translate(parent, value.as_dvec3()).as_vec3();
                let turn = |value: Quat| rotate(index, parent, value.as_dquat()).normalize().as_quat();
                JointTracks {
                    translation: map(&tracks.translation, place),
                    rotation: map(&tracks.rotation, turn),
                    scale: tracks.scale.clone(),
                }
            });
            Clip::new(clip.name().into(), clip.times_seconds().to_vec(), tracks.collect()).expect("a valid clip")
        });
        let clips = clips.collect();
        self.scene.skeleton = Skeleton::new(joints.collect()).expect("a valid skeleton");
        self.scene.clips = clips;
    }

    /// Position in meters and rotation of every joint, as if the scene wore no guise.
    fn seen_through(&self, world: &[DMat4]) -> Vec<(DVec3, DQuat)> {
        let canonical_from_scene = self.scene_from_canonical.conjugate();
        let joint = |joint: usize| {
            let place = canonical_from_scene * position(world, joint) / self.units_per_meter;
            (place, canonical_from_scene * rotation(world, joint) * self.own_axes[joint].conjugate())
        };
        (0..world.len()).map(joint).collect()
    }
}

fn map<T: Copy>(track: &Track<T>, change: impl Fn(T) -> T) -> Track<T> {
    match track {
        Track::Rest => Track::Rest,
        Track::Constant(value) => Track::Constant(change(*value)),
        Track::Sampled(values) => Track::Sampled(values.iter().map(|value| change(*value)).collect()),
    }
}

/// The next value of a linear congruential generator, from −1 to 1.
fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

fn random_rotation(state: &mut u64) -> DQuat {
    DQuat::from_xyzw(random(state), random(state), random(state), random(state) + 1e-3).normalize()
}

fn retargeted_as(spec: &RetargetSpec, source: &Scene, clip: &Clip, target: &Scene) -> Clip {
    let mut reporter = Reporter::new();
    let source = Rig::new("source", source, None, &spec.source, &mut reporter).expect("a source");
    let target = Rig::new("target", target, None, &spec.target, &mut reporter).expect("a target");
    let Resolved { mapping, ops, .. } = resolve(spec, &source, &target, clip, &mut reporter).expect("a mapping");
    let stack = Stack::new(source.skeleton(), target.skeleton(), &mapping, &ops);
    stack.run(clip, &Control::new()).expect("a result").clip
}

/// All frames of a retarget, seen through the target's guise.
fn motion(source: &Guise, target: &Guise) -> Vec<Vec<(DVec3, DQuat)>> {
    motion_as(&RetargetSpec::default(), source, target)
}

fn motion_as(spec: &RetargetSpec, source: &Guise, target: &Guise) -> Vec<Vec<(DVec3, DQuat)>> {
    let result = retargeted_as(spec, &source.scene, &source.scene.clips[0], &target.scene);
    let frame = |frame| target.seen_through(&world(&target.scene.skeleton, Some((&result, frame))));
    (0..result.frame_count()).map(frame).collect()
}

fn assert_same_motion(ours: &[Vec<(DVec3, DQuat)>], plain: &[Vec<(DVec3, DQuat)>], what: &str) {
    assert_eq!(ours.len(), plain.len(), "{what}: frames");
    let (mut meters, mut degrees) = (0.0_f64, 0.0_f64);
    for (ours, plain) in ours.iter().flatten().zip(plain.iter().flatten()) {
        meters = meters.max(ours.0.distance(plain.0));
        degrees = degrees.max(degrees_between(ours.1, plain.1));
    }
    assert!(meters < MAX_METERS, "{what}: places differ by {meters} m");
    assert!(degrees < MAX_DEGREES, "{what}: rotations differ by {degrees}°");
}

fn walk() -> Guise {
    Guise::plain(samples::walk_scene())
}

fn mannequin() -> Guise {
    Guise::plain(samples::mannequin_scene())
}

/// +Z up as +Y was, −Y front as +Z was.
fn z_up() -> (DQuat, Axes) {
    (DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2), "+z-y".parse().expect("axes"))
}

#[test]
fn joint_axes_do_not_matter() {
    let plain = motion(&walk(), &mannequin());
    for seed in 1..4 {
        let ours = motion(&walk().with_other_joint_axes(seed), &mannequin());
        assert_same_motion(&ours, &plain, &format!("source axes {seed}"));
        let ours = motion(&walk(), &mannequin().with_other_joint_axes(seed));
        assert_same_motion(&ours, &plain, &format!("target axes {seed}"));
        let ours = motion(&walk().with_other_joint_axes(seed), &mannequin().with_other_joint_axes(seed + 100));
        assert_same_motion(&ours, &plain, &format!("axes of both {seed}"));
    }
}

#[test]
fn units_and_size_do_not_matter() {
    let plain = motion(&walk(), &mannequin());
    for units_per_meter in [100.0, 39.370_078_74, 0.01] {
        let ours = motion(&walk().in_units(units_per_meter), &mannequin());
        assert_same_motion(&ours, &plain, &format!("source at {units_per_meter} units a meter"));
        let ours = motion(&walk(), &mannequin().in_units(units_per_meter));
        assert_same_motion(&ours, &plain, &format!("target at {units_per_meter} units a meter"));
    }
    for factor in [0.1, 3.0, 100.0] {
        let ours = motion(&walk().grown(factor), &mannequin());
        assert_same_motion(&ours, &plain, &format!("an actor {factor} times as large"));
    }
}

#[test]
fn up_and_front_do_not_matter() {
    let plain = motion(&walk(), &mannequin());
    let (turn, axes) = z_up();
    let about = DQuat::from_rotation_y(std::f64::consts::PI);
    let side = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
    let guises: [(&str, DQuat, Option<Axes>); 6] = [
        ("Z up, declared", turn, Some(axes)),
        ("Z up, to be found out", turn, None),
        ("facing back, as if it faced front", about, Some(Axes::default())),
        ("facing back, to be found out", about, None),
        ("facing right, as if it faced front", side, Some(Axes::default())),
        ("Z up and facing back, to be found out", turn * about, None),
    ];
    for (what, turn, axes) in guises {
        let ours = motion(&walk().turned(turn, axes), &mannequin());
        assert_same_motion(&ours, &plain, &format!("source {what}"));
        let ours = motion(&walk(), &mannequin().turned(turn, axes));
        assert_same_motion(&ours, &plain, &format!("target {what}"));
    }
}

#[test]
fn everything_at_once_does_not_matter() {
    let plain = motion(&walk(), &mannequin());
    let (turn, _) = z_up();
    let source = walk().with_other_joint_axes(7).turned(turn, None).in_units(100.0);
    let target = mannequin().with_other_joint_axes(8).turned(turn, None).in_units(39.370_078_74);
    assert_same_motion(&motion(&source, &target), &plain, "both sides");
}

#[test]
fn real_files_in_another_guise_move_the_same() {
    let files = ["bvh/bandai-namco/dataset-1_walk_normal_001.bvh", "mixamo/gltf/Xbot.glb"].map(corpus_file);
    let [Some(source), Some(target)] = files else { return };
    let file = |path| {
        let mut scene = Figure::read(path).scene;
        // What is said of meshes and poses beside the nodes is in the axes and the unit of the file.
        scene.skin_points = Default::default();
        scene.skin_vertices = Default::default();
        scene.bind_pose.clear();
        scene.clips.truncate(1);
        Guise::plain(scene)
    };
    let (walk, figure) = (|| file(&source), || file(&target));
    let plain = motion(&walk(), &figure());
    let (turn, axes) = z_up();
    for (what, source, target) in [
        ("other joint axes", walk().with_other_joint_axes(21), figure().with_other_joint_axes(22)),
        ("an actor three times as large", walk().grown(3.0), figure()),
        ("Z up", walk(), figure().turned(turn, Some(axes))),
        ("centimeters", walk(), figure().in_units(100.0)),
    ] {
        assert_same_motion(&motion(&source, &target), &plain, what);
    }
}

/// The mannequin with its limbs hung from the root, as exports of the skin's joints alone have them.
fn in_pieces() -> Guise {
    let mut rig = MadeRig::of(&samples::mannequin_scene());
    for joint in ["thigh", "clavicle", "foot", "lowerarm"] {
        rig = rig.hung_from(&format!("{joint}_l"), "root").hung_from(&format!("{joint}_r"), "root");
    }
    Guise::plain(rig.scene(|name| name.starts_with("foot")))
}

#[test]
fn limbs_in_pieces_and_twists_do_not_depend_on_axes_units_and_facing() {
    let roles = roles_of(&samples::mannequin_scene());
    let plain = motion_as(&roles, &walk(), &in_pieces());
    let (turn, axes) = z_up();
    let about = DQuat::from_rotation_y(std::f64::consts::PI);
    for (what, target) in [
        ("other joint axes", in_pieces().with_other_joint_axes(11)),
        ("centimeters", in_pieces().in_units(100.0)),
        ("Z up", in_pieces().turned(turn, Some(axes))),
        ("facing back", in_pieces().turned(about, None)),
        ("all of it", in_pieces().with_other_joint_axes(12).turned(turn, None).in_units(39.370_078_74)),
    ] {
        assert_same_motion(&motion_as(&roles, &walk(), &target), &plain, what);
    }
}

fn cut(clip: &Clip, from: usize, to: usize) -> Clip {
    let times = clip.times_seconds()[from..to].to_vec();
    let tracks = clip.joints().iter().map(|tracks| JointTracks {
        translation: cut_track(&tracks.translation, from, to),
        rotation: cut_track(&tracks.rotation, from, to),
        scale: cut_track(&tracks.scale, from, to),
    });
    Clip::new(clip.name().into(), times, tracks.collect()).expect("a valid clip")
}

fn cut_track<T: Copy>(track: &Track<T>, from: usize, to: usize) -> Track<T> {
    match track {
        Track::Rest => Track::Rest,
        Track::Constant(value) => Track::Constant(*value),
        Track::Sampled(values) => Track::Sampled(values[from..to].to_vec()),
    }
}

fn assert_cuts_agree(source: &Scene, clip: &Clip, target: &Scene, what: &str) {
    let plain = parse_spec(PLAIN).expect("a spec");
    let whole = retargeted_as(&plain, source, clip, target);
    let frames = clip.frame_count();
    for (from, to) in [(0, frames / 3), (frames / 3, frames / 2 + 1), (frames - 2, frames)] {
        let part = retargeted_as(&plain, source, &cut(clip, from, to), target);
        for frame in from..to {
            let whole = world(&target.skeleton, Some((&whole, frame)));
            let part = world(&target.skeleton, Some((&part, frame - from)));
            for joint in 0..whole.len() {
                let meters = position(&whole, joint).distance(position(&part, joint));
                assert!(meters < MAX_METERS, "{what}: frame {frame} of {from}..{to}: {meters} m");
                let degrees = degrees_between(rotation(&whole, joint), rotation(&part, joint));
                assert!(degrees < MAX_DEGREES, "{what}: frame {frame} of {from}..{to}: {degrees}°");
            }
        }
    }
}

#[test]
fn where_a_clip_was_cut_does_not_matter() {
    let (walk, mannequin) = (samples::walk_scene(), samples::mannequin_scene());
    assert_cuts_agree(&walk, &walk.clips[0], &mannequin, "the samples");
    for source in ["bvh/cmu/12_01_walk.bvh", "mixamo/fbx/walking_noskin.fbx", "bvh/fair1/dab_zup.bvh"] {
        let (Some(source_file), Some(target)) = (corpus_file(source), corpus_file("mixamo/gltf/Xbot.glb")) else {
            return;
        };
        let (figure, target) = (Figure::read(&source_file), Figure::read(&target));
        assert_cuts_agree(&figure.scene, figure.clip(), &target.scene, source);
    }
}
