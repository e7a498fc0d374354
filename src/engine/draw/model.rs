//! A moving drawing as a model: its texture on a flat mesh, which bones carry, as glTF.
//!
//! Each body part group is a mesh. The order of drawing is a distance toward the viewer: a morph that moves a part forward by one layer,
//! with the number of its layer as its weight. Skins take no notice of where their meshes are, and morphs come before skins.

use std::collections::BTreeMap;

use glam::{DMat4, DQuat, DVec2, DVec3};
use serde_json::{Value, json};

use crate::{
    drawing::{Performance, Skin},
    engine::{Failure, FailureCode, NamedBytes, provenance::engine},
    formats::glb_file,
    model::Control,
    picture::Picture,
};

use super::{FileReader, Scenery, film::puppet, stage::DrawnCharacter};

/// The height of a figure in meters.
const HEIGHT_METERS: f64 = 1.7;
/// From one layer to the next, in meters.
const LAYER_METERS: f64 = 0.004;
/// Less opacity than this is none.
const CUT_OUT_BELOW: f64 = 0.5;
/// So many pixels beyond the figure its colors are continued, for viewers that mix neighbors.
const BLED_PIXELS: usize = 6;

const FLOAT: u32 = 5126;
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_SHORT: u32 = 5123;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The characters of a scene as one binary glTF.
///
/// # Errors
///
/// Where a picture cannot be read, or characters are deformed in a way that no skin has.
pub(super) fn glb(
    scenery: &Scenery,
    read: &mut FileReader<'_>,
    source: Option<NamedBytes<'_>>,
    control: &Control,
) -> Result<Vec<u8>, Failure> {
    let mut document = Document::default();
    let mut channels = Channels::default();
    // A skin needs bones, also where the picture is deformed as the original does it.
    let mut held = scenery.clone();
    held.look.deformation = crate::drawing::Deformation::Bones;
    held.look.smooth = true;
    for (index, character) in scenery.characters.iter().enumerate() {
        control.check()?;
        let puppet = puppet(character, &held, true, read)?;
        let skin = puppet.skin().ok_or_else(|| Failure::new(FailureCode::Internal, "a mesh has no bones"))?;
        Figure::new(index, character, &skin).write(&mut document, &mut channels)?;
    }
    let name = &scenery.name;
    let animation = json!({"name": name, "channels": channels.channels, "samplers": channels.samplers});
    document.list("animations").push(animation);
    document.extras = json!({"engine": engine(), "source": source.map(|source| source.name.to_owned())});
    document.into_glb()
}

#[derive(Default)]
struct Channels {
    channels: Vec<Value>,
    samplers: Vec<Value>,
}

impl Channels {
    fn add(&mut self, node: usize, path: &str, (input, output): (usize, usize), interpolation: &str) {
        self.channels.push(json!({"sampler": self.samplers.len(), "target": {"node": node, "path": path}}));
        self.samplers.push(json!({"input": input, "output": output, "interpolation": interpolation}));
    }
}

/// A character with its lengths in meters.
struct Figure<'a> {
    name: String,
    character: &'a DrawnCharacter,
    performance: &'a Performance,
    skin: &'a Skin<'a>,
    /// Meters in a side of the drawing's square.
    scale: f64,
    /// The lowest place of the drawing at rest.
    floor: f64,
    /// For each bone the joint at its end and the joint that it begins at.
    bones: Vec<[usize; 2]>,
}

impl<'a> Figure<'a> {
    fn new(index: usize, character: &'a DrawnCharacter, skin: &'a Skin<'a>) -> Self {
        let heights = || skin.vertices.iter().map(|vertex| vertex.y);
        let floor = heights().fold(f64::MAX, f64::min);
        let height = heights().fold(f64::MIN, f64::max) - floor;
        Self {
            name: format!("drawing{}", if index == 0 { String::new() } else { format!("_{index}") }),
            character,
            performance: &character.performance,
            skin,
            scale: HEIGHT_METERS / height.max(1e-9),
            floor,
            bones: skin.bones(),
        }
    }

    /// A place at rest in meters: the root in the middle, the drawing on the floor.
    fn meters(&self, place: DVec2) -> DVec2 {
        DVec2::new(place.x - self.character.rig.rest[0].x, place.y - self.floor) * self.scale
    }

    /// The joints at a frame, not mirrored, relative to the root.
    fn joints(&self, frame: usize) -> Vec<DVec2> {
        let (mut joints, _) = self.performance.joints_about_root(frame);
        if self.performance.is_mirrored[frame] {
            joints.iter_mut().for_each(|joint| joint.x = -joint.x);
        }
        joints
    }

    fn write(&self, document: &mut Document, channels: &mut Channels) -> Result<(), Failure> {
        let frames = self.performance.frames;
        let times: Vec<f32> = (0..frames).map(|frame| (frame as f64 * self.performance.frame_time) as f32).collect();
        let input = document.accessor(&times, "SCALAR", None);
        document.bound(input, &[times[0]], &[times[frames - 1]]);
        let skin = self.write_bones(document, channels, input);
        let material = self.write_material(document)?;
        let groups = self.skin.parts.len();
        let first: Vec<f32> = self.layers(0);
        let of_frames: Vec<Vec<f32>> = (0..frames).map(|frame| self.layers(frame)).collect();
        for group in 0..groups {
            let Some(mesh) = self.write_mesh(document, group, material, first[group]) else { continue };
            let node = document.node(json!({
                "name": format!("{}_part_{group}", self.name), "mesh": mesh, "skin": skin,
            }));
            document.roots.push(node);
            let layers: Vec<f32> = of_frames.iter().map(|layers| layers[group]).collect();
            if layers.iter().any(|layer| *layer != layers[0]) {
                let output = document.accessor(&layers, "SCALAR", None);
                channels.add(node, "weights", (input, output), "STEP");
            }
        }
        Ok(())
    }

    /// For each group the number of its layer.
    fn layers(&self, frame: usize) -> Vec<f32> {
        let groups = self.skin.parts.len();
        let order = &self.performance.order[frame * groups..][..groups];
        let mut layers = vec![0.0; groups];
        order.iter().enumerate().for_each(|(layer, &group)| layers[group] = layer as f32);
        layers
    }

    /// The bones and what they do. Gives the index of the skin.
    fn write_bones(&self, document: &mut Document, channels: &mut Channels, input: usize) -> usize {
        let rig = &self.character.rig;
        let frames = self.performance.frames;
        let joints: Vec<Vec<DVec2>> = (0..frames).map(|frame| self.joints(frame)).collect();
        let turns: Vec<Vec<f64>> = joints.iter().map(|joints| self.skin.turns(joints)).collect();
        let stretches: Vec<Vec<f64>> = joints.iter().map(|joints| self.skin.stretches(joints)).collect();
        let is_stretched = stretches.iter().flatten().any(|stretch| (stretch - 1.0).abs() > 1e-4);
        let root = document.node(json!({"name": format!("{}_root", self.name)}));
        document.roots.push(root);
        self.write_root(document, channels, root, input);
        // The bone that a bone goes on from: the one that ends where it begins.
        let before = |bone: usize| self.bones.iter().position(|other| other[0] == self.bones[bone][1]);
        let nodes: Vec<usize> =
            self.bones.iter().map(|[joint, _]| document.node(json!({"name": rig.joint_names[*joint]}))).collect();
        let mut skin_nodes = nodes.clone();
        let mut matrices: Vec<[f32; 16]> = Vec::new();
        for (bone, &[joint, from]) in self.bones.iter().enumerate() {
            let parent = before(bone);
            document.adopt(parent.map_or(root, |parent| nodes[parent]), nodes[bone]);
            // Where a bone begins, in the frame of the one before, which begins elsewhere and is turned.
            let start = |frame: usize| {
                let origin = parent.map_or(DVec2::ZERO, |parent| joints[frame][self.bones[parent][1]]);
                let turned = parent.map_or(0.0, |parent| turns[frame][parent]);
                DVec2::from_angle(-turned).rotate(joints[frame][from] - origin) * self.scale
            };
            let origin = parent.map_or(rig.rest[0], |parent| rig.rest[self.bones[parent][1]]);
            let at_rest = (rig.rest[from] - origin) * self.scale;
            document.nodes[nodes[bone]]["translation"] = json!(space(at_rest));
            let starts: Vec<[f32; 3]> = (0..frames).map(|frame| space(start(frame))).collect();
            if starts.iter().any(|start| (start[0] - at_rest.x as f32).hypot(start[1] - at_rest.y as f32) > 1e-5) {
                let output = document.accessor(starts.as_flattened(), "VEC3", None);
                channels.add(nodes[bone], "translation", (input, output), "LINEAR");
            }
            let rotations: Vec<[f32; 4]> = (0..frames)
                .map(|frame| turned(turns[frame][bone] - parent.map_or(0.0, |parent| turns[frame][parent])))
                .collect();
            let output = document.accessor(continuous(rotations).as_flattened(), "VEC4", None);
            channels.add(nodes[bone], "rotation", (input, output), "LINEAR");
            let place = self.meters(rig.rest[from]);
            let mut bind = DMat4::from_translation(DVec3::new(place.x, place.y, 0.0));
            if is_stretched {
                let along = rig.rest[joint] - rig.rest[from];
                let angle = along.y.atan2(along.x);
                let name = format!("{}_length", rig.joint_names[joint]);
                let node = document.node(json!({"name": name, "rotation": turned(angle)}));
                document.adopt(nodes[bone], node);
                let scales: Vec<[f32; 3]> =
                    stretches.iter().map(|stretches| [stretches[bone] as f32, 1.0, 1.0]).collect();
                let output = document.accessor(scales.as_flattened(), "VEC3", None);
                channels.add(node, "scale", (input, output), "LINEAR");
                skin_nodes[bone] = node;
                bind *= DMat4::from_quat(DQuat::from_rotation_z(angle));
            }
            matrices.push(affine(bind.inverse()));
        }
        let inverse = document.accessor(matrices.as_flattened(), "MAT4", None);
        let skin = document.list("skins");
        skin.push(json!({
            "name": self.name, "joints": skin_nodes, "skeleton": root, "inverseBindMatrices": inverse,
        }));
        skin.len() - 1
    }

    /// The way of the root, and the mirroring about it.
    fn write_root(&self, document: &mut Document, channels: &mut Channels, root: usize, input: usize) {
        let start = self.meters(self.character.rig.rest[0]);
        let place = |way: &DVec2| space(start + *way * self.scale);
        document.nodes[root]["translation"] = json!(space(start));
        let places: Vec<[f32; 3]> = self.performance.roots.iter().map(place).collect();
        let output = document.accessor(places.as_flattened(), "VEC3", None);
        channels.add(root, "translation", (input, output), "LINEAR");
        if self.performance.is_mirrored.contains(&true) {
            let scale = |is: &bool| [if *is { -1.0_f32 } else { 1.0 }, 1.0, 1.0];
            let scales: Vec<[f32; 3]> = self.performance.is_mirrored.iter().map(scale).collect();
            let output = document.accessor(scales.as_flattened(), "VEC3", None);
            channels.add(root, "scale", (input, output), "STEP");
        }
    }

    /// The mesh of a body part group; nothing where it has no triangle.
    fn write_mesh(&self, document: &mut Document, group: usize, material: usize, layer: f32) -> Option<usize> {
        let triangles = &self.skin.parts[group];
        let mut used: BTreeMap<usize, u16> = BTreeMap::new();
        for &vertex in triangles.iter().flatten() {
            let next = u16::try_from(used.len()).ok()?;
            used.entry(vertex).or_insert(next);
        }
        if used.is_empty() {
            return None;
        }
        let mut vertices: Vec<(u16, usize)> = used.iter().map(|(vertex, place)| (*place, *vertex)).collect();
        vertices.sort_unstable();
        let vertices: Vec<usize> = vertices.into_iter().map(|(_, vertex)| vertex).collect();
        let texture = self.skin.texture;
        let size = DVec2::new(texture.width as f64, texture.height as f64);
        let positions: Vec<[f32; 3]> =
            vertices.iter().map(|&vertex| space(self.meters(self.skin.vertices[vertex]))).collect();
        let coordinates: Vec<[f32; 2]> =
            vertices.iter().map(|&vertex| (self.skin.texels[vertex] / size).as_vec2().to_array()).collect();
        let (mut joints, mut weights) = (Vec::<[u8; 4]>::new(), Vec::<[f32; 4]>::new());
        for &vertex in &vertices {
            let (mut of, mut by) = ([0; 4], [0.0; 4]);
            for (slot, &(bone, share)) in self.skin.shares()[vertex].iter().take(4).enumerate() {
                (of[slot], by[slot]) = (u8::try_from(bone).ok()?, share as f32);
            }
            joints.push(of);
            weights.push(by);
        }
        let forward: Vec<[f32; 3]> = vec![[0.0, 0.0, LAYER_METERS as f32]; vertices.len()];
        let indices: Vec<u16> = triangles.iter().flatten().map(|vertex| used[vertex]).collect();
        let position = document.accessor(positions.as_flattened(), "VEC3", Some(ARRAY_BUFFER));
        let bounds = |of: fn(f32, f32) -> f32, start: f32| {
            positions.iter().fold([start; 3], |all, place| [0, 1, 2].map(|axis: usize| of(all[axis], place[axis])))
        };
        document.bound(position, &bounds(f32::min, f32::MAX), &bounds(f32::max, f32::MIN));
        let target = document.accessor(forward.as_flattened(), "VEC3", Some(ARRAY_BUFFER));
        document.bound(target, &forward[0], &forward[0]);
        let primitive = json!({
            "attributes": {
                "POSITION": position,
                "TEXCOORD_0": document.accessor(coordinates.as_flattened(), "VEC2", Some(ARRAY_BUFFER)),
                "JOINTS_0": document.small(joints.as_flattened(), UNSIGNED_BYTE, 4),
                "WEIGHTS_0": document.accessor(weights.as_flattened(), "VEC4", Some(ARRAY_BUFFER)),
            },
            "indices": document.indices(&indices),
            "material": material,
            "targets": [{"POSITION": target}],
        });
        let meshes = document.list("meshes");
        meshes.push(json!({
            "name": format!("part_{group}"), "primitives": [primitive], "weights": [layer],
            "extras": {"targetNames": ["layer"]},
        }));
        Some(meshes.len() - 1)
    }

    fn write_material(&self, document: &mut Document) -> Result<usize, Failure> {
        let failed = |error: crate::picture::PictureError| Failure::new(FailureCode::Internal, error.to_string());
        let png = bled(self.skin.texture.clone()).to_png().map_err(failed)?;
        let view = document.view(&png, None);
        let images = document.list("images");
        images.push(json!({"name": self.name, "bufferView": view, "mimeType": "image/png"}));
        let image = images.len() - 1;
        let samplers = document.list("samplers");
        samplers.push(json!({"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}));
        let sampler = samplers.len() - 1;
        let textures = document.list("textures");
        textures.push(json!({"source": image, "sampler": sampler}));
        let texture = textures.len() - 1;
        let materials = document.list("materials");
        materials.push(json!({
            "name": self.name,
            "pbrMetallicRoughness": {"baseColorTexture": {"index": texture}, "metallicFactor": 0.0, "roughnessFactor": 1.0},
            "alphaMode": "MASK",
            "alphaCutoff": CUT_OUT_BELOW,
            "doubleSided": true,
            "extensions": {"KHR_materials_unlit": {}},
        }));
        Ok(materials.len() - 1)
    }
}

fn space(place: DVec2) -> [f32; 3] {
    [place.x as f32, place.y as f32, 0.0]
}

/// A turn about +Z.
fn turned(angle: f64) -> [f32; 4] {
    let half = angle / 2.0;
    [0.0, 0.0, half.sin() as f32, half.cos() as f32]
}

/// Rotations that go from one to the next by the shorter way.
fn continuous(mut rotations: Vec<[f32; 4]>) -> Vec<[f32; 4]> {
    for at in 1..rotations.len() {
        let before = rotations[at - 1];
        if before[2] * rotations[at][2] + before[3] * rotations[at][3] < 0.0 {
            rotations[at].iter_mut().for_each(|part| *part = -*part);
        }
    }
    rotations
}

fn affine(matrix: DMat4) -> [f32; 16] {
    let mut columns = matrix.as_mat4().to_cols_array();
    // Rounding must not touch the row that makes the matrix affine.
    [3, 7, 11].into_iter().for_each(|place| columns[place] = 0.0);
    columns[15] = 1.0;
    columns
}

/// Continues the colors of a figure into what is transparent around it.
fn bled(mut picture: Picture) -> Picture {
    let (width, height) = (picture.width, picture.height);
    let mut is_known: Vec<bool> = picture.pixels.iter().map(|pixel| pixel[3] > 0).collect();
    for _ in 0..BLED_PIXELS {
        let mut found = Vec::new();
        for index in (0..picture.pixels.len()).filter(|index| !is_known[*index]) {
            let (row, column) = (index / width, index % width);
            let (mut sums, mut count) = ([0_u32; 3], 0);
            for next in row.saturating_sub(1)..(row + 2).min(height) {
                for beside in column.saturating_sub(1)..(column + 2).min(width) {
                    let other = next * width + beside;
                    if is_known[other] {
                        (0..3).for_each(|part| sums[part] += u32::from(picture.pixels[other][part]));
                        count += 1;
                    }
                }
            }
            if count > 0 {
                found.push((index, sums.map(|sum| (sum / count) as u8)));
            }
        }
        for (index, [red, green, blue]) in found {
            picture.pixels[index] = [red, green, blue, 0];
            is_known[index] = true;
        }
    }
    // What is far away packs better as one color.
    for (pixel, is_known) in picture.pixels.iter_mut().zip(is_known) {
        if !is_known {
            *pixel = [255, 255, 255, 0];
        }
    }
    picture
}

/// A glTF under construction.
#[derive(Default)]
struct Document {
    nodes: Vec<Value>,
    roots: Vec<usize>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    binary: Vec<u8>,
    /// Other members, by their names.
    lists: BTreeMap<&'static str, Vec<Value>>,
    extras: Value,
}

impl Document {
    fn node(&mut self, node: Value) -> usize {
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    fn adopt(&mut self, parent: usize, child: usize) {
        match self.nodes[parent].get_mut("children").and_then(Value::as_array_mut) {
            Some(children) => children.push(json!(child)),
            None => self.nodes[parent]["children"] = json!([child]),
        }
    }

    fn list(&mut self, name: &'static str) -> &mut Vec<Value> {
        self.lists.entry(name).or_default()
    }

    fn view(&mut self, bytes: &[u8], purpose: Option<u32>) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len()});
        if let Some(purpose) = purpose {
            view["target"] = json!(purpose);
        }
        self.binary.extend_from_slice(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    /// Floats of a type such as `VEC3`.
    fn accessor(&mut self, values: &[f32], kind: &str, purpose: Option<u32>) -> usize {
        let parts = match kind {
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            _ => 1,
        };
        let view = self.view(bytemuck::cast_slice(values), purpose);
        let count = values.len() / parts;
        self.accessors.push(json!({"bufferView": view, "componentType": FLOAT, "count": count, "type": kind}));
        self.accessors.len() - 1
    }

    fn small(&mut self, values: &[u8], kind: u32, parts: usize) -> usize {
        let view = self.view(values, Some(ARRAY_BUFFER));
        let count = values.len() / parts;
        self.accessors.push(json!({"bufferView": view, "componentType": kind, "count": count, "type": "VEC4"}));
        self.accessors.len() - 1
    }

    fn indices(&mut self, values: &[u16]) -> usize {
        let view = self.view(bytemuck::cast_slice(values), Some(ELEMENT_ARRAY_BUFFER));
        self.accessors.push(
            json!({"bufferView": view, "componentType": UNSIGNED_SHORT, "count": values.len(), "type": "SCALAR"}),
        );
        self.accessors.len() - 1
    }

    fn bound(&mut self, accessor: usize, least: &[f32], most: &[f32]) {
        self.accessors[accessor]["min"] = json!(least);
        self.accessors[accessor]["max"] = json!(most);
    }

    /// Joins the JSON and the bytes.
    fn into_glb(self) -> Result<Vec<u8>, Failure> {
        let mut document = json!({
            "asset": {"version": "2.0", "generator": "retargetd", "extras": self.extras},
            "extensionsUsed": ["KHR_materials_unlit"],
            "scene": 0,
            "scenes": [{"nodes": self.roots}],
            "nodes": self.nodes,
            "bufferViews": self.views,
            "accessors": self.accessors,
            "buffers": [{"byteLength": self.binary.len()}],
        });
        for (member, list) in self.lists {
            document[member] = Value::Array(list);
        }
        glb_file(&document, &self.binary)
            .map_err(|_| Failure::new(FailureCode::AssetLimitExceeded, "the model has more than 4 GiB"))
    }
}
