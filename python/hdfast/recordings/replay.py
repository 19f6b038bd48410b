"""Replay of recordings: columns taken by name, NaN bridged, gaps checked."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError, choose
from hdfast.rows import table_columns
from hdfast.scenario import Scenario
from hdfast.scenario_parts import RPM, typical_speed

OWN = ("hold", "speed")  # arguments that are no further options
INPUTS = {"motor_torque": "motor_torque", "motor_motion": "motor_angle", "reference": "speed_reference"}


def replay(cls: type[Scenario], recording: Any, input_name: str, hold: bool, options: dict[str, Any]) -> Scenario:
    """Build the scenario of `Scenario.replay`."""
    source = INPUTS[choose("input", input_name, INPUTS)]
    columns = table_columns("recording", recording)
    for needed in ("t", source):
        if needed not in columns:
            raise InputError(f"recording has no column {needed!r} (input={input_name!r} needs t and {source})")
    makers: dict[str, Callable[..., Scenario]]
    makers = {"motor_torque": cls.torque_profile, "motor_angle": cls.motion, "speed_reference": cls.speed_profile}
    make = makers[source]
    known = [one.name for one in inspect.signature(make).parameters.values() if one.kind is one.KEYWORD_ONLY]
    for name in options:
        choose("option of replay", name, ["max_gap", *(one for one in known if one not in OWN)])
    options = dict(options)
    t = _time(columns["t"])
    gap = options.pop("max_gap", None)
    gap = 20.0 * float(np.median(np.diff(t))) if gap is None else checks.positive("max_gap", gap, 1e6, "s")
    t, values = _channel(t, columns[source], source, gap)
    if "load_torque" in columns and "load" not in options:
        options["load"] = _channel(_time(columns["t"]), columns["load_torque"], "load_torque", gap)
    if source == "motor_angle":
        if "motor_torque" in columns and "torque" not in options:
            options["torque"] = _channel(_time(columns["t"]), columns["motor_torque"], "motor_torque", gap)
        return make(t, values, hold=hold, **options)
    if "motor_angle" in columns:
        moments, angle = _channel(_time(columns["t"]), columns["motor_angle"], "motor_angle", gap)
        if options.get("initial") != "zero_angle":
            options.setdefault("theta_m0", float(angle[0]))
        if source == "motor_torque":
            options.setdefault("speed_rpm", typical_speed(moments, angle) / RPM)
    if source == "speed_reference":
        return make(t, speed=values, hold=hold, **options)
    return make(t, values, hold=hold, **options)


def _time(values: Any) -> Floats:
    t = checks.table("recording['t']", values)
    if len(t) < 2:
        raise InputError(f"recording['t'] has {len(t)} samples (allowed: at least 2)")
    return checks.times("recording['t'] - first", t - t[0])


def _channel(t: Floats, values: Any, name: str, gap: float) -> tuple[Floats, Floats]:
    samples = checks.as_floats(f"recording[{name!r}]", values)
    if samples.shape != t.shape:
        raise InputError(f"recording[{name!r}] has shape {samples.shape}, recording['t'] has {t.shape}")
    known = np.isfinite(samples)
    if not known.any():
        raise InputError(f"recording[{name!r}] holds no finite sample")
    moments = t[known]
    holes = np.diff(np.concatenate([[0.0], moments, [t[-1]]]))
    worst = int(np.argmax(holes))
    if holes[worst] > gap:
        start = 0.0 if worst == 0 else moments[worst - 1]
        raise InputError(
            f"recording[{name!r}] has no sample for {holes[worst]:g} s after {start:g} s "
            f"(allowed: {gap:g} s; raise max_gap to accept it)"
        )
    if known.all():
        return moments, samples
    filled = np.interp(t, moments, samples[known])
    return t, filled
