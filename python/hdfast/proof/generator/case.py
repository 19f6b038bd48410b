"""Build one case: rig, motion, effects at a stated multiple of what is detectable, nuisance, recordings, label."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator

from hdfast.proof.generator import VERSION, sensors, stepping
from hdfast.proof.generator.campaign_file import measured, write_case
from hdfast.proof.generator.certificate import angle_share, hiding, likeness
from hdfast.proof.generator.effects import EFFECTS, Drive
from hdfast.proof.generator.equipment import TURN
from hdfast.proof.generator.imposed import SKIP
from hdfast.proof.generator.linear import Linearisation, Refit, linearise
from hdfast.proof.generator.nuisance import draw_nuisance
from hdfast.proof.generator.oracle import oracle
from hdfast.proof.generator.plant import Array
from hdfast.proof.generator.programme import Run
from hdfast.proof.generator.recipe import Recipe
from hdfast.proof.generator.responses import Motion
from hdfast.proof.generator.rig import Rig, draw_rig
from hdfast.proof.generator.sizing import QUIETEST, UNDETECTABLE, Sized, follow, length, sketch, swallowed, together
from hdfast.proof.generator.truth import refitted

ATTEMPTS = 40
ABSORBED_RATIO, ABSORBED_LOW, ABSORBED_HIGH = 1.15, 0.05, 0.30
UNDECIDABLE, STRANGE = 0.98, 0.95
HIDDEN_MOTION, LEFT, HOPELESS = 0.02, 0.5, 0.4


class UnfitError(Exception):
    """These draws cannot make the case that the recipe asks for."""


class Built(NamedTuple):
    """A written case: its label, and the rig and the drive behind it."""

    label: dict[str, Any]
    rig: Rig
    drive: Drive


def build(recipe: Recipe, folder: Path) -> Built:
    """Write one case; draws that miss the recipe's conditions are repeated.

    Raises:
        UnfitError: no draw fits.
    """
    last = UnfitError(str(recipe))
    for attempt in range(ATTEMPTS):
        try:
            return _attempt(recipe, folder, np.random.default_rng([recipe.seed, attempt]))
        except UnfitError as reason:
            last = reason
    raise last


def _attempt(recipe: Recipe, folder: Path, rng: Generator) -> Built:
    model = recipe.model
    rig = draw_rig(rng, model)
    bare = Drive(rig.plant, sensors.SOUND)
    fit = [k for k, run in enumerate(rig.runs) if run.role == "fit"]
    traces = [simulate(rig, bare, rig.runs[k], rng) for k in fit]
    motions = [motion(x, rig.runs[k]) for x, k in zip(traces, fit, strict=True)]
    rig, lin, named = sized_within_limits(rig, bare, motions, model, rng)
    files = [f"{x:08x}" for x in rng.integers(0, 2**32, len(rig.runs))]
    full, certificate = together(bare, named), certified(model, lin, named, [files[k] for k in fit])
    if "masked_by_controller" in model.kinds:
        certificate["speed_change"] = _speed_change(rig, full, traces, fit, rng)
        if certificate["speed_change"] > HIDDEN_MOTION:
            raise UnfitError(f"{model}: the motion shows it")
    minor = draw_nuisance(rng, lin, set(model.effects))
    if recipe.like:
        named, full, certificate = [], bare, certified(recipe, lin, [], [files[k] for k in fit])
    full = together(full, minor)
    made = [record(rig, full, run, k, rng) for k, run in enumerate(rig.runs)]
    if not all(np.isfinite(values).all() for one in made for values in one.noisy.values()):
        raise UnfitError(f"{recipe}: the drive ran away")
    certificate |= _floor(lin, named, full, made)
    tables = [sampled(rig, run, one.noisy, rng) for one, run in zip(made, rig.runs, strict=True)]
    suffix = write_case(folder, rig, files, tables, sensors.recorded_noise(rig.chain, rng), rng)
    for window in certificate["windows"]:
        window[2] += suffix
    return Built(label(recipe, rig, named, minor, certificate), rig, full)


def certified(recipe: Recipe, lin: Linearisation, named: list[Sized], files: list[str]) -> dict[str, Any]:
    """The certificate of a case that keeps the rules of its kinds.

    Raises:
        UnfitError: it does not.
    """
    refit = swallowed(lin, named)
    check_size(lin, refit, named)
    hidden = hiding(lin, refit) if named else {}
    check_hiding(recipe, hidden)
    certificate = hidden | likeness(lin, refit, named, files)
    check_likeness(recipe, named, certificate)
    check_sampling(recipe, lin, certificate["orders"])
    return certificate


def _floor(lin: Linearisation, named: list[Sized], full: Drive, made: list[Recorded]) -> dict[str, Any]:
    """What the true structure, refitted to the other recordings, leaves of those that are held out."""
    rig = lin.rig
    fit, heldout = ([x for x, run in zip(made, rig.runs, strict=True) if run.role == r] for r in ("fit", "heldout"))
    structure = refitted(lin, named, full, [x.clean for x in fit], [x.noisy for x in fit])
    missed = structure.misses(rig, full, [x.motion for x in heldout])
    return oracle(rig, [x.clean for x in heldout], [x.noisy for x in heldout], missed)


def label(
    recipe: Recipe, rig: Rig, named: list[Sized], minor: list[Sized], certificate: dict[str, Any]
) -> dict[str, Any]:
    """The label of a case with its certificate."""
    drive = together(Drive(rig.plant, sensors.SOUND), named)
    return {
        "kind": list(recipe.kinds),
        "effects": [
            {
                "id": s.id,
                "place": EFFECTS[s.id].place,
                "amplitude": s.amplitude,
                "amplitude_over_mda": s.multiple,
                "visibility": s.visibility,
                "true_parameters": EFFECTS[s.id].parameters(drive),
            }
            for s in named
        ],
        **certificate,
        "baseline_true": rig.true,
        "nuisance": [{"id": s.id, "amplitude": s.amplitude, "amplitude_over_mda": s.multiple} for s in minor],
        "motor_only": rig.motor_only,
        "controller": rig.declared,
        "generator": {"version": VERSION, "seed": recipe.seed},
    }


def check_visible(recipe: Recipe, named: list[Sized]) -> None:
    """Refuse what is far from the rule of absorbed effects already at its detectable amplitude.

    Raises:
        UnfitError: the refit leaves several times too much or too little.
    """
    far = (s for s in named if not HOPELESS * ABSORBED_LOW <= s.visibility <= ABSORBED_HIGH / HOPELESS)
    if "absorbed" in recipe.kinds and (first := next(far, None)):
        raise UnfitError(f"{recipe}: visibility {first.visibility:.3f}")


def check_size(lin: Linearisation, refit: Refit, named: list[Sized]) -> None:
    """Hold a case of one effect against its multiple: what a refit leaves need not grow with the amplitude.

    Raises:
        UnfitError: the refit leaves less than half of it.
    """
    if len(named) == 1 and length(lin, refit.left) < LEFT * named[0].multiple:
        raise UnfitError(f"{named[0].id}: swallowed")


def check_hiding(recipe: Recipe, hidden: dict[str, Any]) -> None:
    """Hold a case against the rule of absorbed effects.

    Raises:
        UnfitError: the refit shows it, or leaves too much or too little.
    """
    if "absorbed" not in recipe.kinds:
        return
    swallowed = hidden["refit_nrmse_over_noise"] <= ABSORBED_RATIO
    if not swallowed or not ABSORBED_LOW <= hidden["visibility"] <= ABSORBED_HIGH:
        raise UnfitError(f"{recipe}: visibility {hidden['visibility']:.2f}")


def check_likeness(recipe: Recipe, named: list[Sized], certificate: dict[str, Any]) -> None:
    """Hold a case against the rules on its closest rival.

    Raises:
        UnfitError: the certificate does not carry the kind.
    """
    rival = certificate["closest_rival"]
    stratum = recipe.kinds[0]
    if any(s.detectable >= UNDETECTABLE for s in named):
        raise UnfitError(f"{recipe}: invisible")
    if stratum == "undecidable" and rival["abs_cos"] <= UNDECIDABLE:
        raise UnfitError(f"{recipe}: closest rival {rival}")
    if stratum == "outside" and rival["abs_cos"] > STRANGE:
        raise UnfitError(f"{recipe}: looks like {rival}")
    if stratum == "single" and not recipe.bench.motor_only and rival["abs_cos"] > UNDECIDABLE:
        raise UnfitError(f"{recipe}: cannot be told from {rival}")


def check_sampling(recipe: Recipe, lin: Linearisation, orders: list[float]) -> None:
    """Hold a case against the rule of effects masked by sampling.

    Raises:
        UnfitError: no recording turns fast enough for a line to pass half the sampling rate.
    """
    fastest = max(float(np.max(np.abs(m.speed))) for m in lin.motions) / TURN
    if "masked_by_sampling" in recipe.kinds and max(orders) * fastest <= 0.5 * lin.rig.chain.rate:
        raise UnfitError(f"{recipe}: line at {max(orders) * fastest:.0f} Hz")


def sized_within_limits(
    rig: Rig, drive: Drive, motions: list[Motion], recipe: Recipe, rng: Generator
) -> tuple[Rig, Linearisation, list[Sized]]:
    """Size the effects; where one leaves its physical range, the bench gets quieter or noisier sensors.

    Raises:
        UnfitError: the range is left even so.
    """
    least = HOPELESS * ABSORBED_LOW if "absorbed" in recipe.kinds else 0.0
    for tries_left in (2, 1, 0):
        lin = linearise(rig, drive, motions, rng)
        named = [sketch(lin, effect_id, multiple, rng) for effect_id, multiple in recipe.effects.items()]
        if _within(named)[1] <= 1.0:
            named = [follow(lin, s, least) for s in named]
            check_visible(recipe, named)
        small, excess = _within(named)
        if excess <= 1.0 and (small >= 0.02 or not tries_left):
            return rig, lin, named
        if excess * QUIETEST**tries_left > 1.0:
            break
        rig = rig.noisier(max(0.8 / excess, QUIETEST) if excess > 1.0 else min(0.04 / small, 3.0))
    raise UnfitError(f"{recipe}: {excess:.2g} times the physical limit")


def _within(named: list[Sized]) -> tuple[float, float]:
    """Least and greatest share of its physical limit that an effect takes."""
    shares = [s.amplitude / EFFECTS[s.id].limit for s in named] or [0.5]
    return min(shares), max(shares)


def simulate(rig: Rig, drive: Drive, run: Run, rng: Generator) -> Array:
    """Traces of one recording on the grid."""
    p = drive.plant
    start = stepping.start_at_rest(p, run.start, float(run.load[0]))
    encoder = 1e-5 * rng.standard_normal(run.reference.size)
    controller = rig.controller if run.closed else rig.controller._replace(closed=0)
    traces = stepping.run(p, controller, run.reference, run.load, run.temperature, encoder, start)
    return np.asarray(traces[: len(stepping.TRACES)])


def motion(traces: Array, run: Run) -> Motion:
    """The motion of one recording, for the linear statistics."""
    named = dict(zip(stepping.TRACES, traces, strict=True))
    pull = np.gradient(named["motor_speed"], stepping.GRID)
    columns = (named["motor_angle"], named["motor_speed"], pull, run.load, run.temperature)
    angle, speed, pull, load, temperature = (np.ascontiguousarray(x[: x.size // SKIP * SKIP : SKIP]) for x in columns)
    return Motion(angle, speed, pull, load, temperature)


def _speed_change(rig: Rig, full: Drive, traces: list[Array], fit: list[int], rng: Generator) -> float:
    row = stepping.TRACES.index("motor_speed")
    changed = [simulate(rig, full, rig.runs[k], rng)[row] for k in fit]
    return angle_share([x[row] for x in traces], changed)


class Recorded(NamedTuple):
    """One recording: its true motion, and its channels on the grid, clean and as the sensors give them."""

    motion: Motion
    clean: dict[str, Array]
    noisy: dict[str, Array]


def record(rig: Rig, drive: Drive, run: Run, index: int, rng: Generator) -> Recorded:
    """One recording of a drive."""
    traces = simulate(rig, drive, run, rng)
    clean = sensors.clean(traces, drive.faults)
    noisy = sensors.disturb(clean, rig.chain, rng)
    noisy["motor_torque"] = noisy["motor_torque"] * (1.0 + rig.torque_scale) + rig.torque_offset[index]
    return Recorded(motion(traces, run), clean, noisy)


def sampled(rig: Rig, run: Run, noisy: dict[str, Array], rng: Generator) -> dict[str, Array]:
    """The samples that the file of one recording holds."""
    return sensors.sample(shown(rig, run, noisy, rng), rig.chain, rng)


def shown(rig: Rig, run: Run, noisy: dict[str, Array], rng: Generator) -> dict[str, Array]:
    """The columns that the file of one recording holds."""
    out = {name: noisy[name] for name in measured(rig)}
    if run.load.any():
        out["load_torque"] = run.load
    if run.closed:
        out["speed_reference"] = run.reference
    out["temperature"] = run.temperature + 0.05 * rng.standard_normal(run.temperature.size)
    return out
