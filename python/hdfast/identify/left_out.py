"""Identified friction and hysteresis as entries of `[[terms]]`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from hdfast.identify.estimate import CONFIDENCE, Estimate, Estimates

DRY = ("coulomb_friction", "coulomb_friction_smooth", "stribeck_friction", "presliding_friction")
DIPPING = ("stribeck_friction", "presliding_friction")
HYSTERETIC = ("hysteresis", "maxwell_slip")
GAUSSIAN = 2.0  # shape of the fitted dip exp(-(w/omega_s)^2)
LOBES = 2.0  # order of the ripple that starts tell
CLEAR = 5.0  # standard deviations below zero: no chance

Decision = tuple[list[dict[str, Any]], set[str]]  # entries of a test, and the effects that it decides on, found or not


def entry(effect: str, **parameters: float) -> dict[str, Any]:
    """One entry of `[[terms]]`."""
    return {"effect": effect, "parameters": parameters}


def number(stated: Any) -> Any:
    """The value of an entry, which may state its deviation beside it."""
    return stated["value"] if isinstance(stated, Mapping) else stated


def dry_friction(estimates: Sequence[Estimate], notes: list[str]) -> Decision:
    """Terms of a friction ladder: dry level with its dip, asymmetry, share of the load; only what differs from zero.

    The engine's asymmetry acts on the whole dry level, dip and share of the load included. Where no deviation is known,
    nothing is decided, nor where a level is negative.
    """
    known = {item.name: item for item in estimates}
    forward = known["T_c_forward"]
    backward = known.get("T_c_backward", forward)
    level = 0.5 * (forward.value + backward.value)
    found = []
    below = [item for item in (forward, backward) if negative(item)]
    if below:
        wrong = "sign of motor_torque looks reversed" if level < 0.0 else "zero of motor_torque looks shifted"
        notes.append(f"no dry friction: {negative_text(below[0])}: the {wrong}")
        return [], set()
    decided = _told(forward, *DRY) | (_told(backward, "asymmetric_friction") if "T_c_backward" in known else set())
    if level > 0.0 and _sure(forward) and _sure(backward):
        if "omega_s" in known and _sure(known["T_s_excess"]):
            ratio = 1.0 + known["T_s_excess"].value / level
            dip = {"breakaway_ratio": ratio, "omega_s": known["omega_s"].value, "stribeck_shape": GAUSSIAN}
            found.append(entry("stribeck_friction", T_c=level, **dip))
        else:
            found.append(entry("coulomb_friction", T_c=level))
        found += _asymmetry((forward, backward), level)
    share = known.get("c_L")
    if share is not None:
        decided |= _told(share, "load_dependent_friction")
        if negative(share):
            notes.append(f"no load-dependent friction: {negative_text(share)}")
        if share.value > 0.0 and _sure(share):
            found.append(entry("load_dependent_friction", c_drive=share.value, c_back=share.value))
    if "beta" in known:
        notes.append("thermal_viscous is not written: beta is known, heat capacity and cooling time are not")
    if found:
        notes.append(f"the model file declares {', '.join(item['effect'] for item in found)}")
    else:
        notes.append(_no_friction(forward))
    return found, decided


def coulomb(sides: Sequence[Estimate], notes: list[str]) -> Decision:
    """The terms of a coast-down whose inertia is known.

    Args:
        sides: Coulomb torque of the only direction, or forward and backward.
        notes: what was written is added.
    """
    unsure = [item for item in sides if not (item.value > 0.0 and _sure(item))]
    if unsure:
        least = min(unsure, key=lambda item: item.value)
        notes.append(_no_friction(least))
        return [], _told(least, *DRY) if len(unsure) == len(sides) else set()
    level = sum(item.value for item in sides) / len(sides)
    found = [entry("coulomb_friction", T_c=level), *_asymmetry(sides, level)]
    notes.append(f"the model file declares {', '.join(item['effect'] for item in found)}")
    return found, set(DRY) | (_told(sides[0], "asymmetric_friction") if len(sides) == 2 else set())


def _asymmetry(sides: Sequence[Estimate], level: float) -> list[dict[str, Any]]:
    """The term of two directions that surely differ; none of a single one."""
    bias = 0.5 * (sides[0].value - sides[-1].value)
    if abs(bias) > 2.0 * math.hypot(sides[0].sigma, sides[-1].sigma):
        return [entry("asymmetric_friction", eps_c=bias / level, eps_B=0.0)]
    return []


def _no_friction(torque: Estimate) -> str:
    if not math.isfinite(torque.sigma):
        return "dry friction is not known: its deviation is not"
    if negative(torque):
        return f"no dry friction: {negative_text(torque)}: was the motor driven?"
    return f"no dry friction: it is not surely above zero at {100.0 * CONFIDENCE:.0f} %"


def breakaway(
    sides: Sequence[Estimate],
    ripple: tuple[Estimate, float] | None,
    declared: Sequence[Mapping[str, Any]],
    notes: list[str],
) -> Decision:
    """Terms of a starting-torque test: the level as breakaway of a declared law with a dip, else as Coulomb torque.

    Args:
        sides: starting torque of each direction.
        ripple: relative amplitude twice per motor revolution and its phase [rad].
        declared: entries of the base model.
        notes: what was written is added.
    """
    level = sum(item.value for item in sides) / len(sides)
    dipping = [
        item for item in declared if item.get("effect") in DIPPING and number(item.get("parameters", {}).get("T_c", 0))
    ]
    if dipping:
        law = dict(dipping[0]["parameters"])
        ratio = max(level / float(number(law["T_c"])), 1.0)
        found = [entry(dipping[0]["effect"], **law | {"breakaway_ratio": ratio})]
    else:
        found = [entry("coulomb_friction", T_c=level)]
        notes.append("sliding friction is not known: the starting torque stands as Coulomb torque")
    decided = set(DRY)
    if len(sides) == 2:
        decided |= _told(sides[0], "asymmetric_friction")
        found += _asymmetry(sides, level)
    if ripple is not None:
        size, phase = ripple
        if size.value > 3.0 * size.sigma:
            wave = {"friction_ripple": size.value, "order": LOBES, "psi": phase % math.tau}
            found.append(entry("position_dependent_friction", **wave))
            decided.add("position_dependent_friction")
        elif _order(declared) == LOBES:
            decided |= _told(size, "position_dependent_friction")
    notes.append(f"the model file declares {', '.join(item['effect'] for item in found)}")
    return found, decided


def hysteresis(estimates: Estimates, phi_max: float, notes: list[str]) -> Decision:
    """The term of a torque loop: its torque as fitted, its windup such that a cycle costs the energy found.

    Bouc-Wen with beta = n = 1 closes from branch to branch over 2 phi_h, so that a cycle of amplitude phi_max costs
    4 T_h (phi_max - phi_h).
    """
    torque, energy = estimates.named("hysteresis_torque"), estimates.named("loop_energy")
    if negative(torque):
        notes.append(f"no hysteresis: {negative_text(torque)}: does the torque lag load_angle?")
        return [], set()
    if torque.value <= 0.0 or not _sure(torque):
        notes.append(f"no hysteresis: its torque is not surely above zero at {100.0 * CONFIDENCE:.0f} %")
        return [], _told(torque, *HYSTERETIC)
    windup = phi_max - energy.value / (4.0 * torque.value)
    if not 0.0 < windup < phi_max:
        notes.append("no hysteresis term: the energy of the loop does not go together with its width")
        return [], set()
    notes.append("the model file declares hysteresis: same torque and energy per cycle, closing as Bouc-Wen does")
    return [entry("hysteresis", T_h=torque.value, phi_h=windup, beta=1.0, loop_sharpness=1.0)], set(HYSTERETIC)


def negative(item: Estimate) -> bool:
    """Whether a number is farther below zero than chance takes it."""
    return item.value < -CLEAR * item.sigma


def negative_text(item: Estimate) -> str:
    """Says that a number is negative."""
    return f"{item.name} is negative ({100.0 * CONFIDENCE:.0f} %: {item.low:.3g} .. {item.high:.3g} {item.unit})"


def _sure(item: Estimate) -> bool:
    return item.low > 0.0 or item.high < 0.0


def _told(item: Estimate, *effects: str) -> set[str]:
    """The effects that a number decides on: none without a deviation, none where it is negative."""
    return set(effects) if math.isfinite(item.sigma) and not negative(item) else set()


def _order(declared: Sequence[Mapping[str, Any]]) -> float:
    """Order of the declared position_dependent_friction, its default where none is stated."""
    stated = [item.get("parameters", {}) for item in declared if item.get("effect") == "position_dependent_friction"]
    return float(number(stated[0].get("order", LOBES))) if stated else LOBES
