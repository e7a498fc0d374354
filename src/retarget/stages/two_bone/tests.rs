//! Limbs get where they can, and stay finite where they cannot.

use super::*;

/// A leg that hangs down and is bent by that many degrees at the knee, forward.
fn leg(bend_degrees: f64) -> TwoBone {
    let (start, middle) = (DVec3::new(0.1, 1.0, 0.0), DVec3::new(0.1, 0.55, 0.0));
    let end = middle + DQuat::from_rotation_x(bend_degrees.to_radians()) * DVec3::new(0.0, -0.4, 0.0);
    TwoBone {
        start,
        middle,
        end,
        hinge: DVec3::X,
        goal: end,
        softness: 0.03,
        extension: 0.0,
        stretch: 1.0,
        change: None,
        near_axis: None,
    }
}

/// Where the end is when the two rotations are applied to the joints one after the other.
fn posed(limb: &TwoBone, reach: &Reach) -> DVec3 {
    let bent = limb.middle + reach.bend * (limb.end - limb.middle);
    limb.start + reach.aim * (bent - limb.start) * reach.stretch
}

/// Goals all around the start, within and beyond what the limb reaches.
fn goals() -> Vec<DVec3> {
    let mut goals = Vec::new();
    for distance in [0.06, 0.2, 0.5, 0.8, 0.82] {
        for step in 0..40_u32 {
            let (turn, height) = (f64::from(step) * 0.7, f64::from(step) / 19.5 - 1.0);
            let level = (1.0 - height * height).max(0.0).sqrt();
            goals.push(DVec3::new(turn.cos() * level, height, turn.sin() * level) * distance);
        }
    }
    goals
}

#[test]
fn what_is_in_reach_is_reached() {
    for bend in [5.0, 40.0, 110.0] {
        for goal in goals() {
            let limb = leg(bend);
            let limb = TwoBone { goal: limb.start + goal, ..limb };
            let reach = limb.solve();
            assert!(reach.end.distance(limb.goal) < 1e-9, "bend {bend}, goal {goal}: {}", reach.end);
            assert!(posed(&limb, &reach).distance(reach.end) < 1e-9, "the rotations say the same");
            assert!((reach.middle.distance(limb.start) - 0.45).abs() < 1e-12, "bones keep their length");
        }
    }
}

/// A leg whose shin is turned by so many degrees sideways and forward at the knee.
fn knock_kneed(side_degrees: f64, forward_degrees: f64) -> TwoBone {
    let limb = leg(0.0);
    let turn = DQuat::from_rotation_z(side_degrees.to_radians()) * DQuat::from_rotation_x(forward_degrees.to_radians());
    TwoBone { end: limb.middle + turn * DVec3::new(0.0, -0.4, 0.0), ..limb }
}

#[test]
fn a_knee_that_is_off_to_a_side_reaches_exactly() {
    for side in [-15.0, -9.5, -4.0, 4.0, 9.5, 15.0] {
        for distance in [0.3, 0.6, 0.8] {
            let limb = knock_kneed(side, 1.0);
            let limb = TwoBone { goal: limb.start + DVec3::new(0.1, -1.0, 0.2).normalize() * distance, ..limb };
            let reach = limb.solve();
            assert!(reach.end.distance(limb.goal) < 1e-9, "{side}° at {distance}: {}", reach.end.distance(limb.goal));
        }
    }
}

/// On which side of the hinge the normal of the limb's plane lies is noise where the knee is bent across the hinge.
#[test]
fn a_knee_that_is_off_to_a_side_does_not_flip() {
    for side in [3.0, 6.0, 9.5, 12.0, 16.0, 20.0, 60.0] {
        let knees = [-0.01, 0.01].map(|forward| {
            let limb = knock_kneed(side, forward);
            let goal = limb.start + DVec3::new(0.0, -0.78_f64.min(limb.end.distance(limb.start) - 0.02), 0.0);
            TwoBone { goal, ..limb }.solve().middle
        });
        let apart = knees[0].distance(knees[1]);
        // Where plane and hinge give way to one another, a hundredth of a degree moves it by up to 1.5 mm.
        assert!(apart < 2e-3, "{side}°: the knee is {apart} elsewhere");
    }
}

#[test]
fn a_goal_that_is_reached_already_changes_nothing() {
    for bend in [-100.0, -40.0, -20.0, -8.0, -1.0, 0.0, 0.5, 30.0, 120.0] {
        let limb = TwoBone { extension: 1.0, ..leg(bend) };
        let reach = limb.solve();
        let turned = reach.bend.angle_between(DQuat::IDENTITY).max(reach.aim.angle_between(DQuat::IDENTITY));
        assert!(turned < 1e-6, "bend {bend}: turned by {turned}");
    }
}

#[test]
fn what_is_out_of_reach_is_neared_softly_and_the_rest_is_left() {
    let limb = leg(20.0);
    let far = TwoBone { goal: limb.start - DVec3::Y * 2.0, ..limb };
    let reach = far.solve();
    let length = reach.end.distance(far.start);
    assert!(length < 0.85 && length > 0.84, "never quite straight: {length}");
    assert!((reach.end - far.start).normalize().dot(-DVec3::Y) > 1.0 - 1e-12, "toward the goal");
    assert!((reach.end.distance(far.goal) - (2.0 - length)).abs() < 1e-9, "the residual is what is missing");
    let hard = TwoBone { softness: 0.0, ..far };
    assert!((hard.solve().end.distance(far.start) - 0.85).abs() < 1e-9, "without softness it is straight");
    let stretched = TwoBone { stretch: 10.0, ..far }.solve();
    assert!(stretched.end.distance(far.goal) < 1e-9, "with stretch it gets there");
    assert!((stretched.stretch - 2.0 / length).abs() < 1e-9, "by as much as it needs");
}

#[test]
fn goals_that_move_little_move_the_knee_little() {
    for bend in [-40.0, -20.0, -3.0, 0.0, 2.0, 60.0] {
        let limb = leg(bend);
        let mut before: Option<DVec3> = None;
        for step in 0..4000_u32 {
            let time = f64::from(step) / 4000.0;
            // From a deep squat to far out of reach, swinging to the front and the side.
            let goal = DVec3::new(0.2 * (time * 7.0).sin(), -0.3 - 0.8 * time, 0.3 * (time * 9.0).sin());
            let middle = TwoBone { goal: limb.start + goal, ..limb }.solve().middle;
            assert!(middle.is_finite(), "bend {bend}, step {step}");
            if let Some(before) = before {
                let moved = middle.distance(before);
                assert!(moved < 0.02, "bend {bend}, step {step}: the knee jumps by {moved}");
            }
            before = Some(middle);
        }
    }
}

#[test]
fn degenerate_limbs_stay_finite() {
    let limb = leg(30.0);
    let cases = [
        TwoBone { goal: limb.start, ..limb },
        TwoBone { middle: limb.start, ..limb },
        TwoBone { end: limb.middle, ..limb },
        TwoBone { hinge: DVec3::ZERO, ..leg(0.0) },
        TwoBone { hinge: -DVec3::Y, ..leg(0.0) },
        TwoBone { goal: limb.start + (limb.start - limb.end), ..limb },
        TwoBone { end: limb.start, ..limb },
        TwoBone { goal: DVec3::splat(f64::NAN), ..limb },
    ];
    for case in cases {
        let reach = case.solve();
        let finite =
            reach.bend.is_finite() && reach.aim.is_finite() && reach.end.is_finite() && reach.stretch.is_finite();
        assert!(finite, "{case:?}: {reach:?}");
    }
}

#[test]
fn a_limb_that_may_reach_farther_is_softened_without_a_corner() {
    // Slopes of what is reached over the distance of the goal, around where softening begins and where the limb ends.
    let reached = |distance: f64| {
        let limb = TwoBone { extension: 0.985, ..leg(20.0) };
        let limb = TwoBone { goal: limb.start - DVec3::Y * distance * 0.85, ..limb };
        limb.solve().end.distance(limb.start) / 0.85
    };
    let places: Vec<f64> = (0..200).map(|step| reached(0.96 + f64::from(step) * 5e-4)).collect();
    let slopes: Vec<f64> = places.windows(2).map(|pair| (pair[1] - pair[0]) / 5e-4).collect();
    assert!((slopes[0] - 1.0).abs() < 1e-6 && reached(0.985) > 0.985 - 1e-9, "all of what it may reach");
    let corner = slopes.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
    assert!(corner < 0.05, "the slope changes by {corner} at most");
}

#[test]
fn knees_bend_about_their_hinge_when_straight() {
    let limb = TwoBone { goal: DVec3::new(0.1, 0.4, 0.0), ..leg(0.0) };
    let reach = limb.solve();
    let forward = (reach.middle - limb.start).z;
    assert!(forward > 0.1, "the knee goes to the front: {forward}");
    assert!(reach.middle.x - 0.1 < 1e-12, "and not sideways");
}

/// A knee that is nearly straight may point anywhere; when its foot is lifted, it bends where frames around say.
#[test]
fn a_knee_that_is_nearly_straight_bends_where_it_does_around() {
    let around = DQuat::from_rotation_y(0.2) * DVec3::X;
    for turn in [-40.0_f64, -15.0, 0.0, 20.0, 45.0] {
        for bend in [-4.0_f64, 2.0, 4.0] {
            let limb = leg(0.0);
            let axis = DQuat::from_rotation_y(turn.to_radians()) * DVec3::X;
            let shin = DQuat::from_axis_angle(axis, bend.to_radians()) * DVec3::new(0.0, -0.4, 0.0);
            let limb = TwoBone { end: limb.middle + shin, near_axis: Some(around), ..limb };
            let limb = TwoBone { goal: limb.start - DVec3::Y * 0.75, ..limb };
            let reach = limb.solve();
            assert!(reach.end.distance(limb.goal) < 1e-9, "it reaches: {}", reach.end);
            let off = (reach.middle - limb.start).reject_from(DVec3::Y).normalize();
            let wanted = DVec3::NEG_Y.cross(around).normalize();
            let apart = off.angle_between(wanted).to_degrees();
            assert!(apart < 12.0, "{bend}° turned by {turn}°: {apart}° elsewhere");
        }
    }
}

/// A knee that bends across its hinge, as the rest pose of some rigs has it, bends as it does in the frames around: the sign that the
/// hinge gives its axis means nothing there.
#[test]
fn a_knee_that_bends_across_its_hinge_turns_about_no_third_axis() {
    let about = |degrees: f64| DQuat::from_rotation_y(degrees.to_radians()) * DVec3::X;
    let mut before: Option<DVec3> = None;
    for step in 0..30_u32 {
        let shin = DQuat::from_axis_angle(about(95.0), f64::from(20 + step).to_radians()) * DVec3::new(0.0, -0.4, 0.0);
        let limb = leg(0.0);
        let limb = TwoBone { end: limb.middle + shin, near_axis: Some(about(70.0)), ..limb };
        let limb = TwoBone { goal: limb.start + (limb.end - limb.start) * 0.98, ..limb };
        let reach = limb.solve();
        assert!(reach.end.distance(limb.goal) < 1e-9, "it reaches: {}", reach.end);
        let moved = before.map_or(0.0, |before| before.distance(reach.middle));
        assert!(moved < 0.015, "from a bend of {} degrees to the next the knee goes {moved} m", 20 + step);
        before = Some(reach.middle);
    }
}
