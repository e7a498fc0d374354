//! The fbx reader and writer.
