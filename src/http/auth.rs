//! Who asks, and what they may do.
//!
//! Where callers must say who they are, every route but the open ones wants `Authorization: Bearer …` with a key (`rtk_…`) or, where an
//! issuer of tokens is named, with a token of it. Whoever has either is a principal and sees what belongs to that principal;
//! everything else is not there, so that ids tell nothing. Where nobody has to, everybody is the same principal and may do everything.

use axum::{
    extract::{FromRequestParts, MatchedPath, Query, Request, State},
    http::{HeaderMap, HeaderValue, Method, StatusCode, Uri, header, request::Parts},
    middleware::Next,
    response::{IntoResponse, Response},
};

use super::{ApiState, code::Code, extract, neighbors, problem::Problem};
use crate::{
    identity::{Identity, TokenError},
    jobs::{ApiKeyRecord, Keys, Principal, Scope},
    telemetry::Metric,
};

/// Who asks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Caller(pub(super) Principal);

impl<S: Send + Sync> FromRequestParts<S> for Caller {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        // The layer that says who asks is around every route that has one.
        parts
            .extensions
            .get::<Self>()
            .cloned()
            .ok_or_else(|| Problem::internal(&"a request reached a handler without an authenticated caller"))
    }
}

/// Where keys are.
const KEYS: &str = "/v1/keys";
/// Where tokens for event streams are made.
const STREAM_TOKENS: &str = "/v1/stream-tokens";
/// The streams that they open.
const STREAMS: [&str; 3] = ["/v1/events", "/v1/jobs/{id}/events", "/v1/batches/{id}/events"];

/// What a route asks for; nothing where everybody may come in: what is the same for all, and holds nothing of anybody.
#[must_use]
pub(super) fn needed_scope(method: &Method, route: &str) -> Option<Scope> {
    const OPEN: [&str; 6] = [
        "/v1/formats",
        "/v1/limits",
        "/v1/findings",
        "/v1/schemas/retarget-spec",
        "/v1/schemas/draw-spec",
        "/v1/schemas/rig-template",
    ];
    // Whoever may look may ask for a token to look with.
    if route == STREAM_TOKENS {
        return Some(Scope::Read);
    }
    // A sample of the studio becomes an asset of whoever asks.
    let is_asset = route.starts_with("/studio/") && *method == Method::POST;
    let is_guarded = route == "/metrics" || route.starts_with("/v1/") || is_asset;
    if !is_guarded || OPEN.contains(&route) {
        return None;
    }
    Some(match *method {
        // The metrics tell how much everybody does.
        _ if route.starts_with(KEYS) || route == "/metrics" => Scope::Admin,
        Method::GET | Method::HEAD => Scope::Read,
        _ => Scope::Write,
    })
}

pub(super) async fn authenticate(
    State(state): State<ApiState>,
    route: Option<MatchedPath>,
    mut request: Request,
    next: Next,
) -> Response {
    let is_stream = route.as_ref().is_some_and(|route| STREAMS.contains(&route.as_str()));
    let needed = route.and_then(|route| needed_scope(request.method(), route.as_str()));
    let token = stream_token(request.uri()).filter(|_| is_stream);
    let caller = match (state.settings.asks_who_calls(), needed) {
        (true, Some(scope)) => match admitted(&state, request.headers(), token.as_deref(), scope).await {
            Ok(caller) => caller,
            Err(denied) => {
                if denied.has_shown_something() {
                    state.turns.keep_back(false).await;
                }
                return denied.into_response();
            }
        },
        (false, Some(_)) => match admitted_unknown(&state, &request) {
            Ok(caller) => caller,
            Err(problem) => return problem.into_response(),
        },
        (_, None) => Caller(Principal::anonymous()),
    };
    // Where nobody is asked, everybody is the same caller and has everything.
    let is_known = state.settings.asks_who_calls() && needed.is_some();
    let _share = match is_known.then(|| state.shares.take(&caller.0)) {
        Some(None) => {
            state.turns.keep_back(true).await;
            return too_many(&state).into_response();
        }
        share => share.flatten(),
    };
    request.extensions_mut().insert(caller.clone());
    let mut response = if is_known {
        let turn = state.turns.take(&caller.0).await;
        request.extensions_mut().insert(turn.spent.clone());
        turn.spent.count(next.run(request)).await
    } else {
        next.run(request).await
    };
    // The log says who asked.
    response.extensions_mut().insert(caller);
    response
}

/// A principal has as many requests as may be.
fn too_many(state: &ApiState) -> Problem {
    let most = state.settings.max_principal_requests;
    Metric::AdmissionRejected.count([("reason", "too_busy".to_owned())], 1);
    Problem::new(Code::TooBusy, "too many requests of the same caller are being worked on").about_limit(
        "principal_requests",
        most,
        most + 1,
    )
}

/// Why somebody does not come in.
struct Denied {
    problem: Box<Problem>,
    /// The rest of the header that says how to come in (RFC 6750, section 3); nothing where nothing was shown.
    challenge: String,
}

impl Denied {
    /// Whether it is what was shown that opens nothing, and not that nothing was shown.
    const fn has_shown_something(&self) -> bool {
        !self.challenge.is_empty()
    }

    /// What was shown opens nothing.
    fn invalid(problem: Problem) -> Self {
        let challenge = format!(", error=\"invalid_token\", error_description=\"{}\"", quotable(&problem.detail));
        Self { problem: Box::new(problem), challenge }
    }
}

impl From<Problem> for Denied {
    fn from(problem: Problem) -> Self {
        Self { problem: Box::new(problem), challenge: String::new() }
    }
}

impl IntoResponse for Denied {
    fn into_response(self) -> Response {
        let Self { problem, challenge } = self;
        let is_told = matches!(problem.code.status(), StatusCode::UNAUTHORIZED | StatusCode::FORBIDDEN);
        let mut response = problem.into_response();
        if let Ok(challenge) = HeaderValue::try_from(format!("Bearer realm=\"retargetd\"{challenge}"))
            && is_told
        {
            response.headers_mut().insert(header::WWW_AUTHENTICATE, challenge);
        }
        response
    }
}

/// A sentence as the header may quote it.
fn quotable(sentence: &str) -> String {
    sentence.chars().filter(|letter| matches!(letter, ' '..='~') && !matches!(letter, '"' | '\\')).collect()
}

/// Lets somebody in where nobody is asked for a key. Keys are for later, when everybody is: whoever makes them must reach the database.
fn admitted_unknown(state: &ApiState, request: &Request) -> Result<Caller, Problem> {
    neighbors::check(request.uri(), request.headers(), &state.settings)?;
    if request.uri().path().starts_with(KEYS) {
        return Err(Problem::new(
            Code::Forbidden,
            "this service runs without authentication, so there are no keys to create or list",
        )
        .with_hint(
            "'retargetd keys create' makes them on the machine of the service; '--authentication keys' asks for them",
        ));
    }
    Ok(Caller(Principal::anonymous()))
}

/// The token in the address of a request.
fn stream_token(uri: &Uri) -> Option<String> {
    let Query(given) = Query::<Vec<(String, String)>>::try_from_uri(uri).ok()?;
    given.into_iter().find(|(name, _)| name == "token").map(|(_, text)| text)
}

/// The key that a request shows, where it shows one that is good.
pub(super) async fn shown_key(state: &ApiState, headers: &HeaderMap) -> Result<Option<ApiKeyRecord>, Problem> {
    if !state.settings.asks_who_calls() {
        return Ok(None);
    }
    let text = shown(state, headers).map(str::trim)?;
    Ok(state.keys.check(text).await?)
}

async fn admitted(state: &ApiState, headers: &HeaderMap, token: Option<&str>, scope: Scope) -> Result<Caller, Denied> {
    if let Some(token) = token {
        let key = state.keys.check_stream_token(token).await.map_err(Problem::from)?;
        let key = key
            .ok_or_else(|| Denied::invalid(unauthenticated(state, "the token in the address has ended, or is none")))?;
        return allowed(key.principal, &key.scopes, scope, "key", scope.name());
    }
    let text = shown(state, headers)?;
    if state.tokens.are_taken() && !Keys::is_shaped_like_one(text) {
        let Identity { principal, scopes } = state.tokens.check(text).await.map_err(refused)?;
        let name = state.tokens.scope_name(scope);
        return allowed(principal, &scopes, scope, "token", &name);
    }
    // Whether it was never there, has ended or was revoked is nobody's business who does not hold it.
    let key = state.keys.check(text).await.map_err(Problem::from)?;
    let key = key.ok_or_else(|| Denied::invalid(unauthenticated(state, "the key is not good")))?;
    allowed(key.principal, &key.scopes, scope, "key", scope.name())
}

/// The key or the token of a request.
fn shown<'a>(state: &ApiState, headers: &'a HeaderMap) -> Result<&'a str, Problem> {
    let given = extract::text(headers, &header::AUTHORIZATION);
    if given.is_empty() {
        let what = if state.tokens.are_taken() { "neither a key nor a token" } else { "no key" };
        return Err(unauthenticated(state, &format!("the request has {what}")));
    }
    match given.split_once(' ') {
        Some((scheme, text)) if scheme.eq_ignore_ascii_case("bearer") => Ok(text.trim()),
        _ => Err(unauthenticated(state, "the header 'Authorization' is not of the scheme 'Bearer'")),
    }
}

fn unauthenticated(state: &ApiState, detail: &str) -> Problem {
    let also = match state.settings.token_issuer.as_str() {
        "" => String::new(),
        issuer => format!(", or a token of '{issuer}' in its place"),
    };
    let hint = "send the header 'Authorization: Bearer rtk_…'; the operator makes keys with 'retargetd keys create'";
    Problem::new(Code::Unauthenticated, detail).with_hint(format!("{hint}{also}"))
}

/// Why a token opens nothing, as a problem.
fn refused(error: TokenError) -> Denied {
    let detail = format!("the token is not good: {error}");
    match error {
        TokenError::Unavailable => Problem::new(Code::Unavailable, detail).into(),
        TokenError::Expired => Denied::invalid(Problem::new(Code::TokenExpired, detail).with_hint("get a fresh one")),
        _ => Denied::invalid(Problem::new(Code::TokenRefused, detail)),
    }
}

/// Lets somebody in whose key or token has the scope, which it calls by `name`.
fn allowed(principal: Principal, has: &[Scope], needed: Scope, what: &str, name: &str) -> Result<Caller, Denied> {
    if has.contains(&needed) {
        return Ok(Caller(principal));
    }
    let names = has.iter().map(|scope| scope.name()).collect::<Vec<_>>().join(", ");
    let has = if names.is_empty() { "none" } else { &names };
    let detail = format!("this needs a {what} with the scope '{name}'; this one has: {has}");
    let challenge = format!(", error=\"insufficient_scope\", scope=\"{}\"", quotable(name));
    Err(Denied { problem: Box::new(Problem::new(Code::Forbidden, detail)), challenge })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looking_needs_less_than_changing_and_probes_need_nothing() {
        let needed = |method: Method, route: &str| needed_scope(&method, route);
        assert_eq!(needed(Method::GET, "/v1/jobs/{id}"), Some(Scope::Read), "looking");
        assert_eq!(needed(Method::HEAD, "/v1/results/{id}/content"), Some(Scope::Read), "looking");
        assert_eq!(needed(Method::POST, "/v1/retarget"), Some(Scope::Write), "changing");
        assert_eq!(needed(Method::DELETE, "/v1/assets/{id}"), Some(Scope::Write), "changing");
        assert_eq!(needed(Method::GET, "/v1/keys"), Some(Scope::Admin), "keys of everybody");
        assert_eq!(needed(Method::GET, "/metrics"), Some(Scope::Admin), "tells how much everybody does");
        for open in ["/", "/livez", "/readyz", "/docs/{*page}", "/openapi.json", "/v1/limits"] {
            assert_eq!(needed(Method::GET, open), None, "{open}");
        }
    }
}
