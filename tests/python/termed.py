"""What the tests of the terms share: every term with parameters that make it large, and calls of the engine."""

from __future__ import annotations

import hdfast
import numpy as np
from drives import SCENARIO

TRAJECTORY = ["theta_m", "omega_m", "theta_l", "omega_l"]

# id: parameters by column name, chosen so that the effect is large
VALUES = {
    "delay": {"tau_d": 4e-3},
    "torque_saturation": {"tau_limit": 0.13, "tau_stall": 0.2, "omega_free": 100.0},
    "actuator_lag": {"tau_e": 5e-3},
    "torque_gain": {"gain_error": 0.1, "saturation_share": 0.2, "tau_peak": 0.22},
    "torque_ripple": {
        "pole_pairs": 4.0,
        "r_2": 0.03,
        "torque_ripple_psi_2": 0.4,
        "r_6": 0.02,
        "psi_6": -1.0,
        "tau_off": 0.01,
        "torque_ripple_psi_1": 2.0,
    },
    "cogging": {"cogging_order": 24.0, "T_cog": 0.02, "cogging_psi_1": 0.3, "T_cog_2": 0.01, "cogging_psi_2": 1.1},
    "input_compliance": {"k_ci": 60.0, "c_ci": 4e-3, "rotor_share": 0.6},
    "te_harmonic": {"te_harmonic_order": 120 / 121, "te_harmonic_A_cos": 1e-4, "te_harmonic_A_sin": -5e-5},
    "te_load_dependence": {
        "te_load_dependence_order": 3.0,
        "te_load_dependence_A_cos": 7e-6,
        "te_load_dependence_A_sin": 4e-6,
    },
    "te_beat": {"te_beat_A_cos": 6e-5, "te_beat_A_sin": 5e-5},
    "te_hysteresis": {"direction_offset": 1e-4, "settling_angle": 0.4},
    "tooth_passage": {
        "teeth": 240.0,
        "A_one_lobe": 1e-5,
        "tooth_passage_psi_1": 0.3,
        "A_both_lobes": 4e-6,
        "tooth_passage_psi_2": -0.8,
    },
    "local_fault": {"fault_height": 1e-4, "local_fault_order": 2.0, "local_fault_psi": 0.5, "fault_width": 0.4},
    "coupling_slip": {"T_slip": 9.0, "relief": 0.6},
    "ratcheting": {"T_rat": 9.0, "spline_teeth": 9000.0},
    "backlash": {"half_gap": 5e-5},
    "soft_windup": {"delta_K": 1.2e4, "phi_0": 6e-5},
    "mesh_stiffness_variation": {
        "eps_2": 0.2,
        "mesh_stiffness_variation_psi_2": 0.7,
        "eps_o": 0.15,
        "psi_o": -0.4,
    },
    "hysteresis": {"T_h": 4.0, "phi_h": 2e-4, "hysteresis_beta": 0.7, "loop_sharpness": 1.6},
    "maxwell_slip": {"maxwell_slip_T_h": 4.0, "maxwell_slip_phi_h": 2e-4},
    "viscoelastic": {"K_v": 6000.0, "tau_short": 0.02, "tau_long": 0.5},
    "coulomb_friction": {"coulomb_friction_T_c": 0.04},
    "coulomb_friction_smooth": {"coulomb_friction_smooth_T_c": 0.04, "omega_eps": 0.5},
    "stribeck_friction": {
        "stribeck_friction_T_c": 0.03,
        "stribeck_friction_breakaway_ratio": 1.5,
        "stribeck_friction_omega_s": 5.0,
        "stribeck_shape": 1.4,
    },
    "presliding_friction": {
        "sigma_0": 3.0,
        "sigma_1": 0.02,
        "presliding_friction_T_c": 0.03,
        "presliding_friction_breakaway_ratio": 1.3,
        "presliding_friction_omega_s": 3.0,
    },
    "load_dependent_friction": {"c_drive": 0.15, "c_back": 0.4},
    "nonlinear_viscous": {"drag_torque": 0.05, "drag_power": 0.7},
    "position_dependent_friction": {
        "friction_ripple": 0.3,
        "position_dependent_friction_order": 2.0,
        "position_dependent_friction_psi": 0.2,
    },
    "asymmetric_friction": {"eps_c": 0.15, "eps_B": 0.2},
    "thermal_viscous": {
        "thermal_viscous_beta": 0.05,
        "heat_capacity": 0.2,
        "cooling_time": 0.5,
        "ambient_temperature": 10.0,
    },
    "wear_run_in": {"friction_wear": 0.3, "error_wear": -0.2, "hours": 4.0, "run_in_hours": 5.0},
    "load_motor_ripple": {"load_ripple": 0.3, "load_motor_ripple_order": 60.0, "load_motor_ripple_psi": 0.4},
    "external_periodic_torque": {"T_external": 3.0, "f_external": 37.0, "external_periodic_torque_psi": 0.6},
    "gravity_unbalance": {"T_gravity": 8.0, "gravity_unbalance_psi": 0.5},
    "load_compliance": {"K_c": 2e4, "c_c": 15.0, "payload_share": 0.7},
    "load_side_friction": {"T_cl": 3.0},
    "rotor_unbalance_reaction": {"unbalance": 3e-4, "rotor_unbalance_reaction_psi": 0.3},
    "base_compliance": {"k_b": 1e5, "c_b": 20.0, "J_b": 0.3},
}
# effects that show only together with another
WITH = {
    "position_dependent_friction": ["coulomb_friction"],
    "asymmetric_friction": ["stribeck_friction"],
    "rotor_unbalance_reaction": ["base_compliance"],
}
COMBINATIONS = [
    ["coulomb_friction", "load_side_friction"],
    ["stribeck_friction", "load_side_friction", "backlash", "te_hysteresis"],
    ["presliding_friction", "hysteresis", "viscoelastic", "base_compliance", "cogging"],
    ["load_dependent_friction", "position_dependent_friction", "asymmetric_friction", "thermal_viscous", "wear_run_in"],
    ["presliding_friction", "position_dependent_friction", "asymmetric_friction", "wear_run_in"],
    ["coulomb_friction_smooth", "nonlinear_viscous", "asymmetric_friction", "thermal_viscous", "wear_run_in"],
    ["delay", "actuator_lag", "torque_ripple", "torque_gain", "input_compliance", "load_compliance"],
    ["backlash", "soft_windup", "mesh_stiffness_variation", "hysteresis", "gravity_unbalance"],
    ["soft_windup", "maxwell_slip", "load_side_friction"],
    ["te_harmonic", "te_load_dependence", "te_beat", "tooth_passage", "local_fault", "load_motor_ripple"],
]

# without a spring to even them out, or in company, 240 teeth take SciPy long
FEWER_TEETH = {"teeth": 12.0, "A_one_lobe": 5e-5, "A_both_lobes": 1e-5}

# forward, back, then free: (until, motor torque); slow enough at the end for dry friction in company to stop it
RUN = [(0.1, 0.16), (0.22, -0.15), (0.6, 0.0)]
LOAD = 4.0


def with_company(terms):
    """The terms, those they need to show, and the parameters of all of them."""
    on = [*dict.fromkeys([*(other for term in terms for other in WITH.get(term, [])), *terms])]
    return on, {name: value for term in on for name, value in VALUES[term].items()}


def simulate(p, terms, scenario, t, signals=TRAJECTORY, start=None, rtol=1e-10, base="two_inertia", **options):
    """One row of the engine as an array (signals, times), from rest at zero angles unless `start` says otherwise."""
    model = hdfast.Model(base=base, terms=terms)
    state = np.zeros((1, len(model.states)))
    if start is not None:
        state[0, : len(start)] = start
    row = {name: value for name, value in p.items() if name not in SCENARIO}
    run = hdfast.simulate(
        row,
        model=model,
        scenario=scenario,
        t_eval=t,
        signals=signals,
        initial_state=state,
        rtol=rtol,
        metrics=["te_pp"],
        **options,
    )
    assert run.status == "finished", run.message
    return np.array([run[name] for name in signals])


def torque_steps(pieces, load=0.0):
    """Scenario of constant motor torques, each until its time."""
    times, torques, begin = [], [], 0.0
    for end, torque in pieces:
        times += [begin, end]
        torques += [torque, torque]
        begin = end
    return hdfast.Scenario.torque_profile(times, torques, load=load)


def held_input(t_end, load):
    """Scenario of a locked motor under a load table (times, torques)."""
    t = np.linspace(0.0, t_end, 9)
    return hdfast.Scenario.motion(t, 0.0 * t, t_end=t_end, load=load)


def assert_close(found, expected, rtol):
    """Each signal against its own largest value."""
    for name, one, other in zip(TRAJECTORY, found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=rtol * np.max(np.abs(other)), err_msg=name)
