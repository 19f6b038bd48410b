//! What a term may say and do.

use super::{Dry, HIDDEN, Place, Wound};
use crate::model::{Base, Bends, Corners};
use crate::real::{Real, Scalar};

/// A parameter of a term.
#[derive(Clone, Copy, Debug)]
pub struct TermParameter {
    /// Name; prefixed by the term's id where two terms share it.
    pub name: &'static str,
    /// Symbol in the equation.
    pub symbol: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Value for a size-25 unit.
    pub default: f64,
    /// Plausible range for a size-25 unit.
    pub plausible: (f64, f64),
    /// Allowed range; outside of it a row is a bad row.
    pub allowed: (f64, f64),
    /// One sentence.
    pub meaning: &'static str,
}

impl TermParameter {
    /// A parameter; [`TermParameter::size_25`] and [`TermParameter::within`] complete it.
    pub(super) const fn new(name: &'static str, unit: &'static str, meaning: &'static str) -> Self {
        Self {
            name,
            symbol: name,
            unit,
            default: 0.0,
            plausible: (0.0, 0.0),
            allowed: (f64::NEG_INFINITY, f64::INFINITY),
            meaning,
        }
    }

    /// Another symbol than the name.
    pub(super) const fn symbol(self, symbol: &'static str) -> Self {
        Self { symbol, ..self }
    }

    /// A phase.
    pub(super) const fn phase(name: &'static str, meaning: &'static str) -> Self {
        Self::new(name, "rad", meaning).size_25(0.0, -std::f64::consts::PI, std::f64::consts::PI)
    }

    /// Default and plausible range for a size-25 unit.
    pub(super) const fn size_25(self, default: f64, low: f64, high: f64) -> Self {
        Self { default, plausible: (low, high), ..self }
    }

    /// The allowed range.
    pub(super) const fn within(self, low: f64, high: f64) -> Self {
        Self { allowed: (low, high), ..self }
    }
}

/// A hidden state of a term.
#[derive(Clone, Copy, Debug)]
pub struct TermState {
    /// Name.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Size below which relative accuracy is not asked for.
    pub scale: f64,
}

/// What a term says of itself.
#[derive(Clone, Copy, Debug)]
pub struct TermInfo {
    /// Effect id.
    pub id: &'static str,
    /// Where in the drive it sits.
    pub place: Place,
    /// The base models it can join.
    pub bases: &'static [Base],
    /// One sentence.
    pub description: &'static str,
    /// Equation in plain text.
    pub equation: &'static str,
    /// Where the equation comes from.
    pub source: &'static str,
    /// The parameter that is its amplitude.
    pub amplitude: &'static str,
    /// Parameters in the order in which the term reads them.
    pub parameters: &'static [TermParameter],
    /// Hidden states in the order in which the term reads them.
    pub states: &'static [TermState],
}

/// The motion at one instant, before the terms have their say.
#[derive(Clone, Copy)]
pub struct Motion<R> {
    /// Time [s].
    pub t: R,
    /// Motor angle [rad].
    pub theta_m: R,
    /// Motor speed [rad/s].
    pub omega_m: R,
    /// Load angle [rad].
    pub theta_l: R,
    /// Load speed [rad/s].
    pub omega_l: R,
    /// 1 / ratio.
    pub inverse_ratio: R,
}

impl<R: Real> Motion<R> {
    /// That of a rigid gear without kinematic error, at time 0.
    #[inline(always)]
    pub fn of_motor(theta_m: R, omega_m: R, inverse_ratio: R) -> Self {
        let (theta_l, omega_l) = (theta_m * inverse_ratio, omega_m * inverse_ratio);
        Self { t: R::zero(), theta_m, omega_m, theta_l, omega_l, inverse_ratio }
    }
}

/// A term's hidden states and their rates.
pub struct Hidden<'a, 'b, R: Real> {
    /// States.
    pub states: &'a [R],
    /// Rates, to be set by the term.
    pub rates: &'a mut [R],
    corners: &'a mut Corners<'b, R>,
    first_corner: usize,
}

impl<R: Real> Hidden<'_, '_, R> {
    /// See [`Corners::clamp`]; `corner` counts the term's own.
    #[inline(always)]
    pub fn clamp(&mut self, corner: usize, x: R, bound: R, size: f64) -> R {
        self.corners.clamp(self.first_corner + corner, x, bound, size)
    }

    /// See [`Corners::sign`].
    #[inline(always)]
    pub fn sign(&mut self, corner: usize, x: R, size: f64) -> R {
        self.corners.sign(self.first_corner + corner, x, size)
    }

    /// See [`Corners::min`].
    #[inline(always)]
    pub fn min(&mut self, corner: usize, left: R, right: R, size: f64) -> R {
        self.corners.min(self.first_corner + corner, left, right, size)
    }
}

/// Hidden states of all terms with their rates, and the corners of all laws.
pub struct Internals<'a, R: Real> {
    /// States.
    pub states: &'a [R; HIDDEN],
    /// Rates.
    pub rates: [R; HIDDEN],
    /// Corners.
    pub corners: Corners<'a, R>,
}

impl<'a, R: Real> Internals<'a, R> {
    /// States without rates.
    #[inline(always)]
    pub fn new(states: &'a [R; HIDDEN], corners: Corners<'a, R>) -> Self {
        Self { states, rates: [R::zero(); HIDDEN], corners }
    }

    /// What a term sees of them.
    #[inline(always)]
    pub(super) fn of(&mut self, first_state: usize, first_corner: usize) -> Hidden<'_, 'a, R> {
        let first = first_state.min(HIDDEN);
        Hidden {
            states: &self.states[first..],
            rates: &mut self.rates[first..],
            corners: &mut self.corners,
            first_corner,
        }
    }
}

/// The motor's side: what the drive makes of the commanded torque.
pub struct Actuator<R> {
    /// Motor torque [N m].
    pub torque: R,
    /// Inertia that turns with the wave generator [kg m^2].
    pub inertia: R,
}

/// The kinematics of the mesh.
pub struct Mesh<R> {
    /// Kinematic error [rad] and its derivative with respect to the motor angle.
    pub error: R,
    /// Derivative of the kinematic error.
    pub error_slope: R,
    /// Derivative of that slope with respect to the motor angle; only the rigid gear reads it.
    pub error_curvature: R,
    /// Derivative of that slope with respect to the motor speed [s]; only the rigid gear reads it.
    pub slope_by_speed: R,
    /// Windup added by the structure [rad], and its rate.
    pub added_windup: R,
    /// Rate of the added windup [rad/s].
    pub added_windup_rate: R,
    /// Load torque in force [N m], for errors that depend on it.
    pub load_torque: R,
}

/// The gear between motor and load.
pub struct Gear<R> {
    /// Windup that the spring sees [rad]; a clearance shortens it.
    pub spring_windup: R,
    /// Windup that jumps have let go for ever [rad].
    pub let_go: R,
    /// Torque that terms add to the law of the spring [N m].
    pub added_spring_torque: R,
    /// Factor on the spring torque, what terms add to it included.
    pub stiffness_factor: R,
    /// Torque added to spring and damper [N m at the output].
    pub added_torque: R,
    /// Derivative of the stiffness factor with respect to the motor angle [1/rad]; times the energy that the
    /// spring stores at the factor 1 it resists the motor [N m].
    pub motor_reaction: R,
    /// The same for the load angle.
    pub load_reaction: R,
    /// Windup [rad].
    pub windup: R,
    /// Windup rate [rad/s].
    pub windup_rate: R,
}

impl<R: Real> Mesh<R> {
    /// The kinematics of the gear alone, before the terms have their say.
    #[inline(always)]
    pub fn new((error, error_slope): (R, R), error_curvature: R, load_torque: R) -> Self {
        let zero = R::zero();
        Self {
            error,
            error_slope,
            error_curvature,
            slope_by_speed: zero,
            added_windup: zero,
            added_windup_rate: zero,
            load_torque,
        }
    }
}

impl<R: Real> Gear<R> {
    /// The gear at a windup, before the terms have their say.
    #[inline(always)]
    pub fn new(windup: R, windup_rate: R) -> Self {
        let zero = R::zero();
        Self {
            spring_windup: windup,
            let_go: zero,
            added_spring_torque: zero,
            stiffness_factor: R::splat(1.0),
            added_torque: zero,
            motor_reaction: zero,
            load_reaction: zero,
            windup,
            windup_rate,
        }
    }

    /// Windup beyond what jumps have let go [rad].
    #[inline(always)]
    pub fn left(&self) -> R {
        self.windup - self.let_go
    }
}

/// What the gear does to the structure.
pub struct Reaction<R> {
    /// Gear torque [N m at the output].
    pub gear_torque: R,
    /// Torque on the housing beside it [N m].
    pub on_housing: R,
}

impl<R: Real> Reaction<R> {
    /// That of the gear alone.
    #[inline(always)]
    pub fn new(gear_torque: R) -> Self {
        Self { gear_torque, on_housing: R::zero() }
    }
}

/// The load side.
pub struct Load<R> {
    /// Load torque, positive resists [N m].
    pub torque: R,
    /// Inertia that moves with the output [kg m^2].
    pub inertia: R,
}

/// One piece of left-out physics. Every method it does not need does nothing.
#[allow(unused_variables)]
pub trait Term {
    /// What it says of itself.
    const INFO: TermInfo;
    /// Whether its states jump.
    const JUMPS: bool = false;
    /// Whether it acts by time alone, whatever the drive does.
    const BY_TIME: bool = false;
    /// Whether it acts over so short a part of a revolution that steps could run over it.
    const NARROW: bool = false;
    /// How many corners its law has.
    const CORNERS: usize = 0;
    /// Whether it adds to the law of the spring; its amplitude then is what may be too large.
    const SPRING: bool = false;
    /// Whether its friction at an even speed is the same at every angle, so that the sustaining torque covers it.
    const SUSTAINED: bool = false;

    /// Sets the hidden states of a drive that begins in this motion; zero where it does nothing.
    #[inline(always)]
    fn begin<R: Real>(p: &[R], motion: &Motion<R>, states: &mut [R]) {}
    /// Sets the hidden states of a drive that has long been wound up, whatever its motion; zero where it does nothing.
    #[inline(always)]
    fn wind<R: Real>(p: &[R], wound: &mut Wound<R>, states: &mut [R]) {}
    /// Sets the hidden states that the same motion soon brings about on a motor of that friction; as it begins where it
    /// does nothing.
    #[inline(always)]
    fn settle<R: Real>(p: &[R], motion: &Motion<R>, dry: &Dry<R>, states: &mut [R]) {}
    /// Energy [J] stored in the term; what it takes beyond that is lost and never negative. Springs and masses beyond
    /// the motor and the output belong to what drives them, not to the balance of the gear.
    #[inline(always)]
    fn stored<R: Real>(p: &[R], gear: &Gear<R>, states: &[R]) -> R {
        R::zero()
    }
    /// Energy [J] that the torque it adds to the spring stores at the windup which the spring sees, at the factor 1.
    #[inline(always)]
    fn added_spring_energy<R: Real>(p: &[R], windup: R) -> R {
        R::zero()
    }
    /// Derivative of that torque with respect to the windup [N m/rad], as [`crate::model::spring::is_stiff`] expects it.
    #[inline(always)]
    fn added_stiffness<R: Real>(p: &[R], windup: R) -> R {
        R::zero()
    }
    /// What is left before the term's states jump; where it falls below 0 they do. In any unit. It follows from
    /// what the jump relieves: the torque of the spring alone, without the damper or what terms add.
    #[inline(always)]
    fn reserve<R: Real>(p: &[R], gear: &Gear<R>, spring_torque: R, states: &[R]) -> R {
        R::splat(f64::INFINITY)
    }
    /// The jump, where the reserve has been used up.
    fn jump<S: Scalar>(p: &[S], gear: &Gear<S>, spring_torque: S, states: &mut [S]) {}
    /// The frequency [Hz] at which it acts by time alone.
    #[inline(always)]
    fn frequency<R: Real>(p: &[R]) -> R {
        R::zero()
    }
    /// How far [rad] the motor may turn from this angle without passing over what it does.
    #[inline(always)]
    fn reach<R: Real>(p: &[R], theta_m: R) -> R {
        R::splat(f64::INFINITY)
    }
    /// Shapes the motor torque.
    #[inline(always)]
    fn actuator<R: Real>(p: &[R], motion: &Motion<R>, actuator: &mut Actuator<R>, hidden: Hidden<R>) {}
    /// Highest order per motor revolution that it adds to the kinematic error.
    #[inline(always)]
    fn highest_order<R: Real>(p: &[R]) -> R {
        R::zero()
    }
    /// The order per motor revolution at which what it adds to the kinematic error repeats; 0 where it is the same in every
    /// revolution, or settles.
    #[inline(always)]
    fn repeats_at<R: Real>(p: &[R], inverse_ratio: R) -> R {
        R::zero()
    }
    /// Adds to the kinematic error.
    #[inline(always)]
    fn mesh<R: Real>(p: &[R], motion: &Motion<R>, mesh: &mut Mesh<R>, hidden: Hidden<R>) {}
    /// Shapes spring and gear torque.
    #[inline(always)]
    fn gear<R: Real>(p: &[R], motion: &Motion<R>, gear: &mut Gear<R>, hidden: Hidden<R>) {}
    /// Adds friction on the motor shaft.
    #[inline(always)]
    fn motor_friction<R: Real>(p: &[R], motion: &Motion<R>, dry: &mut Dry<R>, hidden: Hidden<R>) {}
    /// Adds friction on the output.
    #[inline(always)]
    fn load_friction<R: Real>(p: &[R], motion: &Motion<R>, dry: &mut Dry<R>, hidden: Hidden<R>) {}
    /// Answers the gear torque.
    #[inline(always)]
    fn reaction<R: Real>(p: &[R], motion: &Motion<R>, reaction: &mut Reaction<R>, hidden: Hidden<R>) {}
    /// Adds to the load.
    #[inline(always)]
    fn load<R: Real>(p: &[R], motion: &Motion<R>, load: &mut Load<R>, hidden: Hidden<R>) {}
}
