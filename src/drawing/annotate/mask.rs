//! The mask of a drawing: which pixels are the figure's.

use super::{
    bits::Bits,
    bridges::join_parts,
    components::{Component, components, filled},
    edges, paper,
    strokes::{Strokes, strokes},
};
use crate::{drawing::DrawingError, model::Reporter, picture::Picture};

/// Radius of the closing, and then of the growing, of strokes: those of *Animated Drawings*.
const CLOSED: usize = 2;
const GROWN: usize = 2;
/// Radii that are tried for outlines with gaps.
const CLOSED_FURTHER: [usize; 3] = [5, 9, 14];
/// Part of the figure by which it has to become larger for a gap to have been closed.
const GAINED: f64 = 0.5;
/// How much larger than its strokes a figure is whose outline cannot have a gap.
const WHOLE: f64 = 3.0;
/// Opacity from which on a pixel is the figure's.
const OPAQUE_FROM: u8 = 128;
/// Part of the pixels that have to be transparent for the opacity to be the mask.
const TRANSPARENT: f64 = 0.01;
/// Part of an opaque figure that holes have to take for it to be an outline.
const OUTLINE: f64 = 0.4;
/// Pixels of the smallest figure, on its longer side.
const SMALLEST: usize = 12;
/// Part of a picture that a figure takes at least.
const SMALLEST_SHARE: f64 = 0.0008;
/// The opposite: what fills a picture is no figure before a ground.
const LARGEST_SHARE: f64 = 0.97;

/// Where a mask came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaskOrigin {
    /// A file that the user gave.
    Given,
    /// The opacity of the picture.
    Alpha,
    /// The strokes of the picture, and what they enclose.
    Strokes,
}

/// Finds the figure by the opacity of a picture where it has any, else by its strokes.
pub(super) fn mask_of_picture(picture: &Picture, reporter: &mut Reporter) -> Result<(Bits, MaskOrigin), DrawingError> {
    if let Some(bits) = opaque_figure(picture, reporter) {
        return Ok((bits?, MaskOrigin::Alpha));
    }
    let found = drawn_figure(picture, false, reporter).or_else(|| drawn_figure(picture, true, reporter));
    let bits = found.ok_or_else(|| {
        let detail = "there is no figure: nothing that is drawn is large enough, darker than the paper around it and in one piece";
        DrawingError::new("image", detail, "take a picture of one figure with dark closed lines, or give a mask")
    })?;
    Ok((bits, MaskOrigin::Strokes))
}

/// Whether a mask is as large as its picture.
pub(super) fn check_size(mask: [usize; 2], picture: [usize; 2]) -> Result<(), DrawingError> {
    if mask == picture {
        return Ok(());
    }
    let [width, height] = picture;
    let detail = format!("it has {} by {} pixels, the picture {width} by {height}", mask[0], mask[1]);
    Err(DrawingError::new("mask", detail, "give a mask of the size of the picture, as the picture is seen"))
}

/// The figure of a mask that the user gave, in the size that is worked in.
pub(super) fn given_mask(mask: &Picture, reporter: &mut Reporter) -> Result<Bits, DrawingError> {
    let transparent = mask.pixels.iter().filter(|pixel| pixel[3] < OPAQUE_FROM).count();
    let by_opacity = transparent > 0 && transparent < mask.pixels.len();
    let is_figure = |pixel: [u8; 4]| {
        let gray = pixel[..3].iter().copied().max().unwrap_or(0);
        pixel[3] >= OPAQUE_FROM && (by_opacity || gray >= OPAQUE_FROM)
    };
    let bits = Bits::of(mask.width, mask.height, |index| is_figure(mask.pixels[index]));
    let share = bits.count() as f64 / bits.cells.len() as f64;
    if share > LARGEST_SHARE {
        let detail = format!("{:.0} % of it are white", share * 100.0);
        return Err(DrawingError::new(
            "mask",
            detail,
            "paint the figure white, and what is around it black or transparent",
        ));
    }
    let (width, height) = (bits.width, bits.height);
    let found = components(&bits, 1);
    let refused = || DrawingError::new("mask", "nothing in it is white and large enough", "paint the figure white");
    let largest = found.first().map(|component| component.bits(width, height)).ok_or_else(refused)?;
    check_large(&largest).ok_or_else(refused)?;
    Ok(join_parts(largest, &found[1..], reporter))
}

/// The figure of a picture with transparent ground; nothing where the ground is not transparent.
fn opaque_figure(picture: &Picture, reporter: &mut Reporter) -> Option<Result<Bits, DrawingError>> {
    let transparent = picture.pixels.iter().filter(|pixel| pixel[3] < OPAQUE_FROM).count();
    if (transparent as f64) < TRANSPARENT * picture.pixels.len() as f64 {
        return None;
    }
    let opaque = Bits::of(picture.width, picture.height, |index| picture.pixels[index][3] >= OPAQUE_FROM);
    let closed = opaque.closed(CLOSED);
    let whole = filled(&closed);
    let enclosed = whole.count() - closed.count();
    // What is drawn as lines on nothing is seen through, and still one body.
    let bits = if enclosed as f64 > OUTLINE * opaque.count() as f64 { whole } else { opaque };
    let found = components(&bits, 16);
    let chosen = chosen(&found, &bits)
        .and_then(|best| check_large(&best.bits(bits.width, bits.height)).map(|bits| (bits, best)));
    Some(match chosen {
        Some((figure, best)) => {
            let others: Vec<Component> = others(&found, best);
            Ok(join_parts(figure, &others, reporter))
        }
        None => {
            let detail = "its ground is transparent, and nothing that is opaque is large enough for a figure";
            Err(DrawingError::new("image", detail, "give a picture of a figure, or a mask"))
        }
    })
}

fn others(all: &[Component], chosen: &Component) -> Vec<Component> {
    all.iter().filter(|component| component.pixels[0] != chosen.pixels[0]).cloned().collect()
}

/// The figure of what is darker than the paper.
fn drawn_figure(picture: &Picture, is_faint: bool, reporter: &mut Reporter) -> Option<Bits> {
    let Strokes { bits: mut drawn, gray, noise, is_light } = strokes(picture, is_faint);
    let strips = edges::take_surroundings(&mut drawn, &gray);
    let lines = paper::take_lines(&mut drawn);
    let (mut figure, mut others) = enclosed_figure(&drawn, CLOSED)?;
    let on_sheet = edges::drawn_on_sheet(&figure, &drawn);
    let is_on_sheet = on_sheet.is_some();
    if let Some(on_sheet) = on_sheet {
        drawn = on_sheet;
        (figure, others) = enclosed_figure(&drawn, CLOSED)?;
    }
    let is_whole = |figure: &Bits| {
        let strokes = figure.cells.iter().zip(&drawn.cells).filter(|(is_in, is_drawn)| **is_in && **is_drawn).count();
        figure.count() as f64 > WHOLE * strokes as f64
    };
    let mut closed_by = None;
    // A small closing may only join what gaps had parted, and a larger one enclose it.
    for radius in CLOSED_FURTHER {
        if is_whole(&figure) {
            break;
        }
        let Some((closed, rest)) = enclosed_figure(&drawn, radius) else { continue };
        // What closing itself adds is no gain.
        let before = drawn.closed(closed_by.unwrap_or(CLOSED)).count() as f64;
        let added = drawn.closed(radius).count() as f64 - before;
        if closed.count() as f64 - added.max(0.0) > figure.count() as f64 * (1.0 + GAINED) {
            closed_by = Some(radius);
            (figure, others) = (closed, rest);
        }
    }
    if let Some(radius) = closed_by {
        let detail = format!("its outline has gaps of up to {} pixels; they were closed", radius * 2);
        reporter.warn("outline_open", "image", detail, "close the lines of the drawing, or give a mask");
    }
    if noise > 6.0 {
        let detail = format!("the picture is noisy: {noise:.0} grays of 255");
        reporter.warn("picture_noisy", "image", detail, "take it in better light, or scan it");
    }
    if is_faint {
        let hint = "draw with a darker pen, or give a mask";
        reporter.warn("lines_faint", "image", "lines are hardly darker than the paper", hint);
    }
    if lines > 0 {
        let detail = format!("{lines} lines of the paper were taken out");
        reporter.warn("paper_lines", "image", detail, "draw on plain paper where lines of the figure are lost");
    }
    if strips > 0 || is_on_sheet {
        let hint = "cut the picture to the drawing where parts of it are lost";
        reporter.warn("surroundings_cut", "image", "what is around the paper was left out", hint);
    }
    if is_light {
        reporter.warn("picture_dark", "image", "the ground is dark: light lines count as drawn", "");
    }
    Some(join_parts(figure, &others, reporter))
}

/// What strokes enclose, with its gaps closed: the figure, and what is not it.
fn enclosed_figure(drawn: &Bits, radius: usize) -> Option<(Bits, Vec<Component>)> {
    let (width, height) = (drawn.width, drawn.height);
    let mut whole = filled(&drawn.closed(radius).grown(GROWN));
    let is_edge = |pixel: usize| {
        let (row, column) = (pixel / width, pixel % width);
        row == 0 || column == 0 || row + 1 == height || column + 1 == width
    };
    (0..whole.cells.len()).filter(|&pixel| is_edge(pixel)).for_each(|pixel| whole.cells[pixel] = false);
    let found = components(&whole, 32);
    let best = chosen(&found, &whole)?;
    let figure = check_large(&best.bits(width, height))?;
    Some((figure, others(&found, best)))
}

/// The component that is most like a figure: large, in the middle, not along the edge.
fn chosen<'a>(found: &'a [Component], bits: &Bits) -> Option<&'a Component> {
    let [half_width, half_height] = [bits.width as f64 / 2.0, bits.height as f64 / 2.0];
    let score = |component: &Component| {
        let [x, y] = component.middle();
        let off = ((x - half_width) / half_width).hypot((y - half_height) / half_height);
        let area = component.pixels.len() as f64;
        let along_edge = component.on_edge as f64 / area.sqrt();
        area * (1.0 - 0.45 * off.min(1.4)) / (1.0 + 2.0 * along_edge)
    };
    found.iter().max_by(|one, other| score(one).total_cmp(&score(other)))
}

/// The same, where it is large enough to be a figure and does not fill the whole picture.
fn check_large(figure: &Bits) -> Option<Bits> {
    let [left, top, right, bottom] = figure.bounds()?;
    let side = (right - left).max(bottom - top);
    let share = figure.count() as f64 / figure.cells.len() as f64;
    (side >= SMALLEST && (SMALLEST_SHARE..=LARGEST_SHARE).contains(&share)).then(|| figure.clone())
}
