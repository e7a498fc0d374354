//! Percentiles and the like.

/// The value below which a share of the values lies, by the nearest rank; 0 for none. Puts the values into another order.
pub(super) fn percentile(values: &mut [f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
    let index = ((values.len() - 1) as f64 * share).round() as usize;
    *values.select_nth_unstable_by(index.min(values.len() - 1), f64::total_cmp).1
}

/// How many frames there are a second on the mean; 0 for a single one.
pub(super) fn frames_per_second(times_seconds: &[f64]) -> f64 {
    let seconds = times_seconds.last().zip(times_seconds.first()).map_or(0.0, |(last, first)| last - first);
    if seconds > 0.0 { (times_seconds.len() - 1) as f64 / seconds } else { 0.0 }
}

/// The mean of what is finite; 0 for none.
pub(super) fn mean(values: &[f64]) -> f64 {
    let finite = values.iter().filter(|value| value.is_finite());
    let (sum, count) = finite.fold((0.0, 0_usize), |(sum, count), value| (sum + value, count + 1));
    if count > 0 { sum / count as f64 } else { 0.0 }
}
