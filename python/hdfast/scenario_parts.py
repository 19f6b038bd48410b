"""Arguments that the scenario constructors share, checked and turned into tracks."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import scipy

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError, choose, shorten
from hdfast.segments import Track, constant, held, linear

RPM = 2.0 * math.pi / 60.0
PER_RPM = 1.0 / RPM
K_P, K_I, TAU_MAX = 0.05, 0.8, 2.0
T_RAMP, T_BRAKE = 0.2, 0.02
MAX_TIME = 1e6
MAX_SPEED_RPM = 1e5
MAX_TORQUE = 1e6
MAX_ANGLE = 1e9


def pair(t_name: str, t: Any, name: str, values: Any, limit: float) -> tuple[Floats, Floats]:
    """A table of samples over time, both checked; no sample larger than `limit`."""
    t = checks.times(t_name, t, MAX_TIME, strictly=False)
    values = checks.table(name, values)
    if len(t) != len(values):
        raise InputError(f"{name} has {len(values)} samples, {t_name} has {len(t)} (allowed: the same number)")
    worst = int(np.argmax(np.abs(values)))
    if abs(values[worst]) > limit:
        raise InputError(f"{name}[{worst}] = {values[worst]:g} is out of range (allowed: up to {limit:g} in size)")
    return t, values


def without_meaning(beside: str, **given: Any) -> None:
    """Refuse arguments that mean nothing beside another one, named as in `start='speed_ramp'`."""
    for name, value in given.items():
        if value is not None:
            raise InputError(f"{name} = {shorten(value)} has no meaning with {beside} (allowed: None)")


def run_phase(window: Any, t_on: float, t_off: float | None, t_end: float, default: float) -> tuple[float, float]:
    """(t_off, t_run) from what was given."""
    if window is None:
        return checks.number("t_off", default if t_off is None else t_off, t_on, t_end, "s"), math.nan
    try:
        begin, end = window
    except (TypeError, ValueError):
        raise InputError(f"run_window = {shorten(window)} is not a pair (begin, end) of times in s") from None
    end = checks.number("run_window end", end, t_on, t_end, "s")
    begin = checks.number("run_window begin", begin, t_on, end, "s")
    if t_off is not None and end != checks.number("t_off", t_off, t_on, t_end, "s"):
        raise InputError(f"run_window ends at {end:g} s but t_off = {t_off:g} s (allowed: the same time)")
    return end, begin


def load_tracks(load: Any, *, held_between: bool) -> dict[str, Track]:
    """The load torque: the column `tau_load`, plus a table when `load` is one."""
    tracks = {"set_load": constant(1.0)}
    if isinstance(load, (tuple, list)):
        tracks["load"] = _torque_table("load", "load", load, "a number or a pair (t, torque)", held_between)
    return tracks


def torque_track(torque: Any, *, held_between: bool) -> dict[str, Track]:
    """The motor torque asked for during a prescribed motion, when there is one."""
    if torque is None:
        return {}
    return {"torque": _torque_table("torque", "motor", torque, "a pair (t, torque)", held_between)}


def _torque_table(name: str, side: str, table: Any, allowed: str, held_between: bool) -> Track:
    if not isinstance(table, (tuple, list)) or len(table) != 2:
        raise InputError(f"{name} = {shorten(table)} is not {allowed}")
    t, values = pair(f"{side} time", table[0], f"{side} torque", table[1], MAX_TORQUE)
    return (held if held_between else linear)(t, values)


def ramp_time(name: str, given: Any, default: float, longest: float) -> float:
    """Duration of a ramp [s]; the default is cut to the time there is."""
    return checks.number(name, min(default, longest) if given is None else given, 0.0, longest, "s")


def down_from_one(t_on: float, ramp: float) -> Track:
    """One until t_on, zero from t_on + ramp on."""
    return linear(np.array([t_on, t_on + ramp]), np.array([1.0, 0.0]))


def ramp_up_then_zero(t_on: float, ramp: float, level: float, t_off: float) -> Track:
    """`level` from t_on (+ ramp) to t_off, zero outside."""
    corners = [(t_on, 0.0), (t_on + ramp, level), (t_off, level), (t_off, 0.0)]
    t, value = np.array(corners).T
    return linear(t, value)


def scenario_values(speed_rpm: Any, load: Any, K_p: Any, K_i: Any, tau_max: Any, theta_m0: Any) -> dict[str, float]:
    """Defaults of the scenario columns, checked."""
    constant_load = 0.0 if isinstance(load, (tuple, list)) else load
    return {
        "omega_set": checks.number("speed_rpm", speed_rpm, -MAX_SPEED_RPM, MAX_SPEED_RPM, "r/min") * RPM,
        "tau_load": checks.number("load", constant_load, -MAX_TORQUE, MAX_TORQUE, "N m"),
        "K_p": checks.finite("K_p", K_p, 0.0, 1e6, "N m s/rad"),
        "K_i": checks.finite("K_i", K_i, 0.0, 1e6, "N m/rad"),
        "tau_max": checks.positive("tau_max", tau_max, math.inf, "N m"),
        "theta_m0": checks.finite("theta_m0", theta_m0, -MAX_ANGLE, MAX_ANGLE, "rad"),
    }


def ring_window(default: tuple[float, float, bool], delay: Any, width: Any) -> tuple[float, float, bool]:
    """(delay, width, on the load) of the residual ring."""
    return (
        checks.number("ring_delay", default[0] if delay is None else delay, 0.0, MAX_TIME, "s"),
        checks.positive("ring_width", default[1] if width is None else width, MAX_TIME, "s"),
        default[2],
    )


def motion_spline(t: Floats, angle: Floats, smoothing: Any) -> Any:
    """One cubic spline through or near the samples, as `PPoly`."""
    if smoothing is None:
        return scipy.interpolate.CubicSpline(t, angle)
    if isinstance(smoothing, str):
        choose("smoothing", smoothing, ["auto"])
        weight = None
    else:
        weight = checks.number("smoothing", smoothing, 0.0, 1e12, "s^3")
    return scipy.interpolate.PPoly.from_spline(scipy.interpolate.make_smoothing_spline(t, angle, lam=weight))


def typical_speed(t: Floats, angle: Floats) -> float:
    """Fastest mean speed over a tenth of a recorded motion [rad/s]."""
    width = (t[-1] - t[0]) / 10.0
    begin = np.linspace(t[0], t[-1] - width, 91)
    travelled = np.interp(begin + width, t, angle) - np.interp(begin, t, angle)
    return float(travelled[np.argmax(np.abs(travelled))] / width)
