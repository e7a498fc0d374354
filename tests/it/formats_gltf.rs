//! The gltf reader and writer.
