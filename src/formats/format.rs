//! The formats, and the facts about them that users see.

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Format {
    /// Binary glTF 2.0.
    Glb,
    /// glTF 2.0 as JSON, buffers embedded as data URIs.
    Gltf,
    /// VRM 0.x or 1.0: a GLB with a humanoid map.
    Vrm,
    /// VRM animation: a GLB with a humanoid map and one clip.
    Vrma,
    /// Autodesk FBX, binary or text.
    Fbx,
    /// Biovision hierarchy.
    Bvh,
    /// Pose arrays in a NumPy archive.
    PosesNpz,
    /// Pose arrays in JSON.
    PosesJson,
    /// Parameters of a body model in a NumPy archive.
    BodyModel,
    /// Joint positions or features in one NumPy array.
    JointPositions,
    /// A zip archive with one model and the files that it points to.
    Zip,
    /// Positions of joints as comma-separated text.
    PositionsCsv,
    /// A still picture.
    Png,
    /// A picture; moves unless a still is asked for.
    Webp,
    /// A moving picture of 255 colors.
    Gif,
    /// A moving picture without loss.
    Apng,
    /// A video of the result, where the crate is built with the feature `mp4`; `mp4`.
    Mp4,
    /// A zip archive with a drawn character: its joints, its texture and its mask.
    Drawing,
    /// Each frame of a moving drawing as a PNG, in a zip archive.
    PngZip,
    /// What a moving drawing's joints do, in a NumPy archive.
    Poses2dNpz,
    /// What a moving drawing's joints do, in JSON.
    Poses2dJson,
}

/// What users are told about a format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FormatInfo {
    /// The name on the wire.
    pub name: &'static str,
    /// File endings without the dot; the first is the one that is written.
    pub endings: &'static [&'static str],
    /// The media type.
    pub media_type: &'static str,
    /// Whether it can be read.
    pub reads: bool,
    /// Whether it can be written.
    pub writes: bool,
    /// One line.
    pub description: &'static str,
    /// Which axes and unit a written file has.
    pub space: Space,
    /// Whether a written file holds a glTF document, with all that a target's has.
    pub has_document: bool,
    /// Whether a file can say which mesh hangs on which joints.
    pub has_skins: bool,
    /// Whether a file's joints are the nodes that a skin names, and not those that it calls joints.
    pub joints_are_skinned: bool,
    /// Whether a written file holds custom properties that change.
    pub has_properties: bool,
    /// Whether a written file's animation can be compressed.
    pub has_compression: bool,
    /// The feature of the crate that it takes to write it, where it takes one.
    pub feature: Option<&'static str>,
    /// Whether it is a picture of the result, and not the result itself.
    pub is_picture: bool,
    /// Whether it is written of moving drawings only.
    pub is_drawn: bool,
}

/// Axes and unit of a written file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// +Y up, +Z front, meters.
    Canonical,
    /// Those of the target.
    OfTarget,
    /// Those of the target where its file says which they are, else [`Space::Canonical`].
    SaidByTarget,
}

/// What most formats have in common.
const PLAIN: FormatInfo = FormatInfo {
    name: "",
    endings: &[],
    media_type: "application/octet-stream",
    reads: true,
    writes: true,
    description: "",
    space: Space::Canonical,
    has_document: false,
    has_skins: false,
    joints_are_skinned: false,
    has_properties: false,
    has_compression: false,
    feature: None,
    is_picture: false,
    is_drawn: false,
};

/// What pictures have in common.
const PICTURE: FormatInfo = FormatInfo { reads: false, is_picture: true, ..PLAIN };

/// What formats of moving drawings have in common.
const DRAWN: FormatInfo = FormatInfo { reads: false, is_drawn: true, ..PLAIN };

/// What glTF formats have in common.
const GLTF_BASE: FormatInfo = FormatInfo {
    media_type: "model/gltf-binary",
    has_document: true,
    has_skins: true,
    joints_are_skinned: true,
    has_properties: true,
    has_compression: true,
    ..PLAIN
};

const GLB: FormatInfo = FormatInfo { name: "glb", endings: &["glb"], description: "binary glTF 2.0", ..GLTF_BASE };

const GLTF: FormatInfo = FormatInfo {
    name: "gltf",
    endings: &["gltf"],
    media_type: "model/gltf+json",
    description: "glTF 2.0 as JSON with embedded buffers",
    ..GLTF_BASE
};

const VRM: FormatInfo = FormatInfo {
    name: "vrm",
    endings: &["vrm"],
    description: "VRM 0.x or 1.0 avatar; written as a GLB that keeps the VRM extension",
    ..GLTF_BASE
};

const VRMA: FormatInfo = FormatInfo {
    name: "vrma",
    endings: &["vrma"],
    media_type: "model/gltf-binary",
    description: "VRM animation: the motion of a humanoid, its expressions and its gaze, for any VRM",
    joints_are_skinned: true,
    has_compression: true,
    ..PLAIN
};

const FBX: FormatInfo = FormatInfo {
    name: "fbx",
    endings: &["fbx"],
    description: "Autodesk FBX, binary or text; written binary: the skeleton, its animation, and the meshes of an FBX target",
    has_skins: true,
    ..PLAIN
};

const BVH: FormatInfo = FormatInfo {
    name: "bvh",
    endings: &["bvh"],
    media_type: "text/plain",
    description: "Biovision hierarchy",
    space: Space::OfTarget,
    ..PLAIN
};

const POSES_NPZ: FormatInfo = FormatInfo {
    name: "poses_npz",
    endings: &["npz"],
    media_type: "application/x-npz",
    description: "pose arrays in a NumPy archive",
    space: Space::SaidByTarget,
    has_properties: true,
    ..PLAIN
};

const POSES_JSON: FormatInfo = FormatInfo {
    name: "poses_json",
    endings: &["json"],
    media_type: "application/json",
    description: "pose arrays in JSON",
    space: Space::SaidByTarget,
    has_properties: true,
    ..PLAIN
};

const BODY_MODEL: FormatInfo = FormatInfo {
    name: "body_model",
    endings: &["npz"],
    media_type: "application/x-npz",
    writes: false,
    description: "SMPL, SMPL+H or SMPL-X parameters as AMASS and AIST++ keep them; read on the mean body",
    ..PLAIN
};

const JOINT_POSITIONS: FormatInfo = FormatInfo {
    name: "joint_positions",
    endings: &["npy"],
    media_type: "application/x-npy",
    writes: false,
    description: "positions of SMPL's 22 or 24 joints, or HumanML3D features",
    ..PLAIN
};

const ZIP: FormatInfo = FormatInfo {
    name: "zip",
    endings: &["zip"],
    media_type: "application/zip",
    description: "one model of the formats above with the buffers and images that it points to; written as glTF with its \
                  buffer in a file of its own",
    has_skins: false,
    joints_are_skinned: false,
    ..GLTF_BASE
};

const POSITIONS_CSV: FormatInfo = FormatInfo {
    name: "positions_csv",
    endings: &["csv"],
    media_type: "text/csv",
    reads: false,
    description: "where every joint is in every frame, as comma-separated text in meters, +Y up and +Z front",
    ..PLAIN
};

const PNG: FormatInfo = FormatInfo {
    name: "png",
    endings: &["png"],
    media_type: "image/png",
    description: "a still picture of the result, or a sheet of several frames",
    ..PICTURE
};

const WEBP: FormatInfo = FormatInfo {
    name: "webp",
    endings: &["webp"],
    media_type: "image/webp",
    description: "a moving picture of the result; a still without loss where the view asks for one",
    ..PICTURE
};

const GIF: FormatInfo = FormatInfo {
    name: "gif",
    endings: &["gif"],
    media_type: "image/gif",
    description: "a moving picture of the result in 255 colors",
    ..PICTURE
};

const APNG: FormatInfo = FormatInfo {
    name: "apng",
    endings: &["apng"],
    media_type: "image/apng",
    description: "a moving picture of the result as PNG, without loss",
    ..PICTURE
};

const MP4: FormatInfo = FormatInfo {
    name: "mp4",
    endings: &["mp4"],
    media_type: "video/mp4",
    writes: cfg!(feature = "mp4"),
    feature: Some("mp4"),
    description: "a video of the result (H.264), without opacity; where the service is built with the feature mp4",
    ..PICTURE
};

impl FormatInfo {
    /// Why it cannot be written, for people; to be asked where it cannot.
    #[must_use]
    pub fn why_unwritten(&self) -> String {
        self.feature.map_or_else(
            || format!("{} files can be read but not written", self.name),
            |feature| format!("{} is not written by this build, which is without the feature '{feature}'", self.name),
        )
    }
}

const DRAWING: FormatInfo = FormatInfo {
    name: "drawing",
    endings: &["zip"],
    media_type: "application/zip",
    writes: false,
    description: "a drawn character as a target: char_cfg.yaml, texture.png and mask.png in a zip archive, or a picture alone (PNG, JPEG, WebP), whose mask and joints are found",
    ..PLAIN
};

const PNG_ZIP: FormatInfo = FormatInfo {
    name: "png_zip",
    endings: &["zip"],
    media_type: "application/zip",
    description: "of a moving drawing each frame as a PNG",
    ..DRAWN
};

const POSES2D_NPZ: FormatInfo = FormatInfo {
    name: "poses2d_npz",
    endings: &["npz"],
    media_type: "application/x-npz",
    description: "of a moving drawing its joints and angles, in a NumPy archive",
    ..DRAWN
};

const POSES2D_JSON: FormatInfo = FormatInfo {
    name: "poses2d_json",
    endings: &["json"],
    media_type: "application/json",
    description: "of a moving drawing its joints and angles, in JSON",
    ..DRAWN
};

impl Format {
    /// All formats.
    pub const ALL: [Self; 21] = [
        Self::Glb,
        Self::Gltf,
        Self::Vrm,
        Self::Vrma,
        Self::Fbx,
        Self::Bvh,
        Self::PosesNpz,
        Self::PosesJson,
        Self::BodyModel,
        Self::JointPositions,
        Self::Zip,
        Self::PositionsCsv,
        Self::Png,
        Self::Webp,
        Self::Gif,
        Self::Apng,
        Self::Mp4,
        Self::Drawing,
        Self::PngZip,
        Self::Poses2dNpz,
        Self::Poses2dJson,
    ];

    /// The facts about a format; the only place where they stand.
    #[must_use]
    pub const fn info(self) -> FormatInfo {
        match self {
            Self::Glb => GLB,
            Self::Gltf => GLTF,
            Self::Vrm => VRM,
            Self::Vrma => VRMA,
            Self::Fbx => FBX,
            Self::Bvh => BVH,
            Self::PosesNpz => POSES_NPZ,
            Self::PosesJson => POSES_JSON,
            Self::BodyModel => BODY_MODEL,
            Self::JointPositions => JOINT_POSITIONS,
            Self::Zip => ZIP,
            Self::PositionsCsv => POSITIONS_CSV,
            Self::Png => PNG,
            Self::Webp => WEBP,
            Self::Gif => GIF,
            Self::Apng => APNG,
            Self::Mp4 => MP4,
            Self::Drawing => DRAWING,
            Self::PngZip => PNG_ZIP,
            Self::Poses2dNpz => POSES2D_NPZ,
            Self::Poses2dJson => POSES2D_JSON,
        }
    }

    /// Whether a written file holds a glTF document, with all that a target's has.
    #[must_use]
    pub const fn holds_gltf(self) -> bool {
        self.info().has_document
    }

    /// The format in which a moving drawing is written where this one is asked for by its ending or its media type; nothing where a
    /// drawing is not written so.
    #[must_use]
    pub const fn of_drawing(self) -> Option<Self> {
        match self {
            Self::Glb | Self::Webp | Self::Gif | Self::Apng | Self::Mp4 => Some(self),
            Self::Png => Some(Self::Apng),
            Self::Zip | Self::Drawing | Self::PngZip => Some(Self::PngZip),
            Self::PosesNpz | Self::BodyModel | Self::Poses2dNpz => Some(Self::Poses2dNpz),
            Self::PosesJson | Self::Poses2dJson => Some(Self::Poses2dJson),
            Self::Gltf | Self::Vrm | Self::Vrma | Self::Fbx | Self::Bvh | Self::JointPositions | Self::PositionsCsv => {
                None
            }
        }
    }

    /// The format of that wire name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.info().name == name)
    }

    /// The format that a file's ending stands for; letters of either case.
    #[must_use]
    pub fn from_file_name(file_name: &str) -> Option<Self> {
        let (_, ending) = file_name.rsplit_once('.')?;
        let ending = ending.to_ascii_lowercase();
        Self::ALL.into_iter().find(|format| format.info().endings.contains(&ending.as_str()))
    }
}
