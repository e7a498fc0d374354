//! Limbs reach their goals. (docs/algorithm/legs.md.)
//!
//! A knee that is nearly straight bends by many degrees for a millimeter: where a goal comes to the end of the leg's reach, the bend
//! changes from one frame to the next without bounds, while the foot hardly moves. So what the bends of legs change by is smoothed
//! over time where stages that plant feet set the goals, as far as the foot then misses its goal by a millimeter or two: that is much
//! for the bend of a leg that is nearly straight, and little elsewhere.
//!
//! Nor does a knee that is nearly straight say about which axis it is to bend: to a side now and to the other one a moment later. That
//! is taken from the frames around, in the axes of the hip, where each counts as much as its knee is bent.

use super::stage::Stage;
use glam::{DQuat, DVec3};

use crate::model::rotation::signed_angle;

use crate::{
    model::{Canceled, Skeleton},
    rig::LimbJoints,
};

use super::{
    limbs::{LimbRest, LimbSlots},
    posing::{Pose, Posing},
    temporal::smoothed,
    two_bone::TwoBone,
    work::{Change, Changed, Goal, Work},
};

/// Standard deviation of the smoothing of what the bends of legs change by.
const BEND_SECONDS: f64 = 0.03;
/// Standard deviation of the smoothing of the axes about which legs bend that are nearly straight.
pub(in crate::retarget) const AXIS_SECONDS: f64 = 0.08;
/// What the hinge counts beside the axes of frames that are near; the square of the sine of a bend, which is what they count.
pub(in crate::retarget) const HINGE_WEIGHT: f64 = 1e-3;
/// Changes of bends that are this even, in radians, are as smooth as they can be.
const LITTLE_CHANGE: f64 = 1e-6;

/// Bends limbs so that their ends are at the goals.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct SolveStage {
    pub(in crate::retarget) limbs: Vec<SolvedLimb>,
    pub(in crate::retarget) posing: Posing,
    pub(in crate::retarget) limb_count: usize,
    /// Three per limb: start, middle and end.
    pub(in crate::retarget) changed: Vec<Changed>,
}

/// One limb, with what the op that set its goal says about how it reaches.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct SolvedLimb {
    pub(in crate::retarget) limb: usize,
    pub(in crate::retarget) slots: LimbSlots,
    pub(in crate::retarget) rest: LimbRest,
    pub(in crate::retarget) hangs: Hangs,
    pub(in crate::retarget) softness: f64,
    pub(in crate::retarget) stretch: f64,
    pub(in crate::retarget) align_pole: f64,
    /// Radians.
    pub(in crate::retarget) pole_offset: f64,
    /// Whether its bend changes smoothly, at the cost of where its end is.
    pub(in crate::retarget) is_smooth: bool,
}

/// What moves with what in the file's hierarchy; a limb may come in pieces that ride one another.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct Hangs {
    /// Whether the middle joint is below the start.
    middle_from_start: bool,
    /// Whether the end joint is below the start, and below the middle.
    end_from_start: bool,
    end_from_middle: bool,
}

impl Hangs {
    pub(in crate::retarget) fn of(skeleton: &Skeleton, limb: &LimbJoints) -> Self {
        Self {
            middle_from_start: skeleton.is_ancestor_or_self(limb.start, limb.middle),
            end_from_start: skeleton.is_ancestor_or_self(limb.start, limb.end),
            end_from_middle: skeleton.is_ancestor_or_self(limb.middle, limb.end),
        }
    }
}

/// What comes out for one limb at one frame.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::retarget) struct Solved {
    /// Of its start, middle and end.
    pub(in crate::retarget) changes: [Change; 3],
    residual: f32,
}

/// How the bend of a limb changes that reaches its goal.
#[derive(Clone, Copy, Debug, Default)]
struct Bend {
    /// Radians.
    change: f64,
    /// Unit length.
    axis: DVec3,
}

/// Where a limb is at a frame, before it reaches.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::retarget) struct LimbPlace {
    /// Of its start, middle and end.
    places: [DVec3; 3],
    /// How its start is turned.
    turned: DQuat,
}

/// What is known of the bend of a limb from other frames.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::retarget) struct Around {
    /// The axis about which it bends, in the axes of its start joint; unit length.
    pub(in crate::retarget) axis: Option<DVec3>,
    /// What its bend should change by, in radians.
    pub(in crate::retarget) change: Option<f64>,
}

impl SolvedLimb {
    pub(in crate::retarget) fn place(&self, pose: &Pose) -> LimbPlace {
        LimbPlace { places: self.slots.places(pose), turned: pose.model[self.slots.start].rotation }
    }

    /// The limb where it is.
    fn two_bone(&self, place: &LimbPlace, goal: &Goal, around: Around) -> TwoBone {
        let LimbPlace { places: [start, middle, end], turned } = *place;
        TwoBone {
            start,
            middle,
            end,
            hinge: turned * self.rest.hinge,
            goal: goal.position,
            softness: self.softness,
            extension: goal.extension,
            stretch: self.stretch,
            change: around.change,
            near_axis: around.axis.map(|axis| turned * axis),
        }
    }

    /// What brings the end to its goal. `posing` is that of the pose.
    pub(in crate::retarget) fn solve(&self, posing: &Posing, pose: &Pose, goal: &Goal, around: Around) -> Solved {
        let start = pose.model[self.slots.start].translation;
        let model = |slot: usize| pose.model[slot].rotation;
        let reach = self.two_bone(&self.place(pose), goal, around).solve();
        let line = (reach.end - start).normalize_or_zero();
        let off = (reach.middle - start) - line * (reach.middle - start).dot(line);
        let angle = match goal.pole.length() {
            sure if sure > 0.0 => signed_angle(off, goal.pole, line) * sure * self.align_pole,
            _ => 0.0,
        };
        let turn = DQuat::from_axis_angle(line, angle + self.pole_offset);
        let aim = if line.is_normalized() { turn * reach.aim } else { reach.aim };
        let parent = |slot: usize| posing.parent_of(pose, slot).rotation;
        let (above_start, above_middle, above_end) =
            (parent(self.slots.start), parent(self.slots.middle), parent(self.slots.end));
        let local = |above: DQuat, turned: DQuat| (above.conjugate() * turned).normalize().as_quat();
        let turned = |turn: DQuat, turns: bool, above: DQuat| if turns { turn * above } else { above };
        let above_middle = turned(aim, self.hangs.middle_from_start, above_middle);
        let above_end = turned(reach.bend, self.hangs.end_from_middle, above_end);
        let above_end = turned(aim, self.hangs.end_from_start, above_end);
        let moved = |slot: usize| (pose.local[slot].translation * reach.stretch).as_vec3();
        let changes = [
            Change {
                rotation: local(above_start, aim * model(self.slots.start)),
                translation: pose.local[self.slots.start].translation.as_vec3(),
            },
            Change {
                rotation: local(above_middle, aim * reach.bend * model(self.slots.middle)),
                translation: moved(self.slots.middle),
            },
            Change { rotation: local(above_end, goal.rotation), translation: moved(self.slots.end) },
        ];
        #[expect(clippy::cast_possible_truncation, reason = "a distance for a report")]
        let residual = reach.end.distance(goal.position) as f32;
        Solved { changes, residual }
    }

    /// The normal of its plane in the axes of its start joint, as far as it is bent forward; it counts by the sine of the bend once more.
    pub(in crate::retarget) fn weighted_axis(&self, place: &LimbPlace, goal: &Goal) -> DVec3 {
        let normal = self.two_bone(place, goal, Around::default()).forward_normal();
        place.turned.conjugate() * normal * normal.length()
    }

    /// About which axes it bends, smooth over time, of such axes frame by frame.
    fn smoothed_axes(&self, weighted: &[DVec3], times: &[f64]) -> Vec<DVec3> {
        let hinge = self.rest.hinge * HINGE_WEIGHT;
        let axes = smoothed(weighted, times, AXIS_SECONDS).into_iter();
        axes.map(|axis| (axis + hinge).normalize_or(self.rest.hinge)).collect()
    }
}

impl SolveStage {
    /// The goals of all limbs at a frame.
    fn goals<'w>(&self, work: &'w Work<'_>, frame: usize) -> &'w [Goal] {
        &work.goals[frame * self.limb_count..(frame + 1) * self.limb_count]
    }

    /// Where limbs whose bend is smoothed are, frame by frame.
    fn places(&self, work: &Work<'_>) -> Result<Vec<LimbPlace>, Canceled> {
        let find = |pose: &mut Pose, frame: usize, row: &mut [LimbPlace]| {
            self.posing.fill_model(pose, &work.target, frame);
            for (limb, place) in self.limbs.iter().zip(row).filter(|(limb, _)| limb.is_smooth) {
                *place = limb.place(pose);
            }
        };
        work.rows(self.limbs.len(), || self.posing.pose(), find)
    }

    /// About which axes limbs bend, smooth over time, frame by frame; nothing for limbs that need no smoothing.
    fn axes(&self, places: &[LimbPlace], work: &Work<'_>) -> Result<Vec<Option<Vec<DVec3>>>, Canceled> {
        let width = self.limbs.len();
        let find = |(): &mut (), frame: usize, row: &mut [DVec3]| {
            let limbs = self.limbs.iter().zip(row).zip(&places[frame * width..]);
            for ((limb, axis), place) in limbs.filter(|((limb, _), _)| limb.is_smooth) {
                *axis = limb.weighted_axis(place, &self.goals(work, frame)[limb.limb]);
            }
        };
        let rows = work.rows(width, || (), find)?;
        let of_limb = |(index, limb): (usize, &SolvedLimb)| {
            limb.is_smooth.then(|| {
                let axes: Vec<DVec3> = rows.iter().skip(index).step_by(width).copied().collect();
                limb.smoothed_axes(&axes, work.performed)
            })
        };
        Ok(self.limbs.iter().enumerate().map(of_limb).collect())
    }

    /// What the frames around say of the bends of limbs, frame by frame; nothing for limbs that need no smoothing.
    fn around(&self, work: &Work<'_>) -> Result<Vec<Option<Vec<Around>>>, Canceled> {
        let width = self.limbs.len();
        if !self.limbs.iter().any(|limb| limb.is_smooth) {
            return Ok(vec![None; width]);
        }
        let places = self.places(work)?;
        let axes = self.axes(&places, work)?;
        let axis = |index: usize, frame: usize| axes[index].as_ref().map(|axes| axes[frame]);
        let find = |(): &mut (), frame: usize, row: &mut [Bend]| {
            let goals = self.goals(work, frame);
            let limbs = self.limbs.iter().zip(row).zip(&places[frame * width..]).enumerate();
            for (index, ((limb, bend), place)) in limbs.filter(|(_, ((limb, _), _))| limb.is_smooth) {
                let around = Around { axis: axis(index, frame), change: None };
                let reach = limb.two_bone(place, &goals[limb.limb], around).solve();
                *bend = Bend { change: reach.change, axis: reach.axis };
            }
        };
        let rows = work.rows(width, || (), find)?;
        let of_limb = |index: usize| {
            let bends: Vec<Bend> = rows.iter().skip(index).step_by(width).copied().collect();
            self.limbs[index].is_smooth.then(|| {
                let changes = smooth(&bends, work.performed);
                let around = |frame: usize| Around {
                    axis: axis(index, frame),
                    change: changes.as_ref().map(|changes| changes[frame]),
                };
                (0..bends.len()).map(around).collect()
            })
        };
        Ok((0..width).map(of_limb).collect())
    }
}

impl Stage for SolveStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let width = self.limbs.len();
        let around = self.around(work)?;
        let solve = |pose: &mut Pose, frame: usize, row: &mut [Solved]| {
            self.posing.fill(pose, &work.target, frame);
            let goals = self.goals(work, frame);
            for ((limb, solved), around) in self.limbs.iter().zip(row).zip(&around) {
                let around = around.as_ref().map_or_else(Around::default, |around| around[frame]);
                *solved = limb.solve(&self.posing, pose, &goals[limb.limb], around);
            }
        };
        let rows = work.rows(width, || self.posing.pose(), solve)?;
        work.write_columns(&self.changed, |frame, index| &rows[frame * width + index / 3].changes[index % 3]);
        let mut residuals = std::mem::take(&mut work.residuals);
        residuals.resize(work.frame_count() * self.limb_count, f32::NAN);
        let tell = |(): &mut (), frame: usize, residuals: &mut [f32]| {
            for (limb, solved) in self.limbs.iter().zip(&rows[frame * width..]) {
                residuals[limb.limb] = solved.residual;
            }
        };
        work.fill(&mut residuals, self.limb_count, || (), tell)?;
        work.residuals = residuals;
        work.goals.clear();
        Ok(())
    }
}

/// Changes of one limb's bend, smooth over time; nothing where they are smooth as they are.
fn smooth(bends: &[Bend], times: &[f64]) -> Option<Vec<f64>> {
    // The axis of a bend may turn around from one frame to the next; then the sign of the bend does, too.
    let mut signs = Vec::with_capacity(times.len());
    let mut last = (1.0, DVec3::ZERO);
    for bend in bends {
        let sign: f64 = if bend.axis.dot(last.1) < 0.0 { -last.0 } else { last.0 };
        last = (sign, bend.axis);
        signs.push(sign);
    }
    let changes: Vec<f64> = bends.iter().zip(&signs).map(|(bend, sign)| bend.change * sign).collect();
    let is_even = changes.iter().all(|change| (change - changes[0]).abs() < LITTLE_CHANGE);
    (!is_even).then(|| {
        let mut smooth = smoothed(&changes, times, BEND_SECONDS);
        smooth.iter_mut().zip(&signs).for_each(|(change, sign)| *change *= sign);
        smooth
    })
}
