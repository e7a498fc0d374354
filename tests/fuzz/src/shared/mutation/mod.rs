//! Changes to an input, from a seed: the same seed makes the same change.
//!
//! A file in a container is taken apart, one part of it changed, and put together again with lengths and checksums that are right: else
//! nothing behind them would ever see a change. Now and then the container itself is changed.

mod bytes;
mod json;
mod random;
mod text;

use super::container::Container;
pub(crate) use bytes::change_bytes;
pub(crate) use random::Random;

/// A change that knows nothing of formats: the bytes to the bytes with it.
pub(crate) type Change<'a> = &'a mut dyn FnMut(&[u8], &mut Random) -> Vec<u8>;

/// The input with one change; one that knows nothing of formats is made by `plain`.
pub(crate) fn mutate(input: &[u8], random: &mut Random, plain: Change<'_>) -> Vec<u8> {
    let whole = Container::of(input).filter(|_| !random.one_in(4));
    let Some(mut container) = whole else { return mutate_part(input, random, plain) };
    let Some(part) = random.index(container.parts.len()) else { return plain(input, random) };
    if random.one_in(40) {
        container.parts.swap_remove(part);
    } else if random.one_in(40) {
        let again = container.parts[part].clone();
        container.parts.push(again);
    } else {
        let part = &mut container.parts[part].bytes;
        // An array in an archive is a container itself.
        *part = mutate(part, random, plain);
    }
    container.into_bytes()
}

fn mutate_part(part: &[u8], random: &mut Random, plain: Change<'_>) -> Vec<u8> {
    let changed = match random.below(4) {
        0 => json::mutate(part, random),
        1 => text::mutate(part, random),
        _ => None,
    };
    changed.unwrap_or_else(|| plain(part, random))
}
