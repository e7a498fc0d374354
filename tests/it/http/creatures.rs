//! Rigs of animals that users teach: with templates of their own, where neither names nor shape say anything.

use reqwest::{Client, StatusCode};
use retargetd::{
    formats::{self, Format, Include, TargetClips, WriteOptions},
    model::{Control, JointTracks, Reporter},
};
use serde_json::{Value, json};

use super::support::{json as read, start_service};
use crate::made_animals::{Beast, Random, ant, dragon};

/// The animal as pose arrays, with joints called `krel_0` and so on that lie in a heap: nothing can be seen in them.
fn heap(beast: &Beast) -> Vec<u8> {
    let mut random = Random(9);
    let mut scene = beast.scene(glam::DQuat::IDENTITY, 1.0, &mut random);
    let joints = scene.skeleton.joints().iter().cloned().enumerate().map(|(index, mut joint)| {
        joint.name = format!("krel_{index}");
        joint.rest.translation = random.direction() * random.between(0.1, 0.4);
        joint
    });
    scene.skeleton = retargetd::model::Skeleton::new(joints.collect()).expect("the same tree");
    let tracks = vec![JointTracks::default(); scene.skeleton.len()];
    let clip = retargetd::model::Clip::new("still".into(), vec![0.0], tracks).expect("a clip");
    let (format, include, target_clips) = (Format::PosesJson, Include::Everything, TargetClips::Keep);
    let options = WriteOptions { include, target_clips, ..WriteOptions::new(format) };
    formats::write(&scene, &clip, &options, &Control::new(), &mut Reporter::new()).expect("it can be written")
}

/// What a user says of it.
fn template(beast: &Beast, kind: &str) -> Value {
    let names = |joints: &Vec<usize>| joints.iter().map(|joint| format!("krel_{joint}")).collect::<Vec<_>>();
    let roles: serde_json::Map<String, Value> =
        beast.roles.iter().map(|(role, joints)| (role.to_string(), json!(names(joints)))).collect();
    json!({"kind": kind, "title": "One of ours", "roles": roles})
}

#[tokio::test(flavor = "multi_thread")]
async fn animals_of_ones_own_are_recognized_by_their_templates() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let client = Client::builder().no_proxy().build().expect("a client");
    for (name, beast, kind) in [("our_dragon", dragon(), "quadruped"), ("our_ant", ant(), "other")] {
        let url = format!("{}/v1/assets?filename={name}.json", server.url);
        let asset = read(client.post(url).body(heap(&beast)).send().await.expect("an answer")).await;
        let skeleton = format!("{}{}", server.url, asset["skeleton"].as_str().expect("a place"));
        let before = read(client.get(&skeleton).send().await.expect("an answer")).await;
        let legs = |answer: &Value| {
            let roles = answer["rigs"][0]["roles"].as_object().cloned().unwrap_or_default();
            roles.keys().filter(|role| role.contains("_leg")).count()
        };
        assert_eq!(legs(&before), 0, "{name}: a heap has no legs: {}", before["rigs"][0]["roles"]);

        let url = format!("{}/v1/rigs/{name}", server.url);
        let kept = client.put(&url).json(&template(&beast, kind)).send().await.expect("an answer");
        assert_eq!(kept.status(), StatusCode::CREATED, "{name}: {}", kept.text().await.expect("text"));
        let after = read(client.get(&skeleton).send().await.expect("an answer")).await;
        let rig = &after["rigs"][0];
        assert_eq!((&rig["recognised_as"], &rig["kind"]), (&json!(name), &json!(kind)), "{name}");
        for (role, joints) in &beast.roles {
            let role = role.to_string();
            let first = format!("krel_{}", joints[0]);
            let seen = &rig["roles"][&role];
            assert!(*seen == first || seen[0] == first, "{name}: {role} is {seen}, not {first}");
        }
        let files = json!({"source": {"asset": asset["id"]}, "target": {"asset": asset["id"]}});
        let url = format!("{}/v1/mapping-suggestions", server.url);
        let suggestion = read(client.post(url).json(&files).send().await.expect("an answer")).await;
        let roles = suggestion["roles"].as_array().expect("roles");
        assert_eq!(roles.len(), beast.roles.len(), "{name}: {suggestion}");
        assert!(roles.iter().all(|pair| pair["confidence"].as_f64() > Some(0.5)), "{name}: {roles:?}");
    }
    let wrong = json!({"kind": "other", "roles": {"left_leg_0": ["a"], "leg_2": ["b"], "left_leg_1": ["c"]}});
    let url = format!("{}/v1/rigs/wrong", server.url);
    let refused = read(client.put(url).json(&wrong).send().await.expect("an answer")).await;
    let pointers: Vec<&str> =
        refused["errors"].as_array().expect("errors").iter().filter_map(|error| error["pointer"].as_str()).collect();
    assert_eq!(pointers, ["/roles/left_leg_0", "/roles/leg_2/0"], "a pair needs its sides, and legs count from 1");
}
