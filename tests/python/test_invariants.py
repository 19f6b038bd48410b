"""Statements that follow from the physics alone (T1 to T11), for the engine and for the reference."""

from __future__ import annotations

import math

import hdfast
import numpy as np
import pytest
from drives import AMPLITUDES, LABELS, ORDERS, RPM, kinematic_error, linear, parameters
from oracles import closed_forms, lagrange
from scipy.optimize import curve_fit

Scenario = hdfast.Scenario
INERTIA_TABLE = {  # J_l: motor-locked Hz, free Hz, decay 1/s, tau_rb s
    0.05: (125, 126, 207, 0.246),
    0.1: (88.6, 89.6, 105, 0.249),
    0.5: (39.6, 41.8, 22.9, 0.271),
    1.0: (28.0, 31.0, 12.9, 0.298),
    2.0: (19.8, 23.9, 8.0, 0.354),
    5.0: (12.5, 18.3, 5.4, 0.520),
    12.0: (8.1, 15.6, 4.6, 0.907),
}


def one(p, **columns):
    """Columns for `sweep` from a full set of parameters, some of them arrays."""
    length = max([np.size(value) for value in columns.values()], default=1)
    return {name: np.broadcast_to(value, (length,)) for name, value in {**p, **columns}.items()}


def only_nominal_where_slow(sweep, J_l):
    """Plain Python runs the nominal load inertia, and with --long the others."""
    if sweep.slow and J_l != 0.5:
        pytest.skip("needs --long")


def order_labels(p):
    return [name.removeprefix("te_cos_") for name in p if name.startswith("te_cos_")]


# T1


@pytest.mark.parametrize(
    ("scenario", "changes"),
    [
        (Scenario.start_stop(t_end=2.0), {}),
        (Scenario.start_stop(start="speed_ramp", stop="brake", t_end=2.0, speed_rpm=300), {"J_l": 5.0, "s": 1.0}),
        (Scenario.start_stop(t_end=1.0, initial="zero_angle", load=40.0), {"k2": 4e5}),
    ],
    ids=["coast", "brake", "loaded"],
)
@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
def test_exact_energy_audit(sweep, base, scenario, changes):
    """T1: the change of energy is what was put in less what was lost, computed here from the final state."""
    names = ["energy_in", "loss_motor", "loss_wave_generator", "loss_load", "loss_mesh", "energy_residual"]
    p = parameters(**changes)
    p = {**p, **scenario.values}
    start = np.zeros((1, 5 if base == "two_inertia" else 3))
    start[0, 1] = 4.0
    residuals = []
    for rtol in (1e-6, 1e-10):
        result = sweep(
            one(p), model=hdfast.Model(base), scenario=scenario, initial_state=start, metrics=names, rtol=rtol
        )
        change = stored(p, base, result.final_state[0]) - stored(p, base, start[0])
        put_in, *losses = (result.metrics[name][0] for name in names[:5])
        residuals.append(abs(change - put_in + sum(losses)) / max(abs(put_in), sum(losses)))
        assert residuals[-1] < 300 * rtol
        assert result.metrics["energy_residual"][0] < 300 * rtol
        assert losses[-1] == 0.0 or base == "two_inertia"
    assert residuals[1] < 1e-8


def stored(p, base, state):
    """Energy [J] from a reported state; the spring's share by quadrature of its torque."""
    drive = lagrange.Lagrangian(p, [float(x) for x in order_labels(p)], order_labels(p), "polynomial")
    if base == "one_inertia":
        upsilon = drive.windup_gradient([state[0], 0.0])[0]
        return 0.5 * (p["J_m"] + p["J_l"] * upsilon**2) * state[1] ** 2
    theta_m, omega_m, theta_l, omega_l = state[:4]
    end = drive.windup([theta_m, theta_l])
    nodes, weights = np.polynomial.legendre.leggauss(200)
    potential = 0.5 * end * np.sum(weights * drive.spring_torque(0.5 * end * (nodes + 1.0)))
    return 0.5 * p["J_m"] * omega_m**2 + 0.5 * p["J_l"] * omega_l**2 + potential


# T2


@pytest.mark.parametrize("slip", [0.0, 1.0])
def test_exact_two_mass_step(sweep, slip):
    """T2: without kinematic error and with a linear spring, the step response is a matrix exponential."""
    p = linear(s=slip)
    t = np.linspace(0.0, 0.8, 41)
    torque = 0.03
    scenario = Scenario.start_stop(stop=None, torque=torque, t_end=0.8)
    signals = ["theta_m", "omega_m", "theta_l", "omega_l", "windup"]
    result = sweep(one(p), scenario=scenario, t_eval=t, signals=signals, rtol=1e-10, metrics=["te_pp"])
    exact = np.array([closed_forms.two_mass_response(p, x, torque) for x in t]).T
    for name, values in zip(signals, exact, strict=False):
        np.testing.assert_allclose(result.samples[name][0], values, rtol=1e-9, atol=1e-9 * np.max(np.abs(values)))
    windup = exact[0] / 121 - exact[2]
    np.testing.assert_allclose(result.samples["windup"][0], windup, atol=1e-8 * np.max(np.abs(windup)))


# T3


def test_exact_rigid_limit(sweep):
    """T3: the load angle approaches the rigid gear as 1/K."""
    factors = np.array([1.0, 10.0]) if sweep.slow else np.array([1.0, 10.0, 100.0, 1000.0])
    p = parameters()
    springs = {name: p[name] * factors for name in ("k1", "k3", "k5")}
    scenario = Scenario.start_stop(stop=None, t_end=2.0)
    result = sweep(one(p, **springs), scenario=scenario, rtol=1e-10, metrics=["te_pp"])
    torque = lagrange.sustaining_torque(p)
    phasors = {n: p[f"te_cos_{n}"] - 1j * p[f"te_sin_{n}"] for n in range(1, 16)}
    theta_m, _ = closed_forms.rigid_response(p, phasors, 2.0, torque)
    drive = lagrange.Lagrangian(p, [float(n) for n in range(1, 16)], order_labels(p), "polynomial")
    rigid = theta_m / 121 - drive.theta_e(theta_m)
    start = [0.0, 0.0, -drive.theta_e(0.0), 0.0, 0.0]
    soft = lagrange.solve(p, ORDERS, LABELS, "polynomial", scenario.segments, 2.0, start, rtol=1e-10).at(2.0)[2, 0]
    np.testing.assert_allclose((result.final_state[:, 2] - rigid) * factors, soft - rigid, rtol=0.02)
    rigid_model = sweep(one(p), model=hdfast.Model("one_inertia"), scenario=scenario, rtol=1e-10, metrics=["te_pp"])
    np.testing.assert_allclose(rigid_model.final_state[0, 0], theta_m, rtol=1e-9)


# T4


@pytest.mark.parametrize("J_l", INERTIA_TABLE)
def test_exact_table_of_modes(J_l):
    """T4: the table of section 5 against its own formulas, the eigenvalues, and what the engine finds after a step."""
    p = linear(J_l=J_l, k1=3.1e4)
    locked, free, decay, tau = INERTIA_TABLE[J_l]
    np.testing.assert_allclose(math.sqrt(p["k1"] / J_l) / (2 * math.pi), locked, rtol=6e-3)
    np.testing.assert_allclose(closed_forms.undamped_frequency(p), free, rtol=6e-3)
    np.testing.assert_allclose(closed_forms.decay_rate(p), decay, rtol=1e-2)
    np.testing.assert_allclose(closed_forms.torsional_mode(p)[1], decay, rtol=3e-2)
    np.testing.assert_allclose(closed_forms.coast_time_constant(p), tau, rtol=3e-3)
    scenario = Scenario.start_stop(speed_rpm=300, stop=None, t_end=6 / decay)
    names = ["mode_frequency_start", "mode_decay_start"]
    found = hdfast.sweep(one(p, omega_set=300 * RPM), scenario=scenario, metrics=names, rtol=1e-8)
    damped_frequency = math.sqrt(free**2 - (decay / (2 * math.pi)) ** 2)
    np.testing.assert_allclose(found["mode_frequency_start"][0], damped_frequency, rtol=6e-3)
    np.testing.assert_allclose(found["mode_decay_start"][0], decay, rtol=1e-2)


@pytest.mark.parametrize("J_l", [0.1, 0.5, 2.0, 5.0])
@pytest.mark.parametrize("spring", ["polynomial", "piecewise"])
def test_exact_modes_of_a_loaded_spring(sweep, spring, J_l):
    """A small step on a spring that its load has wound up: the mode of the two inertias on its tangent there."""
    only_nominal_where_slow(sweep, J_l)
    loads = np.array([20.0] if sweep.slow else [0.0, 5.0, -5.0, 20.0, -20.0, 60.0, -60.0])
    p = parameters(spring, te_scale=0.0, J_l=J_l)
    _, decay = closed_forms.torsional_mode(linear(J_l=J_l))
    found = sweep(
        one(p, tau_load=loads),
        model=hdfast.Model(spring=spring),
        scenario=Scenario.start_stop(stop=None, t_end=5 / decay),
        metrics=["mode_frequency_start", "mode_decay_start"],
        rtol=1e-8,
    ).metrics
    for load, frequency, rate in zip(loads, *found.values(), strict=True):
        stiffness = tangent_under(spring, load)
        expected = closed_forms.torsional_mode(linear(J_l=J_l, k1=stiffness))
        np.testing.assert_allclose([frequency, rate], expected, rtol=1e-2, err_msg=f"{load} N m")


def tangent_under(spring, load):
    """Stiffness [N m/rad] of the default spring under a torque [N m]."""
    p = parameters(spring)
    if spring == "piecewise":
        return p["K1"] if abs(load) < p["T1"] else p["K2"] if abs(load) < p["T2"] else p["K3"]
    law = np.polynomial.Polynomial([-abs(load), *(p[f"k{n}"] for n in range(1, 6))])
    windup = min(root.real for root in law.roots() if abs(root.imag) < 1e-12 and root.real > -1e-12)
    return law.deriv()(min(windup, p["phi_max"]))


def test_exact_mode_of_a_soft_windup():
    """What the teeth lack of their stiffness without torque is there under a load."""
    p = parameters(te_scale=0.0)
    missing = 1.2e4
    found = hdfast.sweep(
        one(p, tau_load=np.array([0.0, 20.0, -20.0]), delta_K=missing, phi_0=6e-5),
        model=hdfast.Model(terms=["soft_windup"]),
        scenario=Scenario.start_stop(speed_rpm=15, stop=None, t_end=0.25),
        metrics=["mode_frequency_start"],
        rtol=1e-8,
    )["mode_frequency_start"]
    loaded = tangent_under("polynomial", 20.0)
    expected = [closed_forms.torsional_mode(linear(k1=k1))[0] for k1 in (p["k1"] - missing, loaded, loaded)]
    np.testing.assert_allclose(found, expected, rtol=1e-2)


def damped(t, amplitude, phase, frequency, decay, offset, slope):
    return amplitude * np.exp(-decay * t) * np.cos(2 * math.pi * frequency * t + phase) + offset + slope * t


def fitted_mode(t, rate, frequency, decay):
    """(frequency, decay, amplitude) of a windup rate by SciPy's curve fit."""
    guess = [np.max(np.abs(rate)), 0.0, frequency, decay, 0.0, 0.0]
    scale = np.max(np.abs(rate))
    found, _ = curve_fit(damped, t, rate / scale, [1.0, *guess[1:]], maxfev=20_000)
    return found[2], found[3], abs(found[0]) * scale


@pytest.mark.parametrize("J_l", [0.1, 0.5, 2.0, 12.0])
def test_exact_free_decay(sweep, J_l):
    """T4: released from a small windup, the drive rings with frequency and decay of its eigenvalues."""
    only_nominal_where_slow(sweep, J_l)
    p = linear(J_l=J_l, k3=1.3445e10, k5=-3.211e15)
    frequency, decay = closed_forms.torsional_mode(p)
    t_end = 5 / decay
    t = np.linspace(0.0, t_end, 301)
    scenario = Scenario.torque_profile(t=[0.0, t_end], torque=[0.0, 0.0], t_end=t_end)
    start = np.array([[0.0, 0.0, -1e-5, 0.0, 0.0]])
    result = sweep(
        one(p), scenario=scenario, t_eval=t, signals=["windup_rate"], initial_state=start, rtol=1e-9, metrics=["te_pp"]
    )
    found = fitted_mode(t, result.samples["windup_rate"][0], frequency, decay)
    np.testing.assert_allclose(found[0], frequency, rtol=1e-3)
    np.testing.assert_allclose(found[1], decay, rtol=2e-2)


# T5


def test_exact_quasi_static_te(sweep):
    """T5: at 15 r/min the transmission error is the kinematic error plus B_l omega_l / K."""
    p = parameters()
    scenario = Scenario.start_stop(speed_rpm=15, start="speed_ramp", stop=None, t_end=6.0, run_window=(2.0, 6.0))
    metrics = ["te_mean", "order_1", "order_2", "order_4", "order_15", "te_pp", "te_rms"]
    result = sweep(one({**p, "omega_set": 15 * RPM}), scenario=scenario, metrics=metrics).metrics
    np.testing.assert_allclose(result["te_mean"][0], 0.5 * 15 * RPM / 121 / 3.102e4, rtol=2e-2)
    np.testing.assert_allclose(result["te_mean"][0], 2.1e-7, rtol=3e-2)
    for order, gain in ((1, 1.000), (2, 1.000), (4, 1.001), (15, 1.009)):
        np.testing.assert_allclose(result[f"order_{order}"][0] / AMPLITUDES[order - 1], gain, atol=6e-4)
    np.testing.assert_allclose(result["te_pp"][0], 222.1e-6, rtol=2e-3)
    np.testing.assert_allclose(result["te_rms"][0], 67.5e-6, rtol=2e-3)


# T6


@pytest.mark.parametrize(("J_l", "speed"), [(0.5, 100.0), (0.5, 600.0), (2.0, 300.0), (12.0, 150.0)])
def test_exact_forced_response(sweep, J_l, speed):
    """T6: with the motor speed held exactly, order amplitudes are A_n |H|."""
    only_nominal_where_slow(sweep, J_l)
    amplitudes = np.array(AMPLITUDES) * 1e-2
    p = {**linear(J_l=J_l, te_scale=1.0), **kinematic_error(amplitudes), "omega_set": speed * RPM}
    settled = 20.0 / (p["B_sp"] / (2 * J_l))
    t_end = settled + max(0.6, 2 * 60 / speed)
    t = np.linspace(0.0, t_end, 11)
    scenario = Scenario.motion(t, speed * RPM * t, t_end=t_end)
    orders = [1, 2, 4, 8, 15]
    metrics = [f"{kind}_{n}" for n in orders for kind in ("order", "speed_order")]
    found = sweep(one(p), scenario=scenario, metrics=metrics, rtol=1e-10).metrics
    for n in orders:
        line = amplitudes[n - 1] * closed_forms.forced_gain(p, n * speed * RPM)
        np.testing.assert_allclose(found[f"order_{n}"][0], line, rtol=1e-3)
        np.testing.assert_allclose(found[f"speed_order_{n}"][0], line * n * speed * RPM, rtol=1e-3)


@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
def test_exact_te_of_a_rigid_gear_in_imposed_motion(sweep, rtol):
    """Nothing is integrated here, so no error estimate limits the step: metrics must see the kinematic error anyhow."""
    p = parameters(omega_set=10 * math.pi)
    t = np.linspace(0.0, 2.0, 6)
    scenario = Scenario.motion(t, 10 * math.pi * t, t_off=1.8, t_end=2.0, run_window=(1.0, 1.8))
    metrics = ["te_rms", "te_mean", "te_pp", "upsilon_min", "speed_ripple"]
    found = sweep(one(p), model=hdfast.Model("one_inertia"), scenario=scenario, metrics=metrics, rtol=rtol).metrics
    theta = np.linspace(0.0, 2 * math.pi, 20_001)
    drive = lagrange.Lagrangian(p, [float(n) for n in range(1, 16)], order_labels(p), "polynomial")
    error, slope = drive.theta_e(theta), drive.theta_e(theta, 1)
    np.testing.assert_allclose(found["te_rms"][0], math.sqrt(np.sum(np.square(AMPLITUDES)) / 2), rtol=1e-4)
    np.testing.assert_allclose(found["te_mean"][0], 0.0, atol=1e-4 * AMPLITUDES[1])
    np.testing.assert_allclose(found["te_pp"][0], np.ptp(error), rtol=1e-4)
    np.testing.assert_allclose(found["speed_ripple"][0], 10 * math.pi * np.ptp(slope), rtol=1e-3)
    np.testing.assert_allclose(found["upsilon_min"][0], 1 / 121 - np.max(slope), rtol=1e-6)


# T7


def test_exact_local_ratio(sweep):
    """T7: the windup rate is the derivative of the windup, and a positive slope of the error slows the output."""
    p = parameters(te_scale=5.0, theta_m0=0.4)
    t = np.linspace(0.4, 0.41, 101)
    result = sweep(
        one(p),
        scenario=Scenario.start_stop(t_end=1.0),
        t_eval=t,
        signals=["windup", "windup_rate", "theta_e", "te"],
        rtol=1e-10,
        metrics=["te_pp"],
    )
    windup, rate, theta_e, te = (result.samples[name][0] for name in ("windup", "windup_rate", "theta_e", "te"))
    h = t[1] - t[0]
    slope = (windup[:-4] - 8 * windup[1:-3] + 8 * windup[3:-1] - windup[4:]) / (12 * h)
    np.testing.assert_allclose(rate[2:-2], slope, atol=1e-7 * np.max(np.abs(rate)) + 1e-10)
    np.testing.assert_allclose(te, theta_e + windup, atol=1e-18)


def test_exact_sign_of_the_kinematic_error(sweep):
    """T7: an error that grows with the motor angle makes the output slower."""
    c = 1e-4
    p = {**linear(te_scale=1.0), "te_cos_1/1000": 0.0, "te_sin_1/1000": 1000 * c}
    p = {name: value for name, value in p.items() if not name.startswith("te_") or name.endswith(("scale", "1/1000"))}
    model = hdfast.Model(orders=["1/1000"])
    t = np.array([0.0, 2.9])
    result = sweep(
        one(p), model=model, scenario=Scenario.start_stop(), t_eval=t, signals=["omega_m", "omega_l"], metrics=["te_pp"]
    )
    ratio = result.samples["omega_l"][0, 1] / result.samples["omega_m"][0, 1]
    np.testing.assert_allclose(ratio, 1 / 121 - c, rtol=1e-3)
    assert ratio < 1 / 121


# T8, T9


@pytest.mark.parametrize("spring", ["polynomial", "piecewise"])
def test_exact_symmetry(sweep, spring):
    """T8: with an odd spring and no kinematic error, reversed inputs give exactly reversed outputs."""
    p = parameters(spring, te_scale=0.0)
    sign = np.array([1.0, -1.0])
    t = np.linspace(0.0, 1.0, 21)
    signals = ["theta_m", "omega_m", "theta_l", "omega_l", "te", "tau_m", "gear_torque"]
    scenario = Scenario.start_stop(start="speed_ramp", stop="brake", t_end=1.0)
    result = sweep(
        one(p, omega_set=200 * RPM * sign, tau_load=30.0 * sign),
        model=hdfast.Model(spring=spring),
        scenario=scenario,
        t_eval=t,
        signals=signals,
        metrics=["peak_windup", "steady_speed", "te_mean"],
    )
    for name in signals:
        np.testing.assert_array_equal(result.samples[name][0], -result.samples[name][1], err_msg=name)
    np.testing.assert_array_equal(result.final_state[0], -result.final_state[1])
    assert result.metrics["peak_windup"][0] == result.metrics["peak_windup"][1]
    np.testing.assert_allclose(result.metrics["steady_speed"][0], -result.metrics["steady_speed"][1], rtol=1e-12)


def test_exact_scaling(sweep):
    """T9: with a linear drive, doubled inputs under doubled floors of the error control exactly double the answer."""
    p = linear()
    t = np.linspace(0.0, 1.0, 21)
    answers = []
    for factor in (1.0, 2.0):
        answers.append(
            sweep(
                one(p, omega_set=100 * RPM * factor, tau_load=10.0 * factor),
                scenario=Scenario.start_stop(t_end=1.0),
                t_eval=t,
                signals=["omega_m", "te"],
                atol=factor,
                metrics=["te_pp"],
            )
        )
    for name in ("omega_m", "te"):
        np.testing.assert_array_equal(2.0 * answers[0].samples[name], answers[1].samples[name])


# T10


@pytest.mark.parametrize("J_l", [0.05, 0.5, 12.0])
@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
def test_exact_coast(sweep, base, J_l):
    """T10: without kinematic error the speed decays with tau_rb, whatever the speed."""
    only_nominal_where_slow(sweep, J_l)
    speeds = np.array([600.0] if sweep.slow else [30.0, 100.0, 600.0])
    p = linear(J_l=J_l)
    tau = closed_forms.coast_time_constant(p)
    t_off = 2.1 + 16 * tau
    scenario = Scenario.start_stop(t_off=t_off, t_end=t_off + 4 * tau)
    result = sweep(
        one(p, omega_set=speeds * RPM),
        model=hdfast.Model(base),
        scenario=scenario,
        metrics=["stop_time", "stop_shape", "rise_time"],
        rtol=1e-8,
    ).metrics
    close = 1e-4 if base == "one_inertia" else 5e-3
    np.testing.assert_allclose(result["stop_time"], tau * math.log(19), rtol=close)
    np.testing.assert_allclose(result["rise_time"], tau * math.log(19), rtol=close)
    np.testing.assert_allclose(result["stop_shape"], math.log(1.9) / math.log(10), rtol=close * 3)
    if J_l == 0.5:
        np.testing.assert_allclose(result["stop_time"], 0.797, rtol=5e-3)


# T11


@pytest.mark.parametrize("J_l", [0.25, 0.5, 2.0, 12.0, 60.0])
def test_exact_event_amplitude(sweep, J_l):
    """T11: fitted mode amplitudes against the formulas for a torque step (a) and a released windup (b)."""
    only_nominal_where_slow(sweep, J_l)
    p = linear(J_l=J_l)
    step = closed_forms.step_amplitude(p, lagrange.sustaining_torque({**p, "omega_set": 300 * RPM}))
    _, decay = closed_forms.torsional_mode(p)
    scenario = Scenario.start_stop(speed_rpm=300, stop=None, t_end=6 / decay)
    names = ["mode_amplitude_start", "mode_frequency_start", "mode_decay_start"]
    columns = one(p, omega_set=300 * RPM)
    found = sweep(columns, scenario=scenario, metrics=names, rtol=1e-8).metrics
    np.testing.assert_allclose(found["mode_amplitude_start"][0], step, rtol=1e-2)
    np.testing.assert_allclose(found["mode_frequency_start"][0], closed_forms.torsional_mode(p)[0], rtol=2e-3)
    np.testing.assert_allclose(found["mode_decay_start"][0], decay, rtol=2e-2)
    if J_l == 0.5:
        np.testing.assert_allclose(step, 3.65e-3, rtol=2e-2)


@pytest.mark.parametrize("J_l", [0.25, 0.5, 2.0, 12.0])
def test_exact_release_amplitude(sweep, J_l):
    """T11 (b): the kinematic error at zero angle, released at 15 r/min under a slow torque ramp."""
    only_nominal_where_slow(sweep, J_l)
    p = parameters(J_l=J_l, omega_set=15 * RPM)
    drive = lagrange.Lagrangian(p, [float(n) for n in range(1, 16)], order_labels(p), "polynomial")
    released = closed_forms.release_amplitude(p, drive.theta_e(0.0))
    _, decay = closed_forms.torsional_mode(p)
    scenario = Scenario.start_stop(
        speed_rpm=15, stop=None, torque_ramp=0.5, t_end=max(0.5, 6 / decay), initial="zero_angle"
    )
    found = sweep(one(p), scenario=scenario, metrics=["mode_amplitude_start"], rtol=1e-8).metrics
    np.testing.assert_allclose(found["mode_amplitude_start"][0], released, rtol=1.5e-2)
    if J_l == 0.5:
        np.testing.assert_allclose(released, 1.83e-2, rtol=1e-2)


@pytest.mark.parametrize(("J_l", "peak"), [(0.5, 2.8), (2.0, 12.0), (12.0, 39.0)])
def test_exact_brake_torque(sweep, J_l, peak):
    """Case (e): spring torque of a 20 ms brake at 100 r/min, below its bound."""
    only_nominal_where_slow(sweep, J_l)
    p = parameters(J_l=J_l)
    scenario = Scenario.start_stop(start="speed_ramp", stop="brake", t_off=2.0, t_end=3.0)
    t = np.linspace(2.0, 3.0, 2001)
    result = sweep(one(p), scenario=scenario, t_eval=t, signals=["gear_torque"], metrics=["te_pp"])
    torque = np.max(np.abs(result.samples["gear_torque"]))
    assert torque < closed_forms.brake_torque_bound(p, 100 * RPM)
    np.testing.assert_allclose(torque, peak, rtol=0.05)


TE_TABLE = {  # J_l: {r/min: (peak to peak, rms, mean) in 1e-6 rad}
    0.5: {15: (222.1, 67.5, 0.21), 100: (225.9, 68.1, 1.39), 300: (242.3, 73.8, 4.2), 600: (395.5, 111, 8.1)},
    2.0: {50: (225.9, 68.1, None), 300: (348.5, 100, None), 600: (610, 207, None)},
    12.0: {100: (268.7, 83.7, None), 300: (279.5, 87.4, None), 600: (125.6, 38.5, None)},
}


@pytest.mark.parametrize("J_l", TE_TABLE)
def test_exact_table_of_te(sweep, J_l):
    """Transmission error against speed, the table of section 11 (PI-held, run-in of 2 s, whole revolutions)."""
    p = parameters(J_l=J_l)
    for speed, (peak_to_peak, rms, mean) in TE_TABLE[J_l].items():
        if sweep.slow and speed != 300:
            continue
        revolution = 60 / speed
        end = 2.0 + revolution * max(3, math.ceil(0.5 / revolution))
        scenario = Scenario.start_stop(speed_rpm=speed, start="speed_ramp", stop=None, t_end=end, run_window=(2.0, end))
        names = ["te_pp", "te_rms", "te_mean"]
        found = sweep(one({**p, "omega_set": speed * RPM}), scenario=scenario, metrics=names).metrics
        np.testing.assert_allclose(found["te_pp"][0], peak_to_peak * 1e-6, rtol=2e-2, err_msg=f"{speed} r/min")
        np.testing.assert_allclose(found["te_rms"][0], rms * 1e-6, rtol=2e-2)
        if mean is not None:
            np.testing.assert_allclose(found["te_mean"][0], mean * 1e-6, rtol=4e-2)


def test_exact_a_mode_is_the_same_beside_orders():
    """A row in which a moment of the order's grid falls within a microsecond of one of the mode's."""
    drive = {"J_l": 0.6857806111649245, "k1": 25509.07233420745}
    scenario = hdfast.Scenario.start_stop(t_off=2.0, t_end=2.2)
    alone, beside = (
        hdfast.sweep(drive, scenario=scenario, metrics=metrics)["mode_frequency_start"]
        for metrics in (["mode_frequency_start"], ["order_2", "mode_frequency_start"])
    )
    assert alone.tobytes() == beside.tobytes()


@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
def test_exact_an_imposed_motion_starts_where_it_is(sweep, base):
    """Held still far from zero, a rigid drive shows the kinematic error there, and a soft one swings about it."""
    t, p = np.linspace(0.0, 0.2, 9), parameters()
    scenario = Scenario.motion(t, np.full(9, 5.0), initial="zero_angle")
    found = sweep(one(p), model=hdfast.Model(base), scenario=scenario, t_eval=t, signals=["theta_m", "te"])
    np.testing.assert_allclose(found.samples["theta_m"][0], 5.0)
    error = lagrange.Lagrangian(p, ORDERS, LABELS, "polynomial").theta_e(5.0)
    swing = 0.0 if base == "one_inertia" else abs(error) * np.exp(-(p["B_l"] + p["B_sp"]) / (2.0 * p["J_l"]) * t)
    assert np.all(np.abs(found.samples["te"][0] - error) <= 1.01 * swing + 1e-9)


def test_exact_no_energy_exchanged_is_none_lost():
    found = hdfast.sweep({}, scenario=Scenario.torque_profile([0.0, 1.0], [0.0, 0.0]), metrics=["energy_residual"])
    assert found["energy_residual"][0] == 0.0


@pytest.mark.parametrize(
    ("speed", "torque", "turns"),
    [(60.0, 0.0025, False), (60.0, 0.0035, False), (60.0, 0.0038, True), (10.0, 0.0028, False), (10.0, 0.0031, True)],
)
def test_exact_no_order_amplitude_from_a_part_of_a_revolution(speed, torque, turns):
    """Far below its set speed the drive turns once before the samples begin: an amplitude is right or missing."""
    p = parameters()
    scenario = hdfast.Scenario.start_stop(torque=torque, t_off=20.0, t_end=21.0)
    found = hdfast.sweep({"omega_set": speed}, scenario=scenario, metrics=["steady_speed", "order_2"])
    reached = torque / (p["B_m"] + p["B_ml"] + p["B_l"] / p["ratio"] ** 2)
    np.testing.assert_allclose(found["steady_speed"][0], reached, rtol=1e-3)
    right = AMPLITUDES[1] * closed_forms.forced_gain(p, 2 * reached) if turns else math.nan
    np.testing.assert_allclose(found["order_2"][0], right, rtol=1e-3)


@pytest.mark.parametrize(
    ("speed", "told", "untold"),
    [
        (100.0, ["2", "3"], ["1/121", "1/2", "120/121", "101/100", "3/2", "1"]),
        (300.0, ["2", "1/2", "4/3"], ["1/121", "1/4", "120/121", "101/100", "5/4", "1"]),
    ],
)
def test_exact_only_orders_that_the_revolutions_tell_apart(sweep, speed, told, untold):
    """Half a second holds one revolution at 100 r/min and three at 300: orders less than a turn apart are not told."""
    p = parameters(omega_set=speed * RPM)
    kinds = ("order_",) if sweep.slow else ("order_", "speed_order_")
    found = sweep(
        {"omega_set": [p["omega_set"]]},
        model=hdfast.Model(orders=[1, "120/121", 2]),
        scenario=Scenario.start_stop(t_off=0.65, t_end=0.66),
        initial_state=[0.0, p["omega_set"], 0.0, p["omega_set"] / p["ratio"]],
        metrics=[f"{kind}{order}" for kind in kinds for order in (*told, *untold)],
    ).metrics
    for kind in kinds:
        assert [order for order in (*told, *untold) if np.isnan(found[f"{kind}{order}"][0])] == untold
    right = AMPLITUDES[1] * closed_forms.forced_gain(p, 2 * p["omega_set"])
    np.testing.assert_allclose(found["order_2"][0], right, rtol=2e-2)


@pytest.mark.parametrize("swing", [0.0, 3.0, 6.0])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_exact_steady_speed_of_a_motor_that_turns_back(sweep, swing, direction):
    """The run goes back to the last time that the motor stood whole revolutions away, of the times that it did."""
    t = np.linspace(0.0, 2.0, 801)

    def angle(t):
        return direction * (8.0 * t + swing * np.sin(35.0 * t) * np.minimum(t, 0.2) / 0.2)

    times = np.linspace(0.0, 1.5, 150_001)
    beyond = np.abs(angle(2.0) - angle(times)) >= 2 * np.pi
    begin = times[np.flatnonzero(beyond)[-1]]
    found = sweep({"J_l": [0.5]}, scenario=Scenario.motion(t, angle(t)), metrics=["steady_speed"]).metrics
    np.testing.assert_allclose(found["steady_speed"][0], direction * 2 * np.pi / (2.0 - begin), rtol=1e-4)


def test_exact_steady_speed_after_the_motion_has_been_reversed(sweep):
    """Four revolutions forward, then two back: those count, though the motor stands two farther than it began."""
    t, turns = np.array([0.0, 0.1, 1.6, 1.7, 2.5]), 2.5 * 2 * np.pi
    speeds = np.array([0.0, turns, turns, -turns, -turns])
    scenario = Scenario.speed_profile(t, speed=speeds)
    found = sweep({"te_scale": [0.0]}, scenario=scenario, metrics=["steady_speed"]).metrics
    np.testing.assert_allclose(found["steady_speed"][0], -turns, rtol=1e-2)


@pytest.mark.parametrize(("t_on", "t_off", "t_end"), [(0.1, 0.6, 0.7), (0.2, 0.7, 0.8), (0.7, 1.2, 1.3)])
def test_exact_a_run_phase_that_fills_the_motion(sweep, t_on, t_off, t_end):
    """One revolution at 120 r/min takes all of half a second, however the times round: nothing happens in the start."""
    scenario = Scenario.start_stop(speed_rpm=120.0, t_on=t_on, t_off=t_off, t_end=t_end)
    parts = ["energy_in_start", "energy_in_run", "energy_in_stop"]
    metrics = [*parts, "energy_in", "loss_mesh_start", "te_pp", "te_pp_start"]
    found = sweep({"J_l": [0.5]}, scenario=scenario, metrics=metrics).metrics
    assert found["energy_in_start"][0] == found["loss_mesh_start"][0] == 0.0
    assert np.isnan(found["te_pp_start"][0])
    assert found["te_pp"][0] > 1e-4
    np.testing.assert_allclose(sum(found[name] for name in parts), found["energy_in"], rtol=1e-9)


@pytest.mark.parametrize("window", [None, (35.0, 40.0), (10.0, 40.0)])
def test_exact_orders_that_nothing_excites_whatever_the_run_phase(window):
    """A run phase of many revolutions does not thin the samples of those that are fitted."""
    begin = {"t_off": 40.0} if window is None else {"run_window": window}
    scenario = Scenario.start_stop(speed_rpm=600.0, start="speed_ramp", stop="brake", t_end=41.0, **begin)
    found = hdfast.sweep({}, scenario=scenario, metrics=["order_2", "order_50", "order_100"])
    right = AMPLITUDES[1] * closed_forms.forced_gain(parameters(), 2 * 600.0 * RPM)
    np.testing.assert_allclose(found["order_2"], right, rtol=3e-2)
    assert found["order_50"] < 1e-10
    assert found["order_100"] < 1e-10


def test_exact_no_amplitude_of_an_order_between_the_samples():
    """20,000 samples of four revolutions tell orders up to 2,000 apart; one beyond spoils only those fitted with it."""
    beyond = hdfast.sweep({}, metrics=["order_2", "order_1900", "order_2100"])
    assert beyond["order_2"] > 1e-5
    assert beyond["order_1900"] < 1e-10
    assert np.isnan(beyond["order_2100"])
    assert np.isnan(hdfast.sweep({}, model=hdfast.Model(orders=[2, 2100]), metrics=["order_2"])["order_2"])


@pytest.mark.parametrize("rtol", [1e-6, 1e-7, 1e-9])
@pytest.mark.parametrize(
    ("row", "terms", "options"),
    [
        ({"tau_load": 5.0, "omega_set": 5.15}, ["stribeck_friction"], {"t_on": 0.05, "t_off": 0.9, "t_end": 1.6}),
        ({"omega_set": 0.0, "tau_load": 30.0}, [], {"start": "speed_ramp", "initial": "zero_angle"}),
    ],
)
def test_exact_no_rise_of_a_motor_that_stands_still(row, terms, options, rtol):
    model = hdfast.Model(terms=terms, orders=[1, 2])
    names = [name for name in hdfast.metrics() if name.startswith(("rise_", "stop_", "dead_"))]
    found = hdfast.sweep(
        row, model=model, scenario=Scenario.start_stop(**options), metrics=["steady_speed", *names], rtol=rtol
    )
    assert abs(found["steady_speed"][0]) < 1e-9
    assert {name: found[name][0] for name in names if not np.isnan(found[name][0])} == {}


def test_exact_no_rise_of_a_speed_that_goes_down_and_up(sweep):
    """It begins above 5 % of what it ends at, passes 95 % and then 0: it rises past 5 % long after."""
    t = np.linspace(0.0, 3.0, 61)
    speed = np.interp(t, [0.0, 0.3, 0.7, 1.2, 1.5, 3.0], [6.0, 11.0, 11.0, -0.5, 10.0, 10.0])
    angle = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2.0 * np.diff(t))])
    scenario = Scenario.motion(t, angle, t_off=2.8)
    found = sweep({"te_scale": [0.0]}, scenario=scenario, metrics=["rise_time", "rise_shape", "dead_time"]).metrics
    assert np.isnan(found["rise_time"][0])
    assert np.isnan(found["rise_shape"][0])
    assert found["dead_time"][0] == pytest.approx(1.23, abs=0.02)


@pytest.mark.parametrize("spring", ["polynomial", "piecewise"])
def test_exact_a_rigid_gear_has_no_spring(sweep, spring):
    names = {"polynomial": ["k1", "k5", "phi_max"], "piecewise": ["K1", "T2"]}[spring]
    options = {"model": hdfast.Model("one_inertia", spring), "scenario": Scenario.start_stop(t_end=1.0)}
    options["metrics"] = ["steady_speed", "energy_in", "time_outside_range", "peak_windup"]
    expected = sweep({}, **options).metrics
    for name in names:
        found = sweep({name: np.array([-1.0])}, **options).metrics
        assert {metric: value[0] for metric, value in found.items()} == {k: v[0] for k, v in expected.items()}
