//! What is behind all characters: a color, or a picture, and a floor.

use crate::{
    drawing::draw_floor,
    engine::{Failure, FailureCode, NamedBytes},
    picture::{Picture, read_upright},
};

use super::{FileReader, stage::Scenery};

/// What is behind all characters. A picture is turned as its camera was held, and stretched over everything.
pub(super) fn background(
    scenery: &Scenery,
    given: Option<NamedBytes<'_>>,
    read: &mut FileReader<'_>,
) -> Result<Picture, Failure> {
    let view = &scenery.view;
    let [width, height] = view.window_dimensions;
    // A photograph is made smaller by a whole factor first, so that what is left out does not flicker.
    let open = |bytes: &[u8], file: &str| {
        read_upright(bytes, 2 * width.max(height)).map(|upright| stretched(&upright.picture, [width, height])).map_err(
            |error| {
                let failure = Failure::new(FailureCode::AssetMalformed, format!("{file}: {error}"));
                Failure { place: file.to_owned(), ..failure.with_hint("save it again as PNG") }
            },
        )
    };
    let color = view.clear_color.map(|part| (part * 255.0).round() as u8);
    let mut filled = match (&view.background_image, given) {
        (_, Some(file)) => open(file.bytes, file.name)?,
        (Some(file), None) => open(&read(file)?, file)?,
        (None, None) => Picture::filled(width, height, color),
    };
    if scenery.has_floor {
        draw_floor(view, &mut filled);
    }
    Ok(filled)
}

/// A picture in another size: each pixel is the mean of the four that are nearest to its middle, by their distance.
fn stretched(image: &Picture, [width, height]: [usize; 2]) -> Picture {
    let mut filled = Picture::filled(width, height, [0; 4]);
    // The two pixels around a place, and the share of the second.
    let around = |pixel: usize, pixels: usize, of: usize| {
        let place = ((pixel as f64 + 0.5) * of as f64 / pixels as f64 - 0.5).clamp(0.0, (of - 1) as f64);
        let first = place as usize;
        (first, (first + 1).min(of - 1), place - first as f64)
    };
    for row in 0..height {
        let (top, low, down) = around(row, height, image.height);
        for column in 0..width {
            let (left, right, along) = around(column, width, image.width);
            let color = |row: usize, column: usize| image.pixels[row * image.width + column].map(f64::from);
            let mix = |one: f64, other: f64, share: f64| one + (other - one) * share;
            let corners = [color(top, left), color(top, right), color(low, left), color(low, right)];
            let [one, two, three, four] = corners;
            filled.pixels[row * width + column] = std::array::from_fn(|part| {
                let across = [mix(one[part], two[part], along), mix(three[part], four[part], along)];
                mix(across[0], across[1], down).round() as u8
            });
        }
    }
    filled
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretched_picture_goes_evenly_from_pixel_to_pixel() {
        let image = Picture { width: 2, height: 1, pixels: vec![[0, 0, 0, 255], [200, 100, 0, 255]] };
        let wide = stretched(&image, [4, 2]);
        assert_eq!(wide.pixels[..4], [[0, 0, 0, 255], [50, 25, 0, 255], [150, 75, 0, 255], [200, 100, 0, 255]]);
        assert_eq!(stretched(&image, [2, 1]), image, "in its own size it stays");
    }
}
