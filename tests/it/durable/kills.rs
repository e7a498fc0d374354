//! Small jobs while processes are killed at random: none is lost, none is visible twice, and what the dead had is soon taken up again.
//!
//! `RETARGETD_TEST_JOBS=1000` is the long form: with the usual lease, and held to its figures, which are printed.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
    time::Duration,
};

use jiff::Timestamp;
use retargetd::telemetry::Clock;
use serde_json::Value;

use super::{
    dice::Dice,
    studio::{CLIP, Customer, Place, edit_of},
    support::ServiceProcess,
};
use crate::{event_stream::Heard, support::Extent};

/// How long it may take until another has what the dead had.
const LONGEST_RECOVERY: Duration = Duration::from_secs(10);

/// The processes of a studio, of which one after the other dies.
struct Fleet {
    place: Place,
    flags: Vec<&'static str>,
    /// Where it stays alive whoever dies.
    api: Option<ServiceProcess>,
    mortals: Vec<ServiceProcess>,
}

impl Fleet {
    fn start(place: Place, lease: &'static str) -> Self {
        let flags =
            vec!["--lease-period", lease, "--max-queued-jobs", "100000", "--workers", "2", "--max-attempts", "50"];
        let is_one = matches!(place, Place::Folder(_));
        let api = (!is_one).then(|| place.serve(&[&flags[..4], &["--workers", "0"]].concat(), &[]));
        let mut fleet = Self { place, flags, api, mortals: Vec::new() };
        fleet.mortals = (0..if is_one { 1 } else { 3 }).map(|_| fleet.mortal()).collect();
        fleet
    }

    fn mortal(&self) -> ServiceProcess {
        match self.api {
            Some(_) => self.place.worker(&self.flags, &[]),
            None => self.place.serve(&self.flags, &[]),
        }
    }

    fn url(&self) -> String {
        self.api.as_ref().unwrap_or(&self.mortals[0]).url.clone()
    }

    /// Kills one of them as a power cut does, and starts another in its place.
    fn kill(&mut self, dice: &Dice, clock: &Clock) -> Kill {
        let victim = dice.roll(self.mortals.len() as u64) as usize;
        let before = clock.now();
        self.mortals[victim].kill();
        let after = clock.now();
        self.mortals[victim] = self.mortal();
        Kill { before, after }
    }
}

/// When a process was killed: just before, and when it was gone.
struct Kill {
    before: Timestamp,
    after: Timestamp,
}

/// What was heard of one job.
#[derive(Default)]
struct Life {
    /// Since when it runs.
    running_since: Option<Timestamp>,
    /// When it was taken from somebody, while nobody else has it.
    robbed_at: Option<Timestamp>,
    /// How often it came to an end.
    ends: usize,
    /// Its results, as they were when they were first seen.
    results: Value,
}

/// What was heard of all jobs, and who was killed in the meantime.
#[derive(Default)]
struct Story {
    last_id: String,
    lives: BTreeMap<String, Life>,
    kills: Vec<Kill>,
    ended: usize,
    /// How long it took until another had what a process had that died.
    recoveries: Vec<Duration>,
}

impl Story {
    /// Takes an event in; gives the job when it has ended well.
    fn hear(&mut self, heard: &Heard) -> Option<String> {
        assert_ne!(heard.event, "reset", "no event is missing");
        let expected = self.last_id.parse::<u64>().unwrap_or(0) + 1;
        assert_eq!(heard.id, expected.to_string(), "each event once and in order");
        heard.id.clone_into(&mut self.last_id);
        let at: Timestamp = heard.data["created_at"].as_str().expect("a time").parse().expect("a time");
        let id = heard.data["job"].as_str().expect("an id").to_owned();
        let life = self.lives.entry(id.clone()).or_default();
        match heard.data["state"].as_str().expect("a state") {
            "queued" => {
                if let Some(since) = life.running_since.take() {
                    // Of all that died while somebody had it, the first. Where none did, somebody was too slow to extend a lease.
                    let kill = self.kills.iter().find(|kill| kill.after >= since && kill.before <= at);
                    life.robbed_at = kill.map(|kill| kill.before);
                }
            }
            "running" => {
                life.running_since = Some(at);
                if let Some(robbed_at) = life.robbed_at.take() {
                    self.recoveries.push(at.duration_since(robbed_at).unsigned_abs());
                }
            }
            state => {
                life.ends += 1;
                self.ended += 1;
                return (state == "succeeded").then_some(id);
            }
        }
        None
    }
}

/// Asks for that many jobs, each under a key of its own and again until it is taken, wherever the service is by then.
async fn ask_for_all(url: Arc<Mutex<String>>, asset: String, count: usize) -> Customer {
    let mut customer = Customer::new();
    for number in 0..count {
        loop {
            let url = url.lock().expect("nobody panics").clone();
            if customer.ask_for(&url, &edit_of(&asset), &format!("job-{number}")).await.is_some() {
                break;
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }
    customer
}

/// Processes are killed, about one for every twenty jobs that end, until all have ended.
async fn loses_nothing(place: Place, name: &str) {
    let extent = Extent::of("RETARGETD_TEST_JOBS", 60);
    let (count, dice, clock) = (extent.amount, Dice::new(7), Clock::system());
    let mut fleet = Fleet::start(place, if extent.is_measured { "6s" } else { "2s" });
    let watcher = Customer::new();
    let asset = watcher.upload(&fleet.url(), CLIP).await.expect("is taken");
    let url = Arc::new(Mutex::new(fleet.url()));
    let asker = tokio::spawn(ask_for_all(Arc::clone(&url), asset, count));

    let (mut story, mut next_kill) = (Story::default(), 7);
    let mut stream = watcher.follow(&fleet.url(), "0").await;
    while story.ended < count {
        let Some(heard) = stream.next().await else {
            stream = watcher.follow(&fleet.url(), &story.last_id).await;
            continue;
        };
        if let Some(id) = story.hear(&heard) {
            let job = watcher.job(&fleet.url(), &id).await.expect("an answer");
            watcher.check_result(&fleet.url(), &job["results"][0]).await;
            story.lives.get_mut(&id).expect("was heard of").results = job["results"].clone();
        }
        if story.ended >= next_kill && story.ended < count {
            tokio::time::sleep(Duration::from_millis(dice.roll(40))).await;
            story.kills.push(fleet.kill(&dice, &clock));
            *url.lock().expect("nobody panics") = fleet.url();
            next_kill = story.ended + 5 + dice.roll(31) as usize;
        }
    }

    let customer = asker.await.expect("every job is taken");
    let states = customer.collect(&fleet.url()).await;
    assert_eq!(states.get("succeeded"), Some(&count), "none is lost, none fails: {states:?}");
    let listed = watcher.list(&fleet.url(), "/v1/jobs").await;
    assert_eq!((listed.len(), story.lives.len()), (count, count), "one job for each key, and no other");
    for job in &listed {
        let life = &story.lives[job["id"].as_str().expect("an id")];
        assert_eq!(life.ends, 1, "it ends once: {job}");
        assert_eq!(job["results"], life.results, "and gives what it gave when it was first seen");
    }
    assert!(!story.kills.is_empty(), "somebody died");
    let longest = story.recoveries.iter().max().copied().unwrap_or_default();
    let figure = format!(
        "{name}: {count} jobs, {} kills, {} jobs taken up again after {:.1} s at most; 0 lost, 0 visible twice",
        story.kills.len(),
        story.recoveries.len(),
        longest.as_secs_f64()
    );
    extent.holds(longest < LONGEST_RECOVERY && !story.recoveries.is_empty(), &figure);
    for process in fleet.mortals.into_iter().chain(fleet.api) {
        assert_eq!(process.terminate(), Some(0), "it ends well");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn workers_killed_at_random_lose_nothing() {
    let Some(place) = Place::shared() else { return };
    loses_nothing(place, "workers on Postgres").await;
}

/// The same with one process and its folder.
#[tokio::test(flavor = "multi_thread")]
async fn a_service_killed_at_random_loses_nothing() {
    loses_nothing(Place::folder(), "one process on SQLite").await;
}
