//! Which morph of the target follows which of the source, and how.
//!
//! By rows of the spec; else by equal names; else by what the names mean: those of ARKit, Character Creator and MetaHuman are folded
//! into ARKit's 52 ([`names`]), and expressions of VRM and visemes are made of those, or they of them, by the formulas of
//! [`formulas`]. Lids, looks and the rest of a face are made by formulas only where nothing of them is met by name: an avatar with all
//! 52 shapes ("perfect sync") needs none, and one whose mouth follows visemes still blinks.

mod formulas;
mod names;

use std::collections::BTreeSet;

use super::{
    error::{SpecError, SpecErrorKind, SpecField},
    spec::{MorphCombine, MorphsSpec},
};
use crate::model::{Morph, MorphPlace};
use formulas::{consonants_in, formula};
use names::{canonical, folded};

/// A viseme that moves nothing, so nothing is lost with it.
const SILENCE: &str = "visemesil";

/// What a morph's name means: a name of ARKit's or VRM's in small letters, such as `eyeblinkleft`, or a viseme's for a consonant, such as
/// `visemekk`; nothing where it is none that is known.
#[must_use]
pub fn morph_meaning(name: &str) -> Option<&'static str> {
    canonical(name)
}

/// One linear form of source weights: `offset + Σ gain · weight`, clamped.
#[derive(Clone, Debug, PartialEq)]
pub struct MorphTerm {
    /// Index of the morph in the source, and the gain.
    pub sources: Vec<(usize, f64)>,
    /// What is added.
    pub offset: f64,
    /// Least and most that comes out.
    pub clamp: [f64; 2],
}

/// How one morph of the target is found.
#[derive(Clone, Debug, PartialEq)]
pub struct MorphDrive {
    /// Index of the morph in the target.
    pub target: usize,
    /// At least one.
    pub terms: Vec<MorphTerm>,
    /// How they are combined.
    pub combine: MorphCombine,
    /// What comes out is multiplied by this, and clamped.
    pub gain: f64,
    /// Least and most that comes out.
    pub clamp: [f64; 2],
}

impl MorphDrive {
    /// The weight, from those of the source.
    pub fn weight(&self, source: impl Fn(usize) -> f64) -> f64 {
        let term = |term: &MorphTerm| {
            let sum: f64 = term.sources.iter().map(|(morph, gain)| gain * source(*morph)).sum();
            (sum + term.offset).clamp(term.clamp[0], term.clamp[1])
        };
        let terms = self.terms.iter().map(term);
        let combined = match self.combine {
            MorphCombine::Sum => terms.sum(),
            MorphCombine::Max => terms.fold(f64::NEG_INFINITY, f64::max),
            MorphCombine::Min => terms.fold(f64::INFINITY, f64::min),
            MorphCombine::Product => terms.product(),
        };
        (combined * self.gain).clamp(self.clamp[0], self.clamp[1])
    }
}

/// What follows what; sources that nothing follows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MorphMapping {
    /// In the order of the target's morphs, each at most once.
    pub drives: Vec<MorphDrive>,
    /// Indices of source morphs that no drive uses.
    pub unused: Vec<usize>,
}

/// Finds out what follows what. `animated` are the source morphs that a clip animates.
///
/// # Errors
/// When a row names a morph that a side does not have, or its clamp is none.
pub fn map_morphs(
    source: &[Morph],
    animated: &[usize],
    target: &[Morph],
    spec: &MorphsSpec,
) -> Result<MorphMapping, SpecError> {
    let mut drives: Vec<Option<MorphDrive>> = vec![None; target.len()];
    if spec.enabled {
        by_rows(source, target, spec, &mut drives)?;
        if spec.by_name {
            by_names(source, animated, target, &mut drives);
        }
    }
    let drives: Vec<MorphDrive> = drives.into_iter().flatten().collect();
    let used: BTreeSet<usize> =
        drives.iter().flat_map(|drive| &drive.terms).flat_map(|term| &term.sources).map(|(morph, _)| *morph).collect();
    let is_silence = |morph: &usize| canonical(&source[*morph].name) == Some(SILENCE);
    let unused = animated.iter().copied().filter(|morph| !used.contains(morph) && !is_silence(morph)).collect();
    Ok(MorphMapping { drives, unused })
}

fn by_rows(
    source: &[Morph],
    target: &[Morph],
    spec: &MorphsSpec,
    drives: &mut [Option<MorphDrive>],
) -> Result<(), SpecError> {
    let mut fields = Vec::new();
    for (index, row) in spec.rows.iter().enumerate() {
        let mut find = |side: &str, name: &str, morphs: &[Morph]| -> Vec<usize> {
            let same = |morph: &Morph| morph.name == name || folded(&morph.name) == folded(name);
            let found: Vec<usize> = (0..morphs.len()).filter(|morph| same(&morphs[*morph])).collect();
            if found.is_empty() {
                let detail = format!("the {side} has no morph or expression '{name}'");
                let field = SpecField::new(SpecErrorKind::UnknownName, format!("/morphs/rows/{index}/{side}"), detail);
                fields.push(field.with_nearest(name, morphs.iter().map(|morph| morph.name.as_str())));
            }
            found
        };
        let (from, onto) = (find("source", &row.source, source), find("target", &row.target, target));
        let [least, most] = row.clamp;
        if !(least.is_finite() && most.is_finite() && least <= most) {
            let detail = format!("[{least}, {most}] is no range; the least comes first");
            let pointer = format!("/morphs/rows/{index}/clamp");
            fields.push(SpecField::new(SpecErrorKind::InvalidValue, pointer, detail));
            continue;
        }
        let Some(from) = from.first() else { continue };
        let term = MorphTerm { sources: vec![(*from, row.gain)], offset: row.offset, clamp: row.clamp };
        for morph in onto {
            match &mut drives[morph] {
                Some(drive) => drive.terms.push(term.clone()),
                place => {
                    let (combine, clamp) = (row.combine, row.clamp);
                    *place = Some(MorphDrive { target: morph, terms: vec![term.clone()], combine, gain: 1.0, clamp });
                }
            }
        }
    }
    SpecError::from_fields(fields).map_or(Ok(()), Err)
}

fn by_names(source: &[Morph], animated: &[usize], target: &[Morph], drives: &mut [Option<MorphDrive>]) {
    let canonical_names: Vec<Option<&str>> = animated.iter().map(|morph| canonical(&source[*morph].name)).collect();
    // A clip that drives several meshes of one face has each name several times; the first one stands for all.
    let by_canonical = |name: &str| {
        let found = canonical_names.iter().position(|known| *known == Some(name));
        found.map(|index| animated[index])
    };
    let is_by_row: Vec<bool> = drives.iter().map(Option::is_some).collect();
    let mut is_direct = [is_by_row.contains(&true); Region::ALL.len()];
    // Expressions first: a shape that belongs to one that is met by name is moved by it, and not a second time by its own name.
    let (expressions, shapes): (Vec<usize>, Vec<usize>) =
        (0..target.len()).filter(|index| can_show(&target[*index])).partition(|index| is_expression(&target[*index]));
    let mut is_bound = vec![false; target.len()];
    for index in expressions.iter().chain(&shapes).copied() {
        if drives[index].is_some() || is_bound[index] {
            continue;
        }
        let morph = &target[index];
        let name = folded(&morph.name);
        let equal = animated.iter().copied().find(|source_morph| folded(&source[*source_morph].name) == name);
        let Some(found) = equal.or_else(|| by_canonical(canonical(&morph.name)?)) else { continue };
        is_direct[Region::of(canonical(&morph.name).unwrap_or_default()) as usize] = true;
        let term = MorphTerm { sources: vec![(found, 1.0)], offset: 0.0, clamp: [f64::MIN, f64::MAX] };
        // Shapes may be driven beyond their ends on purpose; expressions may not.
        let mut clamp = [f64::MIN, f64::MAX];
        if let MorphPlace::Expression(binds) = &morph.place {
            clamp = [0.0, 1.0];
            binds.iter().for_each(|(shape, _)| is_bound[*shape] = true);
        }
        drives[index] =
            Some(MorphDrive { target: index, terms: vec![term], combine: MorphCombine::Sum, gain: 1.0, clamp });
    }
    by_formulas(target, (&expressions, &shapes), drives, &mut is_bound, is_direct, &by_canonical);
    let vowels = expressions.into_iter().filter(|index| !is_by_row[*index]);
    add_consonants(target, vowels, drives, &by_canonical);
}

/// Parts of a face that are met by name or made by formulas each for itself: a viseme of that name says nothing of the lids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Region {
    Lids,
    /// Where the eyes look.
    Look,
    Rest,
}

impl Region {
    const ALL: [Self; 3] = [Self::Lids, Self::Look, Self::Rest];

    fn of(meaning: &str) -> Self {
        if meaning.contains("blink") {
            Self::Lids
        } else if meaning.contains("look") {
            Self::Look
        } else {
            Self::Rest
        }
    }
}

/// Drives of whatever can be made of several of the source's, in the regions of which nothing is met by name.
fn by_formulas(
    target: &[Morph],
    (expressions, shapes): (&[usize], &[usize]),
    drives: &mut [Option<MorphDrive>],
    is_bound: &mut [bool],
    is_direct: [bool; Region::ALL.len()],
    by_canonical: &impl Fn(&str) -> Option<usize>,
) {
    let has_both_blinks = ["blinkleft", "blinkright"]
        .iter()
        .all(|name| expressions.iter().any(|index| folded(&target[*index].name) == *name));
    for index in expressions.iter().chain(shapes).copied() {
        let morph = &target[index];
        let name = canonical(&morph.name).map_or_else(|| folded(&morph.name), str::to_owned);
        // The lids would close with both of them already.
        let closes_twice = name == "blink" && has_both_blinks;
        if drives[index].is_some() || is_bound[index] || closes_twice || is_direct[Region::of(&name) as usize] {
            continue;
        }
        drives[index] = formula(&name, index, by_canonical);
        if let (Some(_), MorphPlace::Expression(binds)) = (&drives[index], &morph.place) {
            binds.iter().for_each(|(shape, _)| is_bound[*shape] = true);
        }
    }
}

/// Adds what consonants do to the vowels of a target without visemes for them.
fn add_consonants(
    target: &[Morph],
    expressions: impl Iterator<Item = usize>,
    drives: &mut [Option<MorphDrive>],
    by_canonical: &impl Fn(&str) -> Option<usize>,
) {
    let has = |name: &str| target.iter().any(|morph| canonical(&morph.name) == Some(name));
    let find = |name: &str| by_canonical(name).filter(|_| !has(name));
    for index in expressions {
        let Some(term) = canonical(&target[index].name).and_then(|vowel| consonants_in(vowel, &find)) else { continue };
        match &mut drives[index] {
            Some(drive) if drive.combine == MorphCombine::Sum => drive.terms.push(term),
            Some(_) => {}
            none => {
                let (combine, clamp) = (MorphCombine::Sum, [0.0, 1.0]);
                *none = Some(MorphDrive { target: index, terms: vec![term], combine, gain: 1.0, clamp });
            }
        }
    }
}

const fn is_expression(morph: &Morph) -> bool {
    matches!(morph.place, MorphPlace::Expression(_))
}

/// Whether something moves with it.
fn can_show(morph: &Morph) -> bool {
    match &morph.place {
        MorphPlace::Mesh { .. } | MorphPlace::Weight => true,
        MorphPlace::Expression(binds) => !binds.is_empty(),
        MorphPlace::Property => false,
    }
}
