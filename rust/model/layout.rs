//! The parameters of a model: the one table from which every other room reads names, units and ranges.

use super::terms::Choice;
use super::{Base, Spring};

/// Who sets a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// A property of the drive: a column of the parameter array.
    Drive,
    /// A property of the scenario that a row may override.
    Scenario,
}

/// One parameter as users see it.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// Column name.
    pub name: String,
    /// Symbol in the equations.
    pub symbol: String,
    /// SI unit.
    pub unit: &'static str,
    /// Value for the SHF-25-120 unit.
    pub default: f64,
    /// Lower end of the plausible range.
    pub low: f64,
    /// Upper end of the plausible range.
    pub high: f64,
    /// One sentence.
    pub meaning: String,
    /// Where default and range come from.
    pub source: &'static str,
    /// Who sets it.
    pub group: Group,
}

/// Why a row cannot be simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BadParameter {
    /// Index of the offending parameter.
    pub index: usize,
}

/// Name, symbol, unit, default, plausible range (two numbers), allowed range, meaning, source.
type Entry = (&'static str, &'static str, &'static str, f64, f64, f64, (f64, f64), &'static str, &'static str);

const ANY: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);
const NOT_NEGATIVE: (f64, f64) = (0.0, f64::INFINITY);
const POSITIVE: (f64, f64) = (f64::MIN_POSITIVE, f64::INFINITY);
/// Motor angles whose sine is accurate [rad].
const ACCURATE: (f64, f64) = (-1e9, 1e9);

const CHOICE: &str = "chosen for the reconstructed model of the SHF-25-120 bench";
const CATALOGUE: &str = "maker's catalogue, size 25, ratio above 50";
const FIT: &str = "odd fit of the catalogue stiffness curve over +-67 N m";

const DRIVE: [Entry; 8] = [
    (
        "ratio",
        "i",
        "1",
        121.0,
        31.0,
        161.0,
        ANY,
        "reduction ratio, not 0; the output turns with the input",
        "article: SHF-25-120, flexspline fixed",
    ),
    (
        "J_m",
        "J_m",
        "kg m^2",
        3.0e-4,
        1.0e-4,
        1.0e-3,
        POSITIVE,
        "motor and wave-generator inertia",
        "wave generator 1.07e-4 from the catalogue, rest chosen",
    ),
    ("J_l", "J_l", "kg m^2", 0.5, 0.05, 12.0, POSITIVE, "load inertia at the output", CHOICE),
    ("B_m", "B_m", "N m s/rad", 6e-4, 1e-4, 3e-3, NOT_NEGATIVE, "viscous damping of the motor", CHOICE),
    ("B_l", "B_l", "N m s/rad", 0.5, 0.0, 5.0, NOT_NEGATIVE, "viscous damping of the load", CHOICE),
    ("B_ml", "B_ml", "N m s/rad", 6e-4, 1e-4, 3e-3, NOT_NEGATIVE, "damping between wave generator and cup", CHOICE),
    ("B_sp", "B_sp", "N m s/rad", 20.0, 2.0, 100.0, NOT_NEGATIVE, "damping of the mesh, on the windup rate", CHOICE),
    ("s", "s", "1", 0.0, 0.0, 1.0, NOT_NEGATIVE, "share of the load speed in the wave-generator slip", CHOICE),
];

const POLYNOMIAL: [Entry; 6] = [
    ("k1", "k_1", "N m/rad", 3.102e4, 1.0e4, 6.0e4, POSITIVE, "spring, linear coefficient", FIT),
    ("k2", "k_2", "N m/rad^2", 0.0, -1.0e6, 1.0e6, ANY, "spring, quadratic coefficient", FIT),
    ("k3", "k_3", "N m/rad^3", 1.3445e10, 0.0, 2.0e10, ANY, "spring, cubic coefficient", FIT),
    ("k4", "k_4", "N m/rad^4", 0.0, -1.0e12, 1.0e12, ANY, "spring, quartic coefficient", FIT),
    ("k5", "k_5", "N m/rad^5", -3.211e15, -4.0e15, 1.0e15, ANY, "spring, quintic coefficient", FIT),
    (
        "phi_max",
        "phi_max",
        "rad",
        1.465e-3,
        1.0e-3,
        3.3e-3,
        POSITIVE,
        "end of the fitted range, linear beyond; the stiffness has to be positive up to it",
        FIT,
    ),
];

const PIECEWISE: [Entry; 5] = [
    ("K1", "K_1", "N m/rad", 3.1e4, 1.0e4, 6.0e4, POSITIVE, "stiffness up to T1", CATALOGUE),
    ("K2", "K_2", "N m/rad", 5.0e4, 1.0e4, 8.0e4, POSITIVE, "stiffness between T1 and T2", CATALOGUE),
    ("K3", "K_3", "N m/rad", 5.7e4, 1.0e4, 9.0e4, POSITIVE, "stiffness beyond T2", CATALOGUE),
    ("T1", "T_1", "N m", 14.0, 1.0, 40.0, POSITIVE, "torque at which K1 ends", CATALOGUE),
    ("T2", "T_2", "N m", 48.0, 20.0, 120.0, POSITIVE, "torque at which K2 ends, above T1", CATALOGUE),
];

const SCENARIO: [Entry; 6] = [
    (
        "omega_set",
        "Omega_set",
        "rad/s",
        10.471975511965978,
        -63.0,
        63.0,
        ANY,
        "set speed of the motor",
        "article: 15 to 600 r/min",
    ),
    (
        "tau_load",
        "tau_load",
        "N m",
        0.0,
        -167.0,
        167.0,
        ANY,
        "load torque, positive resists",
        "catalogue: start-stop limit 167 N m",
    ),
    (
        "K_p",
        "K_p",
        "N m s/rad",
        0.05,
        0.0,
        1.0,
        NOT_NEGATIVE,
        "proportional gain of the speed controller, 0 or at least 1e-12",
        CHOICE,
    ),
    (
        "K_i",
        "K_i",
        "N m/rad",
        0.8,
        0.0,
        20.0,
        NOT_NEGATIVE,
        "integral gain of the speed controller, 0 or at least 1e-12",
        CHOICE,
    ),
    ("tau_max", "tau_max", "N m", 2.0, 0.1, 10.0, POSITIVE, "torque limit of the speed controller", CHOICE),
    ("theta_m0", "theta_m0", "rad", 0.0, -1.0e3, 1.0e3, ACCURATE, "motor angle at the start", CHOICE),
];

/// Position of J_l.
const LOAD_INERTIA: usize = 2;

/// Amplitude [1e-6 rad] and phase [rad] of the default kinematic error, orders 1 to 15.
const KINEMATIC_ERROR: [(f64, f64); 15] = [
    (20.0, 5.97),
    (90.0, 0.91),
    (6.0, 5.96),
    (22.0, 1.96),
    (1.7888543819998317, 2.66),
    (8.0, 5.20),
    (1.5118578920369088, 2.57),
    (1.4142135623730951, 3.45),
    (1.3333333333333333, 0.17),
    (1.2649110640673518, 4.73),
    (1.2060453783110545, 3.38),
    (1.1547005383792515, 2.07),
    (1.1094003924504583, 4.95),
    (1.0690449676496976, 1.91),
    (1.0327955589886444, 2.85),
];

/// Positions of the scenario's columns, counted from the end of the drive's.
#[derive(Clone, Copy, Debug)]
#[repr(usize)]
pub enum ScenarioColumn {
    /// Set speed.
    OmegaSet,
    /// Load torque.
    TauLoad,
    /// Proportional gain.
    Kp,
    /// Integral gain.
    Ki,
    /// Torque limit.
    TauMax,
    /// Motor angle at the start.
    ThetaM0,
}

/// Which parameters a model has, and where each stands in a row.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Base model.
    pub base: Base,
    /// Spring law.
    pub spring: Spring,
    /// Orders of the kinematic error per motor revolution.
    pub orders: Vec<f64>,
    /// Terms beyond the nominal model.
    pub terms: Choice,
}

impl Layout {
    /// Position of the first spring parameter.
    pub const SPRING: usize = DRIVE.len();

    /// Position of `te_scale`; the cosine coefficients follow, then the sine coefficients.
    pub fn te_scale(&self) -> usize {
        Self::SPRING + self.spring_entries().len()
    }

    /// Position of the first cosine coefficient.
    pub fn te_cos(&self) -> usize {
        self.te_scale() + 1
    }

    /// Position of the first sine coefficient.
    pub fn te_sin(&self) -> usize {
        self.te_cos() + self.orders.len()
    }

    /// Position of the first parameter of the terms.
    pub fn term_parameters(&self) -> usize {
        self.te_sin() + self.orders.len()
    }

    /// Position of a scenario column.
    pub fn scenario(&self, column: ScenarioColumn) -> usize {
        self.term_parameters() + self.terms.parameter_count + column as usize
    }

    /// How many parameters there are, the scenario's included.
    pub fn len(&self) -> usize {
        self.term_parameters() + self.terms.parameter_count + SCENARIO.len()
    }

    /// Never: every model has parameters.
    pub fn is_empty(&self) -> bool {
        false
    }

    fn spring_entries(&self) -> &'static [Entry] {
        match self.spring {
            Spring::Polynomial => &POLYNOMIAL,
            Spring::Piecewise => &PIECEWISE,
        }
    }

    /// Whether a parameter may be infinite: the torque limit alone.
    pub fn may_be_infinite(&self, index: usize) -> bool {
        index == self.scenario(ScenarioColumn::TauMax)
    }

    /// The allowed range of every parameter in row order; what else a parameter has to be stands in its meaning.
    pub fn allowed(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let of = |(index, entry): (usize, &Entry)| match self.base {
            Base::OneInertia if index == LOAD_INERTIA => NOT_NEGATIVE,
            Base::OneInertia if index >= Self::SPRING => ANY,
            _ => entry.6,
        };
        let drive = DRIVE.iter().chain(self.spring_entries()).enumerate().map(of);
        let kinematic_error = std::iter::repeat_n(ANY, self.term_parameters() - self.te_scale());
        let terms = self.terms.terms().flat_map(|term| term.parameters).map(|parameter| parameter.allowed);
        drive.chain(kinematic_error).chain(terms).chain(SCENARIO.iter().map(|entry| entry.6))
    }

    /// The table of parameters in row order; `labels` are the orders as users write them.
    pub fn parameters(&self, labels: &[String]) -> Vec<Parameter> {
        let entry = |group: Group| {
            move |&(name, symbol, unit, default, low, high, _, meaning, source): &Entry| Parameter {
                name: name.into(),
                symbol: symbol.into(),
                unit,
                default,
                low,
                high,
                meaning: meaning.into(),
                source,
                group,
            }
        };
        let mut table: Vec<Parameter> = DRIVE.iter().chain(self.spring_entries()).map(entry(Group::Drive)).collect();
        table.push(Parameter {
            name: "te_scale".into(),
            symbol: "A".into(),
            unit: "1",
            default: 1.0,
            low: 0.0,
            high: 3.0,
            meaning: "factor on the whole kinematic error".into(),
            source: CHOICE,
            group: Group::Drive,
        });
        for (wave, symbol, word) in [("cos", "a", "cosine"), ("sin", "b", "sine")] {
            table.extend(self.orders.iter().zip(labels).map(|(&order, label)| Parameter {
                name: format!("te_{wave}_{label}"),
                symbol: format!("{symbol}_{label}"),
                unit: "rad",
                default: default_coefficient(order, wave),
                low: -1.5e-4,
                high: 1.5e-4,
                meaning: format!("kinematic error, {word} coefficient of order {label}"),
                source: CHOICE,
                group: Group::Drive,
            }));
        }
        for term in self.terms.terms() {
            table.extend(term.parameters.iter().map(|parameter| Parameter {
                name: self.terms.column(term, parameter.name),
                symbol: parameter.symbol.into(),
                unit: parameter.unit,
                default: parameter.default,
                low: parameter.plausible.0,
                high: parameter.plausible.1,
                meaning: format!("{}: {}", term.id, parameter.meaning),
                source: term.source,
                group: Group::Drive,
            }));
        }
        table.extend(SCENARIO.iter().map(entry(Group::Scenario)));
        table
    }
}

fn default_coefficient(order: f64, wave: &str) -> f64 {
    if order.fract() != 0.0 || !(1.0..=15.0).contains(&order) {
        return 0.0;
    }
    let (amplitude, phase) = KINEMATIC_ERROR[order as usize - 1];
    1e-6 * amplitude * if wave == "cos" { phase.sin() } else { phase.cos() }
}
