//! Every finding that there is: its stable code, how much it matters, what it means and what to do.

/// How much a finding matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Motion cannot come out right before it is mended.
    Error,
    /// Motion may come out wrong, or something is lost.
    Warning,
    /// Good to know; nothing has to be done.
    Note,
}

impl Severity {
    /// All of them, the worst first.
    pub const ALL: [Self; 3] = [Self::Error, Self::Warning, Self::Note];

    /// The name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
        }
    }
}

macro_rules! findings {
    ($( $variant:ident = $name:literal, $severity:ident, $about:literal, $fix:literal; )+) => {
        /// The findings. A code never changes its meaning.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum FindingCode { $( #[doc = $about] $variant, )+ }

        impl FindingCode {
            /// All of them, in the order of the documentation.
            pub const ALL: &'static [Self] = &[$( Self::$variant, )+];

            /// The code on the wire.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $( Self::$variant => $name, )+ }
            }

            /// How much it matters.
            #[must_use]
            pub const fn severity(self) -> Severity {
                match self { $( Self::$variant => Severity::$severity, )+ }
            }

            /// What it means.
            #[must_use]
            pub const fn about(self) -> &'static str {
                match self { $( Self::$variant => $about, )+ }
            }

            /// What to do about it.
            #[must_use]
            pub const fn fix(self) -> &'static str {
                match self { $( Self::$variant => $fix, )+ }
            }
        }
    };
}

findings! {
    ScaleAboveSkeleton = "scale_above_skeleton", Note,
        "A node above the joints scales the whole skeleton, as exports from Blender and Mixamo do.",
        "Nothing: it is taken into account. To be rid of it, apply the scale of the armature before exporting.";
    NonUniformScale = "non_uniform_scale", Warning,
        "A joint is scaled differently along its axes, so that turning what hangs below it distorts it.",
        "Apply the scale in the program that made the rig, and bind the mesh again.";
    ScaledJoint = "scaled_joint", Note,
        "A joint of the skeleton itself is scaled at rest; what hangs below it is scaled along.",
        "Nothing, where it is meant (a child made from an adult's rig); else apply the scale and bind again.";
    NegativeScale = "negative_scale", Warning,
        "A joint or a node above it is mirrored by a negative scale.",
        "Mirror the rig with a tool for rigs instead, or apply the scale, and recompute the normals of the mesh.";
    ZeroScale = "zero_scale", Error,
        "A joint is scaled to nothing, so everything below it lies in one point or plane.",
        "Give it a scale; hide meshes by other means.";
    Shear = "shear", Warning,
        "A scale that differs by axis lies above turned joints, or a node's matrix shears. No rotation and scale can say that.",
        "Apply the scales of the armature and its joints before exporting.";
    JointNamesMissing = "joint_names_missing", Warning,
        "Joints have no names, so nothing can be recognized by name and configs must say `#<node index>`.",
        "Export with names. Without, check the roles below and give wrong ones in `roles`.";
    JointNamesRepeated = "joint_names_repeated", Warning,
        "Several joints have one name; configs, rest uploads and pose arrays cannot tell them apart by it.",
        "Rename them. Until then configs call them `#<node index>`.";
    SidesSwapped = "sides_swapped", Warning,
        "Joints named left lie on the right of a body whose feet point forward.",
        "Where they lie counts. Where the names are right, give `roles`; else rename the joints.";
    NoSkin = "no_skin", Note,
        "No mesh is bound to the joints; there is only a skeleton.",
        "Nothing, for a source of motion. A character that is to be seen needs its skinned mesh.";
    SeveralSkins = "several_skins", Note,
        "Several skins share the skeleton, each with joints of its own (body, clothes, hair).",
        "Nothing: all of them are animated together.";
    RoleUnskinned = "role_unskinned", Warning,
        "A joint of the body moves nothing of the mesh, although the file has skins.",
        "Bind the mesh to it, or give the joint that does move the mesh in `roles`.";
    MeshOffJoints = "mesh_off_joints", Warning,
        "The mesh of the body lies away from the joints that move it, so any rotation carries it off.",
        "Bind the mesh again where its joints are; often an object above the skeleton or the mesh was moved after binding.";
    JointsUnskinned = "joints_unskinned", Note,
        "Whole trees of joints are bound to no mesh: controls, helpers, sockets or a second skeleton.",
        "Nothing; leave them out when exporting to make the file smaller.";
    InverseBindsMissing = "inverse_binds_missing", Warning,
        "A skin has no inverse bind matrices, so the file does not say in which pose the mesh was bound.",
        "Export with inverse bind matrices. The node pose counts as the rest pose.";
    InverseBindsIdentity = "inverse_binds_identity", Warning,
        "All inverse bind matrices of a skin are the identity although its joints are in different places.",
        "Bind the mesh again; a viewer shows this mesh exploded. The node pose counts as the rest pose.";
    BindPoseDiffers = "bind_pose_differs", Note,
        "The mesh was bound in another pose than the nodes are in. The bind pose is measured from.",
        "Nothing, where the bind pose is the T or A pose; else set `rest` to `nodes`.";
    BindPoseIgnored = "bind_pose_ignored", Warning,
        "The bind pose has other bone lengths than the nodes, so it cannot be of this skeleton. The node pose is measured from.",
        "Bind the mesh to the skeleton as it is, or send a T pose as the rest file.";
    TooManyInfluences = "too_many_influences", Note,
        "Vertices may be bound to more than four joints; many engines keep only the four strongest.",
        "Limit the influences to four when exporting for a game engine.";
    NoBody = "no_body", Warning,
        "The joints make up no body that is known: neither a biped, nor a quadruped, nor a creature on more legs.",
        "Give `roles` or `chains` in the config, or teach the rig with `PUT /v1/rigs/{name}`.";
    SeveralBodies = "several_bodies", Warning,
        "The file holds more than one body. The largest is looked at and retargeted.",
        "Export one character per file.";
    SizeImplausible = "size_implausible", Warning,
        "The figure is far smaller or larger than a person, going by the unit of its file.",
        "Export in the right unit, or set `unit`. Motion is scaled to the character either way.";
    UnitUnknown = "unit_unknown", Note,
        "The format does not say its unit; it was taken from the size of the figure.",
        "Set `unit` in the config where the guess is wrong.";
    FeetOffFloor = "feet_off_floor", Note,
        "At rest the feet are well above or below the floor of the file.",
        "Nothing: the floor is taken to be under the feet. Set `ground` where that is wrong.";
    RestPoseUnclear = "rest_pose_unclear", Warning,
        "The rest pose is neither a T, nor an A, nor one with the arms down; what is measured from it may be bent.",
        "Send a T pose as the rest file, or name a clip and frame in `rest`.";
    LimbDisconnected = "limb_disconnected", Warning,
        "A part of a limb does not hang from the part before it, so it does not follow it by itself.",
        "Nothing, where the animation moves each part; else parent the joints to one another.";
    LimbIncomplete = "limb_incomplete", Error,
        "A segment of a limb is missing while the one after it is there, so the limb cannot bend where it should.",
        "Give the joint in `roles` where it is there under another name; else add it to the rig.";
    LimbCutOff = "limb_cut_off", Warning,
        "A limb ends too early, or is there on one side only.",
        "Nothing, where it is meant; else give its joints in `roles`, or add them to the rig.";
    LimbOnLimb = "limb_on_limb", Error,
        "A leg hangs from an arm, or an arm from a leg.",
        "Parent it to the trunk, or give the right joints in `roles`.";
    BoneWithoutLength = "bone_without_length", Error,
        "Two joints of a limb lie in one place, so the bone between them has no direction.",
        "Move the joints apart, or give the joint that does end the bone in `roles`.";
    BoneImplausible = "bone_implausible", Warning,
        "A bone of a limb is many times as long as the one before it: a joint is named for a place where it is not.",
        "Give the right joint in `roles`, or move the joint.";
    NameMisleads = "name_misleads", Warning,
        "Joints of a limb are called after other parts than those that they are by their shape and place.",
        "Look at the roles, and rename the joints; where the names are right, give them in `roles`.";
    KneeBackwards = "knee_bends_backwards", Warning,
        "A knee is bent the wrong way at rest; solvers for legs take their direction from it.",
        "Bend the knee slightly forward in the rest pose.";
    ElbowBackwards = "elbow_bends_backwards", Warning,
        "An elbow is bent the wrong way at rest.",
        "Bend the elbow slightly in the rest pose, so that the forearm leans forward.";
    LimbsUneven = "limbs_uneven", Note,
        "A limb is longer on one side than on the other.",
        "Nothing, where it is meant; else mirror one side of the rig.";
    NoAnimation = "no_animation", Note,
        "The file has no clip.",
        "Nothing, for a target. A source needs one.";
    ClipStill = "clip_still", Note,
        "A clip has keys, but nothing moves in it.",
        "Nothing, where it is a pose; else check what was baked when exporting.";
    ClipOneFrame = "clip_one_frame", Note,
        "A clip has one frame only: a pose.",
        "Nothing; it can serve as the rest pose, as `rest: {clip, frame}`.";
    ClipStartsLate = "clip_starts_late", Note,
        "The first key of a clip is well after its beginning.",
        "Nothing: the result begins at the first key.";
    TracksConstant = "tracks_constant", Note,
        "Most tracks of a clip hold one value from beginning to end.",
        "Nothing; optimizing the animation when exporting makes the file smaller.";
    ScaleAnimated = "scale_animated", Note,
        "A clip changes the scale of joints. Scale is not retargeted.",
        "Bake squash and stretch into other channels, or into morph targets, where it matters.";
    BonesStretch = "bones_stretch", Note,
        "A clip changes the length of bones below the pelvis. Bones of the target keep their length.",
        "Nothing, where it is noise of a capture; set `translation` of the chain where it is meant.";
}
