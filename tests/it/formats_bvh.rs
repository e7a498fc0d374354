//! The bvh reader and writer.
