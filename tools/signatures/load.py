"""Load, couplings and structure."""

from __future__ import annotations

import numpy as np
from hdfast import Scenario

from signatures.manoeuvres import Case, both, compare, held_speed, ring
from signatures.picture import WITHOUT, Curve, Signature

RINGING, TE = "time after release [ms]", "transmission error [µrad]"
UNBALANCED = Case(("base_compliance",), {"k_b": 1e5})


def _released(case: Case) -> Curve:
    t, te = ring(case, 20.0, 0.12)
    return t, 1e6 * te


def _over_output(case: Case) -> Curve:
    turns, te = held_speed(case, 60.0, 121, "te", 8)
    return turns / 121.0, 1e6 * te


def _load_ripple(case: Case) -> Curve:
    turns, te = held_speed(case, 60.0, 121, "te", 16, 40.0)
    return turns / 121.0, 1e6 * (te - np.mean(te))


def _hum(case: Case, rpm: float) -> Curve:
    _, te = held_speed(case, rpm, 4, "te", 4096)
    spectrum = 2e6 * np.abs(np.fft.rfft(te * np.hanning(len(te)))) / len(te) * 2.0
    f = np.arange(len(spectrum)) * rpm / 60.0 / 4.0
    keep = (f > 30.0) & (f < 70.0)
    return f[keep], spectrum[keep]


def _humming() -> dict[str, Curve]:
    quiet, loud = both("external_periodic_torque", {"T_external": 1.0}).values()
    return {WITHOUT: _hum(quiet, 60.0), "with, 60 r/min": _hum(loud, 60.0), "with, 90 r/min": _hum(loud, 90.0)}


def _chirp(case: Case) -> Curve:
    """Speed ripple of the motor [r/min] under a torque of 0.05 N m at several frequencies [Hz]."""
    found, frequencies = [], np.geomspace(40.0, 400.0, 60)
    for f in frequencies:
        end = 0.4 + 20.0 / f
        t = np.arange(0.0, end, 1.0 / (40.0 * f))
        run = case.run(Scenario.torque_profile(t, 0.05 * np.sin(2.0 * np.pi * f * t)), t, ["omega_m"], rtol=1e-6)
        last = t > end - 10.0 / f
        wave = np.exp(-2j * np.pi * f * t[last])
        found.append(2.0 * np.abs(np.mean((run["omega_m"][last] - np.mean(run["omega_m"][last])) * wave)))
    return frequencies, np.array(found) * 60.0 / (2.0 * np.pi)


def _unbalance(case: Case) -> Curve:
    speeds = np.array([100.0, 200.0, 300.0, 400.0, 500.0, 600.0])
    size = []
    for rpm in speeds:
        te = held_speed(case, rpm, 10, "te", 64)[1]
        size.append(2e6 * np.abs(np.fft.rfft(te)[10]) / len(te))
    return speeds, np.array(size)


LOAD = {
    "input_compliance": Signature(
        "Sine of 0.05 N m at many frequencies: a mode of rotor against wave generator.",
        "frequency [Hz]", "speed amplitude [r/min]",
        compare(_chirp, "input_compliance", {"k_ci": 100.0}),
    ),
    "load_motor_ripple": Signature(
        "One output turn against 40 N m: the windup follows the load machine.",
        "output angle [turns]", "TE less its mean [µrad]",
        compare(_load_ripple, "load_motor_ripple", {"load_ripple": 0.02}),
    ),
    "external_periodic_torque": Signature(
        "Two speeds: the line stays at its frequency.", "frequency [Hz]",
        "TE amplitude [µrad]", _humming,
    ),
    "gravity_unbalance": Signature(
        "One output turn: a wave in phase with the output angle.", "output angle [turns]", TE,
        compare(_over_output, "gravity_unbalance", {}),
    ),
    "load_compliance": Signature(
        "Input locked, 20 N m let go: a lower mode and a second one.",
        RINGING, TE, compare(_released, "load_compliance", {"K_c": 2e4}),
    ),
    "rotor_unbalance_reaction": Signature(
        "Line of order 1 at several speeds, housing on a spring: it grows with the square of the speed.",
        "motor speed [r/min]", "TE at order 1 [µrad]",
        compare(_unbalance, "rotor_unbalance_reaction", {"unbalance": 1e-5}, UNBALANCED),
    ),
    "base_compliance": Signature(
        "Input locked, 20 N m let go: more windup, a lower mode and a second one.",
        RINGING, TE, compare(_released, "base_compliance", {"k_b": 1e5}),
    ),
}  # fmt: skip
