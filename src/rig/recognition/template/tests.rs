//! Templates: the built-in ones hold together, own ones are compared as they say, wrong ones are refused with a place.

use serde_json::{Value, json};

use super::{RigTemplate, builtin_templates, find, find::TemplateMatch, parse_template};
use crate::{
    model::{Joint, Skeleton, Transform},
    rig::Role,
};

fn skeleton(names: &[String]) -> Skeleton {
    let joint = |(node, name): (usize, &String)| Joint {
        name: name.clone(),
        parent: node.checked_sub(1),
        rest: Transform::IDENTITY,
        is_joint: true,
        node,
    };
    Skeleton::new(names.iter().enumerate().map(joint).collect()).expect("a chain")
}

/// One joint for every name that a template knows, in its first spelling and behind its first prefix.
fn names_of(template: &RigTemplate) -> Vec<(String, String)> {
    let prefix = template.prefixes.first().cloned().unwrap_or_default();
    let words: Vec<String> = template.sides.iter().flatten().filter_map(|side| side.first().cloned()).collect();
    let mut names: Vec<(String, String)> = Vec::new();
    let others = template.expected.iter().chain(&template.required).map(|name| ("", name));
    for (role, name) in template
        .roles
        .iter()
        .flat_map(|(role, names)| names.iter().map(move |name| (role.as_str(), name)))
        .chain(others)
    {
        let first = name.split('|').next().expect("one spelling");
        if first.contains("{side}") {
            for (side, word) in ["left_", "right_"].iter().zip(&words) {
                let role = if role.is_empty() { String::new() } else { format!("{side}{role}") };
                names.push((role, format!("{prefix}{}", first.replace("{side}", word))));
            }
        } else {
            names.push((role.to_owned(), format!("{prefix}{first}")));
        }
    }
    names
}

#[test]
fn every_built_in_template_is_found_by_its_own_joints() {
    assert!(builtin_templates().len() > 30, "the file is read");
    for template in builtin_templates() {
        let document = serde_json::to_value(template).expect("JSON");
        assert_eq!(parse_template(document), Ok(template.clone()), "{}: it is allowed to users", template.name);
        let names = names_of(template);
        let joints: Vec<String> = names.iter().map(|(_, name)| name.clone()).collect();
        let found = find(&skeleton(&joints), &[]).expect("a template");
        assert_eq!(found.name, template.name, "by {joints:?}");
        assert!(!found.is_own, "{}", template.name);
        for (role, name) in names.iter().filter(|(role, _)| !role.is_empty()) {
            let role: Role = role.parse().expect("a role");
            let joints_of_role: Vec<&String> = found.roles[&role].iter().map(|joint| &joints[*joint]).collect();
            assert!(joints_of_role.contains(&name), "{}: {role} is {joints_of_role:?}, not {name}", template.name);
        }
    }
    let mut names: Vec<&str> = builtin_templates().iter().map(|template| template.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), builtin_templates().len(), "names are unique");
}

fn own(changes: &Value) -> Value {
    let mut document = json!({
        "name": "house_rig", "kind": "biped", "prefixes": ["HR_"], "sides": [["a"], ["b"]],
        "roles": {"pelvis": ["k1"], "forearm": ["m{side}|n{side}"], "left_hand": ["h*x"], "head": ["top"]},
    });
    for (key, value) in changes.as_object().expect("an object") {
        document[key] = value.clone();
    }
    document
}

fn found(changes: &Value, names: &[&str]) -> Option<TemplateMatch> {
    let template = parse_template(own(changes)).expect("a template");
    let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
    find(&skeleton(&names), &[template])
}

#[test]
fn own_templates_are_compared_as_they_say() {
    let all = ["space:hr_K-1", "HR_na", "HR_mb", "HR2_hand_x", "HR_top", "other"];
    let whole = found(&json!({}), &all).expect("all are there");
    assert!(whole.is_own, "one of the user's");
    let roles: Vec<(String, Vec<usize>)> =
        whole.roles.iter().map(|(role, joints)| (role.to_string(), joints.clone())).collect();
    let expected = [("pelvis", 0), ("head", 4), ("left_forearm", 1), ("left_hand", 3), ("right_forearm", 2)];
    let expected: Vec<(String, Vec<usize>)> =
        expected.iter().map(|(role, joint)| ((*role).to_owned(), vec![*joint])).collect();
    let sorted = |mut roles: Vec<(String, Vec<usize>)>| {
        roles.sort();
        roles
    };
    assert_eq!(sorted(roles), sorted(expected), "every role and spelling");

    assert!(found(&json!({}), &all[..4]).is_some(), "four of five are 80 %");
    assert!(found(&json!({}), &all[..3]).is_none(), "three of five are 60 %");
    assert!(found(&json!({"at_least": 0.5}), &all[..3]).is_some(), "unless less is asked for");
    assert!(found(&json!({"prefixes": []}), &all).is_none(), "names without the prefix are others");
    let bare = ["k1", "ma", "mb", "hx", "top"];
    assert!(found(&json!({"prefixes": [""]}), &bare).is_some(), "no prefix at all");
    assert!(found(&json!({"prefixes": [""], "required": ["tail"]}), &bare).is_none(), "a joint is missing");
    assert!(found(&json!({"prefixes": [""], "excluded": ["top"]}), &bare).is_none(), "a joint is another rig's");
}

#[test]
fn wrong_templates_are_refused_with_a_place() {
    let cases = [
        (json!({"name": "House Rig"}), "/name", "lower-case"),
        (json!({"kind": "snake"}), "/kind", "biped"),
        (json!({"at_least": 0.1}), "/at_least", "between"),
        (json!({"roles": {}}), "/roles", "says nothing"),
        (json!({"roles": {"forarm": ["x"]}}), "/roles/forarm", "no role"),
        (json!({"roles": {"forearm": ["x"]}}), "/roles/forearm/0", "{side}"),
        (json!({"roles": {"pelvis": [""]}}), "/roles/pelvis/0", "letter"),
        (json!({"roles": {"pelvis": []}}), "/roles/pelvis", "no joint"),
        (json!({"sides": null, "roles": {"hand": ["h{side}"]}}), "/roles/hand/0", "sides"),
        (json!({"expected": ["x|"]}), "/expected/0", "letter"),
        (json!({"sides": [[], ["b"]]}), "/sides", "spelling"),
        (json!({"role": {}}), "/role", "no field"),
    ];
    for (changes, pointer, words) in cases {
        let error = parse_template(own(&changes)).expect_err("it is wrong");
        let field = error.fields.first().expect("a place");
        assert_eq!(field.pointer, pointer, "{changes}: {error}");
        assert!(field.detail.contains(words), "{changes}: {}", field.detail);
    }
    assert_eq!(parse_template(own(&json!({"role": {}}))).expect_err("wrong").fields[0].did_you_mean, ["roles"], "near");
    assert!(parse_template(json!([1])).expect_err("no object").detail.contains("object"), "said so");
}
