//! The public keys of an issuer, as JWK sets (RFC 7517) list them.

use jsonwebtoken::{
    Algorithm, DecodingKey,
    jwk::{AlgorithmParameters, EllipticCurve, Jwk, KeyAlgorithm, KeyOperations, PublicKeyUse},
};
use serde::Deserialize;

/// The keys that signatures can be checked with.
#[derive(Debug)]
pub(super) struct KeySet(Vec<SigningKey>);

#[derive(Debug)]
struct SigningKey {
    id: Option<String>,
    /// What it may be used for, and nothing else.
    algorithms: Vec<Algorithm>,
    key: DecodingKey,
}

impl KeySet {
    /// Reads a set. Keys for other purposes and of kinds that are not known are passed over: sets hold such beside the others.
    ///
    /// # Errors
    /// When the text is no set, or no key of it can be used: an issuer that publishes such a thing has made a mistake, and the keys from
    /// before are the better ones.
    pub(super) fn parse(text: &[u8]) -> Result<Self, String> {
        #[derive(Deserialize)]
        struct Set {
            keys: Vec<serde_json::Value>,
        }
        let set: Set = serde_json::from_slice(text).map_err(|error| format!("it is not a JWK set: {error}"))?;
        let keys = set.keys.into_iter().filter_map(|key| SigningKey::read(&serde_json::from_value(key).ok()?));
        let keys: Vec<_> = keys.collect();
        if keys.is_empty() {
            return Err("it has no public key that signatures could be checked with".to_owned());
        }
        Ok(Self(keys))
    }

    /// The key of that id for that algorithm. A token that names no key is checked with the only one that there is for its algorithm.
    pub(super) fn find(&self, id: Option<&str>, algorithm: Algorithm) -> Option<&DecodingKey> {
        let mut fitting = self.0.iter().filter(|key| key.algorithms.contains(&algorithm));
        match id {
            Some(id) => fitting.find(|key| key.id.as_deref() == Some(id)).map(|key| &key.key),
            None => fitting.next().filter(|_| fitting.next().is_none()).map(|key| &key.key),
        }
    }
}

impl SigningKey {
    fn read(key: &Jwk) -> Option<Self> {
        let common = &key.common;
        let is_for_signatures = matches!(common.public_key_use, None | Some(PublicKeyUse::Signature))
            && common.key_operations.as_ref().is_none_or(|uses| uses.contains(&KeyOperations::Verify));
        let mut algorithms = algorithms_of(&key.algorithm);
        if let Some(only) = common.key_algorithm {
            algorithms.retain(|algorithm| KeyAlgorithm::from(*algorithm) == only);
        }
        if !is_for_signatures || algorithms.is_empty() {
            return None;
        }
        Some(Self { id: common.key_id.clone(), algorithms, key: DecodingKey::from_jwk(key).ok()? })
    }
}

/// What a key of that kind can check. A shared secret is no public key, so it checks nothing.
fn algorithms_of(parameters: &AlgorithmParameters) -> Vec<Algorithm> {
    use Algorithm::{ES256, ES384, EdDSA, PS256, PS384, PS512, RS256, RS384, RS512};
    match parameters {
        AlgorithmParameters::RSA(_) => vec![RS256, RS384, RS512, PS256, PS384, PS512],
        AlgorithmParameters::EllipticCurve(key) if key.curve == EllipticCurve::P256 => vec![ES256],
        AlgorithmParameters::EllipticCurve(key) if key.curve == EllipticCurve::P384 => vec![ES384],
        AlgorithmParameters::OctetKeyPair(key) if key.curve == EllipticCurve::Ed25519 => vec![EdDSA],
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn elliptic(id: &str) -> serde_json::Value {
        json!({"kty": "EC", "crv": "P-256", "kid": id, "x": "AAAA", "y": "AAAA"})
    }

    fn set(keys: &[serde_json::Value]) -> Result<KeySet, String> {
        KeySet::parse(json!({ "keys": keys }).to_string().as_bytes())
    }

    #[test]
    fn a_key_is_found_by_its_id_and_for_its_own_algorithm_only() {
        let keys = set(&[elliptic("one"), elliptic("two")]).expect("a set");
        assert!(keys.find(Some("two"), Algorithm::ES256).is_some(), "its own");
        for other in [Algorithm::RS256, Algorithm::ES384, Algorithm::EdDSA, Algorithm::HS256] {
            assert!(keys.find(Some("two"), other).is_none(), "{other:?} with a key of P-256");
        }
        assert!(keys.find(Some("three"), Algorithm::ES256).is_none(), "nobody's");
        assert!(keys.find(None, Algorithm::ES256).is_none(), "either could be meant");
        let one = set(&[elliptic("one")]).expect("a set");
        assert!(one.find(None, Algorithm::ES256).is_some(), "the only one");
    }

    #[test]
    fn what_is_no_public_key_for_signatures_is_passed_over() {
        let strange = [
            json!({"kty": "oct", "kid": "secret", "k": "c2VzYW1l"}),
            json!({"kty": "EC", "crv": "P-256", "kid": "for encryption", "use": "enc", "x": "AAAA", "y": "AAAA"}),
            json!({"kty": "EC", "crv": "P-256", "kid": "agreed", "key_ops": ["deriveKey"], "x": "AAAA", "y": "AAAA"}),
            json!({"kty": "RSA", "kid": "wrapping", "alg": "RSA-OAEP", "n": "AAAA", "e": "AQAB"}),
            json!({"kty": "AKP", "kid": "of tomorrow", "alg": "ML-DSA-44", "pub": "AAAA"}),
            json!("nothing"),
        ];
        let refused = set(&strange).expect_err("there is none left");
        assert!(refused.contains("no public key"), "{refused}");
        let keys = set(&[&strange[..], &[elliptic("good")]].concat()).expect("one is left");
        assert_eq!(keys.0.len(), 1, "the good one");
        assert!(keys.find(Some("secret"), Algorithm::HS256).is_none(), "secrets are no keys");
        assert!(KeySet::parse(b"<html>").is_err() && KeySet::parse(b"{}").is_err(), "no sets");
    }

    #[test]
    fn a_key_may_narrow_what_it_is_for() {
        let key = json!({"kty": "RSA", "kid": "one", "alg": "PS256", "use": "sig", "n": "AAAA", "e": "AQAB"});
        let keys = set(&[key]).expect("a set");
        assert!(keys.find(Some("one"), Algorithm::PS256).is_some(), "as it says");
        assert!(keys.find(Some("one"), Algorithm::RS256).is_none(), "and nothing else");
    }
}
