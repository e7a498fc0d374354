//! What names of morphs mean: the vocabularies of several tools, folded into ARKit's.

/// ARKit's 52 blend shapes, folded.
const ARKIT: [&str; 52] = [
    "browdownleft",
    "browdownright",
    "browinnerup",
    "browouterupleft",
    "browouterupright",
    "cheekpuff",
    "cheeksquintleft",
    "cheeksquintright",
    "eyeblinkleft",
    "eyeblinkright",
    "eyelookdownleft",
    "eyelookdownright",
    "eyelookinleft",
    "eyelookinright",
    "eyelookoutleft",
    "eyelookoutright",
    "eyelookupleft",
    "eyelookupright",
    "eyesquintleft",
    "eyesquintright",
    "eyewideleft",
    "eyewideright",
    "jawforward",
    "jawleft",
    "jawopen",
    "jawright",
    "mouthclose",
    "mouthdimpleleft",
    "mouthdimpleright",
    "mouthfrownleft",
    "mouthfrownright",
    "mouthfunnel",
    "mouthleft",
    "mouthlowerdownleft",
    "mouthlowerdownright",
    "mouthpressleft",
    "mouthpressright",
    "mouthpucker",
    "mouthright",
    "mouthrolllower",
    "mouthrollupper",
    "mouthshruglower",
    "mouthshrugupper",
    "mouthsmileleft",
    "mouthsmileright",
    "mouthstretchleft",
    "mouthstretchright",
    "mouthupperupleft",
    "mouthupperupright",
    "nosesneerleft",
    "nosesneerright",
    "tongueout",
];

/// Expressions of VRM 1.0, folded.
const VRM: [&str; 17] = [
    "aa",
    "ih",
    "ou",
    "ee",
    "oh",
    "happy",
    "angry",
    "sad",
    "relaxed",
    "surprised",
    "blink",
    "blinkleft",
    "blinkright",
    "lookup",
    "lookdown",
    "lookleft",
    "lookright",
];

/// Other tools' words, without side, for ARKit's: MetaHuman's control curves and Character Creator 3's shapes.
const ALIASES: [(&str, &str); 39] = [
    ("browraisein", "browinnerup"),
    ("browraiseinner", "browinnerup"),
    ("browraiseout", "browouterup"),
    ("browraiseouter", "browouterup"),
    ("browdrop", "browdown"),
    ("browlateral", "browdown"),
    ("eyewiden", "eyewide"),
    ("eyesquintinner", "eyesquint"),
    ("eyecheekraise", "cheeksquint"),
    ("cheekraise", "cheeksquint"),
    ("nosewrinkle", "nosesneer"),
    ("nosescrunch", "nosesneer"),
    ("mouthcornerpull", "mouthsmile"),
    ("mouthcornerdepress", "mouthfrown"),
    ("mouthupperlipraise", "mouthupperup"),
    ("mouthlowerlipdepress", "mouthlowerdown"),
    ("mouthlipspurse", "mouthpucker"),
    ("mouthupup", "mouthupperup"),
    ("mouthdown", "mouthlowerdown"),
    ("mouthcheekblow", "cheekpuff"),
    ("cheekpuffboth", "cheekpuff"),
    ("jawfwd", "jawforward"),
    ("jawopenextreme", "jawopen"),
    ("mouthlipsblow", "cheekpuff"),
    ("tongueoutward", "tongueout"),
    ("eyesblink", "blink"),
    ("mouthopen", "jawopen"),
    ("mouthlipspress", "mouthpress"),
    ("mouthrollinlower", "mouthrolllower"),
    ("mouthrollinupper", "mouthrollupper"),
    ("mouthpuckeropen", "mouthfunnel"),
    ("mouthfunneld", "mouthfunnel"),
    ("mouthfunnelu", "mouthfunnel"),
    ("mouthlipspursed", "mouthpucker"),
    ("mouthlipspurseu", "mouthpucker"),
    ("mouthlowerliprollin", "mouthrolllower"),
    ("mouthupperliprollin", "mouthrollupper"),
    ("jawchinraised", "mouthshruglower"),
    ("jawchinraiseu", "mouthshrugupper"),
];

/// Words for an eye's look to a side of the figure, which ARKit calls inward and outward: MetaHuman's, then Character Creator's.
const LOOKS: [(&str, &str); 12] = [
    ("eyelookleftl", "eyelookoutleft"),
    ("eyelookrightl", "eyelookinleft"),
    ("eyelookleftr", "eyelookinright"),
    ("eyelookrightr", "eyelookoutright"),
    ("eyellookl", "eyelookoutleft"),
    ("eyellookr", "eyelookinleft"),
    ("eyerlookl", "eyelookinright"),
    ("eyerlookr", "eyelookoutright"),
    ("eyellookup", "eyelookupleft"),
    ("eyellookdown", "eyelookdownleft"),
    ("eyerlookup", "eyelookupright"),
    ("eyerlookdown", "eyelookdownright"),
];

/// Visemes of Oculus for consonants, folded; those for vowels are VRM's. The last one is silence.
const CONSONANTS: [&str; 10] = [
    "visemepp",
    "visemeff",
    "visemeth",
    "visemedd",
    "visemekk",
    "visemech",
    "visemess",
    "visemenn",
    "visemerr",
    "visemesil",
];

/// Visemes: what comes behind [`VISEME_PREFIXES`].
const VISEMES: [(&str, &str); 18] = [
    ("aa", "aa"),
    ("e", "ee"),
    ("i", "ih"),
    ("ih", "ih"),
    ("o", "oh"),
    ("oh", "oh"),
    ("u", "ou"),
    ("ou", "ou"),
    ("pp", "visemepp"),
    ("ff", "visemeff"),
    ("th", "visemeth"),
    ("dd", "visemedd"),
    ("kk", "visemekk"),
    ("ch", "visemech"),
    ("ss", "visemess"),
    ("nn", "visemenn"),
    ("rr", "visemerr"),
    ("sil", "visemesil"),
];

/// What stands before visemes: Oculus' word, and VRChat's, of whose `vrc.v_aa` the part before the dot is left out.
const VISEME_PREFIXES: [&str; 3] = ["viseme", "vrcv", "v"];

/// Visemes of Character Creator.
const CREATOR_VISEMES: [(&str, &str); 7] = [
    ("vopen", "aa"),
    ("vwide", "ee"),
    ("vtighto", "ou"),
    ("vlipopen", "ih"),
    ("vexplosive", "visemepp"),
    ("vdentallip", "visemeff"),
    ("vaffricate", "visemech"),
];

/// Small letters and digits, without what tools put in front.
pub(super) fn folded(name: &str) -> String {
    let bare = name.rsplit(['.', ':', '|']).next().unwrap_or(name);
    let folded: String = bare.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase();
    let folded = folded.strip_prefix("ctrlexpressions").unwrap_or(&folded);
    // Character Creator 4 numbers its shapes: A14_Eye_Blink_Left.
    let numbered = bare.as_bytes();
    let is_numbered = numbered.len() > 4
        && numbered[0].is_ascii_alphabetic()
        && numbered[1..3].iter().all(u8::is_ascii_digit)
        && numbered[3] == b'_';
    if is_numbered { folded[3..].to_owned() } else { folded.to_owned() }
}

/// What a name means: a folded name of ARKit's, of VRM's, or of a viseme for a consonant.
pub(super) fn canonical(name: &str) -> Option<&'static str> {
    let name = folded(name);
    let known = |name: &str| ARKIT.iter().chain(&VRM).chain(&CONSONANTS).find(|known| **known == name).copied();
    if let Some(found) = known(&name) {
        return Some(found);
    }
    if let Some((_, meant)) = CREATOR_VISEMES.iter().chain(&LOOKS).find(|(word, _)| *word == name) {
        return Some(meant);
    }
    let viseme = |word: &str| VISEMES.iter().find(|(known, _)| *known == word).map(|(_, meant)| *meant);
    if let Some(meant) = VISEME_PREFIXES.iter().find_map(|prefix| viseme(name.strip_prefix(prefix)?)) {
        return Some(meant);
    }
    let (stem, side) = sided(&name);
    let meant = |stem: &str| ALIASES.iter().find(|(alias, _)| *alias == stem).map(|(_, meant)| *meant);
    [Some(stem), meant(stem)].into_iter().flatten().find_map(|stem| {
        known(&format!("{stem}{side}")).or_else(|| {
            // Some have one shape for what others have two sides of.
            known(stem).filter(|_| !side.is_empty())
        })
    })
}

/// A name without its side, and the side in full.
fn sided(name: &str) -> (&str, &'static str) {
    for (ending, side) in [("left", "left"), ("right", "right"), ("l", "left"), ("r", "right")] {
        if let Some(stem) = name.strip_suffix(ending).filter(|stem| !stem.is_empty()) {
            return (stem, side);
        }
    }
    (name, "")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vocabularies_meet() {
        for (name, meant) in [
            ("eyeBlinkLeft", "eyeblinkleft"),
            ("EyeBlink_L", "eyeblinkleft"),
            ("A14_Eye_Blink_Left", "eyeblinkleft"),
            ("Eye_Blink_R", "eyeblinkright"),
            ("CTRL_expressions_eyeBlinkL", "eyeblinkleft"),
            ("CTRL_expressions_mouthCornerPullR", "mouthsmileright"),
            ("CTRL_expressions_browRaiseInL", "browinnerup"),
            ("CTRL_expressions_noseWrinkleL", "nosesneerleft"),
            ("Brow_Raise_Outer_L", "browouterupleft"),
            ("blendShape1.jawOpen", "jawopen"),
            ("viseme_aa", "aa"),
            ("viseme_O", "oh"),
            ("viseme_kk", "visemekk"),
            ("V_Explosive", "visemepp"),
            ("vrc.v_ou", "ou"),
            ("vrc_v_PP", "visemepp"),
            ("V_Tight_O", "ou"),
            ("blinkLeft", "blinkleft"),
        ] {
            assert_eq!(canonical(name), Some(meant), "{name}");
        }
        for name in ["hair", "target_0", "", "l", "Body_Fat"] {
            assert_eq!(canonical(name), None, "{name:?}");
        }
    }

    #[test]
    fn all_of_arkit_is_met_in_every_spelling() {
        let sides = [("left", "Left", "L"), ("right", "Right", "R")];
        for name in ARKIT {
            assert_eq!(canonical(name), Some(name), "{name} itself");
            assert_eq!(canonical(&name.to_uppercase()), Some(name), "{name} in capitals");
            let Some((stem, (_, long, short))) =
                sides.into_iter().find_map(|side| Some((name.strip_suffix(side.0)?, side)))
            else {
                continue;
            };
            let spellings = [
                format!("{stem}_{short}"),
                format!("{stem}{long}"),
                format!("CTRL_expressions_{stem}{short}"),
                format!("A07_{stem}_{long}"),
            ];
            for spelling in spellings {
                assert_eq!(canonical(&spelling), Some(name), "{spelling}");
            }
        }
        for name in VRM {
            assert_eq!(canonical(name), Some(name), "{name} of VRM");
        }
    }

    #[test]
    fn names_of_metahuman_and_character_creator_mean_what_arkit_says() {
        for (name, meant) in [
            ("CTRL_expressions_eyeLookLeftL", "eyelookoutleft"),
            ("CTRL_expressions_eyeLookLeftR", "eyelookinright"),
            ("CTRL_expressions_eyeLookUpR", "eyelookupright"),
            ("CTRL_expressions_eyeWidenL", "eyewideleft"),
            ("CTRL_expressions_eyeSquintInnerR", "eyesquintright"),
            ("CTRL_expressions_mouthFunnelDL", "mouthfunnel"),
            ("CTRL_expressions_mouthLipsPurseUR", "mouthpucker"),
            ("CTRL_expressions_mouthUpperLipRaiseL", "mouthupperupleft"),
            ("CTRL_expressions_mouthLowerLipDepressR", "mouthlowerdownright"),
            ("CTRL_expressions_mouthCornerDepressL", "mouthfrownleft"),
            ("CTRL_expressions_jawFwd", "jawforward"),
            ("CTRL_expressions_jawChinRaiseDL", "mouthshruglower"),
            ("CTRL_expressions_tongueOut", "tongueout"),
            ("Eye_L_Look_L", "eyelookoutleft"),
            ("Eye_R_Look_Up", "eyelookupright"),
            ("Brow_Drop_R", "browdownright"),
            ("Cheek_Raise_L", "cheeksquintleft"),
            ("Mouth_Smile_L", "mouthsmileleft"),
            ("Jaw_Open", "jawopen"),
            ("A25_Jaw_Open", "jawopen"),
        ] {
            assert_eq!(canonical(name), Some(meant), "{name}");
        }
    }
}
