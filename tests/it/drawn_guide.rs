//! The pictures of the guide to drawings are what the commands beside them make.

use std::{path::Path, process::Command};

/// Pixels of a picture that may differ, for machines that round otherwise.
const APART: f64 = 0.01;

fn run(folder: &Path, arguments: &[&str]) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_retargetd")).args(arguments).current_dir(folder).output().expect("it starts");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// The frames of a GIF, or the one picture of a PNG.
fn frames(bytes: &[u8]) -> Vec<Vec<u8>> {
    if !bytes.starts_with(b"GIF") {
        let picture = retargetd::picture::read_picture(bytes).expect("a picture");
        return vec![picture.pixels.into_flattened()];
    }
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut reader = options.read_info(bytes).expect("a GIF");
    let mut frames = Vec::new();
    while let Some(frame) = reader.read_next_frame().expect("a frame") {
        let mut seen = vec![frame.left as u8, frame.top as u8];
        seen.extend_from_slice(&frame.buffer);
        frames.push(seen);
    }
    frames
}

#[test]
fn pictures_of_the_guide_are_what_the_commands_make() {
    let folder = tempfile::tempdir().expect("a folder");
    let guide = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/guide/drawings.md");
    let guide = std::fs::read_to_string(guide).expect("the guide");
    let line = guide.lines().find(|line| line.starts_with("echo '{")).expect("the config of the guide");
    let config = line.split('\'').nth(1).expect("a config");
    std::fs::write(folder.path().join("small.json"), config).expect("written");
    let archive = retargetd::samples::drawing();
    let limits = retargetd::formats::Limits::default();
    let files = retargetd::formats::unpack_files(&archive, &["png"], &limits, &retargetd::model::Control::new());
    let (_, texture) =
        files.expect("files").into_iter().find(|(name, _)| name.ends_with("texture.png")).expect("a texture");
    for (name, bytes) in
        [("drawing.zip", archive), ("walk.glb", retargetd::samples::walk_clip()), ("hero.png", texture)]
    {
        std::fs::write(folder.path().join(name), bytes).expect("written");
    }
    let draw = "draw --drawing drawing.zip --source walk.glb --config small.json --output drawing_walk.gif";
    run(folder.path(), &draw.split(' ').collect::<Vec<_>>());
    run(folder.path(), &["annotate", "hero.png", "--output", "found"]);
    #[expect(clippy::disallowed_methods, reason = "tests have no settings")]
    let update = std::env::var_os("RETARGETD_UPDATE").is_some();
    for (made, shown) in [("drawing_walk.gif", "drawing_walk.gif"), ("found/joint_overlay.png", "drawing_joints.png")] {
        assert!(guide.contains(shown), "the guide shows {shown}");
        let made = std::fs::read(folder.path().join(made)).expect("a picture");
        let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/pictures").join(shown);
        if update {
            std::fs::write(&place, &made).expect("written");
        }
        let (made, kept) = (frames(&made), frames(&std::fs::read(&place).expect("the picture of the guide")));
        assert_eq!(made.len(), kept.len(), "{shown}: its frames");
        for (frame, (made, kept)) in made.iter().zip(&kept).enumerate() {
            assert_eq!(made.len(), kept.len(), "{shown}: the size of frame {frame}");
            let apart = made.iter().zip(kept).filter(|(one, other)| one.abs_diff(**other) > 8).count();
            assert!(
                apart as f64 <= APART * made.len() as f64,
                "{shown}: frame {frame} differs; RETARGETD_UPDATE=1 writes it anew"
            );
        }
    }
}
