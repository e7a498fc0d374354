//! What drawn characters do, as arrays: in a NumPy archive, or the same in JSON.

use glam::{DVec2, DVec3};
use serde_json::{Map, Value, json};

use crate::{
    drawing::{Arap, Plane, Precision},
    engine::{Failure, FailureCode, NamedBytes},
    formats::{Elements, Limits, NamedArray, read_numbers, write_arrays},
    model::Control,
};

use super::stage::{DrawnCharacter, Scenery, refused};

/// What the characters of a scene do, as an archive of arrays (`.npz`). A mesh, such an archive with `mesh_rest_vertices` and
/// `mesh_triangles`, is deformed with the first character.
///
/// # Errors
///
/// Where the mesh cannot be used.
pub(super) fn npz(scenery: &Scenery, mesh: Option<NamedBytes<'_>>, control: &Control) -> Result<Vec<u8>, Failure> {
    let arrays = arrays(scenery, mesh, control)?;
    write_arrays(&arrays).map_err(|error| Failure::new(FailureCode::Internal, error.detail))
}

/// The same arrays as lists of lists.
///
/// # Errors
///
/// As [`npz`].
pub(super) fn json(scenery: &Scenery, mesh: Option<NamedBytes<'_>>, control: &Control) -> Result<Vec<u8>, Failure> {
    let mut document = Map::new();
    for array in arrays(scenery, mesh, control)? {
        let flat: Vec<Value> = match array.elements {
            // As many digits as the other form has.
            Elements::Reals(values) => values.into_iter().map(|value| json!(value as f32)).collect(),
            Elements::Integers(values) => values.into_iter().map(Value::from).collect(),
            Elements::Names(names) => names.into_iter().map(Value::from).collect(),
        };
        document.insert(array.name, nested(flat, &array.shape));
    }
    serde_json::to_vec(&document).map_err(|error| Failure::new(FailureCode::Internal, format!("the poses: {error}")))
}

/// Values row by row as lists of lists.
fn nested(flat: Vec<Value>, shape: &[usize]) -> Value {
    let Some((&first, rest)) = shape.split_first() else { return flat.into_iter().next().unwrap_or(Value::Null) };
    if rest.is_empty() {
        return Value::Array(flat);
    }
    let each: usize = rest.iter().product();
    let mut flat = flat.into_iter();
    (0..first).map(|_| nested(flat.by_ref().take(each).collect(), rest)).collect()
}

fn arrays(scenery: &Scenery, mesh: Option<NamedBytes<'_>>, control: &Control) -> Result<Vec<NamedArray>, Failure> {
    let mut arrays = Vec::new();
    for (index, character) in scenery.characters.iter().enumerate() {
        let prefix = if scenery.characters.len() > 1 { format!("c{index}_") } else { String::new() };
        let mut own = character.arrays(scenery.is_original);
        if let (0, Some(mesh)) = (index, mesh) {
            own.extend(character.deformed(mesh.bytes, control)?);
        }
        for array in own {
            arrays.push(NamedArray { name: format!("{prefix}{}", array.name), ..array });
        }
    }
    Ok(arrays)
}

impl DrawnCharacter {
    fn arrays(&self, is_original: bool) -> Vec<NamedArray> {
        let Self { rig, motion, retarget, performance, .. } = self;
        let (frames, joints) = (performance.frames, rig.rest.len());
        let groups = retarget.char_bodypart_groups.len();
        let space = |vectors: &[DVec3]| vectors.iter().flat_map(DVec3::to_array).collect::<Vec<_>>();
        let plane = |vectors: &[DVec2]| vectors.iter().flat_map(DVec2::to_array).collect::<Vec<_>>();
        let planes = performance.planes.iter().flat_map(|plane| match plane {
            Plane::Frontal => [1.0, 0.0, 0.0],
            Plane::Sagittal => [0.0, 0.0, 1.0],
        });
        let group_names: Vec<String> =
            retarget.bvh_projection_bodypart_groups.iter().map(|group| group.name.clone()).collect();
        let mut arrays = vec![
            reals("bvh_root_positions", &[frames, 3], space(&motion.roots)),
            reals("bvh_joint_positions_normalised", &[frames, motion.joints(), 3], space(&motion.places)),
            reals("bvh_fwd_vectors", &[frames, 3], space(&motion.forwards)),
            reals(
                "char_orientations_deg",
                &[frames, performance.driven.len()],
                performance.orientations_degrees.clone(),
            ),
            reals("bvh_joint_depths", &[frames, performance.depth_joints.len()], performance.depths.clone()),
            reals("char_root_positions", &[frames, 2], plane(&performance.roots)),
            reals("char_start_loc", &[3], performance.start.to_vec()),
            reals("rig_rest_xy", &[joints, 2], plane(&rig.rest)),
            reals("rig_joint_xy", &[frames, joints, 2], plane(&performance.joints)),
            reals("projection_plane_normals", &[performance.planes.len(), 3], planes.collect()),
            reals("frame_time", &[1], vec![performance.frame_time]),
            NamedArray {
                name: "bodypart_order".to_owned(),
                shape: vec![frames, groups],
                elements: Elements::Integers(performance.order.iter().map(|&group| group as i32).collect()),
            },
            names("orientation_columns", &performance.driven),
            names("depth_columns", &performance.depth_joints),
            names("char_joint_names", &rig.joint_names),
            names("bvh_joint_names", &motion.joint_names),
            names("projection_groups", &group_names),
        ];
        if !is_original {
            arrays.extend(self.further_arrays());
        }
        arrays
    }

    /// What only the steady manner has.
    fn further_arrays(&self) -> [NamedArray; 4] {
        let Self { rig, performance, .. } = self;
        let frames = performance.frames;
        let integers = |name: &str, shape: Vec<usize>, values: Vec<i32>| NamedArray {
            name: name.to_owned(),
            shape,
            elements: Elements::Integers(values),
        };
        let mirrored = performance.is_mirrored.iter().map(|is| i32::from(*is)).collect();
        let feet: Vec<String> = performance.contacts.iter().map(|(joint, _)| rig.joint_names[*joint].clone()).collect();
        let stands =
            (0..frames).flat_map(|frame| performance.contacts.iter().map(move |(_, all)| i32::from(all[frame])));
        [
            integers("mirrored", vec![frames], mirrored),
            reals("camera_pan", &[frames], performance.pan.clone()),
            integers("contacts", vec![frames, feet.len()], stands.collect()),
            names("contact_joints", &feet),
        ]
    }

    /// The deformed vertices at each frame.
    fn deformed(&self, mesh: &[u8], control: &Control) -> Result<Vec<NamedArray>, Failure> {
        let vertices = numbers(mesh, "mesh_rest_vertices", 2, control)?;
        let vertices: Vec<DVec2> = vertices.chunks_exact(2).map(DVec2::from_slice).collect();
        let triangles = numbers(mesh, "mesh_triangles", 3, control)?;
        // What is not the index of a vertex becomes one that does not exist.
        let corner = |value: f64| if value < 0.0 { usize::MAX } else { value as usize };
        let triangles: Vec<[usize; 3]> =
            triangles.chunks_exact(3).map(|row| [corner(row[0]), corner(row[1]), corner(row[2])]).collect();
        let arap = Arap::new(&vertices, &triangles, &self.rig.rest_in_single_precision(), Precision::Single)
            .map_err(|error| refused(error, "mesh"))?;
        let mut workspace = arap.workspace();
        let mut deformed = vec![DVec2::ZERO; vertices.len()];
        let frames = self.performance.frames;
        let mut values = Vec::with_capacity(frames * vertices.len() * 2);
        for frame in 0..frames {
            control.check().map_err(|_| Failure::new(FailureCode::Canceled, "canceled"))?;
            let (joints, root) = self.performance.joints_about_root(frame);
            arap.deform(&joints, &mut workspace, &mut deformed);
            values.extend(deformed.iter().flat_map(|&vertex| (vertex + root).to_array()));
        }
        let pinned = arap.is_pinned.iter().map(|&is| i32::from(is)).collect();
        Ok(vec![
            reals("arap_vertices", &[frames, vertices.len(), 2], values),
            NamedArray {
                name: "arap_frames".to_owned(),
                shape: vec![frames],
                elements: Elements::Integers((0..frames as i32).collect()),
            },
            NamedArray {
                name: "arap_pin_mask".to_owned(),
                shape: vec![arap.is_pinned.len()],
                elements: Elements::Integers(pinned),
            },
        ])
    }
}

fn reals(name: &str, shape: &[usize], values: Vec<f64>) -> NamedArray {
    NamedArray { name: name.to_owned(), shape: shape.to_vec(), elements: Elements::Reals(values) }
}

fn names(name: &str, names: &[String]) -> NamedArray {
    NamedArray { name: name.to_owned(), shape: vec![names.len()], elements: Elements::Names(names.to_vec()) }
}

/// An array of rows of a mesh.
fn numbers(mesh: &[u8], name: &str, width: usize, control: &Control) -> Result<Vec<f64>, Failure> {
    let found = read_numbers(mesh, name, &Limits::default(), control).map_err(|error| {
        Failure::new(FailureCode::AssetMalformed, format!("mesh: {}", error.detail)).with_hint(&*error.hint)
    })?;
    match found {
        Some((shape, values)) if shape.len() == 2 && shape[1] == width => Ok(values),
        _ => {
            let detail = format!("mesh: there is no array {name} with rows of {width}");
            let hint = "give an archive with mesh_rest_vertices and mesh_triangles";
            Err(Failure::new(FailureCode::AssetMalformed, detail).with_hint(hint))
        }
    }
}
