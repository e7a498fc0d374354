//! Limbs reach their goals. (docs/algorithm/legs.md.)

use glam::DQuat;

use crate::{
    model::{Canceled, Skeleton},
    rig::LimbJoints,
};

use super::{
    limbs::{LimbRest, LimbSlots},
    posing::{Pose, Posing},
    two_bone::{TwoBone, signed_angle},
    work::{Change, Changed, Goal, Work},
};

/// Bends limbs so that their ends are at the goals.
#[derive(Clone, Debug)]
pub(super) struct SolveStage {
    pub(super) limbs: Vec<SolvedLimb>,
    pub(super) posing: Posing,
    pub(super) limb_count: usize,
    /// Three per limb: start, middle and end.
    pub(super) changed: Vec<Changed>,
}

/// One limb, with what the op that set its goal says about how it reaches.
#[derive(Clone, Debug)]
pub(super) struct SolvedLimb {
    pub(super) limb: usize,
    pub(super) slots: LimbSlots,
    pub(super) rest: LimbRest,
    pub(super) hangs: Hangs,
    pub(super) softness: f64,
    pub(super) stretch: f64,
    pub(super) align_pole: f64,
    /// Radians.
    pub(super) pole_offset: f64,
}

/// What moves with what in the file's hierarchy; a limb may come in pieces that ride one another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hangs {
    /// Whether the middle joint is below the start.
    middle_from_start: bool,
    /// Whether the end joint is below the start, and below the middle.
    end_from_start: bool,
    end_from_middle: bool,
}

impl Hangs {
    pub(super) fn of(skeleton: &Skeleton, limb: &LimbJoints) -> Self {
        Self {
            middle_from_start: skeleton.is_ancestor_or_self(limb.start, limb.middle),
            end_from_start: skeleton.is_ancestor_or_self(limb.start, limb.end),
            end_from_middle: skeleton.is_ancestor_or_self(limb.middle, limb.end),
        }
    }
}

/// What comes out for one limb at one frame.
#[derive(Clone, Copy, Debug, Default)]
struct Solved {
    changes: [Change; 3],
    residual: f32,
}

impl SolveStage {
    pub(super) fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let width = self.limbs.len();
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Solved]| {
            self.posing.fill(pose, &work.target, frame);
            let goals = &work.goals[frame * self.limb_count..(frame + 1) * self.limb_count];
            for (limb, solved) in self.limbs.iter().zip(row) {
                *solved = self.solve(limb, pose, &goals[limb.limb]);
            }
        };
        let rows = work.rows(width, || self.posing.pose(), fill)?;
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

    fn solve(&self, limb: &SolvedLimb, pose: &Pose, goal: &Goal) -> Solved {
        let [start, middle, end] = limb.slots.places(pose);
        let model = |slot: usize| pose.model[slot].rotation;
        let two_bone = TwoBone {
            start,
            middle,
            end,
            hinge: model(limb.slots.start) * limb.rest.hinge,
            goal: goal.position,
            softness: limb.softness,
            extension: goal.extension,
            stretch: limb.stretch,
        };
        let reach = two_bone.solve();
        let line = (reach.end - start).normalize_or_zero();
        let off = (reach.middle - start) - line * (reach.middle - start).dot(line);
        let angle = match goal.pole.length() {
            sure if sure > 0.0 => signed_angle(off, goal.pole, line) * sure * limb.align_pole,
            _ => 0.0,
        };
        let turn = DQuat::from_axis_angle(line, angle + limb.pole_offset);
        let aim = if line.is_normalized() { turn * reach.aim } else { reach.aim };
        let parent = |slot: usize| self.posing.parent_of(pose, slot).rotation;
        let (above_start, above_middle, above_end) =
            (parent(limb.slots.start), parent(limb.slots.middle), parent(limb.slots.end));
        let local = |above: DQuat, turned: DQuat| (above.conjugate() * turned).normalize().as_quat();
        let turned = |turn: DQuat, turns: bool, above: DQuat| if turns { turn * above } else { above };
        let above_middle = turned(aim, limb.hangs.middle_from_start, above_middle);
        let above_end = turned(reach.bend, limb.hangs.end_from_middle, above_end);
        let above_end = turned(aim, limb.hangs.end_from_start, above_end);
        let moved = |slot: usize| (pose.local[slot].translation * reach.stretch).as_vec3();
        let changes = [
            Change {
                rotation: local(above_start, aim * model(limb.slots.start)),
                translation: pose.local[limb.slots.start].translation.as_vec3(),
            },
            Change {
                rotation: local(above_middle, aim * reach.bend * model(limb.slots.middle)),
                translation: moved(limb.slots.middle),
            },
            Change { rotation: local(above_end, goal.rotation), translation: moved(limb.slots.end) },
        ];
        #[expect(clippy::cast_possible_truncation, reason = "a distance for a report")]
        let residual = reach.end.distance(goal.position) as f32;
        Solved { changes, residual }
    }
}
