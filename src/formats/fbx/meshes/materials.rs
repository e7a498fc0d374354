//! Materials as plain ones of metal and roughness, and the images that the file itself holds.
//!
//! Colors count as linear, as Blender takes them. A texture stands for the color that it lies on. A material that shows nothing is
//! taken for one that shows everything, as exporters fill transparency in both ways.

use std::collections::BTreeMap;

use crate::formats::meshes::{Image, Material, Texture};

use super::lost::Lost;

/// Where nothing says how rough it is.
const USUAL_ROUGHNESS: f64 = 0.8;

/// Materials that meshes share, each there once.
#[derive(Default)]
pub(super) struct Materials<'a> {
    materials: Vec<Material<'a>>,
    images: Vec<Image<'a>>,
    /// By the parser's numbers, and the sets of coordinates of the mesh.
    indices: BTreeMap<(u32, Vec<String>), usize>,
    images_by_place: BTreeMap<usize, Option<usize>>,
    lost: Lost,
}

impl<'a> Materials<'a> {
    /// The place of a material in the list, for a mesh with these sets of coordinates.
    pub(super) fn index_of(&mut self, material: &'a ufbx::Material, uv_sets: &[&str]) -> usize {
        let key = (material.element.element_id, uv_sets.iter().map(|name| (*name).to_owned()).collect());
        if let Some(index) = self.indices.get(&key) {
            return *index;
        }
        let (plain, pbr) = (&material.fbx, &material.pbr);
        let (base_maps, glow_maps) =
            ([&pbr.base_color, &plain.diffuse_color], [&pbr.emission_color, &plain.emission_color]);
        let base_color_texture = self.texture(material, base_maps, uv_sets);
        let emissive_texture = self.texture(material, glow_maps, uv_sets);
        let normal_texture = self.texture(material, [&pbr.normal_map, &plain.normal_map], uv_sets);
        let opacity = number(&pbr.opacity, 1.0);
        let is_see_through = pbr.opacity.texture.is_some() || plain.transparency_color.texture.is_some();
        // White where an image is that is not in the file, for whoever puts it there again.
        let is_painted = base_maps.iter().any(|map| map.texture.is_some());
        let base = if is_painted { [1.0; 3] } else { color(&pbr.base_color, [0.8; 3]) };
        let [red, green, blue] = base.map(|value| value * number(&pbr.base_factor, 1.0));
        let emissive = if emissive_texture.is_some() { [1.0; 3] } else { color(&pbr.emission_color, [0.0; 3]) };
        let glow = number(&pbr.emission_factor, 1.0);
        let unit = |value: f64| value.clamp(0.0, 1.0);
        self.materials.push(Material {
            name: &material.element.name,
            base_color: [red, green, blue, if opacity > 0.0 { opacity } else { 1.0 }].map(unit),
            emissive: emissive.map(|value| unit(value * glow)),
            metallic: unit(number(&pbr.metalness, 0.0)),
            roughness: unit(number(&pbr.roughness, USUAL_ROUGHNESS)),
            is_cut_out: is_see_through && base_color_texture.is_some(),
            base_color_texture,
            emissive_texture,
            normal_texture,
        });
        self.indices.insert(key, self.materials.len() - 1);
        self.materials.len() - 1
    }

    fn texture(
        &mut self,
        material: &ufbx::Material,
        maps: [&'a ufbx::MaterialMap; 2],
        uv_sets: &[&str],
    ) -> Option<Texture> {
        let texture = maps.into_iter().filter(|map| map.texture_enabled).find_map(|map| map.texture.as_ref())?;
        let file = if texture.type_ == ufbx::TextureType::File {
            texture
        } else {
            self.lost.note("layers of textures (the first is there)", &material.element.name);
            texture.file_textures.iter().next()?
        };
        if file.has_uv_transform {
            self.lost.note("how textures are moved, turned and repeated", &material.element.name);
        }
        let image = self.image(file)?;
        let uv_set = uv_sets.iter().position(|name| **name == *file.uv_set).unwrap_or(0);
        let is_clamped = [file.wrap_u, file.wrap_v].map(|mode| mode == ufbx::WrapMode::Clamp);
        (!uv_sets.is_empty()).then_some(Texture { image, uv_set, is_clamped })
    }

    fn image(&mut self, texture: &'a ufbx::Texture) -> Option<usize> {
        let bytes: &[u8] = texture.content.as_ref();
        let place = bytes.as_ptr().addr();
        if let Some(image) = self.images_by_place.get(&place).filter(|_| !bytes.is_empty()) {
            return *image;
        }
        let paths = [&texture.relative_filename, &texture.absolute_filename, &texture.element.name];
        let path: &str = paths.into_iter().find(|path| !path.is_empty()).map_or("an image without a name", |path| path);
        let name = path.rsplit(['/', '\\']).next().unwrap_or(path);
        let media_type = match bytes {
            [0x89, b'P', b'N', b'G', ..] => Some("image/png"),
            [0xff, 0xd8, 0xff, ..] => Some("image/jpeg"),
            [] => {
                self.lost.note("images that are not in the file", name);
                None
            }
            _ => {
                self.lost.note("images that are neither PNG nor JPEG", name);
                None
            }
        };
        let image = media_type.map(|media_type| {
            self.images.push(Image { name, media_type, bytes });
            self.images.len() - 1
        });
        if !bytes.is_empty() {
            self.images_by_place.insert(place, image);
        }
        image
    }

    /// All that were asked for; what was lost goes to `lost`.
    pub(super) fn finish(self, lost: &mut Lost) -> (Vec<Material<'a>>, Vec<Image<'a>>) {
        lost.join(self.lost);
        (self.materials, self.images)
    }
}

fn number(map: &ufbx::MaterialMap, otherwise: f64) -> f64 {
    let value = map.value_vec4.x;
    if map.has_value && value.is_finite() { value } else { otherwise }
}

fn color(map: &ufbx::MaterialMap, otherwise: [f64; 3]) -> [f64; 3] {
    let value = [map.value_vec4.x, map.value_vec4.y, map.value_vec4.z];
    if map.has_value && value.iter().all(|part| part.is_finite()) { value } else { otherwise }
}
