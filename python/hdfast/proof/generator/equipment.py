"""Sensors and controllers as benches have them."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from hdfast.proof.generator.control import NO_NOTCH, Controller, notch
from hdfast.proof.generator.noise import Noise
from hdfast.proof.generator.plant import Plant
from hdfast.proof.generator.recipe import Bench
from hdfast.proof.generator.sensors import Chain
from hdfast.proof.generator.stepping import STEP

TURN = 2.0 * np.pi


def draw_chain(rng: Generator, bench: Bench) -> Chain:
    """A sampling chain; noise white and 1/f.

    100 to 1000 Hz without a load side, 500 or 1000 Hz with it, 100 Hz for a fast drive, whatever it conceals.
    """
    usual = [100.0, 250.0, 500.0, 1000.0] if bench.motor_only else [500.0, 1000.0]
    rate = float(rng.choice([100.0] if bench.fast else usual))
    level = bench.noise * np.exp(rng.normal(0, 0.4))
    torque = 0.003 * level
    corner = rng.uniform(200.0, 1500.0, 3)
    return Chain(
        rate=rate,
        averaged=bool(rng.random() < 0.5) and not bench.fast,
        jitter=float(rng.uniform(0.01, 0.05)),
        dropped=float(rng.choice([0.0, 0.0, 0.002, 0.01])),
        skew=float(rng.uniform(-2e-4, 2e-4)),
        resolution=(
            TURN / 2 ** int(rng.choice([14, 16, 17])),
            TURN / 2 ** int(rng.choice([17, 18, 19, 20])),
            float(rng.choice([0.0, 5e-4, 2e-3])),
            float(rng.choice([0.0, 0.02])),
        ),
        noise=(
            Noise(1e-5, 0.0, 1.0),
            Noise(4e-6 * level, rng.uniform(1e-5, 4e-5) * level, corner[0]),
            Noise(torque * rng.uniform(0.5, 1.5), torque * rng.uniform(0.5, 1.5), corner[1]),
            Noise(0.1 * level, 0.25 * level, corner[2]),
        ),
    )


def draw_controller(rng: Generator, inertia: float, plant: Plant, chain: Chain, bench: Bench) -> tuple[Controller, str]:
    """A controller, and how the campaign tells of it: only a plain one can be declared correctly."""
    bandwidth = TURN * (rng.uniform(30.0, 45.0) if bench.stiff else rng.uniform(6.0, 30.0))
    kp = float(inertia * bandwidth)
    period = float(rng.choice([5e-4, 1e-3]))
    habit = rng.choice(["plain", "friction", "notch", "position"], p=[0.4, 0.2, 0.2, 0.2])
    position = habit == "position" or bench.stiff
    controller = Controller(
        closed=1,
        kp=kp,
        ki=kp * bandwidth * float(rng.uniform(0.1, 0.35)),
        stiffness=float(rng.uniform(4.0, 15.0) * (2.0 if bench.stiff else 1.0)) if position else 0.0,
        limit=float(rng.uniform(1.0, 3.0)),
        samples=round(period / STEP),
        step=chain.resolution[0],
        smoothing=float(rng.uniform(0.3, 0.7)),
        friction=plant.T_c * float(rng.uniform(0.4, 1.6)) if habit == "friction" else 0.0,
        viscous=plant.B_m * float(rng.uniform(0.4, 1.6)) if habit == "friction" else 0.0,
        notch=notch(rng.uniform(60, 120), 0.5, period) if habit == "notch" else NO_NOTCH.copy(),
    )
    ways = ["correct", "incomplete", "absent"] if habit == "plain" and not position else ["incomplete", "absent"]
    return controller, str(rng.choice(ways))
