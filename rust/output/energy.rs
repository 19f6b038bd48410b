//! Where the energy went.

use crate::solve::{Integral, Mark, Retrace, Seat};

/// Energy lost in terms from the beginning to the end [J].
pub fn lost_in_terms<const N: usize>(seat: &Seat<N>, retrace: &mut dyn Retrace<N>, end: (f64, &[f64; N])) -> f64 {
    let before = retrace.energies(seat, 0.0, &seat.initial).terms;
    let after = retrace.energies(seat, end.0, end.1).terms;
    seat.integral(Mark::Begin, Mark::End, Integral::TermPower) - (after - before)
}

/// What the balance of energy lacks, as a share of the energy exchanged.
pub fn residual<const N: usize>(seat: &Seat<N>, retrace: &mut dyn Retrace<N>, end: (f64, &[f64; N])) -> f64 {
    let total = |which| seat.integral(Mark::Begin, Mark::End, which);
    let taken: f64 =
        [Integral::MotorLoss, Integral::WaveGeneratorLoss, Integral::LoadLoss, Integral::MeshLoss, Integral::TermPower]
            .map(total)
            .iter()
            .sum();
    let (motor, load) = (total(Integral::MotorPower), total(Integral::LoadPower));
    let before = retrace.energies(seat, 0.0, &seat.initial).mechanical;
    let change = retrace.energies(seat, end.0, end.1).mechanical - before;
    let exchanged = motor.abs().max(load.abs()).max(taken).max(change.abs());
    (change - (motor - load - taken)).abs() / exchanged
}
