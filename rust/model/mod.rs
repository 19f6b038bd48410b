//! What is simulated: parameters, inputs, equations of motion.

mod constants;
mod corners;
mod extended;
mod harmonics;
mod input;
mod layout;
mod one_inertia;
mod program;
mod signal;
pub mod spring;
mod sustaining;
pub mod terms;
mod two_inertia;

pub use constants::{Constants, Row};
pub use corners::{Bends, CORNERS, Corners, Pieces};
pub use extended::{Extended, ExtendedRigid};
pub use harmonics::{Harmonics, MAX_POLYNOMIAL_ORDER};
pub use input::Input;
pub use layout::{BadParameter, Group, Layout, Parameter, ScenarioColumn};
pub use one_inertia::OneInertia;
pub use program::{Drive, Line, Program, SHORTEST_RUN, Segment};
pub use signal::Signal;
pub use spring::Spring;
pub use two_inertia::TwoInertia;

use crate::real::{Real, Scalar};

/// Which equations of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Base {
    /// Motor and load inertia joined by the gear spring.
    TwoInertia,
    /// The rigid limit: one inertia at the motor, with kinematic error.
    OneInertia,
}

impl Base {
    /// All base models.
    pub const ALL: &'static [Self] = &[Self::TwoInertia, Self::OneInertia];

    /// Name users see and type.
    pub fn name(self) -> &'static str {
        match self {
            Self::TwoInertia => "two_inertia",
            Self::OneInertia => "one_inertia",
        }
    }
}

/// Everything a row and its present input contribute to the right-hand side.
pub struct Drivetrain<'a, R: Real> {
    /// Parameters in the form the equations use them.
    pub constants: &'a Constants<R>,
    /// Kinematic error.
    pub harmonics: &'a Harmonics<R>,
    /// The input in force.
    pub input: &'a Input<R>,
    /// Which spring law the constants describe.
    pub spring: Spring,
    /// Physics beyond the nominal model.
    pub terms: &'a terms::Terms<R>,
    /// Directions in which motor and load slide: +1, -1, or 0 where dry friction holds them.
    pub directions: &'a [R; 2],
    /// Pieces of the laws with corners that are held; where absent, every law is on the piece on which it lies.
    pub pieces: Option<&'a Pieces<R::Plain>>,
}

/// Energy [J] in a state.
#[derive(Clone, Copy)]
pub struct Energies<R> {
    /// Of both inertias and the gear spring.
    pub mechanical: R,
    /// Stored in terms.
    pub terms: R,
}

/// What dry friction has to hold on a shaft.
#[derive(Clone, Copy)]
pub struct Shaft<R> {
    /// Torque that would move the shaft if it were free of dry friction [N m].
    pub net: R,
    /// Torque that dry friction can hold [N m]; 0 without dry friction.
    pub breakaway: R,
}

/// The right-hand side and the quantities it passes through.
#[derive(Clone, Copy)]
pub struct Rates<R: Real, const N: usize> {
    /// Time derivative of the state.
    pub slope: [R; N],
    /// Kinematic error [rad].
    pub error: R,
    /// Windup phi at the output [rad].
    pub windup: R,
    /// Its rate [rad/s].
    pub windup_rate: R,
    /// Transmission error theta_m/i - theta_l [rad].
    pub te: R,
    /// Load speed [rad/s].
    pub omega_l: R,
    /// Load acceleration [rad/s^2].
    pub alpha_l: R,
    /// Local ratio of the rigid gear.
    pub upsilon: R,
    /// Gear torque at the output [N m].
    pub gear_torque: R,
    /// Motor torque; with imposed motion the torque it takes [N m].
    pub motor_torque: R,
    /// Torque asked of the drive; with imposed motion the torque it takes [N m].
    pub asked_torque: R,
    /// Torque that the drive delivers [N m].
    pub drive_torque: R,
    /// External load torque [N m].
    pub load_torque: R,
    /// Power that terms take from both inertias and the gear spring [W].
    pub term_power: R,
    /// What is left before hidden states jump; below 0 they have to.
    pub reserve: R,
    /// How much is left of the pieces that are held, in natural sizes.
    pub margin: R::Plain,
    /// Motor and load shaft.
    pub shafts: [Shaft<R>; 2],
}

/// Equations of motion with `N` states; state 0 is theta_m, state 1 omega_m.
pub trait Model<const N: usize> {
    /// Which base model this is.
    const BASE: Base;
    /// The natural size of each state, below which relative accuracy is not asked for.
    const SCALES: [f64; N];

    /// Where the integrator of the speed controller stands.
    const INTEGRATOR: usize;
    /// Room for hidden states of terms, at the end of the state.
    const HIDDEN: usize = 0;
    /// Positions of the speeds at which dry friction may hold a shaft.
    const STICKING: &'static [usize] = &[];
    /// Whether dry friction may hold a shaft; a constant, so that no kernel is compiled that the model never enters.
    const STICKS: bool = !Self::STICKING.is_empty();

    /// States whose rates take no more than speeds, as a set of bits.
    const POSITIONS: u64 = 0;

    /// The rates of these states alone.
    #[inline(always)]
    fn position_rates<R: Real>(_constants: &Constants<R>, _state: &[R; N]) -> [R; N] {
        [R::splat(f64::NAN); N]
    }

    /// The state made of theta_m, omega_m, te, omega_l, z.
    fn compose<S: Scalar>(full: [S; 5]) -> [S; N];

    /// Completes a state in which a drive begins by the hidden ones, given those it has been wound up to.
    fn begin<S: Scalar>(_terms: &terms::Terms<S>, _inverse_ratio: S, _wound: [S; terms::HIDDEN], _state: &mut [S; N]) {}

    /// The size of each state, against which its error is measured.
    fn sizes<R: Real>(state: &[R; N], windup: R) -> [R; N];

    /// The right-hand side at time `t`.
    fn rates<R: Real>(drive: &Drivetrain<R>, t: R, state: &[R; N]) -> Rates<R, N>;

    /// What the corners find at time `t`.
    fn corners<R: Real>(drive: &Drivetrain<R>, t: R, state: &[R; N]) -> Pieces<R::Plain>;

    /// Lets hidden states jump whose reserve is used up.
    fn jump<S: Scalar>(_drive: &Drivetrain<S>, _t: S, _state: &mut [S; N]) {}

    /// The energy at time `t`.
    #[inline(always)]
    fn energies<R: Real>(drive: &Drivetrain<R>, t: R, state: &[R; N]) -> Energies<R> {
        let rates = Self::rates(drive, t, state);
        let c = drive.constants;
        let elastic = spring::energy(drive.spring, c, rates.windup);
        Energies { mechanical: elastic + kinetic([c.j_m, c.j_l], [state[1], rates.omega_l]), terms: R::zero() }
    }
}

/// Energy of motion [J] of motor and load.
#[inline(always)]
fn kinetic<R: Real>(inertias: [R; 2], speeds: [R; 2]) -> R {
    let [j_m, j_l] = inertias;
    let [omega_m, omega_l] = speeds;
    R::splat(0.5) * (j_m * omega_m).mul_add(omega_m, j_l * omega_l * omega_l)
}

/// +1, -1, or 0 at zero.
#[inline(always)]
fn sign<R: Real>(value: R) -> R {
    let (zero, one) = (R::zero(), R::splat(1.0));
    R::select(zero.lt(value), one, R::select(value.lt(zero), -one, zero))
}

/// What rounding may add to the torque on a held shaft: as a share of what holds it, and at least, where that fades away
/// with the torque itself [N m]. A controller brings a shaft to rest exactly there: it would break away and stop again
/// with every step.
const ROUNDING: (f64, f64) = (1e-10, 1e-12);

impl<R: Real> Shaft<R> {
    /// A shaft without dry friction.
    #[inline(always)]
    fn free() -> Self {
        Self { net: R::zero(), breakaway: R::zero() }
    }

    /// How much more dry friction could hold [N m].
    #[inline(always)]
    pub fn spare(&self) -> R {
        let (zero, (share, least)) = (R::zero(), ROUNDING);
        let rounding = self.breakaway.mul_add(R::splat(share), R::splat(least));
        self.breakaway + R::select(zero.lt(self.breakaway), rounding, zero) - self.net.abs()
    }

    /// The way the shaft goes on in one lane, at a speed and after a direction: at rest it is held as long as dry
    /// friction can hold it.
    pub fn onward(&self, lane: usize, speed: f64, direction: f64) -> f64 {
        let (net, breakaway) = (self.net.plain().get(lane), self.breakaway.plain().get(lane));
        let holds = self.spare().plain().get(lane) >= 0.0;
        match (speed == 0.0, breakaway > 0.0) {
            (false, _) => speed.signum(),
            (true, true) if direction != 0.0 => direction,
            (true, true) if holds => 0.0,
            _ => net.signum(),
        }
    }
}
