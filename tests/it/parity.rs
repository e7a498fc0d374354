//! The reference cases of the IK rig retargeter.
