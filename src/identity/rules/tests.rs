//! What is read from claims that were found signed.

use serde_json::json;

use super::*;

const NOW: i64 = 1_800_000_000;

fn rules(change: impl FnOnce(&mut Settings)) -> Rules {
    let mut settings = Settings::default();
    change(&mut settings);
    Rules::new(&settings)
}

fn identity(rules: &Rules, claims: Value) -> Result<Identity, TokenError> {
    let Value::Object(claims) = claims else { panic!("claims are an object") };
    rules.identity(&Claims(claims), Timestamp::from_second(NOW).expect("a time"))
}

#[test]
fn times_are_taken_with_the_leeway_and_not_beyond() {
    let rules = rules(|_| ());
    let at = |exp: Value, nbf: Value| identity(&rules, json!({"sub": "ann", "exp": exp, "nbf": nbf})).map(|_| ());
    let long_ago = json!(NOW - 3600);
    assert_eq!(at(json!(NOW + 1), long_ago.clone()), Ok(()), "good");
    assert_eq!(at(json!(NOW - 29), long_ago.clone()), Ok(()), "the clocks differ");
    assert_eq!(at(json!(NOW - 30), long_ago.clone()), Err(TokenError::Expired), "over");
    assert_eq!(at(json!(NOW as f64 + 0.5), json!(NOW + 30)), Ok(()), "about to begin, and a fraction");
    assert_eq!(at(json!(NOW + 60), json!(NOW + 31)), Err(TokenError::NotYet), "not begun");
    assert_eq!(at(json!("tomorrow"), long_ago), Err(TokenError::Claim("exp".to_owned())), "no time");
    assert_eq!(identity(&rules, json!({"sub": "ann"})), Err(TokenError::Claim("exp".to_owned())), "no end");
}

#[test]
fn scopes_are_those_of_this_service_however_they_are_listed() {
    let scopes = |rules: &Rules, claims: Value| {
        let mut claims = claims;
        (claims["sub"], claims["exp"]) = (json!("ann"), json!(NOW + 60));
        identity(rules, claims).expect("a good token").scopes
    };
    let plain = rules(|_| ());
    let text = json!({"scope": "openid retargetd:write read retargetd:read retargetd:paint"});
    assert_eq!(scopes(&plain, text), [Scope::Read, Scope::Write], "known ones, in order");
    assert_eq!(scopes(&plain, json!({"scope": ["retargetd:admin"]})), [Scope::Admin], "a list");
    assert_eq!(scopes(&plain, json!({"scope": 7})), [], "nothing that can be used");
    assert_eq!(scopes(&plain, json!({})), [], "nothing");
    let nested = rules(|settings| {
        settings.token_scope_claim = "/resource_access/a~1b/roles".to_owned();
        settings.token_scope_prefix = String::new();
    });
    assert_eq!(scopes(&nested, json!({"resource_access": {"a/b": {"roles": ["read"]}}})), [Scope::Read], "deep inside");
    let address = rules(|settings| settings.token_scope_claim = "https://studio.example/scopes".to_owned());
    assert_eq!(
        scopes(&address, json!({"https://studio.example/scopes": "retargetd:read"})),
        [Scope::Read],
        "a name that is a URL"
    );
}

#[test]
fn who_calls_is_a_text_and_never_the_holder_of_a_key() {
    let rules = rules(|settings| settings.token_principal_claim = "email".to_owned());
    let who = |email: Value| identity(&rules, json!({"email": email, "exp": NOW + 60}));
    let ann = who(json!("ann@studio.example")).expect("a good token").principal;
    assert_eq!(ann.as_str(), "token:ann@studio.example", "told apart from keys");
    assert!(Principal::parse(ann.as_str()).is_err(), "no key is made for it");
    for nobody in [json!(""), json!(7), json!(null)] {
        assert_eq!(who(nobody.clone()), Err(TokenError::Claim("email".to_owned())), "{nobody}");
    }
}
