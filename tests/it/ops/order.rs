//! Ops run in the order given, and say so where they do not.

use super::stage::Stage;

#[test]
fn what_runs_behind_kinematics_is_told() {
    let codes = |ops: &str| Stage::walk().play(&format!(r#"{{"ops": [{ops}]}}"#)).warnings;
    let told = |ops: &str| codes(ops).iter().filter(|code| **code == "op_runs_behind_kinematics").count();
    let filter = r#"{"op": "filter"}"#;
    let kinematics = r#"{"op": "pelvis"}, {"op": "fk"}"#;
    assert_eq!(told(&format!("{kinematics}, {filter}")), 0, "it runs where it stands");
    assert_eq!(told(&format!("{filter}, {kinematics}")), 1, "it does not");
    let twist = r#"{"op": "twist"}"#;
    assert_eq!(told(&format!(r#"{{"op": "pelvis"}}, {filter}, {twist}, {{"op": "fk"}}"#)), 2, "one for each op");
    let source = r#"{"op": "scale_source", "factor": 1}, {"op": "contacts"}"#;
    assert_eq!(told(&format!("{source}, {kinematics}")), 0, "ops on the source are not about the pose");
    let off = r#"{"op": "filter", "enabled": false}"#;
    assert_eq!(told(&format!("{off}, {kinematics}")), 0, "an op that does not run");
}
