//! Where every joint is in every frame, as comma-separated text for spreadsheets and scripts.
//!
//! One row per frame; the columns are `frame`, `time_seconds` and three for each joint, such as `Hips.x`. Positions are in the scene's
//! space and unit, to a millionth. (RFC 4180.)

use std::io::Write;

use super::{FormatError, written};
use crate::model::{Clip, Control, Reporter, Scene};

const FRAMES_PER_CHECK: usize = 64;

/// Encodes the positions of the joints of a clip.
pub(super) fn write(
    target: &Scene,
    clip: &Clip,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    let skeleton = &target.skeleton;
    let joints = written::joints_to_write(skeleton);
    written::warn_of_lost_motion(target, clip, &joints, "a table of joints does", reporter);
    let mut text = Vec::new();
    text.extend_from_slice(b"frame,time_seconds");
    for joint in &joints {
        let name = skeleton.label(*joint);
        for axis in ["x", "y", "z"] {
            text.push(b',');
            text.extend_from_slice(cell(&format!("{name}.{axis}")).as_bytes());
        }
    }
    text.extend_from_slice(b"\r\n");
    for (frame, time) in clip.times_seconds().iter().enumerate() {
        if frame % FRAMES_PER_CHECK == 0 {
            control.check()?;
        }
        let pose = clip.local_pose(skeleton, frame).to_model(skeleton);
        let failed = |error: std::io::Error| FormatError::malformed("write", "", error.to_string());
        write!(text, "{frame},{time:.6}").map_err(failed)?;
        for joint in &joints {
            // Without a sign before what rounds to zero.
            let tidy = |value: f64| (value * 1e6).round() / 1e6 + 0.0;
            let [x, y, z] = pose.transforms()[*joint].translation.to_array().map(tidy);
            write!(text, ",{x:.6},{y:.6},{z:.6}").map_err(failed)?;
        }
        text.extend_from_slice(b"\r\n");
    }
    Ok(text)
}

/// A cell, in quotes where it needs them.
fn cell(text: &str) -> String {
    if text.contains([',', '"', '\r', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3, Vec3};

    use super::*;
    use crate::model::{Joint, JointTracks, Skeleton, Track, Transform};

    #[test]
    fn joints_are_where_their_parents_carry_them() {
        let joint = |name: &str, parent, rest| Joint { name: name.into(), parent, rest, is_joint: true, node: 0 };
        let turned = Transform::from_rotation(DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2));
        let joints = vec![joint("a, \"b\"", None, turned), joint("c", Some(0), Transform::from_translation(DVec3::X))];
        let target = Scene { skeleton: Skeleton::new(joints).expect("a skeleton"), ..Scene::default() };
        let moved = JointTracks {
            translation: Track::Sampled(vec![Vec3::ZERO, Vec3::new(0.5, 0.0, -2.0)]),
            ..JointTracks::default()
        };
        let clip = Clip::new(String::new(), vec![0.0, 0.5], vec![moved, JointTracks::default()]).expect("a clip");
        let text = write(&target, &clip, &Control::new(), &mut Reporter::new()).expect("text");
        let wanted = "frame,time_seconds,\"a, \"\"b\"\".x\",\"a, \"\"b\"\".y\",\"a, \"\"b\"\".z\",c.x,c.y,c.z\r\n\
                      0,0.000000,0.000000,0.000000,0.000000,0.000000,1.000000,0.000000\r\n\
                      1,0.500000,0.500000,0.000000,-2.000000,0.500000,1.000000,-2.000000\r\n";
        assert_eq!(String::from_utf8(text).expect("text"), wanted);
    }
}
