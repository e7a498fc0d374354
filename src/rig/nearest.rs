//! Names that look like one that does not exist.

/// How many are offered.
const MOST: usize = 3;
/// Below this likeness (0 to 1) a name is not offered.
const MIN_LIKENESS: f64 = 0.6;
/// Nor one that is less alike than the best by more than this.
const MAX_BEHIND: f64 = 0.2;

/// The known names that look most like `name`, best first; ties in the order given.
pub(crate) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let lower = name.to_lowercase();
    let likeness = |candidate: &str| {
        let candidate = candidate.to_lowercase();
        let bare = candidate.rsplit(':').next().unwrap_or_default();
        strsim::normalized_damerau_levenshtein(&lower, &candidate)
            .max(strsim::normalized_damerau_levenshtein(&lower, bare))
            .max(strsim::jaro_winkler(&lower, &candidate) - 0.2)
    };
    let mut scored: Vec<(f64, &str)> = known
        .into_iter()
        .map(|candidate| (likeness(candidate), candidate))
        .filter(|(score, _)| *score >= MIN_LIKENESS)
        .collect();
    scored.sort_by(|first, second| second.0.total_cmp(&first.0));
    scored.dedup_by(|first, second| first.1 == second.1);
    // What is much less alike than the best is no answer beside it.
    let worst = scored.first().map_or(0.0, |(best, _)| best - MAX_BEHIND);
    scored.retain(|(score, _)| *score >= worst);
    scored.into_iter().take(MOST).map(|(_, candidate)| candidate.to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn misspellings_find_their_name() {
        let known = ["mixamorig:Hips", "mixamorig:Spine", "Thorax", "rotation_alpha"];
        assert_eq!(nearest("Thorx", known), ["Thorax"], "one letter");
        assert_eq!(nearest("hips", known), ["mixamorig:Hips"], "without its namespace");
        assert_eq!(nearest("rotationAlpha", known), ["rotation_alpha"], "other spelling");
        assert!(nearest("zzz", known).is_empty(), "nothing alike");
    }
}
