"""Slopes of the simulated signals, and of what noise of the motor angle adds to them."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.metric import Metric
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.stir import Stir
from hdfast.diagnosis.structure import TORQUE_SCALE, Structure

STEP = 2e-3
#: What the noise of the angle adds to the load side [nats] below which it moves no parameter.
LOUD = 2.0
#: The least share that a slope without the noise is taken to have.
LEAST_TOLD = 0.02
ACCELERATED = ("J_m", "J_l", TORQUE_SCALE, "load_dependent_friction_c_drive", "load_dependent_friction_c_back")
#: Where a signal of the load side tells of the resonance, what the torque alone would say of it is noise as well.
SHAKEN = (*ACCELERATED, "k1", "K1", "K2", "K3", "B_sp")
#: Those that a common factor of drive and torque multiplies, beside the scale of the torque.
MULTIPLIED = ("J_m", "J_l", "k1", "K1", "K2", "K3", "B_sp")


def linearise(
    replay: Replay, structure: Structure, x: Floats, kept: int = 0, wide: Floats | None = None
) -> tuple[Floats, Floats, Floats]:
    """Mismatch and slopes of the simulated signals by central differences; those of the first `kept` stay 0.

    Args:
        replay: recordings.
        structure: equations and free parameters.
        x: coordinates (P,) within their bounds, as all steps are.
        kept: how many parameters, from the first on, are left out.
        wide: steps (P,) to both sides; default small ones.

    Returns:
        Mismatch (N,), slopes (N, P), and the noise of the acceleration that was taken from them (N, P).
    """
    forth, back = (np.diag(steps)[kept:] for steps in _inside(structure, x, wide))
    shaken = SHAKEN if replay.plant.load_side else ACCELERATED
    noisy = [j for j, name in enumerate(structure.names) if name in shaken and j >= kept]
    higher = 1 + np.arange(len(forth))
    lower = higher + len(forth)
    moved = np.concatenate([x[None], x + forth, x - back])
    own = np.array(noisy, dtype=int) - kept
    stacked, slow = replay.both(structure, moved, [*higher[own], *lower[own]])
    spans = (forth + back).sum(axis=1)[:, None]
    slopes, rough = np.zeros((replay.layout.size, len(x))), np.zeros((replay.layout.size, len(x)))
    slopes[:, kept:] = -((stacked[higher] - stacked[lower]) / spans).T
    rough[:, noisy] = slopes[:, noisy] + ((slow[: len(own)] - slow[len(own) :]) / spans[own]).T
    common = _common_factor(structure, x, shaken)
    if common is not None and kept == 0:
        rough[:, structure.names.index(TORQUE_SCALE)] = -rough @ common
    return stacked[0], np.nan_to_num(slopes - rough), np.nan_to_num(rough)


def _common_factor(structure: Structure, x: Floats, shaken: Collection[str]) -> Floats | None:
    """Change of the shaken coordinates (P,) with the logarithm of a factor that multiplies all torques of a drive.

    With the scale of the recorded torque it changes no signal, and noise must not tell it: that of the scale's slope is
    minus theirs together. What a torque holds beyond an acceleration's noise, as the steps of a friction, is none.

    Args:
        structure: equations and free parameters.
        x: coordinates (P,).
        shaken: parameters whose slopes hold the noise of the acceleration.

    Returns:
        The changes, 0 for all others; None where the scale or one of them is given.
    """
    multiplied = [name for name in MULTIPLIED if name in shaken]
    given = [name for name in multiplied if name not in structure.names and structure.fixed.get(name, 0.0) != 0.0]
    if given or TORQUE_SCALE not in structure.names:
        return None
    pairs = zip(structure.free, x, strict=True)
    return np.array([(1.0 if free.positive else at) if free.name in multiplied else 0.0 for free, at in pairs])


def stirred(
    replay: Replay, structure: Structure, x: Floats, mismatch: Floats, slopes: Floats, known: Fit | None = None
) -> Stir:
    """What one more noise of the angle adds on the load side, and its slopes; nothing where it hardly counts.

    The recorded motion holds such noise, which shakes the simulated load and not the real one. A fit that takes what it
    adds for a mismatch would find every damping too large.

    Args:
        replay: recordings.
        structure: equations and free parameters.
        x: coordinates (P,).
        mismatch, slopes: there, (N,) and (N, P).
        known: an earlier fit whose parameters come first; theirs are kept.
    """
    if not replay.plant.load_side or (known is not None and not known.stir.loud):
        return Stir.none(slopes)
    noise = replay.noise_on_load(structure, x[None], mismatch[None])[0]
    white = Metric.of(replay, mismatch).white
    if not np.sum(white(replay.layout, noise) ** 2) > 2.0 * LOUD:
        return Stir.none(slopes)
    kept = 0 if known is None else known.slopes.shape[1]
    felt = np.any(slopes[replay.load_side] != 0.0, axis=0)
    own = [j for j, one in enumerate(structure.free) if j >= kept and felt[j] and not one.name.startswith("te_")]
    found = np.zeros_like(slopes)
    if known is not None:
        found[:, :kept] = known.stir.slopes
    if own:
        forth, back = (steps[own] for steps in _inside(structure, x))
        ways = np.eye(len(x))[own]
        moved = np.concatenate([x + ways * forth[:, None], x - ways * back[:, None]])
        still = mismatch - slopes[:, own].T * np.stack([forth, -back])[..., None]
        higher, lower = np.split(replay.noise_on_load(structure, moved, np.concatenate(still)), 2)
        found[:, own] = np.nan_to_num((lower - higher) / (forth + back)[:, None]).T
    whole, feigned = (np.sum(white(replay.layout, one) ** 2, axis=0) for one in (slopes, found))
    told = np.maximum(whole - feigned, LEAST_TOLD * (whole + feigned))
    return Stir(noise, found, np.where(feigned > 0.0, (whole + feigned) / np.maximum(told, 1e-300), 1.0))


def _inside(structure: Structure, x: Floats, wide: Floats | None = None) -> tuple[Floats, Floats]:
    """Steps (P,) from coordinates (P,) forth and back, within the bounds.

    Beyond a bound nothing changes: a slope taken there would leave a parameter where it ran aground.
    """
    low, high = structure.bounds
    steps = STEP * units_of(structure) if wide is None else wide
    return np.minimum(steps, high - x), np.minimum(steps, x - low)


def units_of(structure: Structure) -> Floats:
    """What steps of the coordinates are multiples of, shape (P,)."""
    return np.array([1.0 if free.positive else free.sigma for free in structure.free])
