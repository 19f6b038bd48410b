"""What the tests of derivatives share: rows off the defaults, extrapolated differences, options of the calls."""

from __future__ import annotations

import hdfast
import numpy as np
from termed import torque_steps

INITIAL = [f"initial_{state}" for state in hdfast.Model().states]
OFFSETS = (-2.0, -1.0, 1.0, 2.0)
WEIGHTS = (1 / 12, -8 / 12, 8 / 12, -1 / 12)
#: Sizes of what is zero.
SIZES = {"te_cos_2": 9e-5, "te_sin_3": 6e-6, "initial_theta_m": 1.0, "initial_theta_l": 1e-3, "initial_omega_l": 0.1}

START_STOP = hdfast.Scenario.start_stop(speed_rpm=120, start="speed_ramp", stop="brake", t_end=2.0)
PRECISE = {"metrics": [], "rtol": 1e-12}
#: Start, run and stop at a speed.
AT_SPEED = PRECISE | {"scenario": START_STOP, "t_eval": np.linspace(0.0, 2.0, 81)}
#: Steps of torque: stops, holds and releases where there is friction.
STEPS = [(0.1, 0.16), (0.28, -0.15), (0.8, 0.0)]
AT_TORQUE = PRECISE | {"scenario": torque_steps(STEPS, load=4.0), "t_eval": np.linspace(0.0, 0.8, 33)}


def random_row(seed, **changes):
    rng = np.random.default_rng(seed)
    row = {p.name: p.default * rng.uniform(0.9, 1.1) for p in hdfast.params()}
    scenario = {"omega_set": 12.0, "tau_load": 6.0, "K_p": 0.05, "K_i": 0.8, "tau_max": 2.0, "theta_m0": 0.7}
    return row | scenario | {"ratio": 121.0, "s": 0.3, "k2": 2e5} | changes


def differences(row, wrt, step, start=None, **options):
    """Central differences, extrapolated once, with `wrt` last; and the error that rounding leaves in them."""
    sizes = np.array([step * (abs(row.get(name, 0.0)) or SIZES.get(name, 1.0)) for name in wrt])
    count = len(wrt) * len(OFFSETS)
    table = {name: np.full(count, value) for name, value in row.items()}
    states = None if start is None else np.tile(start, (count, 1))
    for k, (name, size) in enumerate(zip(wrt, sizes, strict=True)):
        for j, offset in enumerate(OFFSETS):
            if name in INITIAL:
                states[4 * k + j, INITIAL.index(name)] += offset * size
            else:
                table[name][4 * k + j] += offset * size
    result = hdfast.sweep(table, initial_state=states, **options)
    assert result.finished.all()
    found = {}
    for name, values in {**result.metrics, **result.samples, **result.recorded}.items():
        grouped = values.reshape(len(wrt), 4, *values.shape[1:])
        slopes = np.moveaxis(np.tensordot(grouped, WEIGHTS, axes=(1, 0)), 0, -1) / sizes
        found[name] = slopes, 1e-11 * np.max(np.abs(values)) / sizes
    return found


def assert_close(row, wrt, tolerance, steps=(1e-3, 1e-4), start=None, **options):
    """Samples within `tolerance` of the largest derivative over time, metrics of themselves.

    The best of the steps counts; rounding may add what it leaves in the longest of them.
    """
    state = None if start is None else np.array([start])
    result = hdfast.sweep(row, initial_state=state, sensitivities=wrt, **options)
    assert result.finished.all(), result.message(0)
    references = [differences(row, wrt, step, start, **options) for step in steps]
    over_time = {**result.sample_sensitivities, **result.recorded_sensitivities}
    for name, found in {**result.metric_sensitivities, **over_time}.items():
        expected = [reference[name] for reference in references]
        sizes = [np.abs(slope) if slope.ndim == 1 else np.max(np.abs(slope), axis=0) for slope, _ in expected]
        error = np.min([np.abs(found[0] - slope) for slope, _ in expected], axis=0)
        error, size = error - np.min([noise for _, noise in expected], axis=0), np.max(sizes, axis=0)
        worst = (error / np.maximum(size, 1e-300)).reshape(-1, len(wrt)).max(0)
        assert np.all(error <= tolerance * size), f"{name}: {dict(zip(wrt, worst, strict=True))}"
