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

/// The cubic estimate of an extremum is trusted to this share of its height above the step's ends.
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

/// The watched signals of all lanes.
pub struct Watch<R: Real> {
    list: WatchList,
    now: [Reading<R>; WATCHED],
    low: [R; WATCHED],
    high: [R; WATCHED],
    /// Heights a step has to promise to become a candidate.
    low_bar: [R::Plain; WATCHED],
    high_bar: [R::Plain; WATCHED],
    outside: R::Plain,
}

impl<R: Real> Watch<R> {
    pub fn new(list: WatchList) -> Self {
        let zero = R::zero();
        let nothing = Reading { value: zero, rate: zero };
        Self {
            list,
            now: [nothing; WATCHED],
            low: [zero; WATCHED],
            high: [zero; WATCHED],
            low_bar: [R::Plain::zero(); WATCHED],
            high_bar: [R::Plain::zero(); WATCHED],
            outside: R::Plain::zero(),
        }
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
            let Reading { value: end, rate: end_rate } = Self::read(signal, rates, c);
            self.high[signal] = R::select(accepted, self.high[signal].max(end), self.high[signal]);
            self.low[signal] = R::select(accepted, self.low[signal].min(end), self.low[signal]);
            let (start, start_rate) = (self.now[signal].value.plain(), self.now[signal].rate.plain());
            let (end, end_rate) = (end.plain(), end_rate.plain());
            let zero = R::Plain::zero();
            let turning = accepted & (start_rate * end_rate).lt(zero);
            if turning.any() {
                let lever = step * R::Plain::splat(0.5) / (start_rate - end_rate);
                let first = (start_rate * start_rate).mul_add(lever, start);
                let second = (end_rate * end_rate).mul_add(lever, end);
                let top = turning & zero.lt(start_rate);
                let peak = first.max(second);
                let doubt = (peak - start.max(end)) * R::Plain::splat(DOUBT);
                self.propose(top, signal, 1.0, peak, doubt, &mut candidate);
                let bottom = turning & start_rate.lt(zero);
                let dip = first.min(second);
                let doubt = (start.min(end) - dip) * R::Plain::splat(DOUBT);
                self.propose(bottom, signal, -1.0, -dip, doubt, &mut candidate);
            }
        }
    }

    #[inline(always)]
    fn propose(
        &mut self,
        lanes: R::Mask,
        signal: usize,
        sign: f64,
        height: R::Plain,
        doubt: R::Plain,
        candidate: &mut impl FnMut(u64, usize, f64, R::Plain),
    ) {
        let (seen, bar) = if sign > 0.0 {
            (self.high[signal].plain(), &mut self.high_bar[signal])
        } else {
            (-self.low[signal].plain(), &mut self.low_bar[signal])
        };
        let at_most = height + doubt;
        let worth = lanes & bar.max(seen).lt(at_most);
        let bits = worth.to_bits();
        if bits != 0 {
            *bar = R::Plain::select(worth, bar.max(height - doubt), *bar);
            candidate(bits, signal, sign, at_most);
        }
    }

    /// Where a signal lies in the course of a step, at least and at most: between the control points of the cubic through
    /// the ends of the step, give or take a doubt.
    #[inline(always)]
    pub(super) fn bounds<const N: usize>(
        &self,
        signal: Watched,
        step: R::Plain,
        rates: &Rates<R, N>,
        c: &Constants<R>,
    ) -> [R::Plain; 2] {
        let Reading { value: start, rate: start_rate } = self.now[signal as usize];
        let Reading { value: end, rate: end_rate } = Self::read(signal as usize, rates, c);
        let lever = step * R::Plain::splat(1.0 / 3.0);
        let (start, end) = (start.plain(), end.plain());
        let (first, second) = (start_rate.plain().mul_add(lever, start), (-end_rate.plain()).mul_add(lever, end));
        let low = start.min(end).min(first.min(second));
        let high = start.max(end).max(first.max(second));
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
            self.low_bar[signal].set(lane, -value.plain());
            self.high_bar[signal].set(lane, value.plain());
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
