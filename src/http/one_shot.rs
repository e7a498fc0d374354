//! What a request for a one-shot says beside its body.

use axum::http::{HeaderMap, header};

use super::{ApiState, caching, extract, idempotency::IdempotencyKey, negotiate, problem::Problem};
use crate::{engine::Format, jobs::NewJob};

/// Read before the body, so that a request that cannot be answered is refused before its files arrive.
pub(super) struct OneShotHeaders {
    format: Option<Format>,
    idempotency_key: Option<String>,
    skip_cache: bool,
}

impl OneShotHeaders {
    /// Reads them.
    ///
    /// # Errors
    /// When nothing more is taken on, or no format that can be written matches `Accept`.
    pub(super) async fn read(
        state: &ApiState,
        headers: &HeaderMap,
        IdempotencyKey(idempotency_key): IdempotencyKey,
    ) -> Result<Self, Problem> {
        state.jobs.check_admission().await?;
        let format = negotiate::wanted_format(extract::text(headers, &header::ACCEPT))?;
        Ok(Self { format, idempotency_key, skip_cache: caching::is_skipped(headers) })
    }

    /// Has the job be as they say.
    pub(super) fn apply(self, new: &mut NewJob) {
        new.formats.extend(self.format);
        (new.idempotency_key, new.skip_cache) = (self.idempotency_key, self.skip_cache);
    }
}
