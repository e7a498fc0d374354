//! Clients that generators make of the OpenAPI document: each is made, checked by the compiler of its language, and taken on the same journey
//! against the real service: two uploads, a one-shot, a job that is waited for, a download, a batch, a refusal.
//!
//! `tests/run` installs the generators.

use std::{
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
};

use retargetd::samples;
use tempfile::TempDir;

use crate::{
    service_process::ServiceProcess,
    support::{python_with, skip},
};

/// What every journey says that it has done.
const STATIONS: [&str; 6] = [
    "uploaded two files",
    "retargeted in one request",
    "waited for a job: ",
    "downloaded its result",
    "waited for a batch",
    "was refused: unknown_asset",
];

fn tool(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools").join(path)
}

fn told(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

/// Runs a command, and shows what it said where it fails.
fn succeed(command: &mut Command) -> String {
    let output = command.stdin(Stdio::null()).output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(output.status.success(), "{command:?} ended with {}:\n{}", output.status, told(&output));
    told(&output)
}

/// A folder to generate into: the document, and the two samples.
fn folder_with_document() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let document = Command::new(env!("CARGO_BIN_EXE_retargetd")).arg("openapi").output().expect("the binary runs");
    let files =
        [("openapi.json", document.stdout), ("walk.glb", samples::walk_clip()), ("hero.glb", samples::mannequin())];
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).expect("a file");
    }
    folder
}

/// Takes the journey and looks at what it brought.
fn travel(folder: &Path, command: &mut Command) {
    let mut service = Command::new(env!("CARGO_BIN_EXE_retargetd"));
    service.args(["serve", "--listen", "127.0.0.1:0", "--log", "warn", "--data"]).arg(folder.join("data"));
    let service = ServiceProcess::listening(&mut service);
    let command = command.args(["walk.glb", "hero.glb", "."]).current_dir(folder);
    let text = succeed(command.env("RETARGETD_URL", &service.url).env("NO_PROXY", "127.0.0.1"));
    for station in STATIONS {
        assert!(text.contains(station), "'{station}' in what it said:\n{text}");
    }
    let read = |name: &str| std::fs::read(folder.join(name)).expect("it was saved");
    let (one_shot, job) = (read("one_shot.glb"), read("job.glb"));
    assert!(one_shot.starts_with(b"glTF") && one_shot == job, "both ways give the same file");
}

#[test]
fn openapi_python_client_makes_one_that_works() {
    let Some(python) = python_with("openapi_python_client") else {
        return skip("a client of openapi-python-client, because that is not installed");
    };
    let folder = folder_with_document();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("config.yml"), "post_hooks: []\n").expect("a config");
    let package = at("client/retargetd_client");
    std::fs::create_dir(at("client")).expect("a folder");
    let mut generate = Command::new(&python);
    generate.args(["-m", "openapi_python_client", "generate", "--meta", "none", "--fail-on-warning", "--path"]);
    generate.arg(at("openapi.json")).arg("--config").arg(at("config.yml")).arg("--output-path").arg(&package);
    succeed(&mut generate);
    succeed(Command::new(&python).args(["-m", "compileall", "-q"]).arg(&package));
    let journey = tool("openapi_python_client/journey.py");
    match python_with("mypy") {
        Some(python) => {
            // The journey and all that it uses.
            let mut check = Command::new(python);
            check
                .args(["-m", "mypy", "--follow-imports", "silent", "--cache-dir"])
                .arg(at("cache"))
                .arg(&journey)
                .env("MYPYPATH", at("client"));
            succeed(&mut check);
        }
        None => skip("the types of the client of openapi-python-client, because mypy is not installed"),
    }
    travel(folder.path(), Command::new(&python).arg(&journey).env("PYTHONPATH", at("client")));
}

/// OpenAPI Generator, with the Java that comes beside it.
fn openapi_generator(folder: &Path, arguments: &[&str]) -> Option<PathBuf> {
    let Some(python) = python_with("openapi_generator_cli") else {
        skip("a client of OpenAPI Generator, because that is not installed");
        return None;
    };
    let mut generate = Command::new(&python);
    generate.args(["-c", "import openapi_generator_cli; openapi_generator_cli.cli()", "generate"]);
    generate.args(["-i", "openapi.json", "-o", "client"]);
    succeed(generate.args(arguments).current_dir(folder));
    Some(python)
}

#[test]
fn openapi_generator_makes_one_in_python_that_works() {
    let folder = folder_with_document();
    let Some(python) = openapi_generator(folder.path(), &["-g", "python", "--package-name", "retargetd_client"]) else {
        return;
    };
    let client = folder.path().join("client");
    succeed(Command::new(&python).args(["-m", "compileall", "-q"]).arg(client.join("retargetd_client")));
    let journey = tool("openapi_generator/journey.py");
    travel(folder.path(), Command::new(&python).arg(&journey).env("PYTHONPATH", &client));
}

#[test]
fn openapi_generator_makes_one_in_typescript_that_works() {
    let Some(modules) = node_modules("typescript", "typescript") else { return };
    let folder = folder_with_document();
    let arguments = ["-g", "typescript-fetch", "--additional-properties", "importFileExtension=.js"];
    if openapi_generator(folder.path(), &arguments).is_none() {
        return;
    }
    compile_and_travel(folder.path(), &modules, "openapi_generator");
}

/// The packages of a tool. Nothing, said on standard error, where node may not be used.
#[expect(clippy::disallowed_methods, reason = "tests have no settings")]
fn node_modules(name: &str, package: &str) -> Option<PathBuf> {
    if std::env::var_os("RETARGETD_SKIP_NODE").is_some_and(|value| value == "1") {
        skip("clients in TypeScript, because RETARGETD_SKIP_NODE is 1");
        return None;
    }
    let modules = tool(name).join("node_modules");
    assert!(
        modules.join(package).exists(),
        "{package} is not installed: run 'npm ci --prefix tests/tools/{name}', or set RETARGETD_SKIP_NODE=1"
    );
    Some(modules)
}

/// What the compiler is told: as strict as by default of new projects.
const TSCONFIG: &str = r#"{"compilerOptions": {"strict": true, "target": "es2022", "lib": ["es2023", "dom", "dom.iterable"], "module": "nodenext", "moduleResolution": "nodenext",
    "types": ["node"], "outDir": "out", "rootDir": "."}, "include": ["journey.mts", "client", "schema.d.ts"]}"#;

/// Prepares a folder for the compiler.
fn prepare(folder: &Path, modules: &Path) {
    std::fs::write(folder.join("tsconfig.json"), TSCONFIG).expect("a config");
    std::fs::write(folder.join("package.json"), r#"{"type": "module"}"#).expect("a package");
    #[cfg(unix)]
    std::os::unix::fs::symlink(modules, folder.join("node_modules")).expect("a link");
}

/// Compiles the whole client with the journey of a tool, and takes it.
fn compile_and_travel(folder: &Path, modules: &Path, tool_name: &str) {
    if !folder.join("tsconfig.json").exists() {
        prepare(folder, modules);
    }
    std::fs::copy(tool(tool_name).join("journey.mts"), folder.join("journey.mts")).expect("the journey");
    let compiler = modules.join("typescript/bin/tsc");
    succeed(Command::new("node").arg(compiler).args(["--project", "tsconfig.json"]).current_dir(folder));
    travel(folder, Command::new("node").arg("out/journey.mjs"));
}

#[test]
fn openapi_typescript_makes_types_that_work() {
    let Some(modules) = node_modules("openapi_fetch", "openapi-typescript") else { return };
    let folder = folder_with_document();
    prepare(folder.path(), &modules);
    let mut generate = Command::new("node");
    let generator = tool("openapi_fetch/generate.mjs");
    succeed(generate.arg(generator).args(["openapi.json", "schema.d.ts"]).current_dir(folder.path()));
    compile_and_travel(folder.path(), &modules, "openapi_fetch");
}

#[test]
fn hey_api_makes_one_that_works() {
    let Some(modules) = node_modules("hey_api", "@hey-api/openapi-ts") else { return };
    let folder = folder_with_document();
    prepare(folder.path(), &modules);
    std::fs::copy(tool("hey_api/openapi-ts.config.mjs"), folder.path().join("openapi-ts.config.mjs"))
        .expect("its config");
    let generator = modules.join("@hey-api/openapi-ts/bin/run.js");
    succeed(Command::new("node").arg(generator).current_dir(folder.path()));
    compile_and_travel(folder.path(), &modules, "hey_api");
}
