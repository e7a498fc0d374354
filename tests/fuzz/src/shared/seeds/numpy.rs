//! Arrays of NumPy and archives of them.

use super::{
    super::container::{Part, archive},
    Seed,
};

/// An array in NumPy's format; the data may be of any length.
fn array(kind: &str, shape: &[usize], data: &[u8]) -> Vec<u8> {
    let shape: String = shape.iter().map(|length| format!("{length}, ")).collect();
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}\n");
    let mut bytes = b"\x93NUMPY\x01\0".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

/// Single precision; small numbers that differ.
fn floats(shape: &[usize]) -> Vec<u8> {
    let count: usize = shape.iter().product();
    let data: Vec<u8> = (0..count).flat_map(|index| ((index % 7) as f32 * 0.1).to_le_bytes()).collect();
    array("<f4", shape, &data)
}

fn names(all: &[&str]) -> Vec<u8> {
    let data: Vec<u8> =
        all.iter().flat_map(|name| name.chars().flat_map(|letter| u32::from(letter).to_le_bytes())).collect();
    array("<U1", &[all.len()], &data)
}

/// Frames per second, a number without dimensions.
fn rate() -> Vec<u8> {
    array("<f8", &[], &120.0_f64.to_le_bytes())
}

fn file(name: &str, members: &[(&str, Vec<u8>)]) -> Seed {
    let parts: Vec<Part> = members.iter().map(|(key, bytes)| Part::new(&format!("{key}.npy"), bytes)).collect();
    (name.to_owned(), archive(&parts))
}

/// Pose arrays with all that they may hold, in unusual types.
pub(super) fn poses() -> Vec<Seed> {
    let unit: Vec<u8> = (0..4).flat_map(|_| [0.0_f64, 0.0, 0.0, 1.0]).flat_map(f64::to_be_bytes).collect();
    let meta = r#"{"fps": 2, "axes": "+z-y", "unit": 0.01, "name": "n"}"#;
    let text: Vec<u8> = meta.chars().flat_map(|letter| u32::from(letter).to_le_bytes()).collect();
    let small = [
        ("joint_names", names(&["a", "b"])),
        ("parents", array("|i1", &[2], &[255, 0])),
        ("rest_translations", floats(&[2, 3])),
        ("rest_rotations", array(">f8", &[2, 4], &unit[..64])),
        ("rest_scales", array("<i2", &[2, 3], &[1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0])),
        ("times", array("<f2", &[2], &[0, 0, 0, 0x3c])),
        ("translations", floats(&[2, 2, 3])),
        ("rotations", array(">f8", &[2, 2, 4], &unit)),
        ("morph_names", array("|S2", &[1], b"ab")),
        ("morph_weights", floats(&[2, 1])),
        ("contact_joints", names(&["b"])),
        ("contacts", array("|b1", &[2, 1], &[0, 1])),
        ("meta", array(&format!("<U{}", meta.len()), &[], &text)),
    ];
    vec![file("small", &small)]
}

/// The layouts of AMASS, AIST++ and SMPL-X, in one array and in parts.
pub(super) fn body_models() -> Vec<Seed> {
    vec![
        file("amass", &[("poses", floats(&[3, 156])), ("trans", floats(&[3, 3])), ("mocap_framerate", rate())]),
        file(
            "aist",
            &[("smpl_poses", floats(&[2, 72])), ("smpl_trans", floats(&[2, 3])), ("smpl_scaling", floats(&[1]))],
        ),
        file("matrices", &[("fullpose", floats(&[1, 55, 3, 3])), ("transl", floats(&[1, 3]))]),
        file(
            "parts",
            &[
                ("root_orient", floats(&[2, 3])),
                ("pose_body", floats(&[2, 63])),
                ("pose_hand", floats(&[2, 90])),
                ("pose_jaw", floats(&[2, 3])),
                ("pose_eye", floats(&[2, 6])),
                ("trans", floats(&[2, 3])),
            ],
        ),
        file(
            "columns",
            &[("poses", array("<f8", &[1, 22, 3], &[0; 528])), ("fps", array("<i4", &[1], &[30, 0, 0, 0]))],
        ),
    ]
}

/// Positions of 22 and 24 joints, and features.
pub(super) fn joint_positions() -> Vec<Seed> {
    [("positions_22", vec![2, 22, 3]), ("positions_24", vec![2, 24, 3]), ("features", vec![3, 263])]
        .map(|(name, shape)| (name.to_owned(), floats(&shape)))
        .into()
}
