//! Who asks, and what they may do.
//!
//! Where keys are asked for, every route but the open ones wants `Authorization: Bearer rtk_…`. Whoever has a key is a principal and sees
//! what belongs to that principal; everything else is not there, so that ids tell nothing. Where no keys are asked for, everybody is the
//! same principal and may do everything.

use axum::{
    extract::{FromRequestParts, MatchedPath, Request, State},
    http::{HeaderMap, HeaderValue, Method, header, request::Parts},
    middleware::Next,
    response::{IntoResponse, Response},
};

use super::{ApiState, code::Code, extract, problem::Problem};
use crate::jobs::{Principal, Scope};

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
            .ok_or_else(|| Problem::internal(&"a request reached a handler as nobody's"))
    }
}

/// What a route asks for; nothing where everybody may come in: what is the same for all, and holds nothing of anybody.
#[must_use]
pub(super) fn needed_scope(method: &Method, route: &str) -> Option<Scope> {
    const OPEN: [&str; 5] =
        ["/v1/formats", "/v1/limits", "/v1/findings", "/v1/schemas/retarget-spec", "/v1/schemas/rig-template"];
    let is_guarded = route == "/metrics" || route.starts_with("/v1/");
    if !is_guarded || OPEN.contains(&route) {
        return None;
    }
    Some(match *method {
        _ if route.starts_with("/v1/keys") => Scope::Admin,
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
    let needed = route.and_then(|route| needed_scope(request.method(), route.as_str()));
    let caller = match (state.settings.asks_for_keys(), needed) {
        (true, Some(scope)) => match admitted(&state, request.headers(), scope).await {
            Ok(caller) => caller,
            Err(problem) => return refused(problem),
        },
        _ => Caller(Principal::anonymous()),
    };
    request.extensions_mut().insert(caller.clone());
    let mut response = next.run(request).await;
    // The log says who asked.
    response.extensions_mut().insert(caller);
    response
}

async fn admitted(state: &ApiState, headers: &HeaderMap, scope: Scope) -> Result<Caller, Problem> {
    const HINT: &str =
        "send the header 'Authorization: Bearer rtk_…'; the operator makes keys with 'retargetd keys create'";
    let refused = |detail: &str| Problem::new(Code::Unauthenticated, detail).with_hint(HINT);
    let given = extract::text(headers, &header::AUTHORIZATION);
    if given.is_empty() {
        return Err(refused("the request has no key"));
    }
    let (scheme, text) = given.split_once(' ').unwrap_or((given, ""));
    if !scheme.eq_ignore_ascii_case("bearer") {
        return Err(refused("the header 'Authorization' is not of the scheme 'Bearer'"));
    }
    // Whether it was never there, has ended or was revoked is nobody's business who does not hold it.
    let key = state.keys.check(text.trim()).await?.ok_or_else(|| refused("the key is not good"))?;
    if !key.scopes.contains(&scope) {
        let has = key.scopes.iter().map(|scope| scope.name()).collect::<Vec<_>>().join(", ");
        let detail = format!("this needs a key with the scope '{}'; this one has: {has}", scope.name());
        return Err(Problem::new(Code::Forbidden, detail));
    }
    Ok(Caller(key.principal))
}

fn refused(problem: Problem) -> Response {
    let is_unauthenticated = problem.code == Code::Unauthenticated;
    let mut response = problem.into_response();
    if is_unauthenticated {
        let challenge = HeaderValue::from_static("Bearer realm=\"retargetd\"");
        response.headers_mut().insert(header::WWW_AUTHENTICATE, challenge);
    }
    response
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
        assert_eq!(needed(Method::GET, "/metrics"), Some(Scope::Read), "tells how much is going on");
        for open in ["/", "/livez", "/readyz", "/docs/{*rest}", "/openapi.json", "/v1/limits"] {
            assert_eq!(needed(Method::GET, open), None, "{open}");
        }
    }
}
