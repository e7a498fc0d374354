//! Pictures of figures to mask and joints: real drawings against what people said of them, and drawings in many styles made by code.

mod canvas;
mod command;
mod files;
mod pose_model;
mod styles;

use std::{collections::BTreeMap, path::Path};

use retargetd::{
    engine::{AnnotatedDrawing, BodyKind, Control, Failure, FailureCode, NamedBytes, annotate_drawing},
    picture::{Picture, read_picture, write_png},
};

use crate::support::corpus_file;
use styles::Drawn;

/// Joints by their names, in pixels of the picture.
type Joints = BTreeMap<String, [f64; 2]>;

fn annotated(picture: &[u8], kind: Option<BodyKind>) -> Result<AnnotatedDrawing, Failure> {
    annotate_drawing(NamedBytes { name: "picture", bytes: picture }, None, kind, None, &Control::new())
}

/// The joints that were found, in pixels of the picture as it was given.
fn joints(drawing: &AnnotatedDrawing) -> Joints {
    let view = drawing.view();
    let corner = [view.bounds.left as f64, view.bounds.top as f64];
    let place = |loc: [usize; 2]| [0, 1].map(|axis: usize| loc[axis] as f64 / view.scale + corner[axis]);
    view.skeleton.into_iter().map(|joint| (joint.name, place(joint.loc))).collect()
}

/// How far each joint is from where it should be, in percent of a height; sorted.
fn errors<'a>(found: &Joints, wanted: impl IntoIterator<Item = (&'a str, [f64; 2])>, height: f64) -> Vec<f64> {
    let far = |(name, place): (&str, [f64; 2])| {
        let found = found.get(name).unwrap_or_else(|| panic!("there is no joint {name}"));
        (found[0] - place[0]).hypot(found[1] - place[1]) / height * 100.0
    };
    let mut errors: Vec<f64> = wanted.into_iter().map(far).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

fn share(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() as f64 * share) as usize).min(sorted.len() - 1)]
}

/// # Panics
/// Where a joint of the right side is on the left of the picture's twin of it, or the other way round.
fn check_sides(name: &str, found: &Joints, wanted: &Joints) {
    for (joint, place) in wanted.iter().filter(|(joint, _)| joint.starts_with("left_")) {
        let twin = joint.replace("left_", "right_");
        let (found, twin_found) = (found[joint], found[&twin]);
        let is_right_way = (found[0] > twin_found[0]) == (place[0] > wanted[&twin][0]);
        assert!(is_right_way, "{name}: {joint} at {found:?} and {twin} at {twin_found:?} changed sides");
    }
}

/// Size and joints of a character config.
fn character(path: &Path) -> (f64, Joints) {
    let text = std::fs::read_to_string(path).expect("a character");
    let document: serde_json::Value = serde_saphyr::from_str(&text).expect("YAML");
    let joints = document["skeleton"].as_array().expect("joints").iter().map(|joint| {
        let at = |axis: usize| joint["loc"][axis].as_f64().expect("a number");
        (joint["name"].as_str().expect("a name").to_owned(), [at(0), at(1)])
    });
    (document["height"].as_f64().expect("a number"), joints.collect())
}

fn file(drawing: &AnnotatedDrawing, name: &str) -> Vec<u8> {
    let files = drawing.files().expect("files");
    files.into_iter().find(|(other, _)| *other == name).map(|(_, bytes)| bytes).expect("the file")
}

fn decoded(bytes: &[u8]) -> Picture {
    read_picture(bytes).unwrap_or_else(|error| panic!("{error}"))
}

/// How much two masks have in common, of what either has.
fn common(one: &Picture, other: &Picture, [left, top]: [usize; 2]) -> f64 {
    let (mut both, mut either) = (0_u32, 0_u32);
    for (index, pixel) in one.pixels.iter().enumerate() {
        let (column, row) = (index % one.width, index / one.width);
        let is_other = column >= left
            && row >= top
            && column - left < other.width
            && row - top < other.height
            && other.pixels[(row - top) * other.width + column - left][0] >= 128;
        both += u32::from(pixel[0] >= 128 && is_other);
        either += u32::from(pixel[0] >= 128 || is_other);
    }
    f64::from(both) / f64::from(either)
}

#[test]
fn drawings_of_people_are_annotated_as_people_did() {
    let mut all = Vec::new();
    for name in ["char1", "char2", "char3", "char4"] {
        let Some(texture) = corpus_file(&format!("animated-drawings/{name}/texture.png")) else { continue };
        let (height, wanted) = character(&texture.with_file_name("char_cfg.yaml"));
        let drawing = annotated(&std::fs::read(&texture).expect("a texture"), None).expect("a figure");
        let view = drawing.view();
        assert_eq!(view.rig, "humanoid", "{name}");
        let found = joints(&drawing);
        check_sides(name, &found, &wanted);
        let errors = errors(&found, wanted.iter().map(|(name, place)| (name.as_str(), *place)), height);
        assert!(share(&errors, 0.5) <= 4.0, "{name}: {errors:?}");
        all.extend(errors);
        let given = decoded(&std::fs::read(texture.with_file_name("mask.png")).expect("a mask"));
        let common = common(&given, &decoded(&file(&drawing, "mask.png")), [view.bounds.left, view.bounds.top]);
        assert!(common >= 0.97, "{name}: {common}");
    }
    if !all.is_empty() {
        all.sort_by(f64::total_cmp);
        assert!(share(&all, 0.5) <= 4.0 && share(&all, 0.9) <= 9.0, "together: {all:?}");
    }
}

/// The camera was held on its side, the paper lies on a blanket, and there is another drawing on it.
#[test]
fn a_photograph_is_annotated_as_its_crop_was() {
    let Some(photograph) = corpus_file("animated-drawings/char4/original_img.png") else { return };
    let drawing = annotated(&std::fs::read(&photograph).expect("a photograph"), None).expect("a figure");
    let view = drawing.view();
    assert_eq!((view.rig, view.bounds.right <= 3024, view.bounds.bottom > 3024), ("humanoid", true, true), "upright");
    let codes: Vec<&str> = view.warnings.iter().map(|warning| warning.code).collect();
    assert_eq!(codes, ["surroundings_cut", "other_figures"]);
    // Both in shares of the height from nose to feet.
    let relative = |joints: &Joints| -> Joints {
        let [nose, feet] = ["neck", "left_foot"].map(|name| joints[name]);
        let height = feet[1] - nose[1];
        joints
            .iter()
            .map(|(name, at)| (name.clone(), [(at[0] - nose[0]) / height, (at[1] - nose[1]) / height]))
            .collect()
    };
    let (_, wanted) = character(&photograph.with_file_name("char_cfg.yaml"));
    let (found, wanted) = (relative(&joints(&drawing)), relative(&wanted));
    check_sides("original_img", &found, &wanted);
    let errors = errors(&found, wanted.iter().map(|(name, place)| (name.as_str(), *place)), 1.0);
    assert!(share(&errors, 0.5) <= 6.0, "{errors:?}");
}

/// A picture of a small person.
pub(crate) fn small_figure() -> Vec<u8> {
    png(&styles::tiny())
}

/// A picture of an animal from the side.
pub(crate) fn small_animal() -> Vec<u8> {
    png(&styles::pig())
}

fn png(drawn: &Drawn) -> Vec<u8> {
    write_png(&drawn.canvas.picture).unwrap_or_else(|error| panic!("{error}"))
}

/// # Panics
/// Where a drawing of a person is not annotated as it was drawn.
fn check_human(drawn: &Drawn) -> Vec<f64> {
    let drawing = annotated(&png(drawn), None).unwrap_or_else(|failure| panic!("{}: {failure}", drawn.name));
    let view = drawing.view();
    assert_eq!(view.rig, "humanoid", "{}: {:?}", drawn.name, view.warnings);
    let found = joints(&drawing);
    let wanted: Joints = drawn.joints.iter().map(|(name, place)| ((*name).to_owned(), *place)).collect();
    check_sides(drawn.name, &found, &wanted);
    let height = (view.bounds.bottom - view.bounds.top) as f64;
    let errors = errors(&found, drawn.joints.iter().copied(), height);
    assert!(share(&errors, 0.5) <= 4.0, "{}: {errors:?}", drawn.name);
    let mask = decoded(&file(&drawing, "mask.png"));
    for joint in &view.skeleton {
        assert_eq!(
            mask.pixels[joint.loc[1] * mask.width + joint.loc[0]][0],
            255,
            "{}: {} is in the mask",
            drawn.name,
            joint.name
        );
    }
    errors
}

#[test]
fn figures_in_many_styles_are_found() {
    let humans = styles::humans();
    assert!(humans.len() >= 10);
    let mut errors: Vec<f64> = humans.iter().flat_map(check_human).collect();
    errors.sort_by(f64::total_cmp);
    assert!(share(&errors, 0.5) <= 4.0 && share(&errors, 0.9) <= 9.0, "together: {errors:?}");
}

#[test]
fn what_was_noticed_is_told() {
    let humans = styles::humans();
    let noticed = [
        ("stick_on_lined_paper", "paper_lines"),
        ("gaps_in_the_outline", "outline_open"),
        ("tadpole", "figure_without_trunk"),
        ("noisy", "picture_noisy"),
        ("on_a_blackboard", "picture_dark"),
        ("sheet_on_a_table", "surroundings_cut"),
    ];
    for (name, code) in noticed {
        let drawn = humans.iter().find(|drawn| drawn.name == name).expect("that style");
        let view = annotated(&png(drawn), None).expect("a figure").view();
        assert!(view.warnings.iter().any(|warning| warning.code == code), "{name}: {:?}", view.warnings);
    }
    let armless = annotated(&png(&styles::armless()), None).expect("a figure").view();
    assert_eq!(armless.rig, "humanoid");
    assert!(armless.warnings.iter().any(|warning| warning.code == "joints_guessed"), "{:?}", armless.warnings);
    let sure = |name: &str| armless.skeleton.iter().find(|joint| joint.name == name).expect("the joint").confidence;
    assert!(sure("left_hand") < 0.5 && sure("left_foot") > 0.5, "what was guessed is less sure than what was seen");
}

#[test]
fn other_bodies_are_refused_as_human_and_get_joints_of_their_own() {
    for animal in [styles::pig(), styles::dog()] {
        let refused = annotated(&png(&animal), Some(BodyKind::Humanoid)).expect_err("it is no person");
        assert_eq!(refused.code, FailureCode::FigureNotFound, "{}: {refused}", animal.name);
        assert!(refused.detail.contains("trunk lies") && refused.hint.contains("quadruped"), "{refused:?}");
        let drawing = annotated(&png(&animal), None).expect("an animal");
        let view = drawing.view();
        assert_eq!((view.rig, view.warnings[0].code), ("quadruped", "body_kind"), "{}", animal.name);
        let height = (view.bounds.bottom - view.bounds.top) as f64;
        let errors = errors(&joints(&drawing), animal.joints.iter().copied(), height);
        assert!(share(&errors, 0.5) <= 4.0, "{}: {errors:?}", animal.name);
    }
    let octopus = annotated(&png(&styles::octopus()), None).expect("limbs").view();
    assert_eq!((octopus.rig, octopus.skeleton.len()), ("chains", 1 + 8 * 3), "three joints for each arm");
    let blank = annotated(&png(&styles::blank()), None).expect_err("nothing is drawn");
    assert_eq!(blank.code, FailureCode::FigureNotFound, "{blank}");
}
