//! BVH: depth, counts, numbers and words beyond all measure.

use super::{BEYOND_A_LIMIT, MALFORMED, Wanted, case, try_all};

const CHANNELS: &str = "CHANNELS 3 Zrotation Xrotation Yrotation";

/// One joint, and this motion.
fn moved(motion: &str) -> String {
    format!("HIERARCHY\nROOT a\n{{\nOFFSET 0 0 0\n{CHANNELS}\n}}\nMOTION\n{motion}\n")
}

fn joint(count: &str) -> String {
    format!("HIERARCHY\nROOT a\n{{\nOFFSET 0 0 0\nCHANNELS {count}\n}}\n")
}

#[test]
fn the_hierarchy() {
    let chain = "HIERARCHY ROOT a { OFFSET 0 0 0 ".to_owned() + &"JOINT b { OFFSET 0 1 0 ".repeat(100_000);
    let wide = "HIERARCHY ROOT a { OFFSET 0 0 0 ".to_owned() + &"JOINT b { OFFSET 0 1 0 } ".repeat(70_000) + "}";
    let twice = "HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 2 Xrotation Xrotation }";
    try_all(&[
        case("deep.bvh", chain, BEYOND_A_LIMIT),
        case("wide.bvh", wide, BEYOND_A_LIMIT),
        case("many roots.bvh", "HIERARCHY ".to_owned() + &"ROOT a { OFFSET 0 0 0 } ".repeat(70_000), BEYOND_A_LIMIT),
        case("only opening.bvh", "HIERARCHY ROOT a ".to_owned() + &"{".repeat(1 << 20), MALFORMED),
        case("only closing.bvh", "HIERARCHY ".to_owned() + &"}".repeat(1 << 20), MALFORMED),
        case("one long name.bvh", format!("HIERARCHY ROOT {} {{ OFFSET 0 0 0 }}", "x".repeat(8 << 20)), Wanted::Read),
        case("a billion channels.bvh", joint("1000000000 Xrotation"), MALFORMED),
        case("channels below zero.bvh", joint("-1"), MALFORMED),
        case("channels beyond counting.bvh", joint("1e308"), MALFORMED),
        case("one channel twice.bvh", twice, MALFORMED),
        case("an infinite offset.bvh", "HIERARCHY ROOT a { OFFSET 0 1e999 0 }", MALFORMED),
        case("no offset but a word.bvh", "HIERARCHY ROOT a { OFFSET 0 nan 0 }", MALFORMED),
        case("zero bytes.bvh", "HIERARCHY\0\0\0\0", MALFORMED),
    ]);
}

#[test]
fn the_motion() {
    try_all(&[
        case("frames beyond counting.bvh", moved("Frames: 1e300\nFrame Time: 0.1\n1 2 3"), BEYOND_A_LIMIT),
        case("a billion frames.bvh", moved("Frames: 1000000000\nFrame Time: 0.1\n1 2 3"), BEYOND_A_LIMIT),
        case("frames are none.bvh", moved("Frames: nan\nFrame Time: 0.1\n1 2 3"), MALFORMED),
        case(
            "more rows than allowed.bvh",
            moved(&format!("Frames: 1\nFrame Time: 0.1\n{}", "1 2 3\n".repeat(300_000))),
            BEYOND_A_LIMIT,
        ),
        case("no time passes.bvh", moved("Frames: 1\nFrame Time: 0\n1 2 3"), MALFORMED),
        case("next to no time passes.bvh", moved("Frames: 1\nFrame Time: 1e-320\n1 2 3"), MALFORMED),
        case("ages pass.bvh", moved("Frames: 1\nFrame Time: 1e300\n1 2 3"), MALFORMED),
        case("too large an angle.bvh", moved("Frames: 1\nFrame Time: 0.1\n1e38 2 3"), MALFORMED),
        case("an infinite angle.bvh", moved("Frames: 1\nFrame Time: 0.1\n1e999 2 3"), MALFORMED),
        case("angles that are none.bvh", moved("Frames: 1\nFrame Time: 0.1\nnan -inf 3"), MALFORMED),
        case(
            "a number of a million digits.bvh",
            moved(&format!("Frames: 1\nFrame Time: 0.1\n0.{} 2 3", "1".repeat(1 << 20))),
            Wanted::Read,
        ),
        case(
            "numbers without channels.bvh",
            "HIERARCHY ROOT a { OFFSET 0 0 0 } MOTION Frames: 1 Frame Time: 1 5",
            MALFORMED,
        ),
    ]);
}
