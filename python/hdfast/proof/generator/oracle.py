"""What the true structure would leave of held-out recordings: their noise, of all samples and below a corner."""

from __future__ import annotations

from typing import Any

import numpy as np

from hdfast.proof.generator.plant import Array
from hdfast.proof.generator.responses import channels, halved, inertial_torque, sampled
from hdfast.proof.generator.rig import Rig

LOWEST, CORNERS = 1.0, 24
TINY = 1e-30
CHANNEL = {"torque": "motor_torque", "load_angle": "te", "output_torque": "output_torque"}


def oracle(rig: Rig, clean: list[dict[str, Array]], noisy: list[dict[str, Array]]) -> dict[str, Any]:
    """Noise over signal of held-out recordings with the true structure: of all samples, and by channel and corner.

    Root mean square over channels (motor torque, transmission error, output torque) and recordings of
    rms(noise) / std(measured). A tool compares within a band of its own: `oracle_heldout` gives pairs of corner [Hz]
    and error of what is below, where the torque also holds what the motor angle's noise looks like.
    """
    rate, inertia = rig.chain.rate, rig.plant.J_r + rig.plant.J_w
    corners = np.geomspace(LOWEST, 0.5 * rate, CORNERS)
    whole: list[float] = []
    below: dict[str, list[list[float]]] = {}
    for true, seen in zip(clean, noisy, strict=True):
        for name, (a, b) in _compared(rig, true, seen).items():
            spread = float(np.std(b)) + TINY
            whole.append(float(np.std(b - a)) / spread)
            noise = b - a
            if name == "motor_torque":
                noise = b - np.polyval(np.polyfit(a, b, 1), a)
                shaken = sampled(rig, halved(rig, seen["motor_angle"] - true["motor_angle"]), rate)
                noise = noise - inertial_torque(shaken, inertia, 1.0 / rate)
            below.setdefault(name, []).append([_below(noise, corner, rate) / spread for corner in corners])
    rows = {name: np.sqrt(np.mean(np.square(shares), axis=0)) for name, shares in below.items()}
    return {
        "oracle_heldout_nrmse": float(np.sqrt(np.mean(np.square(whole)))),
        "oracle_heldout": {
            name: [[round(float(f), 3), float(f"{share:.4g}")] for f, share in zip(corners, row, strict=True)]
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


def _below(noise: Array, corner: float, rate: float) -> float:
    """Rms of what noise has up to a corner, without its mean."""
    power = np.abs(np.fft.rfft(noise)) ** 2
    inside = np.fft.rfftfreq(noise.size, 1.0 / rate) <= corner
    inside[0] = False
    return float(np.sqrt(2.0 * np.sum(power[inside])) / noise.size)
