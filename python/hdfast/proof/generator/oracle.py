"""What the true structure, refitted, would leave of held-out recordings: their noise and what the refit gets wrong."""

from __future__ import annotations

from typing import Any

import numpy as np

from hdfast.proof.generator.equipment import TURN
from hdfast.proof.generator.imposed import COARSE
from hdfast.proof.generator.plant import Array
from hdfast.proof.generator.responses import channels, every, halved, sampled
from hdfast.proof.generator.rig import Rig
from hdfast.proof.generator.whitening import Channels

LOWEST, CORNERS, ORDER = 1.0, 24, 4
TINY = 1e-30
CHANNEL = {"torque": "motor_torque", "load_angle": "te", "output_torque": "output_torque"}


def oracle(
    rig: Rig, clean: list[dict[str, Array]], noisy: list[dict[str, Array]], mispredicted: Channels
) -> dict[str, Any]:
    """Error of the true structure, refitted, on held-out recordings: of all samples, and by channel and corner.

    `oracle_heldout_nrmse` is the root mean square over channels (motor torque, transmission error, output torque) and
    recordings of rms(error) / std(measured). A tool compares within a band of its own, and only where it judges:
    `oracle_heldout` gives pairs of corner [Hz] and rms error below it [N m or rad], `noise_heldout` that of the noise,
    which no refit reaches. The torque's noise also holds what the motor angle's looks like, differentiated twice, and
    goes through a zero-phase low-pass of order `ORDER` with half its amplitude at the corner.

    Args:
        rig: the rig.
        clean, noisy: channels of each recording on the grid, without and with noise.
        mispredicted: what the refitted structure misses of the clean channels.
    """
    corners = np.geomspace(LOWEST, 0.5 * rig.chain.rate, CORNERS)
    shares: list[float] = []
    noise: dict[str, list[Array]] = {CHANNEL[name]: [] for name in channels(rig)}
    error: dict[str, list[Array]] = {name: [] for name in noise}
    for true, seen, missed in zip(clean, noisy, mispredicted, strict=True):
        angle = _kept(rig, seen["motor_angle"] - true["motor_angle"])
        for (name, (a, b)), missing in zip(_compared(rig, true, seen).items(), missed, strict=True):
            wrong = _up_to(missing, every(rig) * COARSE, corners)
            torque = name == "motor_torque"
            own = _unscaled(a, b) if torque else b - a
            shares.append(float(np.hypot(np.std(own), wrong[-1])) / (float(np.std(b)) + TINY))
            below = _of_torque(rig, own, angle, corners) if torque else _up_to(own, 1.0 / rig.chain.rate, corners)
            noise[name].append(below)
            error[name].append(np.hypot(below, wrong))
    return {
        "oracle_heldout_nrmse": float(np.sqrt(np.mean(np.square(shares)))),
        "oracle_heldout": _rows(corners, error),
        "noise_heldout": _rows(corners, noise),
    }


def _rows(corners: Array, spectra: dict[str, list[Array]]) -> dict[str, list[list[float]]]:
    """Pairs of corner and root mean square over recordings, by channel."""
    rows = {name: np.sqrt(np.mean(np.square(own), axis=0)) for name, own in spectra.items()}
    return {
        name: [[round(float(f), 3), float(f"{rms:.4g}")] for f, rms in zip(corners, row, strict=True)]
        for name, row in rows.items()
    }


def _kept(rig: Rig, x: Array) -> Array:
    """What the recorder keeps of a signal in steps of `COARSE`, at its own rate."""
    return sampled(rig, halved(rig, x), rig.chain.rate)


def _up_to(values: Array, step: float, corners: Array) -> Array:
    """Root mean square of samples (N,), `step` [s] apart, up to each corner, shape (K,)."""
    frequency = np.fft.rfftfreq(values.size, step)[1:]
    return _rms(np.abs(np.fft.rfft(values)[1:]), (frequency <= corners[:, None]).astype(float), values.size)


def _unscaled(clean: Array, noisy: Array) -> Array:
    """Noise of a torque without the scale and the zero of its reading, which a refit finds, shape (N,)."""
    return np.asarray(noisy - np.polyval(np.polyfit(clean, noisy, 1), clean))


def _of_torque(rig: Rig, noise: Array, angle: Array, corners: Array) -> Array:
    """Root mean square of the torque's noise and of what the angle's (N,) looks like, below each corner, shape (K,)."""
    inertia = rig.plant.J_r + rig.plant.J_w
    frequency = np.fft.rfftfreq(noise.size, 1.0 / rig.chain.rate)[1:]
    accelerated = inertia * (TURN * frequency) ** 2 * np.fft.rfft(angle)[1:]
    own = np.fft.rfft(noise)[1:]
    return _rms(np.abs(own + accelerated), 1.0 / (1.0 + (frequency / corners[:, None]) ** (2 * ORDER)), noise.size)


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
