//! What every edit does, as the body of an HTML page: for each a config, and a curve of the motion before and after it. Made from a clip by the
//! edits themselves, so it shows what they do and not what somebody once drew.

mod entries;

use std::borrow::Cow;

use crate::{
    editing::{Tolerance, reduce_keys},
    engine::{Failure, edited_clip, laid_over},
    model::{Clip, Control, Reporter, Scene},
    retarget::{KeysSpec, OutputChoice, RetargetSpec, parse_spec},
    rig::Rig,
};

use self::entries::{ENTRIES, Entry, left_thigh, only};
use super::page::{Escaped, Line, line_plot};

/// What is in the page, for a frame around it. `walk` is a scene with a clip of a body that walks: [`crate::samples::walk_scene`]. The text
/// in its figures has no color of its own.
///
/// # Errors
/// When the scene has no such clip.
pub fn edits_article(walk: &Scene) -> Result<String, Failure> {
    let mut article = String::with_capacity(256 << 10);
    article.push_str("<h1>What edits do</h1>\n");
    article.push_str(
        "<p>Each figure is a curve of one walk, before (blue) and after (orange) the edit in its config.</p>\n",
    );
    for entry in &ENTRIES {
        section(&mut article, walk, entry)?;
    }
    Ok(article)
}

fn section(page: &mut String, walk: &Scene, entry: &Entry) -> Result<(), Failure> {
    let spec = parse_spec(entry.config.as_bytes())?;
    let mut reporter = Reporter::new();
    let rig = Rig::new("source", walk, None, &spec.source, &mut reporter)?;
    let before = &walk.clips[0];
    let after = after(&rig, before, &spec, &mut reporter)?;
    let line = |clip: &Clip| Line { times_seconds: clip.times_seconds().to_vec(), values: entry.shown.of(&rig, clip) };
    let lines = [line(before), line(&after)];
    let (name, text) = (entry.name, Escaped(entry.text));
    page.push_str(&format!("<h2 id=\"{name}\"><code>{name}</code></h2>\n<p>{text}</p>\n"));
    page.push_str(&format!("<pre><code>{}</code></pre>\n", Escaped(entry.config)));
    let label = format!("{name}: {} before and after", entry.shown.name());
    if let Some(svg) = line_plot(&lines, entry.shown.unit()) {
        page.push_str(&format!("<figure role=\"img\" aria-label=\"{}\">{svg}</figure>\n", Escaped(&label)));
    }
    page.push_str(&format!("<p><small>{}</small></p>\n", Escaped(entry.shown.name())));
    Ok(())
}

/// The clip as the spec's `edit`, `layer` and `output.keys` make it.
fn after(rig: &Rig<'_>, clip: &Clip, spec: &RetargetSpec, reporter: &mut Reporter) -> Result<Clip, Failure> {
    let control = Control::new();
    let edited: Cow<'_, Clip> = edited_clip(rig, clip, spec, &control, reporter)?;
    if let Some(layer) = &spec.layer {
        return laid_over(rig, &spec.source, &edited, layer, &control, reporter);
    }
    let keys = match &spec.output {
        Some(OutputChoice::One(output)) => output.keys.tolerance(),
        _ => KeysSpec::default().tolerance(),
    };
    let Some(tolerance) = keys else { return Ok(edited.into_owned()) };
    let tolerance = Tolerance {
        distance: tolerance.distance_meters,
        shell: tolerance.shell_meters,
        interpolation: tolerance.interpolation,
    };
    let reduction = reduce_keys(&edited, rig.skeleton(), tolerance, &control)?;
    let frames = left_thigh(rig).map(|joint| reduction.keys.joints[joint].rotation.frames.clone());
    Ok(only(&edited, &frames.unwrap_or_default()))
}
