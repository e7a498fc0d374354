//! What a token must say, and what is read from it.

use std::{borrow::Cow, collections::HashSet, time::Duration};

use jiff::Timestamp;
use jsonwebtoken::{Algorithm, DecodingKey, Header, Validation, decode, errors::ErrorKind};
use serde_json::{Map, Value};

use super::{Identity, TokenError};
use crate::{
    config::{Settings, TokenAlgorithms},
    store::{Principal, Scope},
};

/// What is asked of tokens.
#[derive(Debug)]
pub(super) struct Rules {
    issuer: String,
    audience: Vec<String>,
    /// How tokens may be signed, with the names of the ways.
    algorithms: Vec<(Algorithm, &'static str)>,
    principal_claim: String,
    scope_claim: String,
    scope_prefix: String,
    leeway: Duration,
}

/// What a token says, once its signature, its issuer and its audience were found good.
#[derive(Debug)]
pub(super) struct Claims(Map<String, Value>);

impl Rules {
    /// Those of the settings.
    pub(super) fn new(settings: &Settings) -> Self {
        Self {
            issuer: settings.token_issuer.clone(),
            audience: settings.token_audience.0.clone(),
            algorithms: known_algorithms(&settings.token_algorithms.0),
            principal_claim: settings.token_principal_claim.clone(),
            scope_claim: settings.token_scope_claim.clone(),
            scope_prefix: settings.token_scope_prefix.clone(),
            leeway: settings.token_leeway.0,
        }
    }

    /// What a scope is called in a token.
    pub(super) fn scope_name(&self, scope: Scope) -> String {
        format!("{}{}", self.scope_prefix, scope.name())
    }

    /// Looks at how a token says that it is signed. Nothing else of the header is believed.
    pub(super) fn check_header(&self, header: &Header) -> Result<(), TokenError> {
        if header.crit.is_some() {
            return Err(TokenError::Extension);
        }
        if self.algorithms.iter().any(|(algorithm, _)| *algorithm == header.alg) {
            return Ok(());
        }
        let known = known_algorithms(&TokenAlgorithms::ALL);
        let name = known.into_iter().find(|(algorithm, _)| *algorithm == header.alg);
        Err(TokenError::Algorithm(name.map_or("a shared secret", |(_, name)| name)))
    }

    /// What a token says, when it is signed with that key, in that way, by the issuer and for this service.
    pub(super) fn signed_claims(
        &self,
        text: &str,
        algorithm: Algorithm,
        key: &DecodingKey,
    ) -> Result<Claims, TokenError> {
        let mut validation = Validation::new(algorithm);
        validation.set_issuer(&[&self.issuer]);
        validation.set_audience(&self.audience);
        validation.set_required_spec_claims(&["iss", "aud"]);
        // Times are looked at below, by the clock that the rest of the service goes by.
        validation.validate_exp = false;
        let checked = decode::<Map<String, Value>>(text, key, &validation);
        checked.map(|token| Claims(token.claims)).map_err(|error| match error.into_kind() {
            ErrorKind::InvalidIssuer => TokenError::Issuer,
            ErrorKind::InvalidAudience => TokenError::Audience,
            ErrorKind::MissingRequiredClaim(name) => TokenError::Claim(name),
            ErrorKind::Json(_) | ErrorKind::Utf8(_) | ErrorKind::Base64(_) | ErrorKind::InvalidToken => {
                TokenError::Malformed
            }
            _ => TokenError::Signature,
        })
    }

    /// Who calls and what is allowed, if the token is good at that time.
    pub(super) fn identity(&self, claims: &Claims, now: Timestamp) -> Result<Identity, TokenError> {
        let (now, leeway) = (now.as_millisecond() as f64 / 1e3, self.leeway.as_secs_f64());
        if now >= claims.time("exp")?.ok_or_else(|| TokenError::Claim("exp".to_owned()))? + leeway {
            return Err(TokenError::Expired);
        }
        if claims.time("nbf")?.is_some_and(|begin| now + leeway < begin) {
            return Err(TokenError::NotYet);
        }
        let subject = claims.find(&self.principal_claim).and_then(Value::as_str).filter(|subject| !subject.is_empty());
        let subject = subject.ok_or_else(|| TokenError::Claim(self.principal_claim.clone()))?;
        Ok(Identity { principal: Principal::of_token(subject), scopes: self.scopes(claims) })
    }

    /// Those that are known among those that are listed; others are for other services.
    fn scopes(&self, claims: &Claims) -> Vec<Scope> {
        let listed: HashSet<&str> = match claims.find(&self.scope_claim) {
            Some(Value::String(text)) => text.split(' ').collect(),
            Some(Value::Array(entries)) => entries.iter().filter_map(Value::as_str).collect(),
            _ => HashSet::new(),
        };
        Scope::ALL.into_iter().filter(|scope| listed.contains(self.scope_name(*scope).as_str())).collect()
    }
}

fn known_algorithms(names: &[&'static str]) -> Vec<(Algorithm, &'static str)> {
    names.iter().filter_map(|name| Some((name.parse().ok()?, *name))).collect()
}

impl Claims {
    /// A claim by its name, or by a JSON pointer where it begins with `/`. Names of claims may be URLs, so a point divides nothing.
    fn find(&self, name: &str) -> Option<&Value> {
        let Some(pointer) = name.strip_prefix('/') else { return self.0.get(name) };
        let mut steps = pointer.split('/').map(unescaped);
        let first = self.0.get(&*steps.next()?)?;
        steps.try_fold(first, |value, step| value.get(&*step))
    }

    /// A time in seconds since 1970, which may have a fraction.
    fn time(&self, name: &str) -> Result<Option<f64>, TokenError> {
        let Some(value) = self.0.get(name) else { return Ok(None) };
        value.as_f64().map(Some).ok_or_else(|| TokenError::Claim(name.to_owned()))
    }
}

/// A step of a JSON pointer as RFC 6901 writes it.
fn unescaped(step: &str) -> Cow<'_, str> {
    if step.contains('~') { step.replace("~1", "/").replace("~0", "~").into() } else { step.into() }
}

#[cfg(test)]
mod tests;
