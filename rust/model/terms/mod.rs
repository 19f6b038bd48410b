//! Physics the nominal model leaves out: one file per term, one line in the catalogue.
//!
//! A term enters the equations of motion at fixed places, in this order: the actuator shapes the motor torque, the
//! mesh shapes kinematic error, windup, and gear torque, friction resists motor and load, the load and the structure
//! add torques of their own. Which terms are on is the same for all rows of a sweep; their parameters are not.

mod actuator_lag;
mod asymmetric_friction;
mod backlash;
mod base_compliance;
mod catalogue;
mod cogging;
mod contract;
mod coulomb_friction;
mod coulomb_friction_smooth;
mod coupling_slip;
mod delay;
mod dry;
mod external_periodic_torque;
mod gravity_unbalance;
mod hysteresis;
mod input_compliance;
mod line;
mod load_compliance;
mod load_dependent_friction;
mod load_motor_ripple;
mod load_side_friction;
mod local_fault;
mod maxwell_slip;
mod mesh_stiffness_variation;
mod nonlinear_viscous;
mod position_dependent_friction;
mod presliding_friction;
mod ratcheting;
mod rotor_unbalance_reaction;
mod sizes;
mod soft_windup;
mod stribeck_friction;
mod te_beat;
mod te_harmonic;
mod te_hysteresis;
mod te_load_dependence;
#[cfg(test)]
mod tests;
mod thermal_viscous;
mod tooth_passage;
mod torque_gain;
mod torque_ripple;
mod torque_saturation;
mod viscoelastic;
mod wear_run_in;
mod wound;

pub use catalogue::{Choice, Place, TERMS, Terms};
pub use contract::{
    Actuator, Gear, Hidden, Internals, Load, Mesh, Motion, Reaction, Term, TermInfo, TermParameter, TermState,
};
pub use dry::{Dry, at_rest};
pub use wound::Wound;

/// States that terms may add between them.
pub const HIDDEN: usize = 8;
