//! Tokens of an identity provider: which open what, and what happens to keys and issuers that come and go.

use std::{
    net::{SocketAddr, TcpListener},
    process::Command,
    time::Duration,
};

use base64::{Engine as _, engine::general_purpose::URL_SAFE_NO_PAD};
use jsonwebtoken::{Algorithm, EncodingKey, Header, encode};
use reqwest::{Method, Response};
use retargetd::{jobs::Scope, telemetry::Clock};
use serde_json::{Value, json};

use super::{
    identity_provider::{AUDIENCE, Provider, TokenKey, claims},
    support::{BVH, PATIENCE, Service, ServiceProcess, header, json as read, problem, taken},
};

const READ: &str = "openid retargetd:read";
const ALL: &str = "retargetd:read retargetd:write retargetd:admin";

/// A service that takes tokens of that issuer and has them fetched as often as it likes.
async fn service(issuer: &str, more: &[(&str, &str)]) -> Service {
    let settings = [("token_issuer", issuer), ("token_audience", AUDIENCE), ("token_keys_pause", "50ms")];
    Service::start(&[&settings[..], more].concat()).await
}

async fn ask(service: &Service, token: &str, method: Method, path: &str) -> Response {
    let request = service.client.request(method, service.at(path)).bearer_auth(token);
    request.body(BVH).send().await.expect("an answer")
}

async fn status(service: &Service, token: &str) -> u16 {
    ask(service, token, Method::GET, "/v1/jobs").await.status().as_u16()
}

/// Looks until a token has that status.
async fn until(service: &Service, token: &str, expected: u16) {
    let seen = async {
        while status(service, token).await != expected {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    };
    tokio::time::timeout(PATIENCE, seen).await.unwrap_or_else(|_| panic!("the status becomes {expected}"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_token_opens_what_its_scopes_say_beside_keys() {
    let made =
        [Algorithm::ES256, Algorithm::EdDSA, Algorithm::RS256].map(|way| TokenKey::new(&format!("{way:?}"), way));
    let provider = Provider::start(&made.each_ref()).await;
    let service = service(&provider.url, &[]).await;
    for key in &made {
        let token = key.sign(&claims(&provider.url, "ann", READ));
        assert_eq!(status(&service, &token).await, 200, "signed in any way that is taken: {token}");
    }
    let other_way = made[2].sign_as(Algorithm::PS256, "RS256", &claims(&provider.url, "ann", READ));
    assert_eq!(status(&service, &other_way).await, 200, "one key of RSA is good for several ways");
    let several = json!({"aud": ["https://other.example", AUDIENCE], "scope": ["retargetd:read"]});
    let mut of_several = claims(&provider.url, "ann", "");
    of_several.as_object_mut().expect("an object").extend(several.as_object().expect("an object").clone());
    assert_eq!(status(&service, &made[0].sign(&of_several)).await, 200, "lists of audiences and scopes");

    let reader = made[0].sign(&claims(&provider.url, "ann", READ));
    let refused = ask(&service, &reader, Method::POST, "/v1/assets?filename=walk.bvh").await;
    let challenge = header(&refused, "www-authenticate").to_owned();
    assert!(challenge.contains("insufficient_scope") && challenge.contains("\"retargetd:write\""), "{challenge}");
    let refused = problem(refused, 403, "forbidden").await;
    assert!(refused["detail"].as_str().is_some_and(|detail| detail.contains("'retargetd:write'")), "{refused}");
    let nothing = made[0].sign(&claims(&provider.url, "ann", "read write admin"));
    problem(ask(&service, &nothing, Method::GET, "/v1/jobs").await, 403, "forbidden").await;

    let operator = made[0].sign(&claims(&provider.url, "operator", ALL));
    let body = json!({"principal": "farm"});
    let made = service.client.post(service.at("/v1/keys")).bearer_auth(&operator).json(&body).send().await;
    let made = read(made.expect("an answer")).await;
    assert_eq!(status(&service, made["secret"].as_str().expect("a key")).await, 200, "keys are good as before");
    let wrong = ask(&service, "rtk_made_up", Method::GET, "/v1/jobs").await;
    problem(wrong, 401, "unauthenticated").await;
    service.stop().await;
}

/// A text as tokens hold their parts.
fn part(value: &Value) -> String {
    URL_SAFE_NO_PAD.encode(value.to_string())
}

#[tokio::test(flavor = "multi_thread")]
async fn every_other_token_is_refused_with_its_reason() {
    let (elliptic, rsa) = (TokenKey::new("one", Algorithm::ES256), TokenKey::new("two", Algorithm::RS256));
    let provider = Provider::start(&[&elliptic, &rsa]).await;
    let service = service(&provider.url, &[("token_algorithms", "RS256,ES256")]).await;
    let good = claims(&provider.url, "ann", READ);
    assert_eq!(status(&service, &elliptic.sign(&good)).await, 200, "the one that the others differ from");
    let now = Clock::system().now().as_second();
    let but = |name: &str, value: Value| {
        let mut changed = good.clone();
        changed[name] = value;
        elliptic.sign(&changed)
    };
    let without = |name: &str| {
        let mut changed = good.clone();
        changed.as_object_mut().expect("an object").shift_remove(name);
        elliptic.sign(&changed)
    };
    let with_secret = |secret: &[u8]| {
        let header = Header { kid: Some("two".to_owned()), ..Header::new(Algorithm::HS256) };
        encode(&header, &good, &EncodingKey::from_secret(secret)).expect("a token")
    };
    let modulus = rsa.public()["n"].as_str().expect("a modulus").to_owned();
    let signed = elliptic.sign(&good);
    let (head, signature) = (signed.split('.').next().expect("a header"), signed.rsplit('.').next().expect("one"));
    let forged = json!({"iss": provider.url, "aud": AUDIENCE, "sub": "bob", "scope": ALL, "exp": now + 3600});
    let critical = json!({"alg": "ES256", "kid": "one", "crit": ["b64"], "b64": false});
    let strangers = TokenKey::new("one", Algorithm::ES256);
    let cases = [
        ("expired", but("exp", json!(now - 31)), "token_expired", "expired"),
        ("not begun", but("nbf", json!(now + 120)), "token_refused", "not valid yet"),
        ("no end", without("exp"), "token_refused", "'exp'"),
        ("another audience", but("aud", json!("https://other.example")), "token_refused", "audience"),
        ("no audience", without("aud"), "token_refused", "'aud'"),
        ("another issuer", but("iss", json!("https://evil.example")), "token_refused", "issuer"),
        ("no issuer", without("iss"), "token_refused", "'iss'"),
        ("nobody", without("sub"), "token_refused", "'sub'"),
        ("a key of somebody else, by the same id", strangers.sign(&good), "token_refused", "signature"),
        ("a key that nobody knows", strangers.sign_as(Algorithm::ES256, "three", &good), "token_refused", "no key"),
        ("the key of another way", rsa.sign_as(Algorithm::RS256, "one", &good), "token_refused", "no key"),
        ("a way that is not allowed", rsa.sign_as(Algorithm::PS256, "two", &good), "token_refused", "PS256"),
        ("the public key as a secret", with_secret(modulus.as_bytes()), "token_refused", "shared secret"),
        (
            "its bytes as a secret",
            with_secret(&URL_SAFE_NO_PAD.decode(&modulus).expect("bytes")),
            "token_refused",
            "shared secret",
        ),
        (
            "no signature",
            format!("{}.{}.", part(&json!({"alg": "none"})), part(&good)),
            "token_refused",
            "not a signed",
        ),
        ("NONE", format!("{}.{}.", part(&json!({"alg": "NONE"})), part(&good)), "token_refused", "not a signed"),
        ("an empty signature", format!("{head}.{}.", part(&good)), "token_refused", "signature"),
        ("other claims under it", format!("{head}.{}.{signature}", part(&forged)), "token_refused", "signature"),
        (
            "what must be understood and is not",
            format!("{}.{}.{signature}", part(&critical), part(&good)),
            "token_refused",
            "extension",
        ),
        ("no token", "sesame".to_owned(), "token_refused", "not a signed"),
        ("too many parts", format!("{signed}.{signature}"), "token_refused", "not a signed"),
    ];
    for (name, token, code, reason) in cases {
        let answer = ask(&service, &token, Method::GET, "/v1/jobs").await;
        let challenge = header(&answer, "www-authenticate").to_owned();
        assert!(challenge.contains("error=\"invalid_token\""), "{name}: {challenge}");
        let problem = problem(answer, 401, code).await;
        assert!(problem["detail"].as_str().is_some_and(|detail| detail.contains(reason)), "{name}: {problem}");
        assert!(challenge.contains(reason), "{name}, in the header too: {challenge}");
        let told = format!("{problem}{challenge}");
        assert!(!told.contains(&token) && !told.contains("ann"), "{name}: nothing of the token is told: {told}");
    }
    let nothing = problem(service.get("/v1/jobs").await, 401, "unauthenticated").await;
    assert!(nothing["hint"].as_str().is_some_and(|hint| hint.contains(&provider.url)), "whose token: {nothing}");
    service.clock.advance(Duration::from_secs(3600 + 60));
    let late = ask(&service, &signed, Method::GET, "/v1/jobs").await;
    problem(late, 401, "token_expired").await;
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn principals_of_tokens_and_keys_see_nothing_of_one_another() {
    let key = TokenKey::new("one", Algorithm::ES256);
    let provider = Provider::start(&[&key]).await;
    let service = service(&provider.url, &[]).await;
    let token = |subject: &str| key.sign(&claims(&provider.url, subject, ALL));
    let (ann, bob, odd) = (token("ann"), token("bob"), token("Ann Ö. <ann@studio.example>"));
    let holder = service.key("ann", &[Scope::Read, Scope::Write]).await;
    let uploaded = taken(ask(&service, &ann, Method::POST, "/v1/assets?filename=walk.bvh").await).await;
    let path = format!("/v1/assets/{uploaded}");
    assert_eq!(ask(&service, &ann, Method::GET, &path).await.status(), 200, "her own");
    let renewed = {
        let mut later = claims(&provider.url, "ann", READ);
        later["jti"] = json!("another");
        key.sign(&later)
    };
    assert_eq!(ask(&service, &renewed, Method::GET, &path).await.status(), 200, "with her next token as well");
    for (name, other) in [("another token", bob.as_str()), ("a key of the same name", holder.reveal()), ("odd", &odd)] {
        assert_eq!(ask(&service, other, Method::GET, &path).await.status(), 404, "{name}");
    }
    let own = taken(ask(&service, &odd, Method::POST, "/v1/assets?filename=walk.bvh").await).await;
    let path = format!("/v1/assets/{own}");
    assert_eq!(ask(&service, &odd, Method::GET, &path).await.status(), 200, "a subject that is no plain name");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn keys_are_rotated_and_an_issuer_may_go_away() {
    let [first, second, third] = ["1", "2", "3"].map(|id| TokenKey::new(id, Algorithm::ES256));
    let provider = Provider::start(&[&first]).await;
    let address: SocketAddr = provider.url.trim_start_matches("http://").parse().expect("an address");
    let service = service(&provider.url, &[("token_keys_period", "1s")]).await;
    let sign = |key: &TokenKey| key.sign(&claims(&format!("http://{address}"), "ann", READ));
    let (old, new, newest) = (sign(&first), sign(&second), sign(&third));
    assert_eq!((status(&service, &old).await, status(&service, &new).await), (200, 401), "the first key");
    provider.publish(&[&first, &second]);
    until(&service, &new, 200).await;
    assert_eq!(status(&service, &old).await, 200, "both, while the issuer has both");
    provider.publish(&[&second]);
    until(&service, &old, 401).await;
    assert_eq!(status(&service, &new).await, 200, "the one that is left");

    provider.stop().await;
    tokio::time::sleep(Duration::from_millis(1200)).await;
    assert_eq!(status(&service, &newest).await, 401, "nobody can say whose it is");
    assert_eq!(status(&service, &new).await, 200, "known keys are good while the issuer is away");
    assert_eq!(service.get("/readyz").await.status(), 200, "which is no reason to send nobody here");
    let provider = Provider::start_at(address, &[&third]).await;
    until(&service, &newest, 200).await;
    until(&service, &new, 401).await;
    provider.stop().await;
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn made_up_names_of_keys_do_not_flood_the_issuer() {
    let (known, stranger) = (TokenKey::new("one", Algorithm::ES256), TokenKey::new("x", Algorithm::ES256));
    let provider = Provider::start(&[&known]).await;
    let service = service(&provider.url, &[("token_keys_pause", "1h")]).await;
    for name in 0..50 {
        let token = stranger.sign_as(Algorithm::ES256, &format!("made up {name}"), &claims(&provider.url, "ann", ALL));
        assert_eq!(status(&service, &token).await, 401, "nobody's");
    }
    assert_eq!(provider.asked(), 1, "at the start, and not again before the pause is over");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn without_an_issuer_at_the_start_keys_are_good_and_nothing_is_sent_here_until_it_comes() {
    let address = TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr()).expect("a free port");
    let issuer = format!("http://{address}");
    let service = service(&issuer, &[]).await;
    let signer = TokenKey::new("one", Algorithm::ES256);
    let token = signer.sign(&claims(&issuer, "ann", READ));
    let answer = ask(&service, &token, Method::GET, "/v1/jobs").await;
    assert!(!header(&answer, "retry-after").is_empty(), "when to try again");
    problem(answer, 503, "unavailable").await;
    problem(service.get("/readyz").await, 503, "unavailable").await;
    let key = service.key("farm", &[Scope::Read]).await;
    assert_eq!(status(&service, key.reveal()).await, 200, "keys need no issuer");
    let provider = Provider::start_at(address, &[&signer]).await;
    until(&service, &token, 200).await;
    assert_eq!(service.get("/readyz").await.status(), 200, "ready from now on");
    provider.stop().await;
    service.stop().await;
}

/// The program as an operator starts it, with keys in a file; and nothing of a token in its log, at whatever level.
#[tokio::test(flavor = "multi_thread")]
async fn keys_may_come_from_a_file_and_tokens_never_reach_the_log() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (file, log) = (folder.path().join("keys.json"), folder.path().join("log"));
    let signer = TokenKey::new("one", Algorithm::ES256);
    std::fs::write(&file, json!({ "keys": [signer.public()] }).to_string()).expect("a file");
    let start = |flags: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
        command.args(["serve", "--listen", "127.0.0.1:0", "--log", "trace", "--token-issuer", "farm", "--data"]);
        command.arg(folder.path().join("data")).args(flags).arg("--token-keys").arg(&file);
        command
    };
    let output = start(&[]).output().expect("it runs");
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(2) && told.contains("--token-audience"), "what is missing: {told}");

    let log_file = std::fs::File::create(&log).expect("a file");
    let server = ServiceProcess::listening_with_log(&mut start(&["--token-audience", AUDIENCE]), log_file);
    let client = reqwest::Client::builder().no_proxy().timeout(PATIENCE).build().expect("a client");
    let stranger = TokenKey::new("one", Algorithm::ES256);
    let shown = [&signer, &stranger].map(|key| key.sign(&claims("farm", "ann", READ)));
    let mut seen = Vec::new();
    for token in &shown {
        let answer = client.get(format!("{}/v1/jobs", server.url)).bearer_auth(token).send().await;
        seen.push(answer.expect("an answer").status().as_u16());
    }
    assert_eq!(seen, [200, 401], "the one that is signed with a key of the file");
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
    let log = std::fs::read_to_string(&log).expect("a log");
    assert!(log.contains("token:ann"), "who asked is in the log");
    for part in shown.iter().flat_map(|token| token.split('.').skip(1)) {
        assert!(!log.contains(part), "claims and signatures are not");
    }

    std::fs::remove_file(&file).expect("is removed");
    let output = start(&["--token-audience", AUDIENCE]).output().expect("it runs");
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(4) && told.contains("keys.json"), "which file: {told}");
}
