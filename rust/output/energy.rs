//! Where the energy went.

use crate::model::{Layout, spring};
use crate::solve::{Integral, Mark, Retrace, Seat};

/// Kinetic and potential energy [J] of a row in a state.
pub fn stored<const N: usize>(
    layout: &Layout,
    seat: &Seat<N>,
    retrace: &mut dyn Retrace<N>,
    t: f64,
    state: &[f64; N],
) -> f64 {
    let c = &seat.assignment.row.constants;
    let rates = retrace.rates(seat, t, state);
    let kinetic = 0.5 * (c.j_m * state[1] * state[1] + c.j_l * rates.omega_l * rates.omega_l);
    kinetic + spring::energy(layout.spring, c, rates.windup)
}

/// What the balance of energy lacks, as a share of the energy exchanged.
pub fn residual<const N: usize>(
    layout: &Layout,
    seat: &Seat<N>,
    retrace: &mut dyn Retrace<N>,
    t: f64,
    state: &[f64; N],
) -> f64 {
    let total = |which| seat.integral(Mark::Begin, Mark::End, which);
    let losses: f64 = [Integral::MotorLoss, Integral::WaveGeneratorLoss, Integral::LoadLoss, Integral::MeshLoss]
        .map(total)
        .iter()
        .sum();
    let (motor, load) = (total(Integral::MotorPower), total(Integral::LoadPower));
    let before = stored(layout, seat, retrace, 0.0, &seat.initial.clone());
    let change = stored(layout, seat, retrace, t, state) - before;
    let exchanged = motor.abs().max(load.abs()).max(losses).max(change.abs());
    (change - (motor - load - losses)).abs() / exchanged
}
