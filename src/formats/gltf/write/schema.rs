//! What the writer adds to a document, as glTF 2.0 names it. The members of each object stand in the order of the fields.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};
use serde_json::{Map, Value};

/// The lists of a document.
#[derive(Clone, Copy, Debug)]
pub(super) enum List {
    Accessors,
    BufferViews,
    Images,
    Materials,
    Meshes,
    Nodes,
    Samplers,
    Skins,
    Textures,
}

impl List {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Accessors => "accessors",
            Self::BufferViews => "bufferViews",
            Self::Images => "images",
            Self::Materials => "materials",
            Self::Meshes => "meshes",
            Self::Nodes => "nodes",
            Self::Samplers => "samplers",
            Self::Skins => "skins",
            Self::Textures => "textures",
        }
    }
}

/// The number type of an accessor's components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    Short,
    UnsignedShort,
    UnsignedInt,
    Float,
}

impl Serialize for Component {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u64(match self {
            Self::Short => 5122,
            Self::UnsignedShort => 5123,
            Self::UnsignedInt => 5125,
            Self::Float => 5126,
        })
    }
}

/// How many components an element of an accessor has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Shape {
    Scalar,
    Vec2,
    Vec3,
    Vec4,
    Mat4,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) buffer_view: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) byte_offset: Option<usize>,
    pub(super) component_type: Component,
    #[serde(skip_serializing_if = "is_false")]
    pub(super) normalized: bool,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) shape: Shape,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) sparse: Option<Sparse>,
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub(super) bounds: Option<Bounds>,
}

impl Accessor {
    /// Elements without bounds; those of a view where `buffer_view` is set then.
    pub(super) const fn new(component_type: Component, count: usize, shape: Shape) -> Self {
        Self {
            buffer_view: None,
            byte_offset: None,
            component_type,
            normalized: false,
            count,
            shape,
            sparse: None,
            bounds: None,
        }
    }

    /// The elements of a view of their own.
    pub(super) fn of_view(view: usize, component_type: Component, count: usize, shape: Shape) -> Self {
        Self { buffer_view: Some(view), ..Self::new(component_type, count, shape) }
    }
}

/// The smallest and the largest value of each component.
#[derive(Debug, Serialize)]
pub(super) struct Bounds {
    pub(super) min: Vec<f32>,
    pub(super) max: Vec<f32>,
}

/// Elements of an accessor that are not zero.
#[derive(Debug, Serialize)]
pub(super) struct Sparse {
    pub(super) count: usize,
    pub(super) indices: SparseIndices,
    pub(super) values: SparseValues,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub(super) buffer_view: usize,
    pub(super) component_type: Component,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub(super) buffer_view: usize,
}

/// What a buffer view is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    Vertices,
    Indices,
}

impl Serialize for Target {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u64(match self {
            Self::Vertices => 34962,
            Self::Indices => 34963,
        })
    }
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub(super) buffer: usize,
    pub(super) byte_offset: usize,
    pub(super) byte_length: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) target: Option<Target>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) extensions: BTreeMap<&'static str, CompressedView>,
}

/// A view of `EXT_meshopt_compression`.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct CompressedView {
    pub(super) buffer: usize,
    pub(super) byte_offset: usize,
    pub(super) byte_length: usize,
    pub(super) byte_stride: usize,
    pub(super) mode: &'static str,
    pub(super) count: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) filter: Option<&'static str>,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) byte_length: usize,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) extensions: BTreeMap<&'static str, Fallback>,
}

/// Marks a buffer without content, which compressed views decode into.
#[derive(Debug, Serialize)]
pub(super) struct Fallback {
    pub(super) fallback: bool,
}

#[derive(Debug, Serialize)]
pub(super) struct Asset {
    pub(super) version: &'static str,
    pub(super) generator: &'static str,
}

#[derive(Debug, Serialize)]
pub(super) struct DocumentScene<'a> {
    pub(super) nodes: &'a [usize],
}

#[derive(Debug, Default, Serialize)]
pub(super) struct Node<'a> {
    #[serde(skip_serializing_if = "str::is_empty")]
    pub(super) name: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) translation: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) rotation: Option<[f64; 4]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) scale: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "<[usize]>::is_empty")]
    pub(super) children: &'a [usize],
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) mesh: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) skin: Option<usize>,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin<'a> {
    #[serde(skip_serializing_if = "str::is_empty")]
    pub(super) name: &'a str,
    pub(super) inverse_bind_matrices: usize,
    pub(super) joints: &'a [usize],
}

#[derive(Debug, Serialize)]
pub(super) struct Animation<'a> {
    #[serde(skip_serializing_if = "str::is_empty")]
    pub(super) name: &'a str,
    pub(super) channels: Vec<Channel>,
    pub(super) samplers: Vec<AnimationSampler>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) extras: Option<AnimationExtras<'a>>,
}

#[derive(Debug, Serialize)]
pub(super) struct AnimationExtras<'a> {
    pub(super) curves: PropertyCurves<'a>,
}

/// Custom properties: key times and the values of each.
#[derive(Debug, Serialize)]
pub(super) struct PropertyCurves<'a> {
    pub(super) times_seconds: &'a [f64],
    pub(super) values: Map<String, Value>,
}

#[derive(Debug, Serialize)]
pub(super) struct Channel {
    pub(super) sampler: usize,
    pub(super) target: ChannelTarget,
}

#[derive(Debug, Serialize)]
pub(super) struct ChannelTarget {
    pub(super) node: usize,
    pub(super) path: &'static str,
}

#[derive(Debug, Serialize)]
pub(super) struct AnimationSampler {
    pub(super) input: usize,
    pub(super) interpolation: Interpolation,
    pub(super) output: usize,
}

#[derive(Clone, Copy, Debug, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Interpolation {
    Linear,
    CubicSpline,
}

#[derive(Debug, Serialize)]
pub(super) struct Mesh<'a> {
    pub(super) primitives: Vec<Primitive<'a>>,
    #[serde(skip_serializing_if = "str::is_empty")]
    pub(super) name: &'a str,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) weights: Vec<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) extras: Option<MeshExtras<'a>>,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct MeshExtras<'a> {
    pub(super) target_names: Vec<&'a str>,
}

#[derive(Debug, Serialize)]
pub(super) struct Primitive<'a> {
    /// Accessors by the names of attributes.
    pub(super) attributes: &'a Map<String, Value>,
    pub(super) indices: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) material: Option<usize>,
    #[serde(skip_serializing_if = "<[MorphTarget]>::is_empty")]
    pub(super) targets: &'a [MorphTarget],
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) struct MorphTarget {
    pub(super) position: usize,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Image<'a> {
    pub(super) mime_type: &'a str,
    pub(super) buffer_view: usize,
    #[serde(skip_serializing_if = "str::is_empty")]
    pub(super) name: &'a str,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Material<'a> {
    #[serde(skip_serializing_if = "str::is_empty")]
    pub(super) name: &'a str,
    pub(super) pbr_metallic_roughness: Surface,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) normal_texture: Option<TextureInfo>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) emissive_texture: Option<TextureInfo>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) emissive_factor: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) alpha_mode: Option<&'static str>,
    pub(super) double_sided: bool,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Surface {
    pub(super) base_color_factor: [f64; 4],
    pub(super) metallic_factor: f64,
    pub(super) roughness_factor: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) base_color_texture: Option<TextureInfo>,
}

#[derive(Clone, Copy, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureInfo {
    pub(super) index: usize,
    #[serde(skip_serializing_if = "is_first")]
    pub(super) tex_coord: usize,
}

/// How a texture goes on beyond its edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wrap {
    Clamp,
    Repeat,
}

impl Serialize for Wrap {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u64(match self {
            Self::Clamp => 33071,
            Self::Repeat => 10497,
        })
    }
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureSampler {
    pub(super) wrap_s: Wrap,
    pub(super) wrap_t: Wrap,
}

#[derive(Debug, Serialize)]
pub(super) struct Texture {
    pub(super) source: usize,
    pub(super) sampler: usize,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands references on")]
const fn is_false(value: &bool) -> bool {
    !*value
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands references on")]
const fn is_first(set: &usize) -> bool {
    *set == 0
}
