//! A drawing that is ready to be seen: its texture on a mesh, its mesh in parts.

use glam::DVec2;

use crate::picture::Picture;

use super::{
    Arap, ArapWorkspace, CharacterSpec, DrawingError, Performance, PlanarRig, Precision, RetargetSpec, ViewSection,
    fill::{self, Corner},
    lattice::Lattice,
    parts,
    viewpoint::Viewpoint,
};

/// Gray of a mask from which on a pixel is the figure's.
const FIGURE_FROM: u8 = 128;

/// A drawing with texture, mesh and parts.
#[derive(Clone, Debug)]
pub struct Puppet {
    /// The texture; what the mask leaves out has no opacity.
    texture: Picture,
    /// For each vertex its place on the texture, in pixels.
    texels: Vec<DVec2>,
    arap: Arap,
    /// For each body part group and each of its joints the triangles.
    parts: Vec<Vec<Vec<[usize; 3]>>>,
    viewpoint: Viewpoint,
}

/// What [`Puppet::draw`] works in.
#[derive(Clone, Debug)]
pub struct PuppetWorkspace {
    arap: ArapWorkspace,
    deformed: Vec<DVec2>,
    seen: Vec<Option<DVec2>>,
}

impl Puppet {
    /// Puts a drawing together.
    ///
    /// # Errors
    ///
    /// Where sizes do not fit, the mask is empty, or a joint is unknown.
    pub fn new(
        spec: &CharacterSpec,
        rig: &PlanarRig,
        retarget: &RetargetSpec,
        view: &ViewSection,
        [mut texture, mask]: [Picture; 2],
    ) -> Result<Self, DrawingError> {
        for (name, picture) in [("texture.png", &texture), ("mask.png", &mask)] {
            if [picture.width, picture.height] != [spec.width as usize, spec.height as usize] {
                let detail = format!("{name} has {} by {} pixels", picture.width, picture.height);
                let fix = format!("the config says {} by {}", spec.width, spec.height);
                return Err(DrawingError::new("width, height", detail, fix));
            }
        }
        let is_figure = |pixel: [u8; 4]| pixel[0] >= FIGURE_FROM && pixel[3] > 0;
        for (pixel, &mask) in texture.pixels.iter_mut().zip(&mask.pixels) {
            if !is_figure(mask) {
                pixel[3] = 0;
            }
        }
        let mesh = Lattice::new(&mask, is_figure);
        let arap = Arap::new(&mesh.vertices, &mesh.triangles, &rig.rest, Precision::Double)?;
        let of_joints = parts::triangles_of_joints(rig, &mesh);
        let mut parts = Vec::new();
        for (index, group) in retarget.char_bodypart_groups.iter().enumerate() {
            let mut part = Vec::new();
            for name in &group.char_joints {
                let place = || format!("char_bodypart_groups[{index}].char_joints");
                let joint =
                    rig.joint(name).ok_or_else(|| DrawingError::unknown_name(place(), name, &rig.joint_names))?;
                part.push(of_joints[joint].clone());
            }
            parts.push(part);
        }
        let side = f64::from(spec.padded_side());
        let texel = |vertex: &DVec2| DVec2::new(vertex.x * side, f64::from(spec.height) - vertex.y * side);
        let texels = mesh.vertices.iter().map(texel).collect();
        Ok(Self { texture, texels, arap, parts, viewpoint: Viewpoint::new(view) })
    }

    /// Memory for [`Self::draw`].
    #[must_use]
    pub fn workspace(&self) -> PuppetWorkspace {
        let count = self.texels.len();
        PuppetWorkspace { arap: self.arap.workspace(), deformed: vec![DVec2::ZERO; count], seen: vec![None; count] }
    }

    /// Draws the puppet as it is at a frame over what is there. After its last frame it holds still.
    pub fn draw(
        &self,
        performance: &Performance,
        frame: usize,
        workspace: &mut PuppetWorkspace,
        picture: &mut Picture,
    ) {
        let frame = frame.min(performance.frames - 1);
        let (joints, root) = performance.joints_about_root(frame);
        self.arap.deform(&joints, &mut workspace.arap, &mut workspace.deformed);
        for (seen, &vertex) in workspace.seen.iter_mut().zip(&workspace.deformed) {
            *seen = self.viewpoint.seen((vertex + root).extend(performance.start[2]));
        }
        let groups = self.parts.len();
        for &group in &performance.order[frame * groups..(frame + 1) * groups] {
            let part = &self.parts[group];
            let is_near = performance.group_depths[frame * groups + group] > 0.0;
            for index in 0..part.len() {
                let joint = if is_near { index } else { part.len() - 1 - index };
                for &triangle in &part[joint] {
                    self.draw_triangle(triangle, &workspace.seen, picture);
                }
            }
        }
    }

    fn draw_triangle(&self, triangle: [usize; 3], seen: &[Option<DVec2>], picture: &mut Picture) {
        let corner = |vertex: usize| Some(Corner { seen: seen[vertex]?, texel: self.texels[vertex] });
        if let [Some(one), Some(two), Some(three)] = triangle.map(corner) {
            fill::triangle(picture, &self.texture, [one, two, three]);
        }
    }
}
