//! What a report found is drawn where it is: judged by another projection than that of the pictures.

use glam::{Vec2, Vec3};
use retargetd::{
    engine::{Format, Limits, NamedBytes, PreviewOptions, View, preview},
    model::Control,
    retarget::{MetricName, Verdict},
    samples,
};
use serde_json::json;

use super::retargeted;
use crate::quality::figure::{position, read_scene, world};

const SIZE: usize = 400;

/// The sample walk on the sample character, moved up by that much: the report, the file, and pictures at a time with and without marks.
fn moved(up_meters: f64, at_seconds: f64) -> (retargetd::engine::Outcome, [Vec<[u8; 4]>; 2]) {
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    let run = |marks: bool| {
        let config = json!({
            "ops": [{"op": "pelvis", "offset": [0.0, up_meters, 0.0]}, {"op": "fk"}],
            "output": {"view": {"size": [SIZE, SIZE], "at_seconds": at_seconds, "marks": marks, "follow": "hold", "camera": "side"}},
        });
        let formats = [Format::Glb, Format::Png];
        retargeted(("walk.glb", &walk), ("mannequin.glb", &mannequin), &config.to_string(), &formats)
    };
    let pictures = [true, false].map(|marks| pixels(&run(marks).outputs[1].bytes));
    (run(true), pictures)
}

fn pixels(bytes: &[u8]) -> Vec<[u8; 4]> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("a PNG");
    let mut buffer = vec![0; reader.output_buffer_size().expect("a size")];
    reader.next_frame(&mut buffer).expect("a frame");
    buffer.chunks_exact(4).map(|part| [part[0], part[1], part[2], part[3]]).collect()
}

/// Where the camera of a still of the file at that time sees a joint, by the angle of view.
fn seen(glb: &[u8], at_seconds: f64, joint: &str) -> Vec2 {
    let view = json!({"size": [SIZE, SIZE], "at_seconds": at_seconds, "follow": "hold", "camera": "side"});
    let view: View = serde_json::from_value(view).expect("a view");
    let options = PreviewOptions { view, ending: "png".to_owned(), clip: None };
    let named = NamedBytes { name: "result.glb", bytes: glb };
    let picture = preview(named, &options, &Limits::default(), &Control::new()).expect("a picture");
    let scene = read_scene(glb, "result.glb");
    let clip = &scene.clips[0];
    let times = clip.times_seconds();
    let frame = (0..times.len())
        .min_by(|one, other| (times[*one] - at_seconds).abs().total_cmp(&(times[*other] - at_seconds).abs()))
        .expect("frames");
    let index = scene.skeleton.joints().iter().position(|own| own.name == joint).expect("the joint");
    let place = position(&world(&scene.skeleton, Some((clip, frame))), index).as_vec3();
    let sight = picture.sights[0];
    let [right, up, back] = sight.axes.map(|axis| axis.dot(place - sight.eye));
    let half = (sight.vertical_degrees.to_radians() / 2.0).tan();
    let off = Vec3::new(right, up, 0.0) / (-back * half);
    Vec2::new(1.0 + off.x, 1.0 - off.y) * (SIZE as f32 / 2.0)
}

#[test]
fn two_centimeters_change_a_mark_and_the_ring_lies_around_its_joint() {
    let (before, _) = moved(0.0, 0.0);
    let value = |outcome: &retargetd::engine::Outcome| {
        let metric = &outcome.report.measures.as_ref().expect("measured").metrics[&MetricName::FloorPenetration];
        (metric.value.expect("measured"), metric.verdict, metric.worst.first().cloned())
    };
    let (sound, verdict, _) = value(&before);
    assert!(verdict == Verdict::Pass, "the walk itself is well: {sound}");
    let (sunk, ..) = moved(-0.02, 0.0);
    let (deep, verdict, worst) = value(&sunk);
    assert!(verdict != Verdict::Pass && deep - sound > 1.0, "two centimeters are told: {sound} and {deep}");
    let worst = worst.expect("where it is worst");

    let (_, [plain, _]) = moved(0.0, worst.time_seconds);
    let (result, [marked, bare]) = moved(-0.02, worst.time_seconds);
    let differing = marked.iter().zip(&plain).filter(|(one, other)| one != other).count();
    assert!(differing > 50, "the pictures differ: {differing}");
    let at = seen(&result.outputs[0].bytes, worst.time_seconds, &worst.joint);
    let radius = SIZE as f32 * 0.045 + 2.0;
    let is_ring = |place: Vec2| {
        let (column, row) = (place.x as usize, place.y as usize);
        column < SIZE && row < SIZE && marked[row * SIZE + column] != bare[row * SIZE + column]
    };
    let turn = |step: usize| Vec2::from_angle(step as f32 * std::f32::consts::TAU / 90.0);
    // Where the ring is, along rays from the joint as another projection sees it.
    let found =
        (0..90).filter(|step| (-8..=8).any(|off| is_ring(at + turn(*step) * (radius + off as f32 * 0.5)))).count();
    assert!(found >= 85, "a ring of {radius} pixels within 4 pixels of {at}: {found} of 90 rays");
}
