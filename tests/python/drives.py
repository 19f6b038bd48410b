"""Drives and inputs for the tests, typed from the model's tables and not read from the package."""

from __future__ import annotations

import math

from hdfast.reference import Problem

RPM = 2 * math.pi / 60
ORDERS = [float(n) for n in range(1, 16)]
LABELS = [str(n) for n in range(1, 16)]
AMPLITUDES = [20e-6, 90e-6, 6e-6, 22e-6, 4e-6 / math.sqrt(5), 8e-6] + [4e-6 / math.sqrt(n) for n in range(7, 16)]
PHASES = [5.97, 0.91, 5.96, 1.96, 2.66, 5.20, 2.57, 3.45, 0.17, 4.73, 3.38, 2.07, 4.95, 1.91, 2.85]
TORQUE, SPEED, MOTION = 0, 1, 2

DRIVE = {"ratio": 121.0, "J_m": 3e-4, "J_l": 0.5, "B_m": 6e-4, "B_l": 0.5, "B_ml": 6e-4, "B_sp": 20.0, "s": 0.0}
POLYNOMIAL = {"k1": 3.102e4, "k2": 0.0, "k3": 1.3445e10, "k4": 0.0, "k5": -3.211e15, "phi_max": 1.465e-3}
PIECEWISE = {"K1": 3.1e4, "K2": 5.0e4, "K3": 5.7e4, "T1": 14.0, "T2": 48.0}
SCENARIO = {"omega_set": 100 * RPM, "tau_load": 0.0, "K_p": 0.05, "K_i": 0.8, "tau_max": 2.0, "theta_m0": 0.0}


def kinematic_error(amplitudes=AMPLITUDES, phases=PHASES, labels=LABELS):
    """Parameters te_cos_*, te_sin_* of sum A_n sin(n theta + psi_n)."""
    columns = {}
    for label, amplitude, phase in zip(labels, amplitudes, phases, strict=True):
        columns[f"te_cos_{label}"] = amplitude * math.sin(phase)
        columns[f"te_sin_{label}"] = amplitude * math.cos(phase)
    return columns


def parameters(spring="polynomial", **changes):
    """All parameters of the default drive, some of them changed."""
    law = POLYNOMIAL if spring == "polynomial" else PIECEWISE
    return {**DRIVE, **law, "te_scale": 1.0, **kinematic_error(), **SCENARIO, **changes}


def linear(**changes):
    """The default drive without kinematic error and with a linear spring."""
    return parameters(**{"te_scale": 0.0, "k3": 0.0, "k5": 0.0, **changes})


FIELDS = ["tau", "tau_slope", "sustain", "sustain_slope", "hold", "hold_slope", "ref", "ref_slope", "set", "set_slope"]
FIELDS += ["load", "load_slope", "load_set", "load_set_slope", "c0", "c1", "c2", "c3"]


def segment(start, kind=TORQUE, bumpless=False, **values):
    """One 21-number row of the input table from named entries."""
    unknown = set(values) - set(FIELDS)
    assert not unknown, unknown
    return [float(start), float(kind), float(bumpless)] + [float(values.get(name, 0.0)) for name in FIELDS]


def step_and_coast(t_off=3.0):
    return [segment(0.0, sustain=1.0, load_set=1.0), segment(t_off, load_set=1.0)]


def ramp_and_brake(t_ramp=0.2, t_off=3.0, t_brake=0.02):
    rise = {"kind": SPEED, "load_set": 1.0}
    return [
        segment(0.0, set_slope=1.0 / t_ramp, **rise),
        segment(t_ramp, set=1.0, **rise),
        segment(t_off, set=1.0, set_slope=-1.0 / t_brake, **rise),
        segment(t_off + t_brake, **rise),
    ]


def problem(p=None, segments=None, t_end=6.0, t_off=3.0, **changes):
    """A `Problem` of the default drive and scenario, some of it changed."""
    given = {"orders": ORDERS, "labels": LABELS, "t_off": t_off, **changes}
    return Problem(parameters=p or parameters(), segments=segments or step_and_coast(t_off), t_end=t_end, **given)
