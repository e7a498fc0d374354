//! The `keys` subcommand: who may come in, by the database itself, so that the first key can be made before anybody has one.

use std::{path::PathBuf, time::Duration};

use clap::{Args, Subcommand};
use serde_json::{Value, json};

use crate::{
    app,
    config::{Period, Secret, SettingValue, Settings},
    jobs::{ApiKeyId, ApiKeyRecord, Keys, NewKey, Principal, Refusal, Scope},
};

use super::{
    exit::{BAD_USAGE, Exit, FAILED, print, report, say},
    manner::speaks_json,
};

/// Arguments of `retargetd keys`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Create a key and print it, once: only its hash is stored.
    Create {
        /// Principal of the key; all keys of a principal see the same files, jobs, rigs and presets
        #[arg(value_name = "PRINCIPAL", value_parser = principal)]
        principal: Principal,
        /// Scope of the key: read, write or admin; may be repeated
        #[arg(long = "scope", value_name = "SCOPE", value_parser = scope, default_values = ["read", "write"])]
        scopes: Vec<Scope>,
        /// Validity, such as 90d; without it, the key does not expire
        #[arg(long, value_name = "PERIOD", value_parser = period)]
        lifetime: Option<Duration>,
        /// What the key is for, for people who read the list
        #[arg(long, value_name = "TEXT", default_value = "", hide_default_value = true, value_parser = note)]
        note: String,
        #[command(flatten)]
        place: Place,
    },
    /// List the keys that open something, without their secrets.
    List {
        /// Also list keys that were revoked or have expired
        #[arg(long)]
        all: bool,
        #[command(flatten)]
        place: Place,
    },
    /// Revoke a key immediately; 'list --all' still shows it.
    Revoke {
        /// The id of the key, as printed by 'list'
        #[arg(value_name = "KEY")]
        id: String,
        #[command(flatten)]
        place: Place,
    },
}

/// Where the keys are: the same as the service is started with.
#[derive(Debug, Args)]
struct Place {
    /// Data folder of the service
    #[arg(long, value_name = "FOLDER", env = "RETARGETD_DATA", default_value = "retargetd-data")]
    data: PathBuf,
    /// URL of the Postgres database, if one is used
    #[arg(long, value_name = "URL", env = "RETARGETD_DATABASE", hide_env_values = true, default_value = "")]
    database: String,
    /// Create the data folder and its database if missing
    #[arg(long)]
    new: bool,
}

impl Place {
    /// Where that is, without a password.
    fn name(&self) -> String {
        match self.database.rsplit_once('@') {
            Some((_, place)) => format!("the Postgres database at {place}"),
            None if self.database.is_empty() => format!("the data folder {}", self.data.display()),
            None => "the Postgres database that is given".to_owned(),
        }
    }

    async fn keys(&self) -> Result<Keys, Exit> {
        let settings =
            Settings { data: self.data.clone(), database: Secret(self.database.clone()), ..Settings::default() };
        if self.new && self.database.is_empty() {
            app::make_database(&settings).await.map_err(|error| Exit::new(FAILED, format!("{error:#}"), ""))?;
        }
        let keys = app::keys(&settings).await.map_err(|error| {
            Exit::new(FAILED, format!("{error:#}"), "give --data or --database, the same as to 'retargetd serve'; --new makes a database before the first start")
        })?;
        say(format_args!("keys of {}", self.name()));
        Ok(keys)
    }
}

pub(super) fn run(arguments: Arguments) -> Result<(), Exit> {
    super::runtime()?.block_on(act(arguments.action))
}

async fn act(action: Action) -> Result<(), Exit> {
    match action {
        Action::Create { principal, scopes, lifetime, note, place } => {
            let new = NewKey { principal, scopes, lifetime, note };
            let (text, key) = place.keys().await?.create(new).await.map_err(failed)?;
            // The key alone goes to standard output, for scripts to keep.
            say(format_args!("made {}; keep the key, it is not shown again:", line(&key)));
            if speaks_json() {
                return report(|| json!({"key": view(&key), "secret": text.reveal()}));
            }
            print(&format!("{}\n", text.reveal()))
        }
        Action::List { all, place } => {
            let keys = place.keys().await?.list(all).await.map_err(failed)?;
            if speaks_json() {
                return report(|| json!({"keys": keys.iter().map(view).collect::<Vec<_>>()}));
            }
            if keys.is_empty() {
                say("there are no keys that open anything; 'retargetd keys create PRINCIPAL' makes one");
            }
            print(&keys.iter().map(|key| format!("{}\n", line(key))).collect::<String>())
        }
        Action::Revoke { id, place } => {
            let id = ApiKeyId::parse(&id).map_err(|error| Exit::new(BAD_USAGE, error.to_string(), LIST_HINT))?;
            place.keys().await?.revoke(&id).await.map_err(failed)?;
            say(format_args!("revoked {id}: it opens nothing any more; 'retargetd keys list --all' still shows it"));
            report(|| json!({"revoked": id.to_string()}))
        }
    }
}

const LIST_HINT: &str = "'retargetd keys list' lists them";

fn failed(refusal: Refusal) -> Exit {
    match refusal {
        Refusal::NotFound { .. } => Exit::new(BAD_USAGE, refusal.to_string(), LIST_HINT),
        Refusal::TooManyKeys { .. } => {
            Exit::new(BAD_USAGE, refusal.to_string(), "'retargetd keys revoke' ends one that is no longer used")
        }
        refusal => Exit::new(FAILED, refusal.to_string(), ""),
    }
}

fn line(key: &ApiKeyRecord) -> String {
    let scopes = key.scopes.iter().map(|scope| scope.name()).collect::<Vec<_>>().join(",");
    let end = key.expires_at.map_or_else(|| "no end".to_owned(), |end| format!("until {end}"));
    let used = key.last_used_at.map_or_else(|| "never used".to_owned(), |used| format!("last used {used}"));
    let revoked = key.revoked_at.map(|revoked| format!(", revoked {revoked}")).unwrap_or_default();
    let note = if key.note.is_empty() { String::new() } else { format!(": {}", key.note) };
    format!("{} {} {scopes} since {} {end}, {used}{revoked}{note}", key.id, key.principal, key.created_at)
}

fn view(key: &ApiKeyRecord) -> Value {
    let time = |time: Option<jiff::Timestamp>| time.map(|time| time.to_string());
    json!({"id": key.id.to_string(), "principal": key.principal.to_string(),
        "scopes": key.scopes.iter().map(|scope| scope.name()).collect::<Vec<_>>(), "created_at": key.created_at.to_string(),
        "expires_at": time(key.expires_at), "last_used_at": time(key.last_used_at), "revoked_at": time(key.revoked_at),
        "note": key.note})
}

fn principal(text: &str) -> Result<Principal, String> {
    Principal::parse(text).map_err(|error| error.to_string())
}

fn note(text: &str) -> Result<String, String> {
    NewKey::check_note(text).map(|()| text.to_owned())
}

fn scope(text: &str) -> Result<Scope, String> {
    Scope::from_name(text).ok_or_else(|| "the scopes are read, write and admin".to_owned())
}

fn period(text: &str) -> Result<Duration, String> {
    Period::parse(text).map(|period| period.0)
}
