//! The store: what is promised of records and blobs together.

use std::{sync::Arc, time::Duration};

use jiff::Timestamp;

use super::{AssetId, AssetRecord, DataFolder, Principal, Store};

fn asset(sha256: &str, bytes: u64) -> AssetRecord {
    let created_at = Timestamp::UNIX_EPOCH;
    AssetRecord {
        id: AssetId::new(),
        principal: Principal::anonymous(),
        sha256: sha256.to_owned(),
        bytes,
        format: "bvh".to_owned(),
        file_name: "walk.bvh".to_owned(),
        created_at,
        expires_at: created_at + Duration::from_secs(60),
    }
}

async fn open() -> (tempfile::TempDir, DataFolder, Store) {
    let root = tempfile::tempdir().expect("a temporary folder");
    let folder = DataFolder::take(root.path()).expect("nobody has it");
    let store = Store::open(&folder).await.expect("the store opens");
    (root, folder, store)
}

#[tokio::test]
async fn a_blob_is_visible_when_it_is_complete_and_not_before() {
    let (_root, folder, store) = open().await;
    for (size, is_in_memory) in [(0, true), (3_000_000, true), (20_000_000, false)] {
        let mut writer = store.blobs().begin().expect("begins");
        for piece in vec![7; size].chunks(900_000) {
            writer.write(piece).await.expect("writes");
        }
        let unnamed = writer.finish().await.expect("finishes");
        assert_eq!(unnamed.in_memory().map(|bytes| bytes.len()), is_in_memory.then_some(size), "small ones only");
        let digest = unnamed.blob().sha256.clone();
        assert!(!store.blobs().has(&digest).await.expect("answers"), "complete, but not kept yet");
        let blob = unnamed.keep().await.expect("is kept");
        assert_eq!((blob.bytes, blob.sha256.len()), (size as u64, 64), "size and name");
        let bytes = store.blobs().read(&digest).await.expect("reads");
        assert!(bytes.len() == size && bytes.iter().all(|byte| *byte == 7), "the same bytes");
        let whole = store.blobs().write(bytes, None).await.expect("writes");
        assert_eq!(*whole.blob(), blob, "the same by whatever way");
        assert_eq!(whole.keep().await.expect("is there already"), blob, "and once");
        let left = std::fs::read_dir(folder.uploads()).expect("a folder").count();
        assert_eq!(left, 0, "nothing is left where uploads are written");
    }
}

#[tokio::test]
async fn memory_for_files_that_arrive_is_bounded_and_given_back() {
    let (_root, _folder, store) = open().await;
    let receive = async |first: u8| {
        let mut writer = store.blobs().begin().expect("begins");
        writer.write(&vec![first; 15_000_000]).await.expect("writes");
        writer.finish().await.expect("finishes")
    };
    let mut arrived = Vec::new();
    for first in 0..8 {
        arrived.push(receive(first).await);
    }
    let in_memory = arrived.iter().filter(|blob| blob.in_memory().is_some()).count();
    assert!((3..=4).contains(&in_memory), "64 MiB for all: {in_memory} of 8 files of 15 MB");
    drop(arrived);
    assert!(receive(9).await.in_memory().is_some(), "there is room again");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_dropped_half_way_leaves_nothing() {
    let (_root, folder, store) = open().await;
    let mut writer = store.blobs().begin().expect("begins");
    writer.write(&vec![1; 20_000_000]).await.expect("writes");
    assert_ne!(std::fs::read_dir(folder.uploads()).expect("a folder").count(), 0, "parts are there");
    drop(writer);
    drop(store.blobs().write(vec![2; 10].into(), None).await.expect("writes"));
    for _ in 0..500 {
        if std::fs::read_dir(folder.uploads()).expect("a folder").count() == 0 {
            return;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    panic!("something is left where uploads are written");
}

#[tokio::test]
async fn the_same_bytes_have_one_record_which_is_kept_longer() {
    let (_root, _folder, store) = open().await;
    let first = asset("aa", 1);
    let later = AssetRecord { expires_at: first.expires_at + Duration::from_secs(1), ..asset("aa", 1) };
    assert!(store.records().add_asset(&first).await.expect("writes").1, "the first is new");
    let (stored, is_new) = store.records().add_asset(&later).await.expect("writes");
    assert!(!is_new && stored.id == first.id, "the same record");
    assert_eq!(stored.expires_at, later.expires_at, "kept as long as the later asks for");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn many_writers_wait_for_one_another() {
    let (_root, _folder, store) = open().await;
    let store = Arc::new(store);
    let tasks: Vec<_> = (0..8)
        .map(|task| {
            let store = Arc::clone(&store);
            tokio::spawn(async move {
                for number in 0..20 {
                    let record = asset(&format!("{task}-{number}"), 1);
                    store.records().add_asset(&record).await?;
                    store.records().remove_asset(&record.principal, &record.id).await?;
                    store.records().add_asset(&record).await?;
                }
                Ok::<_, super::StoreError>(())
            })
        })
        .collect();
    for task in tasks {
        task.await.expect("no panic").expect("never 'database is locked'");
    }
    assert_eq!(store.records().stored_bytes().await.expect("answers"), 160, "all are there");
}

#[tokio::test]
async fn expired_files_go_with_their_bytes_unless_another_record_names_them() {
    let (_root, _folder, store) = open().await;
    let blob = store.blobs().write(vec![3; 10].into(), None).await.expect("writes").keep().await.expect("is kept");
    let short = asset(&blob.sha256, 10);
    let long = AssetRecord {
        format: "poses_json".to_owned(),
        expires_at: short.expires_at + Duration::from_secs(60),
        ..asset(&blob.sha256, 10)
    };
    store.records().add_asset(&short).await.expect("writes");
    store.records().add_asset(&long).await.expect("another format of the same bytes");
    assert_eq!(store.sweep(short.expires_at).await.expect("sweeps"), 1, "one has expired");
    assert!(store.blobs().has(&blob.sha256).await.expect("answers"), "the other still names the bytes");
    assert_eq!(store.sweep(long.expires_at).await.expect("sweeps"), 1, "now the other");
    assert!(!store.blobs().has(&blob.sha256).await.expect("answers"), "nobody names the bytes");
}
