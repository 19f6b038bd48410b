//! Extrema while integrating: values at step ends in lanes, and the few steps that may hold a larger one inside.

use super::record::Record;
use crate::model::{Constants, Rates};
use crate::real::{Mask, Real};

/// A watched signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Watched {
    /// Windup.
    Windup,
    /// Transmission error.
    Te,
    /// Load speed.
    OmegaL,
}

/// How many signals can be watched.
pub const WATCHED: usize = 3;

/// Which signals are watched, by position.
pub type WatchList = [bool; WATCHED];

/// The cubic through the ends of a step is trusted to this share of its height above them.
const DOUBT: f64 = 0.25;

/// A step that may hold an extremum inside.
#[derive(Clone, Copy, Debug)]
pub struct Candidate<S, const N: usize> {
    /// Where the step starts.
    pub start: Record<S, N>,
    /// Its length [s].
    pub step: f64,
    /// The signal.
    pub signal: Watched,
    /// +1 for a maximum, -1 for a minimum.
    pub sign: f64,
    /// Highest value, times `sign`, that the step may hold.
    pub at_most: f64,
    /// Whether a closer look is asked for.
    pub asked: bool,
    /// What the closer look found.
    pub peak: Option<S>,
}

/// Extrema of one signal at the ends of the steps of one window.
#[derive(Clone, Copy, Debug)]
pub struct Range<S> {
    /// Smallest value.
    pub low: S,
    /// Largest value.
    pub high: S,
}

/// A signal with its rate.
#[derive(Clone, Copy)]
struct Reading<R> {
    value: R,
    rate: R,
}

impl<R: Real> Reading<R> {
    #[inline(always)]
    fn plain(self) -> Reading<R::Plain> {
        Reading { value: self.value.plain(), rate: self.rate.plain() }
    }
}

/// The watched signals of all lanes.
pub struct Watch<R: Real> {
    list: WatchList,
    now: [Reading<R>; WATCHED],
    low: [R; WATCHED],
    high: [R; WATCHED],
    outside: R::Plain,
}

impl<R: Real> Watch<R> {
    pub fn new(list: WatchList) -> Self {
        let zero = R::zero();
        let nothing = Reading { value: zero, rate: zero };
        Self { list, now: [nothing; WATCHED], low: [zero; WATCHED], high: [zero; WATCHED], outside: R::Plain::zero() }
    }

    #[inline(always)]
    fn read<const N: usize>(signal: usize, rates: &Rates<R, N>, c: &Constants<R>) -> Reading<R> {
        match signal {
            0 => Reading { value: rates.windup, rate: rates.windup_rate },
            1 => Reading { value: rates.te, rate: c.inverse_ratio.mul_add(rates.slope[0], -rates.omega_l) },
            _ => Reading { value: rates.omega_l, rate: rates.alpha_l },
        }
    }

    /// Takes rates as the beginning of the next step in the given lanes.
    #[inline(always)]
    pub fn begin<const N: usize>(&mut self, lanes: R::Mask, rates: &Rates<R, N>, c: &Constants<R>) {
        for signal in 0..WATCHED {
            if self.list[signal] {
                let new = Self::read(signal, rates, c);
                let now = &mut self.now[signal];
                now.value = R::select(lanes, new.value, now.value);
                now.rate = R::select(lanes, new.rate, now.rate);
            }
        }
    }

    /// Looks at an accepted step; `candidate(lanes, signal, sign, at_most)` is told of steps worth a closer look.
    #[inline(always)]
    pub fn step<const N: usize>(
        &mut self,
        accepted: R::Mask,
        step: R::Plain,
        rates: &Rates<R, N>,
        c: &Constants<R>,
        mut candidate: impl FnMut(u64, usize, f64, R::Plain),
    ) {
        for signal in 0..WATCHED {
            if !self.list[signal] {
                continue;
            }
            let end = Self::read(signal, rates, c);
            self.high[signal] = R::select(accepted, self.high[signal].max(end.value), self.high[signal]);
            self.low[signal] = R::select(accepted, self.low[signal].min(end.value), self.low[signal]);
            let (start, end) = (self.now[signal].plain(), end.plain());
            let (zero, doubt) = (R::Plain::zero(), R::Plain::splat(DOUBT));
            let (below, above) = (start.value.min(end.value), start.value.max(end.value));
            let turning = accepted & (start.rate * end.rate).lt(zero);
            if turning.any() {
                let lever = step * R::Plain::splat(0.5) / (start.rate - end.rate);
                let first = (start.rate * start.rate).mul_add(lever, start.value);
                let second = (end.rate * end.rate).mul_add(lever, end.value);
                let peak = first.max(second);
                let top = turning & zero.lt(start.rate);
                self.propose(top, signal, 1.0, (peak - above).mul_add(doubt, peak), &mut candidate);
                let dip = first.min(second);
                let bottom = turning & start.rate.lt(zero);
                self.propose(bottom, signal, -1.0, (below - dip).mul_add(doubt, -dip), &mut candidate);
            }
            let [low, high] = hull(start, end, step);
            let folded = accepted & !turning & (low.lt(below) | above.lt(high));
            if folded.any() {
                self.propose(folded, signal, 1.0, (high - above).mul_add(doubt, high), &mut candidate);
                self.propose(folded, signal, -1.0, (below - low).mul_add(doubt, -low), &mut candidate);
            }
        }
    }

    /// Names the lanes in which a step may hold more than has been seen.
    #[inline(always)]
    fn propose(
        &self,
        lanes: R::Mask,
        signal: usize,
        sign: f64,
        at_most: R::Plain,
        candidate: &mut impl FnMut(u64, usize, f64, R::Plain),
    ) {
        let seen = if sign > 0.0 { self.high[signal].plain() } else { -self.low[signal].plain() };
        let bits = (lanes & seen.lt(at_most)).to_bits();
        if bits != 0 {
            candidate(bits, signal, sign, at_most);
        }
    }

    /// Where a signal lies in the course of a step, at least and at most.
    #[inline(always)]
    pub(super) fn bounds<const N: usize>(
        &self,
        signal: Watched,
        step: R::Plain,
        rates: &Rates<R, N>,
        c: &Constants<R>,
    ) -> [R::Plain; 2] {
        let (start, end) = (self.now[signal as usize], Self::read(signal as usize, rates, c));
        let [low, high] = hull(start.plain(), end.plain(), step);
        let doubt = (high - low) * R::Plain::splat(DOUBT);
        [low - doubt, high + doubt]
    }

    /// Adds time spent outside the spring's range in the given lanes.
    #[inline(always)]
    pub(super) fn add_outside(&mut self, lanes: R::Mask, time: R::Plain) {
        self.outside = R::Plain::select(lanes, self.outside + time, self.outside);
    }

    /// The ranges of a lane since the last call; the next window starts here. `lag` is the derivative of the time
    /// at which one window gives way to the other.
    pub fn close_window(&mut self, lane: usize, lag: f64) -> [Range<R::Lane>; WATCHED] {
        std::array::from_fn(|signal| {
            let Reading { value, rate } = self.now[signal];
            let (value, rate) = (value.get(lane), rate.plain().get(lane));
            let value = value.with_tangent(rate.mul_add(lag, value.tangent()));
            let or_end = |extreme: R::Lane| if extreme.plain() == value.plain() { value } else { extreme };
            let range = Range { low: or_end(self.low[signal].get(lane)), high: or_end(self.high[signal].get(lane)) };
            self.low[signal].set(lane, value);
            self.high[signal].set(lane, value);
            range
        })
    }

    /// Time outside the spring's range of a lane [s].
    pub fn outside(&self, lane: usize) -> f64 {
        self.outside.get(lane)
    }

    /// Starts a lane anew.
    pub fn reset_lane(&mut self, lane: usize) {
        self.outside.set(lane, 0.0);
    }
}

/// The smallest and the largest control point of the cubic through the ends of a step, which lies between them.
#[inline(always)]
fn hull<V: Real>(start: Reading<V>, end: Reading<V>, step: V) -> [V; 2] {
    let lever = step * V::splat(1.0 / 3.0);
    let (first, second) = (start.rate.mul_add(lever, start.value), (-end.rate).mul_add(lever, end.value));
    let low = start.value.min(end.value).min(first.min(second));
    let high = start.value.max(end.value).max(first.max(second));
    [low, high]
}
