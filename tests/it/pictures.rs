//! Pictures of files: by the real binary, and of every body of the corpus.

use std::{path::Path, process::Command};

use rayon::prelude::*;
use retargetd::{
    engine::{Limits, NamedBytes, PreviewOptions, View, preview},
    model::Control,
    samples,
};

use crate::support::{corpus_file, files_below, python_with, skip, with_buffers};

fn draw(arguments: &[&str], folder: &Path, threads: &str) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args(["preview", "walk.glb"])
        .args(arguments)
        .env("RAYON_NUM_THREADS", threads)
        .current_dir(folder)
        .output()
        .expect("the binary runs")
}

/// A folder with the sample walk.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("walk.glb"), samples::walk_clip()).expect("the walk");
    folder
}

fn made(arguments: &[&str], name: &str) -> Vec<u8> {
    let folder = folder();
    let output = draw(&[arguments, &["--output", name]].concat(), folder.path(), "2");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    std::fs::read(folder.path().join(name)).expect("a picture")
}

/// Width, height, and red, green, blue and opacity of all pixels of a PNG.
fn pixels(bytes: &[u8]) -> (usize, usize, Vec<[u8; 4]>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("a PNG");
    let mut buffer = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut buffer).expect("a frame");
    assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Rgba, png::BitDepth::Eight));
    let pixels = buffer.chunks_exact(4).map(|part| [part[0], part[1], part[2], part[3]]).collect();
    (info.width as usize, info.height as usize, pixels)
}

#[test]
fn a_still_has_the_size_that_is_asked_for_and_is_512_pixels_wide_otherwise() {
    let (width, height, all) = pixels(&made(&[], "walk.png"));
    assert_eq!((width, height), (512, 512));
    assert!(all.iter().all(|pixel| pixel[3] == 255), "nothing is transparent unless it is asked for");
    let (width, height, _) = pixels(&made(&["--size", "320x200"], "small.png"));
    assert_eq!((width, height), (320, 200));
    let (width, height, _) = pixels(&made(&["--size", "64", "--sheet", "4x3"], "sheet.png"));
    assert_eq!((width, height), (256, 192), "each cell has the size");
}

#[test]
fn the_figure_is_in_the_middle_of_a_transparent_picture() {
    let (width, height, all) =
        pixels(&made(&["--background", "transparent", "--no-floor", "--camera", "front"], "walk.png"));
    let seen: Vec<(usize, usize)> =
        (0..all.len()).filter(|at| all[*at][3] > 128).map(|at| (at % width, at / width)).collect();
    let share = seen.len() as f64 / all.len() as f64;
    assert!((0.05..0.6).contains(&share), "the figure fills {share:.3} of the picture");
    let rows = (seen.iter().map(|at| at.1).min().unwrap_or(0), seen.iter().map(|at| at.1).max().unwrap_or(0));
    assert!(rows.0 > height / 40 && rows.1 < height - height / 40, "all of it is there: {rows:?}");
    assert!(rows.1 - rows.0 > height * 3 / 4, "and it is large: {rows:?}");
}

#[test]
fn moving_pictures_last_as_long_as_what_they_show() {
    let seconds = samples::walk_scene().clips[0].duration_seconds();
    let arguments = ["--size", "96", "--fps", "12"];
    let frames = (seconds * 12.0).round() as usize;
    let gif = made(&arguments, "walk.gif");
    let mut reader = gif::DecodeOptions::new().read_info(&gif[..]).expect("a GIF");
    assert_eq!(reader.repeat(), gif::Repeat::Infinite);
    let mut delays = Vec::new();
    while let Some(frame) = reader.read_next_frame().expect("a frame") {
        delays.push(frame.delay);
    }
    assert_eq!(delays.len(), frames);
    let total: u32 = delays.iter().map(|delay| u32::from(*delay)).sum();
    assert_eq!(total, (frames as f64 * 100.0 / 12.0).round() as u32, "hundredths of a second, all together exact");

    let webp = made(&arguments, "walk.webp");
    let mut decoder = image_webp::WebPDecoder::new(std::io::Cursor::new(&webp)).expect("a WebP");
    assert_eq!(decoder.dimensions(), (96, 96));
    assert_eq!(decoder.num_frames() as usize, frames);
    let mut buffer = vec![0; decoder.output_buffer_size().expect("a size")];
    let lasts: u32 = (0..frames).map(|_| decoder.read_frame(&mut buffer).expect("a frame")).sum();
    assert_eq!(lasts, (frames as f64 * 1000.0 / 12.0).round() as u32, "milliseconds");

    let apng = made(&arguments, "walk.apng");
    let mut reader = png::Decoder::new(std::io::Cursor::new(&apng)).read_info().expect("a PNG");
    let animation = *reader.info().animation_control().expect("it moves");
    assert_eq!((animation.num_frames as usize, animation.num_plays), (frames, 0));
    let mut buffer = vec![0; reader.output_buffer_size().expect("a size")];
    let mut lasts = 0;
    for _ in 0..frames {
        reader.next_frame(&mut buffer).expect("a frame");
        let control = reader.info().frame_control().expect("how long it is shown");
        assert_eq!(control.delay_den, 1000, "whole milliseconds, which every reader keeps");
        lasts += u32::from(control.delay_num);
    }
    assert_eq!(lasts, (frames as f64 * 1000.0 / 12.0).round() as u32, "milliseconds");
}

/// Reads pictures with Pillow, and tells of each how many frames it has, how often it plays (0: for ever), and its milliseconds.
const READ: &str = r"
import sys
from PIL import Image
for name in sys.argv[1:]:
    with Image.open(name) as picture:
        lasts = 0.0
        for frame in range(picture.n_frames):
            picture.seek(frame)
            picture.load()
            lasts += picture.info['duration']
        print(picture.n_frames, picture.info.get('loop'), round(lasts, 6))
";

/// A rate that no format's unit divides.
#[test]
fn other_readers_find_the_same_frames_loops_and_durations() {
    let Some(python) = python_with("PIL") else { return skip("there is no Python with Pillow") };
    let seconds = samples::walk_scene().clips[0].duration_seconds();
    let (folder, frames) = (folder(), (seconds * 23.976).round() as usize);
    let names = ["walk.gif", "walk.webp", "walk.apng"];
    let paths = names.map(|name| folder.path().join(name));
    for (name, path) in names.iter().zip(&paths) {
        let bytes = made(&["--size", "64", "--fps", "23.976"], name);
        std::fs::write(path, bytes).expect("written");
    }
    let read = Command::new(python).args(["-c", READ]).args(&paths).output().expect("Python runs");
    assert!(read.status.success(), "Pillow reads them: {}", String::from_utf8_lossy(&read.stderr));
    let text = String::from_utf8(read.stdout).expect("text");
    let exact = frames as f64 * 1000.0 / 23.976;
    for ((name, line), unit) in names.iter().zip(text.lines()).zip([10.0, 1.0, 1.0]) {
        let words: Vec<f64> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
        assert_eq!(words[..2], [frames as f64, 0.0], "{name}: frames, and repeated for ever: {line}");
        assert!((words[2] - exact).abs() <= unit / 2.0, "{name}: lasts {exact} ms but for its unit: {line}");
    }
    if Command::new("ffprobe").arg("-version").output().is_err() {
        return skip("there is no ffprobe");
    }
    for path in [&paths[0], &paths[2]] {
        let arguments = ["-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames", "-of", "csv=p=0"];
        let read = Command::new("ffprobe").args(arguments).arg(path).output().expect("ffprobe runs");
        let text = String::from_utf8_lossy(&read.stdout).trim().to_owned();
        assert_eq!((text, read.stderr.len()), (frames.to_string(), 0), "{}", path.display());
    }
}

/// One second of a video has as many frames as were asked for, of the size that was; where the build has none, it says so.
#[test]
fn videos_are_as_long_as_what_they_show() {
    let folder = folder();
    let output = draw(&["--size", "97x64", "--fps", "23.976", "--output", "walk.mp4"], folder.path(), "2");
    if !cfg!(feature = "mp4") {
        assert_eq!(output.status.code(), Some(3), "it is told");
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        return assert!(error.contains("without the feature 'mp4'"), "{error}");
    }
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    if Command::new("ffprobe").arg("-version").output().is_err() {
        return skip("there is no ffprobe");
    }
    let entries = "stream=codec_name,width,height,nb_read_frames,duration,color_space";
    let arguments = ["-v", "error", "-count_frames", "-show_entries", entries, "-of", "json"];
    let read = Command::new("ffprobe").args(arguments).arg(folder.path().join("walk.mp4")).output().expect("runs");
    assert_eq!(String::from_utf8_lossy(&read.stderr), "");
    let stream = serde_json::from_slice::<serde_json::Value>(&read.stdout).expect("JSON")["streams"][0].clone();
    let frames = (samples::walk_scene().clips[0].duration_seconds() * 23.976).round();
    assert_eq!(stream["codec_name"], "h264");
    assert_eq!((&stream["width"], &stream["height"]), (&98.into(), &64.into()), "sides are even");
    assert_eq!(stream["nb_read_frames"], frames.to_string().as_str());
    let seconds: f64 = stream["duration"].as_str().and_then(|text| text.parse().ok()).expect("a duration");
    assert!((seconds - frames / 23.976).abs() < 1e-4, "{seconds} s for {frames} frames");
}

#[test]
fn frames_of_a_webp_are_those_of_the_stills() {
    let webp = made(&["--size", "96", "--fps", "2"], "walk.webp");
    let mut decoder = image_webp::WebPDecoder::new(std::io::Cursor::new(&webp)).expect("a WebP");
    let mut buffer = vec![0; decoder.output_buffer_size().expect("a size")];
    decoder.read_frame(&mut buffer).expect("the first");
    decoder.read_frame(&mut buffer).expect("the second");
    let (.., second) = pixels(&made(&["--size", "96", "--at", "0.5", "--follow", "figure"], "at.png"));
    // The camera is set up by the frames that are shown, so it stands a little otherwise; what is seen is much the same.
    let step = if decoder.has_alpha() { 4 } else { 3 };
    let differing =
        buffer.chunks_exact(step).zip(&second).filter(|(one, other)| one[0].abs_diff(other[0]) > 60).count();
    assert!(differing * 12 < second.len(), "{differing} of {} pixels differ", second.len());
}

#[test]
fn pictures_are_the_same_for_any_number_of_threads() {
    let folder = folder();
    let video = cfg!(feature = "mp4").then_some("mp4");
    for ending in ["png", "gif", "webp", "apng"].into_iter().chain(video) {
        let mut first: Option<Vec<u8>> = None;
        for threads in ["1", "2", "8"] {
            let name = format!("{threads}.{ending}");
            let output = draw(&["--size", "80", "--fps", "10", "--output", &name], folder.path(), threads);
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            let bytes = std::fs::read(folder.path().join(&name)).expect("a picture");
            assert_eq!(*first.get_or_insert_with(|| bytes.clone()), bytes, "{ending} with {threads} threads");
        }
    }
}

#[test]
fn what_cannot_be_drawn_is_told() {
    let folder = folder();
    let cases: [(&[&str], i32, &str); 7] = [
        (&["--output", "walk.glb.jpg"], 2, "end the name in .png, .webp, .gif, .apng or .mp4"),
        (&["--output", "a.png", "--size", "5000"], 2, "size: both sides are 16 to 1920 pixels"),
        (&["--output", "a.png", "--size", "wide"], 2, "give pixels, as 512 or 640x360"),
        (&["--output", "a.gif", "--fps", "0"], 2, "fps: it is 1 to 60"),
        (&["--output", "a.png", "--sheet", "40x1"], 2, "sheet: columns and rows are 1 to 16 each"),
        (&["--output", "a.png", "--clip", "Run"], 3, "there is no clip 'Run'"),
        (&["--output", "walk.glb"], 2, "walk.glb"),
    ];
    for (arguments, code, says) in cases {
        let output = draw(arguments, folder.path(), "1");
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
        assert!(error.contains(says), "{arguments:?}: {error}");
        assert!(error.lines().count() <= 3 || code == 2, "{arguments:?}: {error}");
    }
}

/// A retarget of the sample walk onto the mannequin with that config, whose output goes to a file of that name.
fn retargeted(config: &str, name: &str) -> Vec<u8> {
    let folder = folder();
    std::fs::write(folder.path().join("mannequin.glb"), samples::mannequin()).expect("the mannequin");
    std::fs::write(folder.path().join("config.json"), config).expect("the config");
    let output = Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args([
            "retarget",
            "--source",
            "walk.glb",
            "--target",
            "mannequin.glb",
            "--config",
            "config.json",
            "--output",
            name,
        ])
        .current_dir(folder.path())
        .output()
        .expect("the binary runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    std::fs::read(folder.path().join(name)).expect("a picture")
}

fn with_view(view: &str) -> String {
    format!("{{\"output\": {{\"view\": {view}}}}}")
}

#[test]
fn results_are_pictures_where_the_output_asks_for_one() {
    let (width, height, _) = pixels(&retargeted("{}", "result.png"));
    assert_eq!((width, height), (512, 512), "as a preview is");
    let (width, height, both) =
        pixels(&retargeted(&with_view(r#"{"size": [100, 120], "layout": "side_by_side"}"#), "both.png"));
    assert_eq!((width, height), (200, 120), "source and result beside one another");
    let seen = |side: usize| {
        let of_side = |at: &usize| at % width / 100 == side && both[*at][..3].iter().any(|part| *part < 160);
        (0..both.len()).filter(of_side).count()
    };
    assert!(seen(0) > 400 && seen(1) > 400, "both are there: {} and {}", seen(0), seen(1));
    let (width, ..) = pixels(&retargeted(&with_view(r#"{"size": [100, 120], "layout": "overlay"}"#), "ghost.png"));
    assert_eq!(width, 100, "a ghost needs no more room");
    let gif = retargeted(&with_view(r#"{"size": [64, 64], "fps": 5, "range": [0, 1]}"#), "result.gif");
    assert!(gif.starts_with(b"GIF89a"));
}

#[test]
fn a_ghost_of_the_source_is_blue_and_lies_where_the_result_does_not() {
    let blue = |layout: &str| {
        let view = format!(r#"{{"size": [160, 200], "layout": "{layout}", "camera": "front"}}"#);
        let (.., all) = pixels(&retargeted(&with_view(&view), "ghost.png"));
        all.iter().filter(|pixel| i32::from(pixel[2]) - i32::from(pixel[0]) > 60).count()
    };
    assert_eq!(blue("single"), 0, "the mannequin is gray");
    assert!(blue("overlay") > 200, "{}", blue("overlay"));
}

#[test]
fn the_worst_frames_have_rings_in_the_color_of_their_verdict() {
    let config = |jerk: f64| {
        let view = r#"{"size": [200, 200], "sheet": "worst", "marks": true}"#;
        format!(
            r#"{{"output": {{"view": {view}}}, "report": {{"thresholds": {{"foot_slide": {{"warn_above": 0.0, "fail_above": {jerk}}}}}}}}}"#
        )
    };
    let count = |bytes: &[u8], color: [u8; 3]| {
        let (.., all) = pixels(bytes);
        all.iter().filter(|pixel| pixel[..3] == color).count()
    };
    let (warned, failed) = (retargeted(&config(1000.0), "worst.png"), retargeted(&config(0.0), "worst.png"));
    assert!(count(&warned, [226, 138, 8]) > 20, "orange where it is doubtful");
    assert_eq!(count(&warned, [214, 40, 40]), 0, "nothing fails");
    assert!(count(&failed, [214, 40, 40]) > 20, "red where it is wrong");
}

#[test]
fn a_view_that_cannot_be_shown_is_told() {
    let folder = folder();
    std::fs::write(folder.path().join("mannequin.glb"), samples::mannequin()).expect("the mannequin");
    let cases = [
        (r#"{"output": {"view": {"size": [4, 4]}}}"#, "/output/view/size: both sides are 16 to 1920 pixels"),
        (r#"{"output": {"view": {"camera": "below"}}}"#, "/output/view"),
        (r#"{"output": {"view": {"sheet": "best"}}}"#, "/output/view"),
        (
            r#"{"output": {"view": {"range": [60, 80], "sheet": {"columns": 2, "rows": 1}}}}"#,
            "range: it begins at 60 s, after the clip's end at 4.000 s",
        ),
        (r#"{"report": "none", "output": {"view": {"sheet": "worst"}}}"#, "nothing was measured that could be worst"),
    ];
    for (config, says) in cases {
        std::fs::write(folder.path().join("config.json"), config).expect("the config");
        let output = Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .args([
                "retarget",
                "--source",
                "walk.glb",
                "--target",
                "mannequin.glb",
                "--config",
                "config.json",
                "--output",
                "a.png",
            ])
            .current_dir(folder.path())
            .output()
            .expect("the binary runs");
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{config}: {error}");
        assert!(error.contains(says), "{config}: {error}");
    }
}

#[test]
fn two_files_are_compared_at_one_scale() {
    let folder = folder();
    std::fs::write(folder.path().join("mannequin.glb"), samples::mannequin()).expect("the mannequin");
    let compare = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
        let command = command.args(["compare", "mannequin.glb", "walk.glb", "--size", "160", "--output", "both.png"]);
        let output =
            command.args(arguments).arg("--force").current_dir(folder.path()).output().expect("the binary runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        pixels(&std::fs::read(folder.path().join("both.png")).expect("a picture"))
    };
    assert_eq!(compare(&[]).0, 320, "beside one another");
    assert_eq!(compare(&["--overlay"]).0, 160, "through one another");
}

#[test]
fn the_page_of_a_report_shows_the_result() {
    let folder = folder();
    std::fs::write(folder.path().join("mannequin.glb"), samples::mannequin()).expect("the mannequin");
    let output = Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args([
            "retarget",
            "--source",
            "walk.glb",
            "--target",
            "mannequin.glb",
            "--output",
            "out.glb",
            "--report",
            "report.html",
        ])
        .current_dir(folder.path())
        .output()
        .expect("the binary runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let page = std::fs::read_to_string(folder.path().join("report.html")).expect("a page");
    assert!(page.contains("<img src=\"data:image/png;base64,"), "a picture in it");
}

/// Every file with a body gives a picture with the whole figure in it.
#[test]
fn every_body_of_the_corpus_gives_a_picture() {
    let Some(anchor) = corpus_file("mixamo/gltf/Xbot.glb") else { return };
    let corpus = anchor.ancestors().nth(3).expect("the corpus").to_owned();
    let folders = [
        "mixamo",
        "unreal",
        "vrm0",
        "vrm1",
        "readyplayerme",
        "creatures",
        "cc0-stylised",
        "character-creator",
        "poser-daz",
        "rigify-blender",
        "decentraland",
        "biped",
        "humanik-unity",
        "roblox-r15",
    ];
    let files: Vec<_> = folders.iter().flat_map(|folder| files_below(&corpus.join(folder))).collect();
    let endings = ["glb", "gltf", "vrm", "fbx", "bvh", "npz"];
    let is_read =
        |path: &&std::path::PathBuf| path.extension().is_some_and(|own| endings.iter().any(|ending| own == *ending));
    let wrong: Vec<String> = files.par_iter().filter(is_read).filter_map(|path| wrong_picture(path)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn wrong_picture(path: &Path) -> Option<String> {
    let mut bytes = std::fs::read(path).expect("readable");
    if path.extension().is_some_and(|ending| ending == "gltf") {
        bytes = with_buffers(&bytes, path);
    }
    let name = path.file_name()?.to_string_lossy();
    let view = View {
        size: [128, 128],
        background: retargetd::engine::Background::Transparent,
        floor: false,
        ..View::default()
    };
    let options = PreviewOptions { view, ending: "png".to_owned(), clip: None };
    let file = NamedBytes { name: &name, bytes: &bytes };
    let picture = match preview(file, &options, &Limits::default(), &Control::new()) {
        Ok(picture) => picture,
        Err(failure) => return Some(format!("{}: {failure}", path.display())),
    };
    let (.., all) = pixels(&picture.bytes);
    let share = all.iter().filter(|pixel| pixel[3] > 128).count() as f64 / all.len() as f64;
    let colors: std::collections::BTreeSet<[u8; 4]> = all.iter().copied().filter(|pixel| pixel[3] > 128).collect();
    let is_black = colors.iter().all(|color| color[..3].iter().all(|part| *part < 12));
    let is_right = (0.03..0.6).contains(&share) && !is_black && colors.len() > 8;
    (!is_right).then(|| format!("{}: fills {share:.3}, {} colors", path.display(), colors.len()))
}

/// A pole of two bones that leans and comes back, that tall in centimeters.
fn pole(height: f64) -> String {
    let half = height / 2.0;
    format!(
        "HIERARCHY\nROOT hips\n{{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\nJOINT chest\n\
         {{\nOFFSET 0 {half} 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{{\nOFFSET 0 {half} 0\n}}\n}}\n}}\nMOTION\nFrames: 3\n\
         Frame Time: 0.1\n0 0 0 0 0 0 0 0 0\n0 0 0 5 0 0 0 0 0\n0 0 0 0 0 0 0 0 0\n"
    )
}

#[test]
fn figures_of_very_different_size_are_seen_equally_tall() {
    let folder = folder();
    for (name, height) in [("small.bvh", 100.0), ("large.bvh", 300.0), ("alike.bvh", 90.0)] {
        std::fs::write(folder.path().join(name), pole(height)).expect("a pole");
    }
    let rows = |first: &str, second: &str| {
        let arguments = ["compare", first, second, "--output", "both.png", "--size", "200x200", "--force"];
        let output = Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .args(arguments)
            .current_dir(folder.path())
            .output()
            .expect("the binary runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let (width, _, both) = pixels(&std::fs::read(folder.path().join("both.png")).expect("a picture"));
        assert_eq!(width, 400, "one beside the other");
        [0, 1].map(|side| {
            let is_dark = |at: &usize| at % width / 200 == side && both[*at][..3].iter().all(|part| *part < 170);
            let dark: Vec<usize> = (0..170 * width).filter(is_dark).map(|at| at / width).collect();
            dark.iter().max().expect("it is seen") - dark.iter().min().expect("it is seen")
        })
    };
    let [one, other] = rows("small.bvh", "large.bvh");
    assert!(one > 80 && one.abs_diff(other) <= 6, "{one} and {other} rows");
    let [one, other] = rows("alike.bvh", "small.bvh");
    assert!(other * 9 > one * 10 - 60 && other > one, "those of nearly one size at one scale: {one} and {other} rows");
}
