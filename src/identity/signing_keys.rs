//! The issuer's keys, kept fresh.
//!
//! One task fetches them: at the start, whenever their period is over, and when a token names a key that is not among them, but not
//! again before a pause is over, so that nobody who sends made-up names has the issuer flooded. What was fetched last stays when the
//! issuer goes away. Who looks for a key that is not there waits a moment for a fetch that may bring it, and never does one.

use std::{sync::Arc, time::Duration};

use jsonwebtoken::{Algorithm, DecodingKey};
use tokio::{
    sync::{Notify, watch},
    time::{Instant, timeout},
};
use tokio_util::task::AbortOnDropHandle;

use super::{
    error::{KeysError, TokenError},
    issuer::Issuer,
    key_set::KeySet,
};

/// How long who looks for a key waits for it to be fetched.
const LONGEST_WAIT: Duration = Duration::from_secs(2);

/// The keys as they are known now.
#[derive(Debug)]
pub(super) struct SigningKeys {
    fetched: watch::Receiver<Fetched>,
    wanted: Arc<Notify>,
    pause: Duration,
    _keeper: AbortOnDropHandle<()>,
}

/// What the last fetches gave.
#[derive(Clone, Debug)]
struct Fetched {
    /// The last keys that could be had.
    keys: Option<Arc<KeySet>>,
    /// When the issuer was last asked.
    at: Instant,
    /// Whether it answered then.
    is_fresh: bool,
}

impl Fetched {
    fn find(&self, id: Option<&str>, algorithm: Algorithm) -> Result<DecodingKey, TokenError> {
        let keys = self.keys.as_ref().ok_or(TokenError::Unavailable)?;
        keys.find(id, algorithm).cloned().ok_or(TokenError::UnknownKey)
    }
}

impl SigningKeys {
    /// Fetches the keys and keeps them fresh from then on, until it is dropped.
    ///
    /// # Errors
    /// When they cannot be had and waiting is no help.
    pub(super) async fn start(issuer: Issuer, period: Duration, pause: Duration) -> Result<Self, KeysError> {
        let keys = match issuer.keys().await {
            Err(error) if issuer.may_come_back() => {
                tracing::warn!(%error, "no token can be checked until the issuer's keys are there");
                None
            }
            keys => Some(Arc::new(keys?)),
        };
        let is_fresh = keys.is_some();
        let (sender, fetched) = watch::channel(Fetched { keys, at: Instant::now(), is_fresh });
        let wanted = Arc::new(Notify::new());
        let keeper = tokio::spawn(keep_fresh(issuer, sender, Arc::clone(&wanted), (period, pause)));
        Ok(Self { fetched, wanted, pause, _keeper: AbortOnDropHandle::new(keeper) })
    }

    /// Whether there are any.
    pub(super) fn are_there(&self) -> bool {
        self.fetched.borrow().keys.is_some()
    }

    /// The key of that id for that algorithm.
    ///
    /// # Errors
    /// [`TokenError::UnknownKey`], or [`TokenError::Unavailable`] when no keys are there at all.
    pub(super) async fn find(&self, id: Option<&str>, algorithm: Algorithm) -> Result<DecodingKey, TokenError> {
        let mut fetched = self.fetched.clone();
        let known = fetched.borrow_and_update().clone();
        let found = known.find(id, algorithm);
        if found.is_ok() || known.at.elapsed() < self.pause {
            return found;
        }
        self.wanted.notify_one();
        // Whether it brought anything is seen below.
        let _ = timeout(LONGEST_WAIT, fetched.changed()).await;
        let known = fetched.borrow().clone();
        known.find(id, algorithm)
    }
}

async fn keep_fresh(
    issuer: Issuer,
    fetched: watch::Sender<Fetched>,
    wanted: Arc<Notify>,
    (period, pause): (Duration, Duration),
) {
    loop {
        let Fetched { keys: before, at, is_fresh } = fetched.borrow().clone();
        // Not before the pause is over, whoever asks; an issuer that did not answer is asked again at its end.
        tokio::time::sleep_until(at + pause).await;
        if is_fresh {
            tokio::select! {
                () = tokio::time::sleep_until(at + period) => {}
                () = wanted.notified() => {}
            }
        }
        let keys = match issuer.keys().await {
            Ok(keys) => Some(Arc::new(keys)),
            Err(error) => {
                if is_fresh {
                    tracing::warn!(%error, "the issuer's keys could not be fetched; those from before stay");
                }
                None
            }
        };
        if keys.is_some() && !is_fresh {
            tracing::info!("the issuer's keys are there");
        }
        let is_fresh = keys.is_some();
        fetched.send_replace(Fetched { keys: keys.or(before), at: Instant::now(), is_fresh });
    }
}
