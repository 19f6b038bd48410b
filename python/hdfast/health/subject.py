"""A recording under examination: what the checks read and where they write."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.health.finding import REJECT, Finding
from hdfast.health.motion import Motion
from hdfast.health.rigid import RigidFit, rigid_fit
from hdfast.recordings import Campaign, CampaignRecording, Recording

REQUIRED = ("t", "motor_angle", "motor_torque")
ANGLES = ("motor_angle", "load_angle")
LARGEST = 1e12
Window = tuple[float, float]


@dataclass
class Facts:
    """What was measured on a recording.

    Attributes:
        rate_hz: samples per second that its clock would take.
        effective_rate_hz: changes per second of a column whose values are held, else numbers per second: `rate_hz`
            unless samples are missing throughout.
        resolution: step of a column; the larger of what is stated and what the values show.
        lag_s: lag of the load side against the motor side [s], None where it cannot be told.
        ratio: gear ratio by the angles, None where it cannot be told.
        saturation: (torque [N m], share of samples) of a plateau, or None.
        gaps: times without samples [s].
        events: times in which the residual stands out [s].
    """

    rate_hz: float = float("nan")
    effective_rate_hz: dict[str, float] = field(default_factory=dict)
    resolution: dict[str, float] = field(default_factory=dict)
    lag_s: float | None = None
    ratio: float | None = None
    saturation: tuple[float, float] | None = None
    gaps: list[Window] = field(default_factory=list)
    events: list[Window] = field(default_factory=list)


class Subject:
    """One recording of a campaign on its way through the checks.

    Attributes:
        timed: (n,) samples whose time can be used.
        unused: columns with too few numbers, or with a fault that makes them useless.
        findings, facts: what the checks found.
    """

    def __init__(self, campaign: Campaign, recording: CampaignRecording) -> None:
        self.campaign = campaign
        self.recording = recording
        self.timed: NDArray[np.bool_] = np.ones(recording.samples, dtype=bool)
        self.unused: set[str] = set()
        self._left_out: dict[str, NDArray[np.bool_]] = {}
        self.findings: list[Finding] = []
        self.facts = Facts()
        drive = campaign.drive.values
        self.ratio: float | None = drive.get("ratio")
        inertia = None
        if self.ratio and "J_m" in drive:
            inertia = drive["J_m"] + drive.get("J_l", 0.0) / self.ratio**2
        self.inertia: float | None = inertia

    def find(self, check: str, severity: str, sentence: str, **numbers: Any) -> None:
        """Add a finding; `numbers` are value, limit, t0 and t1."""
        assert set(numbers) <= {item.name for item in fields(Finding)}
        self.findings.append(Finding(check, severity, f"{self.recording.name}: {sentence}", **numbers))

    @property
    def rejected(self) -> bool:
        """True when a check has rejected the recording."""
        return any(finding.severity == REJECT for finding in self.findings)

    def clean(self, name: str) -> Floats:
        """A column (n,) with NaN for everything that no sensor gives."""
        values = self.recording[name]
        known = np.abs(values) < LARGEST
        if name in self._left_out:
            known &= ~self._left_out[name]
        return np.where(known, values, np.nan)

    def known(self, name: str) -> NDArray[np.intp]:
        """Samples with a time and a number in a column; none of one that is missing or not used."""
        if name not in self.recording or name in self.unused:
            return np.zeros(0, dtype=np.intp)
        return np.flatnonzero(self.timed & np.isfinite(self.clean(name)))

    def leave_out(self, name: str, rows: NDArray[np.intp]) -> None:
        """Take some samples of a column for missing."""
        self._left_out.setdefault(name, np.zeros(self.recording.samples, dtype=bool))[rows] = True
        self.__dict__.pop("checked", None)

    def drop(self, name: str) -> None:
        """Do not use a column."""
        self.unused.add(name)
        self.__dict__.pop("checked", None)

    @cached_property
    def checked(self) -> Recording:
        """The columns and samples that can be used, after what was judged so far; columns and time come first."""
        columns = {name: self.clean(name)[self.timed] for name in self.recording if name not in self.unused}
        return Recording(self.recording.name, columns, self.facts.resolution, self.recording.notes)

    @cached_property
    def motion(self) -> Motion:
        """Smoothed motion on an even grid."""
        return Motion.of(self.checked, self.facts.rate_hz)

    def on_grid(self, name: str) -> Floats:
        """A column with numbers on the grid of the motion, shape (m,)."""
        known = np.isfinite(self.checked[name])
        return np.interp(self.motion.t, self.checked["t"][known], self.checked[name][known])

    @cached_property
    def rigid(self) -> RigidFit | None:
        """The motor torque explained by a rigid drive."""
        return rigid_fit(self.motion, self.ratio)

    def stated_lag(self, channel: str) -> float:
        """What the campaign states a channel to be later than the motor angle by [s]."""
        known = self.campaign.delays
        return known.get(channel, 0.0) - known.get("motor_angle", 0.0)

    def mask(self) -> NDArray[np.bool_]:
        """(n,) samples that are usable: time, required columns, outside events."""
        good = self.timed.copy()
        for name in REQUIRED:
            good &= np.isfinite(self.clean(name)) if name in self.recording else False
        if "t" in self.recording:
            for begin, end in self.facts.events:
                good &= ~((self.recording["t"] >= begin) & (self.recording["t"] <= end))
        return good
