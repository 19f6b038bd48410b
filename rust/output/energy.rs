//! Where the energy went.

use crate::real::Scalar;
use crate::solve::{Integral, Mark, Retrace, Seat};

/// Energy lost in terms from the beginning to the end [J].
pub fn lost_in_terms<S: Scalar, const N: usize>(
    seat: &Seat<S, N>,
    retrace: &mut dyn Retrace<S, N>,
    end: (f64, &[S; N]),
) -> S {
    let before = retrace.energies(seat, 0.0, &seat.initial).terms;
    let after = retrace.energies(seat, end.0, end.1).terms;
    seat.integral(Mark::Begin, Mark::End, Integral::TermPower) - (after - before)
}

/// What the balance of energy lacks, as a share of the energy exchanged; 0 where none is.
pub fn residual<S: Scalar, const N: usize>(
    seat: &Seat<S, N>,
    retrace: &mut dyn Retrace<S, N>,
    end: (f64, &[S; N]),
) -> f64 {
    let total = |which| seat.integral(Mark::Begin, Mark::End, which).plain();
    let taken: f64 =
        [Integral::MotorLoss, Integral::WaveGeneratorLoss, Integral::LoadLoss, Integral::MeshLoss, Integral::TermPower]
            .map(total)
            .iter()
            .sum();
    let (motor, load) = (total(Integral::MotorPower), total(Integral::LoadPower));
    let before = retrace.energies(seat, 0.0, &seat.initial).mechanical.plain();
    let change = retrace.energies(seat, end.0, end.1).mechanical.plain() - before;
    let exchanged = motor.abs().max(load.abs()).max(taken).max(change.abs());
    if exchanged == 0.0 { 0.0 } else { (change - (motor - load - taken)).abs() / exchanged }
}
