//! What feet are moved by between contacts.

use glam::DVec3;

use crate::model::rotation::smootherstep;

use super::Correction;

/// Seconds of a contact from which it is taken how fast its correction changes at its border.
const FITTED_SECONDS: f64 = 0.1;
/// Share of the speed of a correction at the border of a contact that it keeps outside of it. A foot that lands or lifts off changes its own
/// speed by more than the rest of it; with all of it the foot swings out so far that its knee jerks.
const KEPT_SPEED: f64 = 0.5;
/// How long the speed of a correction at the border of a contact takes to go out: at least, and at most.
const LET_GO_SECONDS: f64 = 0.08;
const MAX_LET_GO_SECONDS: f64 = 0.25;
/// A foot that is on its way from one correction to another one may swing out farther by this share of it.
const SWING_SHARE: f64 = 0.7;
/// How far something moves whose speed goes out smoothly in a second, for a speed of 1 at the beginning: the largest of `t · (1 −
/// smootherstep(t))`.
const SWUNG: f64 = 0.266;

/// Fills the frames between two contacts (last frame of the one, first of the other): from one correction to the other where there
/// is no time to let go within `seconds`, else away and back; as smoothly as can be without swinging out farther than `swing`.
pub(in crate::retarget) fn fade(
    corrections: &mut [Correction],
    times: &[f64],
    before: Option<usize>,
    after: Option<usize>,
    seconds: f64,
    swing: f64,
) {
    let from = before.map_or(0, |last| last + 1);
    let to = after.unwrap_or(corrections.len());
    let left = before.map(|last| Border::at(corrections, times, last, false));
    let next = after.map(|first| Border::at(corrections, times, first, true));
    let away = |time: f64| Border { seconds: time, ..Border::default() };
    for frame in from..to {
        let time = times[frame];
        let share = |border: &Border| {
            if seconds > 0.0 { smootherstep(1.0 - (time - border.seconds).abs() / seconds) } else { 0.0 }
        };
        let hold = either(left.as_ref().map_or(0.0, share), next.as_ref().map_or(0.0, share));
        let offset = match (&left, &next) {
            (Some(left), Some(next)) if next.seconds - left.seconds < 2.0 * seconds => between(left, next, time, swing),
            (Some(left), _) if time - left.seconds < seconds => {
                between(left, &away(left.seconds + seconds), time, swing)
            }
            (_, Some(next)) if next.seconds - time < seconds => {
                between(&away(next.seconds - seconds), next, time, swing)
            }
            _ => DVec3::ZERO,
        };
        corrections[frame] = Correction { offset, hold };
    }
}

/// How much one thing or another holds, 0 to 1, without a corner where the one gives way to the other.
pub(in crate::retarget) fn either(one: f64, other: f64) -> f64 {
    one + other - one * other
}

/// A correction at the border of a contact, and how fast it changes there, so that a foot is let go without a jolt.
#[derive(Default)]
struct Border {
    seconds: f64,
    offset: DVec3,
    per_second: DVec3,
}

impl Border {
    /// At the last frame of a contact, or at its first. The speed is a share of that of the parabola through the border that fits the
    /// contact near it best: a line would have the speed that was, not the one that is.
    fn at(corrections: &[Correction], times: &[f64], frame: usize, is_first: bool) -> Self {
        let is_near =
            |other: &usize| (times[*other] - times[frame]).abs() <= FITTED_SECONDS && corrections[*other].hold >= 1.0;
        let offset = corrections[frame].offset;
        let inside = if is_first {
            (frame + 1..times.len()).take_while(is_near).count()
        } else {
            (0..frame).rev().take_while(is_near).count()
        };
        let near = if is_first { frame + 1..frame + 1 + inside } else { frame - inside..frame };
        let of_frame = |other: usize| (times[other] - times[frame], corrections[other].offset - offset);
        // Least squares of `speed · t + bend · t²`.
        let sum = |power: i32| near.clone().map(|other| of_frame(other).0.powi(power)).sum::<f64>();
        let moment =
            |power: i32| near.clone().map(of_frame).map(|(time, moved)| moved * time.powi(power)).sum::<DVec3>();
        let (second, third, fourth) = (sum(2), sum(3), sum(4));
        let per_second = match inside {
            0 => DVec3::ZERO,
            1 | 2 => moment(1) / second,
            _ => (moment(1) * fourth - moment(2) * third) / (second * fourth - third * third),
        };
        Self { seconds: times[frame], offset, per_second: per_second * KEPT_SPEED }
    }
}

/// From one border to the other, without a jolt: the way between them begins and ends at rest, and the speeds at the borders go out
/// the sooner the higher they are. A foot that is held while its goal still moves changes its correction fast; were that speed to
/// last all the way to the next contact, the foot would swing out by a step.
fn between(from: &Border, to: &Border, seconds: f64, swing: f64) -> DVec3 {
    let span = to.seconds - from.seconds;
    let share = smootherstep((seconds - from.seconds) / span);
    let swing = swing + SWING_SHARE * from.offset.distance(to.offset);
    let moved = |border: &Border| {
        let since = (seconds - border.seconds).abs();
        let speed = border.per_second.length().max(f64::MIN_POSITIVE);
        let fading = (swing / (SWUNG * speed)).clamp(LET_GO_SECONDS, MAX_LET_GO_SECONDS).min(span);
        border.per_second * ((seconds - border.seconds) * (1.0 - smootherstep(since / fading)))
    };
    from.offset.lerp(to.offset, share) + moved(from) + moved(to)
}
