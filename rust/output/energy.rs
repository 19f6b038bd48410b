//! Where the energy went.

use crate::real::Scalar;
use crate::solve::{Integral, Mark, Retrace, Seat};

/// A damper of the base models.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damper {
    /// B_m.
    Motor,
    /// B_ml.
    WaveGenerator,
    /// B_l.
    Load,
    /// B_sp.
    Mesh,
}

/// Energy lost in a damper between two marks [J].
pub fn lost_in<S: Scalar, const N: usize>(damper: Damper, seat: &Seat<S, N>, (from, to): (Mark, Mark)) -> S {
    let c = &seat.assignment.row.constants;
    let integral = |which| seat.integral(from, to, which);
    match damper {
        Damper::Motor => integral(Integral::MotorLoss),
        Damper::WaveGenerator => integral(Integral::WaveGeneratorLoss),
        Damper::Load => c.b_l * integral(Integral::OmegaLSquare),
        Damper::Mesh => c.b_sp * integral(Integral::WindupRateSquare),
    }
}

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
    let lost = |damper| lost_in(damper, seat, (Mark::Begin, Mark::End)).plain();
    let dampers = [Damper::Motor, Damper::WaveGenerator, Damper::Load, Damper::Mesh];
    let taken = dampers.map(lost).iter().sum::<f64>() + total(Integral::TermPower);
    let (motor, load) = (total(Integral::MotorPower), total(Integral::LoadPower));
    let before = retrace.energies(seat, 0.0, &seat.initial).mechanical.plain();
    let change = retrace.energies(seat, end.0, end.1).mechanical.plain() - before;
    let exchanged = motor.abs().max(load.abs()).max(taken).max(change.abs());
    if exchanged == 0.0 { 0.0 } else { (change - (motor - load - taken)).abs() / exchanged }
}
