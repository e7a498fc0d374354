//! A scene for a viewer: nodes, what can be seen of them as decoded triangles with plain materials, and at most one clip.

use std::borrow::Cow;

use glam::{Mat4, Vec2, Vec3};
use serde_json::{Map, Value, json};

use super::{
    Output,
    animation::{self, MorphNode},
    array,
    meshes::{add_positions, add_vertices},
    pack,
    schema::{Accessor, Component, Image, List, Mesh, MorphTarget, Primitive, Shape, Skin, Target},
    skeleton::node,
    to_value,
};
use crate::{
    formats::{Compression, FormatError},
    model::{Appearance, Canceled, Carrier, Clip, Control, FourInfluences, Paint, Reporter, Scene, Surface},
};

/// A normal that is rounded to so many steps is as long as validators want it, within 0.004.
const NORMAL_STEPS: f32 = 256.0;

/// Joints that move surfaces, and how they were bound.
type BoundJoints = Vec<(usize, Mat4)>;

/// Writes a GLB whose first nodes are the joints of the scene in their order, each with its label in `extras.joint`; `extras` goes to its
/// scene. Of the joints that move a vertex the four with the largest shares are kept, which is what every viewer knows.
///
/// # Errors
/// When it would be larger than a GLB can be, or the work is canceled.
pub(in crate::formats) fn write_display(
    scene: &Scene,
    clip: Option<&Clip>,
    appearance: &Appearance,
    extras: &Value,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    let generator = concat!("retargetd ", env!("CARGO_PKG_VERSION"));
    let mut json = Map::new();
    json.insert("asset".into(), json!({"version": "2.0", "generator": generator}));
    let mut output = Output::new(json, Compression::None);
    add_nodes(&mut output.json, scene, extras)?;
    add_images(&mut output, appearance)?;
    add_materials(&mut output.json, appearance)?;
    let mut skins: Vec<BoundJoints> = Vec::new();
    let mut morph_nodes = Vec::new();
    for surface in appearance.surfaces.iter().filter(|surface| !surface.indices.is_empty()) {
        control.check().map_err(|Canceled| FormatError::from(Canceled))?;
        let node = add_surface(&mut output, surface, scene, &mut skins)?;
        if !surface.shapes.is_empty() {
            let morphs = surface.shapes.iter().map(|shape| Some(shape.morph)).collect();
            let rest = surface.shapes.iter().map(|shape| scene.morphs[shape.morph].rest).collect();
            morph_nodes.push(MorphNode { node, morphs, rest });
        }
    }
    for joints in &skins {
        add_skin(&mut output, joints)?;
    }
    if let Some(clip) = clip {
        let animation = animation::append(&mut output, scene, clip, |index, _| index, &morph_nodes, control, reporter)?;
        output.json.extend(animation.map(|animation| ("animations".to_owned(), json!([animation]))));
    }
    if output.binary.length() > 0 {
        output.json.insert("buffers".into(), json!([{"byteLength": output.binary.length()}]));
    }
    pack::glb(output)
}

/// The joints, below one node where they are several trees, as skins ask for.
fn add_nodes(json: &mut Map<String, Value>, scene: &Scene, extras: &Value) -> Result<(), FormatError> {
    let joints = scene.skeleton.joints();
    let labeled = |(index, (joint, children)): (usize, (_, Vec<usize>))| {
        let mut node = to_value(&node(joint, &children))?;
        node["extras"] = json!({"joint": scene.skeleton.label(index)});
        Ok(node)
    };
    let nodes = joints.iter().zip(scene.skeleton.children()).enumerate().map(labeled);
    let mut nodes = nodes.collect::<Result<Vec<Value>, FormatError>>()?;
    let mut roots: Vec<usize> = (0..joints.len()).filter(|joint| joints[*joint].parent.is_none()).collect();
    if roots.len() > 1 {
        nodes.push(json!({"name": "scene", "children": roots}));
        roots = vec![nodes.len() - 1];
    }
    json.insert("scene".into(), json!(0));
    json.insert("scenes".into(), json!([{"extras": {"retargetd": extras}}]));
    if !nodes.is_empty() {
        json["scenes"][0]["nodes"] = json!(roots);
        json.insert("nodes".into(), Value::Array(nodes));
    }
    Ok(())
}

/// A mesh of its own for a surface, and a node that has it. Gives the node.
fn add_surface(
    output: &mut Output<'_>,
    surface: &Surface,
    scene: &Scene,
    skins: &mut Vec<BoundJoints>,
) -> Result<usize, FormatError> {
    let mesh = add_mesh(output, surface)?;
    let mut node = json!({"mesh": mesh});
    let nodes = array(&mut output.json, "nodes")?;
    let index = nodes.len();
    match &surface.carrier {
        Carrier::Joint(joint) => {
            nodes.push(node);
            push_in(&mut nodes[*joint], "children", json!(index));
        }
        Carrier::Skin { joints, .. } => {
            let skin = skins.iter().position(|known| known == joints).unwrap_or_else(|| {
                skins.push(joints.clone());
                skins.len() - 1
            });
            node["skin"] = json!(skin);
            node["name"] =
                json!(format!("{}_skin_{skin}", scene.skeleton.label(joints.first().map_or(0, |bound| bound.0))));
            nodes.push(node);
            push_in(&mut output.json["scenes"][0], "nodes", json!(index));
        }
    }
    Ok(index)
}

/// Adds to the array of that name in an object, made where it is not there.
fn push_in(object: &mut Value, key: &str, item: Value) {
    match object[key].as_array_mut() {
        Some(list) => list.push(item),
        None => object[key] = json!([item]),
    }
}

fn add_mesh(output: &mut Output<'_>, surface: &Surface) -> Result<usize, FormatError> {
    let mut attributes = Map::new();
    let steps = steps_of(&surface.positions);
    let positions: Vec<Vec3> = surface.positions.iter().map(|place| rounded(*place, steps)).collect();
    attributes.insert("POSITION".into(), json!(add_positions(output, &positions)?));
    if !surface.normals.is_empty() {
        let normals: Vec<[f32; 3]> = surface
            .normals
            .iter()
            .map(|normal| rounded(normal.normalize_or(Vec3::Y), NORMAL_STEPS).to_array())
            .collect();
        attributes.insert("NORMAL".into(), json!(add_vertices(output, &normals, Component::Float, Shape::Vec3)?));
    }
    if !surface.texture_coordinates.is_empty() {
        let places: Vec<[f32; 2]> = surface.texture_coordinates.iter().map(Vec2::to_array).collect();
        attributes.insert("TEXCOORD_0".into(), json!(add_vertices(output, &places, Component::Float, Shape::Vec2)?));
    }
    if !surface.colors.is_empty() {
        let colors: Vec<[f32; 4]> = surface.colors.iter().map(glam::Vec4::to_array).collect();
        attributes.insert("COLOR_0".into(), json!(add_vertices(output, &colors, Component::Float, Shape::Vec4)?));
    }
    if let Carrier::Skin { influences, .. } = &surface.carrier {
        let largest: Vec<FourInfluences> =
            (0..surface.positions.len()).map(|vertex| largest_four(influences, vertex)).collect();
        let joints: Vec<[u16; 4]> = largest.iter().map(|four| four.joints).collect();
        let shares: Vec<[f32; 4]> = largest.iter().map(|four| four.shares).collect();
        attributes
            .insert("JOINTS_0".into(), json!(add_vertices(output, &joints, Component::UnsignedShort, Shape::Vec4)?));
        attributes.insert("WEIGHTS_0".into(), json!(add_vertices(output, &shares, Component::Float, Shape::Vec4)?));
    }
    let indices = add_indices(output, &surface.indices)?;
    let mut targets = Vec::with_capacity(surface.shapes.len());
    for shape in &surface.shapes {
        let mut offsets = vec![Vec3::ZERO; surface.positions.len()];
        shape.offsets.iter().for_each(|(vertex, offset)| offsets[*vertex as usize] = *offset);
        offsets.iter_mut().for_each(|offset| *offset = rounded(*offset, steps));
        targets.push(MorphTarget { position: add_positions(output, &offsets)? });
    }
    let primitive = Primitive { attributes: &attributes, indices, material: surface.paint, targets: &targets };
    output.push(List::Meshes, &Mesh { primitives: vec![primitive], name: "", weights: Vec::new(), extras: None })
}

/// How many steps a unit of length has: a surface is at most 32,768 of them large, which is a tenth of a millimeter of a figure.
fn steps_of(positions: &[Vec3]) -> f32 {
    let largest = positions.iter().map(|place| place.abs().max_element()).fold(0.0, f32::max);
    if largest > 0.0 { 2.0_f32.powf(14.0 - largest.log2().ceil()) } else { 1.0 }
}

/// Numbers of few digits: nobody sees the others, and what has them is twice as large when it is compressed.
fn rounded(place: Vec3, steps: f32) -> Vec3 {
    let rounded = (place * steps).round() / steps;
    if rounded.is_finite() { rounded } else { place }
}

/// Indices as short as they can be.
fn add_indices(output: &mut Output<'_>, indices: &[u32]) -> Result<usize, FormatError> {
    let short: Option<Vec<u16>> =
        indices.iter().map(|index| u16::try_from(*index).ok().filter(|index| *index < u16::MAX)).collect();
    let (view, component) = match &short {
        Some(short) => (output.add_values(short, Some(Target::Indices))?, Component::UnsignedShort),
        None => (output.add_values(indices, Some(Target::Indices))?, Component::UnsignedInt),
    };
    output.add_accessor(&Accessor::of_view(view, component, indices.len(), Shape::Scalar))
}

/// The four joints with the largest shares of a vertex, each once, with shares that are 1 together.
fn largest_four(influences: &[Vec<FourInfluences>], vertex: usize) -> FourInfluences {
    let mut found: Vec<(u16, f32)> = Vec::with_capacity(8);
    for four in influences.iter().map(|set| set[vertex]) {
        for (joint, share) in four.joints.into_iter().zip(four.shares).filter(|(_, share)| *share > 0.0) {
            match found.iter_mut().find(|(known, _)| *known == joint) {
                Some((_, sum)) => *sum += share,
                None => found.push((joint, share)),
            }
        }
    }
    found.sort_by(|one, other| other.1.total_cmp(&one.1).then(one.0.cmp(&other.0)));
    found.truncate(4);
    let total: f32 = found.iter().map(|(_, share)| share).sum();
    let mut four = FourInfluences { joints: [0; 4], shares: [1.0, 0.0, 0.0, 0.0] };
    for (place, (joint, share)) in found.into_iter().enumerate() {
        (four.joints[place], four.shares[place]) = (joint, share / total);
    }
    four
}

fn add_skin(output: &mut Output<'_>, joints: &BoundJoints) -> Result<(), FormatError> {
    let columns = |(_, matrix): &(usize, Mat4)| {
        let matrix = if matrix.is_finite() { *matrix } else { Mat4::IDENTITY };
        let mut columns = matrix.to_cols_array();
        // The last row of an affine matrix, without rounding: validators compare it bit for bit.
        (columns[3], columns[7], columns[11], columns[15]) = (0.0, 0.0, 0.0, 1.0);
        columns
    };
    let matrices: Vec<[f32; 16]> = joints.iter().map(columns).collect();
    let view = output.add_values(&matrices, None)?;
    let accessor = Accessor::of_view(view, Component::Float, joints.len(), Shape::Mat4);
    let inverse_bind_matrices = output.add_accessor(&accessor)?;
    let nodes: Vec<usize> = joints.iter().map(|(joint, _)| *joint).collect();
    output.push(List::Skins, &Skin { name: "", inverse_bind_matrices, joints: &nodes })?;
    Ok(())
}

/// PNG and JPEG files as they are; an empty one has no image and no texture.
fn add_images<'a>(output: &mut Output<'a>, appearance: &'a Appearance) -> Result<(), FormatError> {
    for image in appearance.images.iter().filter(|image| !image.is_empty()) {
        let media_type = if image.starts_with(&[0xff, 0xd8]) { "image/jpeg" } else { "image/png" };
        let buffer_view = output.add_view(Cow::Borrowed(image), None)?;
        let source = output.push(List::Images, &Image { mime_type: media_type, buffer_view, name: "" })?;
        array(&mut output.json, "textures")?.push(json!({"source": source}));
    }
    Ok(())
}

fn add_materials(json: &mut Map<String, Value>, appearance: &Appearance) -> Result<(), FormatError> {
    let mut texture_of = Vec::with_capacity(appearance.images.len());
    let mut textures = 0_usize;
    for image in &appearance.images {
        texture_of.push((!image.is_empty()).then_some(textures));
        textures += usize::from(!image.is_empty());
    }
    for Paint { base_color, image, cut_out_below, is_blended } in &appearance.paints {
        let mut surface =
            json!({"baseColorFactor": base_color.to_array(), "metallicFactor": 0, "roughnessFactor": 0.9});
        if let Some(texture) = image.and_then(|image| texture_of.get(image).copied().flatten()) {
            surface["baseColorTexture"] = json!({"index": texture});
        }
        let mut material = json!({"pbrMetallicRoughness": surface, "doubleSided": true});
        if let Some(cutoff) = cut_out_below {
            material["alphaMode"] = json!("MASK");
            material["alphaCutoff"] = json!(cutoff);
        } else if *is_blended {
            material["alphaMode"] = json!("BLEND");
        }
        array(json, "materials")?.push(material);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_not_seen() {
        let place = Vec3::new(1.234_567_8, -0.000_012, 1.9);
        let steps = steps_of(&[place]);
        assert_eq!(steps, 8192.0, "of what is up to 2 large");
        assert!((rounded(place, steps) - place).abs().max_element() <= 0.5 / 8192.0);
        assert_eq!(steps_of(&[Vec3::ZERO]), 1.0);
        let normal = rounded(Vec3::new(0.6, -0.64, 0.48), NORMAL_STEPS);
        assert!((normal.length() - 1.0).abs() < 0.004, "{normal}");
        let tiny = Vec3::splat(1e-38);
        assert!(rounded(tiny, steps_of(&[tiny])).is_finite());
    }

    #[test]
    fn the_largest_shares_of_a_vertex_stay_and_are_one_together() {
        let set = |joints, shares| vec![FourInfluences { joints, shares }];
        let sets = [set([1, 2, 3, 4], [0.1, 0.2, 0.1, 0.1]), set([2, 5, 6, 0], [0.1, 0.3, 0.1, 0.0])];
        let four = largest_four(&sets, 0);
        assert_eq!(four.joints, [2, 5, 1, 3], "each once, the largest first, of equal ones the first");
        assert!((four.shares.iter().sum::<f32>() - 1.0).abs() < 1e-6, "{four:?}");
        assert_eq!(largest_four(&[set([7; 4], [0.0; 4])], 0).shares, [1.0, 0.0, 0.0, 0.0], "never nothing");
    }
}
