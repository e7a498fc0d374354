//! `retargetd annotate`, by the real binary.

use std::{
    path::Path,
    process::{Command, Output},
};

use super::{png, styles};

pub(crate) fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_retargetd")).args(arguments).current_dir(folder).output().expect("it starts")
}

pub(crate) fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_picture_becomes_a_folder_that_is_drawn() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let drawn = styles::tiny();
    std::fs::write(folder.path().join("hero.png"), png(&drawn)).expect("written");
    let annotated = run(folder.path(), &["annotate", "hero.png", "--output", "hero", "--json"]);
    assert!(annotated.status.success(), "{}", said(&annotated));
    let view: serde_json::Value = serde_json::from_slice(&annotated.stdout).expect("JSON");
    assert_eq!((&view["rig"], view["skeleton"].as_array().map(Vec::len)), (&"humanoid".into(), Some(16)));
    for name in ["char_cfg.yaml", "texture.png", "mask.png", "joint_overlay.png", "bounding_box.yaml"] {
        assert!(folder.path().join("hero").join(name).is_file(), "{name}");
    }
    std::fs::write(folder.path().join("walk.glb"), retargetd::samples::walk_clip()).expect("written");
    for (drawing, told) in [("hero", ""), ("hero.png", "the drawing was annotated")] {
        let drawn = run(folder.path(), &["draw", "--drawing", drawing, "--source", "walk.glb", "--output", "hero.npz"]);
        assert!(drawn.status.success() && said(&drawn).contains(told), "{drawing}: {}", said(&drawn));
    }
    for (drawing, annotated) in [("hero", serde_json::Value::Null), ("hero.png", "humanoid".into())] {
        let seen = run(folder.path(), &["inspect", drawing, "--json"]);
        assert!(seen.status.success(), "{drawing}: {}", said(&seen));
        let view: serde_json::Value = serde_json::from_slice(&seen.stdout).expect("JSON");
        assert_eq!((&view["format"], &view["drawing"]["annotated"]), (&"drawing".into(), &annotated), "{view}");
        assert_eq!((&view["counts"]["joints"], &view["drawing"]["mask_parts"]), (&16.into(), &1.into()), "{view}");
        assert!(view["drawing"]["mask_pixels"].as_u64().is_some_and(|pixels| pixels > 1000), "{view}");
        let page = run(folder.path(), &["inspect", drawing]);
        assert!(String::from_utf8_lossy(&page.stdout).contains("right_elbow"), "a page for people");
    }
    std::fs::create_dir(folder.path().join("empty")).expect("a folder");
    let nothing = run(folder.path(), &["inspect", "empty"]);
    assert!(nothing.status.code() == Some(3) && said(&nothing).contains("char_cfg.yaml"), "{}", said(&nothing));
    let again = run(folder.path(), &["annotate", "hero.png", "--output", "hero", "--no-clobber"]);
    assert_eq!(again.status.code(), Some(2), "{}", said(&again));
    let animal = styles::pig();
    std::fs::write(folder.path().join("pig.png"), png(&animal)).expect("written");
    let refused = run(folder.path(), &["annotate", "pig.png", "--output", "pig", "--rig", "humanoid"]);
    assert_eq!(refused.status.code(), Some(3), "{}", said(&refused));
    assert!(said(&refused).contains("picture pig.png") && said(&refused).contains("hint: "), "{}", said(&refused));
    assert!(!folder.path().join("pig").exists(), "nothing is written");
}
