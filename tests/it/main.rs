//! All integration tests, in one binary for the sake of link time.

mod event_stream;
mod made_animals;
mod service_process;
mod support;

mod alignment;
mod architecture;
mod bone_maps;
mod cli;
mod clients;
mod corpus;
mod demo;
mod durable;
mod editing;
mod explain;
mod formats_body_model;
mod formats_bundle;
mod formats_bvh;
mod formats_fbx;
mod formats_fbx_write;
mod formats_gltf;
mod formats_poses;
mod gaze;
mod http;
mod joint_table;
mod judges;
mod morphs;
mod ops;
mod parity;
mod quality;
mod readme;
mod rig_doctor;
mod rig_recognition;
mod skin_points;
mod tune;
