"""What the true structure would leave of held-out recordings: their noise, of all samples and below a corner."""

from __future__ import annotations

from typing import Any

import numpy as np

from hdfast.proof.generator.equipment import TURN
from hdfast.proof.generator.plant import Array
from hdfast.proof.generator.responses import channels, halved, sampled
from hdfast.proof.generator.rig import Rig

LOWEST, CORNERS, ORDER = 1.0, 24, 4
TINY = 1e-30
CHANNEL = {"torque": "motor_torque", "load_angle": "te", "output_torque": "output_torque"}


def oracle(rig: Rig, clean: list[dict[str, Array]], noisy: list[dict[str, Array]]) -> dict[str, Any]:
    """What noise leaves of held-out recordings with the true structure: of all samples, and by channel and corner.

    `oracle_heldout_nrmse` is the root mean square over channels (motor torque, transmission error, output torque) and
    recordings of rms(noise) / std(measured). A tool compares within a band of its own, and only where it judges:
    `oracle_heldout` gives pairs of corner [Hz] and rms noise below it [N m or rad]. The torque also holds what the
    motor angle's noise looks like, differentiated twice, and goes through a zero-phase low-pass of order `ORDER` with
    half its amplitude at the corner.
    """
    corners = np.geomspace(LOWEST, 0.5 * rig.chain.rate, CORNERS)
    whole: list[float] = []
    below: dict[str, list[Array]] = {}
    for true, seen in zip(clean, noisy, strict=True):
        angle = _kept(rig, seen["motor_angle"] - true["motor_angle"])
        for name, (a, b) in _compared(rig, true, seen).items():
            whole.append(float(np.std(b - a)) / (float(np.std(b)) + TINY))
            own = _of_torque(rig, a, b, angle, corners) if name == "motor_torque" else _up_to(rig, b - a, corners)
            below.setdefault(name, []).append(own)
    rows = {name: np.sqrt(np.mean(np.square(own), axis=0)) for name, own in below.items()}
    return {
        "oracle_heldout_nrmse": float(np.sqrt(np.mean(np.square(whole)))),
        "oracle_heldout": {
            name: [[round(float(f), 3), float(f"{rms:.4g}")] for f, rms in zip(corners, row, strict=True)]
            for name, row in rows.items()
        },
    }


def _kept(rig: Rig, x: Array) -> Array:
    """What the recorder keeps of a signal in steps of `COARSE`, at its own rate."""
    return sampled(rig, halved(rig, x), rig.chain.rate)


def _up_to(rig: Rig, noise: Array, corners: Array) -> Array:
    """Root mean square of noise (N,) up to each corner, shape (K,)."""
    frequency = np.fft.rfftfreq(noise.size, 1.0 / rig.chain.rate)[1:]
    return _rms(np.abs(np.fft.rfft(noise)[1:]), (frequency <= corners[:, None]).astype(float), noise.size)


def _of_torque(rig: Rig, clean: Array, noisy: Array, angle: Array, corners: Array) -> Array:
    """Root mean square of the torque's noise and of what the angle's (N,) looks like, below each corner, shape (K,)."""
    inertia = rig.plant.J_r + rig.plant.J_w
    frequency = np.fft.rfftfreq(clean.size, 1.0 / rig.chain.rate)[1:]
    accelerated = inertia * (TURN * frequency) ** 2 * np.fft.rfft(angle)[1:]
    own = np.fft.rfft(noisy - np.polyval(np.polyfit(clean, noisy, 1), clean))[1:]
    return _rms(np.abs(own + accelerated), 1.0 / (1.0 + (frequency / corners[:, None]) ** (2 * ORDER)), clean.size)


def _rms(spectrum: Array, passed: Array, size: int) -> Array:
    """Root mean square of what filters (K, F) pass of an amplitude spectrum (F,) of real samples, shape (K,)."""
    return np.asarray(np.linalg.norm(passed * spectrum, axis=1) * np.sqrt(2.0) / size)


def _compared(rig: Rig, true: dict[str, Array], seen: dict[str, Array]) -> dict[str, tuple[Array, Array]]:
    """Clean and noisy signals that are compared, by the names of a verdict's channels."""
    ratio = rig.plant.ratio
    out = {}
    for name in channels(rig):
        if name == "load_angle":
            pair = [x["motor_angle"] / ratio - x["load_angle"] for x in (true, seen)]
        else:
            pair = [x["motor_torque" if name == "torque" else name] for x in (true, seen)]
        out[CHANNEL[name]] = (_kept(rig, pair[0]), _kept(rig, pair[1]))
    return out
