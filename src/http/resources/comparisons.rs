//! `POST /v1/comparisons`: two results, and how their measures differ.

use axum::{Json, extract::State};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{
    http::{ApiState, auth::Caller, code::Code, extract::JsonBody, problem::Problem},
    jobs::{Jobs, Principal, ResultId},
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new().routes(routes!(compare))
}

/// Two results.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewComparison)]
struct ComparisonBody {
    /// The one that is there.
    first: ComparedBody,
    /// The one that it is compared with.
    second: ComparedBody,
}

/// A result.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewComparedResult)]
struct ComparedBody {
    /// The id of a result of a retarget.
    #[schema(example = "res_01j9z3k8m0q4r6t8v0x2y4a6c8")]
    result: String,
}

/// Which of two is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum Better {
    /// The first.
    First,
    /// The second.
    Second,
    /// Neither of them.
    Neither,
}

/// A result and what was measured of it as a whole.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = ComparedResult)]
struct ComparedView {
    /// The result.
    result: String,
    /// The job that gave it.
    job: String,
    /// `pass`, `warn`, `fail` or `not_applicable`.
    verdict: String,
    /// What that is about.
    verdict_reason: String,
    /// 0 is best.
    score: Option<f64>,
}

/// A metric of both.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = ComparedMetric)]
struct MetricView {
    /// Its name.
    #[schema(example = "foot_slide")]
    name: String,
    /// What it says.
    about: String,
    /// Unit of all values.
    unit: String,
    /// Of the first; nothing where it cannot be measured.
    first: Option<f64>,
    /// Of the second.
    second: Option<f64>,
    /// Second less first; less than 0 is better.
    difference: Option<f64>,
    /// Verdict of the first.
    first_verdict: String,
    /// Verdict of the second.
    second_verdict: String,
    /// Which is better: by its verdict, else by its value where that differs by more than a hundredth of what is a warning.
    better: Better,
}

/// How two results differ.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Comparison)]
struct ComparisonView {
    /// The first.
    first: ComparedView,
    /// The second.
    second: ComparedView,
    /// Which has the better verdict, else the better score.
    better: Better,
    /// Every metric, by name.
    metrics: Vec<MetricView>,
}

/// Measures two results against each other.
///
/// Nothing is run: the values are those of the reports of both. They may be of different clips and characters; what that says is for the
/// caller to know.
#[utoipa::path(post, path = "/v1/comparisons", tag = "results", request_body = ComparisonBody,
    responses((status = 200, body = ComparisonView, description = "the differences")))]
async fn compare(
    State(jobs): State<Jobs>,
    Caller(owner): Caller,
    JsonBody(body): JsonBody<ComparisonBody>,
) -> Result<Json<ComparisonView>, Problem> {
    let (first, of_first) = measured(&jobs, &owner, &body.first, "/first/result").await?;
    let (second, of_second) = measured(&jobs, &owner, &body.second, "/second/result").await?;
    let better = match worse(&first.verdict).cmp(&worse(&second.verdict)) {
        std::cmp::Ordering::Equal => lower(first.score, second.score, 0.0),
        order => by(order),
    };
    let names: std::collections::BTreeSet<&String> = of_first.keys().chain(of_second.keys()).collect();
    let of = |metrics: &Map<String, Value>, name: &str| metrics.get(name).cloned().unwrap_or_default();
    let metrics = names.into_iter().map(|name| metric(name, &of(&of_first, name), &of(&of_second, name))).collect();
    Ok(Json(ComparisonView { first, second, better, metrics }))
}

/// What the report of a result says of it, and its metrics by name.
async fn measured(
    jobs: &Jobs,
    owner: &Principal,
    body: &ComparedBody,
    pointer: &'static str,
) -> Result<(ComparedView, Map<String, Value>), Problem> {
    let id = ResultId::parse(&body.result)
        .map_err(|error| Problem::new(Code::InvalidValue, error.to_string()).at(pointer, Vec::new()))?;
    let result = jobs.result(owner, &id).await?;
    let report = jobs.report(owner, &result.job_id).await?;
    let mut report: Value = serde_json::from_str(&report).map_err(|error| Problem::internal(&error))?;
    let Some(Value::Object(mut measures)) = report.get_mut("measures").map(Value::take) else {
        return Err(Problem::new(Code::InvalidValue, format!("nothing was measured of the result '{id}'"))
            .at(pointer, Vec::new())
            .with_hint("only retargets are measured, unless their config says \"report\": \"none\""));
    };
    let text = |name: &str| measures.get(name).and_then(Value::as_str).unwrap_or_default().to_owned();
    let view = ComparedView {
        result: id.to_string(),
        job: result.job_id.to_string(),
        verdict: text("verdict"),
        verdict_reason: text("verdict_reason"),
        score: measures.get("score").and_then(Value::as_f64),
    };
    match measures.remove("metrics") {
        Some(Value::Object(metrics)) => Ok((view, metrics)),
        _ => Ok((view, Map::new())),
    }
}

fn metric(name: &str, first: &Value, second: &Value) -> MetricView {
    let text = |key: &str| first.get(key).or_else(|| second.get(key)).and_then(Value::as_str).unwrap_or_default();
    let verdict = |of: &Value| of.get("verdict").and_then(Value::as_str).unwrap_or("not_applicable").to_owned();
    let value = |of: &Value| of.get("value").and_then(Value::as_f64);
    let (first_verdict, second_verdict) = (verdict(first), verdict(second));
    let warning = first.get("warn_above").and_then(Value::as_f64).unwrap_or(0.0);
    let better = match worse(&first_verdict).cmp(&worse(&second_verdict)) {
        std::cmp::Ordering::Equal => lower(value(first), value(second), warning / 100.0),
        _ if value(first).is_none() || value(second).is_none() => Better::Neither,
        order => by(order),
    };
    MetricView {
        name: name.to_owned(),
        about: text("about").to_owned(),
        unit: text("unit").to_owned(),
        first: value(first),
        second: value(second),
        difference: value(first).zip(value(second)).map(|(first, second)| second - first),
        first_verdict,
        second_verdict,
        better,
    }
}

/// How bad a verdict is.
fn worse(verdict: &str) -> u8 {
    match verdict {
        "fail" => 3,
        "warn" => 2,
        "pass" => 1,
        _ => 0,
    }
}

const fn by(order: std::cmp::Ordering) -> Better {
    match order {
        std::cmp::Ordering::Less => Better::First,
        std::cmp::Ordering::Greater => Better::Second,
        std::cmp::Ordering::Equal => Better::Neither,
    }
}

fn lower(first: Option<f64>, second: Option<f64>, least: f64) -> Better {
    match first.zip(second) {
        Some((first, second)) if (first - second).abs() > least => by(first.total_cmp(&second)),
        _ => Better::Neither,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn the_lower_value_is_better_where_verdicts_are_the_same() {
        let of =
            |value: f64, verdict: &str| json!({"value": value, "verdict": verdict, "unit": "cm", "warn_above": 1.0});
        let view = metric("foot_slide", &of(2.0, "warn"), &of(1.5, "warn"));
        assert_eq!((view.better, view.difference), (Better::Second, Some(-0.5)), "less slide");
        assert_eq!(metric("foot_slide", &of(0.9, "pass"), &of(1.5, "warn")).better, Better::First, "by the verdict");
        assert_eq!(
            metric("foot_slide", &of(1.5, "warn"), &of(1.505, "warn")).better,
            Better::Neither,
            "as good as equal"
        );
        let none = json!({"verdict": "not_applicable"});
        assert_eq!(metric("foot_slide", &none, &of(0.9, "pass")).better, Better::Neither, "not measured is not better");
    }
}
