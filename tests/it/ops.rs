//! The ops behind forward kinematics, each against cases whose result is known.

mod joints;
mod limits;
mod pins;
mod poses;
mod root_motion;
mod stage;
