//! Keys with which callers say who they are: making them, checking them, ending them.
//!
//! A key is `rtk_<id>_<secret>`. The id is found in the database, the digest of the secret is compared without telling by the time
//! that takes how much of it fits. The secret itself is told once, to whoever makes the key, and kept nowhere.

use std::{fmt, time::Duration};

use sha2::{Digest, Sha256};
use subtle::ConstantTimeEq;

use super::Refusal;
use crate::{
    store::{ApiKeyId, ApiKeyRecord, Principal, Records, Scope, StoreError, hexadecimal},
    telemetry::Clock,
};

/// What every key begins with, so that people and scanners for leaked secrets know one when they see it.
const PREFIX: &str = "rtk_";
/// 256 bits: nobody finds a key by trying.
const SECRET_BYTES: usize = 32;
/// Keys of one principal that are good at the same time: one that is in use, and the one that follows it.
const MAX_PER_PRINCIPAL: u64 = 2;

/// How often it is noted that a key is in use: each time costs a write.
const NOTED_EVERY: Duration = Duration::from_secs(300);

/// A key as its holder shows it. Never shown by us but once.
#[derive(Clone, PartialEq, Eq)]
pub struct KeyText(String);

impl KeyText {
    pub(super) const fn of(text: String) -> Self {
        Self(text)
    }

    /// The key, to be handed to its holder.
    #[must_use]
    pub fn reveal(&self) -> &str {
        &self.0
    }
}

impl fmt::Debug for KeyText {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("hidden")
    }
}

/// A key that is to be made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewKey {
    /// Who shall have it.
    pub principal: Principal,
    /// What it shall allow.
    pub scopes: Vec<Scope>,
    /// How long it shall be good; for ever, where nothing is said.
    pub lifetime: Option<Duration>,
    /// What it is for, in words for whoever reads the list. May be empty.
    pub note: String,
}

impl NewKey {
    /// Letters that a note has at most.
    pub const MAX_NOTE: usize = 200;

    /// Sees to it that a note is one line of no more letters than that.
    ///
    /// # Errors
    /// What a note is, where this is none.
    pub fn check_note(text: &str) -> Result<(), String> {
        let is_note = text.chars().count() <= Self::MAX_NOTE && !text.chars().any(char::is_control);
        is_note.then_some(()).ok_or_else(|| format!("a note is one line of up to {} letters", Self::MAX_NOTE))
    }
}

/// The keys. Cheap to clone; all clones are the same.
#[derive(Clone, Debug)]
pub struct Keys {
    records: Records,
    clock: Clock,
}

impl Keys {
    /// The keys that those records hold.
    #[must_use]
    pub const fn new(records: Records, clock: Clock) -> Self {
        Self { records, clock }
    }

    pub(super) const fn clock(&self) -> &Clock {
        &self.clock
    }

    /// The key of an id, where there is one that is good.
    pub(super) async fn good_key(&self, id: &ApiKeyId, now: jiff::Timestamp) -> Result<Option<ApiKeyRecord>, Refusal> {
        let key = self.records.api_key(id).await?;
        Ok(key.filter(|key| key.expires_at.is_none_or(|end| end > now)))
    }

    /// Makes a key. What it gives first is told to its holder and to nobody else.
    ///
    /// # Errors
    /// When the principal has two keys already that are good, or the store fails.
    pub async fn create(&self, new: NewKey) -> Result<(KeyText, ApiKeyRecord), Refusal> {
        let mut secret = [0; SECRET_BYTES];
        getrandom::fill(&mut secret).map_err(StoreError::from)?;
        let secret = hexadecimal(&secret);
        let mut scopes = new.scopes;
        scopes.sort_unstable();
        scopes.dedup();
        let key = ApiKeyRecord {
            id: ApiKeyId::new(),
            principal: new.principal,
            sha256: hexadecimal(&Sha256::digest(secret.as_bytes())),
            scopes,
            created_at: self.clock.now(),
            expires_at: new.lifetime.map(|lifetime| self.clock.after(lifetime)),
            last_used_at: None,
            note: new.note,
            revoked_at: None,
        };
        if !self.records.add_api_key(&key, MAX_PER_PRINCIPAL).await? {
            return Err(Refusal::TooManyKeys { principal: key.principal, most: MAX_PER_PRINCIPAL });
        }
        let letters = key.id.as_str().trim_start_matches(ApiKeyId::PREFIX);
        Ok((KeyText(format!("{PREFIX}{letters}_{secret}")), key))
    }

    /// The keys that open something, the oldest first; with `all`, also those that were revoked or have expired.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn list(&self, all: bool) -> Result<Vec<ApiKeyRecord>, Refusal> {
        let now = self.clock.now();
        let is_good = |key: &ApiKeyRecord| key.revoked_at.is_none() && key.expires_at.is_none_or(|end| end > now);
        Ok(self.records.api_keys().await?.into_iter().filter(|key| all || is_good(key)).collect())
    }

    /// Ends a key at once. It stays in the list of all keys.
    ///
    /// # Errors
    /// When there is none that is not revoked, or the store fails.
    pub async fn revoke(&self, id: &ApiKeyId) -> Result<(), Refusal> {
        match self.records.revoke_api_key(id, self.clock.now()).await? {
            true => Ok(()),
            false => Err(Refusal::NotFound { kind: "key", id: id.to_string() }),
        }
    }

    /// Whether a text is meant as a key, good or not.
    #[must_use]
    pub fn is_shaped_like_one(text: &str) -> bool {
        text.starts_with(PREFIX)
    }

    /// The record of a key as its holder shows it; `None` when it is no key, or none that is good now.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn check(&self, text: &str) -> Result<Option<ApiKeyRecord>, Refusal> {
        let Some((id, secret)) = parts(text) else { return Ok(None) };
        let Some(key) = self.records.api_key(&id).await? else { return Ok(None) };
        let seen = hexadecimal(&Sha256::digest(secret.as_bytes()));
        let is_the_same: bool = seen.as_bytes().ct_eq(key.sha256.as_bytes()).into();
        let now = self.clock.now();
        if !is_the_same || key.expires_at.is_some_and(|end| end <= now) {
            return Ok(None);
        }
        if key.last_used_at.is_none_or(|used| used + NOTED_EVERY <= now) {
            // That nobody can write it down is no reason to keep its holder out.
            if let Err(error) = self.records.note_use_of_api_key(&key.id, now).await {
                tracing::warn!(%error, "the use of a key could not be noted");
            }
        }
        Ok(Some(key))
    }
}

/// The id and the secret of a text that has the shape of a key.
fn parts(text: &str) -> Option<(ApiKeyId, &str)> {
    let (letters, secret) = text.strip_prefix(PREFIX)?.split_once('_')?;
    let id = ApiKeyId::parse(&format!("{}{letters}", ApiKeyId::PREFIX)).ok()?;
    (secret.len() == 2 * SECRET_BYTES).then_some((id, secret))
}

#[cfg(test)]
mod tests {
    use super::*;

    async fn keys(clock: &Clock) -> (tempfile::TempDir, Keys) {
        let folder = tempfile::tempdir().expect("a folder");
        let records = Records::open(&folder.path().join("state.db")).await.expect("opens");
        (folder, Keys::new(records, clock.clone()))
    }

    fn new(principal: &str, lifetime_seconds: Option<u64>) -> NewKey {
        NewKey {
            principal: Principal::parse(principal).expect("a name"),
            scopes: vec![Scope::Write, Scope::Read, Scope::Write],
            lifetime: lifetime_seconds.map(Duration::from_secs),
            note: String::new(),
        }
    }

    #[tokio::test]
    async fn only_the_whole_key_opens_and_only_until_it_ends() {
        let clock = Clock::system();
        let (_folder, keys) = keys(&clock).await;
        let (text, made) = keys.create(new("ann", Some(60))).await.expect("is made");
        assert_eq!(made.scopes, [Scope::Read, Scope::Write], "each once, in order");
        let checked = keys.check(text.reveal()).await.expect("is looked up").expect("opens");
        assert_eq!((checked.principal.as_str(), checked.id), ("ann", made.id.clone()), "it says who");
        assert!(!text.reveal().contains(&made.sha256), "what is kept is not what is shown");
        let used = |listed: Vec<ApiKeyRecord>| listed.iter().map(|key| key.last_used_at.is_some()).collect::<Vec<_>>();
        assert_eq!(used(keys.list(false).await.expect("lists")), [true], "it is known that it is in use");

        let (other, _) = keys.create(new("bob", None)).await.expect("is made");
        let crossed =
            format!("{}{}", &text.reveal()[..text.reveal().len() - 64], &other.reveal()[other.reveal().len() - 64..]);
        for wrong in ["", "rtk_", "rtk__", text.reveal().trim_start_matches(PREFIX), crossed.as_str(), made.id.as_str()]
        {
            assert!(keys.check(wrong).await.expect("is looked up").is_none(), "{wrong:?}");
        }

        clock.advance(Duration::from_secs(61));
        assert!(keys.check(text.reveal()).await.expect("is looked up").is_none(), "its time is over");
        keys.revoke(&made.id).await.expect("is there");
        assert!(keys.revoke(&made.id).await.is_err(), "it was revoked before");
    }

    #[tokio::test]
    async fn a_revoked_key_opens_nothing_and_stays_in_the_list() {
        let clock = Clock::system();
        let (_folder, keys) = keys(&clock).await;
        let (text, made) =
            keys.create(NewKey { note: "farm, north".to_owned(), ..new("ann", None) }).await.expect("is made");
        let (_, other) = keys.create(new("ann", Some(60))).await.expect("is made");
        let token = keys.stream_token(&made);
        keys.revoke(&made.id).await.expect("is there");
        assert!(keys.check(text.reveal()).await.expect("is looked up").is_none(), "it opens nothing");
        let streamed = keys.check_stream_token(token.text.reveal()).await.expect("is looked up");
        assert!(streamed.is_none(), "nor does a token of it");
        let ids = |listed: Vec<ApiKeyRecord>| listed.into_iter().map(|key| key.id).collect::<Vec<_>>();
        assert_eq!(ids(keys.list(false).await.expect("lists")), [other.id], "what is good");
        let all = keys.list(true).await.expect("lists");
        assert_eq!((all.len(), all[0].note.as_str()), (2, "farm, north"), "all, with what they are for");
        assert!(all[0].revoked_at.is_some() && all[1].revoked_at.is_none(), "and which are revoked");
        keys.create(new("ann", None)).await.expect("a revoked key takes no place");
        clock.advance(Duration::from_secs(61));
        assert_eq!(keys.list(false).await.expect("lists").len(), 1, "what has expired is not good");
        assert_eq!(keys.list(true).await.expect("lists").len(), 3, "and stays as well");
        for _ in 0..55 {
            let (_, key) = keys.create(new("bob", None)).await.expect("is made");
            keys.revoke(&key.id).await.expect("is there");
        }
        assert_eq!(keys.list(true).await.expect("lists").len(), 53, "of very many the oldest go");
    }

    #[tokio::test]
    async fn a_principal_has_two_good_keys_at_most() {
        let clock = Clock::system();
        let (_folder, keys) = keys(&clock).await;
        keys.create(new("ann", Some(60))).await.expect("the first");
        keys.create(new("ann", None)).await.expect("the one that follows it");
        let refused = keys.create(new("ann", None)).await.expect_err("a third");
        assert!(matches!(refused, Refusal::TooManyKeys { most: 2, .. }), "{refused}");
        keys.create(new("bob", None)).await.expect("others are not concerned");
        clock.advance(Duration::from_secs(61));
        keys.create(new("ann", None)).await.expect("the first has ended");
    }

    #[test]
    fn a_key_is_not_shown_to_developers() {
        assert_eq!(format!("{:?}", KeyText("rtk_sesame".to_owned())), "hidden", "nor to logs");
    }
}
