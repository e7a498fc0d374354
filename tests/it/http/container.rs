//! The container files, as far as they can be checked without a container.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    process::Command,
};

use retargetd::{config::Settings, telemetry::Metric};

use crate::support::{python_with, skip};

const COMPOSE_FILES: [&str; 2] = ["compose.yaml", "compose.scaled.yaml"];

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docker").join(name)
}

fn read(name: &str) -> String {
    let path = path(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{} cannot be read: {error}", path.display()))
}

fn variables(text: &str) -> BTreeSet<String> {
    let is_name = |letter: char| letter.is_ascii_uppercase() || letter == '_' || letter.is_ascii_digit();
    let places = text.match_indices("RETARGETD_");
    places.map(|(start, _)| text[start..].chars().take_while(|letter| is_name(*letter)).collect()).collect()
}

#[test]
fn every_variable_is_a_setting() {
    let mut known: BTreeSet<String> = Settings::TABLE.iter().map(retargetd::config::Setting::variable).collect();
    known.insert("RETARGETD_URL".to_owned());
    for name in ["Dockerfile", "compose.yaml", "compose.scaled.yaml", "kubernetes/retargetd.yaml"] {
        let seen = variables(&read(name));
        assert!(!seen.is_empty(), "{name} sets something");
        let unknown: Vec<_> = seen.difference(&known).collect();
        assert!(unknown.is_empty(), "{name} names what is no setting: {unknown:?}");
    }
}

#[test]
fn ports_user_and_health_check_agree() {
    let (image, compose) = (read("Dockerfile"), read("compose.yaml"));
    assert!(image.contains("RETARGETD_LISTEN=0.0.0.0:8080") && image.contains("EXPOSE 8080"), "one port inside");
    assert!(compose.contains(":8080\""), "and that port is published");
    assert!(image.contains("USER 65532:65532"), "not root");
    assert!(image.contains("RETARGETD_DATA=/data") && compose.contains(":/data"), "one data folder");
    assert!(image.contains("HEALTHCHECK") && image.contains("[\"retargetd\", \"health\"]"), "asks itself");
    assert!(compose.contains("read_only: true"), "the root is read-only");
}

#[test]
fn processes_that_share_are_told_the_same_place() {
    let scaled = read("compose.scaled.yaml");
    assert!(scaled.contains("postgres://retargetd:retargetd@database/retargetd"), "the records");
    assert!(scaled.contains("POSTGRES_USER: retargetd") && scaled.contains("POSTGRES_DB: retargetd"), "that are there");
    assert!(scaled.contains("RETARGETD_BLOBS: s3://clips") && scaled.contains("files/clips"), "the files");
    assert!(scaled.contains("AWS_SECRET_ACCESS_KEY: retargetd-secret"), "with the key");
    assert!(scaled.contains("MINIO_ROOT_PASSWORD: retargetd-secret"), "that opens them");
    assert!(scaled.contains("command: [worker]") && scaled.contains("RETARGETD_WORKERS: \"0\""), "both roles");
}

/// Runs a judge and gives what it says where it is not content.
fn complaint(judge: &mut Command) -> Option<String> {
    let done = judge.output().expect("the judge runs");
    let said = String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr);
    (!done.status.success()).then_some(said)
}

#[test]
fn compose_files_follow_the_compose_specification() {
    let Some(python) = python_with("check_jsonschema") else {
        return skip("the Python package check-jsonschema is not installed; tests/run installs it");
    };
    let mut judge = Command::new(&python);
    judge.args(["-m", "check_jsonschema", "--builtin-schema", "vendor.compose-spec"]);
    let complaint = complaint(judge.args(COMPOSE_FILES.map(path)));
    assert!(complaint.is_none(), "{complaint:?}");
}

#[test]
fn docker_reads_the_compose_files() {
    if !Command::new("docker").args(["compose", "version"]).output().is_ok_and(|done| done.status.success()) {
        return skip("Docker with its compose plugin is not installed");
    }
    for name in COMPOSE_FILES {
        let complaint =
            complaint(Command::new("docker").args(["compose", "--file"]).arg(path(name)).args(["config", "--quiet"]));
        assert!(complaint.is_none(), "{name}: {complaint:?}");
    }
}

#[test]
fn kubernetes_knows_every_property_of_the_manifests() {
    let Some(python) = python_with("kubernetes_validate") else {
        return skip("the Python package kubernetes-validate is not installed; tests/run installs it");
    };
    let judged = |file: &Path| {
        complaint(Command::new(&python).args(["-m", "kubernetes_validate", "--strict", "--quiet"]).arg(file))
    };
    let good = judged(&path("kubernetes/retargetd.yaml"));
    assert!(good.is_none(), "{good:?}");
    let misspelt = tempfile::NamedTempFile::with_suffix(".yaml").expect("a file");
    let text = read("kubernetes/retargetd.yaml").replace("readOnlyRootFilesystem:", "readOnlyRootFileSystem:");
    std::fs::write(misspelt.path(), text).expect("writes");
    assert!(judged(misspelt.path()).is_some(), "a slip of one letter is found");
}

/// The number after a key of a YAML file, without its unit.
fn number_after(text: &str, key: &str) -> u64 {
    let rest = text.split_once(key).unwrap_or_else(|| panic!("there is a '{key}'")).1;
    let digits: String =
        rest.chars().skip_while(|letter| !letter.is_ascii_digit()).take_while(char::is_ascii_digit).collect();
    digits.parse().expect("a number")
}

#[test]
fn pods_are_asked_where_they_answer_and_get_the_time_they_need() {
    let manifests = read("kubernetes/retargetd.yaml");
    let pods: Vec<&str> =
        manifests.split("\n---\n").filter(|document| document.contains("\nkind: Deployment\n")).collect();
    assert_eq!(pods.len(), 2, "APIs and workers");
    let document = read("../openapi/openapi.json");
    for pod in pods {
        assert!(pod.contains("0.0.0.0:9090") && pod.contains("{name: probes, containerPort: 9090}"), "one port: {pod}");
        for path in pod.split("path: ").skip(1).map(|rest| rest.split(',').next().unwrap_or_default()) {
            assert!(document.contains(&format!("\"{path}\"")), "{path} is a route");
        }
        let drain = if pod.contains("RETARGETD_DRAIN_DELAY") { number_after(pod, "RETARGETD_DRAIN_DELAY") } else { 0 };
        let needed = drain + number_after(pod, "RETARGETD_GRACE_PERIOD") + 5;
        assert!(number_after(pod, "terminationGracePeriodSeconds") > needed, "killed before it has stopped: {pod}");
        assert!(pod.contains("runAsNonRoot: true") && pod.contains("readOnlyRootFilesystem: true"), "confined: {pod}");
    }
    assert!(
        manifests.contains("RETARGETD_WORKERS, value: \"0\"") && manifests.contains("args: [worker]"),
        "both roles"
    );
}

#[test]
fn images_are_named_in_full_and_by_version_and_everything_is_bounded() {
    let names = ["Dockerfile", "compose.yaml", "compose.scaled.yaml", "kubernetes/retargetd.yaml"];
    for (name, text) in names.map(|name| (name, read(name))) {
        let lines = text.lines().map(str::trim);
        let images: Vec<&str> = lines
            .filter_map(|line| line.strip_prefix("image: ").or_else(|| line.strip_prefix("FROM ")))
            .map(|image| image.split(' ').next().unwrap_or_default())
            .collect();
        assert!(!images.is_empty(), "{name} has images");
        for image in images {
            let (place, rest) = image.split_once('/').unwrap_or_else(|| panic!("{name}: {image} says where it is"));
            assert!(place.contains('.') || place == "localhost", "{name}: {image} says where it is");
            let version = rest.split_once(':').map_or("", |(_, version)| version);
            assert!(version.chars().any(|letter| letter.is_ascii_digit()), "{name}: {image} says which one");
        }
    }
    let has = |name: &str, word: &str| assert!(read(name).contains(word), "{name} has '{word}'");
    has("compose.yaml", "pids_limit:");
    has("compose.yaml", "no-new-privileges:true");
    has("compose.scaled.yaml", "pids_limit:");
    has("kubernetes/retargetd.yaml", "\nkind: NetworkPolicy\n");
    has("kubernetes/retargetd.yaml", "automountServiceAccountToken: false");
}

/// The words that come after each `before`, up to one of `ends`.
fn words_after<'a>(text: &'a str, before: &str, ends: &[char]) -> Vec<&'a str> {
    let rests = text.split(before).skip(1).filter_map(|rest| rest.split(ends).next());
    rests.flat_map(|rest| rest.split(',')).map(str::trim).filter(|word| !word.is_empty()).collect()
}

#[test]
fn the_dashboard_shows_every_metric_by_labels_that_it_has() {
    let dashboard: serde_json::Value = serde_json::from_str(&read("grafana/dashboard.json")).expect("JSON");
    let panels = dashboard["panels"].as_array().expect("panels");
    let targets = panels.iter().flat_map(|panel| panel["targets"].as_array().into_iter().flatten());
    let mut shown = BTreeSet::new();
    for expression in targets.map(|target| target["expr"].as_str().expect("an expression")) {
        let name = expression.split(|letter: char| !letter.is_ascii_lowercase() && letter != '_');
        let name = name.into_iter().find(|word| word.starts_with("retargetd_")).expect("a metric");
        let name = name.strip_suffix("_bucket").unwrap_or(name);
        let metric = Metric::ALL.iter().find(|metric| metric.name() == name);
        let metric = metric.unwrap_or_else(|| panic!("'{name}' is a metric: {expression}"));
        shown.insert(metric.name());
        let labels = [words_after(expression, "by (", &[')']), words_after(expression, "{", &['='])].concat();
        let unknown: Vec<_> =
            labels.iter().filter(|label| **label != "le" && !metric.labels().contains(label)).collect();
        assert!(unknown.is_empty(), "{name} has no label {unknown:?}: {expression}");
    }
    let hidden: Vec<_> = Metric::ALL.iter().filter(|metric| !shown.contains(metric.name())).collect();
    assert!(hidden.is_empty(), "nobody would see {hidden:?}");
}

#[test]
fn the_entry_point_parses_and_the_variables_are_valid() {
    let image = read("Dockerfile");
    assert!(image.contains("ENTRYPOINT [\"retargetd\"]") && image.contains("CMD [\"serve\"]"), "what is run");
    let pairs: Vec<(String, String)> = image
        .split_whitespace()
        .filter_map(|word| word.split_once('='))
        .filter(|(name, _)| name.starts_with("RETARGETD_"))
        .map(|(name, value)| (name.to_owned(), value.to_owned()))
        .collect();
    let settings = Settings::read(|setting| {
        pairs.iter().find(|(name, _)| *name == setting.variable()).map(|(_, value)| value.clone())
    });
    assert!(settings.is_ok(), "the image's variables are valid: {settings:?}");
    let help = Command::new(env!("CARGO_BIN_EXE_retargetd")).args(["serve", "--help"]).output().expect("it runs");
    let help = String::from_utf8_lossy(&help.stdout).into_owned();
    assert!(Settings::TABLE.iter().all(|setting| help.contains(&setting.flag())), "every setting has its flag: {help}");
}

/// Copies a file or a folder.
fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        std::fs::create_dir_all(to).expect("a folder");
        for entry in std::fs::read_dir(from).expect("a folder of the project") {
            let entry = entry.expect("an entry");
            copy(&entry.path(), &to.join(entry.file_name()));
        }
    } else {
        std::fs::copy(from, to).unwrap_or_else(|error| panic!("{}: {error}", from.display()));
    }
}

#[test]
fn what_the_image_copies_is_a_project_that_cargo_accepts() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let ignored = std::fs::read_to_string(root.join(".dockerignore")).expect("the list of what is left out");
    let allowed: BTreeSet<&str> = ignored.lines().filter_map(|line| line.strip_prefix('!')).collect();
    assert_eq!(ignored.lines().next(), Some("*"), "everything else is left out");
    let context = tempfile::tempdir().expect("a folder");
    let image = read("Dockerfile");
    let copied = image.lines().filter_map(|line| line.strip_prefix("COPY ")).filter(|line| !line.starts_with("--"));
    for line in copied {
        let names: Vec<&str> = line.split_whitespace().collect();
        let (sources, _) = names.split_at(names.len() - 1);
        for name in sources {
            assert!(allowed.contains(name), "{name} is copied, so .dockerignore must let it through");
            copy(&root.join(name), &context.path().join(name));
        }
    }
    // A target that is not there is asked for, because Cargo looks at the whole manifest before it says so.
    let output = Command::new(env!("CARGO"))
        .args(["build", "--offline", "--locked", "--bin", "absent"])
        .current_dir(context.path())
        .output()
        .expect("cargo runs");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(error.contains("no bin target named `absent`"), "the manifest can be read: {error}");
}
