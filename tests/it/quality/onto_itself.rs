//! A clip onto the rig that it was made on must come back as it is.

use glam::DMat4;
use retargetd::{
    formats::{self, Limits},
    model::{Clip, Control, Reporter, Scene, Skeleton},
    retarget::{Mapping, Resolved, RetargetSpec, Stack, parse_spec, resolve},
    rig::Rig,
};

use super::figure::{degrees_between, frames_of, position, rotations, world};
use crate::support::{corpus_file, files_below};

const PLAIN: &[u8] = br#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#;
const MAX_DEGREES: f64 = 0.01;
/// At a height of [`MAN_METERS`].
const MAX_METERS: f64 = 1e-4;
/// Chains whose bones move in the clip still lead where the source's lead, which turns them a little.
const MAX_BENT_DEGREES: f64 = 10.0;
const MAN_METERS: f64 = 1.7;
const FRAMES_LOOKED_AT: usize = 60;

/// Files with an animation in which no body is found by names, so that there is nothing to retarget.
const NO_BODY: [&str; 8] = [
    "cc0-stylised/kenney_platformer_noskin.glb",
    "khronos/CesiumMan.glb",
    "khronos/CesiumMan_embedded.gltf",
    "khronos/SimpleSkin.gltf",
    "khronos/SimpleSkinning.gltf",
    "khronos/rigged_simple.gltf",
    "misc-rigs/animation_with_skeleton_generic_names.fbx",
    "misc-rigs/huesitos.fbx",
];

#[test]
fn every_clip_of_the_corpus() {
    let Some(corpus) = corpus_file("") else { return };
    let mut problems = Vec::new();
    let (mut compared, mut with_moving_bones) = (0, 0);
    for path in files_below(&corpus) {
        let name = path.strip_prefix(&corpus).expect("below the corpus").to_string_lossy().into_owned();
        let family = name.split('/').next().unwrap_or("");
        if ["hostile", "fbx-semantics", "animated-drawings"].contains(&family) {
            continue;
        }
        let Some(scene) = animated_scene(&std::fs::read(&path).expect("readable"), &name) else { continue };
        match Comparison::of(&scene) {
            Err(_) if NO_BODY.contains(&name.as_str()) => {}
            Err(error) => problems.push(format!("{name}: not retargeted: {error}")),
            Ok(comparison) => {
                compared += 1;
                with_moving_bones += usize::from(comparison.moving_bones > 0);
                problems.extend(comparison.problem().map(|problem| format!("{name}: {problem}")));
            }
        }
    }
    assert!(problems.is_empty(), "{} of {compared}:\n{}", problems.len(), problems.join("\n"));
    assert!(compared > 50, "the corpus holds clips, found {compared}");
    assert!(with_moving_bones > 3, "some move bones apart, which is not transferred, found {with_moving_bones}");
}

fn animated_scene(bytes: &[u8], name: &str) -> Option<Scene> {
    let format = formats::sniff(bytes, name).ok()?;
    let scene = formats::read(bytes, format, &Limits::default(), &Control::new(), &mut Reporter::new()).ok()?;
    scene.clips.iter().any(Clip::is_animated).then_some(scene)
}

/// The worst differences over the frames, between the clip and what became of it.
struct Comparison {
    degrees: f64,
    worst_turned: String,
    /// At the height of a man.
    meters: f64,
    worst_placed: String,
    /// Joints whose bone changes its length or direction in the clip, and all below them: these ride along at rest length.
    moving_bones: usize,
    /// The largest difference of joints that bend for the sake of a direction, because bones along it move.
    bent_degrees: f64,
}

impl Comparison {
    fn of(scene: &Scene) -> Result<Self, String> {
        let (clip, result, mapping) = retarget_onto_itself(scene)?;
        let skeleton = &scene.skeleton;
        let driven = mapping.driven();
        let pelvis = mapping.pelvis.as_ref().map(|pelvis| pelvis.target);
        let placed = placed_joints(skeleton, clip, &driven, pelvis);
        let bends = bent_joints(skeleton, clip, &mapping);
        let size = height(&world(skeleton, Some((clip, 0))), &driven);
        let mut comparison = Self {
            degrees: 0.0,
            worst_turned: String::new(),
            meters: 0.0,
            worst_placed: String::new(),
            bent_degrees: 0.0,
            moving_bones: (0..skeleton.len()).filter(|&joint| driven[joint] && !placed[joint]).count(),
        };
        for frame in frames_of(clip, FRAMES_LOOKED_AT) {
            let (before, after) = (world(skeleton, Some((clip, frame))), world(skeleton, Some((&result, frame))));
            let turns = (rotations(skeleton, clip, frame), rotations(skeleton, &result, frame));
            for joint in (0..skeleton.len()).filter(|&joint| driven[joint]) {
                let degrees = degrees_between(turns.0[joint], turns.1[joint]);
                if bends[joint] {
                    comparison.bent_degrees = comparison.bent_degrees.max(degrees);
                } else if degrees > comparison.degrees {
                    comparison.degrees = degrees;
                    comparison.worst_turned = format!("{} at frame {frame}", skeleton.label(joint));
                }
                let meters = position(&before, joint).distance(position(&after, joint)) / size * MAN_METERS;
                if placed[joint] && meters > comparison.meters {
                    comparison.meters = meters;
                    comparison.worst_placed = format!("{} at frame {frame}", skeleton.label(joint));
                }
            }
        }
        Ok(comparison)
    }

    fn problem(&self) -> Option<String> {
        let is_good = self.degrees < MAX_DEGREES && self.meters < MAX_METERS && self.bent_degrees < MAX_BENT_DEGREES;
        let Self { degrees, worst_turned, meters, worst_placed, moving_bones, bent_degrees } = self;
        (!is_good).then(|| {
            format!("{degrees:.4}° ({worst_turned}), {meters:.6} m ({worst_placed}); {moving_bones} on moving bones, {bent_degrees:.4}°")
        })
    }
}

fn retarget_onto_itself(scene: &Scene) -> Result<(&Clip, Clip, Mapping), String> {
    // Feet of legs whose bones stretch are where rotations do not take them, and planting would take them there.
    let moves_bones = |clip: &Clip| (1..scene.skeleton.len()).any(|joint| !keeps_bone(&scene.skeleton, clip, joint));
    let stretches = scene.clips.iter().find(|clip| clip.is_animated()).is_some_and(moves_bones);
    let spec = if stretches { parse_spec(PLAIN).expect("a spec") } else { RetargetSpec::default() };
    let mut reporter = Reporter::new();
    let rig = |name, reporter: &mut Reporter| Rig::new(name, scene, None, &spec.source, reporter);
    let source = rig("source", &mut reporter).map_err(|error| error.to_string())?;
    let target = rig("target", &mut reporter).map_err(|error| error.to_string())?;
    let clip = scene.clips.iter().find(|clip| clip.is_animated()).ok_or("no clip")?;
    let Resolved { mapping, ops, .. } =
        resolve(&spec, &source, &target, clip, &mut reporter).map_err(|error| error.to_string())?;
    let stack = Stack::new(source.skeleton(), target.skeleton(), &mapping, &ops);
    let result = stack.run(clip, &Control::new()).map_err(|error| error.to_string())?;
    Ok((clip, result.clip, mapping))
}

/// Driven joints whose place follows from the pelvis' and from rotations that the plan drives: on the way up to the pelvis
/// no bone moves and nothing turns that is not driven.
fn placed_joints(skeleton: &Skeleton, clip: &Clip, driven: &[bool], pelvis: Option<usize>) -> Vec<bool> {
    let mut placed = vec![false; skeleton.len()];
    let mut stiff = vec![false; skeleton.len()];
    for joint in 0..skeleton.len() {
        let is_pelvis = pelvis == Some(joint);
        let rides = skeleton.parent(joint).is_some_and(|parent| stiff[parent]);
        placed[joint] = driven[joint] && (is_pelvis || (rides && keeps_bone(skeleton, clip, joint)));
        let turns_alike = driven[joint] || !clip.joints()[joint].rotation.is_animated();
        stiff[joint] = (is_pelvis || (rides && keeps_bone(skeleton, clip, joint)))
            && turns_alike
            && keeps_scale(skeleton, clip, joint);
    }
    placed
}

/// Joints of chains that are turned to lead where the source's lead, and along which a bone moves.
fn bent_joints(skeleton: &Skeleton, clip: &Clip, mapping: &Mapping) -> Vec<bool> {
    let mut bent = vec![false; skeleton.len()];
    for chain in &mapping.chains {
        let Some(chord) = &chain.chord else { continue };
        let path = skeleton.path(chain.target[0], chord.target_end).expect("a chord ends below its chain");
        if path[1..].iter().any(|&joint| !keeps_bone(skeleton, clip, joint)) {
            chain.target.iter().for_each(|&joint| bent[joint] = true);
        }
    }
    bent
}

fn keeps_bone(skeleton: &Skeleton, clip: &Clip, joint: usize) -> bool {
    let rest = skeleton.joints()[joint].rest.translation;
    let slack = 1e-5 * rest.length() + 1e-7;
    let track = &clip.joints()[joint].translation;
    (0..clip.frame_count()).all(|frame| track.at(frame, rest.as_vec3()).as_dvec3().distance(rest) <= slack)
}

fn keeps_scale(skeleton: &Skeleton, clip: &Clip, joint: usize) -> bool {
    let rest = skeleton.joints()[joint].rest.scale;
    let track = &clip.joints()[joint].scale;
    (0..clip.frame_count()).all(|frame| track.at(frame, rest.as_vec3()).as_dvec3().distance(rest) <= 1e-5)
}

/// The largest extent of the driven joints.
fn height(world: &[DMat4], driven: &[bool]) -> f64 {
    let positions = || (0..world.len()).filter(|&joint| driven[joint]).map(|joint| position(world, joint));
    let low = positions().fold(glam::DVec3::INFINITY, glam::DVec3::min);
    let high = positions().fold(glam::DVec3::NEG_INFINITY, glam::DVec3::max);
    (high - low).max_element().max(f64::MIN_POSITIVE)
}
