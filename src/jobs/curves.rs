//! What was measured of a job, at every frame. Reports are kept with few values a curve; all of them are found again when somebody asks.

use serde_json::{Value, json};

use super::{Engine, EngineRequest, Jobs, Question, Refusal, engine::InputBytes, library, looks::Look};
use crate::{
    engine::{Control, Failure, Format},
    store::{ConfigDocument, JobId, JobRecord, JobTask, Principal},
};

impl Jobs {
    /// The curves of a job's measures with a value for each frame, as a JSON object; an empty one where nothing is measured: of an edit, of a
    /// pose, and where the config asks for no measures.
    ///
    /// # Errors
    /// When there is no such job, it has not succeeded, or there is no room to measure it again.
    pub async fn curves(&self, owner: &Principal, id: &JobId) -> Result<Value, Refusal> {
        let spec = self.resolved_spec(owner, id).await?;
        let JobRecord { mut request, memory_bytes, .. } = self.record(owner, id).await?;
        let Some(text) = spec_for_curves(&spec).filter(|_| request.task == JobTask::Retarget) else {
            return Ok(json!({}));
        };
        request.config = Some(ConfigDocument { file_name: "config.json".to_owned(), text: text.into() });
        let look = Look { owner, thread: "curves", what: "measuring every frame", memory_bytes };
        let load = async {
            let bytes = InputBytes::read(&self.0.store, &request).await?;
            Ok((bytes, library::knowledge(&self.0.store, owner, &request.rigs).await?, request.clone()))
        };
        let report = self.look(look, load, |(bytes, knowledge, request), engine, limits, control| {
            let files = bytes.files(request);
            let formats = &[Format::PosesNpz];
            let asked = EngineRequest { question: Question::Retarget, files, formats, knowledge, limits };
            measured(&asked, engine, control)
        });
        Ok(report.await?.pointer_mut("/measures/curves").map_or_else(|| json!({}), Value::take))
    }
}

fn measured(asked: &EngineRequest<'_>, engine: &dyn Engine, control: &Control) -> Result<Value, Failure> {
    Ok(serde_json::from_str(&engine.ask(asked, control)?.ran()?.report).unwrap_or_default())
}

/// The spec that measures every frame; nothing where it asks for no measures. What is written of it does not matter.
fn spec_for_curves(resolved: &str) -> Option<String> {
    let mut spec: Value = serde_json::from_str(resolved).ok()?;
    let detail = spec.pointer("/report/detail").or_else(|| spec.get("report")).and_then(Value::as_str);
    if detail == Some("none") {
        return None;
    }
    match spec.get_mut("report") {
        Some(Value::Object(report)) => drop(report.insert("detail".to_owned(), json!("full"))),
        _ => spec["report"] = json!("full"),
    }
    spec.as_object_mut()?.remove("output");
    Some(spec.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_stays_but_how_much_is_measured() {
        let read = |text: &str| spec_for_curves(text).map(|text| serde_json::from_str::<Value>(&text).expect("JSON"));
        assert_eq!(read(r#"{"align": "none", "output": []}"#), Some(json!({"align": "none", "report": "full"})));
        assert_eq!(read(r#"{"report": "none"}"#), None, "who wants no measures gets none");
        let spec = read(r#"{"report": {"detail": "summary", "thresholds": {}}}"#);
        assert_eq!(spec, Some(json!({"report": {"detail": "full", "thresholds": {}}})), "thresholds stay");
    }
}
