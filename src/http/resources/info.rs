//! What the service says of itself: limits, formats, schemas, version, and where to go.

use axum::{
    Json,
    extract::State,
    http::{HeaderMap, HeaderValue, header},
    response::{IntoResponse, Redirect, Response},
};
use serde::Serialize;
use utoipa::ToSchema;
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{
    config::Settings,
    engine::{FindingCode, Format, draw_spec_schema, drawing_limits, template_schema},
    http::{ApiState, Shared, extract, json_text, negotiate::prefers_page, upload::MAX_PICTURE_BYTES},
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new()
        .routes(routes!(discovery))
        .routes(routes!(version))
        .routes(routes!(limits))
        .routes(routes!(formats))
        .routes(routes!(spec_schema))
        .routes(routes!(draw_schema))
        .routes(routes!(rig_schema))
        .routes(routes!(findings))
}

/// Where to go from the root.
#[derive(Debug, Serialize, ToSchema)]
struct Discovery {
    /// `retargetd`.
    name: &'static str,
    /// The version that runs.
    version: &'static str,
    /// One line.
    description: &'static str,
    /// How to begin.
    try_this: &'static str,
    /// Where things are.
    links: Links,
}

/// Where things are.
#[derive(Debug, Serialize, ToSchema)]
struct Links {
    docs: &'static str,
    /// The page for people; absent where it is turned off.
    #[serde(skip_serializing_if = "Option::is_none")]
    studio: Option<&'static str>,
    openapi: &'static str,
    retarget: &'static str,
    drawings: &'static str,
    assets: &'static str,
    jobs: &'static str,
    batches: &'static str,
    edits: &'static str,
    poses: &'static str,
    explanations: &'static str,
    webhooks: &'static str,
    events: &'static str,
    mapping_suggestions: &'static str,
    config_checks: &'static str,
    rigs: &'static str,
    presets: &'static str,
    formats: &'static str,
    findings: &'static str,
    problems: &'static str,
    limits: &'static str,
    usage: &'static str,
    retarget_spec_schema: &'static str,
    rig_template_schema: &'static str,
    ready: &'static str,
    metrics: &'static str,
}

/// Lists the entry points.
///
/// Leads who accepts `text/html` more gladly than JSON, as browsers do, to the page for people: the studio, or the documents where it is
/// turned off.
#[utoipa::path(get, path = "/", tag = "service",
    params(("Accept" = Option<String>, Header, description = "`text/html` for the page")),
    responses((status = 200, body = Discovery, description = "where to go"),
        (status = 307, description = "to the page for people", headers(("Location" = String)))))]
async fn discovery(State(settings): State<Shared<Settings>>, headers: HeaderMap) -> Response {
    let has_studio = settings.studio.0;
    let mut response = if prefers_page(extract::text(&headers, &header::ACCEPT)) {
        Redirect::temporary(if has_studio { "/studio/" } else { "/docs" }).into_response()
    } else {
        where_to_go(has_studio).into_response()
    };
    response.headers_mut().insert(header::VARY, HeaderValue::from_static("accept"));
    response
}

fn where_to_go(has_studio: bool) -> Json<Discovery> {
    Json(Discovery {
        name: env!("CARGO_PKG_NAME"),
        version: env!("CARGO_PKG_VERSION"),
        description: env!("CARGO_PKG_DESCRIPTION"),
        try_this: "curl -F source=@walk.bvh -F target=@hero.glb <this address>/v1/retarget -o out.glb",
        links: Links {
            docs: "/docs",
            studio: has_studio.then_some("/studio/"),
            openapi: "/openapi.json",
            retarget: "/v1/retarget",
            drawings: "/v1/drawings",
            assets: "/v1/assets",
            jobs: "/v1/jobs",
            batches: "/v1/batches",
            edits: "/v1/edits",
            poses: "/v1/poses",
            explanations: "/v1/explanations",
            webhooks: "/v1/webhooks",
            events: "/v1/events",
            mapping_suggestions: "/v1/mapping-suggestions",
            config_checks: "/v1/config-checks",
            rigs: "/v1/rigs",
            presets: "/v1/presets",
            formats: "/v1/formats",
            findings: "/v1/findings",
            problems: "/problems",
            limits: "/v1/limits",
            usage: "/v1/usage",
            retarget_spec_schema: "/v1/schemas/retarget-spec",
            rig_template_schema: "/v1/schemas/rig-template",
            ready: "/readyz",
            metrics: "/metrics",
        },
    })
}

/// What runs.
#[derive(Debug, Serialize, ToSchema)]
struct Version {
    /// `retargetd`.
    name: &'static str,
    /// The version.
    version: &'static str,
}

/// Shows the version.
#[utoipa::path(get, path = "/version", tag = "service", responses((status = 200, body = Version, description = "the version")))]
async fn version() -> Json<Version> {
    Json(Version { name: env!("CARGO_PKG_NAME"), version: env!("CARGO_PKG_VERSION") })
}

/// A limit.
#[derive(Debug, Serialize, ToSchema)]
struct Limit {
    /// Its name, as in the member `limit` of problems.
    #[schema(example = "file_bytes")]
    name: &'static str,
    /// Its value.
    #[schema(value_type = f64, example = 268_435_456)]
    value: serde_json::Number,
    /// `bytes`, `seconds` or `count`.
    unit: &'static str,
    /// What it bounds.
    bounds: &'static str,
    /// The flag of `retargetd serve` that changes it; absent where nothing does.
    #[serde(skip_serializing_if = "Option::is_none")]
    flag: Option<String>,
    /// The environment variable that changes it; absent where nothing does.
    #[serde(skip_serializing_if = "Option::is_none")]
    variable: Option<String>,
}

/// The limits.
#[derive(Debug, Serialize, ToSchema)]
struct Limits {
    /// All of them.
    limits: Vec<Limit>,
}

/// Lists every limit.
#[utoipa::path(get, path = "/v1/limits", tag = "service", responses((status = 200, body = Limits, description = "every limit")))]
async fn limits(State(settings): State<Shared<Settings>>) -> Json<Limits> {
    let views = settings.limits().into_iter().map(|limit| Limit {
        name: limit.setting.limit_name(),
        value: number(limit.value),
        unit: limit.setting.unit.name(),
        bounds: limit.setting.help.trim(),
        flag: Some(limit.setting.flag()),
        variable: Some(limit.setting.variable()),
    });
    let fixed = drawing_limits().into_iter().map(|(name, value, bounds)| (name, value as u64, "count", bounds));
    let bytes = (
        "drawing_picture_bytes",
        MAX_PICTURE_BYTES,
        "bytes",
        "Bytes of a picture that is sent by itself as a part of a drawing",
    );
    let fixed = fixed.chain([bytes]).map(|(name, value, unit, bounds)| Limit {
        name,
        value: value.into(),
        unit,
        bounds,
        flag: None,
        variable: None,
    });
    Json(Limits { limits: views.chain(fixed).collect() })
}

/// Whole numbers are written without a fraction.
fn number(value: f64) -> serde_json::Number {
    let whole = value as u64;
    if whole as f64 == value {
        return whole.into();
    }
    serde_json::Number::from_f64(value).unwrap_or_else(|| 0.into())
}

/// A file format.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Format)]
struct FormatView {
    /// Its name.
    name: &'static str,
    /// File endings, without the dot.
    endings: &'static [&'static str],
    /// The media type.
    media_type: &'static str,
    /// Whether it can be uploaded.
    reads: bool,
    /// Whether it can be a result.
    writes: bool,
    /// One line.
    description: &'static str,
}

/// The formats.
#[derive(Debug, Serialize, ToSchema)]
struct Formats {
    /// All of them.
    formats: Vec<FormatView>,
}

/// Lists every file format.
#[utoipa::path(get, path = "/v1/formats", tag = "service", responses((status = 200, body = Formats, description = "every format")))]
async fn formats() -> Json<Formats> {
    let views = Format::ALL.into_iter().map(Format::info).map(|info| FormatView {
        name: info.name,
        endings: info.endings,
        media_type: info.media_type,
        reads: info.reads,
        writes: info.writes,
        description: info.description,
    });
    Json(Formats { formats: views.collect() })
}

/// Returns the JSON Schema of the retarget spec.
#[utoipa::path(get, path = "/v1/schemas/retarget-spec", tag = "service",
    responses((status = 200, body = Object, description = "a JSON Schema")))]
async fn spec_schema(State(state): State<ApiState>) -> Response {
    json_text((state.spec_schema)().to_string())
}

/// Gives the JSON Schema of the spec of drawings that move.
#[utoipa::path(get, path = "/v1/schemas/draw-spec", tag = "service",
    responses((status = 200, body = Object, description = "a JSON Schema")))]
async fn draw_schema() -> Response {
    json_text(draw_spec_schema().to_string())
}

/// Gives the JSON Schema of rig templates.
#[utoipa::path(get, path = "/v1/schemas/rig-template", tag = "service",
    responses((status = 200, body = Object, description = "a JSON Schema")))]
async fn rig_schema() -> Response {
    json_text(template_schema().to_string())
}

/// A finding of the rig doctor.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = FindingKind)]
struct FindingKindView {
    /// Its code, as in `findings` of a skeleton. Never changes its meaning.
    #[schema(example = "knee_bends_backwards")]
    code: &'static str,
    /// `error`: motion cannot come out right before it is mended; `warning`: it may come out wrong, or something is lost; `note`:
    /// good to know.
    severity: &'static str,
    /// What it means.
    about: &'static str,
    /// What to do about it.
    fix: &'static str,
}

/// The findings.
#[derive(Debug, Serialize, ToSchema)]
struct FindingKinds {
    /// All of them.
    findings: Vec<FindingKindView>,
}

/// Lists every finding that an inspection can have.
#[utoipa::path(get, path = "/v1/findings", tag = "service", responses((status = 200, body = FindingKinds, description = "every finding")))]
async fn findings() -> Json<FindingKinds> {
    let view = |code: &FindingCode| FindingKindView {
        code: code.name(),
        severity: code.severity().name(),
        about: code.about(),
        fix: code.fix(),
    };
    Json(FindingKinds { findings: FindingCode::ALL.iter().map(view).collect() })
}
