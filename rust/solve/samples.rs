//! The samples of one row, at the times of the user's grid and of the metrics' probes.

use super::sampling::Sampled;
use crate::model::Signal;
use crate::real::Scalar;
use std::sync::Arc;

/// When a row is sampled, and what its samples hold.
#[derive(Clone)]
pub struct Wanted<S> {
    /// Times at which the user wants samples, ascending.
    pub grid: Arc<[f64]>,
    /// Times at which metrics look at the motion, ascending.
    pub probes: Arc<[S]>,
    /// What is kept at both.
    pub sampled: Arc<Sampled>,
}

/// Memory that goes from row to row.
pub type Room<S> = [Vec<S>; 2];

/// Samples so far.
pub struct Samples<S> {
    wanted: Wanted<S>,
    /// Signals at the times of the grid and of the probes.
    kept: Room<S>,
    /// How many of each have been passed.
    taken: [usize; 2],
    /// Which of them the last one was.
    passed: usize,
    /// The next time of each; infinity when no more.
    due: [S; 2],
}

impl<S: Scalar> Samples<S> {
    /// None so far.
    pub fn new(wanted: Wanted<S>, mut room: Room<S>) -> Self {
        for (own, count) in room.iter_mut().zip([wanted.grid.len(), wanted.probes.len()]) {
            own.clear();
            own.reserve_exact(count * wanted.sampled.signals().len());
        }
        let mut samples = Self { wanted, kept: room, taken: [0; 2], passed: 0, due: [S::zero(); 2] };
        samples.due = [samples.due_on(0), samples.due_on(1)];
        samples
    }

    /// When the next sample is due; infinity when no more.
    #[inline(always)]
    pub fn due(&self) -> S {
        let [grid, probe] = self.due;
        probe.min(grid)
    }

    /// Goes on to the sample after the next one; when that is due.
    #[inline(always)]
    pub fn pass(&mut self) -> S {
        let [grid, probe] = self.due;
        self.passed = usize::from(probe.plain() < grid.plain());
        self.taken[self.passed] += 1;
        self.due[self.passed] = self.due_on(self.passed);
        self.due()
    }

    /// Takes the signals of the sample passed last, which `value` gives by their places.
    #[inline(always)]
    pub fn push(&mut self, value: impl Fn(usize) -> S) {
        let (kept, width) = (&mut self.kept[self.passed], self.wanted.sampled.signals().len());
        // Room was made in advance: lanes that call for memory keep nothing in registers meanwhile.
        if kept.len() + width <= kept.capacity() {
            (0..width).for_each(|place| kept.push(value(place)));
        }
    }

    /// A signal at the times of the grid so far.
    pub fn on_grid(&self, signal: Signal) -> impl Iterator<Item = S> + '_ {
        self.column(0, signal)
    }

    /// A signal at the probes so far.
    pub fn probed(&self, signal: Signal) -> impl Iterator<Item = S> + '_ {
        self.column(1, signal)
    }

    /// The times of the probes.
    pub fn probes(&self) -> impl Iterator<Item = f64> + '_ {
        self.wanted.probes.iter().map(|time| time.plain())
    }

    /// The memory, for another row.
    pub fn into_room(self) -> Room<S> {
        self.kept
    }

    #[inline(always)]
    fn due_on(&self, which: usize) -> S {
        let place = self.taken[which];
        let time = match which {
            0 => self.wanted.grid.get(place).map(|&time| S::splat(time)),
            _ => self.wanted.probes.get(place).copied(),
        };
        time.unwrap_or(S::splat(f64::INFINITY))
    }

    fn column(&self, which: usize, signal: Signal) -> impl Iterator<Item = S> + '_ {
        let signals = self.wanted.sampled.signals();
        let place = signals.iter().position(|own| *own == signal).expect("samples hold the signal");
        self.kept[which].iter().copied().skip(place).step_by(signals.len())
    }
}
