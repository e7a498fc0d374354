//! Names that look like one that does not exist.

/// How many are offered.
const MOST: usize = 3;
/// Below this likeness (0 to 1) a name is not offered.
const MIN_LIKENESS: f64 = 0.6;
/// Nor one that is less alike than the best by more than this.
const MAX_BEHIND: f64 = 0.2;

/// The known names that look most like `name`, best first; ties in the order given.
pub(crate) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let mut scored = scored(name, known);
    scored.retain(|(score, _)| *score >= MIN_LIKENESS);
    scored.dedup_by(|first, second| first.1 == second.1);
    // What is much less alike than the best is no answer beside it.
    let worst = scored.first().map_or(0.0, |(best, _)| best - MAX_BEHIND);
    scored.retain(|(score, _)| *score >= worst);
    scored.into_iter().take(MOST).map(|(_, candidate)| candidate.to_owned()).collect()
}

/// All known names, those that look most like `name` first; ties in the order given.
pub(crate) fn by_likeness<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    scored(name, known).into_iter().map(|(_, candidate)| candidate).collect()
}

/// How alike the known names are, the most alike first.
fn scored<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Vec<(f64, &'a str)> {
    let lower = name.to_lowercase();
    let likeness = |candidate: &str| {
        let candidate = candidate.to_lowercase();
        let bare = candidate.rsplit(':').next().unwrap_or_default();
        strsim::normalized_damerau_levenshtein(&lower, &candidate)
            .max(strsim::normalized_damerau_levenshtein(&lower, bare))
            .max(strsim::jaro_winkler(&lower, &candidate) - 0.2)
    };
    let known = known.into_iter().map(|candidate| (likeness(candidate), candidate));
    let mut scored: Vec<(f64, &str)> = known.collect();
    scored.sort_by(|first, second| second.0.total_cmp(&first.0));
    scored
}

#[cfg(test)]
mod tests {
    use super::{by_likeness, nearest};

    #[test]
    fn misspellings_find_their_name() {
        let known = ["mixamorig:Hips", "mixamorig:Spine", "Thorax", "rotation_alpha"];
        assert_eq!(nearest("Thorx", known), ["Thorax"], "one letter");
        assert_eq!(nearest("hips", known), ["mixamorig:Hips"], "without its namespace");
        assert_eq!(nearest("rotationAlpha", known), ["rotation_alpha"], "other spelling");
        assert!(nearest("zzz", known).is_empty(), "nothing alike");
        assert_eq!(by_likeness("thorax", known)[0], "Thorax", "all of them, the most alike first");
        assert_eq!(by_likeness("", ["b", "a"]), ["b", "a"], "ties stay in their order");
    }
}
