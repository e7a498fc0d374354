//! The same inputs give the same bytes, whatever the number of threads.

use retargetd::{
    engine::{Format, Inputs, Limits, NamedBytes, Outcome, retarget},
    model::Control,
    samples,
};

use crate::support::corpus_file;

fn bytes_of(inputs: &Inputs<'_>, threads: usize) -> (Vec<Vec<u8>>, String) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
    let result = pool.install(|| retarget(inputs, &Limits::default(), &Control::new()));
    let Outcome { outputs, resolved_spec, .. } = result.expect("a result");
    (outputs.into_iter().map(|output| output.bytes).collect(), resolved_spec.to_string())
}

fn assert_same_bytes(source: NamedBytes<'_>, target: NamedBytes<'_>) {
    let formats = [Format::Glb, Format::Bvh, Format::PosesNpz, Format::PosesJson];
    let inputs = Inputs { source, target, source_rest: None, target_rest: None, config: None, formats: &formats };
    let once = bytes_of(&inputs, 1);
    assert_eq!(once, bytes_of(&inputs, 2), "{}: two threads give what one gives", source.name);
    assert_eq!(once, bytes_of(&inputs, 2), "{}: and again", source.name);
}

#[test]
fn samples_do_not_depend_on_threads() {
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    assert_same_bytes(
        NamedBytes { name: "walk.glb", bytes: &walk },
        NamedBytes { name: "mannequin.glb", bytes: &mannequin },
    );
}

#[test]
fn a_long_clip_does_not_depend_on_threads() {
    let Some(source) = corpus_file("bvh/xsens/aitviewer_sample.bvh") else { return };
    let Some(target) = corpus_file("unreal/ue4_names_apose.glb") else { return };
    let (source, target) = (std::fs::read(source).expect("readable"), std::fs::read(target).expect("readable"));
    assert_same_bytes(
        NamedBytes { name: "source.bvh", bytes: &source },
        NamedBytes { name: "target.glb", bytes: &target },
    );
}

#[test]
fn the_resolved_spec_gives_the_same_result() {
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    let source = NamedBytes { name: "walk.glb", bytes: &walk };
    let target = NamedBytes { name: "mannequin.glb", bytes: &mannequin };
    let formats = [Format::PosesNpz];
    let plain = Inputs { source, target, source_rest: None, target_rest: None, config: None, formats: &formats };
    let (outputs, spec) = bytes_of(&plain, 1);
    let config = Some(NamedBytes { name: "config.json", bytes: spec.as_bytes() });
    let (again, spec_again) = bytes_of(&Inputs { config, ..plain }, 1);
    assert_eq!(outputs, again, "the resolved spec gives the same bytes");
    assert_eq!(spec, spec_again, "and resolves to itself");
}
