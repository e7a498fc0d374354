//! What curves of the source's clip say of alphas and contacts.

use std::collections::BTreeMap;

use super::{AlphaCurve, curves::ContactCurve};
use crate::{
    model::{Clip, Morph, Scene, Track},
    rig::error::{SpecErrorKind, SpecField},
};

/// Key times and values of a curve of the clip; tells where there is none of that name.
struct Curve<'a> {
    times_seconds: &'a [f64],
    weights: Option<&'a Track<f32>>,
    rest: f32,
}

impl<'a> Curve<'a> {
    fn find(
        name: &str,
        pointer: String,
        scene: &'a Scene,
        clip: &'a Clip,
        fields: &mut Vec<SpecField>,
    ) -> Option<Self> {
        let index = find(name, pointer, &scene.morphs, fields)?;
        let track = clip.morphs().iter().find(|track| track.morph == index);
        Some(Self {
            times_seconds: clip.times_seconds(),
            weights: track.map(|track| &track.weights),
            rest: scene.morphs[index].rest,
        })
    }

    fn keys(&self) -> impl Iterator<Item = (f64, f64)> {
        let value = |frame: usize| self.weights.map_or(self.rest, |weights| weights.at(frame, self.rest));
        self.times_seconds.iter().enumerate().map(move |(frame, time)| (*time, f64::from(value(frame))))
    }
}

/// The curve of that name; tells where there is none.
pub(in crate::retarget) fn find(
    name: &str,
    pointer: String,
    morphs: &[Morph],
    fields: &mut Vec<SpecField>,
) -> Option<usize> {
    let index = morphs.iter().position(|morph| morph.name == name);
    if index.is_none() {
        let detail = format!("the source has no curve and no morph '{name}'");
        let field = SpecField::new(SpecErrorKind::UnknownName, pointer, detail);
        fields.push(field.with_nearest(name, morphs.iter().map(|morph| morph.name.as_str())));
    }
    index
}

/// Keys of seconds and alpha, one per frame; none of the op where there is no such curve.
pub(in crate::retarget) fn alpha_keys(
    curve: &AlphaCurve,
    pointer: String,
    scene: &Scene,
    clip: &Clip,
    fields: &mut Vec<SpecField>,
) -> Vec<[f64; 2]> {
    let AlphaCurve { curve: name, gain, offset } = curve;
    let found = Curve::find(name, format!("{pointer}/curve"), scene, clip, fields);
    let key = |(time, value): (f64, f64)| [time, (value * gain + offset).clamp(0.0, 1.0)];
    found.map_or_else(|| vec![[0.0, 0.0]], |curve| curve.keys().map(key).collect())
}

/// For each point the times in which it touches, from its first to its last frame.
pub(in crate::retarget) fn contact_spans(
    curves: &BTreeMap<String, ContactCurve>,
    pointer: &str,
    scene: &Scene,
    clip: &Clip,
    fields: &mut Vec<SpecField>,
) -> BTreeMap<String, Vec<[f64; 2]>> {
    let mut spans = BTreeMap::new();
    for (point, bounds) in curves {
        let pointer = format!("{pointer}/{point}");
        if bounds.below.is_none() && bounds.above.is_none() {
            let detail = "a bound is needed: below or above which value the point touches";
            fields.push(SpecField::new(SpecErrorKind::InvalidValue, pointer.clone(), detail));
        }
        let Some(curve) = Curve::find(&bounds.curve, format!("{pointer}/curve"), scene, clip, fields) else { continue };
        let touches =
            |value: f64| bounds.below.is_none_or(|most| value < most) && bounds.above.is_none_or(|least| value > least);
        let mut runs: Vec<[f64; 2]> = Vec::new();
        let mut touched = false;
        for (time, value) in curve.keys() {
            let touching = touches(value);
            match runs.last_mut().filter(|_| touching && touched) {
                Some(run) => run[1] = time,
                None if touching => runs.push([time, time]),
                None => {}
            }
            touched = touching;
        }
        spans.insert(point.clone(), runs);
    }
    spans
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Morph, MorphPlace, MorphTrack};

    fn source() -> (Scene, Clip) {
        let scene = Scene {
            morphs: vec![Morph { name: "speed".into(), rest: 0.0, place: MorphPlace::Expression(Vec::new()) }],
            ..Scene::default()
        };
        let weights = Track::Sampled(vec![30.0, 10.0, 5.0, 40.0, 8.0]);
        let clip = Clip::new(String::new(), vec![0.0, 0.1, 0.2, 0.3, 0.4], Vec::new()).expect("a clip");
        (scene, clip.with_morphs(vec![MorphTrack { morph: 0, weights }]).expect("a curve"))
    }

    #[test]
    fn a_point_touches_while_its_curve_is_within_the_bounds() {
        let (scene, clip) = source();
        let mut fields = Vec::new();
        let slow = |below, above| {
            let curve = ContactCurve { curve: "speed".into(), below, above };
            BTreeMap::from([("left_toe".to_owned(), curve)])
        };
        let mut spans = |curves| contact_spans(&curves, "/ops/0/curves", &scene, &clip, &mut fields);
        assert_eq!(spans(slow(Some(15.0), None))["left_toe"], [[0.1, 0.2], [0.4, 0.4]], "below");
        assert_eq!(spans(slow(Some(35.0), Some(9.0)))["left_toe"], [[0.0, 0.1]], "between");
        spans(slow(None, None));
        assert_eq!(fields[0].pointer, "/ops/0/curves/left_toe", "a bound is needed");
    }

    #[test]
    fn an_alpha_is_the_curve_within_0_and_1() {
        let (scene, clip) = source();
        let mut fields = Vec::new();
        let curve = AlphaCurve { curve: "speed".into(), gain: -0.05, offset: 1.0 };
        let keys = alpha_keys(&curve, "/ops/0/alpha".into(), &scene, &clip, &mut fields);
        assert_eq!(keys, [[0.0, 0.0], [0.1, 0.5], [0.2, 0.75], [0.3, 0.0], [0.4, 0.6]], "one key a frame");
        let unknown = AlphaCurve { curve: "sped".into(), ..curve };
        alpha_keys(&unknown, "/ops/0/alpha".into(), &scene, &clip, &mut fields);
        assert_eq!(
            (fields[0].pointer.as_str(), &fields[0].did_you_mean[..]),
            ("/ops/0/alpha/curve", &["speed".to_owned()][..])
        );
    }
}
