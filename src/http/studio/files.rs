//! The files of `studio/`, which the binary carries. A test keeps the list complete.

macro_rules! files {
    ($($path:literal),* $(,)?) => {
        /// Paths below `studio/`, and their bytes.
        pub(super) const FILES: &[(&str, &[u8])] =
            &[$(($path, include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/studio/", $path)))),*];
    };
}

files![
    "api/client.js",
    "api/live.js",
    "api/problem.js",
    "api/types.js",
    "batch/panel.js",
    "dom.js",
    "drawing/character.js",
    "drawing/choices.js",
    "drawing/editor.js",
    "drawing/live.js",
    "drawing/mask.js",
    "drawing/panel.js",
    "drawing/report.js",
    "drawing/take.js",
    "drawing/zip.js",
    "drop.js",
    "embed.js",
    "icon.svg",
    "index.html",
    "keys.js",
    "main.js",
    "mapping/panel.js",
    "ops/edits.js",
    "ops/form.js",
    "ops/panel.js",
    "ops/schema.js",
    "pose/gizmo.js",
    "pose/panel.js",
    "pose/turns.js",
    "report/download.js",
    "report/panel.js",
    "report/plot.js",
    "report/recipes.js",
    "state.js",
    "style.css",
    "tabs.js",
    "timeline/player.js",
    "timeline/timeline.js",
    "timeline/transport.js",
    "vendor/LICENSE.three",
    "vendor/VERSION.json",
    "vendor/three.js",
    "view/figure.js",
    "view/glb.js",
    "view/marks.js",
    "view/motion.js",
    "view/side.js",
    "view/stage.js",
    "view/tools.js",
    "view/viewer.js",
];
