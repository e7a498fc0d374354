//! Who callers are who show a token of an identity provider: JSON Web Tokens (RFC 7519) signed by one issuer that the operator names.
//!
//! A token is looked at in this order, and nothing it claims is believed before its signature is checked: its shape; how it says it is
//! signed, which must be a way that the operator allows and that the key of its name is made for, so that no key is ever used as
//! something else; its signature; its issuer and audience; its times, by the service's own clock; at last who it is about and what it
//! allows. Keys come from the issuer and are kept fresh by a task of their own, never by who calls.
//!
//! Knows nothing of requests and answers.

mod error;
mod issuer;
mod key_set;
mod rules;
mod signing_keys;

pub use error::{KeysError, TokenError};

use std::sync::Arc;

use jsonwebtoken::decode_header;

use self::{issuer::Issuer, rules::Rules, signing_keys::SigningKeys};
use crate::{
    config::Settings,
    store::{Principal, Scope},
    telemetry::Clock,
};

/// What a token says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Who calls.
    pub principal: Principal,
    /// What is allowed. May be nothing.
    pub scopes: Vec<Scope>,
}

/// The tokens that are taken. Cheap to clone; all clones are the same.
#[derive(Clone, Debug, Default)]
pub struct Tokens(Option<Arc<Taken>>);

#[derive(Debug)]
struct Taken {
    rules: Rules,
    keys: SigningKeys,
    clock: Clock,
}

impl Tokens {
    /// None are taken.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// Those that the settings name. An issuer that does not answer is asked again until it does; until then no token can be checked,
    /// which [`Self::can_be_checked`] tells.
    ///
    /// # Errors
    /// When the issuer's keys are in a file that cannot be used, or no connections can be made at all.
    pub async fn start(settings: &Settings, clock: Clock) -> Result<Self, KeysError> {
        if !settings.takes_tokens() {
            return Ok(Self::none());
        }
        let issuer = Issuer::new(settings)?;
        let (period, pause) = (settings.token_keys_period.0, settings.token_keys_pause.0);
        let keys = SigningKeys::start(issuer, period, pause).await?;
        Ok(Self(Some(Arc::new(Taken { rules: Rules::new(settings), keys, clock }))))
    }

    /// Whether any are taken.
    #[must_use]
    pub const fn are_taken(&self) -> bool {
        self.0.is_some()
    }

    /// Whether those that are taken can be checked: the issuer's keys have been there once. Stays so when the issuer goes away.
    #[must_use]
    pub fn can_be_checked(&self) -> bool {
        self.0.as_ref().is_none_or(|taken| taken.keys.are_there())
    }

    /// What a scope is called in a token.
    #[must_use]
    pub fn scope_name(&self, scope: Scope) -> String {
        self.0.as_ref().map_or_else(String::new, |taken| taken.rules.scope_name(scope))
    }

    /// Who shows that text, when it is a token that is good now.
    ///
    /// # Errors
    /// Why it is not.
    pub async fn check(&self, text: &str) -> Result<Identity, TokenError> {
        let taken = self.0.as_ref().ok_or(TokenError::Malformed)?;
        // What names no known algorithm, such as 'none', is refused here already.
        let header = decode_header(text).map_err(|_| TokenError::Malformed)?;
        taken.rules.check_header(&header)?;
        let key = taken.keys.find(header.kid.as_deref(), header.alg).await?;
        let claims = taken.rules.signed_claims(text, header.alg, &key)?;
        taken.rules.identity(&claims, taken.clock.now())
    }
}
