//! The level of the floor under each contact.
//!
//! Captures are off by the thickness of a shoe, floors are not level, and what is known of the source's soles may be guessed. So what
//! the source's sole is above its floor while it stands counts as standing, contact by contact, as long as that is a few
//! centimeters; what is more is a step. In a contact that lasts it may change: a body that is captured with legs of one length
//! lifts its feet as it bows.

use super::{CARRIES_METERS, Clearance, FloorFoot, FloorStage};
use crate::{
    model::rotation::smootherstep,
    retarget::stages::{
        contact_points::{ContactPoints, Part},
        temporal::{median, runs, smoothed},
        work::Work,
    },
};

/// The largest level, for a leg of 1 m.
const MAX_METERS: f64 = 0.04;
/// A clip whose lowest ground is farther from the floor, for a leg of 1 m, goes down from it.
const MAX_FLOOR_METERS: f64 = 0.1;
/// Feet that touch in less than one of so many frames in which one is low touch too seldom to say when they stand.
const SELDOM: usize = 4;
/// One of so many contacts may lie nearer to the floor than a clip whose floor is off as a whole.
const SELDOM_OFF: usize = 10;
/// How far its contacts may differ from that beyond [`MAX_METERS`], for a leg of 1 m.
const OFF_METERS: f64 = 0.015;
/// One of so many frames in which nothing touches is lower than the floor.
const LOW_SHARE: usize = 4;
/// A contact that lasts at least twice as long has a level for every piece of about this length.
const PIECE_SECONDS: f64 = 0.5;
/// What a contact lifts its foot by beyond the pelvis counts from here on, for a leg of 1 m, and over how much it begins: less is no floor that is
/// off, and tilting the foot for it keeps the knee as it is.
const LIFT_METERS: f64 = 0.01;
const LIFT_FADE_METERS: f64 = 0.015;
/// Standard deviation of the smoothing from one contact to the next.
const SMOOTHING_SECONDS: f64 = 0.1;

impl FloorStage {
    /// The largest level that is taken off, in units of the source.
    pub(in crate::retarget) fn most_level(&self) -> f64 {
        if self.op.adaptive { MAX_METERS * self.source_leg } else { 0.0 }
    }

    /// The contacts, where they say when feet stand. Of feet that are low far more often than they touch, as in walks on the spot in
    /// which a toe rests for a moment, they do not.
    pub(in crate::retarget) fn standing<'w>(
        &self,
        rows: &[Clearance],
        work: &'w Work<'_>,
    ) -> Option<&'w ContactPoints> {
        let contacts = Some(&work.contacts).filter(|contacts| contacts.is_anything_touching())?;
        let most = self.lowest_level(rows) + CARRIES_METERS * self.source_leg;
        let (mut low, mut touching) = (0_usize, 0_usize);
        for (frame, row) in rows.chunks_exact(self.feet.len().max(1)).enumerate() {
            low += usize::from(row.iter().any(|foot| foot.source < most));
            touching += usize::from(self.feet.iter().any(|foot| contacts.touches(foot.limb, frame)));
        }
        (touching * SELDOM >= low).then_some(contacts)
    }

    /// The level under every foot, frame by frame.
    pub(in crate::retarget) fn levels(
        &self,
        rows: &[Clearance],
        standing: Option<&ContactPoints>,
        work: &Work<'_>,
    ) -> Levels {
        let known = |(index, foot): (usize, &FloorFoot)| match standing {
            Some(_) => self.known(index, foot, rows, work),
            None => Vec::new(),
        };
        let heights: Vec<Vec<Known>> = self.feet.iter().enumerate().map(known).collect();
        let most = self.most_level();
        // Of a clip of stairs and slopes, what stands higher or lower than captures are off by stands on other ground.
        let level = standing.and_then(|contacts| contacts.level_below_raised_ground);
        let has_ground = level.is_some();
        let level = level.filter(|level| level.abs() < MAX_FLOOR_METERS * self.source_leg).unwrap_or(0.0);
        let is_ground = |known: &Known| has_ground && (known.height - level).abs() > most;
        let on_floor = heights.iter().flatten().filter(|known| !is_ground(known));
        let mut levels: Vec<f64> = on_floor.map(|known| known.height).collect();
        let base = if has_ground { 0.0 } else { base(&mut levels, MAX_FLOOR_METERS * self.source_leg) };
        let beyond = OFF_METERS * self.source_leg;
        let bounded = |height: f64| height.clamp((base - beyond).min(-most), (base + beyond).max(most));
        levels.iter_mut().for_each(|height| *height = bounded(*height));
        let all = median(&mut levels);
        let all = all.unwrap_or_else(|| if has_ground { 0.0 } else { self.lowest_level(rows) });
        let off = |known: &Known| if is_ground(known) { all } else { bounded(known.height) };
        let ground = |known: &Known| if is_ground(known) { known.height - all } else { 0.0 };
        let follow = |foot: &Vec<Known>, level: &dyn Fn(&Known) -> f64, otherwise: f64| {
            let known = foot.iter().map(|known| Known { height: level(known), ..*known });
            over_time(&known.collect::<Vec<_>>(), otherwise, work.performed)
        };
        Levels {
            off: heights.iter().map(|foot| follow(foot, &off, all)).collect(),
            ground: has_ground.then(|| heights.iter().map(|foot| follow(foot, &ground, 0.0)).collect()),
        }
    }

    /// The level in a clip in which nothing touches: a low height of the lower foot.
    fn lowest_level(&self, rows: &[Clearance]) -> f64 {
        let lower = |row: &[Clearance]| row.iter().map(|foot| foot.source).fold(f64::INFINITY, f64::min);
        let mut heights: Vec<f64> = rows.chunks_exact(self.feet.len().max(1)).map(lower).collect();
        heights.sort_by(f64::total_cmp);
        let most = self.most_level();
        heights.get(heights.len() / LOW_SHARE).map_or(0.0, |height| height.clamp(-most, most))
    }

    /// How far a foot is moved up on the whole, frame by frame: in each contact, or piece of one, what it needs where it stands flattest,
    /// where that is more than the pelvis goes; between contacts from the one to the other. `wants` says what it needs where it stands on its whole sole.
    pub(in crate::retarget) fn lifts_of_contacts(
        &self,
        index: usize,
        shifts: &[f64],
        work: &Work<'_>,
        wants: impl Fn(usize) -> Option<f64>,
    ) -> Vec<f64> {
        let flattest = |first: usize, last: usize| (first..=last).filter_map(&wants).reduce(f64::max);
        let known = in_contacts(self.feet[index].limb, work, flattest);
        if known.is_empty() {
            return shifts.to_vec();
        }
        let lifts = over_time(&known, 0.0, work.performed);
        let more = |lift: f64, shift: f64| {
            let more = (lift - shift).max(0.0);
            more * smootherstep((more / self.target_leg - LIFT_METERS) / LIFT_FADE_METERS)
        };
        lifts.into_iter().zip(shifts).map(|(lift, shift)| shift + more(lift, *shift)).collect()
    }

    fn known(&self, index: usize, foot: &FloorFoot, rows: &[Clearance], work: &Work<'_>) -> Vec<Known> {
        let width = self.feet.len();
        // Room for the frames of a contact, so that a long clip allocates no more than a short one.
        let mut clearances = Vec::with_capacity(work.frame_count());
        let level = |first: usize, last: usize| {
            let clearance = |frame: usize| rows[frame * width + index].source;
            clearances.clear();
            clearances.extend((first..=last).filter(|frame| is_flat(foot.limb, *frame, work)).map(clearance));
            if clearances.is_empty() {
                clearances.extend((first..=last).map(clearance));
            }
            Some(median(&mut clearances).unwrap_or(0.0))
        };
        in_contacts(foot.limb, work, level)
    }
}

/// How far the floor of a clip is off as a whole, by the heights of its contacts: all but one of [`SELDOM_OFF`] are off by at least that, the same
/// way. Nothing where it is more than `most`: the figure stands on something.
fn base(heights: &mut [f64], most: f64) -> f64 {
    heights.sort_by(f64::total_cmp);
    let few = heights.len() / SELDOM_OFF;
    let (Some(low), Some(high)) = (heights.get(few), heights.iter().rev().nth(few)) else { return 0.0 };
    let base = low.max(0.0) + high.min(0.0);
    if base.abs() > most { 0.0 } else { base }
}

/// Frames of a contact whose level is looked at together, and those from and to which it counts.
struct Piece {
    first: usize,
    last: usize,
    from: usize,
    to: usize,
}

/// A short contact is one piece. Between the middles of two pieces of a long one the level goes from that of one to that of the other.
fn pieces(first: usize, last: usize, times: &[f64]) -> impl Iterator<Item = Piece> {
    let frames = last - first + 1;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of pieces of a clip")]
    let count = (((times[last] - times[first]) / PIECE_SECONDS).floor() as usize).clamp(1, frames);
    let border = move |piece: usize| first + frames * piece / count;
    let piece = move |index: usize| {
        let (begin, end) = (border(index), border(index + 1) - 1);
        let middle = usize::midpoint(begin, end);
        let from = if index == 0 { first } else { middle };
        let to = if index + 1 == count { last } else { middle };
        Piece { first: begin, last: end, from, to }
    };
    (0..count).map(piece)
}

/// The level under every foot, frame by frame, in units of the source.
pub(in crate::retarget) struct Levels {
    /// What the capture is off by.
    off: Vec<Vec<f64>>,
    /// How far the ground is above the floor; nothing of clips whose feet stand on the floor only.
    ground: Option<Vec<Vec<f64>>>,
}

impl Levels {
    /// What the capture is off by.
    pub(in crate::retarget) fn off(&self, foot: usize, frame: usize) -> f64 {
        self.off[foot][frame]
    }

    /// How high the ground is above the floor.
    pub(in crate::retarget) fn ground(&self, foot: usize, frame: usize) -> f64 {
        self.ground.as_ref().map_or(0.0, |ground| ground[foot][frame])
    }

    /// Both: how high the source's foot is above its floor when it stands.
    pub(in crate::retarget) fn standing(&self, foot: usize, frame: usize) -> f64 {
        self.off(foot, frame) + self.ground(foot, frame)
    }
}

/// How high a foot is in one contact, or in a piece of it.
#[derive(Clone, Copy)]
struct Known {
    first: usize,
    last: usize,
    height: f64,
}

/// What is known in the contacts of a limb and the pieces of long ones; `height` says it for their first and last frame.
fn in_contacts(limb: usize, work: &Work<'_>, mut height: impl FnMut(usize, usize) -> Option<f64>) -> Vec<Known> {
    let touches: Vec<bool> = (0..work.frame_count()).map(|frame| work.contacts.touches(limb, frame)).collect();
    let contacts = runs(&touches).into_iter();
    contacts
        .flat_map(|(first, last)| pieces(first, last, work.performed))
        .filter_map(|piece| Some(Known { height: height(piece.first, piece.last)?, first: piece.from, last: piece.to }))
        .collect()
}

/// Whether a foot of the source stands on heel and ball.
pub(in crate::retarget) fn is_flat(limb: usize, frame: usize, work: &Work<'_>) -> bool {
    let touches = |part: Part| work.contacts.find(limb, part).map(|point| point.touches[frame]);
    touches(Part::End) == Some(true) && touches(Part::Ball) != Some(false)
}

/// Straight from one contact to the next, then smooth.
fn over_time(known: &[Known], otherwise: f64, times: &[f64]) -> Vec<f64> {
    let (Some(first), Some(last)) = (known.first(), known.last()) else { return vec![otherwise; times.len()] };
    let mut next = 0;
    let at = |frame: usize| {
        while next < known.len() && known[next].last < frame {
            next += 1;
        }
        let after = known.get(next).unwrap_or(last);
        let before = next.checked_sub(1).map_or(first, |before| &known[before]);
        let span = times[after.first] - times[before.last];
        let share = if span > 0.0 { ((times[frame] - times[before.last]) / span).clamp(0.0, 1.0) } else { 1.0 };
        before.height + (after.height - before.height) * share
    };
    let levels: Vec<f64> = (0..times.len()).map(at).collect();
    smoothed(&levels, times, SMOOTHING_SECONDS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clip_whose_floor_is_off_says_so_by_nearly_all_of_its_contacts() {
        let base = |heights: &[f64]| base(&mut heights.to_vec(), 0.1);
        let mut off: Vec<f64> = (0..20).map(|step| 0.05 + 0.001 * f64::from(step)).collect();
        assert!((base(&off) - 0.052).abs() < 1e-12, "all but one of ten: {}", base(&off));
        off[0] = -0.03;
        assert!((base(&off) - 0.052).abs() < 1e-12, "one that is lower says nothing: {}", base(&off));
        let sunk: Vec<f64> = off.iter().map(|height| -height).collect();
        assert!((base(&sunk) + 0.052).abs() < 1e-12, "below the floor as above it: {}", base(&sunk));
        let steps: Vec<f64> = (0..20).map(|step| 0.01 * f64::from(step % 5)).collect();
        assert_eq!(base(&steps), 0.0, "who stands on the floor, too, stands on steps elsewhere");
        assert_eq!(base(&[0.3, 0.31, 0.32]), 0.0, "who is higher stands on something");
        assert_eq!(base(&[]), 0.0);
    }

    #[test]
    fn long_contacts_have_a_level_for_every_half_second() {
        let times: Vec<f64> = (0..240).map(|frame| f64::from(frame) / 60.0).collect();
        let told = |first: usize, last: usize| -> Vec<[usize; 4]> {
            pieces(first, last, &times).map(|piece| [piece.first, piece.last, piece.from, piece.to]).collect()
        };
        assert_eq!(told(10, 60), [[10, 60, 10, 60]], "a step is one");
        assert_eq!(told(0, 60), [[0, 29, 0, 14], [30, 60, 45, 60]], "a second is two");
        assert_eq!(told(7, 7), [[7, 7, 7, 7]], "so is a frame");
        let all: Vec<Piece> = pieces(3, 239, &times).collect();
        assert!(all.windows(2).all(|pair| pair[0].last + 1 == pair[1].first && pair[0].to < pair[1].from));
        let known = |piece: &Piece| Known { first: piece.from, last: piece.to, height: piece.first as f64 };
        let levels = over_time(&all.iter().map(known).collect::<Vec<_>>(), 0.0, &times);
        assert!(levels.windows(2).all(|pair| (0.0..2.0).contains(&(pair[1] - pair[0]))), "it changes slowly");
    }
}
