//! The poses reader and writer.
