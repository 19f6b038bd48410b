"""Whitening of each channel by an autoregression fitted to realisations of its noise."""

from __future__ import annotations

import numpy as np
import scipy

from hdfast.proof.generator.plant import Array
from hdfast.proof.generator.responses import Motion, moving
from hdfast.proof.generator.rig import Rig

ORDER = 16
TINY = 1e-30

Channels = list[list[Array]]


def whiten(rig: Rig, motions: list[Motion], filters: list[tuple[Array, float]], raw: Channels) -> Array:
    """Whiten each channel of each recording and stack them.

    Of the torque counts what has moved during all of the filter's past: at standstill dry friction holds any torque up
    to its level, and a filter that has seen that torque as none shows friction at the step to motion.
    """
    rows = []
    for recording, m in zip(raw, motions, strict=True):
        for index, values in enumerate(recording):
            taps, sigma = filters[index]
            white = scipy.signal.lfilter(taps, [1.0], values) / sigma
            white[:ORDER] = 0.0
            if index == 0:
                white *= scipy.signal.lfilter(np.ones(ORDER + 1), [1.0], moving(rig, m)) > ORDER + 0.5
            rows.append(white)
    return np.concatenate(rows)


def fit_filters(noise: Channels) -> list[tuple[Array, float]]:
    """Autoregression per channel by Yule-Walker on all recordings."""
    out = []
    for index in range(len(noise[0])):
        lags = np.zeros(ORDER + 1)
        count = 0
        for recording in noise:
            x = recording[index] - recording[index].mean()
            lags += np.array([x[k:] @ x[: x.size - k] for k in range(ORDER + 1)])
            count += x.size
        lags /= count
        lags[0] *= 1.0 + 1e-9
        taps = np.append([1.0], -scipy.linalg.solve_toeplitz(lags[:-1], lags[1:]))
        out.append((taps, float(np.sqrt(max(float(taps @ lags), TINY)))))
    return out
