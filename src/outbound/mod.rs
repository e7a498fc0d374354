//! Talking out: the only way on which the service reaches places that its callers name.
//!
//! A caller's URL can point at what only the service can reach: the machine itself, its neighbors, the metadata of a cloud. So every
//! URL passes a [guard](Outbound::check), its host is resolved once, every address that comes out is [judged](address), and the
//! connection goes to one of those very addresses. Proxies of the environment are not used, since they would choose the address, and no
//! answer leads anywhere else by itself. What webhooks are told is [signed](signatures) by the Standard Webhooks scheme.
//!
//! Knows no job and no store: it is handed texts and gives back what came of them.

mod address;
mod client;
mod download;
mod guard;
mod retry_after;
mod signature;

pub use client::{Answer, Outbound, SendError};
pub use download::{Download, FetchError, MAX_REDIRECTS};
pub use guard::Blocked;
pub use signature::{WebhookSecretError, new_secret, signatures};
