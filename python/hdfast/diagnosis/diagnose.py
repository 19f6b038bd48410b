"""The public call: a campaign in, a verdict with its evidence out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from hdfast import checks, files
from hdfast.diagnosis.content import as_dict, rejected
from hdfast.diagnosis.extended import extended_model
from hdfast.diagnosis.session import run, usable
from hdfast.diagnosis.stages import stages
from hdfast.diagnosis.verdict import Verdict, conclude
from hdfast.health import Health, check
from hdfast.recordings import Campaign, recorded

MODEL = "extended_model.toml"
RESULTS = (files.VERDICT, MODEL, files.REPORT)


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """A finished diagnosis.

    Attributes:
        campaign: the campaign it was made from.
        health: what was found when its recordings were examined.
        content: what verdict.json holds.
        evidence: the stages behind it; None when the recordings were rejected.
    """

    campaign: Campaign = field(repr=False)
    health: Health = field(repr=False)
    content: Mapping[str, Any] = field(repr=False)
    evidence: Verdict | None = field(repr=False)

    @property
    def verdict(self) -> str:
        """One of "no_evidence", "found", "undecided", "depends_on", "sensor", "not_reproducible" or "data_rejected"."""
        return str(self.content["verdict"])

    @property
    def effects(self) -> list[dict[str, Any]]:
        """The named effects, as in verdict.json."""
        return list(self.content["effects"])

    def to_dict(self) -> dict[str, Any]:
        """What verdict.json holds."""
        return dict(self.content)

    @property
    def model(self) -> str:
        """The extended model as TOML text: the calibrated one where nothing was found.

        A torque without a name is noted in it, with its curve; no command simulates it, and the drive is the one
        calibrated without it.
        """
        if self.evidence is None:
            return self.campaign.text
        session, unknown = self.evidence.session, self.evidence.described
        final = session.search.final
        values = {name: final.value(name) for name in final.structure.names}
        with threadpool_limits(1):
            sigma = final.sigma_of(session.replay.layout)
        unnamed = None if unknown is None else unknown.noted
        return extended_model(self.campaign, final.structure, values, sigma, unnamed=unnamed)

    def report(self, folder: str | Path) -> Path:
        """Write report.html beside what `save` writes; returns the page's path.

        Raises:
            InputError: the folder cannot be written, holds another campaign file that is no copy of one, or results of
                another command.
        """
        from hdfast.report.diagnosis_page import page

        path = self.save(folder)
        with threadpool_limits(1):
            files.write_text(path / files.REPORT, page(self))
        return path / files.REPORT

    def save(self, folder: str | Path) -> Path:
        """Write extended_model.toml, a copy of the campaign and, last, verdict.json; returns the folder's path.

        What is there of an earlier diagnosis goes first, its page as well.

        Raises:
            InputError: the folder cannot be written, holds another campaign file that is no copy of one, or results of
                another command.
        """
        path = files.prepare_results(folder, self.campaign.text, RESULTS, self.campaign.folder)
        files.remove(path / name for name in RESULTS)
        files.write_text(path / files.CAMPAIGN, self.campaign.text)
        with threadpool_limits(1):
            files.write_text(path / MODEL, self.model)
        files.write_json(path / files.VERDICT, self.to_dict())
        return path

    def __repr__(self) -> str:
        return f"Diagnosis({self.verdict}: {self.content['sentence']})"


def diagnose(
    campaign: str | Path | Campaign,
    *,
    seed: int = 0,
    threads: int | None = None,
    progress: bool | Callable[[str], None] = False,
) -> Diagnosis:
    """Find the physics that a drive's model leaves out; linear algebra runs on one thread, for the same bits anywhere.

    Args:
        campaign: campaign file, or one that is loaded.
        seed: of the draws of screen and verdict; further noises of the motor angle are the same with every seed. The
            same seed and files in the same order give the same bytes.
        threads: threads of the engine.
        progress: True shows a bar on stderr; a function is told what has been done.

    Raises:
        ConfigError: the campaign file is wrong.
        InputError: a recording cannot be read, an argument is out of range, nothing can be told from the recordings, or
            the drive cannot be simulated as stated.
        MissingPackageError: an MDF or TDMS file without the package that reads it.
    """
    seed = checks.whole("seed", seed, 0, checks.MAX_SEED)
    loaded = recorded(campaign)
    number = version("hdfast")
    with threadpool_limits(1):
        health = check(loaded)
        if not health.usable:
            return Diagnosis(loaded, health, rejected(health, seed, number), None)
        with stages(progress) as told:
            session = run(loaded, usable(health), seed, threads, told)
            told.expect(1)
            verdict = conclude(session, seed)
            content = as_dict(verdict, health, seed, number)
            told.done("weighed the verdict")
    return Diagnosis(loaded, health, content, verdict)
