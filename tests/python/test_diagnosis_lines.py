"""Lines in a mismatch: found where a sinusoid is, nowhere else, and counted by recording."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hdfast.diagnosis.band import Band
from hdfast.diagnosis.evidence import Layout
from hdfast.diagnosis.lines import tone_lines
from hdfast.diagnosis.replay import Replay

RATE, SECONDS = 500.0, 8.0
TIMES = np.arange(0.0, SECONDS, 1.0 / RATE)


def replay(owners: list[tuple[int, str]]) -> Replay:
    """Recordings of which nothing but the time is known; one piece of the layout per (recording, channel)."""
    n = len(TIMES)
    units = [SimpleNamespace(t=TIMES) for _ in range(1 + max(unit for unit, _ in owners))]
    channels = tuple(dict.fromkeys(channel for _, channel in owners))
    pieces = tuple((unit, channel, slice(k * n, (k + 1) * n)) for k, (unit, channel) in enumerate(owners))
    numbers = np.concatenate([np.full(n, unit) for unit, _ in owners])
    layout = Layout(
        channels, np.concatenate([np.full(n, channels.index(channel)) for _, channel in owners]), numbers, numbers,
        np.tile(np.arange(n), len(owners)), pieces, np.ones(n * len(owners)), np.ones(len(owners)),
    )  # fmt: skip
    plant = SimpleNamespace(units=units, band=Band(RATE, 0.4 * RATE, 0.4 * RATE))
    return Replay(plant, layout, np.ones(len(channels)), np.ones(len(channels)))


@pytest.mark.parametrize("ratio", [3.0, 10.0, 100.0])
@pytest.mark.parametrize("frequency", [7.0, 40.0, 90.0])
def test_exact_a_sinusoid_has_one_line(frequency: float, ratio: float) -> None:
    """At the edge of the band, where its low-pass ends, a shoulder may stand; it is far weaker."""
    noise = np.random.default_rng(1).standard_normal(len(TIMES))
    found = tone_lines(replay([(0, "motor_torque")]), ratio * np.sin(2.0 * np.pi * frequency * TIMES) + noise)
    assert found[0].position == pytest.approx(frequency, abs=0.5 / SECONDS)
    assert all(line.prominence < 0.3 * found[0].prominence for line in found[1:])


def test_exact_a_line_in_two_channels_stands_in_one_recording() -> None:
    noise = np.random.default_rng(2).standard_normal(4 * len(TIMES))
    tone = 3.0 * np.sin(2.0 * np.pi * 7.0 * TIMES)
    owners = [(0, "motor_torque"), (0, "te"), (1, "motor_torque"), (1, "te")]
    both = tone_lines(replay(owners), noise + np.tile(tone, 4))[0]
    one = tone_lines(replay(owners), noise + np.concatenate([tone, tone, 0.0 * tone, 0.0 * tone]))[0]
    assert (both.recordings, one.recordings) == (2, 1)
