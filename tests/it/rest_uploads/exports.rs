//! Files that the product writes itself, uploaded as rest files: through the engine, as the command line and the service use it.

use glam::{DQuat, DVec3};
use retargetd::{
    engine::{Failure, Inputs, NamedBytes, Outcome, retarget},
    formats::{self, Format, Limits},
    model::{Control, ModelPose, Reporter, Scene},
    rig::{RestSource, RigSpec, Role},
    samples,
};

use super::expected::{DOUBTS, rig_of};
use crate::support::gltf_json;

const FORMATS: [(Format, &str); 5] = [
    (Format::Glb, "rest.glb"),
    (Format::Bvh, "rest.bvh"),
    (Format::Fbx, "rest.fbx"),
    (Format::PosesNpz, "rest.npz"),
    (Format::PosesJson, "rest.json"),
];

struct Job<'a> {
    source: &'a [u8],
    target: &'a [u8],
    source_rest: Option<(&'a [u8], &'a str)>,
    target_rest: Option<(&'a [u8], &'a str)>,
    config: &'a str,
    format: Format,
}

impl Job<'_> {
    fn run(&self) -> Result<Outcome, Failure> {
        let inputs = Inputs {
            source: NamedBytes { name: "walk.glb", bytes: self.source },
            target: NamedBytes { name: "mannequin.glb", bytes: self.target },
            source_rest: self.source_rest.map(|(bytes, name)| NamedBytes { name, bytes }),
            target_rest: self.target_rest.map(|(bytes, name)| NamedBytes { name, bytes }),
            config: Some(NamedBytes { name: "config.json", bytes: self.config.as_bytes() }),
            formats: &[self.format],
        };
        retarget(&inputs, &Limits::default(), &Control::new())
    }
}

fn pose_config(to: &str) -> String {
    format!(r#"{{"pose": {{"to": "{to}"}}}}"#)
}

fn read(bytes: &[u8], name: &str) -> Scene {
    let format = formats::sniff(bytes, name).expect("a format");
    formats::read(bytes, format, &Limits::default(), &Control::new(), &mut Reporter::new()).expect("a scene")
}

/// Largest angle between the limbs of two results, over some frames.
fn limb_degrees(target: &Scene, one: &Outcome, other: &Outcome) -> f64 {
    let (rig, _) = rig_of(target, None, &RigSpec::default()).expect("a rig");
    let scenes = [one, other].map(|outcome| read(&outcome.outputs[0].bytes, "result.glb"));
    let count = scenes[0].clips[0].frame_count();
    assert_eq!(count, scenes[1].clips[0].frame_count(), "as many frames");
    let mut worst = 0.0_f64;
    for frame in (0..count).step_by(10) {
        let [one, other] = [0, 1].map(|index| -> ModelPose {
            let scene: &Scene = &scenes[index];
            scene.clips[0].local_pose(&scene.skeleton, frame).to_model(&scene.skeleton)
        });
        for joints in rig.roles.iter().filter(|(role, _)| role.parse::<Role>().is_ok()).map(|(_, joints)| joints) {
            for &joint in joints {
                let Some(parent) = target.skeleton.parent(joint) else { continue };
                let bone = |pose: &ModelPose| -> DVec3 {
                    pose.transforms()[joint].translation - pose.transforms()[parent].translation
                };
                if bone(&one).length() > 1e-6 {
                    worst = worst.max(bone(&one).angle_between(bone(&other)).to_degrees());
                }
            }
        }
    }
    worst
}

fn doubts(outcome: &Outcome) -> Vec<&'static str> {
    outcome.report.warnings.iter().map(|warning| warning.code).filter(|code| DOUBTS.contains(code)).collect()
}

#[test]
fn what_pose_and_retarget_write_is_taken_as_it_stands() {
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    let scene = read(&mannequin, "mannequin.glb");
    let plain = Job {
        source: &walk,
        target: &mannequin,
        source_rest: None,
        target_rest: None,
        config: "{}",
        format: Format::Glb,
    };
    let without = plain.run().expect("a result");
    let solved = Job { config: r#"{"target": {"rest": "solved"}}"#, ..plain }.run().expect("a result");
    let pose = |to: &str, format| {
        let config = pose_config(to);
        Job { config: &config, source: &mannequin, format, ..plain }.run().expect("a pose").outputs.remove(0).bytes
    };
    let moved = |format| Job { format, ..plain }.run().expect("a result").outputs.remove(0).bytes;
    let mut problems = Vec::new();
    for (format, name) in FORMATS {
        let files = [
            ("its rest pose", pose("rest", format), &without, 0.2),
            ("a T pose", pose("t", format), &solved, 0.5),
            ("a result", moved(format), &without, 0.2),
        ];
        for (what, bytes, expected, most) in files {
            let outcome = match (Job { target_rest: Some((&bytes, name)), ..plain }).run() {
                Ok(outcome) => outcome,
                Err(failure) => {
                    problems.push(format!("{what} in {name}: {failure:?}"));
                    continue;
                }
            };
            let degrees = limb_degrees(&scene, &outcome, expected);
            let (doubts, facts) = (doubts(&outcome), &outcome.report.rigs.target);
            if degrees > most || !(doubts.is_empty() || doubts == ["rest_roll_guessed"]) {
                problems.push(format!("{what} in {name}: {degrees:.2}°, {doubts:?}, {}", facts.rest_pose_reason));
            }
            assert_eq!(facts.rest_pose_from, "upload", "{what} in {name}");
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn a_source_rests_as_its_rest_file() {
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    let plain = Job {
        source: &walk,
        target: &mannequin,
        source_rest: None,
        target_rest: None,
        config: "{}",
        format: Format::Glb,
    };
    let without = plain.run().expect("a result");
    let config = pose_config("rest");
    let scene = read(&mannequin, "mannequin.glb");
    for (format, name) in FORMATS {
        let rest = Job { config: &config, source: &walk, target: &walk, format, ..plain }.run().expect("a pose");
        let rest = Some((rest.outputs[0].bytes.as_slice(), name));
        let outcome = Job { source_rest: rest, ..plain }.run().expect("a result");
        let degrees = limb_degrees(&scene, &outcome, &without);
        assert!(degrees < 0.2, "{name}: {degrees:.2}°, {}", outcome.report.rigs.source.rest_pose_reason);
        assert_eq!(doubts(&outcome), [""; 0], "{name}");
    }
}

#[test]
fn strict_refuses_what_a_rest_file_leaves_open() {
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    let job = Job {
        source: &walk,
        target: &mannequin,
        source_rest: None,
        target_rest: None,
        config: r#"{"strict": true}"#,
        format: Format::Glb,
    };
    let config = pose_config("t");
    let pose = Job { config: &config, format: Format::Bvh, ..job }.run().expect("a pose").outputs.remove(0).bytes;
    let failure = Job { target_rest: Some((&pose, "t.bvh")), ..job }.run().expect_err("how bones are rolled is open");
    assert!(failure.errors.iter().any(|error| error.code == "rest_roll_guessed"), "{failure:?}");
    let failure = Job { target_rest: Some((&walk, "walk.glb")), ..job }.run().expect_err("the file of the source");
    assert!(failure.hint.contains("swapped"), "{failure:?}");
}

/// The sample mannequin as programs save characters in the middle of a clip: its nodes crouch, and its skin says how it was bound.
fn crouching_mannequin() -> Vec<u8> {
    let whole = samples::mannequin();
    let mut document = gltf_json(&whole);
    let length = u32::from_le_bytes(whole[12..16].try_into().expect("four bytes")) as usize;
    let turns = [("thigh_l", 80.0), ("thigh_r", 80.0), ("calf_l", -110.0), ("calf_r", -110.0), ("upperarm_r", 60.0)];
    for node in document["nodes"].as_array_mut().expect("nodes") {
        let turn = turns.iter().find(|(name, _)| node["name"] == *name);
        let Some((_, degrees)) = turn else { continue };
        let own: [f64; 4] =
            node.get("rotation").map_or([0.0, 0.0, 0.0, 1.0], |own| serde_json::from_value(own.clone()).expect("four"));
        let turned = DQuat::from_array(own) * DQuat::from_rotation_x(f64::to_radians(*degrees));
        node["rotation"] = serde_json::json!(turned.to_array());
    }
    formats::glb_file(&document, &whole[28 + length..]).expect("a GLB")
}

/// Thighs, shins and arms of a rest pose as directions.
fn limbs_at_rest(scene: &Scene) -> Vec<DVec3> {
    let (rig, _) = rig_of(scene, None, &RigSpec::default()).expect("a rig");
    let place = |role: &str| rig.canonical_from_scene * rig.rest.transforms()[rig.role(role)[0]].translation;
    let bones = [("thigh", "shin"), ("shin", "foot"), ("upper_arm", "forearm"), ("forearm", "hand")];
    let of_side = |side: &str| {
        bones.map(|(from, to)| (place(&format!("{side}_{to}")) - place(&format!("{side}_{from}"))).normalize())
    };
    ["left", "right"].into_iter().flat_map(of_side).collect()
}

#[test]
fn a_file_without_the_mesh_rests_as_the_mesh_was_bound() {
    let (walk, mannequin) = (samples::walk_clip(), crouching_mannequin());
    let scene = read(&mannequin, "crouching.glb");
    let (rig, _) = rig_of(&scene, None, &RigSpec::default()).expect("a rig");
    assert_eq!(rig.rest_source, RestSource::Bind, "the nodes crouch");
    let bound = limbs_at_rest(&scene);
    let plain = Job {
        source: &walk,
        target: &mannequin,
        source_rest: None,
        target_rest: None,
        config: r#"{"output": {"include": "skeleton+animation"}}"#,
        format: Format::Glb,
    };
    let upright = Job { target: &samples::mannequin(), ..plain }.run().expect("a result");
    for (format, name) in FORMATS {
        let result = Job { format, ..plain }.run().expect("a result");
        let written = read(&result.outputs[0].bytes, name);
        for (index, (limb, bound)) in limbs_at_rest(&written).into_iter().zip(&bound).enumerate() {
            let degrees = limb.angle_between(*bound).to_degrees();
            assert!(degrees < 0.1, "{name}: limb {index} rests {degrees} degrees off");
        }
        if format == Format::Glb {
            let degrees = limb_degrees(&samples::mannequin_scene(), &result, &upright);
            assert!(degrees < 0.5, "and moves as before: {degrees}");
        }
    }
}
