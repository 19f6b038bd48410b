"""How hard a case is, from the generator's own linearisation: what a refit leaves, and which rival looks alike."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from hdfast.proof.generator.effects import EFFECTS, Effect, Shape
from hdfast.proof.generator.linear import Linearisation, Refit
from hdfast.proof.generator.plant import Array
from hdfast.proof.generator.responses import RATE
from hdfast.proof.generator.sizing import Sized

SEPARABLE = 0.8
RIVAL = 0.8
DRAWS, SIZES = 3, (0.1, 1.0)  # shapes of a rival, and multiples of its typical amplitude
FAINT = 0.1
BIN = 0.05
SHARE = 0.8
GAP = 0.25
MOVED = 0.1
NEED_DRY = ("presliding_friction", "asymmetric_friction", "position_dependent_friction")
NOTHING: dict[str, Any] = {
    "refit_nrmse_over_noise": 1.0, "visibility": None, "absorption": {}, "closest_rival": None, "rivals": [],
    "separable_place": False, "windows": [], "orders": [], "depends_on": [], "memory": "none",
}  # fmt: skip


def hiding(lin: Linearisation, refit: Refit) -> dict[str, Any]:
    """How much of the effects a refit of the baseline leaves, and which parameters it would move."""
    moved = {name: round(float(s), 3) for name, s in zip(lin.names, refit.shift, strict=True) if abs(s) > MOVED}
    return {
        "refit_nrmse_over_noise": refit_over_noise(lin, refit.raw),
        "visibility": refit.visibility,
        "absorption": {name: s for name, s in moved.items() if not name.startswith("offset")},
    }


def likeness(lin: Linearisation, refit: Refit, named: list[Sized], files: list[str]) -> dict[str, Any]:
    """Which rivals the remaining signature resembles, where it is and what it follows; empty fields without effects."""
    if not named:
        return dict(NOTHING)
    looks = rivals(lin.sloped(refit.shift), refit.left, named)
    first = EFFECTS[named[0].id]
    elsewhere = [r["abs_cos"] for r in looks if EFFECTS[r["id"]].place != first.place]
    return {
        "closest_rival": looks[0],
        "rivals": [r for r in looks if r["abs_cos"] > RIVAL],
        "separable_place": max(elsewhere, default=0.0) < SEPARABLE,
        "windows": windows(lin, refit.left, files),
        "orders": [order for s in named if (order := _order(s)) is not None],
        "depends_on": list(first.depends_on),
        "memory": first.memory,
    }


def _order(sized: Sized) -> float | None:
    """Cycles per motor revolution of an effect, None for one without."""
    order = EFFECTS[sized.id].order
    if order == "pole_pairs":
        return 2.0 * float(sized.shape["pole_pairs"])
    return float(sized.shape[order]) if isinstance(order, str) else order


def refit_over_noise(lin: Linearisation, residual: Array) -> float:
    """Rms over channels of the residual's size after a refit, noise included, over the noise alone."""
    ratios = []
    for index in range(len(lin.level)):
        part = np.concatenate([rows[index] for rows in split(lin, residual)])
        ratios.append(1.0 + float(np.mean(part**2)) / lin.level[index] ** 2)
    return float(np.sqrt(np.mean(ratios)))


def split(lin: Linearisation, stacked: Array) -> list[list[Array]]:
    """A stacked vector by recording and channel."""
    out, at = [], 0
    for recording in lin.base:
        row = []
        for values in recording:
            row.append(stacked[at : at + values.size])
            at += values.size
        out.append(row)
    return out


def rivals(lin: Linearisation, left: Array, named: list[Sized]) -> list[dict[str, Any]]:
    """Effects of the published list by how much of the remaining signature they explain, after a refit of each.

    Each is taken at its best of several shapes and sizes; where the first resembles nothing, at that. A rival with a
    phase may turn it, so its span is that of two phases a quarter apart; one with an order takes that of the effect
    where it has one.

    Args:
        lin: at the plant that the refit has moved to: there a rival would add to it.
        left: what that refit leaves, whitened.
        named: the effects.
    """
    taken = {s.id for s in named}
    out = []
    for effect in EFFECTS.values():
        if effect.id in taken or effect.id.startswith(("outside_", "minor_")):
            continue
        if (lin.rig.motor_only and effect.needs_load_side) or (effect.id in NEED_DRY and lin.rig.plant.T_c == 0.0):
            continue
        cosine = 0.0
        for turned, size in product(_shapes(effect, _order(named[0])), SIZES):
            cosine = max(cosine, _cosine(lin, effect, turned, size * effect.typical, left))
            if cosine < FAINT:
                break
        out.append({"id": effect.id, "abs_cos": round(min(cosine, 1.0), 4)})
    return sorted(out, key=lambda r: -r["abs_cos"])


def _shapes(effect: Effect, order: float | None) -> list[list[Shape]]:
    """Shapes that a rival may take, each at the phases that span it.

    Args:
        effect: the rival.
        order: that of the effect it is to resemble.
    """
    drawn = [effect.shape(np.random.default_rng(draw)) for draw in range(DRAWS)]
    phases = [name for name in drawn[0] if name.startswith("psi") or name.endswith("phase")]
    free = set(drawn[0]) - {*phases, effect.order}
    taken = {}
    if order is not None and isinstance(effect.order, str):
        taken = {effect.order: order}
        if effect.order == "pole_pairs":
            taken = {effect.order: 0.5 * order} if order % 2.0 == 0.0 else {}
    turns = [{phases[0]: quarter} for quarter in (0.0, np.pi / 2)] if phases else [{}]
    return [[{**shape, **taken, **turn} for turn in turns] for shape in drawn[: None if free else 1]]


def _cosine(lin: Linearisation, effect: Effect, turned: list[Shape], amplitude: float, left: Array) -> float:
    """Share of the remaining signature that an effect of this amplitude explains, turned to any phase."""
    span = [lin.left(lin.signature(effect.on(lin.drive, amplitude, shape))[0]) for shape in turned]
    basis = np.linalg.svd(np.column_stack(span), full_matrices=False)
    strong = basis.U[:, 1e-6 * max(basis.S[0], 1e-30) < basis.S] if basis.S[0] > 1e-9 else basis.U[:, :0]
    return float(np.linalg.norm(strong.T @ left) / np.linalg.norm(left))


def windows(lin: Linearisation, left: Array, files: list[str]) -> list[list[Any]]:
    """Shortest set of time windows that hold 80 % of the remaining signature's energy; short gaps are bridged."""
    step = 1.0 / min(RATE, lin.rig.chain.rate)
    width = max(round(BIN / step), 1)
    bins = []
    for index, rows in enumerate(split(lin, left)):
        energy = np.sum([row[: row.size // width * width].reshape(-1, width) ** 2 for row in rows], axis=(0, 2))
        bins += [(float(e), index, k) for k, e in enumerate(energy)]
    bins.sort(reverse=True)
    total, kept, chosen = sum(e for e, _, _ in bins), 0.0, set()
    for energy, index, k in bins:
        if kept >= SHARE * total:
            break
        kept += energy
        chosen.add((index, k))
    return [
        [round(a * width * step, 3), round((b + 1) * width * step, 3), files[index]]
        for index in range(len(files))
        for a, b in _joined(sorted(k for i, k in chosen if i == index), max(round(GAP / (width * step)), 1))
    ]


def _joined(places: list[int], gap: int) -> list[tuple[int, int]]:
    out: list[tuple[int, int]] = []
    for k in places:
        if out and k - out[-1][1] <= gap:
            out[-1] = (out[-1][0], k)
        else:
            out.append((k, k))
    return out


def angle_share(bare: list[Array], full: list[Array]) -> float:
    """How much an effect changes the motor speed under its controller: rms of the change over rms of the speed."""
    change = np.concatenate([a - b for a, b in zip(full, bare, strict=True)])
    speed = np.concatenate(bare)
    return float(np.sqrt(np.mean(change**2) / np.mean(speed**2)))
