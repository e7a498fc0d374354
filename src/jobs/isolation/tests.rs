//! What goes over the pipes comes out as it went in, and nothing is believed because a number says so.

use super::{frames, messages::*};
use crate::{
    engine::{Failure, FailureCode, FieldError, Format, Inputs, Knowledge, Limits, NamedBytes},
    jobs::failure,
};

#[test]
fn a_request_is_the_same_on_the_other_side() {
    let formats = [Format::Glb, Format::Bvh];
    let file = |name: &'static str, bytes: &'static [u8]| NamedBytes { name, bytes };
    let inputs = Inputs {
        source: file("walk.bvh", b"source"),
        target: file("hero.glb", b""),
        source_rest: None,
        target_rest: Some(file("rest.glb", b"rest")),
        config: Some(file("config.yaml", b"align: off")),
        formats: &formats,
    };
    let task = Task::Explain { frame: 3, joint: "Hips".to_owned() };
    let limits = Limits { nodes: 7, ..Limits::default() };
    let (request, blobs) = Request::new(task.clone(), &inputs, &Knowledge::default(), &limits);
    let mut pipe = Vec::new();
    frames::write(&mut pipe, &request, &blobs).expect("a vector takes all");
    frames::write(&mut pipe, &Answer::Document, &[]).expect("a vector takes all");
    let mut pipe = pipe.as_slice();
    let (read, blobs) = frames::read::<Request>(&mut pipe).expect("reads").expect("is there");
    assert_eq!((&read.task, read.limits), (&task, limits), "what is asked");
    let again = read.inputs(&blobs, &formats);
    assert_eq!((again.source.name, again.source.bytes), ("walk.bvh", &b"source"[..]), "the source");
    assert_eq!(again.target.bytes, b"", "an empty file is one");
    assert!(again.source_rest.is_none(), "what is not there");
    let rest = again.target_rest.expect("is there");
    assert_eq!((rest.name, rest.bytes), ("rest.glb", &b"rest"[..]), "and what comes behind it");
    assert_eq!(again.config.expect("is there").bytes, b"align: off", "the config");
    assert!(matches!(frames::read::<Answer>(&mut pipe), Ok(Some((Answer::Document, _)))), "the next message");
    assert!(matches!(frames::read::<Answer>(&mut pipe), Ok(None)), "and the end");
}

#[test]
fn numbers_without_bytes_behind_them_are_refused() {
    let mut whole = Vec::new();
    frames::write(&mut whole, &Answer::Document, &[b"{}"]).expect("a vector takes all");
    for length in 1..whole.len() {
        assert!(frames::read::<Answer>(&mut &whole[..length]).is_err(), "cut after {length} bytes");
    }
    let huge = [&[255_u8; 8][..], b"{}"].concat();
    assert!(frames::read::<Answer>(&mut huge.as_slice()).is_err(), "a header larger than any");
    let mut blob = whole[..whole.len() - 10].to_vec();
    blob.extend([255; 8]);
    assert!(frames::read::<Answer>(&mut blob.as_slice()).is_err(), "a blob larger than the memory");
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
