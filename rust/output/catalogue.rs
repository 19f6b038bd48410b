//! The metrics by name: the one table of what can be computed, in which unit, and what it needs.

use super::energy::Damper;
use crate::model::{Layout, Signal};
use crate::solve::{Demand, Extreme, Mark, Watched};
use std::sync::LazyLock;

/// A part of the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// From the start of the motion to the run.
    Start,
    /// The last whole revolutions of the set speed before the stop, whatever speed the drive reaches.
    Run,
    /// From the start of the stop to the end.
    Stop,
    /// From the start of the motion to the end.
    All,
}

impl Phase {
    /// The marks at both ends.
    pub fn marks(self) -> (Mark, Mark) {
        match self {
            Self::Start => (Mark::On, Mark::Run),
            Self::Run => (Mark::Run, Mark::Off),
            Self::Stop => (Mark::Off, Mark::End),
            Self::All => (Mark::On, Mark::End),
        }
    }
}

/// What is read off the fitted mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModePart {
    /// Frequency [Hz].
    Frequency,
    /// Decay rate [1/s].
    Decay,
    /// Amplitude of the output speed at the event [rad/s].
    Amplitude,
}

/// One number per row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Metric {
    /// Mean motor speed of the steady run.
    SteadySpeed,
    /// 5 to 95 % of the steady speed.
    RiseTime(Signal),
    /// From the start of the motion to 5 % of the steady speed.
    DeadTime,
    /// (5 to 50 %) / (50 to 95 %).
    RiseShape,
    /// 95 to 5 % of the steady speed.
    StopTime(Signal),
    /// (95 to 50 %) / (50 to 5 %).
    StopShape,
    /// Largest windup, of either sign.
    PeakWindup,
    /// Largest windup in the first half second.
    InitialTePeak,
    /// Mean transmission error.
    TeMean(Phase),
    /// Largest transmission error, of either sign.
    TePeak(Phase),
    /// Transmission error, peak to peak.
    TePeakToPeak(Phase),
    /// Transmission error, rms about the mean.
    TeRms(Phase),
    /// Load speed in the run phase, peak to peak.
    SpeedRipple,
    /// Load speed in the run phase, rms about the mean.
    SpeedRippleRms,
    /// Amplitude at an order of the motor revolution.
    Order(Signal, f64),
    /// The torsional mode after the start (`Start`) or after the stop (`Stop`).
    Mode(ModePart, Phase),
    /// Ring that is left a while after the stop.
    ResidualRing,
    /// Energy put in by motor and load.
    EnergyIn(Phase),
    /// Energy lost in one damper.
    Loss(Damper, Phase),
    /// Energy lost in terms.
    LossInTerms,
    /// What the energy balance lacks.
    EnergyResidual,
    /// Time outside the range of the fitted spring.
    TimeOutsideRange,
    /// Smallest local ratio over a revolution.
    UpsilonMin,
}

/// A metric as users see it.
#[derive(Clone, Debug)]
pub struct MetricEntry {
    /// Name.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// One sentence.
    pub meaning: String,
    /// What is computed.
    pub metric: Metric,
}

fn entry(name: impl Into<String>, unit: &'static str, meaning: impl Into<String>, metric: Metric) -> MetricEntry {
    MetricEntry { name: name.into(), unit, meaning: meaning.into(), metric }
}

impl Metric {
    /// All metrics with fixed names.
    pub fn catalogue() -> &'static [MetricEntry] {
        static CATALOGUE: LazyLock<Vec<MetricEntry>> = LazyLock::new(Metric::table);
        &CATALOGUE
    }

    fn table() -> Vec<MetricEntry> {
        use Signal::{OmegaL, OmegaM};
        let mut table = vec![
            entry(
                "steady_speed",
                "rad/s",
                "mean motor speed over the last whole revolutions before the stop",
                Self::SteadySpeed,
            ),
            entry("rise_time", "s", "5 to 95 % of the steady motor speed", Self::RiseTime(OmegaM)),
            entry("rise_time_load", "s", "5 to 95 % of the steady load speed", Self::RiseTime(OmegaL)),
            entry("dead_time", "s", "from the start of the motion to 5 % of the steady motor speed", Self::DeadTime),
            entry(
                "rise_shape",
                "1",
                "time 5 to 50 % over time 50 to 95 %: 0.28 exponential, 1 straight",
                Self::RiseShape,
            ),
            entry("stop_time", "s", "95 to 5 % of the steady motor speed", Self::StopTime(OmegaM)),
            entry("stop_time_load", "s", "95 to 5 % of the steady load speed", Self::StopTime(OmegaL)),
            entry(
                "stop_shape",
                "1",
                "time 95 to 50 % over time 50 to 5 %: 0.28 exponential, 1 straight",
                Self::StopShape,
            ),
            entry("peak_windup", "rad", "largest windup of either sign", Self::PeakWindup),
            entry(
                "initial_te_peak",
                "rad",
                "largest windup in the first half second of the motion",
                Self::InitialTePeak,
            ),
        ];
        let phases = [
            (Phase::Run, "", "in the run phase"),
            (Phase::Start, "_start", "in the start"),
            (Phase::Stop, "_stop", "in the stop"),
        ];
        for (phase, suffix, when) in phases {
            table.extend([
                entry(
                    format!("te_mean{suffix}"),
                    "rad",
                    format!("mean transmission error {when}"),
                    Self::TeMean(phase),
                ),
                entry(
                    format!("te_peak{suffix}"),
                    "rad",
                    format!("largest transmission error of either sign {when}"),
                    Self::TePeak(phase),
                ),
                entry(
                    format!("te_pp{suffix}"),
                    "rad",
                    format!("transmission error peak to peak {when}"),
                    Self::TePeakToPeak(phase),
                ),
                entry(
                    format!("te_rms{suffix}"),
                    "rad",
                    format!("transmission error rms about its mean {when}"),
                    Self::TeRms(phase),
                ),
            ]);
        }
        table.extend([
            entry("speed_ripple", "rad/s", "load speed peak to peak in the run phase", Self::SpeedRipple),
            entry("speed_ripple_rms", "rad/s", "load speed rms about its mean in the run phase", Self::SpeedRippleRms),
        ]);
        for (phase, event) in [(Phase::Start, "start"), (Phase::Stop, "stop")] {
            table.extend([
                entry(
                    format!("mode_frequency_{event}"),
                    "Hz",
                    format!(
                        "frequency of the torsional mode about the mean windup after the {event}, NaN where no single damped wave fits"
                    ),
                    Self::Mode(ModePart::Frequency, phase),
                ),
                entry(
                    format!("mode_decay_{event}"),
                    "1/s",
                    format!("decay rate of the torsional mode after the {event}, NaN where no single damped wave fits"),
                    Self::Mode(ModePart::Decay, phase),
                ),
                entry(
                    format!("mode_amplitude_{event}"),
                    "rad/s",
                    format!(
                        "output-speed amplitude of the torsional mode at the {event}, NaN where no single damped wave fits"
                    ),
                    Self::Mode(ModePart::Amplitude, phase),
                ),
            ]);
        }
        table.push(entry("residual_ring", "rad/s", "rms of the ring left a while after the stop", Self::ResidualRing));
        for (phase, suffix, when) in [
            (Phase::All, "", ""),
            (Phase::Start, "_start", " in the start"),
            (Phase::Run, "_run", " in the run phase"),
            (Phase::Stop, "_stop", " in the stop"),
        ] {
            table.extend([
                entry(
                    format!("energy_in{suffix}"),
                    "J",
                    format!("energy put in by motor and load{when}"),
                    Self::EnergyIn(phase),
                ),
                entry(
                    format!("loss_motor{suffix}"),
                    "J",
                    format!("energy lost in B_m{when}"),
                    Self::Loss(Damper::Motor, phase),
                ),
                entry(
                    format!("loss_wave_generator{suffix}"),
                    "J",
                    format!("energy lost in B_ml{when}"),
                    Self::Loss(Damper::WaveGenerator, phase),
                ),
                entry(
                    format!("loss_load{suffix}"),
                    "J",
                    format!("energy lost in B_l{when}"),
                    Self::Loss(Damper::Load, phase),
                ),
                entry(
                    format!("loss_mesh{suffix}"),
                    "J",
                    format!("energy lost in B_sp{when}"),
                    Self::Loss(Damper::Mesh, phase),
                ),
            ]);
        }
        table.extend([
            entry("loss_terms", "J", "energy lost in terms from the beginning to the end; below 0 where they lessen the drag of B_m and B_ml", Self::LossInTerms),
            entry(
                "energy_residual",
                "1",
                "what the energy balance lacks, as a share of the energy exchanged",
                Self::EnergyResidual,
            ),
            entry(
                "time_outside_range",
                "s",
                "time with the windup outside the fitted range of the spring",
                Self::TimeOutsideRange,
            ),
            entry(
                "upsilon_min",
                "1",
                "smallest local ratio of the rigid gear over a period of the kinematic error, with the load at the stop; a reversal with te_hysteresis is left out",
                Self::UpsilonMin,
            ),
        ]);
        table
    }

    /// The metric of a name; `order` reads the label after `order_` and `speed_order_`.
    pub fn from_name(name: &str, order: impl Fn(&str) -> Option<f64>) -> Option<MetricEntry> {
        if let Some(found) = Self::catalogue().iter().find(|entry| entry.name == name) {
            return Some(found.clone());
        }
        let (signal, unit, label) = match (name.strip_prefix("order_"), name.strip_prefix("speed_order_")) {
            (Some(label), _) => (Signal::Te, "rad", label),
            (_, Some(label)) => (Signal::OmegaL, "rad/s", label),
            _ => return None,
        };
        let value = order(label).filter(|order| *order > 0.0)?;
        Some(entry(
            name,
            unit,
            format!(
                "amplitude at order {label} over the last whole motor revolutions before the stop that last half a second"
            ),
            Self::Order(signal, value),
        ))
    }

    /// Adds what the metric needs to what is asked of the integration.
    pub fn require(self, layout: &Layout, demand: &mut Demand) {
        for extreme in self.extremes() {
            demand.watched[extreme.signal as usize] = true;
            demand.extremes.push(extreme);
        }
        match self {
            Self::TeMean(_) | Self::TeRms(_) => demand.integrands.te = true,
            Self::SpeedRippleRms => demand.integrands.speed = true,
            Self::ResidualRing => {
                demand.integrands.ring = true;
                demand.integrands.speed = true;
            }
            Self::EnergyIn(_) | Self::Loss(..) | Self::LossInTerms | Self::EnergyResidual => {
                (demand.integrands.energy, demand.integrands.ring, demand.integrands.speed) = (true, true, true);
            }
            Self::TimeOutsideRange => {
                demand.watched[Watched::Windup as usize] = true;
                demand.outside = true;
            }
            Self::PeakWindup
            | Self::InitialTePeak
            | Self::TePeak(_)
            | Self::TePeakToPeak(_)
            | Self::SpeedRipple
            | Self::UpsilonMin => {}
            Self::Mode(..) => demand.sample(&[Signal::ThetaM, Signal::WindupRate, Signal::Windup], layout),
            Self::SteadySpeed
            | Self::RiseTime(_)
            | Self::DeadTime
            | Self::RiseShape
            | Self::StopTime(_)
            | Self::StopShape => demand.record = true,
            Self::Order(signal, _) => {
                demand.record = true;
                demand.sample(&[Signal::ThetaM, signal], layout);
            }
        }
    }

    /// The extremes whose sum the metric is; none where it is something else.
    pub fn extremes(self) -> Vec<Extreme> {
        match self {
            Self::PeakWindup => vec![Extreme::farthest(Watched::Windup, (Mark::Begin, Mark::End))],
            Self::InitialTePeak => vec![Extreme::farthest(Watched::Windup, (Mark::On, Mark::Settled))],
            Self::TePeak(phase) => vec![Extreme::farthest(Watched::Te, phase.marks())],
            Self::TePeakToPeak(phase) => Extreme::both_ends(Watched::Te, phase.marks()).into(),
            Self::SpeedRipple => Extreme::both_ends(Watched::OmegaL, Phase::Run.marks()).into(),
            _ => Vec::new(),
        }
    }

    /// Whether the metric looks at the motion after an event.
    pub fn looks_at_mode(self, event: Phase) -> bool {
        matches!(self, Self::Mode(_, phase) if phase == event)
    }
}
