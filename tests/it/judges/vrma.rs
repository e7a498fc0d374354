//! VRM animations that we write, played by three-vrm on real avatars and read by ourselves.

use std::fs;

use retargetd::engine::Format;

use super::{Axes, MOST_DEGREES, MOST_OF_SIZE, Written, retargeted, three};
use crate::support::{corpus_file, validate_gltf};

const CLIP: &str = "mixamo/gltf/Xbot.glb";
const AVATARS: [&str; 4] = [
    "vrm1/makehuman_body_vrm1.vrm",
    "vrm1/basic_armature_vrm1.vrm",
    "vrm0/makehuman_body_vrm0.vrm",
    "vrm0/godette.vrm",
];
const CONFIG: &str = r#"{"clip": "walk"}"#;

#[test]
fn avatars_play_what_was_made_for_them() {
    let Some(source) = corpus_file(CLIP) else { return };
    let source = fs::read(source).expect("a file");
    let folder = tempfile::tempdir().expect("a folder");
    let (mut written, mut plays) = (Vec::new(), Vec::new());
    for (index, avatar) in AVATARS.iter().enumerate() {
        let Some(path) = corpus_file(avatar) else { return };
        let bytes = fs::read(&path).expect("a file");
        let outcome = retargeted((CLIP, &source), (avatar, &bytes), CONFIG, &[Format::Vrm, Format::Vrma]);
        let file = folder.path().join(format!("{index}.vrma"));
        fs::write(&file, &outcome.outputs[1].bytes).expect("a file");
        plays.push(format!("{}={}", file.display(), path.display()));
        written.push((file, Written::of(&outcome.outputs[0].bytes, "out.vrm")));
    }
    let files: Vec<_> = written.iter().map(|(file, _)| file.as_path()).collect();
    if let Some(reports) = validate_gltf(&files) {
        for report in reports.values() {
            assert_eq!((report["errors"].as_u64(), report["warnings"].as_u64()), (Some(0), Some(0)), "{report}");
        }
    }
    let Some(answers) = three::read(&plays) else { return };
    for (((_, ours), seen), avatar) in written.iter().zip(&answers).zip(AVATARS) {
        let scene = &ours.scene;
        let bone = |joint: usize| scene.declared_roles.iter().find(|(_, declared)| *declared == joint);
        let apart = ours.apart(seen, 1.0, Axes::Same, |joint| {
            let (role, _) = bone(joint)?;
            (!role.ends_with("Eye")).then(|| scene.skeleton.joints()[joint].name.clone())
        });
        assert!(apart.joints > 15, "{avatar}: {apart:?}");
        assert!(apart.size < MOST_OF_SIZE && apart.degrees < MOST_DEGREES, "{avatar}: {apart:?}");
    }
}
