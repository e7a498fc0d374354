//! The joints of a drawing, drawn over it.

use super::{AnnotatedJoint, bits::Bits};
use crate::picture::Picture;

/// Colors of the left side, the right side and the middle.
const COLORS: [[u8; 4]; 3] = [[214, 39, 40, 255], [31, 119, 180, 255], [44, 160, 44, 255]];
/// What surrounds lines and dots, so that they are seen on strokes and on paper.
const RIM: [u8; 4] = [255, 255, 255, 255];
/// Of a joint that was guessed.
const DOUBTFUL: [u8; 4] = [255, 191, 0, 255];
/// Confidence below which a joint is marked.
const SURE: f64 = 0.5;

/// The texture, paler outside the mask, with bones and joints over it.
pub(super) fn overlay(texture: &Picture, mask: &Bits, joints: &[AnnotatedJoint]) -> Picture {
    let mut picture = texture.clone();
    for (pixel, is_figure) in picture.pixels.iter_mut().zip(&mask.cells) {
        if !is_figure {
            (0..3).for_each(|part| pixel[part] = 128 + pixel[part] / 2);
            pixel[3] = pixel[3].max(64);
        }
    }
    let thickness = (texture.width.max(texture.height) as f64 / 150.0).max(1.5);
    let place = |joint: &AnnotatedJoint| joint.place.map(|at| at as f64 + 0.5);
    let bones = joints.iter().filter_map(|joint| {
        let parent = joints.iter().find(|parent| Some(&parent.name) == joint.parent.as_ref())?;
        Some((joint, [place(parent), place(joint)]))
    });
    for (joint, ends) in bones {
        for (width, color) in [(thickness + 2.0, RIM), (thickness, COLORS[side(&joint.name)])] {
            paint(&mut picture, color, |bits| bits.draw_line(ends, width));
        }
    }
    for joint in joints {
        let color = if joint.confidence < SURE { DOUBTFUL } else { COLORS[side(&joint.name)] };
        for (radius, color) in [(thickness * 1.8 + 1.0, RIM), (thickness * 1.8, color)] {
            paint(&mut picture, color, |bits| bits.draw_disc(place(joint), radius));
        }
    }
    picture
}

fn side(name: &str) -> usize {
    if name.starts_with("left") {
        0
    } else if name.starts_with("right") {
        1
    } else {
        2
    }
}

fn paint(picture: &mut Picture, color: [u8; 4], draw: impl FnOnce(&mut Bits)) {
    let mut bits = Bits::filled(picture.width, picture.height, false);
    draw(&mut bits);
    picture.pixels.iter_mut().zip(&bits.cells).filter(|(_, is_in)| **is_in).for_each(|(pixel, _)| *pixel = color);
}
