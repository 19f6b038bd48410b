//! All metrics of one finished row.

use super::catalogue::{Metric, ModePart, Phase};
use super::crossings::{Wanted, crossing};
use super::mode::{self, Mode};
use super::orders::amplitudes;
use super::steady::{Steady, steady};
use super::{energy, local_ratio};
use crate::model::{Layout, Signal};
use crate::real::Scalar;
use crate::solve::{Integral, Mark, Retrace, Seat};

const RISE_LEVELS: (f64, f64) = (0.05, 0.95);
const HALF: f64 = 0.5;
/// A mean speed up to this share of the largest one plus [`CRAWL`] is rounding: the shaft stands still.
const STANDING: f64 = 1e-6;
/// Motor speed below which relative accuracy is not asked for [rad/s].
const CRAWL: f64 = 0.1;

/// Share of a mean square that rounding leaves of the difference to the square of the mean.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// A finished row on its way to numbers.
pub struct Reduction<'a, S, const N: usize> {
    layout: &'a Layout,
    seat: &'a Seat<S, N>,
    retrace: &'a mut dyn Retrace<S, N>,
    end: (f64, [S; N]),
    steady: Option<Steady<S>>,
    modes: [Option<Mode>; 2],
}

/// A number whose derivative is not known.
fn without_derivative<S: Scalar>(value: f64) -> S {
    S::splat(value).with_tangent(f64::NAN)
}

/// From one time to another [s]; NaN where it comes before: a speed that goes up and down has no rise and no fall.
fn span<S: Scalar>(from: S, to: S) -> S {
    if to.plain() < from.plain() { S::splat(f64::NAN) } else { to - from }
}

/// Root of a mean square; 0, and so its derivative, where rest or rounding leaves nothing of it.
fn root_of_mean<S: Scalar>(square: S) -> S {
    if square.plain() <= 0.0 { S::zero() } else { square.sqrt() }
}

impl<'a, S: Scalar, const N: usize> Reduction<'a, S, N> {
    /// For a row that ended at a time in a state.
    pub fn new(
        layout: &'a Layout,
        seat: &'a Seat<S, N>,
        retrace: &'a mut dyn Retrace<S, N>,
        t: f64,
        state: [S; N],
    ) -> Self {
        Self { layout, seat, retrace, end: (t, state), steady: None, modes: [None; 2] }
    }

    /// The metrics' values, in their order.
    pub fn values(&mut self, metrics: &[Metric], out: &mut [S]) {
        for (metric, value) in metrics.iter().zip(out.iter_mut()) {
            if !matches!(metric, Metric::Order(..)) {
                *value = self.value(*metric);
            }
        }
        for signal in [Signal::Te, Signal::OmegaL] {
            self.orders(signal, metrics, out);
        }
    }

    fn value(&mut self, metric: Metric) -> S {
        match metric {
            Metric::SteadySpeed => self.steady().omega_m,
            Metric::RiseTime(signal) => span(self.rise(signal, RISE_LEVELS.0), self.rise(signal, RISE_LEVELS.1)),
            Metric::DeadTime => self.rise(Signal::OmegaM, RISE_LEVELS.0) - self.seat.moment_of(Mark::On),
            Metric::RiseShape => {
                let half = self.rise(Signal::OmegaM, HALF);
                span(self.rise(Signal::OmegaM, RISE_LEVELS.0), half)
                    / span(half, self.rise(Signal::OmegaM, RISE_LEVELS.1))
            }
            Metric::StopTime(signal) => span(self.fall(signal, RISE_LEVELS.1), self.fall(signal, RISE_LEVELS.0)),
            Metric::StopShape => {
                let half = self.fall(Signal::OmegaM, HALF);
                span(self.fall(Signal::OmegaM, RISE_LEVELS.1), half)
                    / span(half, self.fall(Signal::OmegaM, RISE_LEVELS.0))
            }
            Metric::PeakWindup
            | Metric::InitialTePeak
            | Metric::TePeak(_)
            | Metric::TePeakToPeak(_)
            | Metric::SpeedRipple => {
                metric.extremes().iter().fold(S::zero(), |sum, extreme| sum + extreme.value(self.seat))
            }
            Metric::TeMean(phase) => self.mean(Integral::Te, phase),
            Metric::TeRms(phase) => self.deviation(Integral::Te, Integral::TeSquare, phase),
            Metric::SpeedRippleRms => self.deviation(Integral::OmegaL, Integral::OmegaLSquare, Phase::Run),
            Metric::Order(..) => S::splat(f64::NAN),
            Metric::Mode(part, phase) => without_derivative(self.mode(part, phase)),
            Metric::ResidualRing => self.residual_ring(),
            Metric::EnergyIn(phase) => {
                self.integral(Integral::MotorPower, phase) - self.integral(Integral::LoadPower, phase)
            }
            Metric::Loss(damper, phase) => energy::lost_in(damper, self.seat, phase.marks()),
            Metric::EnergyResidual => {
                without_derivative(energy::residual(self.seat, self.retrace, (self.end.0, &self.end.1)))
            }
            Metric::LossInTerms => energy::lost_in_terms(self.seat, self.retrace, (self.end.0, &self.end.1)),
            Metric::TimeOutsideRange => without_derivative(self.seat.outside),
            Metric::UpsilonMin => local_ratio::smallest(self.layout, self.seat, self.retrace),
        }
    }

    fn steady(&mut self) -> Steady<S> {
        *self.steady.get_or_insert_with(|| steady(self.seat, self.retrace))
    }

    fn window(&self, phase: Phase) -> (S, S) {
        let (from, to) = phase.marks();
        (self.seat.moment_of(from), self.seat.moment_of(to))
    }

    fn integral(&self, which: Integral, phase: Phase) -> S {
        let (from, to) = phase.marks();
        self.seat.integral(from, to, which)
    }

    fn mean(&self, which: Integral, phase: Phase) -> S {
        let (from, to) = self.window(phase);
        self.integral(which, phase) / (to - from)
    }

    fn deviation(&self, value: Integral, square: Integral, phase: Phase) -> S {
        let (mean, square) = (self.mean(value, phase), self.mean(square, phase));
        let spread = square - mean * mean;
        root_of_mean(if spread.plain() <= ROUNDING * square.plain() { S::zero() } else { spread })
    }

    /// Time of the first upward crossing of a share of the signal's own steady mean.
    fn rise(&mut self, signal: Signal, share: f64) -> S {
        let mean = self.steady_mean(signal);
        let window = (self.seat.time_of(Mark::On), self.seat.time_of(Mark::Off));
        crossing(
            self.seat,
            self.retrace,
            signal,
            mean.plain().signum(),
            S::splat(share) * mean.abs(),
            window,
            Wanted::FirstUp,
        )
    }

    /// Time of the downward crossing after the stop: the last one for the lower level, else the first.
    fn fall(&mut self, signal: Signal, share: f64) -> S {
        let mean = self.steady_mean(signal);
        let window = (self.seat.time_of(Mark::Off), self.seat.time_of(Mark::End));
        let wanted = if share == RISE_LEVELS.0 { Wanted::LastDown } else { Wanted::FirstDown };
        crossing(self.seat, self.retrace, signal, mean.plain().signum(), S::splat(share) * mean.abs(), window, wanted)
    }

    /// Mean speed of the steady run; NaN where the shaft stands still.
    fn steady_mean(&mut self, signal: Signal) -> S {
        let Steady { omega_m, omega_l, fastest: [motor, load], .. } = self.steady();
        let gear = self.seat.assignment.row.constants.inverse_ratio.plain().abs();
        let (mean, size) =
            if signal == Signal::OmegaM { (omega_m, motor + CRAWL) } else { (omega_l, load + CRAWL * gear) };
        if mean.plain().abs() > STANDING * size { mean } else { S::splat(f64::NAN) }
    }

    fn orders(&mut self, signal: Signal, metrics: &[Metric], out: &mut [S]) {
        let order_of = |metric: &Metric| match metric {
            Metric::Order(of, order) if *of == signal => Some(*order),
            _ => None,
        };
        let wanted: Vec<f64> = metrics.iter().filter_map(order_of).collect();
        if wanted.is_empty() {
            return;
        }
        let steady = self.steady();
        let found = amplitudes(self.seat, signal, &wanted, &self.layout.orders, &steady);
        let places = metrics.iter().zip(out).filter(|(metric, _)| order_of(metric).is_some());
        for ((_, place), value) in places.zip(found) {
            *place = value;
        }
    }

    fn mode(&mut self, part: ModePart, phase: Phase) -> f64 {
        let event = usize::from(phase == Phase::Stop);
        let found = self.modes[event].unwrap_or_else(|| {
            let (from, end) = if event == 0 { (Mark::On, Mark::Off) } else { (Mark::Off, Mark::End) };
            let from = self.seat.time_of(from);
            let window = mode::window(&self.seat.assignment.row).plain();
            let to = self.seat.time_of(end).min(from + window);
            mode::mode(self.layout, self.seat, from, to)
        });
        self.modes[event] = Some(found);
        match part {
            ModePart::Frequency => found.frequency,
            ModePart::Decay => found.decay,
            ModePart::Amplitude => found.amplitude,
        }
    }

    fn residual_ring(&self) -> S {
        let width = S::splat(self.seat.time_of(Mark::RingEnd) - self.seat.time_of(Mark::RingStart));
        let square =
            if self.seat.assignment.program.ring_on_load { Integral::OmegaLSquare } else { Integral::WindupRateSquare };
        root_of_mean(self.seat.integral(Mark::RingStart, Mark::RingEnd, square) / width)
    }
}
