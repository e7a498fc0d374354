//! A copy of a service at work, made by the commands of docs/operate.md, is a service: every job that was acknowledged before is there and ends, and
//! every file is whole.

use std::process::Command;

use super::{
    studio::{CLIP, Customer, Place},
    support::{Postgres, S3, of_role, postgres_tools, serve},
};
use crate::{service_process::ServiceProcess, support::skip};

/// The commands of the page about operations, of which the first begins with these words.
fn commands(first: &str) -> &'static str {
    let page = include_str!("../../../docs/operate.md");
    let chapter = page.split("## Backup, upgrade, roll-back").nth(1).expect("the page says how");
    let block = chapter.split("```bash\n").skip(1).find(|block| block.starts_with(first)).expect("these commands");
    block.split("```").next().expect("it ends")
}

fn run(script: &str, folder: &std::path::Path, variables: &[(&'static str, String)]) {
    let path = postgres_tools().map_or_else(String::new, |folder| format!("PATH={}:\"$PATH\"\n", folder.display()));
    let done = Command::new("bash")
        .args(["-euo", "pipefail", "-c", &format!("{path}{script}")])
        .current_dir(folder)
        .envs(variables.iter().map(|(name, value)| (*name, value)))
        .output()
        .expect("bash runs");
    assert!(done.status.success(), "{script}\n{}", String::from_utf8_lossy(&done.stderr));
}

fn has(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

/// Some jobs before, some while the copy is made. What was promised before must be in the copy.
async fn ask_while(url: &str, copy: impl FnOnce() + Send + 'static) -> Customer {
    let mut customer = Customer::new();
    let asset = customer.upload(url, CLIP).await.expect("is taken");
    for _ in 0..20 {
        assert!(customer.ask(url, &asset).await, "is taken");
    }
    let copying = tokio::task::spawn_blocking(copy);
    let mut other = Customer::new();
    let mut number = 0;
    while !copying.is_finished() {
        number += 1;
        let asset = other.upload(url, &format!("{CLIP}{}", " ".repeat(number))).await.expect("is taken");
        assert!(other.ask(url, &asset).await, "the service goes on");
    }
    copying.await.expect("it is copied");
    assert!(number > 0, "jobs came while it was copied");
    customer
}

#[tokio::test(flavor = "multi_thread")]
async fn a_copy_of_a_running_data_folder_goes_on() {
    if !has("sqlite3") {
        return skip("the program sqlite3 is not installed");
    }
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("backup")).expect("a folder");
    let data = |name: &str| vec!["--data".to_owned(), folder.path().join(name).display().to_string()];
    let service = serve(&data("retargetd-data"), &[]);
    let place = folder.path().to_owned();
    let customer = ask_while(&service.url, move || run(commands("cp --archive"), &place, &[])).await;
    drop(service);
    let restored = serve(&data("backup"), &[]);
    let states = customer.collect(&restored.url).await;
    assert_eq!(states.get("succeeded"), Some(&20), "all that was acknowledged before: {states:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_copy_of_a_running_database_and_its_bucket_goes_on() {
    let Some(Place::Cloud(database, files)) = Place::cloud() else { return };
    if !has("aws") || postgres_tools().is_none() {
        return skip("aws or pg_dump is not installed");
    }
    let Some(empty) = Postgres::start() else { return };
    empty.answers().await;
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("backup")).expect("a folder");
    let mut variables = files.variables();
    variables.push(("RETARGETD_DATABASE", database.url()));
    variables.push(("EMPTY_DATABASE", empty.url()));
    run("aws s3 mb s3://clips-backup", folder.path(), &variables);
    let flags = |database: &Postgres, blobs: &str| {
        ["--database", &database.url(), "--blobs", blobs, "--result-cache", "off"].map(str::to_owned).to_vec()
    };
    let service = serve(&flags(&database, &S3::url()), &files.variables());
    let (place, known) = (folder.path().to_owned(), variables.clone());
    let customer = ask_while(&service.url, move || run(commands("aws s3 sync"), &place, &known)).await;
    drop(service);
    run(commands("pg_restore"), folder.path(), &variables);
    let blobs = S3::url().replace("clips", "clips-backup");
    let restored = ServiceProcess::listening(&mut of_role("serve", &flags(&empty, &blobs), &files.variables()));
    let states = customer.collect(&restored.url).await;
    assert_eq!(states.get("succeeded"), Some(&20), "all that was acknowledged before: {states:?}");
}
