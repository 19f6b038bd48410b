"""What the health checks say of a campaign."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hdfast.health.coverage import Coverage
from hdfast.health.finding import NOTE, REJECT, WARNING, Finding
from hdfast.health.repeats import Repeat, repeats
from hdfast.health.subject import Facts, Subject
from hdfast.recordings import CampaignRecording, Recording


@dataclass(frozen=True, eq=False)
class RecordingHealth:
    """What the checks found on one recording.

    Attributes:
        source: the recording as it was read.
        findings: what the checks have to say.
        facts: what they measured.
        timed: (n,) samples of the source whose time can be used.
        mask: (n,) samples that are usable: time, required columns, outside events; `mask[timed]` belongs to
            `recording`.
        recording: the samples with usable time, checked; None when their time cannot be used.
    """

    source: CampaignRecording
    findings: list[Finding]
    facts: Facts = field(repr=False)
    timed: NDArray[np.bool_] = field(repr=False)
    mask: NDArray[np.bool_] = field(repr=False)
    recording: Recording | None = field(repr=False)

    @property
    def name(self) -> str:
        """The name of the recording."""
        return self.source.name

    @property
    def usable(self) -> bool:
        """True when no finding rejects the recording."""
        return all(finding.severity != REJECT for finding in self.findings)

    @property
    def reason(self) -> str:
        """Why it is rejected, empty when it is usable."""
        return "; ".join(finding.sentence for finding in self.findings if finding.severity == REJECT)


@dataclass(frozen=True, eq=False)
class Health:
    """What the checks found on a campaign.

    Attributes:
        recordings: one entry per recording, in the order of the campaign.
        findings: what concerns the campaign file as a whole.
        coverage: what each group went through.
        subjects: the recordings as the checks saw them.
    """

    recordings: list[RecordingHealth]
    findings: list[Finding]
    coverage: list[Coverage]
    subjects: Sequence[Subject] = field(repr=False)

    @cached_property
    def repeats(self) -> list[Repeat]:
        """Pairs of recordings with equal input."""
        return repeats(self.subjects)

    @property
    def rejected(self) -> dict[str, str]:
        """Reason by name of each rejected recording."""
        return {item.name: item.reason for item in self.recordings if not item.usable}

    @property
    def usable(self) -> bool:
        """True when a recording for fitting is left."""
        return any(item.usable and item.source.role == "fit" for item in self.recordings)

    @property
    def complaint(self) -> str:
        """Why nothing is left to be fitted, empty when something is."""
        if self.usable:
            return ""
        if not any(item.source.role == "fit" for item in self.recordings):
            return 'No recording has the role "fit": without one there is nothing to calibrate the model on.'
        alike: dict[str, list[str]] = {}
        for name, reason in self.rejected.items():
            alike.setdefault(reason.replace(f"{name}: ", ""), []).append(name)
        return ". ".join(f"{', '.join(names)}: {reason}" for reason, names in alike.items())

    @property
    def warnings(self) -> list[str]:
        """What to mend or keep in mind: the sentences of warnings, and of recordings that are not used."""
        marks = {WARNING: "", REJECT: "not used: "}
        return [marks[item.severity] + item.sentence for item in self._every() if item.severity in marks]

    @property
    def notes(self) -> list[str]:
        """What is good to know: the sentences of all other findings."""
        return [item.sentence for item in self._every() if item.severity == NOTE]

    def __iter__(self) -> Iterator[RecordingHealth]:
        return iter(self.recordings)

    def _every(self) -> list[Finding]:
        return [*self.findings, *(finding for item in self.recordings for finding in item.findings)]

    def __repr__(self) -> str:
        marks = {REJECT: "rejected", WARNING: "warning"}
        lines = [f"{marks.get(item.severity, 'note'):>8}  {item.check:<12} {item.sentence}" for item in self._every()]
        good = sum(item.usable for item in self.recordings)
        return "\n".join([f"{good} of {len(self.recordings)} recordings usable", *lines])
