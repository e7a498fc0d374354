//! The words that joints are named with, as data.
//!
//! Words only: how a name is cut into words is the business of [`super::names`], which joint of several gets a role that of
//! [`super::recognise`].

use super::Part;

/// What the words of a name can mean. Words that mean different things on different rigs keep a sense of their own here;
/// the hierarchy decides later.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Sense {
    Pelvis,
    Spine,
    Neck,
    Head,
    Jaw,
    Eye,
    Tail,
    Wing,
    Clavicle,
    /// A clavicle (Mixamo) or an upper arm (Xsens, SMPL).
    Shoulder,
    UpperArm,
    /// An upper arm, or all of the arm.
    Arm,
    Forearm,
    Wrist,
    Hand,
    Palm,
    /// With a side: a thigh (SMPL, Xsens), or a helper above it.
    Hip,
    Thigh,
    /// A shin (Mixamo), a thigh, or all of the leg.
    Leg,
    Shin,
    Ankle,
    Foot,
    Toe,
    /// A finger that is named.
    Finger(Part),
    /// A finger that is numbered at best.
    AnyFinger,
    /// A bone of the palm.
    Metacarpal,
    FrontLeg,
    HindLeg,
    /// Words that would match a general row below but are no part of the body that we know.
    Nothing,
}

impl Sense {
    /// What a joint is called that has that part in a body.
    pub(super) const fn of(part: Part) -> Option<Self> {
        Some(match part {
            Part::Root => return None,
            Part::Pelvis => Self::Pelvis,
            Part::Spine => Self::Spine,
            Part::Neck => Self::Neck,
            Part::Head => Self::Head,
            Part::Jaw => Self::Jaw,
            Part::Eye => Self::Eye,
            Part::Clavicle => Self::Clavicle,
            Part::UpperArm => Self::UpperArm,
            Part::Forearm => Self::Forearm,
            Part::Hand => Self::Hand,
            Part::Thigh => Self::Thigh,
            Part::Shin => Self::Shin,
            Part::Foot => Self::Foot,
            Part::Toe => Self::Toe,
            Part::Thumb | Part::Index | Part::Middle | Part::Ring | Part::Pinky => Self::Finger(part),
            Part::IndexMetacarpal | Part::MiddleMetacarpal | Part::RingMetacarpal | Part::PinkyMetacarpal => {
                Self::Metacarpal
            }
            Part::FrontLeg => Self::FrontLeg,
            Part::HindLeg => Self::HindLeg,
            Part::Leg => Self::Leg,
            Part::Tail => Self::Tail,
            Part::Wing => Self::Wing,
        })
    }
}

/// Words to their sense. A row matches when all its words are there; the first match counts, so rows with more to say
/// stand before general ones.
pub(super) const SENSES: &[(&[&str], Sense)] = &[
    (&["tail"], Sense::Tail),
    (&["wing"], Sense::Wing),
    (&["front", "leg"], Sense::FrontLeg),
    (&["front", "foot"], Sense::FrontLeg),
    (&["front", "paw"], Sense::FrontLeg),
    (&["foreleg"], Sense::FrontLeg),
    (&["hind", "leg"], Sense::HindLeg),
    (&["hind", "foot"], Sense::HindLeg),
    (&["hind", "paw"], Sense::HindLeg),
    (&["rear", "leg"], Sense::HindLeg),
    (&["rear", "foot"], Sense::HindLeg),
    (&["rear", "paw"], Sense::HindLeg),
    (&["back", "leg"], Sense::HindLeg),
    (&["back", "foot"], Sense::HindLeg),
    (&["upper", "jaw"], Sense::Nothing),
    (&["ring", "pinky"], Sense::Finger(Part::Pinky)),
    (&["foot", "thumb"], Sense::Toe),
    (&["toe"], Sense::Toe),
    (&["toes"], Sense::Toe),
    (&["ball"], Sense::Toe),
    (&["metacarpal", "thumb"], Sense::Finger(Part::Thumb)),
    (&["metacarpal"], Sense::Metacarpal),
    (&["carpal"], Sense::Metacarpal),
    (&["in", "hand"], Sense::Metacarpal),
    (&["thumb"], Sense::Finger(Part::Thumb)),
    (&["pinky"], Sense::Finger(Part::Pinky)),
    (&["pinkie"], Sense::Finger(Part::Pinky)),
    (&["little"], Sense::Finger(Part::Pinky)),
    (&["ring"], Sense::Finger(Part::Ring)),
    (&["middle"], Sense::Finger(Part::Middle)),
    (&["mid"], Sense::Finger(Part::Middle)),
    (&["index"], Sense::Finger(Part::Index)),
    (&["finger"], Sense::AnyFinger),
    (&["fingers"], Sense::AnyFinger),
    (&["clavicle"], Sense::Clavicle),
    (&["clav"], Sense::Clavicle),
    (&["collar"], Sense::Clavicle),
    (&["collarbone"], Sense::Clavicle),
    (&["scapula"], Sense::Clavicle),
    (&["upper", "arm"], Sense::UpperArm),
    (&["up", "arm"], Sense::UpperArm),
    (&["fore", "arm"], Sense::Forearm),
    (&["forearm"], Sense::Forearm),
    (&["lower", "arm"], Sense::Forearm),
    (&["low", "arm"], Sense::Forearm),
    (&["lo", "arm"], Sense::Forearm),
    (&["elbow"], Sense::Forearm),
    (&["shoulder"], Sense::Shoulder),
    (&["shldr"], Sense::Shoulder),
    (&["arm"], Sense::Arm),
    (&["wrist"], Sense::Wrist),
    (&["palm"], Sense::Palm),
    (&["hand"], Sense::Hand),
    (&["fist"], Sense::Hand),
    (&["hip", "joint"], Sense::Hip),
    (&["buttock"], Sense::Hip),
    (&["upper", "leg"], Sense::Thigh),
    (&["up", "leg"], Sense::Thigh),
    (&["thigh"], Sense::Thigh),
    (&["lower", "leg"], Sense::Shin),
    (&["low", "leg"], Sense::Shin),
    (&["lo", "leg"], Sense::Shin),
    (&["shin"], Sense::Shin),
    (&["calf"], Sense::Shin),
    (&["knee"], Sense::Shin),
    (&["ankle"], Sense::Ankle),
    (&["foot"], Sense::Foot),
    (&["leg"], Sense::Leg),
    (&["jaw"], Sense::Jaw),
    (&["eye"], Sense::Eye),
    (&["neck"], Sense::Neck),
    (&["head"], Sense::Head),
    (&["lower", "torso"], Sense::Pelvis),
    (&["lower", "body"], Sense::Pelvis),
    (&["pelvis"], Sense::Pelvis),
    (&["hips"], Sense::Pelvis),
    (&["hip"], Sense::Pelvis),
    (&["spine"], Sense::Spine),
    (&["chest"], Sense::Spine),
    (&["torso"], Sense::Spine),
    (&["stomach"], Sense::Spine),
    (&["thorax"], Sense::Spine),
    (&["abdomen"], Sense::Spine),
    (&["ab"], Sense::Spine),
    (&["tummy"], Sense::Spine),
    (&["waist"], Sense::Spine),
    (&["upper", "body"], Sense::Spine),
    (&["lower", "back"], Sense::Spine),
    (&["upper", "back"], Sense::Spine),
];

/// Words that carry no meaning of their own: prefixes of conventions, and what tools call any joint. `base` is among them
/// (`ToeBase`, `CC_Base_`).
pub(super) const NOISE: &[&str] = &[
    "mixamorig",
    "avatar",
    "character",
    "cc",
    "base",
    "rl",
    "def",
    "org",
    "bip",
    "biped",
    "valve",
    "valvebiped",
    "bone",
    "bones",
    "jnt",
    "joint",
    "bn",
    "armature",
    "rig",
    "skeleton",
    "skel",
    "sk",
    "bind",
    "deform",
    "node",
    "anim",
    "stretch",
    "main",
    "b",
    "c",
    "f",
    "j",
    "m",
    "o",
    "x",
    "bend",
    "proximal",
    "intermediate",
    "distal",
    "phalanx",
    "upper",
    "up",
    "lower",
    "low",
    "lo",
    "back",
    "in",
    "top",
    "center",
    "hand",
    "joints",
    "root",
];

/// Words of nodes that steer, mark or hold things and are no part of the body.
pub(super) const CONTROLS: &[&str] = &[
    "ik",
    "fk",
    "ctrl",
    "ctl",
    "control",
    "controller",
    "pole",
    "poletarget",
    "target",
    "effector",
    "tweak",
    "mch",
    "vis",
    "wgt",
    "widget",
    "parent",
    "helper",
    "marker",
    "slot",
    "handslot",
    "socket",
    "attach",
    "attachment",
    "weapon",
    "prop",
    "gizmo",
    "orient",
    "tracker",
    "mesh",
    "geo",
    "collider",
    "footsteps",
    "camera",
    "light",
    "lamp",
    "goal",
    "handle",
    "pivot",
    "heel",
    "share",
    "driver",
    "breast",
    "gun",
    "look",
    "lookat",
];

/// Words of a marker at the end of a chain.
pub(super) const ENDS: &[&str] = &["end", "leaf", "nub", "tip", "site", "endsite", "null"];

/// Words of a helper that carries part of a limb's twist.
pub(super) const TWISTS: &[&str] = &["twist", "roll", "twst"];

/// Words of the two sides, where they stand alone.
pub(super) const LEFT: &[&str] = &["left", "l", "lt", "lf", "lft"];
/// See [`LEFT`].
pub(super) const RIGHT: &[&str] = &["right", "r", "rt", "rgt"];

/// Words that glued names are made of and that no table above lists.
pub(super) const OTHER_WORDS: &[&str] = &["left", "right", "body", "ear", "fore"];

/// Words too short or too common to be found inside a glued name.
pub(super) const NEVER_GLUED: &[&str] =
    &["ab", "in", "b", "c", "f", "j", "m", "o", "x", "l", "r", "ik", "fk", "lo", "cc", "rl", "lt", "rt"];

/// Japanese names, as MMD and VRoid models carry them, longest first.
pub(super) const JAPANESE: &[(&str, &str)] = &[
    ("全ての親", " root "),
    ("センター", " center "),
    ("グルーブ", " groove "),
    ("つま先", " toe "),
    ("上半身", " spine "),
    ("下半身", " pelvis "),
    ("人差指", " index "),
    ("人指", " index "),
    ("親指", " thumb "),
    ("中指", " middle "),
    ("薬指", " ring "),
    ("小指", " pinky "),
    ("手首", " hand "),
    ("足首", " ankle "),
    ("手捩", " forearm twist "),
    ("腕捩", " arm twist "),
    ("ひじ", " forearm "),
    ("ひざ", " shin "),
    ("ＩＫ", " ik "),
    ("左", " left "),
    ("右", " right "),
    ("肩", " shoulder "),
    ("腕", " arm "),
    ("足", " leg "),
    ("首", " neck "),
    ("頭", " head "),
    ("目", " eye "),
    ("腰", " waist "),
    ("先", " tip "),
    ("捩", " twist "),
    ("親", " parent "),
];
