"""Simulate the drive of a campaign as its file states it, on the recorded motion, and measure how far off it is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from hdfast import files
from hdfast.checks import Floats
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.score import nrmse, unexplained
from hdfast.diagnosis.session import Setup, nominal, set_up_usable
from hdfast.printing import percent
from hdfast.recordings import Campaign, recorded

RESULTS = (files.COMPARISON, files.REPORT)
ERROR = "rms over the spread of what was measured"
WORSE = (
    "of {} the model explains nothing or less: check units, signs and clocks in [columns], ratio and inertias in "
    "[drive], and whether a load is missing"
)
LOST = "the drive cannot be simulated along its recorded motion: it has no error"


@dataclass(frozen=True, eq=False)
class Comparison:
    """A nominal drive and its recordings.

    Attributes:
        setup: the recordings at the working rate.
        mismatch: measured minus simulated of the fitted and of the held-out recordings, stacked.
    """

    setup: Setup = field(repr=False)
    mismatch: tuple[tuple[Replay, Floats], ...] = field(repr=False)

    @property
    def errors(self) -> list[dict[str, Any]]:
        """Error by recording and channel: root mean square over the standard deviation of what was measured.

        It is NaN where the drive cannot be simulated.
        """
        rows = []
        for replay, stacked in self.mismatch:
            for index, channel, where in replay.layout.pieces:
                unit = replay.plant.units[index]
                size = float((stacked[where] ** 2).mean() ** 0.5)
                spread = float(replay.layout.spread[where][0])
                rows.append(
                    {"recording": unit.name, "role": unit.role, "channel": channel, "rms": size, "nrmse": size / spread}
                )
        return rows

    @property
    def nrmse(self) -> dict[str, float]:
        """Error over all recordings and channels, by role; NaN where the drive cannot be simulated along one."""
        return {replay.plant.units[0].role: nrmse(replay.layout, stacked) for replay, stacked in self.mismatch}

    @property
    def warnings(self) -> list[str]:
        """As `Setup.warnings`, what cannot be simulated, whether the model explains nothing."""
        return warned(self.setup, self.mismatch)

    def to_dict(self) -> dict[str, Any]:
        """What comparison.json holds; null where there is no number."""
        content: dict[str, Any] = files.json_ready(
            {"nrmse": self.nrmse, "errors": self.errors, "warnings": self.warnings, "version": version("hdfast")}
        )
        return content

    def report(self, folder: str | Path) -> Path:
        """Write the page, the numbers and a copy of the campaign; returns the page's path.

        Raises:
            InputError: the folder cannot be written, holds another campaign file that is no copy of one, or results of
                another command.
        """
        from hdfast.report.comparison_page import page

        campaign = self.setup.campaign
        path = files.prepare_results(folder, campaign.text, RESULTS, campaign.folder)
        files.remove(path / name for name in RESULTS)
        files.write_text(path / files.CAMPAIGN, campaign.text)
        files.write_text(path / files.REPORT, page(self))
        files.write_json(path / files.COMPARISON, self.to_dict())
        return path / files.REPORT

    def __repr__(self) -> str:
        shares = ", ".join(f"{role} {percent(share)}" for role, share in self.nrmse.items())
        return f"Error of the nominal drive ({ERROR}): {shares}"


def warned(setup: Setup, mismatch: Iterable[tuple[Replay, Floats]]) -> list[str]:
    """Warnings of the setup, recordings without an error, and torques of which nothing is explained.

    Args:
        setup: the recordings at the working rate.
        mismatch: measured minus simulated (N,), stacked, NaN where a drive cannot be simulated.
    """
    lost: list[str] = []
    astray: list[set[str]] = []
    for replay, stacked in mismatch:
        pieces = replay.layout.pieces
        gone = [replay.plant.units[index].name for index, _, where in pieces if not np.isfinite(stacked[where]).all()]
        lost += gone
        astray += [] if gone else [set(unexplained(replay, stacked))]
    worse = [WORSE.format(channel) for channel in sorted(set.intersection(*astray) if astray else ())]
    return [*setup.warnings, *(f"{name}: {LOST}" for name in dict.fromkeys(lost)), *worse]


def compare(campaign: str | Path | Campaign, *, threads: int | None = None) -> Comparison:
    """Compare the nominal drive of a campaign, as given, with its recordings.

    The recorded motion of the motor drives the model; motor torque, transmission error and output torque are compared,
    as far as they were recorded.

    Args:
        campaign: campaign file, or one that is loaded.
        threads: threads of the engine.

    Raises:
        ConfigError: the campaign file is wrong.
        InputError: a recording cannot be read, the health checks leave none, nothing can be told from what they leave,
            or the drive cannot be simulated as stated.
        MissingPackageError: an MDF or TDMS file without the package that reads it.
    """
    setup = set_up_usable(recorded(campaign), threads)
    structure = nominal(setup)
    replays = [replay for replay in (setup.replay, setup.held) if replay is not None]
    return Comparison(
        setup, tuple((replay, replay.mismatch(structure, structure.start[None])[0]) for replay in replays)
    )
