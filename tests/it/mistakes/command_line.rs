//! Mistakes on the command line.

use std::{
    path::Path,
    process::{Command, Stdio},
};

use retargetd::samples;

use super::{Told, check};

/// Each with the exit code: 2 for what was typed, 3 for a file, 4 for everything else.
const MISTAKES: [(i32, &str); 61] = [
    (2, "retarget"),
    (2, "retarget --source walk.glb"),
    (2, "retarget --source walk.glb --target hero.glb"),
    (2, "retarget --sorce walk.glb --target hero.glb --output out.glb"),
    (2, "retraget --source walk.glb --target hero.glb --output out.glb"),
    (2, "retarget walk.glb hero.glb out.glb"),
    (2, "retarget --source walk.glb --target hero.glb --output out.xyz"),
    (2, "retarget --source walk.glb --target hero.glb --output out"),
    (2, "retarget --source walk.glb --target hero.glb --output missing/out.glb"),
    (2, "retarget --source walk.glb --target hero.glb --output folder"),
    (2, "retarget --source walk.glb --target hero.glb --output hero.glb"),
    (2, "retarget --source walk.glb --target hero.glb --output ./walk.glb"),
    (2, "retarget --source walk.glb --target hero.glb --output out.glb --output out.glb"),
    (2, "retarget --source walk.glb --target hero.glb --output notes.glb --no-clobber"),
    (2, "retarget --source walk.glb --target hero.glb --output out.glb --force --no-clobber"),
    (2, "retarget --source walk.glb --target hero.glb --output out.glb --fail-on bad"),
    (3, "retarget --source missing.glb --target hero.glb --output out.glb"),
    (3, "retarget --source walk.glb --target folder --output out.glb"),
    (3, "retarget --source notes.txt --target hero.glb --output out.glb"),
    (3, "retarget --source notes.glb --target hero.glb --output out.glb"),
    (3, "retarget --source empty.bvh --target hero.glb --output out.glb"),
    (3, "retarget --source cut.glb --target hero.glb --output out.glb"),
    (3, "retarget --source cut.bvh --target hero.glb --output out.glb"),
    (3, "retarget --source walk.glb.gz --target hero.glb --output out.glb"),
    (3, "retarget --source pointer.glb --target hero.glb --output out.glb"),
    (3, "retarget --source hero.glb --target walk.glb --output out.glb"),
    (3, "retarget --source walk.glb --target hero.glb --output out.glb --config missing.json"),
    (3, "retarget --source walk.glb --target hero.glb --output out.glb --config notes.txt"),
    (3, "retarget --source walk.glb --target hero.glb --output out.glb --config unknown_field.json"),
    (3, "retarget --source walk.glb --target hero.glb --output out.glb --config wrong_type.json"),
    (3, "retarget --source walk.glb --target hero.glb --output out.glb --config unknown_joint.json"),
    (3, "retarget --source walk.glb --target hero.glb --output out.glb --config unknown_op.json"),
    (3, "retarget --source walk.glb --target hero.glb --output out.glb --config broken.json"),
    (3, "retarget --source walk.glb --target hero.glb --output out.glb --preset nonsense"),
    (3, "retarget --source walk.glb --target hero.glb --output out.glb --rig notes.txt"),
    (3, "retarget --source walk.glb --target hero.glb --target-rest notes.txt --output out.glb"),
    (2, "retarget --batch folder --target hero.glb --output out.glb"),
    (3, "retarget --batch folder --target hero.glb --output {name}.bvh"),
    (3, "retarget --batch missing --target hero.glb --output {name}.glb"),
    (2, "retarget --batch folder --source walk.glb --target hero.glb --output {name}.glb"),
    (3, "inspect missing.glb"),
    (2, "inspect"),
    (3, "inspect notes.txt"),
    (2, "edit --input walk.glb --output out.glb"),
    (3, "edit --input walk.glb --config unknown_edit.json --output out.glb"),
    (3, "edit --input walk.glb --config unlike_field.json --output out.glb"),
    (2, "pose --input hero.glb --to x --output out.glb"),
    (2, "pose --input hero.glb --output hero.glb"),
    (3, "explain --source walk.glb --target hero.glb --frame 3000 --joint pelvis"),
    (3, "explain --source walk.glb --target hero.glb --frame 3 --joint pelviss"),
    (2, "preview walk.glb --output walk.jpg"),
    (2, "preview walk.glb --output walk.png --size 0"),
    (2, "check-config"),
    (3, "check-config unknown_field.json"),
    (2, "check-config good.json --source walk.glb"),
    (2, "submit --service nowhere --source walk.glb --target hero.glb --output out.glb"),
    (4, "submit --service http://127.0.0.1:9 --source walk.glb --target hero.glb --output out.glb"),
    (2, "submit --source walk.glb --target hero.glb --output out.glb --label shot"),
    (2, "keys create Studio --data data"),
    (4, "keys list --data data"),
    (2, "serve --workers many --data data"),
];

fn prepare(folder: &Path) {
    let walk = samples::walk_clip();
    let files: [(&str, &[u8]); 18] = [
        ("walk.glb", &walk),
        ("hero.glb", &samples::mannequin()),
        ("notes.txt", b"tuesday is better\n"),
        ("notes.glb", b"tuesday is better\n"),
        ("empty.bvh", b""),
        ("cut.glb", &walk[..walk.len() / 2]),
        ("cut.bvh", b"HIERARCHY\nROOT Hips\n{\n OFFSET 0 0 0\n"),
        ("walk.glb.gz", b"\x1f\x8b\x08\x00\x00\x00\x00\x00"),
        ("pointer.glb", b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n"),
        ("unknown_field.json", br#"{"alighn": "auto"}"#),
        ("wrong_type.json", br#"{"align": 5}"#),
        ("unknown_joint.json", br#"{"target": {"root": "Pelvis2"}}"#),
        ("unknown_op.json", br#"{"ops": [{"op": "pelvos"}]}"#),
        ("broken.json", br#"{"align": "auto""#),
        ("unknown_edit.json", br#"{"edit": {"fsp": 30}}"#),
        ("unlike_field.json", br#"{"edit": {"loop": {"number": 3}}}"#),
        ("good.json", b"{}"),
        ("folder/broken.bvh", b"HIERARCHY\nROOT Hips\n"),
    ];
    std::fs::create_dir(folder.join("folder")).expect("a folder");
    for (name, bytes) in files {
        std::fs::write(folder.join(name), bytes).expect("a file");
    }
}

#[test]
fn mistakes_on_the_command_line_are_told_in_three_lines() {
    let folder = tempfile::tempdir().expect("a folder");
    prepare(folder.path());
    let mut told = Vec::new();
    let mut codes = Vec::new();
    for (code, mistake) in MISTAKES {
        let output = Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .args(mistake.split(' '))
            .current_dir(folder.path())
            .env_remove("RETARGETD_URL")
            .env("NO_PROXY", "127.0.0.1")
            .stdin(Stdio::null())
            .output()
            .expect("the binary runs");
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        // What clap adds to every message is the same each time; what counts is the message itself.
        let help = ["For more information, try", "Usage: ", "       retargetd"];
        let lines = text.lines().map(str::trim_end).filter(|line| !line.is_empty());
        let lines = lines.filter(|line| !help.iter().any(|start| line.starts_with(start))).map(str::to_owned);
        if output.status.code() != Some(code) {
            codes.push(format!("{mistake} ended with {}, not {code}: {text}", output.status));
        }
        told.push(Told { mistake: format!("retargetd {mistake}"), lines: lines.collect() });
    }
    assert!(codes.is_empty(), "{}", codes.join("\n"));
    check(&told, "command_line.txt");
    let left: Vec<_> = std::fs::read_dir(folder.path())
        .expect("the folder")
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .collect();
    assert!(
        !left.iter().any(|name| name.starts_with("out") || name.ends_with(".part")),
        "nothing is left behind: {left:?}"
    );
}
