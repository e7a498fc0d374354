//! The crash matrix: the process dies at every named place, and comes back.

use std::{
    path::Path,
    time::{Duration, Instant},
};

use retargetd::config::Failpoint;

use super::{
    studio::{CLIP, Customer, Place},
    support::{PATIENCE, ServiceProcess},
};

/// Short, so that lost workers are soon known to be.
const LEASE: &str = "--lease-period";
const SHORT: &str = "1s";

fn clip(number: usize) -> String {
    CLIP.replace("0 91 0", &format!("0 {}.5 0", 91 + number))
}

/// Uploads and asks until the service dies under it.
async fn use_until_it_dies(customer: &mut Customer, process: &mut ServiceProcess, dies: &mut ServiceProcess) {
    for number in 0..20 {
        if let Some(asset) = customer.upload(&process.url, &clip(number)).await {
            customer.ask(&process.url, &asset).await;
        }
        if dies.has_ended() || process.has_ended() {
            return;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    wait_for_end(dies).await;
}

async fn wait_for_end(process: &mut ServiceProcess) {
    let began = Instant::now();
    while !process.has_ended() {
        assert!(began.elapsed() < PATIENCE, "the failpoint is reached");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

fn files_in(folder: &Path) -> usize {
    std::fs::read_dir(folder).map_or(0, Iterator::count)
}

#[tokio::test(flavor = "multi_thread")]
async fn one_process_that_dies_anywhere_loses_nothing() {
    for failpoint in Failpoint::ALL {
        let place = Place::folder();
        let mut customer = Customer::new();
        let armed = [("RETARGETD_FAILPOINT", format!("{}:2", failpoint.name()))];
        let mut process = place.serve(&["--workers", "1"], &armed);
        for number in 0..200 {
            if process.has_ended() {
                break;
            }
            if let Some(asset) = customer.upload(&process.url, &clip(number)).await {
                customer.ask(&process.url, &asset).await;
            }
        }
        wait_for_end(&mut process).await;
        let process = place.serve(&["--workers", "1"], &[]);
        let states = customer.collect(&process.url).await;
        assert_eq!(states.get("succeeded"), Some(&customer.promised.len()), "after '{}': {states:?}", failpoint.name());
        // A job that was written down and not acknowledged may still run.
        assert_eq!(process.terminate(), Some(0), "it ends well");
        let Place::Folder(root) = &place else { continue };
        assert_eq!(files_in(&root.path().join("tmp")), 0, "nothing is left after '{}'", failpoint.name());
    }
}

/// A file is given while the disk still takes it down: what dies in between comes back, and gives the same file.
#[tokio::test(flavor = "multi_thread")]
async fn who_has_a_file_has_a_job_that_gives_it() {
    for failpoint in Failpoint::ALL {
        let (place, mut customer) = (Place::folder(), Customer::new());
        let armed = [("RETARGETD_FAILPOINT", format!("{}:3", failpoint.name()))];
        let mut process = place.serve(&["--workers", "1"], &armed);
        let mut given = Vec::new();
        for number in 0..20 {
            if process.has_ended() {
                break;
            }
            given.extend(customer.have_at_once(&process.url, &clip(number)).await);
        }
        wait_for_end(&mut process).await;
        assert!(!given.is_empty(), "files came before '{}'", failpoint.name());
        let process = place.serve(&["--workers", "1"], &[]);
        let states = customer.collect(&process.url).await;
        assert_eq!(states.get("succeeded"), Some(&given.len()), "after '{}': {states:?}", failpoint.name());
        for (id, digest) in given {
            let job = customer.job(&process.url, &id).await.expect("is there");
            assert_eq!(job["results"][0]["sha256"], digest.as_str(), "after '{}'", failpoint.name());
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_or_an_api_that_dies_anywhere_loses_nothing() {
    let Some(place) = Place::shared() else { return };
    for failpoint in Failpoint::ALL {
        let mut customer = Customer::new();
        let armed = [("RETARGETD_FAILPOINT", format!("{}:2", failpoint.name()))];
        let is_of_api = matches!(
            failpoint,
            Failpoint::UploadComplete | Failpoint::UploadKept | Failpoint::BeforeJobRecord | Failpoint::AfterJobRecord
        );
        if is_of_api {
            let mut api = place.serve(&["--workers", "0", LEASE, SHORT], &armed);
            for number in 0..20 {
                if api.has_ended() {
                    break;
                }
                if let Some(asset) = customer.upload(&api.url, &clip(number)).await {
                    customer.ask(&api.url, &asset).await;
                }
            }
            wait_for_end(&mut api).await;
        }
        let mut api = place.serve(&["--workers", "0", LEASE, SHORT], &[]);
        let mut worker = place.worker(&["--workers", "1", LEASE, SHORT], if is_of_api { &[] } else { &armed });
        if !is_of_api {
            use_until_it_dies(&mut customer, &mut api, &mut worker).await;
        }
        let _second = place.worker(&["--workers", "1", LEASE, SHORT], &[]);
        let states = customer.collect(&api.url).await;
        assert_eq!(states.get("succeeded"), Some(&customer.promised.len()), "after '{}': {states:?}", failpoint.name());
    }
}
