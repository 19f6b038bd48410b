"""Drives from which nothing is left out: hardly ever a claim, and seldom a doubt."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import hdfast
import null_campaigns
import pytest
import sampled_loop

FEW, MANY = 1, 100
CLAIMS = {"found", "sensor", "depends_on"}
PROCESSES = 2


def diagnosed(file: Path) -> tuple[str, str]:
    """Verdict and sentence of a campaign."""
    found = hdfast.diagnose(file, threads=1)
    return found.verdict, found.content["sentence"]


def test_against_complete_models_claims_are_rare(tmp_path, long):
    files = [null_campaigns.write(tmp_path / str(seed), seed) for seed in range(MANY if long else FEW)]
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        verdicts = dict(enumerate(pool.map(diagnosed, files)))
    claims = {seed: verdict for seed, verdict in verdicts.items() if verdict[0] in CLAIMS}
    doubts = [seed for seed, verdict in verdicts.items() if verdict[0] == "undecided"]
    assert len(claims) <= len(verdicts) // MANY, claims
    assert len(doubts) <= max(1, len(verdicts) // 10), doubts


@pytest.mark.long
def test_against_a_loop_that_is_logged_at_a_quarter_of_its_rate_nothing_is_claimed(tmp_path):
    """The held command follows the motion with a fading memory, far beyond chance; it lowers the error by 2 %."""
    verdict, sentence = diagnosed(sampled_loop.write(tmp_path, 1))
    assert verdict == "no_evidence", sentence
