//! The ops behind forward kinematics, each against cases whose result is known.

mod chains;
mod curves;
mod goals;
mod joints;
mod limits;
mod order;
mod pelvis;
mod pins;
mod poses;
mod root_motion;
mod stage;
