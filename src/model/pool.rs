//! Work that begins many parallel sections.

/// Does work in a thread of the current pool. A section that another thread begins costs it a message to the pool and a wait; one that a
/// thread of the pool begins costs neither, so what begins many of them moves there once.
pub fn in_pool<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    rayon::scope(|_| work())
}
