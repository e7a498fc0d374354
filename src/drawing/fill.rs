//! Triangles of a drawing onto a picture.

use glam::DVec2;

use crate::picture::Picture;

/// Opacities below this are left out; the others replace what is there.
const CUT_OUT_BELOW: f64 = 0.1 * 255.0;

/// What becomes of a pixel that is drawn over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Blend {
    /// It is replaced, or left where the new one has hardly any opacity.
    Replace,
    /// It shines through where the new one is not opaque.
    Over,
}

/// A corner of a triangle: on the picture and on the texture, both in pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) seen: DVec2,
    pub(super) texel: DVec2,
}

/// Draws a triangle. A pixel belongs to the triangle that its middle is in, so neighbors neither overlap nor leave gaps.
pub(super) fn triangle(picture: &mut Picture, texture: &Picture, corners: [Corner; 3], blend: Blend) {
    let [one, two, three] = corners.map(|corner| corner.seen);
    let area = (two - one).perp_dot(three - one);
    // The texture's place is linear in the picture's.
    let along = [(two - one, corners[1].texel - corners[0].texel), (three - one, corners[2].texel - corners[0].texel)];
    let right = (along[0].1 * along[1].0.y - along[1].1 * along[0].0.y) / area;
    let down = (along[1].1 * along[0].0.x - along[0].1 * along[1].0.x) / area;
    let step = Texel::of(right);
    spans(picture, [one, two, three], |first, pixels| {
        let start = first - one;
        let begin = corners[0].texel + right * start.x + down * start.y - DVec2::splat(0.5);
        let mut texel = Texel::of(begin);
        let end = texel.after(step, pixels.len() as i64 - 1);
        let is_inside = texel.has_four(texture) && end.has_four(texture);
        if is_inside {
            texel.walk(step, texture, pixels, blend);
            return;
        }
        for pixel in pixels {
            texel.draw(texel.four_at_edges(texture), pixel, blend);
            texel = texel.after(step, 1);
        }
    });
}

/// Draws a triangle in one color.
pub(super) fn flat(picture: &mut Picture, color: &[u8; 4], corners: [Corner; 3]) {
    spans(picture, corners.map(|corner| corner.seen), |_, pixels| pixels.fill(*color));
}

/// The runs of pixels whose middles are in a triangle, with the middle of the first of each.
fn spans(picture: &mut Picture, [one, two, three]: [DVec2; 3], mut draw: impl FnMut(DVec2, &mut [[u8; 4]])) {
    let area = (two - one).perp_dot(three - one);
    if area.abs() < 1e-9 || !area.is_finite() {
        return;
    }
    let (top, middle) = if two.y < one.y { (two, one) } else { (one, two) };
    let (middle, bottom) = if three.y < middle.y { (three, middle) } else { (middle, three) };
    let (top, middle) = if middle.y < top.y { (middle, top) } else { (top, middle) };
    // The number of the first pixel whose middle is not before a place.
    let pixels = |at: f64, most: usize| {
        let before = at - 0.5;
        let whole = before as i32;
        (whole.saturating_add(i32::from(before > f64::from(whole))).max(0) as usize).min(most)
    };
    let slope = |start: DVec2, end: DVec2| (end.x - start.x) / (end.y - start.y);
    let (width, height) = (picture.width, picture.height);
    let long = slope(top, bottom);
    // Both triangles of an edge compute a crossing from the same end.
    for (start, end) in [(top, middle), (middle, bottom)] {
        let rows = pixels(start.y, height)..pixels(end.y, height);
        if rows.is_empty() {
            continue;
        }
        let short = slope(start, end);
        for row in rows {
            let line = row as f64 + 0.5;
            let crossings = [top.x + long * (line - top.y), start.x + short * (line - start.y)];
            let [from, to] = if crossings[0] < crossings[1] { crossings } else { [crossings[1], crossings[0]] };
            let columns = pixels(from, width)..pixels(to, width);
            if !columns.is_empty() {
                let first = DVec2::new(columns.start as f64 + 0.5, line);
                draw(first, &mut picture.pixels[row * width..][columns]);
            }
        }
    }
}

/// Lays a color over a pixel.
fn over(pixel: &mut [u8; 4], color: [u8; 4]) {
    if color[3] == 255 || pixel[3] == 0 {
        *pixel = color;
        return;
    }
    let (share, under) = (u32::from(color[3]), u32::from(pixel[3]));
    let rest = under * (255 - share);
    let whole = share * 255 + rest;
    if whole == 0 {
        return;
    }
    for (part, new) in pixel[..3].iter_mut().zip(color) {
        *part = ((u32::from(new) * share * 255 + u32::from(*part) * rest + whole / 2) / whole) as u8;
    }
    pixel[3] = ((whole + 127) / 255) as u8;
}

/// Colors from here on are opaque: the opacity is the highest of four bytes.
const OPAQUE: u32 = 0xff00_0000;
/// The bytes of red, green and blue.
const COLORS: u32 = 0x00ff_ffff;

/// A place on a texture, seen from the middle of its first pixel, in 65,536ths of pixels.
#[derive(Clone, Copy)]
struct Texel {
    x: i64,
    y: i64,
}

impl Texel {
    fn of(place: DVec2) -> Self {
        let [x, y] = [place.x, place.y].map(|at| (at * 65_536.0) as i64);
        Self { x, y }
    }

    fn after(self, step: Self, steps: i64) -> Self {
        Self { x: self.x + step.x * steps, y: self.y + step.y * steps }
    }

    /// Whether the four pixels around it are the texture's.
    fn has_four(self, texture: &Picture) -> bool {
        let (left, top) = (self.x >> 16, self.y >> 16);
        left >= 0 && top >= 0 && left + 1 < texture.width as i64 && top + 1 < texture.height as i64
    }

    /// Draws pixels, each a step further than the one before; all have four pixels around them.
    fn walk(self, step: Self, texture: &Picture, pixels: &mut [[u8; 4]], blend: Blend) {
        let (width, texels) = (texture.width, &texture.pixels[..]);
        let mut texel = self;
        for pixel in pixels {
            let at = (texel.y >> 16) as usize * width + (texel.x >> 16) as usize;
            let Some(around) = texels.get(at..at + width + 2) else { return };
            let four = [around[0], around[1], around[width], around[width + 1]].map(u32::from_le_bytes);
            if four[0] & four[1] & four[2] & four[3] >= OPAQUE {
                *pixel = texel.between_opaque(four);
            } else {
                texel.draw(four, pixel, blend);
            }
            texel = Self { x: texel.x + step.x, y: texel.y + step.y };
        }
    }

    /// Draws a pixel with the color between four.
    fn draw(self, four: [u32; 4], pixel: &mut [u8; 4], blend: Blend) {
        if four[0] | four[1] | four[2] | four[3] <= COLORS {
            return;
        }
        let Some(color) = self.between(four) else { return };
        match blend {
            Blend::Replace if f64::from(color[3]) < CUT_OUT_BELOW => {}
            Blend::Replace => *pixel = color,
            Blend::Over => over(pixel, color),
        }
    }

    /// The same, with nothing where the texture has ended.
    fn four_at_edges(self, texture: &Picture) -> [u32; 4] {
        let (left, top) = (self.x >> 16, self.y >> 16);
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(right, down)| {
            let (column, row) = (left + right, top + down);
            let is_in = (0..texture.width as i64).contains(&column) && (0..texture.height as i64).contains(&row);
            if is_in { u32::from_le_bytes(texture.pixels[row as usize * texture.width + column as usize]) } else { 0 }
        })
    }

    /// How far it is from the left and from the upper two of its four pixels, in 256ths.
    fn shares(self) -> [u32; 2] {
        [(self.x >> 8 & 255) as u32, (self.y >> 8 & 255) as u32]
    }

    /// The color between four opaque pixels.
    fn between_opaque(self, four: [u32; 4]) -> [u8; 4] {
        const EVERY_OTHER: u64 = 0x00ff_00ff_00ff_00ff;
        const HALF: u64 = 0x0080_0080_0080_0080;
        let [right, low] = self.shares().map(u64::from);
        // Each byte gets room for another above it, so that one product is that of four.
        let apart = |color: u32| (u64::from(color) | u64::from(color) << 24) & EVERY_OTHER;
        let mix = |one: u64, other: u64, share: u64| (one * (256 - share) + other * share + HALF) >> 8 & EVERY_OTHER;
        let [one, two, three, four] = four.map(apart);
        let mixed = mix(mix(one, two, right), mix(three, four, right), low);
        ((mixed | mixed >> 24) as u32 | OPAQUE).to_le_bytes()
    }

    /// The color between four pixels, by their opacity; nothing where all of them have none.
    fn between(self, four: [u32; 4]) -> Option<[u8; 4]> {
        let [right, low] = self.shares();
        let shares = [(256 - right) * (256 - low), right * (256 - low), (256 - right) * low, right * low];
        let mut sums = [0_u32; 4];
        for (color, share) in four.map(u32::to_le_bytes).into_iter().zip(shares) {
            // At most 255 * 2^8 altogether.
            let weight = (share * u32::from(color[3])) >> 8;
            sums[3] += weight;
            (0..3).for_each(|part| sums[part] += (weight * u32::from(color[part])) >> 8);
        }
        let opacity = (sums[3] + 128) >> 8;
        (opacity > 0).then(|| {
            let part = |sum: u32| (((sum << 8) + sums[3] / 2) / sums[3].max(1)).min(255) as u8;
            [part(sums[0]), part(sums[1]), part(sums[2]), opacity.min(255) as u8]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_halves_of_a_square_cover_it_once() {
        let texture = Picture::filled(8, 8, [10, 20, 30, 255]);
        let mut picture = Picture::filled(20, 20, [0; 4]);
        let corner = |x: f64, y: f64| Corner { seen: DVec2::new(x, y), texel: DVec2::new(2.0, 2.0) };
        let [one, two, three, four] = [corner(3.3, 3.0), corner(15.2, 4.1), corner(14.0, 16.0), corner(2.5, 15.5)];
        triangle(&mut picture, &texture, [one, two, three], Blend::Replace);
        let half = picture.pixels.iter().filter(|pixel| pixel[3] > 0).count();
        let mut other = Picture::filled(20, 20, [0; 4]);
        triangle(&mut other, &texture, [one, three, four], Blend::Replace);
        let both = picture.pixels.iter().zip(&other.pixels).filter(|(one, other)| one[3] > 0 && other[3] > 0).count();
        assert!(half > 50);
        assert_eq!(both, 0);
    }

    #[test]
    fn a_color_between_opaque_ones_is_their_mean_by_distance() {
        let texture = Picture {
            width: 2,
            height: 2,
            pixels: vec![[0, 100, 7, 255], [200, 0, 7, 255], [100, 50, 7, 255], [50, 250, 7, 255]],
        };
        for (place, wanted) in [
            (DVec2::new(0.0, 0.0), [0, 100, 7, 255]),
            (DVec2::new(0.5, 0.0), [100, 50, 7, 255]),
            (DVec2::new(0.25, 0.5), [69, 88, 7, 255]),
            (DVec2::new(0.75, 0.75), [84, 156, 7, 255]),
        ] {
            let texel = Texel::of(place);
            assert!(texel.has_four(&texture));
            let four = texel.four_at_edges(&texture);
            let (fast, slow) = (texel.between_opaque(four), texel.between(four).expect("a color"));
            for part in 0..4 {
                assert!(fast[part].abs_diff(wanted[part]) <= 1, "{place}: {fast:?}");
                assert!(slow[part].abs_diff(wanted[part]) <= 2, "{place}: {slow:?}");
            }
        }
        assert_eq!(Texel::of(DVec2::new(-0.5, 0.5)).four_at_edges(&texture)[0], 0);
    }
}
