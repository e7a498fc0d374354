//! What `strict` means, of a config and on the command line.

use crate::retarget::{Measures, Verdict};

use super::{Failure, FailureCode, FieldError, WarningView};

/// Refuses warnings, and measures that fail.
///
/// # Errors
/// When there is a warning, or a measure fails.
pub fn check_strict(warnings: &[WarningView], measures: Option<&Measures>) -> Result<(), Failure> {
    if !warnings.is_empty() {
        return Err(strict_failure(warnings));
    }
    match measures.filter(|measures| measures.verdict == Verdict::Fail) {
        Some(failed) => Err(strict_measures_failure(failed)),
        None => Ok(()),
    }
}

fn strict_failure(warnings: &[WarningView]) -> Failure {
    let first = &warnings[0];
    let detail = format!(
        "strict was asked for and there are {} warnings; the first is {}: {}",
        warnings.len(),
        first.code,
        first.detail
    );
    let errors = warnings.iter().map(|warning| FieldError {
        pointer: String::new(),
        code: warning.code.into(),
        detail: format!("{}: {}", warning.place, warning.detail),
        did_you_mean: Vec::new(),
    });
    Failure::new(FailureCode::StrictWarnings, detail)
        .with_hint("mend what the warnings name, or leave strict out")
        .with_errors(errors.collect())
}

fn strict_measures_failure(measures: &Measures) -> Failure {
    let failed = measures.metrics.iter().filter(|(_, metric)| metric.verdict == Verdict::Fail);
    let errors: Vec<FieldError> = failed
        .map(|(name, metric)| {
            let value = metric.value.unwrap_or_default();
            let worst = metric.worst.first();
            let place =
                worst.map_or_else(String::new, |worst| format!("; worst at frame {}, '{}'", worst.frame, worst.joint));
            FieldError {
                pointer: format!("/report/thresholds/{}", name.name()),
                code: name.name().into(),
                detail: format!("{value} {} where {} is the most{place}", metric.unit, metric.fail_above),
                did_you_mean: Vec::new(),
            }
        })
        .collect();
    let first = errors.first().map(|error| format!("{}: {}", error.code, error.detail)).unwrap_or_default();
    Failure::new(
        FailureCode::StrictMeasures,
        format!("strict was asked for and {} measures fail; the first is {first}", errors.len()),
    )
    .with_hint("look at the report without strict, or set report.thresholds to what is good enough for you")
    .with_errors(errors)
}
