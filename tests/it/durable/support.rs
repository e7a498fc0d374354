//! Databases, file stores and processes of the service, each in folders and on ports of its own, gone with the test.

use std::{
    net::{TcpListener, TcpStream},
    os::unix::{
        fs::{MetadataExt, chown},
        process::CommandExt,
    },
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use retargetd::store::Records;
use sqlx::Connection as _;

pub(super) use crate::service_process::ServiceProcess;
pub(super) use crate::support::count_of;
use crate::{
    service_process::signal,
    support::{python_with, skip},
};

/// Long enough for a busy machine; nothing waits this long when all is well.
pub(super) const PATIENCE: Duration = Duration::from_secs(120);

fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    listener.local_addr().expect("an address").port()
}

fn wait_for(what: &str, mut is_there: impl FnMut() -> bool) {
    let began = Instant::now();
    while !is_there() {
        assert!(began.elapsed() < PATIENCE, "{what} does not come up");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A Postgres server with an empty database.
pub(super) struct Postgres {
    child: Option<Child>,
    folder: tempfile::TempDir,
    port: u16,
    variables: Vec<(&'static str, String)>,
    options: &'static str,
}

impl Postgres {
    /// `None`, said aloud, where there is no Postgres; `tests/run` installs it.
    pub(super) fn start() -> Option<Self> {
        Self::start_with(&[])
    }

    /// The same with these variables of its environment.
    pub(super) fn start_with(variables: &[(&'static str, String)]) -> Option<Self> {
        Self::start_as(variables, "")
    }

    fn start_as(variables: &[(&'static str, String)], options: &'static str) -> Option<Self> {
        if postgres_command("initdb").is_none() {
            skip("Postgres is not installed; tests/run installs it");
            return None;
        }
        let folder = tempfile::tempdir().expect("a temporary folder");
        if let Some((user, group)) = other_user() {
            chown(folder.path(), Some(user), Some(group)).expect("the folder can be given away");
        }
        let done = command("initdb", folder.path())
            .args(["--username=retargetd", "--auth=trust", "--no-sync", "--encoding=UTF8", "--locale=C"])
            .output()
            .expect("initdb runs");
        assert!(done.status.success(), "initdb works: {}", String::from_utf8_lossy(&done.stderr));
        let mut server = Self { child: None, folder, port: free_port(), variables: variables.to_vec(), options };
        server.run();
        Some(server)
    }

    pub(super) fn url(&self) -> String {
        format!("postgres://retargetd@127.0.0.1:{}/postgres", self.port)
    }

    /// One that writes down by what every statement finds its rows, and goes by an index wherever there is one: the tables of tests are too
    /// small for it to do so by itself.
    pub(super) fn start_explaining() -> Option<Self> {
        let options = "-c session_preload_libraries=auto_explain -c auto_explain.log_min_duration=0 \
                       -c auto_explain.log_nested_statements=on -c enable_seqscan=off -c log_statement=none";
        Self::start_as(&[], options)
    }

    /// What the server has said so far.
    pub(super) fn log(&self) -> String {
        std::fs::read_to_string(self.folder.path().join("log")).expect("its log")
    }

    fn run(&mut self) {
        let log = std::fs::File::create(self.folder.path().join("log")).expect("a log");
        let options = ["-c", "fsync=off", "-c", "max_connections=100", "-c", "unix_socket_directories="];
        let child = command("postgres", self.folder.path())
            .args(["-p", &self.port.to_string(), "-c", "listen_addresses=127.0.0.1"])
            .args(options)
            .args(self.options.split_whitespace())
            .stderr(log)
            .envs(self.variables.iter().map(|(name, value)| (*name, value)))
            .spawn()
            .expect("postgres starts");
        self.child = Some(child);
        let address = ("127.0.0.1", self.port);
        wait_for("Postgres", || TcpStream::connect(address).is_ok());
    }

    /// Cuts every connection, as an operator's restart does, and comes back.
    pub(super) fn restart(&mut self) {
        self.stop("-INT");
        self.run();
    }

    fn stop(&mut self, name: &str) {
        if let Some(mut child) = self.child.take() {
            signal(child.id(), name);
            // Nothing is left to do when it has ended already.
            let _ = child.wait();
        }
    }

    /// Its records. A server that has just started may refuse for a moment.
    pub(super) async fn records(&self) -> Records {
        let began = Instant::now();
        loop {
            match Records::connect(&self.url(), 16).await {
                Ok(records) => return records,
                Err(error) => assert!(began.elapsed() < PATIENCE, "the database opens: {error}"),
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }
}

impl Postgres {
    /// Waits until it takes connections.
    pub(super) async fn answers(&self) {
        let began = Instant::now();
        while let Err(error) = sqlx::PgConnection::connect(&self.url()).await {
            assert!(began.elapsed() < PATIENCE, "the database opens: {error}");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }

    async fn connection(&self) -> sqlx::PgConnection {
        sqlx::PgConnection::connect(&self.url()).await.expect("connects")
    }

    /// Runs statements of the test's own.
    pub(super) async fn execute(&self, statements: &'static str) {
        sqlx::raw_sql(statements).execute(&mut self.connection().await).await.expect("the statements work");
    }

    /// Forgets everything.
    pub(super) async fn empty(&self) {
        self.execute(
            "TRUNCATE assets, jobs, job_inputs, results, named_documents, turns, quarantine, events, event_heads, job_labels, \
             webhooks, deliveries, batches, record_counts",
        )
        .await;
    }

    /// How many rows of the table of jobs were read so far, by connections that are closed.
    pub(super) async fn rows_read(&self) -> i64 {
        let query = "SELECT (seq_tup_read + idx_tup_fetch)::BIGINT FROM pg_stat_user_tables WHERE relname = 'jobs'";
        sqlx::query_scalar(query).fetch_one(&mut self.connection().await).await.expect("the database counts")
    }
}

impl Drop for Postgres {
    fn drop(&mut self) {
        self.stop("-QUIT");
    }
}

/// The folder of the programs of that Postgres which the tests start.
pub(super) fn postgres_tools() -> Option<PathBuf> {
    Some(postgres_command("pg_dump")?.parent()?.to_owned())
}

fn postgres_command(name: &str) -> Option<PathBuf> {
    let versions = std::fs::read_dir("/usr/lib/postgresql").into_iter().flatten();
    let mut folders: Vec<PathBuf> = versions.filter_map(|entry| Some(entry.ok()?.path().join("bin"))).collect();
    folders.sort();
    folders.push(PathBuf::from("/usr/local/bin"));
    folders.push(PathBuf::from("/usr/bin"));
    folders.into_iter().map(|folder| folder.join(name)).find(|path| path.exists())
}

/// A command of Postgres on a data folder, which it refuses to run as root.
fn command(name: &str, data: &Path) -> Command {
    let mut command = Command::new(postgres_command(name).expect("Postgres is installed"));
    command.arg("-D").arg(data.join("data")).current_dir(data).stdout(Stdio::null()).stderr(Stdio::null());
    if name == "initdb" {
        command.stderr(Stdio::piped());
    }
    if let Some((user, group)) = other_user() {
        command.uid(user).gid(group);
    }
    command
}

/// For root: somebody who is not.
fn other_user() -> Option<(u32, u32)> {
    if std::fs::metadata("/proc/self").expect("a process of ours").uid() != 0 {
        return None;
    }
    let users = std::fs::read_to_string("/etc/passwd").expect("the users");
    let find = |wanted: &str| {
        let line = users.lines().find(|line| line.split(':').next() == Some(wanted))?;
        let mut fields = line.split(':').skip(2).map(|field| field.parse().ok());
        Some((fields.next()??, fields.next()??))
    };
    find("postgres").or_else(|| find("nobody"))
}

/// An S3 server that keeps everything in memory, with one bucket.
pub(super) struct S3 {
    child: Child,
    port: u16,
}

impl S3 {
    /// `None`, said aloud, where there is no such server; `tests/run` installs it.
    pub(super) fn start() -> Option<Self> {
        let Some(python) = python_with("moto.server") else {
            skip("the S3 server (moto, from PyPI) is not installed; tests/run installs it");
            return None;
        };
        let port = free_port();
        let child = Command::new(python)
            .args(["-m", "moto.server", "-H", "127.0.0.1", "-p", &port.to_string()])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the S3 server starts");
        wait_for("the S3 server", || TcpStream::connect(("127.0.0.1", port)).is_ok());
        let server = Self { child, port };
        let bucket = format!("{}/{}", server.endpoint(), Self::BUCKET);
        let made = Command::new("curl").args(["--silent", "--fail", "--noproxy", "*", "-X", "PUT", &bucket]).output();
        assert!(made.expect("curl runs").status.success(), "the bucket is made");
        Some(server)
    }

    const BUCKET: &str = "clips";

    fn endpoint(&self) -> String {
        format!("http://127.0.0.1:{}", self.port)
    }

    pub(super) fn url() -> String {
        format!("s3://{}/studio", Self::BUCKET)
    }

    /// What every S3 client is told.
    pub(super) fn variables(&self) -> Vec<(&'static str, String)> {
        vec![
            ("AWS_ENDPOINT_URL", self.endpoint()),
            ("AWS_ALLOW_HTTP", "true".to_owned()),
            ("AWS_REGION", "us-east-1".to_owned()),
            ("AWS_ACCESS_KEY_ID", "anybody".to_owned()),
            ("AWS_SECRET_ACCESS_KEY", "anything".to_owned()),
            ("NO_PROXY", "127.0.0.1".to_owned()),
        ]
    }

    /// Stops it from answering, or lets it answer again.
    pub(super) fn freeze(&self, is_frozen: bool) {
        signal(self.child.id(), if is_frozen { "-STOP" } else { "-CONT" });
    }
}

impl Drop for S3 {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A service with these flags and variables.
pub(super) fn serve(flags: &[String], variables: &[(&'static str, String)]) -> ServiceProcess {
    ServiceProcess::listening(&mut of_role("serve", flags, variables))
}

/// A worker with these flags and variables.
pub(super) fn worker(flags: &[String], variables: &[(&'static str, String)]) -> ServiceProcess {
    ServiceProcess::silent(&mut of_role("worker", flags, variables))
}

pub(super) fn of_role(role: &str, flags: &[String], variables: &[(&'static str, String)]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
    command.args([role, "--log", "error"]);
    // A worker listens nowhere.
    if role == "serve" {
        command.args(["--listen", "127.0.0.1:0"]);
    }
    command.args(flags).envs(variables.iter().map(|(name, value)| (*name, value)));
    command
}
