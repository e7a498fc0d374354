//! The materials of an FBX target: colors, and the textures on them with the images that the file itself holds.
//!
//! All are written as the plain material that every reader of FBX knows. Of a material that is made otherwise, what has a place in that
//! one goes there: base color, normals, glow.

use std::collections::{BTreeMap, BTreeSet};

use crate::model::Reporter;

use super::{
    binary::{Property, Record},
    records::{connection, connection_to_property, object, property},
};

/// Ids of materials and of what lies on them count from here, above those of meshes.
const FIRST_ID: i64 = 1 << 51;
/// How a texture lies on its material; handed on as it stands.
const PLACEMENT: [&str; 5] = ["Translation", "Rotation", "Scaling", "TextureRotationPivot", "TextureScalingPivot"];

/// Materials that meshes share, each written once.
#[derive(Default)]
pub(super) struct Materials {
    pub(super) objects: Vec<Record>,
    pub(super) connections: Vec<Record>,
    /// Textures that have no place in a plain material, or were put together from others.
    left_out: BTreeSet<String>,
    /// How many objects there are of each kind, for the definitions.
    pub(super) materials: i32,
    pub(super) textures: i32,
    pub(super) videos: i32,
    /// Ids by the parser's numbers of what has been written.
    ids: BTreeMap<u32, i64>,
    next_id: i64,
}

impl Materials {
    /// The id of a material.
    pub(super) fn id_of(&mut self, material: &ufbx::Material) -> i64 {
        if let Some(id) = self.ids.get(&material.element.element_id) {
            return *id;
        }
        let id = self.new_id(&material.element);
        self.materials += 1;
        let rows = values(&material.fbx);
        self.objects.push(
            object("Material", id, &material.element.name, "")
                .field("Version", 102)
                .field("ShadingModel", "phong")
                .field("MultiLayer", 0)
                .holding([Record::new("Properties70").holding(rows)]),
        );
        let mut placed = BTreeSet::new();
        for (name, maps) in slots(material) {
            let Some(texture) = maps.iter().find_map(|map| map.texture.as_ref()) else { continue };
            placed.insert(texture.element.element_id);
            if let Some(texture_id) = self.texture(texture) {
                self.connections.push(connection_to_property(texture_id, id, name));
            }
        }
        let others = material.textures.iter().filter(|other| !placed.contains(&other.texture.element.element_id));
        self.left_out.extend(others.map(|other| other.texture.element.name.to_string()));
        id
    }

    /// The id of a texture; of several that are put together, the first. Nothing where there is no image.
    fn texture(&mut self, texture: &ufbx::Texture) -> Option<i64> {
        let file = if texture.type_ == ufbx::TextureType::File {
            texture
        } else {
            self.left_out.insert(texture.element.name.to_string());
            texture.file_textures.iter().next()?
        };
        if let Some(id) = self.ids.get(&file.element.element_id) {
            return Some(*id);
        }
        let id = self.new_id(&file.element);
        self.textures += 1;
        let (name, media) = (&*file.element.name, file.video.as_ref().map_or("", |video| &video.element.name));
        let wrap = |mode: ufbx::WrapMode| i32::from(mode == ufbx::WrapMode::Clamp);
        let placement = PLACEMENT.into_iter().filter_map(|name| {
            let value = &ufbx::find_prop(&file.element.props, name)?.value_vec4;
            Some(property(name, "Vector", "", "A", [value.x, value.y, value.z].map(Property::from)))
        });
        let rows = [
            property("UVSet", "KString", "", "", [(&*file.uv_set).into()]),
            property("WrapModeU", "enum", "", "", [wrap(file.wrap_u).into()]),
            property("WrapModeV", "enum", "", "", [wrap(file.wrap_v).into()]),
            property("UseMaterial", "bool", "", "", [1.into()]),
        ];
        self.objects.push(
            object("Texture", id, name, "")
                .field("Type", "TextureVideoClip")
                .field("Version", 202)
                .field("TextureName", format!("{name}\0\u{1}Texture"))
                .field("Media", format!("{media}\0\u{1}Video"))
                .field("FileName", &*file.absolute_filename)
                .field("RelativeFilename", &*file.relative_filename)
                .holding([Record::new("Properties70").holding(rows.into_iter().chain(placement))]),
        );
        let video = self.video(file);
        self.connections.push(connection(video, id));
        Some(id)
    }

    /// The id of what says where the image of a texture is, and holds it where the file does.
    fn video(&mut self, texture: &ufbx::Texture) -> i64 {
        let element = texture.video.as_ref().map_or(&texture.element, |video| &video.element);
        if let Some(id) = texture.video.as_ref().and_then(|video| self.ids.get(&video.element.element_id)) {
            return *id;
        }
        let id = self.new_id(element);
        self.videos += 1;
        let path = property("Path", "KString", "XRefUrl", "", [(&*texture.absolute_filename).into()]);
        let record = object("Video", id, &element.name, "Clip")
            .field("Type", "Clip")
            .holding([Record::new("Properties70").holding([path])])
            .field("UseMipMap", 0)
            .field("Filename", &*texture.absolute_filename)
            .field("RelativeFilename", &*texture.relative_filename);
        let has_content = texture.content.size > 0;
        let content = has_content.then(|| Record::new("Content").with(Property::Bytes(texture.content.to_vec())));
        self.objects.push(record.holding(content));
        id
    }

    /// Says which textures are not what they were.
    pub(super) fn report(&self, reporter: &mut Reporter) {
        const MAX: usize = 12;
        if self.left_out.is_empty() {
            return;
        }
        let names: Vec<&str> = self.left_out.iter().take(MAX).map(String::as_str).collect();
        let more = if self.left_out.len() > MAX { ", and others" } else { "" };
        reporter.warn(
            "fbx_textures_left_out",
            "Objects",
            format!(
                "{} textures have no place in a plain material, or were put together from several: {}{more}",
                self.left_out.len(),
                names.join(", ")
            ),
            "assign them by the names of the materials",
        );
    }

    fn new_id(&mut self, element: &ufbx::Element) -> i64 {
        let id = FIRST_ID + self.next_id;
        self.next_id += 1;
        self.ids.insert(element.element_id, id);
        id
    }
}

/// Colors and numbers of a plain material.
fn values(maps: &ufbx::MaterialFbxMaps) -> impl Iterator<Item = Record> {
    let color = |name: &str, map: &ufbx::MaterialMap| {
        let color = [map.value_vec4.x, map.value_vec4.y, map.value_vec4.z];
        map.has_value.then(|| property(name, "Color", "", "A", color.map(Property::from)))
    };
    let number = |name: &str, map: &ufbx::MaterialMap| {
        map.has_value.then(|| property(name, "Number", "", "A", [map.value_vec4.x.into()]))
    };
    [
        color("DiffuseColor", &maps.diffuse_color),
        number("DiffuseFactor", &maps.diffuse_factor),
        color("SpecularColor", &maps.specular_color),
        number("SpecularFactor", &maps.specular_factor),
        number("ShininessExponent", &maps.specular_exponent),
        color("EmissiveColor", &maps.emission_color),
        number("EmissiveFactor", &maps.emission_factor),
        color("TransparentColor", &maps.transparency_color),
        number("TransparencyFactor", &maps.transparency_factor),
    ]
    .into_iter()
    .flatten()
}

/// The properties of a plain material that take textures, and where those are, the plain ones first.
fn slots(material: &ufbx::Material) -> [(&'static str, [&ufbx::MaterialMap; 2]); 14] {
    let (plain, other) = (&material.fbx, &material.pbr);
    let one = |name, map| (name, [map; 2]);
    [
        ("DiffuseColor", [&plain.diffuse_color, &other.base_color]),
        one("DiffuseFactor", &plain.diffuse_factor),
        one("SpecularColor", &plain.specular_color),
        one("SpecularFactor", &plain.specular_factor),
        one("ShininessExponent", &plain.specular_exponent),
        ("EmissiveColor", [&plain.emission_color, &other.emission_color]),
        one("EmissiveFactor", &plain.emission_factor),
        one("AmbientColor", &plain.ambient_color),
        one("TransparentColor", &plain.transparency_color),
        one("TransparencyFactor", &plain.transparency_factor),
        one("ReflectionColor", &plain.reflection_color),
        ("NormalMap", [&plain.normal_map, &other.normal_map]),
        one("Bump", &plain.bump),
        one("DisplacementColor", &plain.displacement),
    ]
}
