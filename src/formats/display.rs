//! A file of any format as a plain GLB for viewers.

use glam::Mat4;
use serde_json::Value;

use super::{
    FormatError, gltf,
    space::{Conversion, convert_clip, convert_scene},
};
use crate::model::{Appearance, Axes, Carrier, Clip, ClipError, Control, Reporter, Scene};

/// Encodes the nodes of a scene, what can be seen of them and at most one clip as a GLB in +Y up, +Z front and meters. Everything is
/// decoded: triangles, four joints a vertex, materials of one color and one texture. `axes` and `unit_meters` are those that the scene was
/// found to have; images are PNG or JPEG, or empty where they are left out.
///
/// # Errors
/// When it would be larger than a GLB can be, or the work is canceled.
pub fn write_display(
    scene: &Scene,
    clip: Option<&Clip>,
    appearance: Appearance,
    (axes, unit_meters): (Axes, f64),
    extras: &Value,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    let conversion = Conversion::into_ours(axes, unit_meters);
    if conversion.is_identity() {
        return gltf::write_display(scene, clip, &appearance, extras, control, reporter);
    }
    let not_a_clip = |error: ClipError| FormatError::malformed("convert", "", error.to_string());
    let clip = clip.map(|clip| convert_clip(clip.clone(), scene, &conversion)).transpose().map_err(not_a_clip)?;
    let appearance = scaled(appearance, conversion.scale as f32);
    gltf::write_display(&convert_scene(scene, &conversion), clip.as_ref(), &appearance, extras, control, reporter)
}

/// The same surfaces at another size. Their joints turn them.
fn scaled(mut appearance: Appearance, scale: f32) -> Appearance {
    for surface in &mut appearance.surfaces {
        surface.positions.iter_mut().for_each(|position| *position *= scale);
        surface.shapes.iter_mut().flat_map(|shape| &mut shape.offsets).for_each(|(_, offset)| *offset *= scale);
        if let Carrier::Skin { joints, .. } = &mut surface.carrier {
            joints
                .iter_mut()
                .for_each(|(_, joint_from_vertex)| *joint_from_vertex = at_scale(*joint_from_vertex, scale));
        }
    }
    appearance
}

fn at_scale(mut matrix: Mat4, scale: f32) -> Mat4 {
    let place = matrix.w_axis.truncate() * scale;
    matrix.w_axis = place.extend(1.0);
    matrix
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn a_bound_vertex_is_where_it_was_at_another_size() {
        let matrix = Mat4::from_rotation_z(0.5) * Mat4::from_translation(Vec3::new(1.0, 2.0, 3.0));
        let vertex = Vec3::new(0.3, -0.2, 0.7);
        let wanted = matrix.transform_point3(vertex) * 0.01;
        assert!((at_scale(matrix, 0.01).transform_point3(vertex * 0.01) - wanted).length() < 1e-6);
    }
}
