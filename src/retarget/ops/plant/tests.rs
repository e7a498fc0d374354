//! Feet are held, rolled and let go.

use glam::DQuat;

use crate::model::{Skeleton, Transform};

use super::*;

const FRAMES: usize = 40;

fn times() -> Vec<f64> {
    (0..FRAMES).map(|frame| frame as f64 / 30.0).collect()
}

fn stage(mode: PlantMode) -> PlantStage {
    PlantStage {
        op: PlantOp { mode, blend_seconds: 0.1, ..PlantOp::default() },
        schedule: Schedule { alpha: vec![[0.0, 1.0]], frames: [0, FRAMES - 1] },
        feet: Vec::new(),
        posing: Posing::new(&Skeleton::default(), Transform::IDENTITY, []),
        up: DVec3::Y,
        limb_count: 1,
        leaves_height: false,
    }
}

fn track(positions: Vec<DVec3>, touches: std::ops::Range<usize>) -> Option<PointTrack> {
    let touches = (0..FRAMES).map(|frame| touches.contains(&frame)).collect();
    Some(PointTrack { speeds: speeds(&positions, &times()), positions, touches })
}

/// On a floor that stands; the target has the points that the source has.
fn foot(scale: f64, tracks: [Option<PointTrack>; 3], targets: Vec<[DVec3; 3]>) -> Foot {
    let has_point = tracks.each_ref().map(Option::is_some);
    Foot { scale, still_speed: 0.05, landing_speed: 1.5, swing: 0.03, tracks, has_point, targets, running_floor: None }
}

/// Positions of a point of the target after the corrections.
fn planted(stage: &PlantStage, foot: &Foot, part: usize) -> (Vec<DVec3>, Vec<Correction>) {
    let corrections = stage.corrections(foot, &times(), None);
    let place = |(target, correction): (&[DVec3; 3], &Correction)| target[part] + correction.offset;
    (foot.targets.iter().zip(&corrections).map(place).collect(), corrections)
}

#[test]
fn a_foot_that_slides_beside_its_source_is_held() {
    // The source touches from frame 10 to 30 and slides by 1 cm a frame; the target by as much to the side.
    let source = (0..FRAMES).map(|frame| DVec3::Z * 0.01 * frame as f64).collect();
    let targets = (0..FRAMES).map(|frame| [DVec3::X * 0.01 * frame as f64; 3]).collect();
    let tracks = [track(source, 10..31), None, None];
    let foot = foot(2.0, tracks, targets);
    let (places, corrections) = planted(&stage(PlantMode::Auto), &foot, 0);
    for frame in 10..30 {
        let step = places[frame + 1] - places[frame];
        assert!((step - DVec3::Z * 0.02).length() < 1e-12, "moves as the source does, scaled: {step}");
    }
    assert!((places[20].x - 0.2).abs() < 1e-9, "stands where it deviates least: {}", places[20]);
    let leaving = PlantStage { leaves_height: true, ..stage(PlantMode::Auto) };
    let (_, level) = planted(&leaving, &foot, 0);
    assert!(level.iter().all(|correction| correction.offset.y.abs() < 1e-12), "the floor says how high it is");
    assert_eq!(corrections[5].offset, DVec3::ZERO, "nothing long before");
    assert_eq!(corrections[35].offset, DVec3::ZERO, "nothing long after");
    let (places, _) = planted(&stage(PlantMode::Always), &foot, 0);
    assert!(places[10].distance(places[30]) < 1e-12, "always: not at all");
    let (_, corrections) = planted(&stage(PlantMode::Grounding), &foot, 0);
    assert!(corrections.iter().all(|correction| correction.offset.length() < 1e-12), "grounding: may glide");
}

#[test]
fn a_foot_creeps_no_farther_than_its_source_nor_than_by_itself() {
    // By 1 mm a frame; scaled that is 2 mm.
    let source: Vec<DVec3> = (0..FRAMES).map(|frame| DVec3::Z * 0.001 * frame as f64).collect();
    for (own, wanted) in [(0.5, 0.5), (3.0, 2.0), (-1.0, 0.0)] {
        let own = DVec3::new(10.0, 0.0, own) * 0.001;
        let targets = (0..FRAMES).map(|frame| [own * frame as f64; 3]).collect();
        let foot = foot(2.0, [track(source.clone(), 10..31), None, None], targets);
        let (places, _) = planted(&stage(PlantMode::Auto), &foot, 0);
        for frame in 10..30 {
            let step = places[frame + 1] - places[frame];
            assert!((step - DVec3::Z * wanted * 0.001).length() < 1e-12, "{wanted} mm the way of the source: {step}");
        }
    }
}

#[test]
fn a_foot_that_is_still_in_the_air_is_not_torn_down() {
    // The source stands from frame 10 to 30. The target comes down beside where it will stand, by 10 cm a frame until frame 12.
    let above = |frame: usize| 0.1 * (12.0 - frame as f64).clamp(0.0, 6.0);
    let targets = (0..FRAMES).map(|frame| [DVec3::new(0.01 * frame as f64, above(frame), 0.0); 3]).collect();
    let foot = foot(1.0, [track(vec![DVec3::ZERO; FRAMES], 10..31), None, None], targets);
    let (places, corrections) = planted(&stage(PlantMode::Auto), &foot, 0);
    for (frame, correction) in corrections.iter().enumerate() {
        let lowered = -correction.offset.y;
        assert!(lowered < 0.05, "frame {frame}: {} m over the floor, {lowered} m farther down", above(frame));
    }
    let slid = places[12..30].windows(2).map(|pair| pair[0].distance(pair[1])).fold(0.0, f64::max);
    assert!(slid < 1e-12, "held from where it has landed on: {slid}");
}

/// The source turns on the tip of its toes within five frames; a foot that is long for its leg would have to go 20 cm a frame for that.
#[test]
fn a_foot_that_is_swung_about_its_tip_is_not_held_at_any_speed() {
    let source = vec![DVec3::ZERO; FRAMES];
    let swung = |frame: usize| frame.clamp(18, 23) as f64 - 18.0;
    let targets = (0..FRAMES).map(|frame| [DVec3::X * 0.2 * swung(frame); 3]).collect();
    let foot = foot(1.0, [track(source, 5..36), None, None], targets);
    let (places, corrections) = planted(&stage(PlantMode::Auto), &foot, 0);
    let fastest =
        corrections[5..36].windows(2).map(|pair| pair[0].offset.distance(pair[1].offset) * 30.0).fold(0.0, f64::max);
    assert!(fastest < 1.4 * 1.5 + 1e-9, "it is moved by {fastest} m/s");
    let stands =
        |frames: std::ops::Range<usize>| frames.map(|frame| places[frame].distance(places[frame + 1])).sum::<f64>();
    assert!(stands(6..17) < 1e-9 && stands(24..34) < 1e-9, "where it does not turn it stands");
}

#[test]
fn the_ball_is_held_while_the_heel_lifts() {
    // Flat from 5 to 20, then the foot turns about its ball until 30.
    let ball = DVec3::new(0.0, -0.05, 0.15);
    let still = |place: DVec3| (0..FRAMES).map(|_| place).collect::<Vec<_>>();
    let targets = (0..FRAMES).map(|frame| {
        let pitch = DQuat::from_rotation_x((frame as f64 - 19.0).clamp(0.0, 10.0) * 0.06);
        // The goals' own ball glides by 5 mm a frame.
        let place = ball + DVec3::Z * 0.005 * frame as f64;
        [place - pitch * ball, place, place]
    });
    let tracks = [track(still(DVec3::ZERO), 5..20), track(still(ball), 5..30), None];
    let foot = foot(1.0, tracks, targets.collect());
    let (places, _) = planted(&stage(PlantMode::Auto), &foot, 1);
    let slid = places[24..30].windows(2).map(|pair| pair[0].distance(pair[1])).fold(0.0, f64::max);
    assert!(slid < 1e-12, "the ball stands: {slid}");
    let along: f64 = places[5..30].windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    assert!(along < 0.005, "also while the weight goes over: {along}");
}

#[test]
fn a_foot_that_always_stands_gets_nowhere_in_a_clip_that_is_repeated() {
    // The source's foot shifts to and fro within ten frames and rests for half of them; the target's goals add 2 cm a period to that.
    let sway =
        |frame: usize| if frame % 10 < 5 { 0.01 * (frame as f64 * std::f64::consts::TAU / 5.0).sin() } else { 0.0 };
    let source: Vec<DVec3> = (0..FRAMES).map(|frame| DVec3::Z * sway(frame)).collect();
    let targets = (0..FRAMES).map(|frame| [source[frame] + DVec3::X * 0.002 * frame as f64; 3]).collect();
    let foot = foot(1.0, [track(source, 0..FRAMES), None, None], targets);
    let offsets = |period: Option<usize>| -> Vec<DVec3> {
        let corrections = stage(PlantMode::Auto).corrections(&foot, &times(), period);
        corrections.into_iter().map(|correction| correction.offset).collect()
    };
    let apart =
        |offsets: &[DVec3]| (0..30).map(|frame| offsets[frame].distance(offsets[frame + 10])).fold(0.0, f64::max);
    let (repeated, once) = (offsets(Some(10)), offsets(None));
    assert!((apart(&once) - 0.02).abs() < 1e-9, "without a period it goes on: {}", apart(&once));
    assert!(apart(&repeated) < 1e-9, "with one it comes back: {}", apart(&repeated));
    let resting = repeated[16].distance(repeated[17]);
    assert!((resting - 0.002).abs() < 1e-9, "it is held where the source's rests: {resting}");
}

#[test]
fn short_gaps_lead_straight_from_one_place_to_the_next() {
    let mut corrections = vec![Correction::default(); 10];
    corrections[2] = Correction { offset: DVec3::X, hold: 1.0 };
    corrections[7] = Correction { offset: DVec3::X * 3.0, hold: 1.0 };
    let times: Vec<f64> = (0..10).map(f64::from).collect();
    fade(&mut corrections, &times, Some(2), Some(7), 4.0, 0.03);
    let offsets: Vec<f64> = corrections[2..8].iter().map(|correction| correction.offset.x).collect();
    assert!(offsets.windows(2).all(|pair| pair[0] < pair[1]), "never back: {offsets:?}");
    fade(&mut corrections, &times, Some(7), None, 2.0, 0.03);
    assert_eq!(corrections[9].offset, DVec3::ZERO, "let go after two seconds");
    assert!(corrections[8].offset.x > 0.0, "on the way");
}

#[test]
fn a_foot_that_is_held_while_it_moves_swings_out_little_before() {
    // From frame 20 on the foot is held, and its goal goes on by 0.6 m/s; it lets go at frame 30.
    let mut corrections = vec![Correction::default(); FRAMES];
    for (index, correction) in corrections[20..30].iter_mut().enumerate() {
        *correction = Correction { offset: DVec3::X * (0.02 * index as f64 - 0.05), hold: 1.0 };
    }
    fade(&mut corrections, &times(), None, Some(20), 0.35, 0.03);
    let farthest = corrections[..20].iter().map(|correction| correction.offset.length()).fold(0.0, f64::max);
    assert!(farthest > 0.05, "its speed does not change at once: {farthest}");
    assert!(farthest < 0.07, "it goes out of its way by {farthest} m, to where it is moved by 5 cm");
}
