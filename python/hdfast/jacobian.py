"""Derivatives of the trajectory of one row."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError, choose
from hdfast.model import Model
from hdfast.request import DEFAULT_SIGNALS, prepare_row
from hdfast.sensors.observation import SOURCES
from hdfast.sensors.stage import SensorStage
from hdfast.sweep import run

OPTIONS = ("initial_state", "method", "rtol", "atol", "max_steps", "max_step")


def jacobian(
    row: Any = None,
    *,
    wrt: Sequence[str],
    t_eval: Any,
    signals: Sequence[str] | None = None,
    model: Model | None = None,
    scenario: Any = None,
    sensors: SensorStage | None = None,
    **options: Any,
) -> Floats:
    """Derivatives of one drive's signals over time with respect to parameters and initial states.

    With sensors, also of what they read: derivatives pass delay, filter, averaging, clock and geometry of the sensors
    exactly and rounding as if it were not there; noise and jitter are held as they were drawn (see
    `hdfast.sensors.SensorStage.linearise`).

    Args:
        row: parameters that differ from the defaults, as in `hdfast.simulate`.
        wrt: names of parameters of drive, terms and sensors, scenario columns or initial states (`initial_omega_m`),
            as `sensitivities` of `hdfast.sweep`.
        t_eval: times [s], shape (T,).
        signals: names of signals, and with sensors of channels; default te, omega_m, omega_l, with sensors
            motor_angle, load_angle, motor_torque, output_torque.
        model: the equations; default `Model()`.
        scenario: the inputs over time; default `Scenario.start_stop()`.
        sensors: what reads the channels, as in `hdfast.sweep`.
        options: initial_state, method, rtol, atol, max_steps and max_step as in `hdfast.sweep`.

    Returns:
        Array (T, signals, wrt) in the signal's unit over the parameter's unit; NaN beyond the end of a row that failed.

    Raises:
        InputError: the call cannot mean anything; naming argument, value and what is allowed.
        RowError: the row cannot be simulated.
    """
    channels = [] if sensors is None else list(SOURCES)
    asked = checks.listed("signals", signals if signals is not None else channels or DEFAULT_SIGNALS)
    if not asked:
        raise InputError("signals = [] (allowed: at least one name)")
    for name in options:
        choose("option", name, OPTIONS)
    request = prepare_row(
        row,
        model=model,
        scenario=scenario,
        t_eval=t_eval,
        signals=[name for name in asked if name not in channels],
        metrics=[],
        sensitivities=wrt,
        sensors=sensors,
        **options,
    )
    result = run(request, threads=1, strict=True)
    found = {**result.sample_sensitivities, **result.recorded_sensitivities}
    return np.stack([found[name][0] for name in asked], axis=1)
