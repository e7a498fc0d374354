//! Skeletons below scales that differ by axis, as joints that keep their lengths, and back to the nodes of the file.
//!
//! A node that stretches one axis shears everything that turns below it: a bone is longer along the stretched axis than across it,
//! and its matrix is no rotation and scale any more. Retargeting turns bones, so it needs ones that stay as long as they are. Here a
//! joint is where its matrix puts it at rest, turned as the rotation nearest to its matrix says, with one scale. What that leaves
//! out of the matrix is constant at rest and is kept, so that the nodes of the file can be found again for any pose: a viewer that
//! multiplies their matrices sees every joint where the joints here have it.

use glam::{DMat3, DMat4, DQuat, DVec3, Quat, Vec3};

use super::{
    Clip, ClipError, JointTracks, LocalPose, Scene, Skeleton, SkinPoint, SkinPoints, SkinVertices, Track, Transform,
};

/// Squared scales closer to one another than this share are equal.
const EVEN: f64 = 2e-3;
/// A matrix whose volume is a smaller share of its longest axis cubed flattens what is below it, and cannot be undone.
const FLAT: f64 = 1e-9;
/// Joints of a clip that a stretch moves by a smaller share of the skeleton's size are left as they are.
const NEAR: f64 = 5e-5;
/// Values closer than this are the same over a clip, which leaves a channel out.
const SAME: f64 = 1e-7;

/// What lies between the nodes of a file and the joints of its scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretched {
    /// `parent_from_node` at rest, per joint, as the file has it.
    nodes: Vec<Transform>,
    /// `joint_from_node` but for its place, which is the same: what a joint's rotation and scale leave out of its matrix. Nothing
    /// for joints that no stretching reaches.
    joint_from_node: Vec<Option<DMat3>>,
}

impl Stretched {
    /// The transforms of the file's own nodes at rest, per joint.
    #[must_use]
    pub fn nodes(&self) -> &[Transform] {
        &self.nodes
    }

    /// How many joints of the scene differ from their nodes.
    #[must_use]
    pub fn joint_count(&self) -> usize {
        self.joint_from_node.iter().flatten().count()
    }

    /// The scene with joints that keep their lengths; `self` is of its skeleton.
    ///
    /// Its clips are sampled at all their frames for the joints that are stretched. What it says of the pose in which those were
    /// bound is left out: bind matrices are told apart from the nodes' by rotations and scales, which these have not.
    ///
    /// # Errors
    /// When a clip's numbers become infinite.
    pub fn straighten(self, scene: Scene) -> Result<Scene, ClipError> {
        let file = &scene.skeleton;
        let stretched = self.is_stretched();
        let (rests, _) = straight_pose(file, &self.nodes, &matrices(file, &self.nodes), &stretched);
        let straight = |(joint, rest): (&super::Joint, Transform)| super::Joint { rest, ..joint.clone() };
        let joints: Vec<super::Joint> = file.joints().iter().zip(rests).map(straight).collect();
        // Finite matrices whose volume is not nothing have finite parts.
        let Ok(skeleton) = Skeleton::new(joints) else { return Ok(scene) };
        let clips = scene.clips.iter().map(|clip| self.straight_clip(file, &skeleton, clip));
        let clips = clips.collect::<Result<Vec<Clip>, ClipError>>()?;
        let bind_pose = scene.bind_pose.iter().zip(&stretched);
        let bind_pose = bind_pose.map(|(bind, stretched)| bind.filter(|_| !stretched)).collect();
        let skin_points = self.straight_points(&scene.skin_points);
        let skin_vertices = self.straight_vertices(&scene.skin_vertices).into();
        Ok(Scene { skeleton, clips, bind_pose, skin_points, skin_vertices, stretched: Some(self), ..scene })
    }

    /// What is stretched of a skeleton whose matrices a viewer multiplies; nothing where no joint is.
    #[must_use]
    pub fn of(skeleton: &Skeleton) -> Option<Self> {
        let joints = skeleton.joints();
        let nodes: Vec<Transform> = joints.iter().map(|joint| joint.rest).collect();
        let matrices = matrices(skeleton, &nodes);
        let has_children: Vec<bool> = skeleton.children().iter().map(|children| !children.is_empty()).collect();
        let mut stretched = vec![false; joints.len()];
        for (index, joint) in joints.iter().enumerate() {
            let linear = DMat3::from_mat4(matrices[index]);
            let is_below = joint.parent.is_some_and(|parent| stretched[parent]);
            stretched[index] = (is_below || (has_children[index] && !is_even(&linear))) && !is_flat(&linear);
        }
        let any_marked = joints.iter().any(|joint| joint.is_joint);
        let counts = |(joint, stretched): (&super::Joint, &bool)| *stretched && (joint.is_joint || !any_marked);
        if !joints.iter().zip(&stretched).any(counts) {
            return None;
        }
        let (_, models) = straight_pose(skeleton, &nodes, &matrices, &stretched);
        let joint_from_node = (0..joints.len()).map(|joint| {
            let model_from_joint = DMat3::from_quat(models[joint].rotation) * DMat3::from_diagonal(models[joint].scale);
            stretched[joint].then(|| model_from_joint.inverse() * DMat3::from_mat4(matrices[joint]))
        });
        Some(Self { joint_from_node: joint_from_node.collect(), nodes })
    }

    fn is_stretched(&self) -> Vec<bool> {
        self.joint_from_node.iter().map(Option::is_some).collect()
    }

    /// A clip of the file's nodes as one of the joints.
    fn straight_clip(&self, file: &Skeleton, straight: &Skeleton, clip: &Clip) -> Result<Clip, ClipError> {
        straight_clip(file, straight, clip, &stretched_in(file, clip, self.is_stretched()))
    }

    fn straight_points(&self, points: &SkinPoints) -> SkinPoints {
        let mut entries = Vec::with_capacity(points.len());
        for (joint, matrix) in self.joint_from_node.iter().enumerate() {
            let Ok(index) = u32::try_from(joint) else { break };
            let straight = |point: &SkinPoint| {
                let position = matrix.map_or(point.position, |matrix| (matrix * point.position.as_dvec3()).as_vec3());
                (index, SkinPoint { position, ..*point })
            };
            entries.extend(points.of(joint).iter().map(straight));
        }
        SkinPoints::new(self.joint_from_node.len(), &entries)
    }

    fn straight_vertices(&self, vertices: &SkinVertices) -> SkinVertices {
        vertices.map(|one| {
            let matrix = self.joint_from_node[one.joint as usize];
            matrix.map_or(one.position, |matrix| (matrix * one.position.as_dvec3()).as_vec3())
        })
    }

    /// The file's own skeleton, at rest as `posed` is: the scene's skeleton, or the same in another pose.
    #[must_use]
    pub fn skeleton_of_nodes(&self, posed: &Skeleton) -> Skeleton {
        let locals = self.nodes_of(posed, &posed.rest_pose());
        let joints = posed.joints().iter().zip(locals).map(|(joint, rest)| super::Joint { rest, ..joint.clone() });
        // What is infinite cannot be written; the pose as it is can.
        Skeleton::new(joints.collect()).unwrap_or_else(|_| posed.clone())
    }

    /// Which nodes a pose of some joints changes: those, and all that are stretched below them.
    #[must_use]
    pub fn posed_below(&self, skeleton: &Skeleton, posed: &[usize]) -> Vec<usize> {
        let mut is_posed = vec![false; skeleton.len()];
        for joint in posed.iter().filter(|joint| **joint < skeleton.len()) {
            is_posed[*joint] = true;
        }
        for joint in 0..skeleton.len() {
            let is_below = skeleton.parent(joint).is_some_and(|parent| is_posed[parent]);
            is_posed[joint] |= is_below && self.joint_from_node[joint].is_some();
        }
        (0..skeleton.len()).filter(|joint| is_posed[*joint]).collect()
    }

    /// A clip of the scene's skeleton as one of the file's nodes. Joints that are stretched get translations and scales too, since
    /// that is what keeps their lengths.
    ///
    /// # Errors
    /// When its numbers become infinite.
    pub fn clip_of_nodes(&self, skeleton: &Skeleton, clip: &Clip) -> Result<Clip, ClipError> {
        let mut recorded = Recorded::new(&self.is_stretched(), clip.frame_count());
        for frame in 0..clip.frame_count() {
            recorded.add(&self.nodes_of(skeleton, &clip.local_pose(skeleton, frame)));
        }
        let tracks = recorded.into_tracks(clip, self.nodes.iter().copied());
        clip.clone().with_joints(tracks)
    }

    /// The local transforms of the file's nodes that put every joint where a pose has it.
    ///
    /// From the top down, each below the matrix that its parent really has: places are exact, and what a rotation and a scale
    /// cannot say does not add up along a limb.
    fn nodes_of(&self, skeleton: &Skeleton, pose: &LocalPose) -> Vec<Transform> {
        let models = pose.to_model(skeleton);
        let mut written: Vec<DMat4> = Vec::with_capacity(skeleton.len());
        let mut locals = Vec::with_capacity(skeleton.len());
        for (index, joint) in skeleton.joints().iter().enumerate() {
            let above = joint.parent.map_or(DMat4::IDENTITY, |parent| written[parent]);
            let local = match &self.joint_from_node[index] {
                None => pose.transforms()[index],
                Some(joint_from_node) => {
                    let wanted = models.transforms()[index].to_matrix() * DMat4::from_mat3(*joint_from_node);
                    let local = nearest_transform(&(above.inverse() * wanted), self.nodes[index]);
                    // Nodes at rest keep their numbers.
                    if is_same(&local, &self.nodes[index]) { self.nodes[index] } else { local }
                }
            };
            written.push(above * local.to_matrix());
            locals.push(local);
        }
        locals
    }
}

/// How many joints a clip itself stretches, of a skeleton that is not stretched at rest, so that a viewer that multiplies matrices has
/// some of them noticeably elsewhere; 0 where it has none.
#[must_use]
pub fn joints_stretched_in(skeleton: &Skeleton, clip: &Clip) -> usize {
    let count =
        stretched_in(skeleton, clip, vec![false; skeleton.len()]).into_iter().filter(|stretched| *stretched).count();
    if count == 0 || is_near(skeleton, clip) { 0 } else { count }
}

/// Such a clip with its joints where that viewer has them.
///
/// # Errors
/// When the clip's numbers become infinite.
pub fn straightened_clip(skeleton: &Skeleton, clip: &Clip) -> Result<Clip, ClipError> {
    straight_clip(skeleton, skeleton, clip, &stretched_in(skeleton, clip, vec![false; skeleton.len()]))
}

/// Which joints are stretched in a clip, where those are that are so at rest.
fn stretched_in(skeleton: &Skeleton, clip: &Clip, mut stretched: Vec<bool>) -> Vec<bool> {
    let is_even =
        |scale: &Vec3| (scale.max_element() - scale.min_element()).abs() <= EVEN as f32 * scale.abs().max_element();
    let has_children: Vec<bool> = skeleton.children().iter().map(|children| !children.is_empty()).collect();
    for joint in 0..skeleton.len() {
        let own = match &clip.joints()[joint].scale {
            Track::Rest => false,
            Track::Constant(scale) => !is_even(scale),
            Track::Sampled(scales) => !scales.iter().all(is_even),
        };
        let is_below = skeleton.parent(joint).is_some_and(|parent| stretched[parent]);
        stretched[joint] |= is_below || own && has_children[joint];
    }
    stretched
}

/// Whether no joint of a clip is noticeably elsewhere for a viewer that multiplies matrices.
fn is_near(skeleton: &Skeleton, clip: &Clip) -> bool {
    let mut size = f64::MIN_POSITIVE;
    let mut farthest = 0.0_f64;
    for frame in 0..clip.frame_count() {
        let pose = clip.local_pose(skeleton, frame);
        let models = pose.to_model(skeleton);
        for (matrix, model) in matrices(skeleton, pose.transforms()).iter().zip(models.transforms()) {
            size = size.max(model.translation.distance(models.transforms()[0].translation));
            farthest = farthest.max(matrix.w_axis.truncate().distance(model.translation));
        }
    }
    farthest <= size * NEAR
}

/// The same clip of joints that are not stretched, `straight` at rest.
fn straight_clip(file: &Skeleton, straight: &Skeleton, clip: &Clip, stretched: &[bool]) -> Result<Clip, ClipError> {
    let mut recorded = Recorded::new(stretched, clip.frame_count());
    for frame in 0..clip.frame_count() {
        let pose = clip.local_pose(file, frame);
        let matrices = matrices(file, pose.transforms());
        recorded.add(&straight_pose(file, pose.transforms(), &matrices, stretched).0);
    }
    let rests = straight.joints().iter().map(|joint| joint.rest);
    clip.clone().with_joints(recorded.into_tracks(clip, rests))
}

/// `model_from_node` of every joint, as a viewer multiplies them.
fn matrices(skeleton: &Skeleton, locals: &[Transform]) -> Vec<DMat4> {
    let mut matrices: Vec<DMat4> = Vec::with_capacity(locals.len());
    for (joint, local) in skeleton.joints().iter().zip(locals) {
        let local = local.to_matrix();
        matrices.push(joint.parent.map_or(local, |parent| matrices[parent] * local));
    }
    matrices
}

/// The same pose of joints that are not stretched: local transforms, and those in model space.
fn straight_pose(
    skeleton: &Skeleton,
    locals: &[Transform],
    matrices: &[DMat4],
    stretched: &[bool],
) -> (Vec<Transform>, Vec<Transform>) {
    let (mut straight, mut models): (Vec<Transform>, Vec<Transform>) = Default::default();
    for (index, joint) in skeleton.joints().iter().enumerate() {
        let above = joint.parent.map_or(Transform::IDENTITY, |parent| models[parent]);
        // What is hidden by a scale of nothing has no rotation of its own.
        let is_rigid = stretched[index] && !is_flat(&DMat3::from_mat4(matrices[index]));
        let model = if is_rigid { rigid(&matrices[index]) } else { above.then_child(&locals[index]) };
        straight.push(if is_rigid { above.relative(&model) } else { locals[index] });
        models.push(model);
    }
    (straight, models)
}

/// Place, nearest rotation and mean scale of a matrix. Mirroring is a negative scale.
fn rigid(matrix: &DMat4) -> Transform {
    let linear = DMat3::from_mat4(*matrix);
    let scale = linear.determinant().cbrt();
    Transform {
        translation: matrix.w_axis.truncate(),
        rotation: nearest_rotation(&(linear * scale.signum())),
        scale: DVec3::splat(scale),
    }
}

/// The rotation and scale that come nearest to a matrix; `usual` says which sign its scales have.
fn nearest_transform(matrix: &DMat4, usual: Transform) -> Transform {
    let signs = usual.scale.signum();
    let linear = DMat3::from_mat4(*matrix);
    let rotation = nearest_rotation(&(linear * DMat3::from_diagonal(signs)));
    let along = DMat3::from_quat(rotation).transpose() * linear;
    let scale = DVec3::new(along.x_axis.x, along.y_axis.y, along.z_axis.z);
    Transform { translation: matrix.w_axis.truncate(), rotation, scale }
}

/// The rotation nearest to a matrix of positive volume: the orthogonal factor of its polar decomposition, by Newton's iteration
/// (Higham 1986). One that is flat has none; the identity stands for it.
fn nearest_rotation(matrix: &DMat3) -> DQuat {
    const MAX_STEPS: usize = 40;
    let size = matrix.determinant().abs().cbrt();
    let mut rotation = *matrix * size.recip();
    for _ in 0..MAX_STEPS {
        let next = (rotation + rotation.inverse().transpose()) * 0.5;
        let step = next - rotation;
        rotation = next;
        if (step.x_axis.length_squared() + step.y_axis.length_squared() + step.z_axis.length_squared()) < 1e-28 {
            break;
        }
    }
    let rotation = DQuat::from_mat3(&rotation);
    if rotation.is_finite() { rotation.normalize() } else { DQuat::IDENTITY }
}

fn is_same(first: &Transform, second: &Transform) -> bool {
    const ROUNDING: f64 = 1e-11;
    first.translation.abs_diff_eq(second.translation, ROUNDING * second.translation.length().max(1e-3))
        && first.scale.abs_diff_eq(second.scale, ROUNDING * second.scale.length())
        && 1.0 - first.rotation.dot(second.rotation).abs() < 1e-15
}

fn is_even(linear: &DMat3) -> bool {
    let squares = linear.transpose() * *linear;
    let mean = (squares.x_axis.x + squares.y_axis.y + squares.z_axis.z) / 3.0;
    squares.abs_diff_eq(DMat3::from_diagonal(DVec3::splat(mean)), EVEN * mean)
}

fn is_flat(linear: &DMat3) -> bool {
    let longest = linear.x_axis.length().max(linear.y_axis.length()).max(linear.z_axis.length());
    let volume = linear.determinant().abs();
    !volume.is_finite() || volume <= FLAT * longest.powi(3)
}

/// Local transforms of some joints, frame by frame.
struct Recorded {
    joints: Vec<Option<Vec<Transform>>>,
}

impl Recorded {
    fn new(wanted: &[bool], frames: usize) -> Self {
        Self { joints: wanted.iter().map(|wanted| wanted.then(|| Vec::with_capacity(frames))).collect() }
    }

    fn add(&mut self, locals: &[Transform]) {
        for (frames, local) in self.joints.iter_mut().zip(locals) {
            if let Some(frames) = frames {
                frames.push(*local);
            }
        }
    }

    /// The tracks of a clip with those of the recorded joints instead of its own. Channels that stay at rest are left out.
    fn into_tracks(self, clip: &Clip, rests: impl Iterator<Item = Transform>) -> Vec<JointTracks> {
        let joints = self.joints.into_iter().zip(clip.joints()).zip(rests);
        joints
            .map(|((frames, own), rest)| {
                let Some(frames) = frames else { return own.clone() };
                let vectors = |part: fn(&Transform) -> DVec3| {
                    let still = frames
                        .iter()
                        .all(|local| part(local).abs_diff_eq(part(&rest), SAME * part(&rest).length().max(1e-3)));
                    if still { Track::Rest } else { vectors(frames.iter().map(part)) }
                };
                let turned = |local: &Transform| 1.0 - local.rotation.dot(rest.rotation).abs() > SAME * SAME;
                let rotation = if frames.iter().any(turned) { rotations(&frames) } else { Track::Rest };
                JointTracks {
                    translation: vectors(|local| local.translation),
                    rotation,
                    scale: vectors(|local| local.scale),
                }
            })
            .collect()
    }
}

fn vectors(values: impl Iterator<Item = DVec3>) -> Track<Vec3> {
    Track::Sampled(values.map(|value| value.as_vec3()).collect()).compacted()
}

fn rotations(frames: &[Transform]) -> Track<Quat> {
    let mut values: Vec<Quat> = Vec::with_capacity(frames.len());
    for frame in frames {
        let rotation = frame.rotation.as_quat().normalize();
        values.push(super::rotation::next_to(rotation, values.last().copied()));
    }
    Track::Sampled(values).compacted()
}

#[cfg(test)]
mod tests;
