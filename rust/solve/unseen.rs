//! Steps in which values show no error, as those of a drive at rest: nothing keeps them within the stability of an
//! explicit method, and what rounding leaves in derivatives would grow with them. There alone derivatives have a say in
//! the step: it turns the fastest motion of the linearised equations by no more than a radian, or once the values have
//! moved, and what is left of both with them, by no more than is stable. Its rate is found by powers of their matrix.

use super::Method;
use super::advance::{Advance, Plain};
use super::along::Along;
use super::stepper::{Stepper, plain};
use crate::model::Model;
use crate::real::{Mask, Path, Real, Task};

/// Squared error, in units of the tolerance, below which a step does not see it.
const UNSEEN: f64 = 1e-16;
/// By how much a step turns the fastest motion [rad]: one of order 8 is right to 1e-7 there.
const TURN: f64 = 1.0;
/// Turn up to which a step is left alone once values have moved, in those [rad]: it is stable.
const STABLE: f64 = 3.3;
/// Squares of the matrix that are applied: one is exact for a single oscillation, whatever its phase.
const SQUARES: usize = 3;

/// What is known of the fastest motion of each lane.
pub(super) struct Unseen<V: Real<Plain = V, Lane = f64>, const N: usize> {
    along: Along<V>,
    /// The direction in which the states move fastest.
    direction: [V; N],
    /// The longest step [s]; 0 where errors are seen.
    pub longest: V,
    /// In how many of them a step is left alone.
    left_alone: V,
}

impl<V: Real<Plain = V, Lane = f64>, const N: usize> Unseen<V, N> {
    pub fn new<R: Real<Plain = V>>(stepper: &Stepper<R, N>) -> Self {
        let along = Along::new(&stepper.harmonics, &stepper.terms);
        Self { along, direction: [V::zero(); N], longest: V::zero(), left_alone: V::splat(TURN) }
    }

    /// Steps up to which nothing has to be done [s].
    #[inline(always)]
    fn stable(&self) -> V {
        self.longest * self.left_alone
    }

    /// Forgets the past of one lane.
    pub fn forget(&mut self, lane: usize) {
        self.longest.set(lane, 0.0);
        self.left_alone.set(lane, TURN);
    }

    /// The longest step of the given lanes.
    #[inline(always)]
    fn look<R: Real<Plain = V, Mask = V::Mask>, M: Model<N>>(&mut self, lanes: V::Mask, stepper: &Stepper<R, N>) {
        let used = stepper.used::<M>();
        let unknown = lanes & self.longest.le(V::zero());
        for index in 0..used {
            let sign = if index % 2 == 0 { 1.0 } else { -1.0 };
            let first = V::splat(sign * stepper.scales[index]);
            self.direction[index] = V::select(unknown, first, self.direction[index]);
        }
        let size = |direction: &[V; N]| {
            let mut sum = V::splat(f64::MIN_POSITIVE);
            for index in 0..used {
                let scaled = direction[index] * V::splat(1.0 / stepper.scales[index]);
                sum = scaled.mul_add(scaled, sum);
            }
            sum
        };
        let (held, state) = (self.along.hold(&stepper.drive()), plain(&stepper.state));
        let mut direction = self.direction;
        let mut growth = V::zero();
        for _ in 0..SQUARES {
            let before = size(&direction);
            let once = held.change::<M, N>((stepper.t, V::zero()), &state, &direction);
            direction = held.change::<M, N>((stepper.t, V::zero()), &state, &once);
            let after = size(&direction);
            growth = after / before;
            let shrink = V::splat(1.0) / after.sqrt();
            for number in &mut direction {
                *number = *number * shrink;
            }
        }
        let longest = V::splat(TURN) / growth.sqrt().sqrt();
        let longest = V::select(growth.le(V::splat(f64::MAX)), longest, V::splat(f64::INFINITY));
        self.longest = V::select(lanes, longest, self.longest);
        for (own, found) in self.direction.iter_mut().zip(direction) {
            *own = V::select(lanes, found, *own);
        }
    }
}

impl<P: Path, M: Model<N>, T: Method, const N: usize> Advance<'_, P, M, T, N> {
    /// Holds the next step down where derivatives are all that could tell that it is too long.
    #[inline(always)]
    pub(super) fn hold_unseen(&mut self, accepted: <P::Lanes as Real>::Mask, error: Plain<P>) {
        let Some(unseen) = &mut self.unseen else { return };
        let hidden = accepted & error.lt(Plain::<P>::splat(UNSEEN));
        let seen = accepted & !hidden;
        unseen.longest = Plain::<P>::select(seen, Plain::<P>::zero(), unseen.longest);
        unseen.left_alone = Plain::<P>::select(seen, Plain::<P>::splat(STABLE), unseen.left_alone);
        let lanes = hidden & unseen.stable().lt(self.step);
        if lanes.any() {
            P::Lanes::apart(HoldUnseen { lanes: self, held: lanes });
        }
    }
}

struct HoldUnseen<'b, 'a, P: Path, M: Model<N>, T: Method, const N: usize> {
    lanes: &'b mut Advance<'a, P, M, T, N>,
    held: <P::Lanes as Real>::Mask,
}

impl<P: Path, M: Model<N>, T: Method, const N: usize> Task for HoldUnseen<'_, '_, P, M, T, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { lanes, held } = self;
        if let Some(unseen) = &mut lanes.unseen {
            unseen.look::<P::Lanes, M>(held, &lanes.stepper);
            let held = held & unseen.stable().lt(lanes.step);
            lanes.step = Plain::<P>::select(held, lanes.step.min(unseen.longest), lanes.step);
        }
    }
}
