"""Friction at the motor from a ladder of constant speeds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.identify.estimate import Estimate, Estimates, estimate
from hdfast.identify.fit import Fit, plain
from hdfast.identify.left_out import dry_friction, negative, negative_text
from hdfast.identify.nonlinear import NonlinearFit, fit
from hdfast.identify.plateaus import Plateaus, plateaus
from hdfast.identify.reading import gather
from hdfast.params import params
from hdfast.recordings import Recording

UNITS = {
    "T_c_forward": ("N m", "Coulomb torque forward"),
    "T_c_backward": ("N m", "Coulomb torque backward"),
    "B": ("N m s/rad", "viscous damping at the motor: B_m + B_ml + B_l/ratio^2 together"),
    "T_s_excess": ("N m", "breakaway above Coulomb torque"),
    "omega_s": ("rad/s", "speed scale of the Stribeck dip"),
    "c_L": ("1", "share of the output torque that adds to friction"),
    "beta": ("1/K", "fall of the viscous damping with temperature"),
}
LEAST_WARMING = 3.0
LEAST_LOAD = 10.0  # of |load| over ratio, in standard deviations of the torque of a plateau
LOAD_SHARE = 0.01  # and of the largest torque


def friction(
    recordings: Any,
    *,
    ratio: float,
    columns: Mapping[str, Any] | None = None,
    base: Mapping[str, Any] | None = None,
    source: str = "",
) -> Fit:
    """Identify Coulomb, Stribeck and viscous friction, their asymmetry, and what load and temperature change.

    Fits motor_torque - load_torque/ratio = sgn(w) [T_c + T_s_excess exp(-(w/omega_s)^2) + c_L |load|/ratio]
    + B exp(-beta (temperature - 20)) w on the means over constant speeds. The dip is kept when it lowers BIC; load and
    temperature enter when they were recorded and varied, the load by more than the torques of the plateaus scatter.

    Args:
        recordings: each needs t, motor_angle and motor_torque; speed_reference where it holds several speeds.
        ratio: gear ratio.
        columns, base, source: as in `stiffness`.

    Raises:
        InputError: a column is missing, the motor angle is wrapped, there are too few constant speeds, or no torque at
            any of them.
    """
    i = checks.positive("ratio", ratio, 1e4)
    listed = gather(recordings, columns)
    notes = [f"{item.name}: {note}" for item in listed for note in item.notes]
    means = plateaus(listed, i, notes)
    if not means.torque.any():
        raise InputError("motor_torque less load_torque/ratio is 0 at every constant speed: is it the right column?")
    names = _names(means, listed, i, notes)
    if len(means.speed) < len(names):
        raise InputError(
            f"{len(means.speed)} constant speeds do not give {', '.join(names)} (allowed: at least {len(names)} speeds)"
        )
    plain = _fit(means, names, i)
    untold = [name for name, sigma in zip(names, plain.sigma, strict=True) if plain.freedom and np.isinf(sigma)]
    if untold:
        raise InputError(
            f"{len(means.speed)} constant speeds do not tell {', '.join(untold)} apart (allowed: speeds that differ)"
        )
    dipped_names = [*names, "T_s_excess", "omega_s"]
    dipped = _fit(means, dipped_names, i) if len(means.speed) > len(dipped_names) + 2 else None
    kept = dipped is not None and dipped.bic < plain.bic - 2.0 and dipped.values[-2] > 0.0
    kept = kept and dipped is not None and bool(np.isfinite(dipped.sigma).all())
    found, names = (dipped, dipped_names) if kept and dipped is not None else (plain, names)
    if not kept:
        notes.append("no Stribeck dip: it does not lower BIC, or there are too few speeds")
    elif (slowest := float(np.min(np.abs(means.speed)))) > found.values[-1]:
        notes.append(f"T_s_excess is extrapolated: the slowest speed, {slowest:.3g} rad/s, is above omega_s")
    few = int(np.sum(means.turns < 1.0))
    if few:
        notes.append(f"{few} speeds cover less than a revolution: their torque holds a part of the ripple")
    estimates = _estimates(found, names)
    drive, extra = _model(estimates, base, i, notes)
    terms, decided = dry_friction(estimates, notes)
    return Fit(
        "friction",
        "Friction from a ladder of constant speeds",
        Estimates(estimates),
        {"drive": drive, "terms": terms},
        notes,
        {"speeds": len(means.speed), "residual_rms": float(np.sqrt(np.mean(found.residuals**2))), **extra},
        {},
        {"means": means, "law": dict(zip(names, found.values.tolist(), strict=True)), "ratio": i},
        {
            "speed": ("rad/s", means.speed),
            "torque": ("N m", means.torque),
            "load": ("N m", means.load),
            "temperature": ("degC", means.temperature),
        },
        base or {},
        source,
        decided,
    )


def law_torque(law: Mapping[str, float], speed: Floats, load: Floats, temperature: Floats, ratio: float) -> Floats:
    """Torque [N m] of the fitted law; temperature NaN counts as 20 degC."""
    sign = np.sign(speed)
    dry = np.where(speed > 0, law["T_c_forward"], law.get("T_c_backward", law["T_c_forward"]))
    if "omega_s" in law:
        dry = dry + law["T_s_excess"] * np.exp(-((speed / law["omega_s"]) ** 2))
    warm = np.where(np.isfinite(temperature), temperature - 20.0, 0.0)
    viscous = law["B"] * np.exp(-law.get("beta", 0.0) * warm) * speed
    return np.asarray(sign * (dry + law.get("c_L", 0.0) * np.abs(load) / ratio) + viscous)


def _names(means: Plateaus, listed: list[Recording], ratio: float, notes: list[str]) -> list[str]:
    names = ["T_c_forward", "B"]
    if np.any(means.speed > 0) and np.any(means.speed < 0):
        names.insert(1, "T_c_backward")
    else:
        notes.append("one direction only: asymmetry is not known")
    least = ratio * max(LEAST_LOAD * _noise(means), LOAD_SHARE * float(np.max(np.abs(means.torque))))
    if np.ptp(np.abs(means.load)) > least:
        names.append("c_L")
    else:
        recorded = any(item.filled("load_torque") for item in listed)
        missing = f"the load varies by less than {least:.2g} N m" if recorded else "load_torque is not recorded"
        notes.append(f"load dependence is not known: {missing}")
    warm = means.temperature[np.isfinite(means.temperature)]
    if len(warm) == len(means.speed) and np.ptp(warm) > LEAST_WARMING:
        names.append("beta")
    else:
        notes.append("temperature dependence is not known: temperature is not recorded or varies by less than 3 K")
    return names


def _noise(means: Plateaus) -> float:
    """Typical standard deviation of the torque of a plateau [N m]; 0 where rounding hides it at all of them."""
    noisy = means.noise[means.noise > 0.0]
    return float(np.median(noisy)) if noisy.size else 0.0


def _fit(means: Plateaus, names: list[str], ratio: float) -> NonlinearFit:
    """The law on the means; where rounding hides the noise, that of the other plateaus stands in."""
    size = float(np.max(np.abs(means.torque)))
    fast = float(np.max(np.abs(means.speed)))
    starts = {"T_c_forward": 0.5 * size, "T_c_backward": 0.5 * size, "B": 0.5 * size / fast, "T_s_excess": 0.1 * size}
    starts |= {"omega_s": 0.05 * fast, "c_L": 0.05, "beta": 0.02}
    weight = 1.0 / np.hypot(means.noise, _noise(means) or size)

    def residual(values: Floats) -> Floats:
        law = dict(zip(names, values.tolist(), strict=True))
        return (means.torque - law_torque(law, means.speed, means.load, means.temperature, ratio)) * weight

    return fit(residual, [starts[name] for name in names], uneven=True)


def _estimates(found: NonlinearFit, names: list[str]) -> list[Estimate]:
    listed = []
    for j, name in enumerate(names):
        unit, meaning = UNITS[name]
        listed.append(estimate(name, found.values[j], unit, found.sigma[j], found.freedom, meaning))
    return listed


def _model(
    estimates: list[Estimate], base: Mapping[str, Any] | None, ratio: float, notes: list[str]
) -> tuple[dict[str, Any], dict[str, Any]]:
    by_name = {item.name: item.value for item in estimates}
    damping = next(item for item in estimates if item.name == "B")
    drive = viscous_share(damping, base, ratio, notes)
    backward = by_name.get("T_c_backward", by_name["T_c_forward"])
    mean = 0.5 * (by_name["T_c_forward"] + backward)
    return drive, {"T_c": mean, "asymmetry": (by_name["T_c_forward"] - backward) / (2.0 * mean) if mean else 0.0}


def viscous_share(seen: Estimate, base: Mapping[str, Any] | None, ratio: float, notes: list[str]) -> dict[str, Any]:
    """Section [drive] for a viscous damping at the motor [N m s/rad] of which only the sum is seen.

    A sum that is surely negative changes no damping.
    """
    if negative(seen):
        notes.append(f"no viscous damping: {negative_text(seen)}")
        return {"ratio": ratio}
    total = seen.value
    defaults = {row.name: row.default for row in params()}
    known = plain((base or {}).get("drive", {}))
    shares = {name: float(known.get(name, defaults[name])) for name in ("B_ml", "B_l")}
    own = total - shares["B_ml"] - shares["B_l"] / ratio**2
    origin = "the given drive" if set(shares) <= set(known) else "the defaults"
    if own >= 0.0:
        notes.append(f"only the sum B is seen; B_ml and B_l are those of {origin}, B_m takes the rest")
        return {"ratio": ratio, "B_m": own, **shares}
    notes.append(f"only the sum B is seen, less than B_ml and B_l of {origin} give: B_m is 0, B_ml what B_l leaves")
    return {"ratio": ratio, "B_m": 0.0, "B_ml": max(total - shares["B_l"] / ratio**2, 0.0), "B_l": shares["B_l"]}
