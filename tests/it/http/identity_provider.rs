//! An identity provider inside the test: private keys made in this run, their public halves and a discovery document over HTTP.

use std::{
    net::SocketAddr,
    sync::{
        Arc, Mutex,
        atomic::{AtomicUsize, Ordering},
    },
};

use aws_lc_rs::{
    encoding::{AsDer, Pkcs8V1Der},
    rand::SystemRandom,
    rsa::{KeyPair, KeySize},
    signature::{ECDSA_P256_SHA256_FIXED_SIGNING, EcdsaKeyPair, Ed25519KeyPair},
};
use axum::{Json, Router, routing::get};
use jsonwebtoken::{
    Algorithm, EncodingKey, Header, encode,
    jwk::{Jwk, PublicKeyUse},
};
use retargetd::telemetry::Clock;
use serde_json::{Value, json};
use tokio::{net::TcpListener, task::JoinHandle};

/// What tokens for the service name.
pub(super) const AUDIENCE: &str = "https://retarget.studio.example";

/// A private key.
pub(super) struct TokenKey {
    id: String,
    algorithm: Algorithm,
    key: EncodingKey,
}

impl TokenKey {
    /// A new one for that algorithm.
    pub(super) fn new(id: &str, algorithm: Algorithm) -> Self {
        let random = SystemRandom::new();
        let key = match algorithm {
            Algorithm::ES256 => {
                let document = EcdsaKeyPair::generate_pkcs8(&ECDSA_P256_SHA256_FIXED_SIGNING, &random);
                EncodingKey::from_ec_der(document.expect("a key").as_ref())
            }
            Algorithm::EdDSA => {
                EncodingKey::from_ed_der(Ed25519KeyPair::generate_pkcs8v1(&random).expect("a key").as_ref())
            }
            _ => {
                let pair = KeyPair::generate(KeySize::Rsa2048).expect("a key");
                let document: Pkcs8V1Der<'_> = pair.as_der().expect("a document");
                // Before the key itself stand 26 bytes that say that it is one of RSA.
                EncodingKey::from_rsa_der(&document.as_ref()[26..])
            }
        };
        Self { id: id.to_owned(), algorithm, key }
    }

    /// Its public half, as issuers publish it.
    pub(super) fn public(&self) -> Value {
        let mut public = Jwk::from_encoding_key(&self.key, self.algorithm).expect("a public half");
        public.common.key_id = Some(self.id.clone());
        public.common.public_key_use = Some(PublicKeyUse::Signature);
        // Says nothing of its algorithm, as with most issuers: a key of RSA is good for several.
        public.common.key_algorithm = None;
        serde_json::to_value(public).expect("JSON")
    }

    /// A token with these claims.
    pub(super) fn sign(&self, claims: &Value) -> String {
        self.sign_as(self.algorithm, &self.id, claims)
    }

    /// A token whose header says something else.
    pub(super) fn sign_as(&self, algorithm: Algorithm, id: &str, claims: &Value) -> String {
        let header = Header { kid: Some(id.to_owned()), ..Header::new(algorithm) };
        encode(&header, claims, &self.key).expect("a token")
    }
}

/// Claims of a token that is good for an hour, made by that issuer about that subject.
pub(super) fn claims(issuer: &str, subject: &str, scopes: &str) -> Value {
    let now = Clock::system().now().as_second();
    json!({"iss": issuer, "aud": AUDIENCE, "sub": subject, "scope": scopes, "iat": now, "nbf": now, "exp": now + 3600})
}

/// An issuer that answers.
pub(super) struct Provider {
    /// What its tokens name it, and where it answers.
    pub(super) url: String,
    keys: Arc<Mutex<Value>>,
    asked: Arc<AtomicUsize>,
    task: JoinHandle<()>,
}

impl Provider {
    /// One that publishes these keys, on a port of its own.
    pub(super) async fn start(keys: &[&TokenKey]) -> Self {
        Self::start_at(SocketAddr::from(([127, 0, 0, 1], 0)), keys).await
    }

    /// One that publishes these keys there.
    pub(super) async fn start_at(address: SocketAddr, keys: &[&TokenKey]) -> Self {
        let listener = TcpListener::bind(address).await.expect("a port");
        let url = format!("http://{}", listener.local_addr().expect("an address"));
        let (asked, published) = (Arc::new(AtomicUsize::new(0)), Arc::new(Mutex::new(Value::Null)));
        let discovery = json!({"issuer": url, "jwks_uri": format!("{url}/keys")});
        let (counted, shown) = (Arc::clone(&asked), Arc::clone(&published));
        let router =
            Router::new().route("/.well-known/openid-configuration", get(async move || Json(discovery))).route(
                "/keys",
                get(async move || {
                    counted.fetch_add(1, Ordering::SeqCst);
                    Json(shown.lock().expect("unbroken").clone())
                }),
            );
        let task = tokio::spawn(async move { axum::serve(listener, router).await.expect("serves") });
        let provider = Self { url, keys: published, asked, task };
        provider.publish(keys);
        provider
    }

    /// Publishes these keys from now on, and no others.
    pub(super) fn publish(&self, keys: &[&TokenKey]) {
        let keys: Vec<Value> = keys.iter().map(|key| key.public()).collect();
        *self.keys.lock().expect("unbroken") = json!({ "keys": keys });
    }

    /// How often its keys were fetched.
    pub(super) fn asked(&self) -> usize {
        self.asked.load(Ordering::SeqCst)
    }

    /// Goes away: nobody answers at its address any more.
    pub(super) async fn stop(self) {
        self.task.abort();
        // The port is free when the task is gone.
        let _ = self.task.await;
    }
}
