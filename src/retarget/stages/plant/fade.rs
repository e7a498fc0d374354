//! What feet are moved by between contacts.

use glam::DVec3;

use super::{super::two_bone::smooth, Correction};

/// Seconds of a contact from which it is taken how fast its correction changes at its border.
const FITTED_SECONDS: f64 = 0.1;

/// Fills the frames between two contacts (last frame of the one, first of the other): from one correction to the other where there
/// is no time to let go within `seconds`, else away and back; as smoothly as can be.
pub(super) fn fade(
    corrections: &mut [Correction],
    times: &[f64],
    before: Option<usize>,
    after: Option<usize>,
    seconds: f64,
) {
    let from = before.map_or(0, |last| last + 1);
    let to = after.unwrap_or(corrections.len());
    let left = before.map(|last| Border::at(corrections, times, last, false));
    let next = after.map(|first| Border::at(corrections, times, first, true));
    let away = |time: f64| Border { seconds: time, ..Border::default() };
    for frame in from..to {
        let time = times[frame];
        let share =
            |border: &Border| if seconds > 0.0 { smooth(1.0 - (time - border.seconds).abs() / seconds) } else { 0.0 };
        let hold = either(left.as_ref().map_or(0.0, share), next.as_ref().map_or(0.0, share));
        let offset = match (&left, &next) {
            (Some(left), Some(next)) if next.seconds - left.seconds < 2.0 * seconds => between(left, next, time),
            (Some(left), _) if time - left.seconds < seconds => between(left, &away(left.seconds + seconds), time),
            (_, Some(next)) if next.seconds - time < seconds => between(&away(next.seconds - seconds), next, time),
            _ => DVec3::ZERO,
        };
        corrections[frame] = Correction { offset, hold };
    }
}

/// How much one thing or another holds, 0 to 1, without a corner where the one gives way to the other.
pub(in super::super) fn either(one: f64, other: f64) -> f64 {
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
    /// At the last frame of a contact, or at its first. The speed is that of the parabola through the border that fits the
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
        Self { seconds: times[frame], offset, per_second }
    }
}

/// The way of least jerk from one border to the other that begins and ends as fast as they are, without being sped up there: a
/// polynomial of the fifth degree.
fn between(from: &Border, to: &Border, seconds: f64) -> DVec3 {
    let span = to.seconds - from.seconds;
    let share = (seconds - from.seconds) / span;
    let start = from.per_second * span;
    // What is left of the way and of the speed after going on as it begins.
    let way = to.offset - from.offset - start;
    let speed = to.per_second * span - start;
    let cubic = way * 10.0 - speed * 4.0;
    let quartic = way * -15.0 + speed * 7.0;
    let quintic = way * 6.0 - speed * 3.0;
    from.offset + (start + (cubic + (quartic + quintic * share) * share) * share * share) * share
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_between_contacts_begins_and_ends_as_they_do() {
        let from = Border { seconds: 1.0, offset: DVec3::X, per_second: DVec3::Y * 3.0 };
        let to = Border { seconds: 1.5, offset: DVec3::Z, per_second: DVec3::NEG_X };
        let at = |seconds: f64| between(&from, &to, seconds);
        let speed = |seconds: f64| (at(seconds + 1e-6) - at(seconds - 1e-6)) / 2e-6;
        for border in [&from, &to] {
            assert!(at(border.seconds).distance(border.offset) < 1e-12, "at its place: {}", at(border.seconds));
            let found = speed(border.seconds);
            assert!(found.distance(border.per_second) < 1e-6, "as fast: {found}");
            let sped_up = (speed(border.seconds + 1e-3) - speed(border.seconds - 1e-3)) / 2e-3;
            assert!(sped_up.length() < 0.2, "goes on as it is: {sped_up}");
        }
    }

    #[test]
    fn a_contact_is_left_as_fast_as_its_correction_changes_at_the_end() {
        let times: Vec<f64> = (0..20).map(|frame| f64::from(frame) / 60.0).collect();
        let offset = |time: f64| DVec3::X * (time + 4.0 * time * time);
        let corrections: Vec<Correction> =
            times.iter().map(|time| Correction { offset: offset(*time), hold: 1.0 }).collect();
        for (frame, is_first) in [(19, false), (4, true)] {
            let border = Border::at(&corrections, &times, frame, is_first);
            let wanted = 1.0 + 8.0 * times[frame];
            assert!((border.per_second.x - wanted).abs() < 1e-9, "{wanted}: {}", border.per_second.x);
        }
        let alone = Border::at(&corrections[..1], &times[..1], 0, true);
        assert_eq!(alone.per_second, DVec3::ZERO, "one frame says nothing");
    }

    #[test]
    fn either_has_no_corner_and_stays_a_share() {
        assert_eq!([either(0.0, 0.5), either(1.0, 0.5), either(0.5, 0.5)], [0.5, 1.0, 0.75]);
    }
}
