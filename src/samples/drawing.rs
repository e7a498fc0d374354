//! A drawn child, made by code: felt pen on paper, with the joints that annotations of *Animated Drawings* have.

use crate::{formats::pack_files, picture::Picture};

const WIDTH: usize = 360;
const HEIGHT: usize = 480;
const PAPER: [u8; 4] = [250, 247, 240, 255];
const INK: [u8; 4] = [40, 38, 52, 255];
/// Half the width of an outline, in pixels.
const PEN: f64 = 2.5;

/// A part of the figure: a thick line from one place to another, thinner toward its end, and its color.
struct Stroke {
    from: [f64; 2],
    to: [f64; 2],
    radii: [f64; 2],
    color: [u8; 3],
}

const SKIN: [u8; 3] = [246, 208, 172];
const SHIRT: [u8; 3] = [226, 84, 70];
const TROUSERS: [u8; 3] = [66, 98, 178];
const SHOES: [u8; 3] = [90, 64, 52];
const HAIR: [u8; 3] = [122, 82, 48];

const fn stroke(from: [f64; 2], to: [f64; 2], radii: [f64; 2], color: [u8; 3]) -> Stroke {
    Stroke { from, to, radii, color }
}

/// The figure, what is behind first. Its right is on the left.
const FIGURE: [Stroke; 16] = [
    stroke([160.0, 290.0], [150.0, 365.0], [24.0, 20.0], TROUSERS),
    stroke([150.0, 365.0], [146.0, 425.0], [20.0, 17.0], TROUSERS),
    stroke([146.0, 440.0], [128.0, 444.0], [15.0, 13.0], SHOES),
    stroke([200.0, 290.0], [210.0, 365.0], [24.0, 20.0], TROUSERS),
    stroke([210.0, 365.0], [214.0, 425.0], [20.0, 17.0], TROUSERS),
    stroke([214.0, 440.0], [232.0, 444.0], [15.0, 13.0], SHOES),
    stroke([146.0, 190.0], [98.0, 222.0], [17.0, 14.0], SHIRT),
    stroke([98.0, 222.0], [52.0, 246.0], [13.0, 11.0], SKIN),
    stroke([50.0, 247.0], [40.0, 252.0], [15.0, 13.0], SKIN),
    stroke([214.0, 190.0], [262.0, 222.0], [17.0, 14.0], SHIRT),
    stroke([262.0, 222.0], [308.0, 246.0], [13.0, 11.0], SKIN),
    stroke([310.0, 247.0], [320.0, 252.0], [15.0, 13.0], SKIN),
    stroke([180.0, 200.0], [180.0, 280.0], [46.0, 42.0], SHIRT),
    stroke([180.0, 150.0], [180.0, 165.0], [14.0, 14.0], SKIN),
    stroke([180.0, 78.0], [180.0, 84.0], [62.0, 60.0], HAIR),
    stroke([180.0, 92.0], [180.0, 100.0], [54.0, 54.0], SKIN),
];

/// Joints with the joint that each hangs on.
const JOINTS: [(&str, [usize; 2], &str); 16] = [
    ("root", [180, 288], ""),
    ("hip", [180, 288], "root"),
    ("torso", [180, 188], "hip"),
    ("neck", [180, 128], "torso"),
    ("right_shoulder", [146, 190], "torso"),
    ("right_elbow", [98, 222], "right_shoulder"),
    ("right_hand", [50, 247], "right_elbow"),
    ("left_shoulder", [214, 190], "torso"),
    ("left_elbow", [262, 222], "left_shoulder"),
    ("left_hand", [310, 247], "left_elbow"),
    ("right_hip", [162, 292], "root"),
    ("right_knee", [150, 362], "right_hip"),
    ("right_foot", [146, 432], "right_knee"),
    ("left_hip", [198, 292], "root"),
    ("left_knee", [210, 362], "left_hip"),
    ("left_foot", [214, 432], "left_knee"),
];

impl Stroke {
    /// How far a place is outside of it; negative inside.
    fn distance(&self, [x, y]: [f64; 2]) -> f64 {
        let [along_x, along_y] = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        let length = (along_x * along_x + along_y * along_y).max(1e-9);
        let share = (((x - self.from[0]) * along_x + (y - self.from[1]) * along_y) / length).clamp(0.0, 1.0);
        let radius = self.radii[0] + (self.radii[1] - self.radii[0]) * share;
        (x - self.from[0] - along_x * share).hypot(y - self.from[1] - along_y * share) - radius
    }
}

/// Mixes a color over a pixel by how much of the pixel is within a distance.
fn mix(pixel: &mut [u8; 4], color: [u8; 3], inside_by: f64) {
    let share = (inside_by + 0.5).clamp(0.0, 1.0);
    for (part, new) in pixel.iter_mut().zip(color) {
        *part = (f64::from(*part) * (1.0 - share) + f64::from(new) * share + 0.5) as u8;
    }
}

/// The drawing and its mask.
fn pictures() -> [Picture; 2] {
    let ink = [INK[0], INK[1], INK[2]];
    let mut drawing = Picture::filled(WIDTH, HEIGHT, PAPER);
    let mut mask = Picture::filled(WIDTH, HEIGHT, [0, 0, 0, 255]);
    for index in 0..WIDTH * HEIGHT {
        let at = [(index % WIDTH) as f64 + 0.5, (index / WIDTH) as f64 + 0.5];
        let pixel = &mut drawing.pixels[index];
        for part in &FIGURE {
            let outside = part.distance(at);
            mix(pixel, ink, PEN - outside);
            mix(pixel, part.color, -PEN - outside);
            if outside < PEN + 1.0 {
                mask.pixels[index] = [255; 4];
            }
        }
        // Eyes, cheeks and a smile.
        for side in [-1.0, 1.0] {
            let eye = (at[0] - 180.0 - side * 20.0).hypot((at[1] - 92.0) * 0.8);
            mix(pixel, ink, 5.0 - eye);
            let cheek = (at[0] - 180.0 - side * 34.0).hypot(at[1] - 112.0);
            mix(pixel, [240, 160, 140], 7.0 - cheek);
        }
        let smile = ((at[0] - 180.0).hypot(at[1] - 104.0) - 24.0).abs();
        if at[1] > 116.0 {
            mix(pixel, ink, 2.0 - smile);
        }
        // Stripes of the shirt.
        let is_on_shirt = FIGURE[12].distance(at) < -PEN - 1.0 && FIGURE[13].distance(at) > PEN;
        if is_on_shirt && (at[1] as usize / 12).is_multiple_of(2) {
            mix(pixel, [250, 226, 140], 0.3);
        }
    }
    [drawing, mask]
}

/// The character config.
fn config() -> String {
    let mut text = format!("width: {WIDTH}\nheight: {HEIGHT}\nskeleton:\n");
    for (name, [x, y], parent) in JOINTS {
        let parent = if parent.is_empty() { "null" } else { parent };
        text.push_str(&format!("- loc: [{x}, {y}]\n  name: {name}\n  parent: {parent}\n"));
    }
    text
}

/// A drawn child as a zip archive with `char_cfg.yaml`, `texture.png` and `mask.png`.
#[must_use]
pub fn drawing() -> Vec<u8> {
    let [texture, mask] = pictures().map(|picture| picture.to_png().expect("a small picture has a PNG"));
    let config = config();
    let files = [("char_cfg.yaml", config.as_bytes()), ("texture.png", &*texture), ("mask.png", &*mask)];
    pack_files(files).expect("three small files have an archive")
}
