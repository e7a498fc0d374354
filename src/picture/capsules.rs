//! What a skeleton without a mesh looks like: a capsule along each bone, and a head.

use std::f32::consts::TAU;

use glam::{Mat4, Vec3, Vec4};

use crate::model::{Appearance, Carrier, ModelPose, Paint, Surface};

/// Corners around a capsule.
const SIDES: usize = 12;
/// Rings of each of its round ends.
const RINGS: usize = 4;

/// A bone that is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bone {
    /// The joint that it begins at, which carries it.
    pub from: usize,
    /// The joint that it ends at.
    pub to: usize,
    /// Whether it is a part of the trunk, which is thicker.
    pub is_trunk: bool,
}

/// A skeleton at rest as capsules along some bones, with a head on the joint that is one, where it is known.
#[must_use]
pub fn capsules(rest: &ModelPose, bones: &[Bone], head: Option<(usize, Option<usize>)>) -> Appearance {
    let place = |joint: usize| rest.transforms()[joint].translation.as_vec3();
    let ends = || bones.iter().flat_map(|bone| [place(bone.from), place(bone.to)]);
    let low = ends().reduce(Vec3::min).unwrap_or_default();
    let high = ends().reduce(Vec3::max).unwrap_or_default();
    let size = (high - low).max_element().max(1e-6);
    let mut surfaces = Vec::new();
    let is_in_head = |bone: &Bone| {
        let goes_on = bones.iter().any(|next| next.from == bone.to);
        head.is_some_and(|(head, _)| bone.from == head) && !goes_on
    };
    // What ends in the head is under the head that is drawn: its top, its eyes, its jaw.
    for bone in bones.iter().filter(|bone| !is_in_head(bone)) {
        let (start, end) = (place(bone.from), place(bone.to));
        let length = start.distance(end);
        if length < 1e-4 * size {
            continue;
        }
        let radius = if bone.is_trunk { 0.055 * size } else { (0.18 * length).clamp(0.009 * size, 0.036 * size) };
        surfaces.extend(surface(rest, bone.from, start, end, radius, 0));
    }
    if let Some((head, neck)) = head {
        let reaches = bones.iter().filter(|bone| bone.from == head).map(|bone| place(bone.to) - place(head));
        let farthest = reaches.max_by(|one, other| one.length().total_cmp(&other.length()));
        let neck = neck.map_or(Vec3::Y, |neck| place(head) - place(neck)).normalize_or(Vec3::Y);
        let toward = farthest.filter(|to| to.length() > 0.03 * size).unwrap_or(neck * 0.09 * size);
        let middle =
            place(head) + toward.normalize_or(Vec3::Y) * (0.5 * toward.length()).clamp(0.03 * size, 0.07 * size);
        let tip = toward.normalize_or(Vec3::Y) * 0.02 * size;
        surfaces.extend(surface(rest, head, middle - tip, middle + tip, 0.055 * size, 1));
    }
    let bone = Paint { base_color: Vec4::new(0.34, 0.45, 0.62, 1.0), ..Paint::default() };
    let face = Paint { base_color: Vec4::new(0.62, 0.47, 0.34, 1.0), ..Paint::default() };
    Appearance { surfaces, paints: vec![bone, face], images: Vec::new() }
}

/// A capsule between two places in model space, carried by a joint; nothing where the joint has no space.
fn surface(rest: &ModelPose, joint: usize, start: Vec3, end: Vec3, radius: f32, paint: usize) -> Option<Surface> {
    let joint_from_model: Mat4 = rest.transforms()[joint].to_matrix().inverse().as_mat4();
    if !joint_from_model.is_finite() {
        return None;
    }
    let along = (end - start).normalize_or(Vec3::Y);
    let across = along.any_orthonormal_vector();
    let other = along.cross(across);
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    let ring_count = 2 * (RINGS + 1);
    for ring in 0..ring_count {
        // From the pole at the start, over its equator and that of the end, to the pole there.
        let is_end = ring > RINGS;
        let angle = (if is_end { ring - RINGS - 1 } else { ring }) as f32 / RINGS as f32 * TAU / 4.0;
        let (height, width) = if is_end { (angle.sin(), angle.cos()) } else { (-angle.cos(), angle.sin()) };
        let center = if is_end { end } else { start };
        for side in 0..SIDES {
            let turn = side as f32 / SIDES as f32 * TAU;
            let normal = along * height + (across * turn.cos() + other * turn.sin()) * width;
            positions.push(joint_from_model.transform_point3(center + normal * radius));
            normals.push(joint_from_model.transform_vector3(normal).normalize_or_zero());
        }
    }
    let mut indices = Vec::new();
    for ring in 0..ring_count - 1 {
        for side in 0..SIDES {
            let at = |ring: usize, side: usize| (ring * SIDES + side % SIDES) as u32;
            let corners = [at(ring, side), at(ring, side + 1), at(ring + 1, side), at(ring + 1, side + 1)];
            indices.extend([corners[0], corners[1], corners[2], corners[1], corners[3], corners[2]]);
        }
    }
    Some(Surface {
        positions,
        normals,
        texture_coordinates: Vec::new(),
        colors: Vec::new(),
        indices,
        paint: Some(paint),
        carrier: Carrier::Joint(joint),
        shapes: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::*;
    use crate::model::Transform;

    /// A neck, a head, the top of the head, and an ear of two bones.
    #[test]
    fn the_end_of_a_head_does_not_stick_out_of_it() {
        let heights = [1.5, 1.6, 1.9, 1.7, 1.8];
        let place = |height: &f64| Transform {
            translation: DVec3::new(0.0, *height, 0.0),
            rotation: DQuat::IDENTITY,
            scale: DVec3::ONE,
        };
        let rest = ModelPose::new(heights.iter().map(place).collect());
        let bones = [(0, 1), (1, 2), (1, 3), (3, 4)].map(|(from, to)| Bone { from, to, is_trunk: false });
        let carriers = |head| {
            let surfaces = capsules(&rest, &bones, head).surfaces;
            let joint = |surface: &Surface| match surface.carrier {
                Carrier::Joint(joint) => Some((joint, surface.paint)),
                _ => None,
            };
            surfaces.iter().filter_map(joint).collect::<Vec<_>>()
        };
        let bone = |joint| (joint, Some(0));
        assert_eq!(carriers(None), [bone(0), bone(1), bone(1), bone(3)]);
        assert_eq!(carriers(Some((1, Some(0)))), [bone(0), bone(1), bone(3), (1, Some(1))]);
    }
}
