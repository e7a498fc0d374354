//! The reference cases of the IK rig retargeter: poses in, its config, poses out, through the command line.
//!
//! The bar: positions within 1e-6 of the figure's size, rotations within 1e-3 degree.

use std::{path::Path, process::Command};

use retargetd::model::Transform;
use serde_json::{Value, json};

use crate::{
    npz::{self, Array},
    support::{shared_folder, skip},
};

const POSITION_BAR: f64 = 1e-6;
const ROTATION_BAR_DEGREES: f64 = 1e-3;

#[test]
#[expect(clippy::print_stderr, reason = "the figures are worth seeing even when they pass")]
fn every_reference_case_is_reproduced() {
    let folder = shared_folder().join("parity/ikrigretarget");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        skip(&format!("{} is not there", folder.display()));
        return;
    };
    let mut cases: Vec<String> = entries
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter_map(|name| name.strip_suffix(".json").map(str::to_owned))
        .collect();
    cases.sort();
    assert!(!cases.is_empty(), "the folder holds cases");
    for case in cases {
        let (position, degrees) = Case::read(&folder, &case).worst_errors();
        eprintln!("{case}: position {position:.2e} of the figure's size, rotation {degrees:.2e} degrees");
        assert!(position <= POSITION_BAR, "{case}: position {position:.3e}");
        assert!(degrees <= ROTATION_BAR_DEGREES, "{case}: rotation {degrees:.3e}");
    }
}

struct Case {
    facts: Value,
    source_rest: Array,
    source: Array,
    target_rest: Array,
    expected: Array,
}

impl Case {
    fn read(folder: &Path, name: &str) -> Self {
        let text = std::fs::read_to_string(folder.join(format!("{name}.json"))).expect("the case's facts");
        let arrays = npz::read(&std::fs::read(folder.join(format!("{name}.npz"))).expect("arrays"));
        let array = |key: &str| arrays.array(key);
        Self {
            facts: serde_json::from_str(&text).expect("JSON"),
            source_rest: array("source_rest_local_srccoord"),
            source: array("source_local_srccoord"),
            target_rest: array("target_rest_local_tgtcoord"),
            expected: array("target_local_tgtcoord"),
        }
    }

    fn config(&self) -> Value {
        let facts = &self.facts;
        let mapping = |entry: &Value| json!([entry["fk"], entry["ik"], entry["source"], entry["target"]]);
        json!({
            "SourceCoord": facts["source_coord"], "WorkCoord": facts["work_coord"], "TargetCoord": facts["target_coord"],
            "SourceRootType": facts["source_root"]["type"], "SourceRootBone": facts["source_root"]["bone"],
            "SourceGroundBone": facts["source_root"]["ground_bone"],
            "TargetRootType": facts["target_root"]["type"], "TargetRootBone": facts["target_root"]["bone"],
            "TargetGroundBone": facts["target_root"]["ground_bone"],
            "SourceChains": facts["source_chains"], "TargetChains": facts["target_chains"],
            "ChainMapping": facts["chain_mapping"].as_array().expect("a list").iter().map(mapping).collect::<Vec<_>>(),
        })
    }

    fn poses(names: &Value, parents: &Value, rest: &Array, motion: Option<&Array>) -> Value {
        let rest_part = |from, to| (0..rest.shape[0]).map(|joint| rest.row(&[joint])[from..to].to_vec()).collect();
        let rows: [Vec<Vec<f64>>; 3] = [rest_part(0, 3), rest_part(3, 7), rest_part(7, 10)];
        let mut poses = json!({
            "joint_names": names, "parents": parents,
            "rest_translations": rows[0], "rest_rotations": rows[1], "rest_scales": rows[2],
        });
        if let Some(motion) = motion {
            let part = |from: usize, to: usize| -> Vec<Vec<Vec<f64>>> {
                let joints =
                    |frame| (0..motion.shape[1]).map(move |joint| motion.row(&[frame, joint])[from..to].to_vec());
                (0..motion.shape[0]).map(|frame| joints(frame).collect()).collect()
            };
            poses["times"] = (0..motion.shape[0]).map(|frame| frame as f64 / 30.0).collect();
            poses["translations"] = json!(part(0, 3));
            poses["rotations"] = json!(part(3, 7));
            poses["scales"] = json!(part(7, 10));
        }
        poses
    }

    /// Worst position error as a share of the figure's size, and worst rotation error in degrees, over all frames and joints.
    fn worst_errors(&self) -> (f64, f64) {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, value: &Value| {
            let path = folder.path().join(name);
            std::fs::write(&path, value.to_string()).expect("written");
            path
        };
        let facts = &self.facts;
        let source =
            Self::poses(&facts["source_names"], &facts["source_parents"], &self.source_rest, Some(&self.source));
        let target = Self::poses(&facts["target_names"], &facts["target_parents"], &self.target_rest, None);
        let output = folder.path().join("out.json");
        let run = Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .arg("retarget")
            .args(["--source".as_ref(), write("source.json", &source).as_os_str()])
            .args(["--target".as_ref(), write("target.json", &target).as_os_str()])
            .args(["--config".as_ref(), write("config.json", &self.config()).as_os_str()])
            .args(["--output".as_ref(), output.as_os_str()])
            .output()
            .expect("the binary runs");
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let result: Value = serde_json::from_slice(&std::fs::read(&output).expect("an output")).expect("JSON");
        self.compare(&result)
    }

    fn compare(&self, result: &Value) -> (f64, f64) {
        let parents: Vec<i64> = self.facts["target_parents"]
            .as_array()
            .expect("a list")
            .iter()
            .map(|parent| parent.as_i64().expect("an index"))
            .collect();
        assert_eq!(result["joint_names"], self.facts["target_names"], "same joints in the same order");
        let (frames, joints) = (self.expected.shape[0], self.expected.shape[1]);
        let (mut size, mut distance, mut degrees) = (0.0_f64, 0.0_f64, 0.0_f64);
        for frame in 0..frames {
            let ours = |joint: usize| {
                let row = |key: &str| numbers(&result[key][frame][joint]);
                transform(&[row("translations"), row("rotations"), row("scales")].concat())
            };
            let theirs = |joint: usize| transform(self.expected.row(&[frame, joint]));
            let (ours, theirs) = (to_model(&parents, joints, ours), to_model(&parents, joints, theirs));
            let root = theirs[0].translation;
            for (ours, theirs) in ours.iter().zip(&theirs) {
                size = size.max((theirs.translation - root).length());
                distance = distance.max((ours.translation - theirs.translation).length());
                degrees =
                    degrees.max(ours.rotation.normalize().angle_between(theirs.rotation.normalize()).to_degrees());
            }
        }
        (distance / size, degrees)
    }
}

fn to_model(parents: &[i64], joints: usize, local: impl Fn(usize) -> Transform) -> Vec<Transform> {
    let mut model: Vec<Transform> = Vec::with_capacity(joints);
    for (joint, parent) in parents.iter().enumerate().take(joints) {
        let local = local(joint);
        model.push(usize::try_from(*parent).map_or(local, |parent| model[parent].then_child(&local)));
    }
    model
}

fn transform(row: &[f64]) -> Transform {
    Transform {
        translation: glam::DVec3::from_slice(&row[..3]),
        rotation: glam::DQuat::from_slice(&row[3..7]).normalize(),
        scale: glam::DVec3::from_slice(&row[7..10]),
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|number| number.as_f64().expect("a number")).collect()
}
