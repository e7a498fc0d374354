//! Every biped that moves onto every biped of the corpus, with no config.
//!
//! `cargo matrix` runs all pairs and leaves `target/matrix/pairs.csv` and `target/matrix/summary.md`; a sample of them runs
//! with the tests. `RETARGETD_MATRIX=part-of-a-name cargo matrix` runs the pairs of the files whose path has that part.

mod bipeds;
mod pair;
mod table;

use rayon::prelude::*;

use self::{
    bipeds::{Biped, Loaded},
    pair::Row,
};

/// Share of the pairs that must be within all limits, of all pairs of the corpus. Those of clips in which the figure kneels or
/// crouches are beyond them where the target's legs are of other proportions: these pairs are without the ops behind FK.
const MIN_SHARE: f64 = 0.95;
/// One in so many pairs runs with the tests. A prime, so that every source and every target gets its turn.
const ONE_IN: usize = 23;

#[test]
fn a_sample_of_all_pairs() {
    let Some(loaded) = Loaded::read() else { return };
    let rows = run(&loaded, |index| index % ONE_IN == 0, "");
    let share = table::share_within(&rows);
    assert!(
        share >= MIN_SHARE,
        "{:.1} % of the pairs are within the limits:\n{}",
        share * 100.0,
        table::summary(&rows)
    );
}

#[test]
#[ignore = "all pairs take minutes; `cargo matrix` runs them"]
fn every_pair() {
    let Some(loaded) = Loaded::read() else { return };
    #[expect(clippy::disallowed_methods, reason = "a command for people; no setting of the program")]
    let wanted = std::env::var("RETARGETD_MATRIX").unwrap_or_default();
    let rows = run(&loaded, |_| true, &wanted);
    table::write(&rows);
    let share = table::share_within(&rows);
    assert!(share >= MIN_SHARE, "{:.1} % of the pairs are within the limits", share * 100.0);
}

fn run(loaded: &Loaded, is_wanted: impl Fn(usize) -> bool, part: &str) -> Vec<Row> {
    let sources: Vec<Biped<'_>> = loaded.bipeds("source").into_iter().filter(Biped::moves).collect();
    let targets = loaded.bipeds("target");
    let pairs = sources.iter().flat_map(|source| targets.iter().map(move |target| (source, target)));
    let pairs = pairs.filter(|(source, target)| source.name.contains(part) || target.name.contains(part));
    let wanted: Vec<_> = pairs.enumerate().filter(|(index, _)| is_wanted(*index)).map(|(_, pair)| pair).collect();
    wanted.into_par_iter().map(|(source, target)| Row::of(source, target)).collect()
}
