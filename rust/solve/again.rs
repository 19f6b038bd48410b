//! Steps of rows taken once more, as many at once as there are lanes, with the same bits as the first time.

use super::interpolant::ALL_STATES;
use super::record::{Dense, Record, lane_coefficients, value_at};
use super::seat::Seat;
use super::stepper::Stepper;
use super::watch::{Candidate, WATCHED};
use super::{Integrands, Method};
use crate::model::terms::Motion;
use crate::model::{Harmonics, Layout, Model, Row};
use crate::real::{Mask, Real, Task};
use std::marker::PhantomData;

/// Points of a step at which it is looked at before the refinement.
const LOOKS: usize = 6;
const REFINEMENTS: usize = 5;
/// Share of the step behind a peak at which the curvature there is found.
const BEHIND: f64 = 1e-4;

/// Lanes with one step each.
pub struct Again<R: Real, M, T, const N: usize> {
    stepper: Stepper<R, N>,
    step: R::Plain,
    methods: PhantomData<(M, T)>,
}

impl<R: Real, M: Model<N>, T: Method, const N: usize> Again<R, M, T, N> {
    /// For rows like this one.
    pub fn new(layout: &Layout, row: &Row<R::Lane>, harmonics: &Harmonics<R::Lane>) -> Self {
        Self {
            stepper: Stepper::new::<M, T>(layout, row, harmonics, Integrands::default(), [false; WATCHED]),
            step: R::Plain::splat(1.0),
            methods: PhantomData,
        }
    }

    /// Puts a step of a row into a lane.
    pub fn set_lane(
        &mut self,
        lane: usize,
        seat: &Seat<R::Lane, N>,
        (start, step): (&Record<R::Lane, N>, f64),
        shared: &Harmonics<R::Lane>,
    ) {
        let segment = seat.segment_before(start.t + 0.5 * step);
        seat.place(lane, &mut self.stepper, segment, (start.t, &start.state));
        let Stepper { directions, held, .. } = &mut self.stepper;
        for (lanes, &direction) in directions.iter_mut().zip(&start.branch.directions) {
            lanes.set(lane, R::Lane::splat(f64::from(direction)));
        }
        for (lanes, &piece) in held.iter_mut().flat_map(|pieces| pieces.iter_mut()).zip(&start.branch.pieces) {
            lanes.set(lane, f64::from(piece));
        }
        seat.load(lane, &mut self.stepper, shared);
        self.step.set(lane, step);
    }

    /// Puts a row's constants into all lanes.
    pub fn load(&mut self, seat: &Seat<R::Lane, N>, shared: &Harmonics<R::Lane>) {
        (0..R::LANES).for_each(|lane| seat.load(lane, &mut self.stepper, shared));
    }

    /// The slopes of the kinematic error at motor angles, all lanes being of one row.
    pub fn error_slopes(&self, speed: R::Lane, angles: &[f64], load_torque: R::Lane) -> Vec<f64> {
        R::apart(ErrorSlopes { stepper: &self.stepper, speed, angles, load_torque })
    }

    /// Takes the steps.
    pub fn take(&mut self) {
        R::apart(Steps::<R, M, T, N> { stepper: &mut self.stepper, step: self.step, methods: PhantomData });
    }

    /// The step of a lane as polynomials.
    pub fn dense(&self, lane: usize) -> Dense<R::Lane, N> {
        let coefficients = lane_coefficients(&self.stepper.polynomials, lane);
        Dense { t: self.stepper.t.get(lane), step: self.step.get(lane), coefficients }
    }

    /// The largest values, times their signs, inside steps that are candidates.
    pub fn peaks(&mut self, candidates: &[&Candidate<R::Lane, N>]) -> R {
        let mut wanted = Wanted::<R> { signals: [0; WATCHED], sign: R::Plain::splat(1.0) };
        for (lane, candidate) in candidates.iter().enumerate() {
            wanted.signals[candidate.signal as usize] |= 1 << lane;
            wanted.sign.set(lane, candidate.sign);
        }
        let (start, step) = (self.stepper.t, self.step);
        R::apart(Peaks::<R, M, N> { stepper: &mut self.stepper, start, step, wanted, model: PhantomData })
    }
}

/// The lanes in which each signal is wanted, and the signs by which the lanes are multiplied.
#[derive(Clone, Copy)]
struct Wanted<R: Real> {
    signals: [u64; WATCHED],
    sign: R::Plain,
}

struct Steps<'a, R: Real, M, T, const N: usize> {
    stepper: &'a mut Stepper<R, N>,
    step: R::Plain,
    methods: PhantomData<(M, T)>,
}

impl<R: Real, M: Model<N>, T: Method, const N: usize> Task for Steps<'_, R, M, T, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.stepper.refresh::<M>(every_lane::<R>());
        self.stepper.attempt::<M, T, true>(self.step);
        self.stepper.interpolate::<M, T>(self.step, ALL_STATES);
    }
}

struct ErrorSlopes<'a, R: Real, const N: usize> {
    stepper: &'a Stepper<R, N>,
    speed: R::Lane,
    angles: &'a [f64],
    load_torque: R::Lane,
}

impl<R: Real, const N: usize> Task for ErrorSlopes<'_, R, N> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn run(self) -> Vec<f64> {
        let Self { stepper, speed, angles, load_torque } = self;
        let mut slopes = Vec::with_capacity(angles.len());
        for part in angles.chunks(R::LANES) {
            let mut lanes = R::zero();
            for (lane, &angle) in part.iter().enumerate() {
                lanes.set(lane, R::Lane::splat(angle));
            }
            let motion = Motion::of_motor(lanes, R::every(speed), stepper.constants.inverse_ratio);
            let slope = stepper.kinematic_error(&motion, R::every(load_torque)).1.plain();
            slopes.extend((0..part.len()).map(|lane| slope.get(lane)));
        }
        slopes
    }
}

#[inline(always)]
fn every_lane<R: Real>() -> R::Mask {
    R::Mask::from_bits(u64::MAX >> (64 - R::LANES))
}

/// Looks on a grid, then at the vertices of parabolas through the three best points.
struct Peaks<'a, R: Real, M, const N: usize> {
    stepper: &'a mut Stepper<R, N>,
    start: R::Plain,
    step: R::Plain,
    wanted: Wanted<R>,
    model: PhantomData<M>,
}

/// A share of the step, and the value there.
type Point<R> = (<R as Real>::Plain, <R as Real>::Plain);

impl<R: Real, M: Model<N>, const N: usize> Peaks<'_, R, M, N> {
    /// The signals after a share of the step.
    #[inline(always)]
    fn look(&mut self, share: R) -> R {
        let Self { stepper, start, step, wanted, .. } = self;
        let t = share.mul_add(R::constant(*step), R::constant(*start));
        R::apart(Look::<R, M, N> { stepper, step: *step, share, t, wanted: *wanted, model: PhantomData })
    }

    /// The derivative at the peak itself, of which values tell half of the digits: where the rate of the signal is zero,
    /// by the secant through the best place and one behind it.
    #[inline(always)]
    fn tangent_at_peak(&mut self, best: R, place: R::Plain, points: &[Point<R>; 3]) -> R::Plain {
        let one = R::Plain::splat(1.0);
        let behind = place + R::Plain::splat(BEHIND);
        let tangent = self.look(R::constant(behind)).tangent();
        let rate = self.look(R::constant(place).with_tangent(one)).tangent() - best.tangent();
        let rate_behind = self.look(R::constant(behind).with_tangent(one)).tangent() - tangent;
        let bend = rate - rate_behind;
        let shift = rate / bend;
        let peak = shift.mul_add(R::Plain::splat(BEHIND), place);
        let inside = R::Plain::zero().lt(bend) & points[0].0.lt(peak) & peak.lt(points[2].0);
        R::Plain::select(inside, shift.mul_add(tangent - best.tangent(), best.tangent()), best.tangent())
    }
}

impl<R: Real, M: Model<N>, const N: usize> Task for Peaks<'_, R, M, N> {
    type Output = R;

    #[inline(always)]
    fn run(mut self) -> R {
        let mut looks = [R::zero(); LOOKS];
        for index in 0..LOOKS {
            looks[index] = self.look(R::constant(share_of::<R>(index)));
        }
        let (mut best, mut place, mut points) = (looks[0], share_of::<R>(0), around(&looks, 1));
        for index in 1..LOOKS {
            let better = best.plain().le(looks[index].plain());
            best = R::select(better, looks[index], best);
            place = R::Plain::select(better, share_of::<R>(index), place);
            points = select::<R>(better, around(&looks, index.min(LOOKS - 2)), points);
        }
        let mut active = every_lane::<R>();
        for _ in 0..REFINEMENTS {
            let share = vertex::<R>(&points);
            active = active & points[0].0.lt(share) & share.lt(points[2].0);
            active = active & R::Plain::zero().lt((share - points[1].0).abs());
            if !active.any() {
                break;
            }
            let value = self.look(R::constant(R::Plain::select(active, share, points[1].0)));
            let gain = (value - best).plain();
            let better = active & R::Plain::zero().lt(gain);
            best = R::select(better, value, best);
            place = R::Plain::select(better, share, place);
            active = active & (best.plain().abs() * R::Plain::splat(1e-15)).lt(gain.abs());
            points = narrowed::<R>(active, points, (share, value.plain()));
        }
        if R::DIFFERENTIATES { best.with_tangent(self.tangent_at_peak(best, place, &points)) } else { best }
    }
}

#[inline(always)]
fn share_of<R: Real>(index: usize) -> R::Plain {
    R::Plain::splat(index as f64 / (LOOKS - 1) as f64)
}

/// The looks before, at and after an index.
#[inline(always)]
fn around<R: Real>(looks: &[R; LOOKS], middle: usize) -> [Point<R>; 3] {
    let (left, right) = (middle - 1, middle + 1);
    [
        (share_of::<R>(left), looks[left].plain()),
        (share_of::<R>(middle), looks[middle].plain()),
        (share_of::<R>(right), looks[right].plain()),
    ]
}

/// What is wanted of the lanes is at an instant, a shaft sliding the way it moves.
struct Look<'a, R: Real, M, const N: usize> {
    stepper: &'a mut Stepper<R, N>,
    step: R::Plain,
    share: R,
    t: R,
    wanted: Wanted<R>,
    model: PhantomData<M>,
}

impl<R: Real, M: Model<N>, const N: usize> Task for Look<'_, R, M, N> {
    type Output = R;

    #[inline(always)]
    fn run(self) -> R {
        let Self { stepper, step, share, t, wanted, .. } = self;
        stepper.t = t.plain();
        for index in 0..N {
            stepper.state[index] = value_at(&stepper.polynomials[index], step, share);
        }
        stepper.slide::<M>(every_lane::<R>());
        let rates = stepper.rates::<M>(t, &stepper.state);
        let mut value = R::zero();
        value = R::select(R::Mask::from_bits(wanted.signals[0]), rates.windup, value);
        value = R::select(R::Mask::from_bits(wanted.signals[1]), rates.te, value);
        value = R::select(R::Mask::from_bits(wanted.signals[2]), rates.omega_l, value);
        value * R::constant(wanted.sign)
    }
}

#[inline(always)]
fn vertex<R: Real>(&[(a, fa), (b, fb), (c, fc)]: &[Point<R>; 3]) -> R::Plain {
    let left = (b - a) * (fb - fc);
    let right = (b - c) * (fb - fa);
    b - ((b - a) * left - (b - c) * right) / (R::Plain::splat(2.0) * (left - right))
}

/// Three points around the larger of the middle and a new point, in the given lanes.
#[inline(always)]
fn narrowed<R: Real>(lanes: R::Mask, points: [Point<R>; 3], new: Point<R>) -> [Point<R>; 3] {
    let [a, b, c] = points;
    let (before, above) = (new.0.lt(b.0), b.1.lt(new.1));
    let left = select::<R>(above, [a, new, b], [new, b, c]);
    let right = select::<R>(above, [b, new, c], [a, b, new]);
    select::<R>(lanes, select::<R>(before, left, right), points)
}

#[inline(always)]
fn select<R: Real>(lanes: R::Mask, yes: [Point<R>; 3], no: [Point<R>; 3]) -> [Point<R>; 3] {
    let mut chosen = no;
    for index in 0..3 {
        chosen[index].0 = R::Plain::select(lanes, yes[index].0, no[index].0);
        chosen[index].1 = R::Plain::select(lanes, yes[index].1, no[index].1);
    }
    chosen
}
