//! Places for connections: so many in all, so many from one address, and a few that only probes are answered on.

use std::{
    collections::BTreeMap,
    net::IpAddr,
    sync::{Arc, Mutex, PoisonError},
};

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Places beside the others, so that a service that has no more of those can still say that it is alive.
const RESERVED: usize = 16;
/// How many of them one address may have.
const RESERVED_PER_PEER: usize = 4;

/// All of them.
#[derive(Debug)]
pub(super) struct Places {
    open: Arc<Semaphore>,
    reserved: Arc<Semaphore>,
    max_per_peer: usize,
    peers: Arc<Mutex<BTreeMap<IpAddr, Peer>>>,
}

/// What one address has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Peer {
    open: usize,
    reserved: usize,
}

impl Peer {
    const fn count(&mut self, is_reserved: bool) -> &mut usize {
        if is_reserved { &mut self.reserved } else { &mut self.open }
    }
}

/// One place. Dropping it gives it back.
#[derive(Debug)]
pub(super) struct Place {
    /// Whether only probes are answered there.
    pub(super) is_reserved: bool,
    peer: IpAddr,
    peers: Arc<Mutex<BTreeMap<IpAddr, Peer>>>,
    _permit: OwnedSemaphorePermit,
}

impl Places {
    pub(super) fn new(open: usize, max_per_peer: usize) -> Self {
        Self {
            open: Arc::new(Semaphore::new(open)),
            reserved: Arc::new(Semaphore::new(RESERVED)),
            max_per_peer,
            peers: Arc::default(),
        }
    }

    /// A place for a connection from that address, if there is one.
    pub(super) fn take(&self, peer: IpAddr) -> Option<Place> {
        let mut peers = self.peers.lock().unwrap_or_else(PoisonError::into_inner);
        let has = peers.get(&peer).copied().unwrap_or_default();
        let open = (has.open < self.max_per_peer).then(|| Arc::clone(&self.open).try_acquire_owned().ok()).flatten();
        let is_reserved = open.is_none();
        let reserved = || {
            (has.reserved < RESERVED_PER_PEER).then(|| Arc::clone(&self.reserved).try_acquire_owned().ok()).flatten()
        };
        let permit = open.or_else(reserved)?;
        *peers.entry(peer).or_default().count(is_reserved) += 1;
        drop(peers);
        Some(Place { is_reserved, peer, peers: Arc::clone(&self.peers), _permit: permit })
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut peers = self.peers.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(has) = peers.get_mut(&self.peer) else { return };
        *has.count(self.is_reserved) -= 1;
        if *has == Peer::default() {
            peers.remove(&self.peer);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_address_has_its_share_and_probes_have_places_of_their_own() {
        let places = Places::new(3, 2);
        let [one, other, third] = [1, 2, 3].map(|last| IpAddr::from([10, 0, 0, last]));
        let kinds = |taken: &[Option<Place>]| -> Vec<_> {
            taken.iter().map(|place| place.as_ref().map(|place| place.is_reserved)).collect()
        };
        let of_one: Vec<_> = (0..7).map(|_| places.take(one)).collect();
        let expected = [Some(false), Some(false), Some(true), Some(true), Some(true), Some(true), None];
        assert_eq!(kinds(&of_one), expected, "its share, a few for probes, no more");
        let of_other: Vec<_> = (0..2).map(|_| places.take(other)).collect();
        assert_eq!(kinds(&of_other), [Some(false), Some(true)], "there are three in all");
        drop(of_one);
        assert_eq!(places.take(third).map(|place| place.is_reserved), Some(false), "given back");
        drop(of_other);
        assert!(places.peers.lock().expect("not poisoned").is_empty(), "nobody is remembered");
    }
}
