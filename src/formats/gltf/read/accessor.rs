//! Typed arrays: every component type, normalized integers, strides, sparse values, compressed views.

use std::collections::{BTreeMap, btree_map::Entry};

use bytemuck::{Pod, Zeroable};

use super::meshopt;
use crate::formats::{
    Budget, FormatError,
    gltf::{
        document::{Document, View},
        json::Cursor,
    },
};

/// The shapes of elements that animations and skins use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    Scalar,
    Vec2,
    Vec3,
    Vec4,
    Mat2,
    Mat3,
    Mat4,
}

/// The types of components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

/// An entry of `accessors`, with nothing decoded yet.
#[derive(Clone, Debug)]
pub(super) struct Accessor {
    /// Number of elements; at least one.
    pub(super) count: usize,
    /// Its own place in `accessors`.
    pub(super) index: usize,
    /// Whether it says between which bounds its values lie.
    pub(super) has_bounds: bool,
    shape: Shape,
    component: Component,
    normalized: bool,
    source: Option<Source>,
    sparse: Option<Sparse>,
}

#[derive(Clone, Copy, Debug)]
struct Source {
    view: usize,
    offset: usize,
}

#[derive(Clone, Copy, Debug)]
struct Sparse {
    count: usize,
    index_component: Component,
    indices: Source,
    values: Source,
}

/// Decodes accessors of one document; compressed views are decoded once.
#[derive(Debug)]
pub(super) struct Accessors<'d> {
    document: &'d Document,
    decompressed: BTreeMap<usize, Vec<u8>>,
}

impl Shape {
    const ALL: [(Self, &'static str, usize); 7] = [
        (Self::Scalar, "SCALAR", 1),
        (Self::Vec2, "VEC2", 2),
        (Self::Vec3, "VEC3", 3),
        (Self::Vec4, "VEC4", 4),
        (Self::Mat2, "MAT2", 4),
        (Self::Mat3, "MAT3", 9),
        (Self::Mat4, "MAT4", 16),
    ];

    fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|row| row.1 == name).map(|row| row.0)
    }

    fn name(self) -> &'static str {
        Self::ALL.iter().find(|row| row.0 == self).map_or("", |row| row.1)
    }

    fn components(self) -> usize {
        Self::ALL.iter().find(|row| row.0 == self).map_or(1, |row| row.2)
    }
}

impl Component {
    const fn from_code(code: u64) -> Option<Self> {
        match code {
            5120 => Some(Self::I8),
            5121 => Some(Self::U8),
            5122 => Some(Self::I16),
            5123 => Some(Self::U16),
            5125 => Some(Self::U32),
            5126 => Some(Self::F32),
            _ => None,
        }
    }

    const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// One component from the first bytes of a slice that is long enough.
    fn decode(self, bytes: &[u8], normalized: bool) -> f32 {
        let (value, largest) = match self {
            Self::I8 => (f32::from(bytes[0] as i8), f32::from(i8::MAX)),
            Self::U8 => (f32::from(bytes[0]), f32::from(u8::MAX)),
            Self::I16 => (f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), f32::from(i16::MAX)),
            Self::U16 => (f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), f32::from(u16::MAX)),
            Self::U32 => (self.decode_index(bytes) as f32, 1.0),
            Self::F32 => (f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]), 1.0),
        };
        // The smallest signed integer has no positive twin; the specification clamps it. NaN stays NaN.
        if normalized && self.size() < 4 { (value / largest).max(-1.0) } else { value }
    }

    fn decode_index(self, bytes: &[u8]) -> u32 {
        match self.size() {
            1 => u32::from(bytes[0]),
            2 => u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        }
    }
}

impl Accessor {
    /// Whether there is anything to decode; without, all elements are zero.
    pub(super) const fn has_data(&self) -> bool {
        self.source.is_some() || self.sparse.is_some()
    }

    /// Checks shape and, where asked for, that the components are floats.
    pub(super) fn expect(&self, shape: Shape, float: bool, place: &Cursor<'_, '_>) -> Result<(), FormatError> {
        if self.shape != shape {
            let detail =
                format!("accessor {} is a {} where a {} is needed", self.index, self.shape.name(), shape.name());
            return Err(place.malformed(detail));
        }
        if float && self.component != Component::F32 {
            return Err(place.malformed(format!("accessor {} must hold floats", self.index)));
        }
        Ok(())
    }
}

impl<'d> Accessors<'d> {
    /// Accessors of a document.
    pub(super) const fn new(document: &'d Document) -> Self {
        Self { document, decompressed: BTreeMap::new() }
    }

    /// The document's JSON.
    pub(super) const fn root(&self) -> Cursor<'d, 'd> {
        self.document.root()
    }

    /// Reads the accessor that `entry` is an index of.
    pub(super) fn accessor(&self, entry: &Cursor<'_, '_>) -> Result<Accessor, FormatError> {
        let root = self.root();
        let accessors = root.get("accessors")?;
        let count = accessors.as_ref().map_or(Ok(0), Cursor::length)?;
        let index = entry.index(count, "accessors")?;
        let accessors = accessors.ok_or_else(|| entry.malformed("there are no accessors"))?;
        let object = accessors.element(index)?;

        let shape = object.require("type")?;
        let shape = Shape::from_name(shape.text()?).ok_or_else(|| shape.malformed("this is not an accessor type"))?;
        let count = object.require("count")?;
        if count.whole()? == 0 {
            return Err(count.malformed("an accessor must have at least one element"));
        }
        let sparse = match object.get("sparse")? {
            Some(sparse) => Some(self.sparse(&sparse, count.size()?)?),
            None => None,
        };
        Ok(Accessor {
            count: count.size()?,
            index,
            has_bounds: object.get("min")?.is_some() && object.get("max")?.is_some(),
            shape,
            component: read_component(&object)?,
            normalized: object.get("normalized")?.map_or(Ok(false), |value| value.boolean())?,
            source: self.source(&object)?,
            sparse,
        })
    }

    fn sparse(&self, object: &Cursor<'_, '_>, elements: usize) -> Result<Sparse, FormatError> {
        let (indices, values) = (object.require("indices")?, object.require("values")?);
        let count = object.require("count")?;
        if count.size()? > elements {
            return Err(count.malformed(format!("{} sparse values do not fit into {elements} elements", count.size()?)));
        }
        let index_component = read_component(&indices)?;
        if !matches!(index_component, Component::U8 | Component::U16 | Component::U32) {
            return Err(indices.malformed("sparse indices must be unsigned integers"));
        }
        let source = |object: &Cursor<'_, '_>| {
            self.source(object)?.ok_or_else(|| object.malformed("the required member 'bufferView' is missing"))
        };
        Ok(Sparse { count: count.size()?, index_component, indices: source(&indices)?, values: source(&values)? })
    }

    fn source(&self, object: &Cursor<'_, '_>) -> Result<Option<Source>, FormatError> {
        let Some(view) = object.get("bufferView")? else { return Ok(None) };
        let view = view.index(self.document.views.len(), "bufferViews")?;
        let offset = object.get("byteOffset")?.map_or(Ok(0), |offset| offset.size())?;
        Ok(Some(Source { view, offset }))
    }

    /// Decodes the first `count` elements. `T` must be as large as that many floats; integers become floats.
    pub(super) fn decode<T: Pod + Zeroable>(
        &mut self,
        accessor: &Accessor,
        count: usize,
        place: &Cursor<'_, '_>,
        budget: &mut Budget<'_>,
    ) -> Result<Vec<T>, FormatError> {
        let components = accessor.shape.components();
        if size_of::<T>() != components * size_of::<f32>() || count > accessor.count {
            return Err(place.malformed(format!("accessor {} does not fit here", accessor.index)));
        }
        // The bytes must be there before memory is taken for what they become.
        let layout = (accessor.component, components, accessor.normalized);
        if let Some(source) = accessor.source {
            self.slice(source, accessor.count, layout, place, budget)?;
        }
        let name = format!("/accessors/{}", accessor.index);
        budget.take_array(count as u64, size_of::<T>() as u64, &name)?;
        let mut elements = vec![T::zeroed(); count];
        let floats: &mut [f32] = bytemuck::cast_slice_mut(&mut elements);
        if let Some(source) = accessor.source {
            let (bytes, stride) = self.slice(source, accessor.count, layout, place, budget)?;
            fill(floats, bytes, stride, layout);
        }
        if let Some(sparse) = accessor.sparse {
            self.overlay(floats, sparse, layout, accessor.count, place, budget)?;
        }
        Ok(elements)
    }

    /// Decodes the indices of triangles, which floats cannot hold.
    pub(super) fn decode_indices(
        &mut self,
        accessor: &Accessor,
        place: &Cursor<'_, '_>,
        budget: &mut Budget<'_>,
    ) -> Result<Vec<u32>, FormatError> {
        let component = accessor.component;
        if !matches!(component, Component::U8 | Component::U16 | Component::U32) {
            return Err(place.malformed("indices must be unsigned integers"));
        }
        let Some(source) = accessor.source else { return Err(place.malformed("the indices have no data")) };
        budget.take_array(accessor.count as u64, size_of::<u32>() as u64, "indices")?;
        let (bytes, stride) = self.slice(source, accessor.count, (component, 1, false), place, budget)?;
        Ok((0..accessor.count).map(|entry| component.decode_index(&bytes[entry * stride..])).collect())
    }

    fn overlay(
        &mut self,
        floats: &mut [f32],
        sparse: Sparse,
        layout: (Component, usize, bool),
        elements: usize,
        place: &Cursor<'_, '_>,
        budget: &mut Budget<'_>,
    ) -> Result<(), FormatError> {
        let index_layout = (sparse.index_component, 1, false);
        let (bytes, stride) = self.slice(sparse.indices, sparse.count, index_layout, place, budget)?;
        budget.take_array(sparse.count as u64, size_of::<usize>() as u64, "sparse indices")?;
        let indices: Vec<usize> = (0..sparse.count)
            .map(|entry| sparse.index_component.decode_index(&bytes[entry * stride..]) as usize)
            .collect();
        if indices.windows(2).any(|pair| pair[0] >= pair[1]) || indices.last().is_some_and(|last| *last >= elements) {
            return Err(place.malformed("the sparse indices of the accessor do not rise, or are out of range"));
        }
        let (bytes, stride) = self.slice(sparse.values, sparse.count, layout, place, budget)?;
        let components = layout.1;
        for (entry, index) in indices.into_iter().enumerate() {
            // Only the first elements may have been asked for.
            let Some(element) = floats.get_mut(index * components..(index + 1) * components) else { break };
            fill(element, &bytes[entry * stride..], stride, layout);
        }
        Ok(())
    }

    /// The bytes of `count` elements and their stride, checked to be inside of the view.
    fn slice(
        &mut self,
        source: Source,
        count: usize,
        (component, components, _): (Component, usize, bool),
        place: &Cursor<'_, '_>,
        budget: &mut Budget<'_>,
    ) -> Result<(&[u8], usize), FormatError> {
        let size = component.size() * components;
        let document = self.document;
        let view = &document.views[source.view];
        let stride = view.stride.unwrap_or(size);
        let past_the_end = || {
            let (offset, view) = (source.offset, source.view);
            place.malformed(format!("{count} elements from byte {offset} on do not fit into buffer view {view}"))
        };
        if stride < size {
            return Err(place.malformed(format!("elements of {size} bytes overlap at a stride of {stride}")));
        }
        let needed = count.saturating_sub(1).checked_mul(stride).and_then(|bytes| bytes.checked_add(size));
        let end = needed.and_then(|bytes| bytes.checked_add(source.offset)).filter(|end| *end <= view.length);
        let end = end.ok_or_else(past_the_end)?;
        let bytes = self.view_bytes(source.view, view, place, budget)?.get(source.offset..end);
        Ok((bytes.ok_or_else(past_the_end)?, stride))
    }

    fn view_bytes(
        &mut self,
        index: usize,
        view: &View,
        place: &Cursor<'_, '_>,
        budget: &mut Budget<'_>,
    ) -> Result<&[u8], FormatError> {
        let document = self.document;
        let buffers = &document.buffers;
        if let Some(bytes) = &buffers[view.buffer].bytes {
            return Ok(&bytes[view.offset..view.offset + view.length]);
        }
        let missing = |buffer: usize| {
            place.malformed(format!("the data is in buffer {buffer}, whose content is not in the file"))
        };
        let compressed = view.compressed.as_ref().ok_or_else(|| missing(view.buffer))?;
        match self.decompressed.entry(index) {
            Entry::Occupied(entry) => Ok(entry.into_mut()),
            Entry::Vacant(entry) => {
                let encoded = buffers[compressed.buffer].bytes.as_ref().ok_or_else(|| missing(compressed.buffer))?;
                let encoded = &encoded[compressed.offset..compressed.offset + compressed.length];
                let place = format!("/bufferViews/{index}");
                Ok(entry.insert(meshopt::decode(encoded, compressed, &place, budget)?))
            }
        }
    }
}

fn read_component(object: &Cursor<'_, '_>) -> Result<Component, FormatError> {
    let component = object.require("componentType")?;
    Component::from_code(component.whole()?)
        .ok_or_else(|| component.malformed(format!("{} is not a component type", component.value())))
}

/// Converts elements that have been checked to be there.
fn fill(
    floats: &mut [f32],
    bytes: &[u8],
    stride: usize,
    (component, components, normalized): (Component, usize, bool),
) {
    let size = component.size();
    if component == Component::F32 && stride == size * components {
        let target: &mut [u8] = bytemuck::cast_slice_mut(floats);
        let length = target.len();
        target.copy_from_slice(&bytes[..length]);
        return;
    }
    for (element, row) in floats.chunks_exact_mut(components).zip(bytes.chunks(stride)) {
        for (float, cell) in element.iter_mut().zip(row.chunks_exact(size)) {
            *float = component.decode(cell, normalized);
        }
    }
}
