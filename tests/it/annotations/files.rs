//! Masks that are given, and pictures and masks that cannot be used.

use retargetd::{
    engine::{AnnotatedDrawing, Control, Failure, FailureCode, NamedBytes, annotate_drawing},
    picture::{Picture, write_png},
};

use super::{annotated, decoded, file, png, styles};

fn with_mask(picture: &[u8], mask: &Picture) -> Result<AnnotatedDrawing, Failure> {
    let mask = write_png(mask).unwrap_or_else(|error| panic!("{error}"));
    let named = |bytes| NamedBytes { name: "picture", bytes };
    annotate_drawing(named(picture), Some(named(&mask)), None, None, &Control::new())
}

/// A small figure, and a mask of it that leaves out the head.
fn figure_and_mask() -> (Vec<u8>, Picture) {
    let drawn = styles::tiny();
    let picture = &drawn.canvas.picture;
    let mut mask = Picture::filled(picture.width, picture.height, [0, 0, 0, 255]);
    let is_in = |column: usize, row: usize| {
        (40..56).contains(&column) && (12..60).contains(&row)
            || (20..76).contains(&column) && (40..46).contains(&row)
            || (36..42).contains(&column) && (60..104).contains(&row)
            || (54..60).contains(&column) && (60..104).contains(&row)
            || (40..56).contains(&column) && (50..66).contains(&row)
    };
    for (index, pixel) in mask.pixels.iter_mut().enumerate() {
        if is_in(index % picture.width, index / picture.width) {
            *pixel = [255; 4];
        }
    }
    (png(&drawn), mask)
}

#[test]
fn a_mask_that_is_given_wins() {
    let (picture, mask) = figure_and_mask();
    let drawing = with_mask(&picture, &mask).expect("a figure");
    let view = drawing.view();
    assert_eq!(view.mask.origin, "given");
    let found = decoded(&file(&drawing, "mask.png"));
    let area = mask.pixels.iter().filter(|pixel| pixel[0] > 0).count() as f64 * view.scale * view.scale;
    let share = view.mask.pixels as f64 / area;
    assert!((0.97..1.03).contains(&share), "as large as the mask that was given: {share}");
    assert_eq!([found.width, found.height], view.size, "as large as the texture");
    let transparent = Picture {
        pixels: mask.pixels.iter().map(|pixel| if pixel[0] > 0 { [0, 0, 0, 255] } else { [0; 4] }).collect(),
        ..mask
    };
    let by_opacity = with_mask(&picture, &transparent).expect("a figure");
    assert_eq!(file(&by_opacity, "mask.png"), file(&drawing, "mask.png"), "opaque counts as white");
}

#[test]
fn masks_that_cannot_be_used_are_refused_with_what_is_wrong() {
    let (picture, mask) = figure_and_mask();
    let refused = |mask: &Picture| with_mask(&picture, mask).expect_err("it cannot be used");
    let small = refused(&Picture::filled(10, 10, [255; 4]));
    assert_eq!((small.code, small.part), (FailureCode::InvalidValue, "mask"));
    assert!(small.detail.contains("10 by 10") && small.detail.contains("96 by 112"), "{small}");
    let black = refused(&Picture::filled(96, 112, [0, 0, 0, 255]));
    assert!(black.detail.contains("nothing in it is white"), "{black}");
    let white = refused(&Picture::filled(96, 112, [255; 4]));
    assert!(white.detail.contains("100 % of it are white"), "{white}");
    let dust = Picture {
        pixels: (0..96 * 112).map(|pixel| if pixel % 7 == 0 { [255; 4] } else { [0, 0, 0, 255] }).collect(),
        ..mask
    };
    assert!(
        matches!(
            with_mask(&picture, &dust),
            Ok(_)
                | Err(
                    Failure { code: FailureCode::InvalidValue, .. } | Failure { code: FailureCode::FigureNotFound, .. }
                )
        ),
        "no fault"
    );
    let broken = annotate_drawing(
        NamedBytes { name: "picture", bytes: &picture },
        Some(NamedBytes { name: "mask", bytes: &picture[..picture.len() / 2] }),
        None,
        None,
        &Control::new(),
    );
    let broken = broken.expect_err("half a file");
    assert_eq!((broken.code, broken.part), (FailureCode::AssetMalformed, "mask"), "{broken}");
}

#[test]
fn hostile_pictures_end_in_a_problem_or_a_drawing() {
    // A chessboard, stripes, a frame, noise: what multiplies components, edges and lines.
    let size = 400;
    type Kind = (&'static str, fn(usize, usize) -> bool);
    let kinds: [Kind; 5] = [
        ("chessboard", |column, row| (column / 2 + row / 2) % 2 == 0),
        ("stripes", |_, row| row % 5 < 2),
        ("frame", |column, row| column.min(row) < 3 || column.max(row) > 396),
        ("dust", |column, row| (column * 7_919 + row * 104_729) % 11 == 0),
        ("confetti", |column, row| column % 13 < 6 && row % 13 < 6),
    ];
    for (name, is_drawn) in kinds {
        let gray = |index: usize| if is_drawn(index % size, index / size) { 20 } else { 235 };
        let pixels = (0..size * size).map(|index| [gray(index), gray(index), gray(index), 255]).collect();
        let picture =
            write_png(&Picture { width: size, height: size, pixels }).unwrap_or_else(|error| panic!("{error}"));
        match annotated(&picture, None) {
            Ok(drawing) => assert!(drawing.view().confidence.is_finite(), "{name}"),
            Err(failure) => assert_eq!(failure.code, FailureCode::FigureNotFound, "{name}: {failure}"),
        }
    }
    for (width, height) in [(1, 1), (1, 300), (2000, 2), (7, 7)] {
        let picture =
            write_png(&Picture::filled(width, height, [90, 90, 90, 255])).unwrap_or_else(|error| panic!("{error}"));
        assert!(annotated(&picture, None).is_err(), "{width} by {height}");
    }
    for bytes in [&b""[..], b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"RIFF\0\0\0\0WEBP", b"text"] {
        let failure = annotated(bytes, None).expect_err("no picture");
        assert_eq!((failure.code, failure.part), (FailureCode::AssetMalformed, "image"), "{failure}");
    }
}

#[test]
fn the_same_picture_gives_the_same_bytes() {
    let (picture, mask) = figure_and_mask();
    let first = with_mask(&picture, &mask).expect("a figure").archive().expect("an archive");
    assert_eq!(first, with_mask(&picture, &mask).expect("a figure").archive().expect("an archive"));
}
