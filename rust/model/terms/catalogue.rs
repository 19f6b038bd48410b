//! The list of terms, and the set of them that is on in a sweep.

use super::{Actuator, Dry, Gear, HIDDEN, Internals, Load, Mesh, Motion, Reaction, Term, TermInfo, Wound};
use crate::model::CORNERS;
use crate::model::corners::OF_TERMS;
use crate::real::{Real, Scalar, Task};

/// Where in the drive a term sits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Motor shaft.
    Motor,
    /// Gear mesh.
    Mesh,
    /// Output.
    Load,
    /// Drive electronics.
    Actuator,
    /// Housing.
    Structure,
}

impl Place {
    /// Name users see.
    pub fn name(self) -> &'static str {
        match self {
            Self::Motor => "motor",
            Self::Mesh => "mesh",
            Self::Load => "load",
            Self::Actuator => "actuator",
            Self::Structure => "structure",
        }
    }
}

/// Defines the list of terms and the calls into those that are on.
macro_rules! catalog {
    ($($term:ident in $module:ident),* $(,)?) => {
        /// All terms, in the order in which they act.
        pub const TERMS: &[TermInfo] = &[$(<super::$module::$term as Term>::INFO),*];

        /// How many corners each of them has.
        const CORNER_COUNTS: [usize; COUNT] = [$(<super::$module::$term as Term>::CORNERS),*];

        /// Which of them the sustaining torque covers, as a set of bits.
        const SUSTAINED: u64 = bits([$(<super::$module::$term as Term>::SUSTAINED),*]);

        /// Which of them add to the law of the spring, as a set of bits.
        const SPRING: u64 = bits([$(<super::$module::$term as Term>::SPRING),*]);

        /// Which of them steps could run over, as a set of bits.
        const NARROW: u64 = bits([$(<super::$module::$term as Term>::NARROW),*]);

        impl<R: Real> Terms<R> {
            catalog!(@hook actuator(actuator: Actuator<R>) [$($term $module)*]);
            catalog!(@hook mesh(mesh: Mesh<R>) [$($term $module)*]);
            catalog!(@hook gear(gear: Gear<R>) [$($term $module)*]);
            catalog!(@hook motor_friction(dry: Dry<R>) [$($term $module)*]);
            catalog!(@hook load_friction(dry: Dry<R>) [$($term $module)*]);
            catalog!(@hook load(load: Load<R>) [$($term $module)*]);
            catalog!(@hook reaction(reaction: Reaction<R>) [$($term $module)*]);

            catalog!(@states begin(motion: &Motion<R>) "Hidden states of a drive that begins in this motion."
                [$($term $module)*]);
            catalog!(@states wind(wound: &mut Wound<R>) "Those of a drive that has long been wound up, and the windup \
                that the structure then adds." [$($term $module)*]);
            catalog!(@sum added_spring_energy "Energy [J] that belongs to what all of them add to the law of the spring."
                [$($term $module)*]);
            catalog!(@sum added_stiffness "Stiffness [N m/rad] that all of them add to it." [$($term $module)*]);

            /// Hidden states that the same motion soon brings about on a motor of that friction.
            pub fn settle(&self, motion: &Motion<R>, dry: &Dry<R>, states: &mut [R; HIDDEN]) {
                let mut index = 0;
                $(
                    if self.is_on(index) {
                        let own = &mut states[self.first_state[index].min(HIDDEN)..];
                        super::$module::$term::settle(self.values_of(index), motion, dry, own);
                    }
                    index += 1;
                )*
                let _ = index;
            }

            /// Highest order per motor revolution that any of them adds to the kinematic error.
            pub fn highest_order(&self) -> R {
                let mut index = 0;
                let mut highest = R::zero();
                $(
                    if self.is_on(index) {
                        highest = highest.max(super::$module::$term::highest_order(self.values_of(index)));
                    }
                    index += 1;
                )*
                let _ = index;
                highest
            }

            /// Energy [J] stored in all of them together.
            pub fn stored(&self, gear: &Gear<R>, states: &[R; HIDDEN]) -> R {
                let mut index = 0;
                let mut energy = R::zero();
                $(
                    if self.is_on(index) {
                        let first = self.first_state[index].min(HIDDEN);
                        energy = energy + super::$module::$term::stored(self.values_of(index), gear, &states[first..]);
                    }
                    index += 1;
                )*
                let _ = index;
                energy
            }

            /// The least reserve of any of them before a jump.
            #[inline(always)]
            pub fn reserve(&self, gear: &Gear<R>, spring_torque: R, states: &[R; HIDDEN]) -> R {
                let mut index = 0;
                let mut least = R::splat(f64::INFINITY);
                $(
                    if <super::$module::$term as Term>::JUMPS && self.is_on(index) {
                        let own = &states[self.first_state[index].min(HIDDEN)..];
                        least = least.min(super::$module::$term::reserve(self.values_of(index), gear, spring_torque, own));
                    }
                    index += 1;
                )*
                let _ = index;
                least
            }

            /// The highest frequency [Hz] at which any of them acts by time alone.
            #[inline(always)]
            pub fn frequency(&self) -> R {
                let mut index = 0;
                let mut highest = R::zero();
                $(
                    if <super::$module::$term as Term>::BY_TIME && self.is_on(index) {
                        highest = highest.max(super::$module::$term::frequency(self.values_of(index)));
                    }
                    index += 1;
                )*
                let _ = index;
                highest
            }

            /// How far [rad] the motor may turn from this angle without passing over what any of them does; absent where
            /// none is narrow.
            #[inline(always)]
            pub fn reach(&self, theta_m: R) -> Option<R> {
                if self.on & NARROW == 0 {
                    return None;
                }
                let mut index = 0;
                let mut least = R::splat(f64::INFINITY);
                $(
                    if <super::$module::$term as Term>::NARROW && self.is_on(index) {
                        least = least.min(super::$module::$term::reach(self.values_of(index), theta_m));
                    }
                    index += 1;
                )*
                let _ = index;
                Some(least)
            }
        }

        impl<S: Scalar> Terms<S> {
            /// Orders per motor revolution at which what they add to the kinematic error repeats.
            pub fn repeat_at(&self, inverse_ratio: S) -> Vec<f64> {
                let mut index = 0;
                let mut orders = Vec::new();
                $(
                    if self.is_on(index) {
                        let order = super::$module::$term::repeats_at(self.values_of(index), inverse_ratio);
                        orders.push(order.plain());
                    }
                    index += 1;
                )*
                let _ = index;
                orders
            }

            /// Lets the one with the least reserve jump.
            pub fn jump(&self, gear: &Gear<S>, spring_torque: S, states: &mut [S; HIDDEN]) {
                let least = self.reserve(gear, spring_torque, states);
                let mut index = 0;
                $(
                    if <super::$module::$term as Term>::JUMPS && self.is_on(index) {
                        let own = &mut states[self.first_state[index].min(HIDDEN)..];
                        let values = self.values_of(index);
                        if super::$module::$term::reserve(values, gear, spring_torque, own).le(least) {
                            super::$module::$term::jump(values, gear, spring_torque, own);
                            return;
                        }
                    }
                    index += 1;
                )*
                let _ = index;
            }
        }
    };
    (@states $states:ident($outset:ident: $type:ty) $what:literal [$($term:ident $module:ident)*]) => {
        #[doc = $what]
        #[inline(always)]
        pub fn $states(&self, $outset: $type, states: &mut [R; HIDDEN]) {
            let mut index = 0;
            $(
                if self.is_on(index) {
                    let first = self.first_state[index].min(HIDDEN);
                    super::$module::$term::$states(self.values_of(index), $outset, &mut states[first..]);
                }
                index += 1;
            )*
            let _ = index;
        }
    };
    (@sum $sum:ident $what:literal [$($term:ident $module:ident)*]) => {
        #[doc = $what]
        #[inline(always)]
        pub fn $sum(&self, windup: R) -> R {
            struct Sum<'a, R: Real> {
                terms: &'a Terms<R>,
                windup: R,
            }
            impl<R: Real> Task for Sum<'_, R> {
                type Output = R;

                #[inline(always)]
                fn run(self) -> R {
                    let Self { terms, windup } = self;
                    let mut index = 0;
                    let mut sum = R::zero();
                    $(
                        if <super::$module::$term as Term>::SPRING && terms.is_on(index) {
                            sum = sum + super::$module::$term::$sum(terms.values_of(index), windup);
                        }
                        index += 1;
                    )*
                    let _ = index;
                    sum
                }
            }
            R::apart(Sum { terms: self, windup })
        }
    };
    (@hook $hook:ident($place:ident: $type:ty) [$($term:ident $module:ident)*]) => {
        /// Lets every term that is on have its say.
        #[inline(always)]
        pub fn $hook(&self, motion: &Motion<R>, $place: &mut $type, inner: &mut Internals<R>) {
            struct Say<'a, 'b, R: Real> {
                terms: &'a Terms<R>,
                motion: &'a Motion<R>,
                $place: &'a mut $type,
                inner: &'a mut Internals<'b, R>,
            }
            impl<R: Real> Task for Say<'_, '_, R> {
                type Output = ();

                #[inline(always)]
                fn run(self) {
                    let Self { terms, motion, $place, inner } = self;
                    let mut index = 0;
                    $(
                        if terms.is_on(index) {
                            let hidden = inner.of(terms.first_state[index], FIRST_CORNERS[index]);
                            super::$module::$term::$hook(terms.values_of(index), motion, $place, hidden);
                        }
                        index += 1;
                    )*
                    let _ = index;
                }
            }
            R::apart(Say { terms: self, motion, $place, inner });
        }
    };
}

catalog! {
    Delay in delay,
    TorqueSaturation in torque_saturation,
    ActuatorLag in actuator_lag,
    TorqueGain in torque_gain,
    TorqueRipple in torque_ripple,
    Cogging in cogging,
    InputCompliance in input_compliance,
    TeHarmonic in te_harmonic,
    TeLoadDependence in te_load_dependence,
    TeBeat in te_beat,
    TeHysteresis in te_hysteresis,
    ToothPassage in tooth_passage,
    LocalFault in local_fault,
    CouplingSlip in coupling_slip,
    Ratcheting in ratcheting,
    Backlash in backlash,
    SoftWindup in soft_windup,
    MeshStiffnessVariation in mesh_stiffness_variation,
    Hysteresis in hysteresis,
    MaxwellSlip in maxwell_slip,
    Viscoelastic in viscoelastic,
    PositionDependentFriction in position_dependent_friction,
    AsymmetricFriction in asymmetric_friction,
    WearRunIn in wear_run_in,
    CoulombFriction in coulomb_friction,
    CoulombFrictionSmooth in coulomb_friction_smooth,
    StribeckFriction in stribeck_friction,
    PreslidingFriction in presliding_friction,
    LoadDependentFriction in load_dependent_friction,
    NonlinearViscous in nonlinear_viscous,
    ThermalViscous in thermal_viscous,
    LoadMotorRipple in load_motor_ripple,
    ExternalPeriodicTorque in external_periodic_torque,
    GravityUnbalance in gravity_unbalance,
    LoadCompliance in load_compliance,
    LoadSideFriction in load_side_friction,
    RotorUnbalanceReaction in rotor_unbalance_reaction,
    BaseCompliance in base_compliance,
}

const COUNT: usize = TERMS.len();

/// Answers as a set of bits.
const fn bits(all: [bool; COUNT]) -> u64 {
    let (mut bits, mut index) = (0, 0);
    while index < COUNT {
        bits |= (all[index] as u64) << index;
        index += 1;
    }
    bits
}

/// Where each term's corners begin: there is room for those of all terms.
const FIRST_CORNERS: [usize; COUNT] = {
    let mut firsts = [OF_TERMS; COUNT];
    let mut index = 1;
    while index < COUNT {
        firsts[index] = firsts[index - 1] + CORNER_COUNTS[index - 1];
        index += 1;
    }
    assert!(firsts[COUNT - 1] + CORNER_COUNTS[COUNT - 1] <= CORNERS);
    firsts
};

/// The terms that are on, with their parameters in lanes.
#[derive(Clone, Debug)]
pub struct Terms<R> {
    on: u64,
    /// Where each term's parameters begin among the values.
    first_value: [usize; COUNT],
    /// Where each term's states begin among the hidden ones.
    first_state: [usize; COUNT],
    values: Vec<R>,
}

impl<R: Real> Terms<R> {
    /// The terms of a choice, all parameters zero.
    pub fn new(choice: &Choice) -> Self {
        Self {
            on: choice.on.iter().fold(0, |bits, index| bits | 1 << index),
            first_value: std::array::from_fn(|index| choice.parameters.get(index).copied().unwrap_or(0)),
            first_state: std::array::from_fn(|index| choice.hidden.get(index).copied().unwrap_or(0)),
            values: vec![R::zero(); choice.parameter_count],
        }
    }

    /// Those of them whose friction the sustaining torque covers.
    pub fn sustained(self) -> Self {
        Self { on: self.on & SUSTAINED, ..self }
    }

    /// The same terms with parameters converted.
    pub fn map<Q>(&self, convert: impl Fn(R) -> Q) -> Terms<Q> {
        Terms {
            on: self.on,
            first_value: self.first_value,
            first_state: self.first_state,
            values: self.values.iter().map(|&value| convert(value)).collect(),
        }
    }

    /// Takes over the parameters of the same terms.
    #[inline(always)]
    pub fn copy_from<Q: Real>(&mut self, other: &Terms<Q>, convert: impl Fn(Q) -> R) {
        self.values.iter_mut().zip(&other.values).for_each(|(own, &value)| *own = convert(value));
    }

    /// Sets the parameters of one lane.
    pub fn set_lane(&mut self, lane: usize, values: &[R::Lane]) {
        for (lanes, &value) in self.values.iter_mut().zip(values) {
            lanes.set(lane, value);
        }
    }

    /// Whether any of them has corners.
    pub fn have_corners(&self) -> bool {
        CORNER_COUNTS.iter().enumerate().any(|(index, &count)| count > 0 && self.is_on(index))
    }

    #[inline(always)]
    fn is_on(&self, index: usize) -> bool {
        self.on >> index & 1 == 1
    }

    /// The parameters of a term and of those after it. Without a panic, so that a hook in which a term does nothing
    /// costs nothing.
    #[inline(always)]
    fn values_of(&self, index: usize) -> &[R] {
        self.values.get(self.first_value[index]..).unwrap_or(&[])
    }
}

/// Which terms are on.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// Positions in the catalogue, ascending.
    pub on: Vec<usize>,
    /// Parameters of all chosen terms.
    pub parameter_count: usize,
    /// Hidden states of all chosen terms.
    pub state_count: usize,
    parameters: Vec<usize>,
    hidden: Vec<usize>,
}

impl Choice {
    /// The terms of the given ids; an error names the id that is unknown or the states that are too many.
    pub fn of(ids: &[String]) -> Result<Self, String> {
        let mut on = Vec::new();
        for id in ids {
            let index = TERMS.iter().position(|term| term.id == id).ok_or_else(|| format!("no term '{id}'"))?;
            on.push(index);
        }
        on.sort_unstable();
        on.dedup();
        let mut choice = Self { on, ..Self::default() };
        for (index, term) in TERMS.iter().enumerate() {
            choice.parameters.push(choice.parameter_count);
            choice.hidden.push(choice.state_count);
            if choice.on.contains(&index) {
                choice.parameter_count += term.parameters.len();
                choice.state_count += term.states.len();
            }
        }
        if choice.state_count > HIDDEN {
            return Err(format!("the terms have {} hidden states together, allowed {HIDDEN}", choice.state_count));
        }
        Ok(choice)
    }

    /// The chosen terms.
    pub fn terms(&self) -> impl Iterator<Item = &'static TermInfo> {
        self.on.iter().map(|&index| &TERMS[index])
    }

    /// Where among the parameters the amplitude of the first term stands that adds to the law of the spring.
    pub fn spring_amplitude(&self) -> Option<usize> {
        let index = self.on.iter().copied().find(|index| SPRING >> index & 1 == 1)?;
        let TermInfo { parameters, amplitude, .. } = &TERMS[index];
        let own = parameters.iter().position(|parameter| parameter.name == *amplitude)?;
        Some(self.parameters[index] + own)
    }

    /// Column name of a term's parameter: its own, prefixed by the term's id where another chosen term has the same.
    pub fn column(&self, term: &TermInfo, parameter: &str) -> String {
        let has_it = |other: &&TermInfo| other.parameters.iter().any(|own| own.name == parameter);
        let shared = self.terms().filter(has_it).count() > 1;
        if shared { format!("{}_{parameter}", term.id) } else { parameter.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn exact_terms_complete() {
        for term in TERMS {
            let id = term.id;
            for (what, text) in
                [("id", id), ("description", term.description), ("equation", term.equation), ("source", term.source)]
            {
                assert!(!text.trim().is_empty(), "{id} has no {what}");
            }
            assert!(id.chars().all(|c| c.is_ascii_lowercase() || c == '_'), "{id}");
            assert!(term.parameters.iter().any(|p| p.name == term.amplitude), "{id} has no amplitude");
            assert!(term.states.len() <= HIDDEN, "{id}");
            for parameter in term.parameters {
                let name = format!("{id}.{}", parameter.name);
                assert!(!parameter.unit.is_empty() && !parameter.meaning.is_empty(), "{name}");
                let ((low, high), (least, most)) = (parameter.plausible, parameter.allowed);
                assert!(low < high && low.is_finite() && high.is_finite(), "{name}: plausible range");
                assert!((low..=high).contains(&parameter.default), "{name}: default");
                assert!(least <= low && high <= most, "{name}: allowed range");
            }
            for state in term.states {
                assert!(!state.name.is_empty() && !state.unit.is_empty() && state.scale > 0.0, "{id}.{}", state.name);
            }
        }
    }

    #[test]
    fn exact_names_are_unique() {
        let mut ids = HashSet::new();
        let mut columns = HashSet::new();
        let mut states = HashSet::new();
        let all = Choice { on: (0..TERMS.len()).collect(), ..Choice::default() };
        for term in TERMS {
            assert!(ids.insert(term.id), "{} twice", term.id);
            for parameter in term.parameters {
                let column = all.column(term, parameter.name);
                assert!(columns.insert(column.to_lowercase()), "{column} twice");
            }
            for state in term.states {
                assert!(states.insert(state.name), "{} twice", state.name);
            }
        }
    }

    #[test]
    fn exact_too_many_hidden_states_are_named() {
        let ids: Vec<String> = TERMS.iter().map(|term| term.id.to_string()).collect();
        let states: usize = TERMS.iter().map(|term| term.states.len()).sum();
        let error = Choice::of(&ids).expect_err("more states than there is room for");
        assert!(error.contains(&states.to_string()) && error.contains(&HIDDEN.to_string()), "{error}");
    }
}
