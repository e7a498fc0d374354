//! Real files, where the corpus of real files is there.
