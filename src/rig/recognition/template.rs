//! Naming conventions that have a name: which one a skeleton follows.
//!
//! For people to see; nothing is decided by it. A convention counts as recognised when three quarters of the names that
//! it expects are there.

use std::collections::BTreeSet;

use crate::model::Skeleton;

/// The share of expected names that must be there.
const ENOUGH: f64 = 0.75;

struct Convention {
    name: &'static str,
    /// Goes before every name; a number may follow it.
    prefix: &'static str,
    expected: &'static [&'static str],
    /// All of these must be there as well.
    needs: &'static [&'static str],
    /// None of these may be there.
    lacks: &'static [&'static str],
}

impl Convention {
    const fn new(name: &'static str, prefix: &'static str, expected: &'static [&'static str]) -> Self {
        Self { name, prefix, expected, needs: &[], lacks: &[] }
    }

    const fn needs(self, needs: &'static [&'static str]) -> Self {
        Self { needs, ..self }
    }

    const fn lacks(self, lacks: &'static [&'static str]) -> Self {
        Self { lacks, ..self }
    }

    fn fits(&self, names: &BTreeSet<String>) -> bool {
        let stripped: BTreeSet<&str> = names.iter().filter_map(|name| self.strip(name)).collect();
        let share = self.expected.iter().filter(|name| stripped.contains(*name)).count() as f64;
        share >= ENOUGH * self.expected.len() as f64
            && self.needs.iter().all(|name| stripped.contains(name))
            && !self.lacks.iter().any(|name| stripped.contains(name))
    }

    fn strip<'a>(&self, name: &'a str) -> Option<&'a str> {
        let rest = name.strip_prefix(self.prefix)?;
        let numbered = !self.prefix.is_empty();
        Some(if numbered { rest.trim_start_matches(|character: char| character.is_ascii_digit()) } else { rest })
    }
}

const HUMANIK: &[&str] = &[
    "hips",
    "spine",
    "head",
    "leftshoulder",
    "leftarm",
    "leftforearm",
    "lefthand",
    "leftupleg",
    "leftleg",
    "leftfoot",
    "rightshoulder",
    "rightarm",
    "rightforearm",
    "righthand",
    "rightupleg",
    "rightleg",
    "rightfoot",
];
const BIPED: &[&str] = &[
    "pelvis",
    "spine",
    "lclavicle",
    "lupperarm",
    "lforearm",
    "lhand",
    "lthigh",
    "lcalf",
    "lfoot",
    "rclavicle",
    "rupperarm",
    "rforearm",
    "rhand",
    "rthigh",
    "rcalf",
    "rfoot",
];
const UNREAL: &[&str] = &[
    "pelvis",
    "spine01",
    "spine02",
    "neck01",
    "head",
    "claviclel",
    "upperarml",
    "lowerarml",
    "handl",
    "thighl",
    "calfl",
    "footl",
    "balll",
    "clavicler",
    "upperarmr",
    "lowerarmr",
    "handr",
    "thighr",
    "calfr",
    "footr",
    "ballr",
];
const BIOVISION: &[&str] = &[
    "hips",
    "chest",
    "neck",
    "head",
    "leftcollar",
    "leftshoulder",
    "leftelbow",
    "leftwrist",
    "lefthip",
    "leftknee",
    "leftankle",
    "rightcollar",
    "rightshoulder",
    "rightelbow",
    "rightwrist",
    "righthip",
    "rightknee",
    "rightankle",
];
const CHARACTER_CREATOR: &[&str] = &[
    "hip",
    "pelvis",
    "waist",
    "spine01",
    "spine02",
    "head",
    "lthigh",
    "lcalf",
    "lfoot",
    "lclavicle",
    "lupperarm",
    "lforearm",
    "lhand",
    "rthigh",
    "rcalf",
    "rfoot",
    "rclavicle",
    "rupperarm",
    "rforearm",
    "rhand",
];
const RIGIFY: &[&str] = &[
    "shoulderl",
    "upperarml",
    "forearml",
    "handl",
    "thighl",
    "shinl",
    "footl",
    "toel",
    "shoulderr",
    "upperarmr",
    "forearmr",
    "handr",
    "thighr",
    "shinr",
    "footr",
    "toer",
];
const GENESIS_8: &[&str] = &[
    "hip",
    "pelvis",
    "abdomenlower",
    "abdomenupper",
    "chestlower",
    "chestupper",
    "lcollar",
    "lshldrbend",
    "lforearmbend",
    "lhand",
    "lthighbend",
    "lshin",
    "lfoot",
    "rcollar",
    "rshldrbend",
    "rforearmbend",
    "rhand",
    "rthighbend",
    "rshin",
    "rfoot",
];
const GENESIS_9: &[&str] = &[
    "hip",
    "pelvis",
    "spine1",
    "spine2",
    "spine3",
    "spine4",
    "lshoulder",
    "lupperarm",
    "lforearm",
    "lhand",
    "lthigh",
    "lshin",
    "lfoot",
    "rshoulder",
    "rupperarm",
    "rforearm",
    "rhand",
    "rthigh",
    "rshin",
    "rfoot",
];
const POSER: &[&str] = &[
    "hip", "abdomen", "chest", "neck", "head", "lcollar", "lshldr", "lforearm", "lhand", "lthigh", "lshin", "lfoot",
    "rcollar", "rshldr", "rforearm", "rhand", "rthigh", "rshin", "rfoot",
];
const UNITY: &[&str] = &[
    "hips",
    "spine",
    "chest",
    "neck",
    "head",
    "leftupperarm",
    "leftlowerarm",
    "lefthand",
    "leftupperleg",
    "leftlowerleg",
    "leftfoot",
    "rightupperarm",
    "rightlowerarm",
    "righthand",
    "rightupperleg",
    "rightlowerleg",
    "rightfoot",
];
const VROID: &[&str] = &[
    "chips",
    "cspine",
    "cchest",
    "cneck",
    "chead",
    "lupperarm",
    "llowerarm",
    "lhand",
    "lupperleg",
    "llowerleg",
    "lfoot",
    "rupperarm",
    "rlowerarm",
    "rhand",
    "rupperleg",
    "rlowerleg",
    "rfoot",
];
const SMPL_LONG: &[&str] = &[
    "pelvis",
    "spine1",
    "spine2",
    "spine3",
    "lefthip",
    "leftknee",
    "leftankle",
    "leftfoot",
    "leftcollar",
    "leftshoulder",
    "leftelbow",
    "leftwrist",
    "righthip",
    "rightknee",
    "rightankle",
    "rightfoot",
    "rightcollar",
    "rightshoulder",
    "rightelbow",
    "rightwrist",
];
const SMPL_SHORT: &[&str] = &[
    "pelvis",
    "spine1",
    "spine2",
    "spine3",
    "lhip",
    "lknee",
    "lankle",
    "lfoot",
    "lcollar",
    "lshoulder",
    "lelbow",
    "lwrist",
    "rhip",
    "rknee",
    "rankle",
    "rfoot",
    "rcollar",
    "rshoulder",
    "relbow",
    "rwrist",
];
const ROBLOX: &[&str] = &[
    "lowertorso",
    "uppertorso",
    "head",
    "leftupperarm",
    "leftlowerarm",
    "lefthand",
    "leftupperleg",
    "leftlowerleg",
    "leftfoot",
    "rightupperarm",
    "rightlowerarm",
    "righthand",
    "rightupperleg",
    "rightlowerleg",
    "rightfoot",
];
const KEYPOINTS: &[&str] = &[
    "hip",
    "thorax",
    "leftshoulder",
    "leftelbow",
    "leftwrist",
    "lefthip",
    "leftknee",
    "leftankle",
    "rightshoulder",
    "rightelbow",
    "rightwrist",
    "righthip",
    "rightknee",
    "rightankle",
];
const MAKEHUMAN: &[&str] = &[
    "upperarm01l",
    "upperarm02l",
    "lowerarm01l",
    "upperleg01l",
    "upperleg02l",
    "lowerleg01l",
    "spine05",
    "spine01",
    "upperarm01r",
    "upperarm02r",
    "lowerarm01r",
    "upperleg01r",
    "upperleg02r",
    "lowerleg01r",
];
const AUTO_RIG_PRO: &[&str] = &[
    "armstretchl",
    "forearmstretchl",
    "thighstretchl",
    "legstretchl",
    "armstretchr",
    "forearmstretchr",
    "thighstretchr",
    "legstretchr",
];
const MMD: &[&str] = &[
    "上半身",
    "下半身",
    "首",
    "頭",
    "左肩",
    "左腕",
    "左ひじ",
    "左手首",
    "左足",
    "左ひざ",
    "右肩",
    "右腕",
    "右ひじ",
    "右手首",
    "右足",
    "右ひざ",
];
const CMU: &[&str] = &["hips", "lhipjoint", "rhipjoint", "lowerback"];

/// The first that fits counts, so those that say more stand first.
const CONVENTIONS: &[Convention] = &[
    Convention::new("mixamo", "mixamorig", HUMANIK),
    Convention::new("humanik", "character", HUMANIK),
    Convention::new("decentraland", "avatar", HUMANIK),
    Convention::new("character_creator", "ccbase", CHARACTER_CREATOR),
    Convention::new("valve_biped", "valvebipedbip", BIPED),
    Convention::new("biped_3ds_max", "bip", BIPED),
    Convention::new("rigify", "def", RIGIFY),
    Convention::new("rigify", "org", RIGIFY),
    Convention::new("vrm", "jbip", VROID),
    Convention::new("cmu", "", CMU),
    Convention::new("perception_neuron", "", HUMANIK).needs(&["leftinhandindex"]),
    Convention::new("ready_player_me", "", HUMANIK).needs(&["lefteye", "righteye", "headtopend"]),
    Convention::new("mixamo", "", HUMANIK).needs(&["spine2", "lefthandthumb1", "lefttoebase"]).lacks(&["spine3"]),
    Convention::new("lafan", "", HUMANIK).needs(&["spine2", "lefttoe", "righttoe"]),
    Convention::new("humanik", "", HUMANIK),
    Convention::new("unreal_5", "", UNREAL).needs(&["spine04", "spine05"]),
    Convention::new("unreal_4", "", UNREAL),
    Convention::new("roblox_r15", "", ROBLOX).needs(&["lowertorso", "uppertorso"]),
    Convention::new("vrm", "", UNITY),
    Convention::new("smpl", "", SMPL_LONG),
    Convention::new("smpl", "", SMPL_SHORT),
    Convention::new("daz_genesis_8", "", GENESIS_8),
    Convention::new("daz_genesis_9", "", GENESIS_9),
    Convention::new("poser", "", POSER),
    Convention::new("human36m", "", KEYPOINTS).needs(&["thorax"]),
    Convention::new("xsens", "", BIOVISION).needs(&["chest2", "chest3", "chest4"]),
    Convention::new("biovision", "", BIOVISION),
    Convention::new("makehuman", "", MAKEHUMAN),
    Convention::new("auto_rig_pro", "", AUTO_RIG_PRO),
    Convention::new("mmd", "", MMD),
];

/// The convention that the joints' names follow.
pub(super) fn convention(skeleton: &Skeleton) -> Option<&'static str> {
    let names: BTreeSet<String> = skeleton.joints().iter().map(|joint| plain(&joint.name)).collect();
    CONVENTIONS.iter().find(|convention| convention.fits(&names)).map(|convention| convention.name)
}

/// Lower case, without a namespace and without separators; a namespace that is a convention's prefix stays.
fn plain(name: &str) -> String {
    let bare = match name.rsplit_once(':') {
        Some((namespace, bare)) if !namespace.starts_with("mixamorig") && !bare.is_empty() => bare,
        _ => name,
    };
    bare.chars().filter(|character| character.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}
