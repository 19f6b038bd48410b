//! Parameters in the form the equations use them, one row at a time or in lanes.

use super::sustaining::sustaining_torque;
use super::terms::Terms;
use super::{BadParameter, Base, Harmonics, Layout, ScenarioColumn, Spring, spring};
use crate::real::{Real, Scalar};

/// A struct of numbers that can be filled lane by lane.
macro_rules! per_lane {
    ($(#[$attribute:meta])* $name:ident { $($(#[$doc:meta])* $field:ident,)* }) => {
        $(#[$attribute])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name<R> { $($(#[$doc])* pub $field: R,)* }

        impl<R: $crate::real::Real> $name<R> {
            /// The same numbers in every lane.
            pub fn splat(one: &$name<R::Lane>) -> Self {
                Self { $($field: R::every(one.$field),)* }
            }
            /// The same numbers converted.
            #[inline(always)]
            pub fn map<Q>(&self, convert: impl Fn(R) -> Q) -> $name<Q> {
                $name { $($field: convert(self.$field),)* }
            }
            /// Replaces the numbers in one lane.
            pub fn set_lane(&mut self, lane: usize, one: &$name<R::Lane>) {
                $(self.$field.set(lane, one.$field);)*
            }
        }
    };
}
pub(super) use per_lane;

per_lane! {
    /// Constants of the equations of motion; SI units.
    Constants {
        /// 1 / ratio.
        inverse_ratio,
        /// 1 / J_m.
        inverse_j_m,
        /// 1 / J_l.
        inverse_j_l,
        /// J_m.
        j_m,
        /// J_l.
        j_l,
        /// B_m.
        b_m,
        /// B_l.
        b_l,
        /// B_ml.
        b_ml,
        /// B_sp.
        b_sp,
        /// Slip factor.
        s,
        /// B_m + B_ml.
        d_mm,
        /// s B_ml.
        d_ml,
        /// B_l + s^2 B_ml.
        d_ll,
        /// Polynomial spring.
        k1,
        /// Polynomial spring.
        k2,
        /// Polynomial spring.
        k3,
        /// Polynomial spring.
        k4,
        /// Polynomial spring.
        k5,
        /// End of the polynomial's range.
        phi_max,
        /// Piecewise spring: K3.
        k_3,
        /// Piecewise spring: K1 - K2.
        k_12,
        /// Piecewise spring: K2 - K3.
        k_23,
        /// Piecewise spring: windup at T1.
        phi_1,
        /// Piecewise spring: windup at T2.
        phi_2,
        /// Proportional gain.
        k_p,
        /// Integral gain.
        k_i,
        /// 1 / K_p, 0 without proportional action.
        inverse_k_p,
        /// Torque limit.
        tau_max,
    }
}

/// Gains below this act on no time scale of a drive and only overflow.
const SMALLEST_GAIN: f64 = 1e-12;

/// One checked row, ready to run.
#[derive(Clone, Debug)]
pub struct Row<S> {
    /// Constants of the equations.
    pub constants: Constants<S>,
    /// Factor on the kinematic error.
    pub te_scale: S,
    /// The kinematic error itself, where it differs from the batch's.
    pub harmonics: Option<Harmonics<S>>,
    /// Set speed [rad/s].
    pub omega_set: S,
    /// Load torque [N m].
    pub tau_load: S,
    /// Motor angle at the start [rad].
    pub theta_m0: S,
    /// Mean motor torque that holds the set speed [N m].
    pub sustaining_torque: S,
    /// Motor torque that holds the load torque of the start there [N m]; none before the row is seated.
    pub holding_torque: S,
    /// Parameters of the terms.
    pub terms: Vec<S>,
    /// How much each order of the kinematic error forces the mode: n^2 A_n.
    pub forcing: Vec<f64>,
}

impl<S: Scalar> Row<S> {
    /// Checks a parameter row and derives the constants.
    pub fn new(layout: &Layout, values: &[S], own_harmonics: bool) -> Result<Self, BadParameter> {
        let (zero, one) = (S::zero(), S::splat(1.0));
        let check = |index: usize, good: bool| if good { Ok(()) } else { Err(BadParameter { index }) };
        for (index, (value, (least, most))) in values.iter().zip(layout.allowed()).enumerate() {
            let value = value.plain();
            check(index, value.is_finite() || (layout.may_be_infinite(index) && value == f64::INFINITY))?;
            check(index, least <= value && value <= most)?;
        }
        let [ratio, j_m, j_l, b_m, b_l, b_ml, b_sp, s] = *values.first_chunk().expect("a full row");
        check(0, ratio.plain() != 0.0)?;
        let scenario = |column| values[layout.scenario(column)];
        for column in [ScenarioColumn::Kp, ScenarioColumn::Ki] {
            let gain = scenario(column).plain();
            check(layout.scenario(column), gain == 0.0 || gain >= SMALLEST_GAIN)?;
        }

        let mut constants = Constants {
            inverse_ratio: one / ratio,
            inverse_j_m: one / j_m,
            inverse_j_l: one / j_l,
            j_m,
            j_l,
            b_m,
            b_l,
            b_ml,
            b_sp,
            s,
            d_mm: b_m + b_ml,
            d_ml: s * b_ml,
            d_ll: b_l + s * s * b_ml,
            k1: zero,
            k2: zero,
            k3: zero,
            k4: zero,
            k5: zero,
            phi_max: S::splat(f64::INFINITY),
            k_3: zero,
            k_12: zero,
            k_23: zero,
            phi_1: zero,
            phi_2: zero,
            k_p: scenario(ScenarioColumn::Kp),
            k_i: scenario(ScenarioColumn::Ki),
            inverse_k_p: zero,
            tau_max: scenario(ScenarioColumn::TauMax),
        };
        if constants.k_p.plain() > 0.0 {
            constants.inverse_k_p = one / constants.k_p;
        }
        if layout.base == Base::TwoInertia {
            set_spring(layout, values, &mut constants)?;
        }

        let orders = layout.orders.len();
        let coefficients = &values[layout.te_cos()..];
        let harmonics = own_harmonics
            .then(|| Harmonics::new(&layout.orders, &coefficients[..orders], &coefficients[orders..2 * orders]));
        let te_scale = values[layout.te_scale()];
        let omega_set = scenario(ScenarioColumn::OmegaSet);
        let tau_load = scenario(ScenarioColumn::TauLoad);
        let terms = values[layout.term_parameters()..][..layout.terms.parameter_count].to_vec();
        check_spring_terms(layout, &constants, &terms)?;
        Ok(Self {
            constants,
            te_scale,
            harmonics,
            omega_set,
            tau_load,
            theta_m0: scenario(ScenarioColumn::ThetaM0),
            forcing: forcing(&layout.orders, coefficients, te_scale),
            sustaining_torque: sustaining_torque(&constants, (&layout.terms, &terms), omega_set, tau_load),
            holding_torque: zero,
            terms,
        })
    }

    /// Angular frequency [rad/s] of the free torsional mode without damping, on a spring of this stiffness [N m/rad].
    pub fn free_frequency(&self, stiffness: S) -> S {
        let (motor, load) = (self.constants.reflected_inertia(), self.constants.j_l);
        (stiffness * (motor + load) / (motor * load)).sqrt()
    }

    /// Decay rate [1/s] of the free torsional mode, the same on every spring.
    pub fn free_decay(&self) -> S {
        let c = &self.constants;
        let (motor, load) = (c.reflected_inertia(), c.j_l);
        let (total, product) = (motor + load, motor * load);
        let reflected = c.d_mm / (c.inverse_ratio * c.inverse_ratio);
        let damping = (reflected * load * load + c.b_l * motor * motor) / (total * total) + c.b_sp;
        damping * total / (S::splat(2.0) * product)
    }

    /// Stiffness of the spring at a windup [N m/rad], with what terms add to its law.
    pub fn stiffness(&self, layout: &Layout, windup: S) -> S {
        let stiffness = spring::tangent(layout.spring, &self.constants, windup);
        if layout.terms.spring_amplitude().is_none() {
            return stiffness;
        }
        let mut terms = Terms::new(&layout.terms);
        terms.set_lane(0, &self.terms);
        stiffness + terms.added_stiffness(windup)
    }

    /// Angular frequency of the free torsional mode on the relaxed spring [rad/s], of the speed loop for a rigid gear.
    pub fn mode(&self, layout: &Layout) -> f64 {
        let c = &self.constants;
        let mode = match layout.base {
            Base::TwoInertia => self.free_frequency(spring::tangent(layout.spring, c, S::zero())),
            Base::OneInertia => (c.k_p + c.d_mm) / c.j_m + (c.k_i / c.j_m).sqrt(),
        };
        mode.plain()
    }

    /// Largest rate [1/s] at which the mode turns or the speed loop of a rigid gear dies away.
    pub fn rate(&self, layout: &Layout) -> f64 {
        let c = &self.constants;
        match layout.base {
            Base::TwoInertia => self.mode(layout),
            Base::OneInertia => {
                let inertia = (c.j_l * c.inverse_ratio * c.inverse_ratio + c.j_m).plain();
                ((c.k_p + c.d_mm).plain() / inertia).max((c.k_i.plain() / inertia).sqrt())
            }
        }
    }
}

impl<R: Real> Constants<R> {
    /// Torque of the dampers of the motor on it [N m], and what they hand on to the output [N m at the output].
    #[inline(always)]
    pub fn motor_dampers(&self, omega_m: R, omega_l: R) -> [R; 2] {
        let on_motor = self.d_mm.mul_add(omega_m, -(self.d_ml * omega_l));
        [on_motor, self.d_ml * (-self.s).mul_add(omega_l, omega_m)]
    }

    /// Inertia of the motor seen at the output [kg m^2].
    pub fn reflected_inertia(&self) -> R {
        self.j_m / (self.inverse_ratio * self.inverse_ratio)
    }
}

/// n^2 A_n of every order, from the cosine and then the sine coefficients.
fn forcing<S: Scalar>(orders: &[f64], coefficients: &[S], te_scale: S) -> Vec<f64> {
    let amplitude = |k: usize| coefficients[k].plain().hypot(coefficients[orders.len() + k].plain());
    orders.iter().enumerate().map(|(k, order)| order * order * amplitude(k) * te_scale.plain().abs()).collect()
}

/// The spring stays stiff with what terms add to it.
fn check_spring_terms<S: Scalar>(layout: &Layout, c: &Constants<S>, values: &[S]) -> Result<(), BadParameter> {
    let Some(amplitude) = layout.terms.spring_amplitude() else { return Ok(()) };
    let mut terms = Terms::new(&layout.terms);
    terms.set_lane(0, values);
    let stiff = spring::is_stiff(layout.spring, c, |windup| terms.added_stiffness(S::splat(windup)).plain());
    if stiff { Ok(()) } else { Err(BadParameter { index: layout.term_parameters() + amplitude }) }
}

fn set_spring<S: Scalar>(layout: &Layout, values: &[S], c: &mut Constants<S>) -> Result<(), BadParameter> {
    let at = |offset: usize| BadParameter { index: Layout::SPRING + offset };
    match layout.spring {
        Spring::Polynomial => {
            [c.k1, c.k2, c.k3, c.k4, c.k5, c.phi_max] = *values[Layout::SPRING..].first_chunk().expect("a full row");
            if !spring::is_stiff(layout.spring, c, |_| 0.0) {
                return Err(at(5));
            }
        }
        Spring::Piecewise => {
            let [k_1, k_2, k_3, t_1, t_2] = *values[Layout::SPRING..].first_chunk().expect("a full row");
            if !t_1.lt(t_2) {
                return Err(at(4));
            }
            c.k_3 = k_3;
            c.k_12 = k_1 - k_2;
            c.k_23 = k_2 - k_3;
            c.phi_1 = t_1 / k_1;
            c.phi_2 = c.phi_1 + (t_2 - t_1) / k_2;
        }
    }
    Ok(())
}
