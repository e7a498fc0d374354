//! `POST /v1/poses` on the binary, with the real engine.

use reqwest::{Client, Response, StatusCode, multipart::Form, multipart::Part};
use retargetd::samples;

use super::support::{PATIENCE, ServiceProcess, header, problem, start_service};

async fn pose(server: &ServiceProcess, query: &str, parts: &[(&'static str, Vec<u8>)]) -> Response {
    let form = parts.iter().fold(Form::new(), |form, (name, bytes)| {
        let ending = if *name == "config" { "json" } else { "glb" };
        form.part(*name, Part::bytes(bytes.clone()).file_name(format!("{name}.{ending}")))
    });
    let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
    client.post(format!("{}/v1/poses{query}", server.url)).multipart(form).send().await.expect("an answer")
}

async fn rest_pose(answer: Response) -> String {
    assert_eq!(answer.status(), StatusCode::OK, "ended within the wait");
    assert!(!header(&answer, "job-id").is_empty(), "it was a job");
    let bytes = answer.bytes().await.expect("a body");
    let file = retargetd::engine::NamedBytes { name: "pose.glb", bytes: &bytes };
    let limits = retargetd::engine::Limits::default();
    let found = retargetd::engine::inspect(file, &limits, &retargetd::model::Control::new()).expect("a file");
    assert_eq!(found.clips.len(), 1, "one clip, which holds the pose");
    // The skins stay bound as they were; how the nodes stand is what was asked for.
    let scene = crate::quality::figure::read_scene(&bytes, "pose.glb");
    let spec: retargetd::retarget::RetargetSpec =
        retargetd::retarget::parse_spec(br#"{"target": {"rest": "nodes"}}"#).expect("a spec");
    let mut reporter = retargetd::model::Reporter::new();
    let rig = retargetd::rig::Rig::new("target", &scene, None, &spec.target, &mut reporter).expect("a rig");
    rig.recognition.rest_pose.name().to_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_character_comes_back_in_the_pose_that_was_asked_for() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let (mannequin, walk) = (samples::mannequin(), samples::walk_clip());
    let target = ("target", mannequin.clone());
    assert_eq!(rest_pose(pose(&server, "", std::slice::from_ref(&target)).await).await, "T", "without a word");
    assert_eq!(rest_pose(pose(&server, "?to=a", std::slice::from_ref(&target)).await).await, "A", "as asked");
    assert_eq!(rest_pose(pose(&server, "?to=rest", std::slice::from_ref(&target)).await).await, "A", "its own");
    let both = [target.clone(), ("source", walk.clone())];
    assert_eq!(rest_pose(pose(&server, "", &both).await).await, "T", "as the other character's");

    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    zip.start_file("folder/mannequin.glb", zip::write::SimpleFileOptions::default()).expect("a member");
    std::io::Write::write_all(&mut zip, &mannequin).expect("written");
    let zipped = [("target", zip.finish().expect("an archive").into_inner())];
    assert_eq!(rest_pose(pose(&server, "?to=a", &zipped).await).await, "A", "out of an archive");

    problem(pose(&server, "", &[("source", walk.clone())]).await, 422, "missing_part").await;
    problem(pose(&server, "?to=source", std::slice::from_ref(&target)).await, 422, "missing_part").await;
    problem(pose(&server, "?to=x", std::slice::from_ref(&target)).await, 400, "malformed_request").await;
    let config = [target.clone(), ("config", b"{}".to_vec())];
    let refused = problem(pose(&server, "", &config).await, 422, "unknown_part").await;
    assert!(refused["hint"].as_str().is_some_and(|hint| hint.contains("/v1/retarget")), "where one goes: {refused}");
    let nonsense = [("target", b"nonsense".to_vec())];
    problem(pose(&server, "", &nonsense).await, 415, "unsupported_format").await;
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}
