"""Every kind of term against what can be written down for it: stops, holds, areas, gaps, lines, modes."""

from __future__ import annotations

import math

import hdfast
import numpy as np
import pytest
from drives import SCENARIO, kinematic_error, linear
from oracles import closed_forms
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq
from termed import VALUES, assert_close, held_input, simulate, torque_steps

Scenario = hdfast.Scenario


# friction


def test_exact_coast_down_under_coulomb_friction():
    """Stop at J/B ln(1 + B omega/T_c), after J/B (omega - T_c t/J) rad, and exactly 0 ever after."""
    speed, level = 60.0, 0.03
    p = linear(J_l=1e-3, coulomb_friction_T_c=level)
    J, B = p["J_m"] + p["J_l"] / 121**2, p["B_m"] + p["B_ml"] + p["B_l"] / 121**2
    stop = J / B * math.log1p(B * speed / level)
    angle = (J * speed - level * stop) / B
    t = np.array([0.0, 0.999 * stop, 1.001 * stop, 2.0 * stop, 6.0 * stop])
    scenario = torque_steps([(t[-1], 0.0)])
    start = [0.0, speed, 0.0, speed / p["ratio"], 0.0]
    theta_m, omega_m, *_ = simulate(p, ["coulomb_friction"], scenario, t, start=start)
    assert omega_m[1] > 0.0
    assert np.all(omega_m[2:] == 0.0)
    np.testing.assert_allclose(theta_m[2:], angle, rtol=2e-5)
    assert theta_m[-1] == theta_m[2]


@pytest.mark.parametrize("term", ["coulomb_friction", "stribeck_friction"])
def test_exact_stick_below_breakaway(term):
    """Held for ever below the breakaway torque, moved above it."""
    values = VALUES[term]
    holding = values[f"{term}_T_c"] * values.get(f"{term}_breakaway_ratio", 1.0)
    t = np.linspace(0.0, 20.0, 21)
    for share in (0.999, 1.001):
        p = linear(**values, B_l=0.0)
        _, omega_m, _, _ = simulate(p, [term], torque_steps([(20.0, share * holding)]), t, rtol=1e-8)
        assert np.all(omega_m == 0.0) if share < 1.0 else omega_m[-1] > 1e-3


def test_exact_pull_in_and_breakaway_under_a_rising_torque():
    """A torque that rises as a ramp moves the shaft when it passes the level, not before."""
    level = VALUES["coulomb_friction"]["coulomb_friction_T_c"]
    p = linear(**VALUES["coulomb_friction"])
    scenario = Scenario.torque_profile([0.0, 1.0], [0.0, 2.0 * level])
    t = np.array([0.0, 0.4999, 0.501, 0.52])
    omega_m = simulate(p, ["coulomb_friction"], scenario, t)[1]
    assert np.all(omega_m[:2] == 0.0)
    np.testing.assert_allclose(omega_m[2], level * 1e-6 / p["J_m"], rtol=2e-2)


def test_exact_asymmetric_hold():
    """The hold of a shaft with asymmetric friction is as asymmetric as its sliding friction."""
    values = {"coulomb_friction_T_c": 0.03, "eps_c": 0.15, "eps_B": 0.0}
    terms = ["coulomb_friction", "asymmetric_friction"]
    t = np.array([0.0, 1.0])
    for torque, moves in ((0.0344, False), (0.0346, True), (-0.0254, False), (-0.0256, True)):
        omega_m = simulate(linear(**values), terms, torque_steps([(1.0, torque)]), t)[1, -1]
        assert (omega_m != 0.0) == moves, torque
        assert omega_m * torque >= 0.0


@pytest.mark.parametrize("term", ["coulomb_friction_smooth", "presliding_friction"])
def test_exact_asymmetry_of_laws_that_do_not_stick(term):
    """At an even speed, forward and backward, the level is T_c (1 +- eps_c)."""
    level, eps, speed = VALUES[term][f"{term}_T_c"], 0.15, 30.0
    p = linear(B_l=0.0, **VALUES[term], eps_c=eps, eps_B=0.0)
    t = np.linspace(0.0, 3.0, 31)
    for way in (1.0, -1.0):
        scenario = Scenario.motion(t, way * speed * t)
        start = [0.0, way * speed, 0.0, way * speed / p["ratio"], 0.0]
        torque = simulate(p, [term, "asymmetric_friction"], scenario, t, ["tau_m"], start)[0, -1]
        own = torque - way * speed * (p["B_m"] + p["B_ml"])
        np.testing.assert_allclose(own, way * level * (1.0 + way * eps), rtol=1e-6)


def test_exact_load_side_friction_shifts_the_windup():
    """At slow speed the windup is +-T_cl/K by the direction, beside the viscous part."""
    level, speed = VALUES["load_side_friction"]["T_cl"], 2.0
    p = linear(**VALUES["load_side_friction"], B_l=0.0)
    for way in (1.0, -1.0):
        t = np.linspace(0.0, 2.0, 41)
        scenario = Scenario.motion(t, way * speed * t)
        start = [0.0, way * speed, -way * level / p["k1"], way * speed / p["ratio"], 0.0]
        windup = simulate(p, ["load_side_friction"], scenario, t, ["windup"], start)[0, -1]
        np.testing.assert_allclose(windup, way * level / p["k1"], rtol=1e-6)


def test_exact_presliding_loops_close():
    """Under a torque that swings below breakaway, the second and the third loop are the same."""
    swing, period = 0.02, 2.0
    corners = np.arange(0.0, 7.0) * period / 2 + 0.25 * period
    t = np.concatenate([[0.0], corners])
    torque = np.concatenate([[0.0], swing * (-1.0) ** np.arange(len(corners))])
    p = linear(**VALUES["presliding_friction"], B_l=50.0)
    grid = np.linspace(0.25 * period, 0.25 * period + 3 * period, 301)
    scenario = Scenario.torque_profile(t, torque)
    theta_m = simulate(p, ["presliding_friction"], scenario, grid, ["theta_m"], rtol=1e-9)[0]
    loops = theta_m[:300].reshape(3, 100)
    size = np.ptp(loops[1])
    assert 0.5 < size / (2 * swing / p["sigma_0"]) < 4.0
    assert np.max(np.abs((loops[2] - loops[2, 0]) - (loops[1] - loops[1, 0]))) < 0.02 * size
    commanded = np.interp(grid[:100], t, torque)
    area = abs(np.trapezoid(commanded, loops[2]))
    assert area > 0.02 * swing * size


def test_exact_terminal_speed_under_nonlinear_drag():
    values = VALUES["nonlinear_viscous"]
    p = linear(**values)

    def missing(speed):
        own = values["drag_torque"] * speed / 100 * (math.hypot(speed, 0.1) / 100) ** (values["drag_power"] - 1)
        return own + (p["B_m"] + p["B_ml"] + p["B_l"] / p["ratio"] ** 2) * speed - 0.05

    t = np.array([0.0, 5.0])
    omega_m = simulate(p, ["nonlinear_viscous"], torque_steps([(5.0, 0.05)]), t)[1, -1]
    np.testing.assert_allclose(omega_m, brentq(missing, 1.0, 100.0), rtol=1e-6)


# windup


def bouc_wen_area(swing, values):
    """Area of the steady loop of the hysteresis torque over a windup that swings, by SciPy in the windup itself."""
    T, phi_h, b, n = (values[name] for name in ("T_h", "phi_h", "hysteresis_beta", "loop_sharpness"))
    area, zeta = 0.0, 0.0
    for turn in range(21):
        way = -1.0 if turn % 2 else 1.0

        def slope(s, y, way=way):
            size = abs(y[0]) ** n
            change = (way - b * size * np.sign(y[0]) - (1 - b) * way * size) / phi_h
            return [change, T * y[0] * way]

        length = swing if turn == 0 else 2.0 * swing
        part = solve_ivp(slope, (0.0, length), [zeta, 0.0], method="DOP853", rtol=1e-11, atol=1e-14)
        zeta = part.y[0, -1]
        if turn >= 19:
            area += part.y[1, -1]
    return area


def test_exact_hysteresis_area_does_not_depend_on_rate():
    """Against an output too heavy to move, the loop beyond spring and damper has the area of Bouc-Wen."""
    values = VALUES["hysteresis"]
    p = linear(J_l=1e8, B_l=0.0, **values)
    swing = 0.04
    area = bouc_wen_area(swing / p["ratio"], values)
    for period in (0.02, 0.2, 2.0):
        t = np.linspace(0.0, 5.0 * period, 10_001)
        angle = swing * np.sin(2 * np.pi * t / period) ** 3
        signals = ["windup", "windup_rate", "gear_torque"]
        windup, rate, torque = simulate(p, ["hysteresis"], Scenario.motion(t, angle), t, signals)
        beyond = torque - p["k1"] * windup - p["B_sp"] * rate
        last = t >= 4.0 * period
        np.testing.assert_allclose(np.trapezoid(beyond[last] * rate[last], t[last]), area, rtol=1e-4)


def test_exact_slip_elements_load_and_unload():
    """Against an output too heavy to move: from rest artanh z + arctan z = 2 windup/yield, on the way back a line."""
    values = VALUES["maxwell_slip"]
    p = linear(J_l=1e8, B_l=0.0, **values)
    top = 1.5 * values["maxwell_slip_phi_h"]
    t = np.linspace(0.0, 2.0, 401)
    angle = p["ratio"] * top * np.sin(0.5 * np.pi * t) ** 2
    windup, rate, torque = simulate(
        p, ["maxwell_slip"], Scenario.motion(t, angle), t, ["windup", "windup_rate", "gear_torque"]
    )
    yields = values["maxwell_slip_phi_h"] * np.array([0.25, 0.75, 1.25, 1.75])

    def loaded(stretch):
        return brentq(lambda z: math.atanh(z) + math.atan(z) - 2.0 * stretch, 0.0, 1.0 - 1e-15)

    turned = windup[200]
    tops = np.array([loaded(turned / one) for one in yields])
    carried = torque - p["k1"] * windup - p["B_sp"] * rate
    for index in (60, 110, 150, 200):
        expected = np.mean([loaded(windup[index] / one) for one in yields])
        np.testing.assert_allclose(carried[index], values["maxwell_slip_T_h"] * expected, rtol=1e-6)
    for index in (210, 215):
        unloaded = np.mean(tops - (turned - windup[index]) / yields)
        np.testing.assert_allclose(carried[index], values["maxwell_slip_T_h"] * unloaded, rtol=1e-6)


def test_exact_backlash_loses_the_gap_at_reversal():
    """Input locked, load reversed: the windups differ by 2 T/K and the whole gap."""
    gap = VALUES["backlash"]["half_gap"]
    p = linear(B_l=5.0, **VALUES["backlash"])
    load = 10.0
    scenario = held_input(4.0, ([0.0, 2.0, 2.0, 4.0], [load, load, -load, -load]))
    windup = simulate(p, ["backlash"], scenario, np.array([0.0, 2.0, 4.0]), ["windup"])[0]
    np.testing.assert_allclose(windup[1] - windup[2], 2 * load / p["k1"] + 2 * gap, rtol=1e-9)
    np.testing.assert_allclose(windup[1], -windup[2], rtol=1e-9)


def test_exact_static_curve_of_the_soft_spring():
    values = VALUES["soft_windup"]
    for load in (1.0, 4.0, 20.0):
        p = linear(B_l=5.0, **values)
        scenario = held_input(3.0, ([0.0, 3.0], [load, load]))
        windup = simulate(p, ["soft_windup"], scenario, np.array([0.0, 3.0]), ["windup"])[0, -1]
        missing = values["delta_K"] * values["phi_0"] * math.tanh(windup / values["phi_0"])
        np.testing.assert_allclose(p["k1"] * windup - missing, load, rtol=1e-8)


def test_exact_creep():
    """A load step with the input locked: at once T/(K + K_v), in the end T/K."""
    values = {"K_v": 6000.0, "tau_short": 0.2, "tau_long": 0.5}
    p = linear(B_l=5.0, B_sp=100.0, **values)
    scenario = held_input(8.0, ([0.0, 8.0], [10.0, 10.0]))
    t = np.array([0.0, 0.1, 8.0])
    windup = simulate(p, ["viscoelastic"], scenario, t, ["windup"])[0]
    np.testing.assert_allclose(windup[2], 10.0 / p["k1"], rtol=1e-6)
    assert 10.0 / (p["k1"] + 6000.0) < windup[1] < 10.0 / p["k1"]


def test_exact_varying_stiffness_conserves_energy():
    """Without damping, kinetic energy and V_s f stay what they were."""
    values = {"eps_2": 0.3, "mesh_stiffness_variation_psi_2": 0.7, "eps_o": 0.2, "psi_o": -0.4}
    p = linear(B_m=0.0, B_l=0.0, B_ml=0.0, B_sp=0.0, **values)
    t = np.linspace(0.0, 0.5, 201)
    start = [0.0, 60.0, 0.0, 60.0 / 121 + 0.05, 0.0]
    scenario = torque_steps([(0.5, 0.0)])
    theta_m, omega_m, theta_l, omega_l = simulate(p, ["mesh_stiffness_variation"], scenario, t, start=start)
    factor = 1 + values["eps_2"] * np.cos(2 * theta_m + 0.7) + values["eps_o"] * np.cos(theta_l - 0.4)
    potential = 0.5 * p["k1"] * (theta_m / 121 - theta_l) ** 2 * factor
    energy = 0.5 * p["J_m"] * omega_m**2 + 0.5 * p["J_l"] * omega_l**2 + potential
    np.testing.assert_allclose(energy, energy[0], rtol=1e-8)
    assert np.ptp(potential) > 5e-4 * energy[0]


# lines


LINES = {
    "te_harmonic": (
        120 / 121,
        1e-5,
        {"te_harmonic_order": 120 / 121, "te_harmonic_A_cos": 6e-6, "te_harmonic_A_sin": 8e-6},
    ),
    "te_beat": (240 / 121, 1e-5, {"te_beat_A_cos": -8e-6, "te_beat_A_sin": 6e-6}),
    "te_load_dependence": (
        2.0,
        1e-5,
        {"te_load_dependence_order": 2.0, "te_load_dependence_A_cos": 3e-7, "te_load_dependence_A_sin": 4e-7},
    ),
    "tooth_passage": (
        240.0,
        2e-6,
        {
            "teeth": 240.0,
            "A_one_lobe": 2e-6,
            "tooth_passage_psi_1": 1.0,
            "A_both_lobes": 0.0,
            "tooth_passage_psi_2": 0.0,
        },
    ),
}


@pytest.mark.parametrize("term", LINES)
def test_exact_lines_of_the_kinematic_error(term):
    """With the motor speed held, the line shows at its order with A |H|."""
    order, amplitude, values = LINES[term]
    p = linear(te_scale=1.0, **kinematic_error([0.0] * 15), **values)
    load = 20.0 if term == "te_load_dependence" else 0.0
    speed = 12.0
    t = np.linspace(0.0, 1.0 + 2 * math.pi * 121 / speed, 9)
    scenario = Scenario.motion(t, speed * t, load=load)
    samples = np.linspace(1.0, t[-1], 121 * 1024 + 1)[:-1]
    te = simulate(p, [term], scenario, samples, ["te"], rtol=1e-8)[0]
    line = 2 * abs(np.mean((te - te.mean()) * np.exp(-1j * order * speed * samples)))
    np.testing.assert_allclose(line, amplitude * closed_forms.forced_gain(p, order * speed), rtol=2e-3)


def test_exact_te_differs_by_direction():
    """Forward and backward, the mean transmission error differs by 2 delta."""
    values = VALUES["te_hysteresis"]
    p = linear(**values, B_l=0.0)
    means = []
    for way in (1.0, -1.0):
        t = np.linspace(0.0, 4.0, 41)
        te = simulate(p, ["te_hysteresis"], Scenario.motion(t, way * 2.0 * t), t, ["te"], [0.0, way * 2.0])[0]
        means.append(te[-1])
    np.testing.assert_allclose(means[0] - means[1], 2 * values["direction_offset"], rtol=1e-5)


RIPPLES = {
    "cogging": (
        (24.0, 60.0, 1e-3),
        {"cogging_order": 24.0, "T_cog": 1e-3, "cogging_psi_1": 0.3, "T_cog_2": 0.0, "cogging_psi_2": 0.0},
    ),
    "position_dependent_friction": (
        (4.0, 400.0, 0.05 * 0.02),
        {
            "coulomb_friction_T_c": 0.02,
            "friction_ripple": 0.05,
            "position_dependent_friction_order": 4.0,
            "position_dependent_friction_psi": 0.3,
        },
    ),
}


@pytest.mark.parametrize("term", RIPPLES)
def test_exact_lines_of_the_torque(term):
    """A small torque ripple at high order moves the speed of the motor by T / (J_m n omega)."""
    (order, speed, torque), values = RIPPLES[term]
    terms = [term, "coulomb_friction"] if "coulomb_friction_T_c" in values else [term]
    p = linear(**values)
    sustaining = (p["B_m"] + p["B_ml"] + p["B_l"] / 121**2) * speed + values.get("coulomb_friction_T_c", 0.0)
    t = 1.0 + np.arange(8 * 1024) / 1024 * 2 * math.pi / speed
    start = [0.0, speed, -p["B_l"] * speed / 121 / p["k1"], speed / 121, 0.0]
    theta_m, omega_m, *_ = simulate(p, terms, torque_steps([(t[-1] + 0.01, sustaining)]), t, start=start)
    line = 2 * abs(np.mean((omega_m - omega_m.mean()) * np.exp(-1j * order * theta_m)))
    matrix, motor, _ = closed_forms.two_mass_matrix(p)
    response = np.linalg.solve(1j * order * speed * np.eye(4) - matrix, motor * torque)[2] * p["ratio"]
    np.testing.assert_allclose(line, abs(response), rtol=1e-2)
    np.testing.assert_allclose(line, torque / (p["J_m"] * order * speed), rtol=5e-2)


# added bodies and drives: all linear, so the response is a matrix exponential


def chain(masses, springs, drag, forces):
    """System matrix and input column of bodies; each spring has the row that gives its stretch, k and c."""
    count = len(masses)
    stiffness, damping = np.zeros((count, count)), np.diag(drag).astype(float)
    for stretch, k, c in springs:
        stiffness += k * np.outer(stretch, stretch)
        damping += c * np.outer(stretch, stretch)
    inertia = np.asarray(masses)[:, None]
    matrix = np.block([[np.zeros((count, count)), np.eye(count)], [-stiffness / inertia, -damping / inertia]])
    return matrix, np.concatenate([np.zeros(count), np.asarray(forces) / inertia[:, 0]])


def bodies(term, p, torque, load):
    """The drive and one more body; the first two are motor (wave generator) and output."""
    i, gear = p["ratio"], (p["k1"], p["B_sp"])
    drag = [p["B_m"] + p["B_ml"], p["B_l"], 0.0]
    if term == "base_compliance":
        springs = [([1 / i, -1.0, 1 - 1 / i], *gear), ([0, 0, 1.0], p["k_b"], p["c_b"])]
        return chain([p["J_m"], p["J_l"], p["J_b"]], springs, drag, [torque, -load, 0.0])
    if term == "load_compliance":
        far = p["payload_share"] * p["J_l"]
        springs = [([1 / i, -1.0, 0], *gear), ([0, 1.0, -1.0], p["K_c"], p["c_c"])]
        return chain([p["J_m"], p["J_l"] - far, far], springs, drag, [torque, 0.0, -load])
    rotor = p["rotor_share"] * p["J_m"]
    springs = [([1 / i, -1.0, 0], *gear), ([1.0, 0, -1.0], p["k_ci"], p["c_ci"])]
    return chain([p["J_m"] - rotor, p["J_l"], rotor], springs, drag, [0.0, -load, torque])


WOUND = {
    "base_compliance": lambda p, load: -(1.0 - 1.0 / p["ratio"]) * load / p["k_b"],
    "load_compliance": lambda p, load: -load / p["K_c"],
    "input_compliance": lambda p, load: load / p["ratio"] / p["k_ci"],
}


@pytest.mark.parametrize("term", WOUND)
def test_exact_modes_with_one_more_body(term):
    """Step response against the matrix exponential of the three bodies, and its modes against the undamped ones.

    The load has wound up the further body.
    """
    p = linear(**VALUES[term])
    torque, load, t_end = 0.05, 3.0, 0.3
    t = np.linspace(0.0, t_end, 61)
    found = simulate(p, [term], torque_steps([(t_end, torque)], load), t)
    matrix, column = bodies(term, p, torque, load)
    augmented = np.zeros((7, 7))
    augmented[:6, :6], augmented[:6, 6] = matrix, column
    start = np.zeros(7)
    start[[2, 6]] = WOUND[term](p, load), 1.0
    states = np.array([expm(augmented * x)[:6] @ start for x in t]).T
    assert_close(found, states[[0, 3, 1, 4]], 1e-8)
    undamped = matrix[3:, :3]
    squares = np.sort(np.linalg.eigvals(-undamped).real)
    damped = np.sort(np.abs(np.linalg.eigvals(matrix)))
    np.testing.assert_allclose(damped[-1], math.sqrt(squares[-1]), rtol=5e-2)


def test_exact_a_motor_before_its_coupling_takes_no_torque_for_the_rotor():
    """`tau_m` of an imposed motion is that of the wave generator: the rotor's share of J_m is missing in it."""
    values = VALUES["input_compliance"]
    p = linear(**values)
    t = np.linspace(0.0, 0.1, 101)
    scenario = Scenario.motion(t, 0.5 * (1.0 - np.cos(60.0 * t)))
    coupled = simulate(p, ["input_compliance"], scenario, t, ["tau_m"])[0]
    whole = simulate(linear(), [], scenario, t, ["tau_m"])[0]
    alpha = 0.5 * 60.0**2 * np.cos(60.0 * t)
    missing = values["rotor_share"] * p["J_m"] * alpha
    np.testing.assert_allclose((whole - coupled)[10:-10], missing[10:-10], atol=1e-3 * np.max(missing))


def test_exact_an_unbalance_shakes_a_housing_that_carries_no_gear_torque():
    """With ratio 1 the housing has no arm: neither does it feel the gear nor the windup the housing."""
    values = {"ratio": 1.0, "J_l": 0.01, "B_l": 0.0}
    t = np.linspace(0.0, 1.0, 11)
    both = ["rotor_unbalance_reaction", "base_compliance"]
    shaken = simulate(linear(**values, **VALUES[both[0]], **VALUES[both[1]]), both, torque_steps([(1.0, 0.02)]), t)
    assert_close(shaken, simulate(linear(**values), [], torque_steps([(1.0, 0.02)]), t), 1e-9)


def test_exact_housing_and_gear_in_series():
    """At rest under load the windup and the housing share the torque: apparent 1/K + (1 - 1/i)^2 / k_b."""
    p = linear(B_l=5.0, **VALUES["base_compliance"])
    scenario = held_input(6.0, ([0.0, 6.0], [10.0, 10.0]))
    te = simulate(p, ["base_compliance"], scenario, np.array([0.0, 6.0]), ["te"])[0, -1]
    np.testing.assert_allclose(te, 10.0 * (1 / p["k1"] + (1 - 1 / 121) ** 2 / p["k_b"]), rtol=1e-7)


@pytest.mark.parametrize("term", ["actuator_lag", "delay"])
def test_exact_late_torque(term):
    """Far behind an edge, the speed of a rigid drive without drag is that of a torque which came later by the delay."""
    p = linear(J_l=1e-3, B_m=0.0, B_ml=0.0, B_l=0.0, **VALUES[term])
    late = p["tau_e"] if term == "actuator_lag" else p["tau_d"]
    t = np.array([0.0, 0.2])
    omega_m = simulate(p, [term], torque_steps([(0.2, 0.02)]), t)[1, -1]
    inertia = p["J_m"] + p["J_l"] / 121**2
    np.testing.assert_allclose(omega_m, 0.02 * (0.2 - late) / inertia, rtol=1e-5)


@pytest.mark.parametrize("terms", [["torque_gain"], ["torque_ripple", "actuator_lag"], ["torque_saturation"]])
def test_exact_the_command_goes_on_where_the_brake_takes_over(terms):
    """What the drive makes of the command is not taken for the command: its torque does not jump either."""
    values = {name: value for term in terms for name, value in VALUES[term].items()}
    scenario = Scenario.start_stop(torque=0.2, stop="brake", t_off=1.0, t_end=2.0)
    p = {name: value for name, value in linear(**values, B_m=5e-3).items() if name not in SCENARIO}
    t = np.array([1.0 - 1e-7, 1.0 + 1e-7])
    model = hdfast.Model(terms=terms)
    before, after = hdfast.simulate(p, model=model, scenario=scenario, t_eval=t, signals=["tau_drive"], metrics=[])[
        "tau_drive"
    ]
    np.testing.assert_allclose(after, before, rtol=1e-4)


def test_exact_clipped_torque():
    """A command beyond the limit accelerates with the limit, and up to the speed that the voltage allows."""
    values = {"tau_limit": 0.1, "tau_stall": 0.4, "omega_free": 80.0}
    p = linear(J_l=1e-3, B_m=0.0, B_ml=0.0, B_l=0.0, **values)
    inertia = p["J_m"] + p["J_l"] / 121**2
    t = np.array([0.0, 0.1, 3.0])
    omega_m = simulate(p, ["torque_saturation"], torque_steps([(3.0, 1.0)]), t)[1]
    np.testing.assert_allclose(omega_m[1], 0.1 * 0.1 / inertia, rtol=1e-4)
    np.testing.assert_allclose(omega_m[2], 80.0, rtol=1e-4)


def test_exact_thermal_equilibrium():
    """At held speed the warming settles where exp(-beta w) B omega^2 = C w / tau."""
    values = {"thermal_viscous_beta": 0.05, "heat_capacity": 1.0, "cooling_time": 0.3, "ambient_temperature": 20.0}
    p = linear(B_l=0.0, **values)
    drag, speed = p["B_m"] + p["B_ml"], 60.0
    warming = brentq(lambda w: math.exp(-0.05 * w) * drag * speed**2 - w * 1.0 / 0.3, 0.0, 100.0)
    t = np.linspace(0.0, 5.0, 51)
    scenario = Scenario.motion(t, speed * t)
    start = [0.0, speed, 0.0, speed / 121, 0.0]
    torque = simulate(p, ["thermal_viscous"], scenario, t, ["tau_m"], start)[0, -1]
    np.testing.assert_allclose(torque, drag * speed * math.exp(-0.05 * warming), rtol=1e-5)


def test_exact_pendulum():
    """A payload off the axis swings about its lowest point with m g r over the total inertia."""
    values = {"T_gravity": 10.0, "gravity_unbalance_psi": 0.0}
    p = linear(J_l=12.0, B_m=0.0, B_ml=0.0, B_l=0.0, k1=3e6, **values)
    inertia = p["J_l"] + 121**2 * p["J_m"]
    period = 2 * math.pi / math.sqrt(10.0 / inertia)
    t = np.array([0.0, 0.25, 0.5]) * period
    tilt = 1e-3
    start = [121 * tilt, 0.0, tilt, 0.0, 0.0]
    theta_l = simulate(p, ["gravity_unbalance"], torque_steps([(t[-1], 0.0)]), t, ["theta_l"], start)[0]
    np.testing.assert_allclose(theta_l, [tilt, 0.0, -tilt], atol=1e-3 * tilt)


def test_exact_external_torque_at_its_frequency():
    """The output answers at the frequency of the torque, with the gain of the two-mass model."""
    values = {"T_external": 1.0, "f_external": 30.0, "external_periodic_torque_psi": 0.0}
    p = linear(**values)
    t = np.linspace(1.0, 2.0, 3001)[:-1]
    omega_l = simulate(p, ["external_periodic_torque"], torque_steps([(2.0, 0.0)]), t, ["omega_l"])[0]
    line = 2 * abs(np.mean(omega_l * np.exp(-2j * np.pi * 30.0 * t)))
    matrix, _, load = closed_forms.two_mass_matrix(p)
    response = np.linalg.solve(2j * np.pi * 30.0 * np.eye(4) - matrix, load)[3]
    np.testing.assert_allclose(line, abs(response), rtol=1e-3)


def test_exact_dry_friction_follows_an_imposed_motion_that_trembles_at_rest() -> None:
    t = np.arange(0.0, 2.0, 2e-3)
    angle = np.where(t < 1.0, 30.0 * t, 30.0) + 1e-6 * np.random.default_rng(1).standard_normal(len(t))
    result = hdfast.sweep(
        {"T_c": [0.0, 0.03]},
        model=hdfast.Model(terms=["coulomb_friction"]),
        scenario=hdfast.Scenario.motion(t, angle),
        t_eval=t[50:450],
        signals=["tau_m"],
        metrics=[],
    )
    assert result.status.tolist() == [0, 0]
    assert result.steps.max() < 4 * len(t)
    added = result.samples["tau_m"][1] - result.samples["tau_m"][0]
    np.testing.assert_allclose(added, 0.03, rtol=1e-9)


def test_regress_a_load_that_turns_back_at_once_goes_on() -> None:
    """Let go with little torque to spare: the first step ends behind the next reversal."""
    rng = np.random.default_rng(4)
    t = np.arange(0.0, 0.5, 5e-4)
    size, line, phase = rng.normal(scale=1e-3, size=8), rng.uniform(20.0, 120.0, 8), rng.uniform(0.0, 6.0, 8)
    result = hdfast.sweep(
        {"load_side_friction_T_cl": np.linspace(1e-3, 0.2, 100)},
        model=hdfast.Model(terms=["load_side_friction"]),
        scenario=Scenario.motion(t, size @ np.sin(2 * np.pi * np.outer(line, t) + phase[:, None])),
        t_eval=t[::50],
        metrics=[],
        max_steps=20_000,
    )
    assert result.finished.all(), result.message(int(np.argmin(result.finished)))
    assert result.steps.max() < 2.0 * np.median(result.steps)


# jumps


def test_exact_slip_leaves_a_share_of_the_windup():
    """A load step swings a locked drive once beyond what the coupling holds; relieved, r T_slip/k stays for ever."""
    values = {"T_slip": 20.0, "relief": 0.5}
    p = linear(**values, B_sp=0.0, B_l=20.0)
    t = np.array([0.0, 0.99, 2.0])
    scenario = held_input(2.0, ([0.0, 1.0, 1.1, 2.0], [12.0, 12.0, 0.0, 0.0]))
    windup = simulate(p, ["coupling_slip"], scenario, t, ["windup"], rtol=1e-9)[0]
    np.testing.assert_allclose(windup[1:], np.array([12.0 + 0.5 * 20.0, 0.5 * 20.0]) / p["k1"], rtol=1e-6)


@pytest.mark.parametrize("B_sp", [0.0, 20.0, 100.0])
def test_exact_every_slip_leaves_the_same_share(B_sp):
    """Each slip begins with T_slip on the spring, also where the damper alone carries more than that meanwhile."""
    values = {"T_slip": 20.0, "relief": 0.5}
    p = linear(**values, B_sp=B_sp, B_l=20.0)
    scenario = held_input(2.0, ([0.0, 0.5, 0.5, 0.52, 0.52, 2.0], [0.0, 0.0, 200.0, 200.0, 0.0, 0.0]))
    windup = simulate(p, ["coupling_slip"], scenario, np.array([0.0, 2.0]), ["windup"], rtol=1e-9)[0]
    slips = windup[-1] * p["k1"] / (0.5 * 20.0)
    assert slips > 1.5
    np.testing.assert_allclose(slips, round(slips), atol=1e-5)


def test_exact_ratcheting_moves_by_whole_teeth():
    """A locked drive is overloaded and relieved: it comes to rest a whole number of pitches away, in the load's way."""
    p = linear(T_rat=300.0, spline_teeth=242.0, B_l=300.0)
    t = np.array([0.0, 2.9, 6.0])
    for way in (1.0, -1.0):
        scenario = held_input(6.0, ([0.0, 3.0, 3.05, 6.0], [0.0, way * 305.0, 0.0, 0.0]))
        te = simulate(p, ["ratcheting"], scenario, t, ["te"], rtol=1e-8)[0]
        teeth = te[-1] * 242.0 / math.tau
        assert abs(teeth) > 0.5
        np.testing.assert_allclose(teeth, round(teeth), atol=1e-6)
        assert np.sign(teeth) == way
        np.testing.assert_allclose(te[1], way * 305.0 * 2.9 / 3.0 / p["k1"], rtol=2e-2)


def test_exact_teeth_ride_in_the_way_of_the_spring():
    """An output thrown against the windup, whose damper pulls the other way: teeth jump the way the spring is wound."""
    p = linear(T_rat=250.0, spline_teeth=242.0)
    start = [0.0, 0.0, -1e-4, 20.0, 0.0]
    te = simulate(p, ["ratcheting"], held_input(3.0, ([0.0, 3.0], [0.0, 0.0])), [0.0, 3.0], ["te"], start, 1e-6)[0]
    teeth = te[-1] * 242.0 / math.tau
    assert teeth < -0.5
    np.testing.assert_allclose(teeth, round(teeth), atol=1e-4)
