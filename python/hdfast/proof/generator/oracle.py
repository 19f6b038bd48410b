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
    rate, inertia = rig.chain.rate, rig.plant.J_r + rig.plant.J_w
    corners = np.geomspace(LOWEST, 0.5 * rate, CORNERS)
    whole: list[float] = []
    below: dict[str, list[list[float]]] = {}
    for true, seen in zip(clean, noisy, strict=True):
        for name, (a, b) in _compared(rig, true, seen).items():
            whole.append(float(np.std(b - a)) / (float(np.std(b)) + TINY))
            frequency = np.fft.rfftfreq(a.size, 1.0 / rate)[1:]
            if name == "motor_torque":
                shaken = sampled(rig, halved(rig, seen["motor_angle"] - true["motor_angle"]), rate)
                accelerated = inertia * (TURN * frequency) ** 2 * np.fft.rfft(shaken)[1:]
                noise = np.abs(np.fft.rfft(b - np.polyval(np.polyfit(a, b, 1), a))[1:] + accelerated)
                passed = [1.0 / (1.0 + (frequency / corner) ** (2 * ORDER)) for corner in corners]
            else:
                noise = np.abs(np.fft.rfft(b - a)[1:])
                passed = [np.asarray(frequency <= corner, dtype=float) for corner in corners]
            rms = [float(np.linalg.norm(share * noise)) * np.sqrt(2.0) / a.size for share in passed]
            below.setdefault(name, []).append(rms)
    rows = {name: np.sqrt(np.mean(np.square(own), axis=0)) for name, own in below.items()}
    return {
        "oracle_heldout_nrmse": float(np.sqrt(np.mean(np.square(whole)))),
        "oracle_heldout": {
            name: [[round(float(f), 3), float(f"{rms:.4g}")] for f, rms in zip(corners, row, strict=True)]
            for name, row in rows.items()
        },
    }


def _compared(rig: Rig, true: dict[str, Array], seen: dict[str, Array]) -> dict[str, tuple[Array, Array]]:
    """Clean and noisy signals that are compared, by the names of a verdict's channels."""
    ratio = rig.plant.ratio
    out = {}
    for name in channels(rig):
        if name == "load_angle":
            pair = [x["motor_angle"] / ratio - x["load_angle"] for x in (true, seen)]
        else:
            pair = [x["motor_torque" if name == "torque" else name] for x in (true, seen)]
        a, b = (sampled(rig, halved(rig, x), rig.chain.rate) for x in pair)
        out[CHANNEL[name]] = (a, b)
    return out
