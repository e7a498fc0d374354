//! How many requests each principal has at work at the same time.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use crate::jobs::Principal;

/// What principals have. Cheap to clone; all clones are the same.
#[derive(Clone, Debug)]
pub struct Shares {
    most: u64,
    counts: Arc<Mutex<BTreeMap<Principal, u64>>>,
}

/// One request. Dropping it ends it.
#[derive(Debug)]
pub(super) struct Share {
    of: Shares,
    principal: Principal,
}

impl Shares {
    /// So many for each at most.
    #[must_use]
    pub fn new(most: u64) -> Self {
        Self { most, counts: Arc::default() }
    }

    /// One more request of that principal, unless it has as many as may be.
    pub(super) fn take(&self, principal: &Principal) -> Option<Share> {
        let mut counts = self.counts.lock().unwrap_or_else(PoisonError::into_inner);
        let count = counts.get(principal).copied().unwrap_or(0);
        if count >= self.most {
            return None;
        }
        counts.insert(principal.clone(), count + 1);
        Some(Share { of: self.clone(), principal: principal.clone() })
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        let mut counts = self.of.counts.lock().unwrap_or_else(PoisonError::into_inner);
        match counts.get_mut(&self.principal) {
            Some(count) if *count > 1 => *count -= 1,
            _ => drop(counts.remove(&self.principal)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_principal_has_its_own_share() {
        let shares = Shares::new(2);
        let [ann, bob] = ["ann", "bob"].map(|name| Principal::parse(name).expect("a name"));
        let held: Vec<_> = (0..3).map(|_| shares.take(&ann)).collect();
        assert!(held[1].is_some() && held[2].is_none(), "two and no more");
        assert!(shares.take(&bob).is_some(), "others have theirs");
        drop(held);
        assert!(shares.take(&ann).is_some(), "given back");
        assert!(shares.counts.lock().expect("not poisoned").is_empty(), "nobody is remembered");
    }
}
