//! A body as a table: joints with names, parents and places in model space, and which way their axes point.

use glam::{DMat3, DQuat, DVec3};

use crate::model::{Joint, ModelPose, Skeleton, Transform};

/// A body in its rest pose.
pub(super) struct Figure {
    joints: Vec<FigureJoint>,
}

struct FigureJoint {
    name: String,
    parent: Option<usize>,
    /// `model_from_joint`.
    model: Transform,
}

/// How the axes of joints are laid.
#[derive(Clone, Copy)]
pub(super) enum BoneAxes {
    /// +Y along the bone and +Z to the front, on both sides.
    YAlongBone,
    /// +X along the bone and +Y to the front in the middle and on the left; the right side is the left one mirrored, so that −X lies along its bones.
    XAlongBoneMirrored,
}

/// One row of a body's table. Rows of the left side are mirrored to the right.
pub(super) struct Row {
    pub(super) name: &'static str,
    pub(super) parent: &'static str,
    pub(super) position: DVec3,
    /// Where the bone ends: the direction of its axis. Zero for a joint that is oriented like its parent.
    pub(super) end: DVec3,
}

/// How names tell the sides apart.
pub(super) struct Sides {
    pub(super) left: &'static str,
    pub(super) right: &'static str,
}

impl Figure {
    /// Lays out a body: rows of the middle and of the left side, parents before children, the right side made from the left.
    pub(super) fn new(rows: &[Row], sides: &Sides, axes: BoneAxes) -> Self {
        let mut figure = Self { joints: Vec::with_capacity(rows.len() * 2) };
        let mut position = 0;
        while position < rows.len() {
            let is_left = |row: &Row| row.name.contains(sides.left);
            if !is_left(&rows[position]) {
                figure.push(&rows[position], None, axes);
                position += 1;
                continue;
            }
            // A run of left rows is a limb; its mirror image follows it as a whole.
            let run = rows[position..].iter().take_while(|row| is_left(row)).count();
            for mirrored in [None, Some(sides)] {
                for row in &rows[position..position + run] {
                    figure.push(row, mirrored, axes);
                }
            }
            position += run;
        }
        figure
    }

    fn push(&mut self, row: &Row, mirrored: Option<&Sides>, axes: BoneAxes) {
        let rename =
            |name: &str| mirrored.map_or_else(|| name.to_owned(), |sides| name.replace(sides.left, sides.right));
        let parent = self.index(&rename(row.parent));
        let flip = |point: DVec3| if mirrored.is_some() { point * DVec3::new(-1.0, 1.0, 1.0) } else { point };
        let left_direction = (row.end != DVec3::ZERO).then(|| (row.end - row.position).normalize());
        let rotation = match (left_direction, axes) {
            (None, _) => parent.map_or(DQuat::IDENTITY, |parent| self.joints[parent].model.rotation),
            (Some(direction), BoneAxes::YAlongBone) => y_along(flip(direction)),
            (Some(direction), BoneAxes::XAlongBoneMirrored) => x_along(direction, mirrored.is_some()),
        };
        let model = Transform { translation: flip(row.position), rotation, scale: DVec3::ONE };
        self.joints.push(FigureJoint { name: rename(row.name), parent, model });
    }

    /// The joint of that name.
    pub(super) fn index(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    pub(super) fn len(&self) -> usize {
        self.joints.len()
    }

    pub(super) fn parent(&self, joint: usize) -> Option<usize> {
        self.joints[joint].parent
    }

    /// `model_from_joint` at rest.
    pub(super) fn model(&self, joint: usize) -> &Transform {
        &self.joints[joint].model
    }

    /// The same as a skeleton.
    ///
    /// # Panics
    /// Never: rows name their parents before themselves.
    pub(super) fn skeleton(&self) -> Skeleton {
        let joint = |(index, joint): (usize, &FigureJoint)| {
            let rest = joint.parent.map_or(joint.model, |parent| self.joints[parent].model.relative(&joint.model));
            Joint { name: joint.name.clone(), parent: joint.parent, rest, is_joint: true, node: index }
        };
        Skeleton::new(self.joints.iter().enumerate().map(joint).collect())
            .expect("a row's parent is looked up among the rows before it")
    }

    /// The rest pose in model space.
    pub(super) fn rest(&self) -> ModelPose {
        ModelPose::new(self.joints.iter().map(|joint| joint.model).collect())
    }
}

/// The rotation whose +Y lies along `direction` and whose +Z is as near to the front as can be; for a bone that itself
/// points to the front, +Z looks up.
pub(super) fn y_along(direction: DVec3) -> DQuat {
    let hint = if direction.z.abs() > 0.7 { DVec3::Y } else { DVec3::Z };
    y_along_toward(direction, hint)
}

/// The rotation whose +Y lies along `direction` and whose +Z is as near to `hint` as can be.
pub(super) fn y_along_toward(direction: DVec3, hint: DVec3) -> DQuat {
    let x = direction.cross(hint).normalize();
    DQuat::from_mat3(&DMat3::from_cols(x, direction, x.cross(direction)))
}

fn x_along(direction: DVec3, mirrored: bool) -> DQuat {
    let hint = if direction.z.abs() > 0.7 { DVec3::Y } else { DVec3::Z };
    let z = direction.cross(hint).normalize();
    let columns = [direction, z.cross(direction), z];
    // Mirroring alone would make a left-handed frame; turning all three axes round makes it right-handed again.
    let mirror = |axis: DVec3| if mirrored { axis * DVec3::new(1.0, -1.0, -1.0) } else { axis };
    let [x, y, z] = columns.map(mirror);
    DQuat::from_mat3(&DMat3::from_cols(x, y, z))
}
