"""Answer one case: python -m hdfast.proof.rivals NAME CAMPAIGN.toml OUT."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any

from threadpoolctl import threadpool_limits

from hdfast import files
from hdfast.diagnosis import diagnose
from hdfast.diagnosis.content import rejected
from hdfast.diagnosis.multistart import multistart
from hdfast.diagnosis.session import nominal, set_up, usable
from hdfast.health import check
from hdfast.proof.rivals.ablations import ABLATIONS, without
from hdfast.proof.rivals.said import as_dict
from hdfast.recordings import load_campaign


def main(name: str, campaign: str, out: str) -> None:
    """Write verdict.json of a rival or an ablation."""
    files.write_json(
        files.prepare(out) / "verdict.json", ablated(name, campaign) if name in ABLATIONS else rival(name, campaign)
    )


def ablated(name: str, campaign: str) -> dict[str, Any]:
    """What the diagnosis says without one of its parts."""
    with without(name):
        return diagnose(campaign).to_dict()


def rival(name: str, campaign: str) -> dict[str, Any]:
    """What another strategy says of the same recordings, from the same calibrated model on."""
    loaded = load_campaign(campaign)
    health = check(loaded)
    if not health.usable:
        return rejected(health, 0, "")
    with threadpool_limits(1):
        setup = set_up(loaded, usable(health), None)
        calibrated = multistart(setup.replay, nominal(setup))
        said = import_module(f"hdfast.proof.rivals.{name}").answer(setup, calibrated)
        return as_dict(said, setup, calibrated)


if __name__ == "__main__":
    main(*sys.argv[1:])
