//! What the records of keys and of named documents promise, whichever database keeps them; part of the suite of `records`.

use jiff::Timestamp;
use retargetd::store::{
    ApiKeyId, ApiKeyRecord, DocumentBounds, DocumentChange, DocumentKind, NewDocument, Precondition, Records, Scope,
};

use super::records::{HOUR, principal};

/// So many documents, of any size.
pub(super) fn bounds(documents: u64) -> DocumentBounds {
    DocumentBounds { documents, versions: 1000, bytes: u64::MAX }
}

pub(super) async fn keys_are_found_bounded_and_revoked(records: &Records) {
    let key = |owner: &str, expires_at: Option<Timestamp>| ApiKeyRecord {
        id: ApiKeyId::new(),
        principal: principal(owner),
        sha256: "aa".to_owned(),
        scopes: vec![Scope::Read, Scope::Admin],
        created_at: Timestamp::UNIX_EPOCH + HOUR,
        expires_at,
        last_used_at: None,
        note: "night shift".to_owned(),
        revoked_at: None,
    };
    let first = key("ann", Some(Timestamp::UNIX_EPOCH + HOUR * 2));
    assert!(records.add_api_key(&first, 1).await.expect("writes"), "the first");
    assert!(!records.add_api_key(&key("ann", None), 1).await.expect("answers"), "no second one");
    assert!(records.add_api_key(&key("bob", None), 1).await.expect("writes"), "of another");
    assert_eq!(records.api_key(&first.id).await.expect("reads").as_ref(), Some(&first), "every field");
    let ended = ApiKeyRecord { created_at: Timestamp::UNIX_EPOCH + HOUR * 2, ..key("ann", None) };
    assert!(records.add_api_key(&ended, 1).await.expect("writes"), "the first has ended by then");
    let racers = (0..8).map(|_| {
        let (records, key) = (records.clone(), key("cy", None));
        async move { records.add_api_key(&key, 2).await }
    });
    let made = futures::future::join_all(racers).await.into_iter().filter(|made| matches!(made, Ok(true))).count();
    assert_eq!(made, 2, "two of many who come at the same time");
    assert_eq!(records.api_keys().await.expect("lists").len(), 5, "all of them");
    let now = Timestamp::UNIX_EPOCH + HOUR * 3;
    assert!(records.revoke_api_key(&first.id, now).await.expect("revokes"), "it was there");
    assert!(!records.revoke_api_key(&first.id, now).await.expect("answers"), "once");
    assert_eq!(records.api_key(&first.id).await.expect("reads"), None, "it opens nothing");
    let listed = records.api_keys().await.expect("lists");
    let revoked: Vec<_> = listed.iter().filter(|key| key.revoked_at.is_some()).collect();
    assert_eq!((listed.len(), revoked.len()), (5, 1), "it stays in the list");
    assert_eq!((&revoked[0].id, revoked[0].revoked_at), (&first.id, Some(now)), "with the time");
}

pub(super) async fn documents_have_versions_and_one_writer_at_a_time(records: &Records) {
    let put = async |text: &str, precondition: Precondition| {
        let new = NewDocument {
            owner: &principal("ann"),
            kind: DocumentKind::Preset,
            name: "hero",
            sha256: text,
            document: text,
        };
        records.put_document(new, &precondition, bounds(3), Timestamp::UNIX_EPOCH).await.expect("writes")
    };
    assert!(matches!(put("1", Precondition::Absent).await, DocumentChange::Created(record) if record.version == 1));
    assert!(matches!(put("2", Precondition::Absent).await, DocumentChange::Refused(Some(_))), "it is there");
    let writers = (0..8).map(|number| {
        let records = records.clone();
        let text = format!("w{number}");
        async move {
            let new = NewDocument {
                owner: &principal("ann"),
                kind: DocumentKind::Preset,
                name: "hero",
                sha256: &text,
                document: &text,
            };
            records.put_document(new, &Precondition::Is(vec!["1".to_owned()]), bounds(3), Timestamp::UNIX_EPOCH).await
        }
    });
    let outcomes = futures::future::join_all(writers).await;
    let won = outcomes.iter().filter(|outcome| matches!(outcome, Ok(DocumentChange::Replaced(_)))).count();
    assert_eq!(won, 1, "one of many who have seen the same wins: {outcomes:?}");
}
