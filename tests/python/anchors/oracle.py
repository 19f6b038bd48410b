"""Inverse model by least squares: plain NumPy and SciPy on the columns of a campaign folder."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import signal
from scipy.interpolate import CubicSpline


@dataclass(frozen=True)
class Record:
    """One recording in SI units, and its role."""

    name: str
    role: str
    columns: dict[str, np.ndarray]

    def __getitem__(self, column: str) -> np.ndarray:
        return self.columns[column]

    @property
    def rate(self) -> float:
        return 1.0 / float(np.mean(np.diff(self["t"])))


def read_folder(campaign: Path) -> tuple[dict[str, Any], list[Record]]:
    """The sections of campaign.toml and its recordings, mapped columns scaled."""
    sections = tomllib.loads(campaign.read_text(encoding="utf-8"))
    records = []
    for entry in sections["recording"]:
        with np.load(campaign.parent / entry["file"]) as archive:
            columns = {key: archive[key] for key in archive.files}
        for standard, where in sections.get("columns", {}).items():
            columns[standard] = columns.pop(where["name"]) * where["scale"]
        records.append(Record(entry["file"], entry["role"], columns))
    return sections, records


def low_pass(values: np.ndarray, t: np.ndarray, corner: float, order: int = 4) -> np.ndarray:
    """Butterworth filter, forwards and backwards, on an even clock between the samples."""
    return _smooth(values, t, corner, order)(t)


def motion(record: Record, corner: float, order: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Speed and acceleration of the motor behind a low-pass."""
    spline = _smooth(record["motor_angle"], record["t"], corner, order)
    return spline(record["t"], 1), spline(record["t"], 2)


def speed_of(angle: np.ndarray, t: np.ndarray, corner: float, order: int = 4) -> np.ndarray:
    """Speed behind a low-pass."""
    return _smooth(angle, t, corner, order)(t, 1)


def _smooth(values: np.ndarray, t: np.ndarray, corner: float, order: int) -> CubicSpline:
    even = np.linspace(t[0], t[-1], len(t))
    b, a = signal.butter(order, corner * 2.0 * (even[1] - even[0]))
    return CubicSpline(even, signal.filtfilt(b, a, CubicSpline(t, values)(even)))


def fitted(columns: Sequence[np.ndarray], wanted: np.ndarray) -> np.ndarray:
    return np.linalg.lstsq(np.stack(columns, 1), wanted, rcond=None)[0]


def error(columns: Sequence[np.ndarray], factors: np.ndarray, wanted: np.ndarray) -> float:
    """Size of what is not explained, in per cent of the size of what is wanted."""
    rest = wanted - np.stack(columns, 1) @ factors
    return float(100.0 * np.linalg.norm(rest) / np.linalg.norm(wanted))


def decimated(values: np.ndarray, factor: int) -> np.ndarray:
    return signal.decimate(values, factor, ftype="fir")


def line(values: np.ndarray, phase: np.ndarray, frequencies: np.ndarray) -> np.ndarray:
    """Amplitude of each line cos(frequency phase + ...) in values, trend removed, Hann window."""
    trend = np.polynomial.Polynomial.fit(phase, values, 2)
    window = np.hanning(len(values))
    rest = window * (values - trend(phase))
    return 2.0 * np.abs(np.exp(-1j * np.outer(frequencies, phase)) @ rest) / window.sum()


def play(values: np.ndarray, half_gap: float) -> np.ndarray:
    """Play operator of the given half gap."""
    out = np.empty_like(values)
    state = values[0]
    for index, value in enumerate(values.tolist()):
        state = min(value + half_gap, max(value - half_gap, state))
        out[index] = state
    return out
