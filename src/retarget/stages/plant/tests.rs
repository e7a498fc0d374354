use glam::DQuat;

use super::*;

const FRAMES: usize = 40;

fn times() -> Vec<f64> {
    (0..FRAMES).map(|frame| frame as f64 / 30.0).collect()
}

fn stage(mode: PlantMode) -> PlantStage {
    PlantStage {
        op: PlantOp { mode, blend_seconds: 0.1, ..PlantOp::default() },
        schedule: Schedule { alpha: vec![[0.0, 1.0]], frames: [0, FRAMES - 1] },
        limbs: Vec::new(),
        travel: DMat3::IDENTITY * 2.0,
        up: DVec3::Y,
        limb_count: 1,
    }
}

fn point(is_ball: bool, positions: Vec<DVec3>, touches: std::ops::Range<usize>) -> ContactPoint {
    let touches = (0..FRAMES).map(|frame| touches.contains(&frame)).collect();
    ContactPoint { name: "left_foot", limb: 0, is_ball, positions, touches }
}

fn goal(position: DVec3, rotation: DQuat) -> Goal {
    Goal { position, rotation, ..Goal::default() }
}

/// Positions of a point after the corrections.
fn planted(stage: &PlantStage, foot: &Foot<'_>, local: DVec3) -> (Vec<DVec3>, Vec<Correction>) {
    let corrections = stage.corrections(foot, &times());
    let place = |(goal, correction): (&Goal, &Correction)| goal.position + goal.rotation * local + correction.offset;
    (foot.goals.iter().zip(&corrections).map(place).collect(), corrections)
}

#[test]
fn a_foot_that_slides_beside_its_source_is_held() {
    // The source stands from frame 10 to 30 and creeps by 1 mm a frame; the target slides by 1 cm a frame.
    let source = (0..FRAMES).map(|frame| DVec3::Z * 0.001 * frame as f64).collect();
    let end = point(false, source, 10..31);
    let goals: Vec<Goal> =
        (0..FRAMES).map(|frame| goal(DVec3::X * 0.01 * frame as f64, DQuat::IDENTITY)).collect();
    let foot = Foot { end: &end, ball: None, target_ball: None, goals: &goals };
    let (places, corrections) = planted(&stage(PlantMode::Auto), &foot, DVec3::ZERO);
    for frame in 10..30 {
        let step = places[frame + 1] - places[frame];
        assert!((step - DVec3::Z * 0.002).length() < 1e-12, "moves as the source does, scaled: {step}");
    }
    assert!((places[20].x - 0.2).abs() < 1e-9, "stands where it deviates least: {}", places[20]);
    assert_eq!(corrections[5].offset, DVec3::ZERO, "nothing long before");
    assert_eq!(corrections[35].offset, DVec3::ZERO, "nothing long after");
    let (places, _) = planted(&stage(PlantMode::Always), &foot, DVec3::ZERO);
    assert!(places[10].distance(places[30]) < 1e-12, "always: not at all");
    let (_, corrections) = planted(&stage(PlantMode::Grounding), &foot, DVec3::ZERO);
    assert!(corrections.iter().all(|correction| correction.offset.length() < 1e-12), "grounding: may glide");
}

#[test]
fn the_ball_is_held_while_the_heel_lifts() {
    // Flat from 5 to 20, then the foot turns about its ball until 30.
    let ball = DVec3::new(0.0, -0.05, 0.15);
    let still = |place: DVec3| (0..FRAMES).map(|_| place).collect::<Vec<_>>();
    let end = point(false, still(DVec3::ZERO), 5..20);
    let toe = point(true, still(ball), 5..30);
    let goals: Vec<Goal> = (0..FRAMES)
        .map(|frame| {
            let pitch = DQuat::from_rotation_x((frame as f64 - 19.0).clamp(0.0, 10.0) * 0.06);
            // The goals' own ball glides by 5 mm a frame.
            goal(ball - pitch * ball + DVec3::Z * 0.005 * frame as f64, pitch)
        })
        .collect();
    let foot = Foot { end: &end, ball: Some(&toe), target_ball: Some(ball), goals: &goals };
    let (places, _) = planted(&stage(PlantMode::Auto), &foot, ball);
    let slid = places[24..30].windows(2).map(|pair| pair[0].distance(pair[1])).fold(0.0, f64::max);
    assert!(slid < 1e-12, "the ball stands: {slid}");
    let along: f64 = places[5..30].windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    assert!(along < 0.005, "also while the weight goes over: {along}");
}

#[test]
fn short_gaps_lead_straight_from_one_place_to_the_next() {
    let mut corrections = vec![Correction::default(); 10];
    corrections[2] = Correction { offset: DVec3::X, hold: 1.0 };
    corrections[7] = Correction { offset: DVec3::X * 3.0, hold: 1.0 };
    let times: Vec<f64> = (0..10).map(f64::from).collect();
    fade(&mut corrections, &times, Some(2), Some(7), 4.0);
    let offsets: Vec<f64> = corrections[2..8].iter().map(|correction| correction.offset.x).collect();
    assert!(offsets.windows(2).all(|pair| pair[0] < pair[1]), "never back: {offsets:?}");
    fade(&mut corrections, &times, Some(7), None, 2.0);
    assert_eq!(corrections[9].offset, DVec3::ZERO, "let go after two seconds");
    assert!(corrections[8].offset.x > 0.0, "on the way");
}
