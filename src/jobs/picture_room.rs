//! Room in memory for pictures that arrive with requests, bounded for all callers together.

use std::sync::Arc;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::Refusal;

/// Bytes of pictures of all callers that are held at the same time.
const HELD_BYTES: usize = 256 << 20;
/// In such steps they are counted.
const STEP: usize = 1 << 20;
/// Room for pictures that arrive.
#[derive(Clone, Debug)]
pub(super) struct PictureRoom(Arc<Semaphore>);

impl Default for PictureRoom {
    fn default() -> Self {
        Self(Arc::new(Semaphore::new(HELD_BYTES / STEP)))
    }
}

impl PictureRoom {
    /// A picture of at most so many bytes.
    pub(super) fn begin(&self, name: &str, most: u64) -> ArrivingPicture {
        ArrivingPicture { name: name.to_owned(), bytes: Vec::new(), most, room: self.clone(), held: None }
    }
}

/// A picture that arrives. Dropping it gives its room back.
#[derive(Debug)]
pub struct ArrivingPicture {
    pub(super) name: String,
    pub(super) bytes: Vec<u8>,
    most: u64,
    room: PictureRoom,
    held: Option<OwnedSemaphorePermit>,
}

impl ArrivingPicture {
    /// Adds bytes.
    ///
    /// # Errors
    /// When there are more than a picture may have, or no room for them at the moment.
    pub fn write(&mut self, chunk: &[u8]) -> Result<(), Refusal> {
        let total = self.bytes.len() + chunk.len();
        if total as u64 > self.most {
            let what = format!("the picture '{}'", self.name);
            return Err(Refusal::TooLarge { what, limit: "picture_bytes", most: self.most, actual: total as u64 });
        }
        let has = self.held.as_ref().map_or(0, OwnedSemaphorePermit::num_permits);
        let more = total.div_ceil(STEP).saturating_sub(has);
        if more > 0 {
            // Those who wait would hold what others wait for.
            let more = Arc::clone(&self.room.0).try_acquire_many_owned(more as u32).map_err(|_| Refusal::TooBusy)?;
            match &mut self.held {
                Some(held) => held.merge(more),
                None => self.held = Some(more),
            }
        }
        self.bytes.extend_from_slice(chunk);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_bounded_each_and_together() {
        let room = PictureRoom(Arc::new(Semaphore::new(4)));
        let mut first = room.begin("image", 3 << 20);
        assert!(first.write(&vec![0; 3 << 20]).is_ok(), "as much as one may have");
        assert!(matches!(first.write(&[0]), Err(Refusal::TooLarge { limit: "picture_bytes", .. })), "one more");
        let mut second = room.begin("image", 3 << 20);
        assert!(second.write(&vec![0; 1 << 20]).is_ok(), "what is left");
        assert!(matches!(second.write(&[0]), Err(Refusal::TooBusy)), "there is no more room");
        drop(first);
        assert!(second.write(&[0]).is_ok(), "there is again");
    }
}
