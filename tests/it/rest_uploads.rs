//! Rest files: the pose of a file put onto a rig, whatever the format, exporter, axes, unit, order and names of its joints.
//!
//! What is expected is always known: the same character in the same pose must give what no upload gives, and in another pose the
//! bones of that pose, which are known because the test has put the character into it.

mod corpus;
mod expected;
mod exports;
mod hostile;
mod made;
mod variant;
