//! The JSON that asks for a batch.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use serde::Deserialize;
use serde_json::{Map, Value, json};
use utoipa::ToSchema;

use super::new_job::{InputBody, NewJobBody, check_labels};
use crate::{
    config::Settings,
    engine::merge_patch,
    http::{body::too_large, code::Code, extract, json_size::bytes_of_object, problem::Problem},
    jobs::{NewBatch, NewJob, OnError},
};

/// How many things that are wrong with items are told at once.
const MAX_ERRORS: usize = 100;

/// Asks for jobs together: `items`, or all pairs of a `matrix`.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewBatch)]
pub(in crate::http) struct NewBatchBody {
    /// What all items have that do not say otherwise, as in the body of `POST /v1/jobs`. An item is laid over it: objects are merged member
    /// by member, everything else (lists too) is taken from the item where it says something (RFC 7396).
    #[serde(default)]
    #[schema(value_type = Option<Object>, example = json!({"target": {"asset": "ast_00000000000000000000000002"}}))]
    defaults: Map<String, Value>,
    /// The items, each as the body of `POST /v1/jobs`, without what it has from `defaults`.
    #[schema(value_type = Option<Vec<Object>>, example = json!([{"source": {"asset": "ast_00000000000000000000000001"}, "labels": {"name": "walk"}}]))]
    items: Option<Vec<Map<String, Value>>>,
    /// Every source onto every target, with every spec.
    matrix: Option<MatrixBody>,
    /// What a failure does to the jobs that have not started: nothing, or they do not start any more.
    #[serde(default)]
    on_error: OnErrorBody,
    /// With `true`, one item that cannot be run is answered with its problem, and nothing is asked for. Otherwise such items are jobs that
    /// have failed, and the others run.
    #[serde(default)]
    atomic: bool,
    /// Words of your own about the batch, given back with it.
    #[serde(default)]
    labels: BTreeMap<String, String>,
    /// Checks everything that can be checked without reading files, and says which items could not be run. Nothing is asked for.
    #[serde(default)]
    pub(super) validate_only: bool,
}

/// Every source onto every target, with every spec: items in the order of sources, then of targets, then of specs.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewBatchMatrix)]
struct MatrixBody {
    /// The files with the animations.
    sources: Vec<MatrixFileBody>,
    /// The files with the characters that they go onto.
    targets: Vec<MatrixFileBody>,
    /// What is done with each pair, as in `defaults`: `config`, `preset`, `output` and so on. Left out, what `defaults` say.
    #[serde(default)]
    #[schema(value_type = Option<Vec<Object>>)]
    specs: Vec<Map<String, Value>>,
}

/// A file of a matrix.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewBatchMatrixFile)]
struct MatrixFileBody {
    /// The id of an asset. Three ids name samples, as in `POST /v1/jobs`.
    #[schema(example = "ast_00000000000000000000000001")]
    asset: String,
    /// The same rig in its rest pose, where the file does not hold it.
    rest: Option<InputBody>,
    /// Labels of the items with this file.
    #[serde(default)]
    labels: BTreeMap<String, String>,
}

/// What a failure does to the jobs of the same batch that have not started.
#[derive(Clone, Copy, Debug, Default, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[schema(as = OnError)]
enum OnErrorBody {
    /// Nothing.
    #[default]
    Continue,
    /// They do not start any more.
    Stop,
}

impl NewBatchBody {
    /// What is asked for.
    ///
    /// # Errors
    /// When there are no items or too many, or items cannot be read: all of them, with pointers.
    pub(in crate::http) fn read(self, settings: &Settings) -> Result<NewBatch, Problem> {
        let labels = check_labels(self.labels, settings)?;
        let items = match (self.items, self.matrix) {
            (Some(items), None) => {
                check_count(items.len() as u64, "/items", settings)?;
                let own = items.iter().map(bytes_of_object).sum();
                check_bytes(&self.defaults, items.len() as u64, own, "/items", settings)?;
                all(items.into_iter().map(|over| read_item(&self.defaults, over, settings)))?
            }
            (None, Some(matrix)) => {
                let (count, own) = matrix.size();
                check_count(count, "/matrix", settings)?;
                check_bytes(&self.defaults, count, own, "/matrix", settings)?;
                all(matrix.items().map(|over| read_item(&self.defaults, over, settings)))?
            }
            _ => {
                let detail = "a batch has either 'items' or a 'matrix'";
                return Err(Problem::new(Code::InvalidValue, detail).at("/items", Vec::new()).with_hint(ITEMS_HINT));
            }
        };
        let on_error = match self.on_error {
            OnErrorBody::Continue => OnError::Continue,
            OnErrorBody::Stop => OnError::Stop,
        };
        Ok(NewBatch { items, on_error, is_atomic: self.atomic, labels, idempotency_key: None })
    }
}

impl MatrixBody {
    /// How many items there are, and what they take up beside the defaults: found out without making one.
    fn size(&self) -> (u64, u64) {
        let [sources, targets] = [&self.sources, &self.targets].map(|files| files.len() as u64);
        let specs = self.specs.len().max(1) as u64;
        let bytes = |files: &[MatrixFileBody]| files.iter().map(MatrixFileBody::bytes).sum::<u64>();
        let of_specs = self.specs.iter().map(bytes_of_object).sum::<u64>();
        let product = |first: u64, second: u64, third: u64| first.saturating_mul(second).saturating_mul(third);
        let of_sources = product(bytes(&self.sources), targets, specs);
        let of_targets = product(bytes(&self.targets), sources, specs);
        let own = product(of_specs, sources, targets).saturating_add(of_sources).saturating_add(of_targets);
        (product(sources, targets, specs), own)
    }

    /// What each pair lays over the defaults, made as it is asked for.
    fn items(&self) -> impl Iterator<Item = Map<String, Value>> {
        let specs: Vec<Option<&Map<String, Value>>> =
            if self.specs.is_empty() { vec![None] } else { self.specs.iter().map(Some).collect() };
        let pairs = self.sources.iter().flat_map(|source| self.targets.iter().map(move |target| (source, target)));
        pairs.flat_map(move |(source, target)| {
            let item = |spec: Option<&Map<String, Value>>| {
                let mut item = Value::Object(spec.cloned().unwrap_or_default());
                for (role, file) in [("source", source), ("target", target)] {
                    merge_patch(&mut item, file.item(role));
                }
                if let Value::Object(item) = item { item } else { Map::new() }
            };
            specs.clone().into_iter().map(item).collect::<Vec<_>>()
        })
    }
}

impl MatrixFileBody {
    /// What it takes up in an item.
    fn bytes(&self) -> u64 {
        let labels = self.labels.iter().map(|(name, text)| (name.len() + text.len()) as u64).sum::<u64>();
        self.asset.len() as u64 + self.rest.as_ref().map_or(0, |rest| rest.asset.len() as u64) + labels
    }

    /// What an item has of it.
    fn item(&self, role: &str) -> Map<String, Value> {
        let mut item = Map::new();
        item.insert(role.to_owned(), json!({"asset": self.asset}));
        if let Some(rest) = &self.rest {
            item.insert(format!("{role}_rest"), json!({"asset": rest.asset}));
        }
        if !self.labels.is_empty() {
            item.insert("labels".to_owned(), json!(self.labels));
        }
        item
    }
}

fn check_count(count: u64, pointer: &str, settings: &Settings) -> Result<(), Problem> {
    let most = settings.max_batch_items;
    if (1..=most).contains(&count) {
        return Ok(());
    }
    let detail = format!("there are {count} items; a batch has from 1 to {most} (the limit 'batch_items')");
    let problem = Problem::new(Code::InvalidValue, detail).about_limit("batch_items", most, count);
    Err(problem.at(pointer, Vec::new()).with_hint(if count == 0 {
        ITEMS_HINT
    } else {
        "ask for them in several batches"
    }))
}

/// What a batch is made of.
const ITEMS_HINT: &str = "an item is what POST /v1/jobs takes, {\"source\": …, \"target\": …}; a matrix has lists of 'sources' and 'targets'";

/// Refuses what would take up too much once every item has what it is given by the defaults and the matrix.
fn check_bytes(
    defaults: &Map<String, Value>,
    count: u64,
    own: u64,
    pointer: &str,
    settings: &Settings,
) -> Result<(), Problem> {
    let (most, actual) =
        (settings.max_batch_bytes.0, bytes_of_object(defaults).saturating_mul(count).saturating_add(own));
    if actual <= most {
        return Ok(());
    }
    let problem = too_large("what the items of the batch have together", "batch_bytes", most, actual);
    Err(problem.at(pointer, Vec::new()).with_hint("ask for it in several batches, or keep the config as a preset"))
}

fn read_item(defaults: &Map<String, Value>, over: Map<String, Value>, settings: &Settings) -> Result<NewJob, Problem> {
    let mut item = Value::Object(defaults.clone());
    merge_patch(&mut item, over);
    let body: NewJobBody = extract::read_value(item)?;
    if body.validate_only {
        let detail = "'validate_only' is said of the whole batch";
        return Err(Problem::new(Code::InvalidValue, detail).at("/validate_only", Vec::new()));
    }
    body.read(settings)
}

/// Has equal texts be one.
fn share(text: &mut Arc<str>, texts: &mut BTreeSet<Arc<str>>) {
    match texts.get(text) {
        Some(same) => *text = Arc::clone(same),
        None => drop(texts.insert(Arc::clone(text))),
    }
}

/// All items, or the problem of the first that cannot be read, with what is wrong with the others.
fn all(items: impl Iterator<Item = Result<NewJob, Problem>>) -> Result<Vec<NewJob>, Problem> {
    let (mut good, mut bad): (Vec<NewJob>, Option<Problem>) = (Vec::new(), None);
    let mut texts = BTreeSet::new();
    for (number, item) in items.enumerate() {
        match item {
            // Once there is one problem, only problems are told.
            Ok(_) if bad.is_some() => {}
            Ok(mut job) => {
                if let Some(config) = &mut job.config {
                    share(&mut config.text, &mut texts);
                }
                good.push(job);
            }
            Err(problem) => {
                let problem = problem.below(&format!("/items/{number}"));
                match &mut bad {
                    None => bad = Some(problem),
                    Some(bad) if bad.errors.len() < MAX_ERRORS => bad.errors.extend(problem.errors),
                    Some(_) => {}
                }
            }
        }
    }
    bad.map_or(Ok(good), Err)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: &str = "ast_01j9z3k8m0q4r6t8v0x2y4a6c8";
    const OTHER: &str = "ast_01j9z3k8m0q4r6t8v0x2y4a6c9";

    fn read(body: Value) -> Result<NewBatch, Problem> {
        extract::read_value::<NewBatchBody>(body)?.read(&Settings::default())
    }

    #[test]
    fn an_item_is_laid_over_the_defaults() {
        let defaults =
            json!({"target": {"asset": ONE}, "config": {"align": "off", "edit": {"fps": 30}}, "labels": {"shot": "1"}});
        let items = json!([{"source": {"asset": OTHER}, "config": {"edit": {"reverse": true}, "align": null}, "labels": {"name": "walk"}}]);
        let batch = read(json!({"defaults": defaults, "items": items})).expect("is read");
        let expected = read(json!({"items": [{
            "source": {"asset": OTHER}, "target": {"asset": ONE}, "config": {"edit": {"fps": 30, "reverse": true}},
            "labels": {"shot": "1", "name": "walk"},
        }]}));
        assert_eq!(batch, expected.expect("is read"), "member by member, and null takes away");
    }

    #[test]
    fn a_matrix_is_every_source_onto_every_target_with_every_spec() {
        let matrix = json!({"sources": [{"asset": ONE, "labels": {"clip": "a"}}, {"asset": OTHER, "rest": {"asset": ONE}}],
            "targets": [{"asset": OTHER, "labels": {"hero": "b"}}], "specs": [{"output": ["glb"]}, {"output": ["bvh"]}]});
        let batch = read(json!({"matrix": matrix})).expect("is read");
        let source = |asset: &str| json!({"asset": asset});
        let items = json!([
            {"source": source(ONE), "target": source(OTHER), "output": ["glb"], "labels": {"clip": "a", "hero": "b"}},
            {"source": source(ONE), "target": source(OTHER), "output": ["bvh"], "labels": {"clip": "a", "hero": "b"}},
            {"source": source(OTHER), "source_rest": source(ONE), "target": source(OTHER), "output": ["glb"], "labels": {"hero": "b"}},
            {"source": source(OTHER), "source_rest": source(ONE), "target": source(OTHER), "output": ["bvh"], "labels": {"hero": "b"}},
        ]);
        assert_eq!(batch, read(json!({"items": items})).expect("is read"), "in that order");
    }

    #[test]
    fn everything_that_is_wrong_is_told_with_its_item() {
        let problem = read(json!({"defaults": {"target": {"asset": ONE}}, "items": [
            {"source": {"asset": ONE}}, {"source": {"asset": "nonsense"}}, {"source": {"asset": ONE}, "outputs": []},
        ]}));
        let pointers = problem.expect_err("two are wrong").errors.into_iter().map(|error| error.pointer);
        assert_eq!(pointers.collect::<Vec<_>>(), ["/items/1/source/asset", "/items/2/outputs"], "both");
        let none = [json!({}), json!({"items": []}), json!({"items": [], "matrix": {"sources": [], "targets": []}})];
        for body in none {
            assert!(read(body.clone()).is_err(), "{body} asks for nothing");
        }
        let many = json!({"sources": vec![json!({"asset": ONE}); 40], "targets": vec![json!({"asset": ONE}); 26]});
        assert_eq!(read(json!({"matrix": many})).expect_err("too many").code, Code::InvalidValue, "1,040 pairs");
    }
}
