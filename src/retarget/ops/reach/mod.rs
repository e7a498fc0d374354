//! Ends of chains get to their goals with the help of the body. (docs/algorithm/joints.md.)

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::{ReachGoal, ReachOp, ReachPlace};

use crate::model::{Skeleton, Transform};
use crate::retarget::stages::posed::Step;
use crate::retarget::{
    mapping::Mapping,
    ops::{context::Context, edit::Edit, op_spec::OpSpec, scope::Scope},
    stages::posed::builder::StepBuilder,
};
use glam::{DMat3, DQuat, DVec3};

use crate::retarget::stages::posed::figure::Figure;

/// Ends at most; more are refused.
pub(in crate::retarget) const MAX_GOALS: usize = 8;
/// Joints that may turn at most; more are refused.
pub(in crate::retarget) const MAX_JOINTS: usize = 64;
/// Rows of the equations: three for each goal.
const ROWS: usize = 3 * MAX_GOALS;
/// Radians that a joint turns in a round at most.
const MAX_TURN: f64 = 0.4;
/// What is gone of the way to a goal in a round at most, as a share of its chain's length: goals out of reach do not tear.
const MAX_STEP: f64 = 0.15;
/// What is left of a goal, as a share of its chain's length, that no further round is made for.
const NEAR_ENOUGH: f64 = 1e-5;

/// All goals of an op.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct ReachStep {
    pub(in crate::retarget) goals: Vec<ReachedGoal>,
    /// Joints that may turn, parents first.
    pub(in crate::retarget) joints: Vec<TurnedJoint>,
    /// Slot of the pelvis and how freely it goes along.
    pub(in crate::retarget) pelvis: Option<(usize, f64)>,
    /// Ends, and what else keeps how it is turned.
    pub(in crate::retarget) kept: Vec<usize>,
    pub(in crate::retarget) iterations: u32,
    /// Square of the damping, a share of the chains' lengths.
    pub(in crate::retarget) damping: f64,
}

/// A joint that may turn.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct TurnedJoint {
    pub(in crate::retarget) slot: usize,
    /// How freely, over the square of a length, so that turning and moving compare.
    pub(in crate::retarget) mobility: f64,
    /// Whether it turns for each of the goals.
    pub(in crate::retarget) turns_for: [bool; MAX_GOALS],
}

/// An end and its goal.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct ReachedGoal {
    pub(in crate::retarget) end: usize,
    pub(in crate::retarget) place: GoalPlace,
    /// Weight along each axis of the figure, as a map of plan space.
    pub(in crate::retarget) weight: DMat3,
    /// Takes a vector's part along the axes that count at all.
    pub(in crate::retarget) mask: DMat3,
    /// Length of its chain.
    pub(in crate::retarget) length: f64,
}

/// Where a goal is.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) enum GoalPlace {
    /// `travel · source + offset`.
    World { source: usize, travel: DMat3, offset: DVec3 },
    /// `start + (source − source_start) · scale + offset`.
    Chain { source: usize, source_start: usize, start: usize, scale: f64, offset: DVec3 },
}

impl ReachStep {
    /// One round: turns all joints a little so that less is left.
    fn improve(&self, figure: &mut Figure<'_>, left: &[DVec3; MAX_GOALS]) {
        let count = self.goals.len();
        let mut ends = [DVec3::ZERO; MAX_GOALS];
        for (end, goal) in ends.iter_mut().zip(&self.goals) {
            *end = figure.model(goal.end).translation;
        }
        let mut equations = Equations::new(count);
        let freedom = self.pelvis.map_or(0.0, |(_, freedom)| freedom);
        for first in 0..count {
            for second in 0..count {
                let mut block = DMat3::from_diagonal(DVec3::splat(freedom));
                for joint in &self.joints {
                    if joint.turns_for[first] && joint.turns_for[second] {
                        let at = figure.model(joint.slot).translation;
                        let (r, s) = (ends[first] - at, ends[second] - at);
                        // Σ over axes a of (a × r)(a × s)ᵀ.
                        let outer = DMat3::from_cols(s * r.x, s * r.y, s * r.z);
                        block += (DMat3::from_diagonal(DVec3::splat(r.dot(s))) - outer) * joint.mobility;
                    }
                }
                block = self.goals[first].mask * block * self.goals[second].mask;
                if first == second {
                    block += DMat3::from_diagonal(DVec3::splat(self.damping));
                }
                equations.set(first, second, block);
            }
            equations.set_right(first, left[first]);
        }
        let pulls = equations.solve();
        if let Some((slot, freedom)) = self.pelvis {
            let moved: DVec3 = pulls[..count].iter().sum::<DVec3>() * freedom;
            let at = figure.model(slot).translation;
            figure.move_to(slot, at + moved);
        }
        // All turns are found before any joint turns, so that each is about where its joint was.
        let mut turns = [DVec3::ZERO; MAX_JOINTS];
        for (turn, joint) in turns.iter_mut().zip(&self.joints) {
            let at = figure.model(joint.slot).translation;
            let pulled =
                (0..count).filter(|&goal| joint.turns_for[goal]).map(|goal| (ends[goal] - at).cross(pulls[goal]));
            *turn = (pulled.sum::<DVec3>() * joint.mobility).clamp_length_max(MAX_TURN);
        }
        if let Some((slot, freedom)) = self.pelvis {
            let at = figure.model(slot).translation;
            figure.move_to(slot, at + pulls[..count].iter().sum::<DVec3>() * freedom);
        }
        // Children first: a parent that turns later carries its children's turns along.
        for (turn, joint) in turns.iter().zip(&self.joints).rev() {
            let now = figure.model(joint.slot).rotation;
            figure.turn_to(joint.slot, DQuat::from_scaled_axis(*turn) * now);
        }
    }
}

impl Step for ReachStep {
    fn apply(&self, figure: &mut Figure<'_>) {
        figure.keep(&self.kept);
        let mut wanted = [DVec3::ZERO; MAX_GOALS];
        for (wanted, goal) in wanted.iter_mut().zip(&self.goals) {
            let place = goal.place(figure);
            // Only a share of the way is gone, so it is a point on it that is to be reached.
            let end = figure.model(goal.end).translation;
            *wanted = end + goal.weight * (place - end);
        }
        for _ in 0..self.iterations {
            let mut left = [DVec3::ZERO; MAX_GOALS];
            let mut is_near = true;
            for ((left, wanted), goal) in left.iter_mut().zip(wanted).zip(&self.goals) {
                *left = goal.mask * (wanted - figure.model(goal.end).translation);
                is_near &= left.length() < NEAR_ENOUGH * goal.length;
                *left = left.clamp_length_max(MAX_STEP * goal.length);
            }
            if is_near {
                break;
            }
            self.improve(figure, &left);
        }
        figure.turn_back(&self.kept);
    }
}

impl ReachedGoal {
    fn place(&self, figure: &mut Figure<'_>) -> DVec3 {
        match self.place {
            GoalPlace::World { source, travel, offset } => travel * figure.source.model[source].translation + offset,
            GoalPlace::Chain { source, source_start, start, scale, offset } => {
                let place = |slot: usize| figure.source.model[slot].translation;
                let way = (place(source) - place(source_start)) * scale;
                figure.model(start).translation + way + offset
            }
        }
    }
}

/// A symmetric system of three rows for each goal.
struct Equations {
    size: usize,
    matrix: [[f64; ROWS]; ROWS],
    right: [f64; ROWS],
}

impl Equations {
    const fn new(goals: usize) -> Self {
        Self { size: 3 * goals, matrix: [[0.0; ROWS]; ROWS], right: [0.0; ROWS] }
    }

    fn set(&mut self, first: usize, second: usize, block: DMat3) {
        for column in 0..3 {
            for row in 0..3 {
                self.matrix[3 * first + row][3 * second + column] = block.col(column)[row];
            }
        }
    }

    fn set_right(&mut self, goal: usize, value: DVec3) {
        self.right[3 * goal..3 * goal + 3].copy_from_slice(&value.to_array());
    }

    /// By Cholesky's decomposition; the damping on the diagonal keeps the matrix positive.
    fn solve(mut self) -> [DVec3; MAX_GOALS] {
        let size = self.size;
        for row in 0..size {
            for column in 0..=row {
                let sum: f64 = (0..column).map(|k| self.matrix[row][k] * self.matrix[column][k]).sum();
                let value = self.matrix[row][column] - sum;
                self.matrix[row][column] = if row == column {
                    value.max(f64::MIN_POSITIVE).sqrt()
                } else {
                    value / self.matrix[column][column]
                };
            }
        }
        for row in 0..size {
            let sum: f64 = (0..row).map(|k| self.matrix[row][k] * self.right[k]).sum();
            self.right[row] = (self.right[row] - sum) / self.matrix[row][row];
        }
        for row in (0..size).rev() {
            let sum: f64 = (row + 1..size).map(|k| self.matrix[k][row] * self.right[k]).sum();
            self.right[row] = (self.right[row] - sum) / self.matrix[row][row];
        }
        let mut solution = [DVec3::ZERO; MAX_GOALS];
        for (goal, value) in solution.iter_mut().enumerate().take(size / 3) {
            *value = DVec3::from_slice(&self.right[3 * goal..3 * goal + 3]);
        }
        solution
    }
}

/// Ends of chains that get to goals.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct ReachDrive {
    /// The ends.
    pub(in crate::retarget) ends: Vec<ReachEnd>,
    /// Joints that may turn, parents first.
    pub(in crate::retarget) joints: Vec<usize>,
    /// How stiff each of them is, 0 to 1.
    pub(in crate::retarget) stiffness: Vec<f64>,
    /// The pelvis, where it may go along, and how freely.
    pub(in crate::retarget) pelvis: Option<(usize, f64)>,
    /// Rounds at most.
    pub(in crate::retarget) iterations: u32,
    /// As a share of the chains' lengths.
    pub(in crate::retarget) damping: f64,
}

/// One end and what its goal comes from.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct ReachEnd {
    /// Joint of the target.
    pub(in crate::retarget) end: usize,
    /// Joint of the source.
    pub(in crate::retarget) source: usize,
    /// The first joint that may turn.
    pub(in crate::retarget) start: usize,
    /// The source's joint that the goal is seen from; nothing where it is a place in the world.
    pub(in crate::retarget) source_start: Option<usize>,
    /// Joints that may turn for it, parents first.
    pub(in crate::retarget) turning: Vec<usize>,
    /// Share of the way there, along left, up and front.
    pub(in crate::retarget) weight: DVec3,
    /// Meters along left, up and front.
    pub(in crate::retarget) offset: DVec3,
}

impl Edit for ReachDrive {
    type Step = ReachStep;

    fn joints(&self, _mapping: &Mapping) -> Vec<usize> {
        self.joints.clone()
    }

    fn step(&self, builder: &mut StepBuilder<'_>) -> ReachStep {
        let stack = builder.stack;
        let ground = stack.ground();
        let axes = ground.axes();
        let length = |skeleton: &Skeleton, rest: &[Transform], start: usize, end: usize| {
            let path = skeleton.path(start, end).unwrap_or_default();
            let place = |joint: usize| rest[joint].translation;
            path.windows(2).map(|pair| place(pair[0]).distance(place(pair[1]))).sum::<f64>()
        };
        let lengths: Vec<f64> =
            self.ends.iter().map(|end| length(stack.target, &stack.target_rest, end.start, end.end)).collect();
        let mut goals = Vec::with_capacity(self.ends.len());
        for (end, &own) in self.ends.iter().zip(&lengths) {
            let offset = axes * end.offset * ground.units_per_meter;
            let source = builder.source(end.source);
            let place = match end.source_start {
                None => GoalPlace::World {
                    source,
                    travel: ground.travel,
                    offset: offset + ground.up * ground.target_floor - ground.travel * ground.up * ground.source_floor,
                },
                Some(start) => {
                    let of_source = length(stack.source, &stack.source_rest, start, end.source);
                    GoalPlace::Chain {
                        source,
                        source_start: builder.source(start),
                        start: builder.target(end.start),
                        scale: if of_source > 0.0 { own / of_source } else { stack.mapping.global_scale },
                        offset,
                    }
                }
            };
            let along = |weight: DVec3| axes * DMat3::from_diagonal(weight) * axes.transpose();
            let counts = end.weight.to_array().map(|weight| if weight > 0.0 { 1.0 } else { 0.0 });
            goals.push(ReachedGoal {
                end: builder.target(end.end),
                place,
                weight: along(end.weight),
                mask: along(DVec3::from(counts)),
                length: own.max(f64::MIN_POSITIVE),
            });
        }
        let mean = (lengths.iter().sum::<f64>() / lengths.len().max(1) as f64).max(f64::MIN_POSITIVE);
        let joints = self.joints.iter().zip(&self.stiffness).map(|(&joint, stiffness)| {
            let mut turns_for = [false; MAX_GOALS];
            for (turns, end) in turns_for.iter_mut().zip(&self.ends) {
                *turns = end.turning.contains(&joint);
            }
            TurnedJoint {
                slot: builder.change(joint, true, false),
                mobility: (1.0 - stiffness) / (mean * mean),
                turns_for,
            }
        });
        let joints: Vec<TurnedJoint> = joints.collect();
        ReachStep {
            goals,
            joints,
            pelvis: self.pelvis.map(|(pelvis, freedom)| (builder.change(pelvis, false, true), freedom)),
            kept: self.ends.iter().map(|end| builder.change(end.end, true, false)).collect(),
            iterations: self.iterations,
            damping: self.damping * self.damping,
        }
    }
}

impl OpSpec for ReachOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let edits = resolve::resolve(self, context);
        context.push(&self.scope, edits);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_are_solved() {
        let matrix = DMat3::from_cols(DVec3::new(4.0, 1.0, 0.5), DVec3::new(1.0, 3.0, 0.2), DVec3::new(0.5, 0.2, 2.0));
        let cross = DMat3::from_diagonal(DVec3::new(0.3, -0.1, 0.2));
        let (first, second) = (DVec3::new(1.0, -2.0, 3.0), DVec3::new(0.5, 0.25, -1.0));
        let mut equations = Equations::new(2);
        equations.set(0, 0, matrix);
        equations.set(1, 1, matrix);
        equations.set(0, 1, cross);
        equations.set(1, 0, cross.transpose());
        equations.set_right(0, matrix * first + cross * second);
        equations.set_right(1, cross.transpose() * first + matrix * second);
        let found = equations.solve();
        assert!(found[0].distance(first) < 1e-12 && found[1].distance(second) < 1e-12, "{found:?}");
    }
}
