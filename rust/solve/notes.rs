//! What is noted of the steps for later: their number, their ends, and those that may hold an extremum.

use super::Method;
use super::advance::{Advance, Plain};
use super::record::{Branch, Record, lane_numbers};
use super::stepper::{Stepper, Trial};
use super::watch::{Candidate, Watched};
use crate::model::{Model, Rates};
use crate::real::{Mask, Path, Real, lanes_of};

impl<P: Path, M: Model<N>, T: Method, const N: usize> Advance<'_, P, M, T, N> {
    /// Counts the attempt and records its end.
    #[inline(always)]
    pub(super) fn count<const HELD: bool>(
        &mut self,
        accepted: <P::Lanes as Real>::Mask,
        step: Plain<P>,
        trial: &Trial<P::Lanes, N>,
    ) {
        let one = Plain::<P>::splat(1.0);
        self.attempts = self.attempts + one;
        self.accepted = self.accepted + Plain::<P>::select(accepted, one, Plain::<P>::zero());
        if self.demand.record {
            self.remember::<HELD>(accepted.to_bits(), step, &trial.rates);
        }
    }

    #[inline(always)]
    pub(super) fn remember<const HELD: bool>(&mut self, lanes: u64, step: Plain<P>, rates: &Rates<P::Lanes, N>) {
        for lane in lanes_of(lanes & self.occupied) {
            let record = Record {
                t: self.stepper.t.get(lane),
                step: step.get(lane),
                state: self.lane_state(lane),
                alpha_m: rates.slope[1].plain().get(lane),
                omega_l: rates.omega_l.plain().get(lane),
                alpha_l: rates.alpha_l.plain().get(lane),
                branch: if HELD { self.branch(lane) } else { Branch::default() },
            };
            if let Some(seat) = &mut self.seats[lane] {
                seat.remember(record);
            }
        }
    }

    /// Extrema inside the accepted steps.
    #[inline(always)]
    pub(super) fn watch<const HELD: bool>(
        &mut self,
        accepted: <P::Lanes as Real>::Mask,
        step: Plain<P>,
        trial: &Trial<P::Lanes, N>,
    ) {
        let Self { stepper, seats, occupied, .. } = self;
        let Stepper { watch, constants, t, state, directions, held, .. } = stepper;
        watch.step(accepted, step, &trial.rates, constants, |lanes, signal, sign, at_most| {
            for lane in lanes_of(lanes & *occupied) {
                let start = Record {
                    t: t.get(lane),
                    step: 0.0,
                    state: lane_numbers(state, lane),
                    alpha_m: f64::NAN,
                    omega_l: f64::NAN,
                    branch: if HELD { Branch::of(lane, directions, held.as_deref()) } else { Branch::default() },
                    alpha_l: f64::NAN,
                };
                let signal = [Watched::Windup, Watched::Te, Watched::OmegaL][signal];
                if let Some(seat) = &mut seats[lane] {
                    seat.propose(Candidate {
                        start,
                        step: step.get(lane),
                        signal,
                        sign,
                        at_most: at_most.get(lane),
                        asked: false,
                        peak: None,
                    });
                }
            }
        });
    }
}
