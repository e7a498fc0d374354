//! What goes over the pipes comes out as it went in, and nothing is believed because a number says so.

use std::sync::Arc;

use super::{frames, messages::*};
use crate::{
    engine::{Failure, FailureCode, FieldError, Format, Knowledge, Limits, NamedBytes},
    jobs::{EngineRequest, Files, Question, failure},
};

#[test]
fn a_request_is_the_same_on_the_other_side() {
    let formats = [Format::Glb, Format::Bvh];
    let file = |name: &'static str, bytes: &'static [u8]| NamedBytes { name, bytes };
    let files = Files {
        source: Some(file("walk.bvh", b"source")),
        target: Some(file("hero.glb", b"")),
        source_rest: None,
        target_rest: Some(file("rest.glb", b"rest")),
        scene: None,
        config: Some(file("config.yaml", b"align: off")),
        target_sha256: None,
    };
    let question = Question::Explain { frame: 3, joint: "Hips".to_owned() };
    let limits = Limits { nodes: 7, ..Limits::default() };
    let knowledge = Knowledge::default();
    let asked =
        EngineRequest { question: question.clone(), files, formats: &formats, knowledge: &knowledge, limits: &limits };
    let (request, blobs) = Request::new(&asked);
    let mut pipe = Vec::new();
    frames::write(&mut pipe, &request, &blobs).expect("a vector takes all");
    frames::write(&mut pipe, &Reply::Document, &[]).expect("a vector takes all");
    let mut pipe = pipe.as_slice();
    let (read, blobs) = frames::read::<Request>(&mut pipe).expect("reads").expect("is there");
    assert_eq!((&read.question, read.limits), (&question, limits), "what is asked");
    let blobs: Vec<_> = blobs.into_iter().map(Arc::new).collect();
    let again = read.files(&blobs);
    let source = again.source.expect("is there");
    assert_eq!((source.name, source.bytes), ("walk.bvh", &b"source"[..]), "the source");
    assert_eq!(again.target.expect("is there").bytes, b"", "an empty file is one");
    assert!(again.source_rest.is_none(), "what is not there");
    let rest = again.target_rest.expect("is there");
    assert_eq!((rest.name, rest.bytes), ("rest.glb", &b"rest"[..]), "and what comes behind it");
    assert_eq!(again.config.expect("is there").bytes, b"align: off", "the config");
    assert!(matches!(frames::read::<Reply>(&mut pipe), Ok(Some((Reply::Document, _)))), "the next message");
    assert!(matches!(frames::read::<Reply>(&mut pipe), Ok(None)), "and the end");
}

#[test]
fn numbers_without_bytes_behind_them_are_refused() {
    let mut whole = Vec::new();
    frames::write(&mut whole, &Reply::Document, &[b"{}"]).expect("a vector takes all");
    for length in 1..whole.len() {
        assert!(frames::read::<Reply>(&mut &whole[..length]).is_err(), "cut after {length} bytes");
    }
    let huge = [&[255_u8; 8][..], b"{}"].concat();
    assert!(frames::read::<Reply>(&mut huge.as_slice()).is_err(), "a header larger than any");
    let mut blob = whole[..whole.len() - 10].to_vec();
    blob.extend([255; 8]);
    assert!(frames::read::<Reply>(&mut blob.as_slice()).is_err(), "a blob larger than the memory");
}

#[test]
fn a_failure_is_the_same_on_the_other_side() {
    let field = FieldError {
        pointer: "/map/0".to_owned(),
        code: "unknown_joint".into(),
        detail: "no such joint".to_owned(),
        did_you_mean: vec!["Hips".to_owned()],
    };
    let failed = Failure::new(FailureCode::UnknownJoint, "there is no joint 'Hip'").in_part("config").with_hint("look");
    let failed = failed.with_errors(vec![field]);
    assert_eq!(failure::restore(failure::keep(failed.clone())), failed, "every field");
}
