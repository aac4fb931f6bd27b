//! Runs of the closed loop.

#[path = "../common/mod.rs"]
mod common;

mod accuracy;
mod bent_joint;
mod bits;
mod blocks;
mod computed;
mod contact;
mod drives;
mod energy;
mod examples;
mod faults;
mod figures;
mod friction;
mod golden;
mod inverse;
mod iwan;
mod jenkins;
mod kept_holds;
mod laws;
mod limits;
mod linear;
mod losses;
mod manoeuvres;
mod massless;
mod massless_kept;
mod modelica;
mod motor_limits;
mod noise;
mod play;
mod prescribed;
mod random;
mod redundant;
mod relations;
mod ripple;
mod safety;
mod signals;
mod simulation;
mod start;
mod stiff;
mod taylor;
mod told;
mod unseen;
mod vehicle;
mod written;
