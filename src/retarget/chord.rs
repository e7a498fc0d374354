//! The turns that make a chain's chord, the line from its first joint to what it leads to, point where it should.
//!
//! With `t` the sum of the bones below the chest as the source's rotations lay them, `c` the chest's bone and `d` the wanted unit
//! direction:
//!
//! - A chain without a chest turns by the arc from `t` to `d`.
//! - With a chest that keeps its rotation, the end lies at `s · d`, where `|s · d − c| = |t|`, and the joints below the chest turn by
//!   the arc from `t` to `s · d − c`. Short joints below a long chest would have to turn far for little, so beyond `free` the chest
//!   takes a share of the arc `w` from `t + c` to `d`. With all of it the joints below turn by `w` as well and nothing bends but
//!   the joint at which the chain begins; the share is the one at which they turn by no more than the limit, to first order.
//!
//! Limits are smooth: a correction is taken as it is up to half of the limit and approaches the limit from there.

use glam::{DQuat, DVec3};

use crate::model::rotation::approach;

use super::{
    lanes::{LANES, QuatLanes, VecLanes},
    mapping::ChordCorrection,
};

/// What the joints of a chain are turned by, in model space, after the source's rotations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ChordTurns {
    /// The joints below the chest; all joints where there is no chest.
    pub(super) below: DQuat,
    /// The chest.
    pub(super) chest: DQuat,
}

impl ChordTurns {
    const NONE: Self = Self { below: DQuat::IDENTITY, chest: DQuat::IDENTITY };
}

/// `below` and `chest` are the bones as the source's rotations lay them, `wanted` has the chord's wanted direction; all in model
/// space, of any length. No turn where one of them has no direction.
pub(super) fn chord_turns(correction: ChordCorrection, below: DVec3, chest: DVec3, wanted: DVec3) -> ChordTurns {
    let directions = wanted.try_normalize().zip((below + chest).try_normalize());
    let (Some((wanted, natural)), Some(_)) = (directions, below.try_normalize()) else { return ChordTurns::NONE };
    let whole = DQuat::from_rotation_arc(natural, wanted);
    match correction {
        ChordCorrection::Whole => ChordTurns { below: whole, ..ChordTurns::NONE },
        ChordCorrection::Limited(max) => ChordTurns { below: limited(whole, max), ..ChordTurns::NONE },
        ChordCorrection::BelowChest { free, max } => {
            let whole = limited(whole, max);
            let reached = whole * natural;
            let alone = turn_below(below, chest, reached);
            let (alone_radians, whole_radians) = (radians(alone), radians(whole));
            let radians = approach(alone_radians, free, max).max(whole_radians);
            if alone_radians <= radians {
                return ChordTurns { below: alone, ..ChordTurns::NONE };
            }
            let share = (alone_radians - radians) / (alone_radians - whole_radians);
            let turned = DQuat::IDENTITY.slerp(whole, share);
            ChordTurns { below: turn_below(below, turned * chest, reached), chest: turned }
        }
    }
}

/// The turns of several frames.
#[derive(Clone, Copy)]
pub(super) struct ChordTurnLanes {
    pub(super) below: QuatLanes,
    pub(super) chest: QuatLanes,
}

/// [`chord_turns`] of several frames. Frames whose correction is taken as it is, which are nearly all, take roots only; no frame depends
/// on another.
#[inline(always)]
pub(super) fn chord_turn_lanes(
    correction: ChordCorrection,
    below: &VecLanes,
    chest: &VecLanes,
    wanted: &VecLanes,
) -> ChordTurnLanes {
    let natural = below.plus(chest);
    // Cosines of the largest turns that no limit changes: of the whole chord, and of what is below the chest.
    let (turned, goal, min_cosines) = match correction {
        ChordCorrection::Whole => (natural, *wanted, [-0.9; 2]),
        ChordCorrection::Limited(max) => (natural, *wanted, [(max / 2.0).cos(); 2]),
        ChordCorrection::BelowChest { free, max } => {
            (*below, goals_below(below, chest, wanted), [(max / 2.0).cos(), free.min(max).cos()])
        }
    };
    let margins = turned.turn_margins(&goal, min_cosines[1]);
    let whole_margins = natural.turn_margins(wanted, min_cosines[0]);
    let mut turns = ChordTurnLanes { below: turned.arcs_to(&goal), chest: QuatLanes::IDENTITY };
    for lane in 0..LANES {
        let is_within_limits = margins[lane] > 0.0 && whole_margins[lane] > 0.0;
        if !is_within_limits {
            let limited = chord_turns(correction, below.get(lane), chest.get(lane), wanted.get(lane));
            turns.below.set(lane, limited.below);
            turns.chest.set(lane, limited.chest);
        }
    }
    turns
}

/// Where bones below a chest that keeps its rotation have to lead for the chord to point in the wanted direction.
#[inline(always)]
fn goals_below(below: &VecLanes, chest: &VecLanes, wanted: &VecLanes) -> VecLanes {
    let (squares, along) = (wanted.dot(wanted), wanted.dot(chest));
    let (below_squares, chest_squares) = (below.dot(below), chest.dot(chest));
    let mut goal = VecLanes::ZERO;
    for lane in 0..LANES {
        let factor = 1.0 / squares[lane].sqrt();
        let along = along[lane] * factor;
        let reach = (along * along + below_squares[lane] - chest_squares[lane]).max(0.0).sqrt();
        let end = (along + reach) * factor;
        goal.x[lane] = wanted.x[lane] * end - chest.x[lane];
        goal.y[lane] = wanted.y[lane] * end - chest.y[lane];
        goal.z[lane] = wanted.z[lane] * end - chest.z[lane];
    }
    goal
}

/// The turn of `below` that takes the end of `below + chest` to where `direction` points. Out of reach, where the chest is longer than
/// the rest, the nearest.
fn turn_below(below: DVec3, chest: DVec3, direction: DVec3) -> DQuat {
    let along = direction.dot(chest);
    let reach = (along * along + below.length_squared() - chest.length_squared()).max(0.0).sqrt();
    let goal = direction * (along + reach) - chest;
    let arc = |goal: DVec3| DQuat::from_rotation_arc(below.normalize(), goal);
    goal.try_normalize().map_or(DQuat::IDENTITY, arc)
}

fn radians(turn: DQuat) -> f64 {
    2.0 * turn.xyz().length().atan2(turn.w.abs())
}

/// A rotation by at most `max` radians about the same axis.
fn limited(turn: DQuat, max: f64) -> DQuat {
    let radians = radians(turn);
    if radians <= max / 2.0 {
        return turn;
    }
    DQuat::IDENTITY.slerp(turn, approach(radians, max / 2.0, max) / radians)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRUNK: ChordCorrection = ChordCorrection::BelowChest { free: 0.1, max: 0.26 };

    fn direction(degrees: f64) -> DVec3 {
        DQuat::from_rotation_x(degrees.to_radians()) * DVec3::Y
    }

    fn degrees(turn: DQuat) -> f64 {
        radians(turn).to_degrees()
    }

    #[test]
    fn nothing_turns_what_points_there_already() {
        for correction in [ChordCorrection::Whole, ChordCorrection::Limited(0.2), TRUNK] {
            let turns = chord_turns(correction, DVec3::Y, direction(10.0) * 2.0, DVec3::Y + direction(10.0) * 2.0);
            assert!(degrees(turns.below) < 1e-9 && degrees(turns.chest) < 1e-9, "{correction:?}: {turns:?}");
        }
    }

    #[test]
    fn a_small_correction_leaves_the_chest_alone_and_is_exact() {
        let (below, chest) = (DVec3::Y * 2.0, DVec3::Y);
        let turns = chord_turns(TRUNK, below, chest, direction(3.0));
        let end = turns.below * below + turns.chest * chest;
        assert!(end.normalize().angle_between(direction(3.0)).to_degrees() < 1e-9, "the chord points there");
        assert!(degrees(turns.chest) < 1e-9, "the chest keeps its rotation: {turns:?}");
        assert!((4.4..4.6).contains(&degrees(turns.below)), "two thirds of the chain do all of it: {turns:?}");
    }

    #[test]
    fn short_joints_below_a_long_chest_do_not_kink() {
        let (below, chest) = (DVec3::Y * 0.14, DVec3::Y * 0.32);
        for wanted in [2.0, 5.0, 8.0, 11.0] {
            let turns = chord_turns(TRUNK, below, chest, direction(wanted));
            let end = turns.below * below + turns.chest * chest;
            let error = end.normalize().angle_between(direction(wanted)).to_degrees();
            assert!(error < 1.5, "{wanted}°: the chord is {error:.2}° off");
            let kink = turns.below.angle_between(turns.chest).to_degrees();
            assert!(kink < 15.5 && degrees(turns.below) < 15.5, "{wanted}°: {:.1}°, {kink:.1}°", degrees(turns.below));
            assert!(degrees(turns.chest) <= wanted + 1e-9, "{wanted}°: the chest turns no further than the whole");
        }
    }

    #[test]
    fn a_correction_never_exceeds_its_limit_and_never_jumps() {
        let (below, chest) = (DVec3::new(0.0, 0.2, 0.02), DVec3::new(0.0, 0.3, -0.05));
        let mut before: Option<ChordTurns> = None;
        for tenth in -1200..1200 {
            let turns = chord_turns(TRUNK, below, chest, direction(f64::from(tenth) / 10.0));
            assert!(degrees(turns.below) < 20.0 && degrees(turns.chest) < 15.1, "{tenth}: {turns:?}");
            if let Some(before) = before {
                let step = turns.below.angle_between(before.below).max(turns.chest.angle_between(before.chest));
                assert!(step.to_degrees() < 1.0, "a step of 0.1° at {tenth} turns by {:.2}°", step.to_degrees());
            }
            before = Some(turns);
        }
    }

    #[test]
    fn frames_together_turn_as_each_alone() {
        let (below, chest) = (DVec3::new(0.0, 0.2, 0.02), DVec3::new(0.05, 0.3, -0.05));
        let corrections = [ChordCorrection::Whole, ChordCorrection::Limited(0.2), TRUNK];
        for (correction, first) in
            corrections.into_iter().flat_map(|it| (-1800..1800).step_by(LANES).map(move |at| (it, at)))
        {
            let chest = if correction.has_chest() { chest } else { DVec3::ZERO };
            let mut lanes = [VecLanes::splat(below), VecLanes::splat(chest), VecLanes::ZERO];
            let directions: Vec<DVec3> =
                (first..).take(LANES).map(|tenth| direction(f64::from(tenth) / 10.0) * 3.0).collect();
            directions.iter().enumerate().for_each(|(lane, direction)| lanes[2].set(lane, *direction));
            // One lane has nowhere to point to.
            lanes[0].set(1, DVec3::ZERO);
            let together = chord_turn_lanes(correction, &lanes[0], &lanes[1], &lanes[2]);
            for lane in 0..LANES {
                let alone = chord_turns(correction, lanes[0].get(lane), lanes[1].get(lane), lanes[2].get(lane));
                let apart = (together.below.get(lane) - alone.below).length()
                    + (together.chest.get(lane) - alone.chest).length();
                assert!(apart < 1e-12, "{correction:?}, {first} and {lane}: {apart}");
            }
        }
    }

    #[test]
    fn what_has_no_direction_turns_nothing() {
        for (below, chest, wanted) in
            [(DVec3::ZERO, DVec3::Y, DVec3::X), (DVec3::Y, DVec3::ZERO, DVec3::ZERO), (DVec3::Y, -DVec3::Y, DVec3::X)]
        {
            assert_eq!(chord_turns(TRUNK, below, chest, wanted), ChordTurns::NONE, "{below} {chest} {wanted}");
        }
    }
}
