//! What the fuzzer found and is mended, each with the smallest input that showed it.
