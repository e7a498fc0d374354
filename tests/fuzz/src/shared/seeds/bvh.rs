//! BVH as different programs write it.

use super::Seed;

const PLAIN: &str = "HIERARCHY\nROOT Hips\n{\n\tOFFSET 0 0.9 0\n\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n\t\
    JOINT Chest\n\t{\n\t\tOFFSET 0 0.5 0\n\t\tCHANNELS 3 Zrotation Xrotation Yrotation\n\t\tEnd Site\n\t\t{\n\t\t\tOFFSET 0 0.2 0\n\t\t}\n\t}\n}\n\
    MOTION\nFrames: 2\nFrame Time: 0.033333\n0 0.9 0 10 0 -20 1 2 3\n0.1 0.9 1e-3 -10 180.0 20 0 0 0\n";

pub(super) fn dialects() -> Vec<Seed> {
    // Every joint moved, orders of rotation that few write, names with spaces, two roots, no leaf's end, comments of nobody.
    let odd = "hierarchy\r\nROOT my hips\r\n{\r\nOFFSET 0 90 0\r\nCHANNELS 6 Xposition Yposition Zposition Yrotation Xrotation Zrotation\r\n\
        JOINT a:b {\r\nOFFSET 1 2 3\r\nCHANNELS 6 Xposition Yposition Zposition Xrotation Yrotation Zrotation\r\n}\r\n}\r\n\
        ROOT other\r\n{\r\nOFFSET 0 0 0\r\nCHANNELS 1 Yrotation\r\n}\r\nMOTION\r\nFrames:   1\r\nFrame Time:\t.04\r\n\
        0 90 0 0 0 0 1 2 3 0 0 0 720\r\n";
    let still = PLAIN.replace("Frames: 2", "Frames: 0").split("0 0.9 0 10").next().unwrap_or_default().to_owned();
    let one_line = PLAIN.replace("0.1 0.9 1e-3", " 0.1 0.9 1e-3").replace("1 2 3\n", "1 2 3");
    let deep = deep(40);
    [("plain", PLAIN), ("odd", odd), ("still", &still), ("one_line", &one_line), ("deep", &deep)]
        .map(|(name, text)| (name.to_owned(), text.as_bytes().to_vec()))
        .into()
}

/// A chain of so many joints, which do not move.
fn deep(joints: usize) -> String {
    let joint = |index: usize| {
        let word = if index == 0 { "ROOT" } else { "JOINT" };
        format!("{word} j{index} {{ OFFSET 0 1 0 CHANNELS 0 ")
    };
    let chain: String = (0..joints).map(joint).collect();
    format!("HIERARCHY {chain} {} MOTION Frames: 1 Frame Time: 0.1\n", "}".repeat(joints))
}
