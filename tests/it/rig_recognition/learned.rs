//! Templates made from real rigs, and what they say of the same rigs again.

use retargetd::{
    model::Reporter,
    rig::{Rig, RigSpec, RigTemplate, Role, parse_template},
};

use super::stripped::samples;

#[test]
fn a_rig_is_known_by_the_template_that_was_learned_from_it() {
    let (mut learned, mut all, mut missed) = (0, 0, Vec::new());
    for sample in samples() {
        let (scene, spec) = (&sample.scene, RigSpec::default());
        let rig = Rig::new("source", scene, None, &spec, &mut Reporter::new()).expect("a rig");
        let found = &rig.recognition;
        let roles = found.roles.iter().map(|(role, finding)| (*role, finding.joints.as_slice()));
        let template = RigTemplate::learn("House Rig 7", found.kind, &scene.skeleton, roles);
        // No body, or one whose joints share their names.
        let Some(template) = template else { continue };
        // What users keep has been read from a document.
        let template = parse_template(serde_json::to_value(&template).expect("a document"));
        let template = template.unwrap_or_else(|error| panic!("{}: {error:?}", sample.path));
        assert_eq!(template.name, "house_rig_7", "a name that templates may have");
        let again = Rig::with_recognizer(
            "source",
            scene,
            None,
            &spec,
            std::slice::from_ref(&template).into(),
            &mut Reporter::new(),
        );
        let again = again.expect("a rig").recognition;
        if scene.declared_roles.is_empty() {
            assert_eq!(again.recognised_as.as_deref(), Some("house_rig_7"), "{}", sample.path);
        }
        for role in template.roles.keys() {
            let role: Role = role.parse().expect("a role");
            let (first, second) = (&found.roles[&role], again.roles.get(&role));
            all += 1;
            if second.map(|finding| finding.joints[0]) != Some(first.joints[0]) {
                missed.push(format!("{}: {role}", sample.path));
            }
        }
        learned += 1;
    }
    // Rigs of several layers have a joint for each; a template says which, and the rest of the body may say another.
    assert!(missed.len() * 100 <= all, "{} of {all} roles are other ones: {missed:?}", missed.len());
    assert!(learned == 0 || learned > 80, "most files of the corpus hold a body with names: {learned}");
}
