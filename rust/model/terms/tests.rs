//! What every term has to keep, whatever its parameters.

use super::{Actuator, Choice, Dry, Gear, HIDDEN, Internals, Load, Mesh, Motion, Reaction, TERMS, TermInfo, Terms};
use crate::model::{CORNERS, Corners, Pieces};
use crate::real::{Pair, Real};

/// Everything the terms can change at one instant.
struct Answer<R: Real> {
    actuator: Actuator<R>,
    mesh: Mesh<R>,
    gear: Gear<R>,
    motor: Dry<R>,
    load: Load<R>,
    output: Dry<R>,
    reaction: Reaction<R>,
    /// Rates of the hidden states after each of the seven hooks.
    rates: [[R; HIDDEN]; 7],
    /// What the corners found.
    corners: Pieces<R::Plain>,
}

impl<R: Real> Answer<R> {
    fn numbers(&self) -> Vec<R> {
        let Self { actuator, mesh, gear, motor, load, output, reaction, .. } = self;
        let mut numbers = vec![actuator.torque, actuator.inertia, mesh.error, mesh.error_slope];
        numbers.extend([mesh.error_curvature, mesh.slope_by_speed]);
        numbers.extend([mesh.added_windup, mesh.added_windup_rate, gear.spring_windup, gear.stiffness_factor]);
        numbers.extend([gear.added_torque, gear.added_spring_torque, gear.motor_reaction, gear.load_reaction]);
        numbers.extend([load.torque, load.inertia, motor.drag, motor.grip, motor.lean]);
        numbers.extend([motor, output].into_iter().flat_map(|dry| [dry.level, dry.breakaway, dry.bias, dry.resisting]));
        numbers.extend([reaction.gear_torque, reaction.on_housing]);
        numbers
    }
}

/// A moment of a drive.
#[derive(Clone, Copy)]
struct Moment {
    theta_m: f64,
    omega_m: f64,
    windup: f64,
    windup_rate: f64,
    gear_torque: f64,
    hidden: f64,
}

const MOMENT: Moment =
    Moment { theta_m: 3.7, omega_m: 12.0, windup: 2e-4, windup_rate: -3e-3, gear_torque: 6.0, hidden: 0.3 };

impl Moment {
    fn omega_l(&self) -> f64 {
        self.omega_m / 121.0 - self.windup_rate
    }

    /// Torques of `B_m` and `B_ml` on motor and output, with s = 1.
    fn dampers(&self) -> [f64; 2] {
        let handed_on = 6e-4 * (self.omega_m - self.omega_l());
        [6e-4 * self.omega_m + handed_on, handed_on]
    }
}

/// +1, -1, or 0 at rest.
fn way(speed: f64) -> f64 {
    if speed == 0.0 { 0.0 } else { speed.signum() }
}

fn answer<R: Real>(terms: &Terms<R>, moment: &Moment) -> Answer<R> {
    answer_on(terms, moment, None)
}

/// The answer on the pieces that are held.
fn answer_on<R: Real>(terms: &Terms<R>, moment: &Moment, pieces: Option<&Pieces<R::Plain>>) -> Answer<R> {
    let s = R::splat;
    let motion = Motion {
        t: s(0.31),
        theta_m: s(moment.theta_m),
        omega_m: s(moment.omega_m),
        theta_l: s(moment.theta_m / 121.0),
        omega_l: s(moment.omega_l()),
        inverse_ratio: s(1.0 / 121.0),
    };
    let mut found = [R::Plain::zero(); CORNERS];
    let states = [s(moment.hidden); HIDDEN];
    let mut inner = Internals::new(&states, Corners::noting(pieces, &mut found));
    let mut motor = Dry::of_motor(s(way(moment.omega_m)), moment.dampers().map(s), s(moment.gear_torque));
    let mut actuator = Actuator { torque: s(0.4), inertia: s(3e-4) };
    let mut mesh = Mesh {
        error: s(1e-5),
        error_slope: s(2e-5),
        error_curvature: s(0.0),
        slope_by_speed: s(0.0),
        added_windup: s(0.0),
        added_windup_rate: s(0.0),
        load_torque: s(20.0),
    };
    let mut gear = Gear::new(s(moment.windup), s(moment.windup_rate));
    let mut load = Load { torque: s(20.0), inertia: s(0.5) };
    let mut reaction = Reaction::new(s(moment.gear_torque));
    let mut hook = |say: &mut dyn FnMut(&mut Internals<R>)| {
        inner.rates = [s(f64::NAN); HIDDEN];
        say(&mut inner);
        inner.rates
    };
    let motor_rates = hook(&mut |inner| terms.motor_friction(&motion, &mut motor, inner));
    let mut output = Dry::of_output(s(way(moment.omega_l())), &motor);
    let rates = [
        hook(&mut |inner| terms.actuator(&motion, &mut actuator, inner)),
        hook(&mut |inner| terms.mesh(&motion, &mut mesh, inner)),
        hook(&mut |inner| terms.gear(&motion, &mut gear, inner)),
        motor_rates,
        hook(&mut |inner| terms.load(&motion, &mut load, inner)),
        hook(&mut |inner| terms.load_friction(&motion, &mut output, inner)),
        hook(&mut |inner| terms.reaction(&motion, &mut reaction, inner)),
    ];
    Answer { actuator, mesh, gear, motor, load, output, reaction, rates, corners: found }
}

fn terms_with(ids: &[&str], values: &[f64]) -> Terms<f64> {
    let ids: Vec<String> = ids.iter().map(ToString::to_string).collect();
    let mut terms = Terms::new(&Choice::of(&ids).expect("known terms"));
    terms.set_lane(0, values);
    terms
}

fn defaults(term: &TermInfo) -> Vec<f64> {
    term.parameters.iter().map(|parameter| parameter.default).collect()
}

/// Defaults, and each parameter in turn at either end of a range.
fn corners(term: &TermInfo, range: fn(&super::TermParameter) -> (f64, f64)) -> Vec<Vec<f64>> {
    let mut rows = vec![defaults(term)];
    for (index, parameter) in term.parameters.iter().enumerate() {
        let (low, high) = range(parameter);
        for end in [low, high].into_iter().filter(|end| end.is_finite()) {
            rows.push(defaults(term));
            let last = rows.len() - 1;
            rows[last][index] = end;
        }
    }
    rows
}

fn info(id: &str) -> &'static TermInfo {
    TERMS.iter().find(|term| term.id == id).expect("a known term")
}

fn grid() -> Vec<Moment> {
    let mut moments = Vec::new();
    for omega_m in [-600.0, -31.0, -2.0, -0.01, 0.0, 1e-3, 0.3, 5.0, 62.8, 420.0] {
        for windup_rate in [-0.4, -1e-3, 0.0, 2e-5, 0.03] {
            for (theta_m, windup) in [(0.0, 0.0), (1.3, 3e-5), (2.9, -4e-4), (4.4, 2e-3), (5.8, -1.2e-5)] {
                for hidden in [-0.9, -0.01, 0.0, 4e-3, 0.6] {
                    let gear_torque = 3.1e4 * windup;
                    moments.push(Moment { theta_m, omega_m, windup, windup_rate, gear_torque, hidden });
                }
            }
        }
    }
    moments
}

#[test]
fn exact_every_allowed_value_gives_finite_numbers() {
    for term in TERMS {
        for values in corners(term, |parameter| parameter.allowed) {
            let terms = terms_with(&[term.id], &values);
            for omega_m in [-31.0, 0.0, 5.0] {
                let found = answer(&terms, &Moment { omega_m, ..MOMENT });
                for number in found.numbers() {
                    assert!(number.is_finite(), "{} at {values:?}", term.id);
                }
            }
        }
    }
}

#[test]
fn exact_every_hidden_rate_is_set_once() {
    for term in TERMS {
        let found = answer(&terms_with(&[term.id], &defaults(term)), &MOMENT);
        for state in 0..HIDDEN {
            let times = found.rates.iter().filter(|rates| !rates[state].is_nan()).count();
            assert_eq!(times, usize::from(state < term.states.len()), "{} state {state}", term.id);
        }
    }
}

#[test]
fn exact_lanes_and_scalar_agree() {
    for term in TERMS {
        let values = defaults(term);
        let alone = terms_with(&[term.id], &values);
        let mut together = Terms::<Pair<Pair<f64>>>::new(&Choice::of(&[term.id.to_string()]).expect("known"));
        for lane in 0..4 {
            together.set_lane(lane, &values);
        }
        let (alone, together) = (answer(&alone, &MOMENT), answer(&together, &MOMENT));
        for (one, lanes) in alone.numbers().into_iter().zip(together.numbers()) {
            assert_eq!(one.to_bits(), lanes.get(3).to_bits(), "{}", term.id);
        }
    }
}

/// On the piece on which it lies a law is what it is without pieces, and none of the piece is used up.
#[test]
fn exact_pieces_are_the_law() {
    for term in TERMS {
        let terms = terms_with(&[term.id], &defaults(term));
        for moment in grid() {
            let free = answer(&terms, &moment);
            let held = answer_on(&terms, &moment, Some(&free.corners));
            for (one, other) in free.numbers().into_iter().zip(held.numbers()) {
                assert_eq!(one, other, "{}", term.id);
            }
            assert!(held.corners.iter().all(|margin| *margin >= 0.0), "{}: {:?}", term.id, held.corners);
        }
    }
}

#[test]
fn exact_friction_never_drives() {
    let asymmetric = "asymmetric_friction";
    let position = "position_dependent_friction";
    let choices: [&[&str]; 9] = [
        &["coulomb_friction"],
        &["coulomb_friction_smooth"],
        &["stribeck_friction"],
        &["load_dependent_friction"],
        &["nonlinear_viscous"],
        &["load_side_friction"],
        &["stribeck_friction", asymmetric, position],
        &["coulomb_friction", "load_dependent_friction", asymmetric, "wear_run_in"],
        &["coulomb_friction", "thermal_viscous", asymmetric, "wear_run_in"],
    ];
    for choice in choices {
        let on: Vec<&TermInfo> = TERMS.iter().filter(|term| choice.contains(&term.id)).collect();
        for corner in 0..2 {
            let plausible = |parameter: &super::TermParameter| match corner {
                0 => parameter.plausible.0,
                _ => parameter.plausible.1,
            };
            let values: Vec<f64> = on.iter().flat_map(|term| term.parameters.iter().map(plausible)).collect();
            let terms = terms_with(choice, &values);
            for moment in grid() {
                let Answer { motor, output, .. } = answer(&terms, &moment);
                let oil = motor.drag * (motor.viscous * moment.omega_m - motor.handed_on * moment.omega_l());
                let dry = motor.direction.mul_add(motor.level, motor.bias + motor.resisting) * moment.omega_m;
                assert!(oil >= 0.0 && dry >= 0.0, "{choice:?}");
                assert!(output.direction * output.level * moment.omega_l() >= 0.0, "{choice:?}");
                assert!(motor.level >= 0.0 && motor.breakaway >= 0.0);
            }
        }
    }
}

/// What terms take, less what they store, is lost: never less than nothing, together with what the dampers lose.
#[test]
fn exact_no_term_creates_energy() {
    for term in TERMS {
        for values in corners(term, |parameter| parameter.plausible) {
            assert_no_energy_is_created(&[term.id], &values);
        }
    }
}

/// Bristles store energy, which what scales friction does not create either.
#[test]
fn exact_no_scale_of_bristles_creates_energy() {
    let bristles = info("presliding_friction");
    for id in ["position_dependent_friction", "asymmetric_friction", "wear_run_in"] {
        let scale = info(id);
        for mut values in corners(scale, |parameter| parameter.plausible) {
            values.extend(defaults(bristles));
            assert_no_energy_is_created(&[id, bristles.id], &values);
        }
    }
}

fn assert_no_energy_is_created(ids: &[&str], values: &[f64]) {
    let terms = terms_with(ids, values);
    for moment in grid() {
        let found = answer(&terms, &moment);
        let Answer { motor, output, gear, mesh, .. } = &found;
        let taken = [
            (motor.torque() + motor.viscous) * moment.omega_m,
            (output.torque() - motor.handed_on) * moment.omega_l(),
            gear.added_torque * moment.windup_rate,
            -moment.gear_torque * mesh.added_windup_rate,
        ];
        let rate_of = |state: usize| found.rates.iter().map(|rates| rates[state]).find(|rate| !rate.is_nan());
        let stored = |time: f64| {
            let states = std::array::from_fn(|state| moment.hidden + time * rate_of(state).unwrap_or(0.0));
            let windup = moment.windup + time * moment.windup_rate;
            terms.stored(&Gear::new(windup, moment.windup_rate), &states)
        };
        let step = 1e-7;
        let storing = (stored(step) - stored(-step)) / (2.0 * step);
        let size = taken.iter().map(|power| power.abs()).sum::<f64>() + storing.abs();
        let lost = taken.iter().sum::<f64>() - storing;
        assert!(lost >= -1e-6 * size - 1e-9, "{ids:?} {values:?}: {lost} of {size}");
    }
}

/// Torque and stiffness that a term adds to the spring are the derivatives of the energy it adds.
#[test]
fn exact_what_is_added_to_the_spring_has_an_energy() {
    for term in TERMS {
        for values in corners(term, |parameter| parameter.plausible) {
            let terms = terms_with(&[term.id], &values);
            for windup in [-4e-4, -1.2e-5, 0.0, 3e-5, 2e-4] {
                let torque = |windup: f64| answer(&terms, &Moment { windup, ..MOMENT }).gear.added_spring_torque;
                let step = 1e-9;
                let slope = |law: &dyn Fn(f64) -> f64| (law(windup + step) - law(windup - step)) / (2.0 * step);
                let (own, stiffness) = (slope(&|x| terms.added_spring_energy(x)), slope(&torque));
                let added = terms.added_stiffness(windup);
                assert!((own - torque(windup)).abs() < 1e-6, "{} {values:?}: {own}", term.id);
                assert!((stiffness - added).abs() < 1e-5 * added.abs() + 1e-3, "{} {values:?}: {stiffness}", term.id);
            }
        }
    }
}

#[test]
fn exact_asymmetry_scales_the_level_of_each_direction() {
    let ids = ["coulomb_friction", "load_dependent_friction", "asymmetric_friction"];
    let (level, shares, eps) = (0.03, [0.1, 0.3], 0.1);
    let terms = terms_with(&ids, &[eps, 0.0, level, shares[0], shares[1]]);
    for gear_torque in [-6.0, 6.0] {
        let dry = |way: f64| {
            let share = if gear_torque * way > 0.0 { shares[0] } else { shares[1] };
            way * (1.0 + eps * way) * (level + share * f64::abs(gear_torque) / 121.0)
        };
        let motor = |omega_m: f64| answer(&terms, &Moment { omega_m, gear_torque, ..MOMENT }).motor;
        assert!((motor(5.0).torque() - dry(1.0)).abs() < 1e-16 && (motor(-5.0).torque() - dry(-1.0)).abs() < 1e-16);
        let held = motor(0.0);
        assert!((held.either_way() + held.breakaway - dry(1.0)).abs() < 1e-16);
        assert!((held.either_way() - held.breakaway - dry(-1.0)).abs() < 1e-16);
    }
}

#[test]
fn exact_slope_of_the_kinematic_error() {
    let ids = ["te_harmonic", "te_load_dependence", "te_beat", "tooth_passage", "local_fault"];
    for id in ids {
        let term = info(id);
        for values in corners(term, |parameter| parameter.plausible) {
            let terms = terms_with(&[id], &values);
            for step in 0..40 {
                let theta_m = 0.173 * f64::from(step);
                let mesh = |theta_m: f64| answer(&terms, &Moment { theta_m, ..MOMENT }).mesh;
                let error = |shift: f64| mesh(theta_m + shift * 1e-5).error;
                let fourth = 8.0 * (error(1.0) - error(-1.0)) - (error(2.0) - error(-2.0));
                let slope = mesh(theta_m).error_slope - 2e-5;
                let numerical = fourth / 12e-5;
                assert!(
                    (slope - numerical).abs() < 1e-6 * slope.abs().max(1e-4),
                    "{id} {values:?}: {slope} {numerical}"
                );
            }
        }
    }
}

/// Curvature and dependence on speed against differences of the slope, along the motor angle and the memory with it.
#[test]
fn exact_rates_of_the_slope() {
    for id in ["te_harmonic", "te_load_dependence", "te_beat", "tooth_passage", "local_fault", "te_hysteresis"] {
        let term = info(id);
        for values in corners(term, |parameter| parameter.plausible) {
            let terms = terms_with(&[id], &values);
            for step in 0..40 {
                let at = Moment { theta_m: 0.173 * f64::from(step), omega_m: 0.03, ..MOMENT };
                let found = answer(&terms, &at);
                let per_angle = if term.states.is_empty() { 0.0 } else { found.rates[1][0] / at.omega_m };
                let slope = |angle: f64, speed: f64| {
                    let hidden = at.hidden + per_angle * angle;
                    let moment = Moment { theta_m: at.theta_m + angle, omega_m: at.omega_m + speed, hidden, ..at };
                    answer(&terms, &moment).mesh.error_slope
                };
                let difference = |along: &dyn Fn(f64) -> f64| {
                    (8.0 * (along(1e-5) - along(-1e-5)) - (along(2e-5) - along(-2e-5))) / 12e-5
                };
                let curvature = difference(&|angle| slope(angle, 0.0));
                let by_speed = difference(&|speed| slope(0.0, speed));
                let Mesh { error_curvature, slope_by_speed, .. } = found.mesh;
                let close = |one: f64, other: f64| (one - other).abs() < 1e-5 * one.abs().max(1e-3);
                assert!(close(error_curvature, curvature), "{id} {values:?}: {error_curvature} {curvature}");
                assert!(close(slope_by_speed, by_speed), "{id} {values:?}: {slope_by_speed} {by_speed}");
            }
        }
    }
}

#[test]
fn exact_reactions_of_a_varying_stiffness() {
    let terms = terms_with(&["mesh_stiffness_variation"], &[0.05, 0.4, 0.03, -1.1]);
    let gear = |theta_m: f64| answer(&terms, &Moment { theta_m, ..MOMENT }).gear;
    for step in 0..50 {
        let theta = 0.31 * f64::from(step);
        let h = 1e-5;
        let numerical = (gear(theta + h).stiffness_factor - gear(theta - h).stiffness_factor) / (2.0 * h);
        let found = gear(theta);
        let slope = found.motor_reaction + found.load_reaction / 121.0;
        assert!((slope - numerical).abs() < 1e-9, "{slope} {numerical}");
    }
}

/// Slip and tooth jump let go their shares of the windup that both have left.
#[test]
fn exact_slip_and_jump_of_teeth_share_the_windup() {
    let terms = terms_with(&["coupling_slip", "ratcheting"], &[9.0, 0.6, 9.0, 9000.0]);
    let pitch = std::f64::consts::TAU / 9000.0;
    let gear = |states: &[f64; HIDDEN], windup: f64| {
        let mut gear = Gear::new(windup, 0.0);
        terms.gear(
            &Motion::of_motor(0.0, 0.0, 1.0 / 121.0),
            &mut gear,
            &mut Internals::new(states, Corners::new(None)),
        );
        gear
    };
    let [slipped, jumped, windup] = [1e-4, -2e-4, 5e-4];
    let mut engaged = [0.0; HIDDEN];
    engaged[..2].copy_from_slice(&[slipped, jumped]);
    let found = gear(&engaged, windup);
    assert_eq!(found.spring_windup, windup - slipped - jumped);
    terms.jump(&found, 10.0, &mut engaged);
    assert!((engaged[0] - slipped - 0.6 * (windup - slipped - jumped)).abs() < 1e-18);
    let riding = |windup: f64| {
        let mut states = [0.0; HIDDEN];
        states[..3].copy_from_slice(&[slipped, jumped, 1.0]);
        let found = gear(&states, windup);
        terms.reserve(&found, 0.0, &states)
    };
    let fallen = slipped + jumped + pitch;
    assert!(riding(fallen - 1e-6) > 0.0 && riding(fallen + 1e-6) < 0.0);
}

#[test]
fn exact_start_in_motion() {
    let terms = terms_with(&["input_compliance", "load_compliance"], &[200.0, 5e-3, 0.63, 5e4, 10.0, 0.8]);
    let motion = Motion { omega_l: 0.06, ..Motion::of_motor(0.0, 7.0, 1.0 / 121.0) };
    let mut states = [0.0; HIDDEN];
    terms.begin(&motion, &mut states);
    assert_eq!(states[..4], [0.0, 7.0, 0.0, 0.06]);
}
