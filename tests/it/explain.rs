//! Explanations: the contributions of a joint, multiplied, are what a retarget of the same inputs gives.

use glam::{DQuat, DVec3};
use retargetd::{
    engine::{
        Control, Explanation, FailureCode, Format, Inputs, Knowledge, Limits, NamedBytes, Question, explain, retarget,
    },
    formats,
    model::{Reporter, Scene},
    samples,
};

use crate::support::corpus_file;

struct Pair {
    source: (String, Vec<u8>),
    target: (String, Vec<u8>),
    config: &'static str,
}

impl Pair {
    fn samples(config: &'static str) -> Self {
        Self {
            source: ("walk.glb".into(), samples::walk_clip()),
            target: ("mannequin.glb".into(), samples::mannequin()),
            config,
        }
    }

    fn corpus(source: &str, target: &str, config: &'static str) -> Option<Self> {
        let read = |name: &str| Some((name.to_owned(), std::fs::read(corpus_file(name)?).expect("readable")));
        Some(Self { source: read(source)?, target: read(target)?, config })
    }

    fn inputs(&self) -> Inputs<'_> {
        Inputs {
            source: NamedBytes { name: &self.source.0, bytes: &self.source.1 },
            target: NamedBytes { name: &self.target.0, bytes: &self.target.1 },
            source_rest: None,
            target_rest: None,
            config: Some(NamedBytes { name: "config.json", bytes: self.config.as_bytes() }),
            formats: &[Format::PosesNpz],
        }
    }

    fn explain(&self, frame: usize, joint: &str) -> Result<Explanation, retargetd::engine::Failure> {
        let question = Question { frame, joint };
        explain(&self.inputs(), &question, &Knowledge::default(), &Limits::default(), &Control::new())
    }

    /// What a retarget gives, read back.
    fn result(&self) -> Scene {
        let outcome = retarget(&self.inputs(), &Limits::default(), &Control::new()).expect("a result");
        let (limits, control) = (Limits::default(), Control::new());
        formats::read(&outcome.outputs[0].bytes, Format::PosesNpz, &limits, &control, &mut Reporter::new())
            .expect("pose arrays")
    }
}

fn product(explanation: &Explanation) -> DQuat {
    let rotations = explanation.contributions.iter().map(|step| DQuat::from_array(step.rotation));
    rotations.fold(DQuat::IDENTITY, |product, rotation| rotation * product)
}

fn apart(first: DQuat, second: DQuat) -> f64 {
    (first - second).length().min((first + second).length())
}

/// Every joint of a result whose file keeps the target's own space.
fn check_all(pair: &Pair, frames: &[usize]) {
    let scene = pair.result();
    let skeleton = &scene.skeleton;
    for &frame in frames {
        let model = scene.clips[0].local_pose(skeleton, frame).to_model(skeleton);
        for joint in (0..skeleton.len()).step_by(3) {
            let name = skeleton.label(joint);
            let explanation = pair.explain(frame, &name).expect("explained");
            let found = model.transforms()[joint].rotation;
            let wanted = product(&explanation);
            assert!(apart(wanted, found) < 1e-6, "'{name}' at {frame}: {wanted} composed, {found} given");
            let result = DQuat::from_array(explanation.result.rotation);
            assert!(apart(result, found) < 1e-6, "'{name}' at {frame}: told {result}, given {found}");
            let rounding = explanation.contributions.iter().find(|step| step.name == "rounding");
            assert!(rounding.is_none(), "'{name}' at {frame}: {rounding:?} is not explained");
            if let Some(position) = &explanation.position {
                let at = model.transforms()[joint].translation;
                let off = DVec3::from_array(position.result).distance(at);
                assert!(
                    off < 1e-5 || explanation.contributions.iter().any(|step| step.moved_meters.is_some()),
                    "{off}"
                );
            }
        }
    }
}

#[test]
fn contributions_compose_to_the_result() {
    check_all(&Pair::samples("{}"), &[0, 57]);
    check_all(&Pair::samples(r#"{"ops": [{"op": "pelvis"}, {"op": "fk", "rotation_alpha": 0.5}]}"#), &[57]);
}

#[test]
fn chains_that_parents_carry_are_explained_too() {
    let config = r#"{"align": "off", "ops": [{"op": "pelvis", "origin": "origin"}, {"op": "fk", "carry": "parent"}]}"#;
    check_all(&Pair::samples(config), &[57]);
}

#[test]
fn real_pairs_are_explained() {
    let pairs =
        [("bvh/cmu/12_01_walk.bvh", "unreal/ue4_names_apose.glb"), ("bvh/fair1/dab_zup.bvh", "mixamo/gltf/Xbot.glb")];
    for (source, target) in pairs {
        let Some(pair) = Pair::corpus(source, target, "{}") else { continue };
        for joint in ["pelvis", "spine_02", "lowerarm_l", "mixamorig:Hips", "mixamorig:LeftForeArm"] {
            let Ok(explanation) = pair.explain(40, joint) else { continue };
            let result = DQuat::from_array(explanation.result.rotation);
            assert!(apart(product(&explanation), result) < 1e-6, "{source} onto {target}: '{joint}'");
            let rounding = explanation.contributions.iter().find(|step| step.name == "rounding");
            assert!(rounding.is_none(), "{source} onto {target}: '{joint}': {rounding:?}");
        }
    }
}

#[test]
fn a_chain_is_turned_as_one() {
    let pair = Pair::samples("{}");
    let turns: Vec<DQuat> = ["spine_01", "spine_02", "spine_03", "spine_04"]
        .iter()
        .filter_map(|joint| {
            let explanation = pair.explain(57, joint).ok()?;
            let step = explanation.contributions.iter().find(|step| step.name == "chain_direction")?;
            Some(DQuat::from_array(step.rotation))
        })
        .collect();
    assert!(turns.len() >= 2, "the spine has joints that are turned with it: {turns:?}");
    assert!(turns.windows(2).all(|pair| apart(pair[0], pair[1]) < 1e-6), "all by the same: {turns:?}");
}

#[test]
fn what_is_not_there_is_named() {
    let pair = Pair::samples("{}");
    let failure = pair.explain(0, "spine_o1").expect_err("no such joint");
    assert_eq!(failure.code, FailureCode::UnknownJoint, "{failure}");
    assert_eq!(failure.errors[0].pointer, "/joint", "the place");
    assert_eq!(failure.errors[0].did_you_mean.first().map(String::as_str), Some("spine_01"), "the nearest name");
    let failure = pair.explain(121, "spine_01").expect_err("no such frame");
    assert_eq!((failure.code, failure.errors[0].pointer.as_str()), (FailureCode::InvalidValue, "/frame"), "{failure}");
}
