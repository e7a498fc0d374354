//! The formats, and the facts about them that users see.

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
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
}

/// What users are told about a format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 12] = [
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
    ];

    /// The facts about a format; the only place where they stand.
    #[must_use]
    pub const fn info(self) -> FormatInfo {
        match self {
            Self::Glb => FormatInfo {
                name: "glb",
                endings: &["glb"],
                media_type: "model/gltf-binary",
                reads: true,
                writes: true,
                description: "binary glTF 2.0",
            },
            Self::Gltf => FormatInfo {
                name: "gltf",
                endings: &["gltf"],
                media_type: "model/gltf+json",
                reads: true,
                writes: true,
                description: "glTF 2.0 as JSON with embedded buffers",
            },
            Self::Vrm => FormatInfo {
                name: "vrm",
                endings: &["vrm"],
                media_type: "model/gltf-binary",
                reads: true,
                writes: true,
                description: "VRM 0.x or 1.0 avatar; written as a GLB that keeps the VRM extension",
            },
            Self::Vrma => FormatInfo {
                name: "vrma",
                endings: &["vrma"],
                media_type: "model/gltf-binary",
                reads: true,
                writes: true,
                description: "VRM animation: the motion of a humanoid, its expressions and its gaze, for any VRM",
            },
            Self::Fbx => FormatInfo {
                name: "fbx",
                endings: &["fbx"],
                media_type: "application/octet-stream",
                reads: true,
                writes: true,
                description: "Autodesk FBX, binary or text; written binary: the skeleton, its animation, and the meshes of an FBX target",
            },
            Self::Bvh => FormatInfo {
                name: "bvh",
                endings: &["bvh"],
                media_type: "text/plain",
                reads: true,
                writes: true,
                description: "Biovision hierarchy",
            },
            Self::PosesNpz => FormatInfo {
                name: "poses_npz",
                endings: &["npz"],
                media_type: "application/x-npz",
                reads: true,
                writes: true,
                description: "pose arrays in a NumPy archive",
            },
            Self::PosesJson => FormatInfo {
                name: "poses_json",
                endings: &["json"],
                media_type: "application/json",
                reads: true,
                writes: true,
                description: "pose arrays in JSON",
            },
            Self::BodyModel => FormatInfo {
                name: "body_model",
                endings: &["npz"],
                media_type: "application/x-npz",
                reads: true,
                writes: false,
                description: "SMPL, SMPL+H or SMPL-X parameters as AMASS and AIST++ keep them; read on the mean body",
            },
            Self::JointPositions => FormatInfo {
                name: "joint_positions",
                endings: &["npy"],
                media_type: "application/x-npy",
                reads: true,
                writes: false,
                description: "positions of SMPL's 22 or 24 joints, or HumanML3D features",
            },
            Self::Zip => FormatInfo {
                name: "zip",
                endings: &["zip"],
                media_type: "application/zip",
                reads: true,
                writes: true,
                description: "one model of the formats above with the buffers and images that it points to; written as glTF with its \
                              buffer in a file of its own",
            },
            Self::PositionsCsv => FormatInfo {
                name: "positions_csv",
                endings: &["csv"],
                media_type: "text/csv",
                reads: false,
                writes: true,
                description: "where every joint is in every frame, as comma-separated text in metres, +Y up and +Z front",
            },
        }
    }

    /// Whether a written file holds a glTF document, with all that a target's has.
    #[must_use]
    pub const fn holds_gltf(self) -> bool {
        matches!(self, Self::Glb | Self::Gltf | Self::Vrm | Self::Zip)
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
