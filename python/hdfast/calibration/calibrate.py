"""Fit the drive of a campaign to its recordings, priors included; the equations stay as the file states them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from hdfast import files
from hdfast.checks import Floats
from hdfast.comparison.compare import ERROR, warned
from hdfast.diagnosis.extended import extended_model
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.multistart import multistart
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.score import nrmse
from hdfast.diagnosis.session import Setup, nominal, set_up_usable
from hdfast.printing import percent
from hdfast.recordings import Campaign, recorded

MODELS = ("given", "calibrated")
MODEL = "model.toml"
RESULTS = (files.CALIBRATION, MODEL, files.REPORT)


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated drive.

    Attributes:
        setup: the recordings at the working rate.
        fit: the drive as the recordings want it.
    """

    setup: Setup = field(repr=False)
    fit: Fit = field(repr=False)

    @property
    def parameters(self) -> list[dict[str, Any]]:
        """Prior, estimate, standard deviation and pull (in standard deviations of the prior) of every fitted value."""
        sigma = self.fit.sigma_of(self.setup.replay.layout)
        structure = self.fit.structure
        pulls = (self.fit.coordinates - structure.start) / structure.sigma
        return [
            {
                "parameter": free.name,
                "unit": free.unit,
                "prior": free.value,
                "prior_sigma": free.sigma * (free.value if free.positive else 1.0),
                "value": self.fit.value(free.name),
                "sigma": sigma[free.name],
                "pull": float(pull),
            }
            for free, pull in zip(structure.free, pulls, strict=True)
        ]

    @property
    def model(self) -> str:
        """The calibrated drive as the text of a drive file."""
        values = {name: self.fit.value(name) for name in self.fit.structure.names}
        sigma = self.fit.sigma_of(self.setup.replay.layout)
        return extended_model(self.setup.campaign, self.fit.structure, values, sigma, "calibrated")

    @property
    def nrmse(self) -> dict[str, dict[str, float]]:
        """Error over all recordings and channels by role, of the drive as given and as calibrated."""
        return {
            role: {name: nrmse(replay.layout, stacked) for name, stacked in zip(MODELS, mismatches, strict=True)}
            for role, (replay, mismatches) in self.mismatches.items()
        }

    @property
    def warnings(self) -> list[str]:
        """As `Setup.warnings`, what cannot be simulated, whether the model explains nothing."""
        return warned(self.setup, ((replay, calibrated) for replay, (_, calibrated) in self.mismatches.values()))

    def to_dict(self) -> dict[str, Any]:
        """What calibration.json holds; null where there is no number."""
        content: dict[str, Any] = files.json_ready(
            {
                "parameters": self.parameters,
                "nrmse": self.nrmse,
                "warnings": self.warnings,
                "version": version("hdfast"),
            }
        )
        return content

    @cached_property
    def mismatches(self) -> dict[str, tuple[Replay, Floats]]:
        """Measured minus simulated by role: the recordings, and (2, N) stacked for the given and the fitted drive."""
        structure = self.fit.structure
        both = np.stack([structure.start, self.fit.coordinates])
        replays = {"fit": self.setup.replay, "heldout": self.setup.held}
        return {
            role: (replay, replay.mismatch(structure, both)) for role, replay in replays.items() if replay is not None
        }

    def report(self, folder: str | Path) -> Path:
        """Write the page, model.toml, the numbers and a copy of the campaign; returns the page's path.

        Raises:
            InputError: the folder cannot be written, holds another campaign file that is no copy of one, or results of
                another command.
        """
        from hdfast.report.calibration_page import page

        campaign = self.setup.campaign
        path = files.prepare_results(folder, campaign.text, RESULTS, campaign.folder)
        files.remove(path / name for name in RESULTS)
        files.write_text(path / files.CAMPAIGN, campaign.text)
        files.write_text(path / MODEL, self.model)
        files.write_text(path / files.REPORT, page(self))
        files.write_json(path / files.CALIBRATION, self.to_dict())
        return path / files.REPORT

    def __repr__(self) -> str:
        shares = ", ".join(
            f"{role} {percent(error['given'])} -> {percent(error['calibrated'])}" for role, error in self.nrmse.items()
        )
        return f"{len(self.fit.structure.free)} parameters calibrated, error ({ERROR}): {shares}"


def calibrate(campaign: str | Path | Campaign, *, threads: int | None = None) -> Calibration:
    """Fit the drive of a campaign to its recordings for fitting.

    Args:
        campaign: campaign file, or one that is loaded.
        threads: threads of the engine.

    Raises:
        ConfigError: the campaign file is wrong.
        InputError: a recording cannot be read, the health checks leave none, nothing can be told from what they leave,
            or the drive cannot be simulated as stated.
        MissingPackageError: an MDF or TDMS file without the package that reads it.
    """
    with threadpool_limits(1):
        setup = set_up_usable(recorded(campaign), threads)
        return Calibration(setup, multistart(setup.replay, nominal(setup)))
