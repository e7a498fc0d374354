//! Expressions and visemes made of ARKit's shapes, and the other way round.
//!
//! (docs/algorithm/faces.md; the constants are ours where it leaves them open.)

use super::{MorphCombine, MorphDrive, MorphTerm};

/// A linear form: an offset, and shapes with gains.
type Form = (f64, &'static [(&'static str, f64)]);

/// What a morph is made of: how the forms are combined, the factor behind, and the forms.
type Recipe = (&'static str, MorphCombine, f64, &'static [Form]);

use MorphCombine::{Min, Product, Sum};

const RECIPES: [Recipe; 57] = [
    // Expressions of VRM 1.0 from ARKit's shapes.
    ("blinkleft", Sum, 1.0, &[(0.0, &[("eyeblinkleft", 1.0)])]),
    ("blinkright", Sum, 1.0, &[(0.0, &[("eyeblinkright", 1.0)])]),
    ("blink", Min, 1.0, &[(0.0, &[("eyeblinkleft", 1.0)]), (0.0, &[("eyeblinkright", 1.0)])]),
    ("aa", Product, 1.0, &[(0.0, &[("jawopen", 1.0)]), (1.0, &[("mouthfunnel", -0.6), ("mouthpucker", -0.6)])]),
    ("ou", Sum, 1.0, &[(0.0, &[("mouthpucker", 1.0)])]),
    ("oh", Product, 2.0, &[(0.0, &[("mouthfunnel", 1.0)]), (0.0, &[("jawopen", 1.0)])]),
    (
        "ih",
        Product,
        1.0,
        &[(0.0, &[("mouthstretchleft", 0.5), ("mouthstretchright", 0.5)]), (1.0, &[("jawopen", -1.0)])],
    ),
    (
        "ee",
        Product,
        2.0,
        &[
            (0.0, &[("mouthsmileleft", 0.5), ("mouthsmileright", 0.5)]),
            (0.0, &[("jawopen", 1.0)]),
            (1.0, &[("jawopen", -1.0)]),
        ],
    ),
    (
        "happy",
        Sum,
        0.25,
        &[(
            0.0,
            &[("mouthsmileleft", 1.0), ("mouthsmileright", 1.0), ("cheeksquintleft", 1.0), ("cheeksquintright", 1.0)],
        )],
    ),
    ("sad", Sum, 1.0, &[(0.0, &[("mouthfrownleft", 0.25), ("mouthfrownright", 0.25), ("browinnerup", 0.5)])]),
    (
        "angry",
        Sum,
        0.25,
        &[(0.0, &[("browdownleft", 1.0), ("browdownright", 1.0), ("nosesneerleft", 1.0), ("nosesneerright", 1.0)])],
    ),
    (
        "surprised",
        Sum,
        1.0 / 3.0,
        &[(
            0.0,
            &[
                ("eyewideleft", 0.5),
                ("eyewideright", 0.5),
                ("browouterupleft", 0.5),
                ("browouterupright", 0.5),
                ("jawopen", 1.0),
            ],
        )],
    ),
    ("lookup", Sum, 0.5, &[(0.0, &[("eyelookupleft", 1.0), ("eyelookupright", 1.0)])]),
    ("lookdown", Sum, 0.5, &[(0.0, &[("eyelookdownleft", 1.0), ("eyelookdownright", 1.0)])]),
    ("lookleft", Sum, 0.5, &[(0.0, &[("eyelookoutleft", 1.0), ("eyelookinright", 1.0)])]),
    ("lookright", Sum, 0.5, &[(0.0, &[("eyelookinleft", 1.0), ("eyelookoutright", 1.0)])]),
    // ARKit's shapes from expressions and visemes.
    ("eyeblinkleft", Sum, 1.0, &[(0.0, &[("blink", 1.0), ("blinkleft", 1.0)])]),
    ("eyeblinkright", Sum, 1.0, &[(0.0, &[("blink", 1.0), ("blinkright", 1.0)])]),
    (
        "jawopen",
        Sum,
        1.0,
        &[(
            0.0,
            &[
                ("aa", 0.7),
                ("oh", 0.4),
                ("ee", 0.2),
                ("ih", 0.1),
                ("surprised", 0.4),
                ("visemeth", 0.15),
                ("visemedd", 0.15),
                ("visemekk", 0.2),
                ("visemenn", 0.1),
                ("visemerr", 0.1),
                ("visemech", 0.1),
            ],
        )],
    ),
    ("mouthpucker", Sum, 1.0, &[(0.0, &[("ou", 1.0), ("visemerr", 0.3)])]),
    ("mouthfunnel", Sum, 1.0, &[(0.0, &[("oh", 0.7), ("visemech", 0.7), ("visemerr", 0.3)])]),
    ("mouthstretchleft", Sum, 1.0, &[(0.0, &[("ih", 0.7), ("visemekk", 0.2), ("visemess", 0.5)])]),
    ("mouthstretchright", Sum, 1.0, &[(0.0, &[("ih", 0.7), ("visemekk", 0.2), ("visemess", 0.5)])]),
    ("mouthpressleft", Sum, 1.0, &[(0.0, &[("visemepp", 0.8)])]),
    ("mouthpressright", Sum, 1.0, &[(0.0, &[("visemepp", 0.8)])]),
    ("mouthrolllower", Sum, 1.0, &[(0.0, &[("visemepp", 0.3), ("visemeff", 0.7)])]),
    ("mouthrollupper", Sum, 1.0, &[(0.0, &[("visemepp", 0.3)])]),
    ("mouthupperupleft", Sum, 1.0, &[(0.0, &[("visemeff", 0.3)])]),
    ("mouthupperupright", Sum, 1.0, &[(0.0, &[("visemeff", 0.3)])]),
    ("mouthlowerdownleft", Sum, 1.0, &[(0.0, &[("visemedd", 0.3), ("visemess", 0.3), ("visemenn", 0.2)])]),
    ("mouthlowerdownright", Sum, 1.0, &[(0.0, &[("visemedd", 0.3), ("visemess", 0.3), ("visemenn", 0.2)])]),
    ("mouthshrugupper", Sum, 1.0, &[(0.0, &[("visemech", 0.2)])]),
    ("tongueout", Sum, 1.0, &[(0.0, &[("visemeth", 0.4)])]),
    // Visemes for consonants from ARKit's shapes; what the tongue does behind the teeth, ARKit does not say.
    (
        "visemepp",
        Sum,
        0.5,
        &[(
            0.0,
            &[("mouthpressleft", 0.5), ("mouthpressright", 0.5), ("mouthrolllower", 0.5), ("mouthrollupper", 0.5)],
        )],
    ),
    (
        "visemeff",
        Product,
        1.0,
        &[
            (0.0, &[("mouthrolllower", 1.0)]),
            (1.0, &[("mouthrollupper", -1.0)]),
            (1.0, &[("mouthpressleft", -0.5), ("mouthpressright", -0.5)]),
        ],
    ),
    ("visemeth", Sum, 1.0, &[(0.0, &[("tongueout", 1.0)])]),
    ("visemech", Product, 1.0, &[(0.0, &[("mouthfunnel", 1.0)]), (1.0, &[("jawopen", -1.0)])]),
    ("mouthsmileleft", Sum, 1.0, &[(0.0, &[("happy", 0.8), ("ee", 0.4), ("relaxed", 0.3)])]),
    ("mouthsmileright", Sum, 1.0, &[(0.0, &[("happy", 0.8), ("ee", 0.4), ("relaxed", 0.3)])]),
    ("cheeksquintleft", Sum, 1.0, &[(0.0, &[("happy", 0.6)])]),
    ("cheeksquintright", Sum, 1.0, &[(0.0, &[("happy", 0.6)])]),
    ("mouthfrownleft", Sum, 1.0, &[(0.0, &[("sad", 0.8)])]),
    ("mouthfrownright", Sum, 1.0, &[(0.0, &[("sad", 0.8)])]),
    ("browinnerup", Sum, 1.0, &[(0.0, &[("sad", 0.8), ("surprised", 0.5)])]),
    ("browdownleft", Sum, 1.0, &[(0.0, &[("angry", 0.9)])]),
    ("browdownright", Sum, 1.0, &[(0.0, &[("angry", 0.9)])]),
    ("nosesneerleft", Sum, 1.0, &[(0.0, &[("angry", 0.6)])]),
    ("nosesneerright", Sum, 1.0, &[(0.0, &[("angry", 0.6)])]),
    ("eyewideleft", Sum, 1.0, &[(0.0, &[("surprised", 0.9)])]),
    ("eyewideright", Sum, 1.0, &[(0.0, &[("surprised", 0.9)])]),
    ("browouterupleft", Sum, 1.0, &[(0.0, &[("surprised", 0.9)])]),
    ("browouterupright", Sum, 1.0, &[(0.0, &[("surprised", 0.9)])]),
    ("eyelookupleft", Sum, 1.0, &[(0.0, &[("lookup", 1.0)])]),
    ("eyelookupright", Sum, 1.0, &[(0.0, &[("lookup", 1.0)])]),
    ("eyelookdownleft", Sum, 1.0, &[(0.0, &[("lookdown", 1.0)])]),
    ("eyelookdownright", Sum, 1.0, &[(0.0, &[("lookdown", 1.0)])]),
    ("relaxed", Sum, 1.0, &[]),
];

/// What visemes for consonants add to mouths that have none of them: to vowels of VRM.
const CONSONANTS_IN_VOWELS: [(&str, &[(&str, f64)]); 4] = [
    ("aa", &[("visemekk", 0.15), ("visemedd", 0.1)]),
    (
        "ih",
        &[
            ("visemeff", 0.2),
            ("visemeth", 0.3),
            ("visemedd", 0.3),
            ("visemekk", 0.2),
            ("visemess", 0.3),
            ("visemenn", 0.3),
        ],
    ),
    ("ou", &[("visemech", 0.4), ("visemerr", 0.3)]),
    ("ee", &[("visemess", 0.2)]),
];

/// What consonants that the source has and the target has not add to a vowel; nothing where there are none.
pub(super) fn consonants_in(vowel: &str, find: &impl Fn(&str) -> Option<usize>) -> Option<MorphTerm> {
    let (_, shares) = CONSONANTS_IN_VOWELS.iter().find(|(name, _)| *name == vowel)?;
    let sources: Vec<(usize, f64)> =
        shares.iter().filter_map(|(consonant, gain)| find(consonant).map(|morph| (morph, *gain))).collect();
    (!sources.is_empty()).then_some(MorphTerm { sources, offset: 0.0, clamp: [0.0, 1.0] })
}

/// How a morph is made of others that the source has; nothing where it has none of them. A form of which the source has nothing is
/// left out; where forms are multiplied, the first one has to be there.
pub(super) fn formula(name: &str, target: usize, find: &impl Fn(&str) -> Option<usize>) -> Option<MorphDrive> {
    let (_, combine, gain, forms) = RECIPES.iter().find(|(made, ..)| *made == name)?;
    let mut terms = Vec::with_capacity(forms.len());
    for (index, (offset, shapes)) in forms.iter().enumerate() {
        let sources: Vec<(usize, f64)> =
            shapes.iter().filter_map(|(shape, gain)| find(shape).map(|morph| (morph, *gain))).collect();
        if sources.is_empty() && (index == 0 || *offset == 0.0) {
            return None;
        }
        terms.push(MorphTerm { sources, offset: *offset, clamp: [0.0, 1.0e3] });
    }
    (!terms.is_empty()).then_some(MorphDrive { target, terms, combine: *combine, gain: *gain, clamp: [0.0, 1.0] })
}
