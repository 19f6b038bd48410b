"""Drives from which nothing is left out: hardly ever a claim, and seldom a doubt."""

from __future__ import annotations

import hdfast
import null_campaigns

FEW, MANY = 40, 100
CLAIMS = {"found", "sensor", "depends_on"}


def test_against_complete_models_claims_are_rare(tmp_path, long):
    verdicts = {}
    for seed in range(MANY if long else FEW):
        found = hdfast.diagnose(null_campaigns.write(tmp_path / str(seed), seed))
        verdicts[seed] = (found.verdict, found.content["sentence"])
    claims = {seed: verdict for seed, verdict in verdicts.items() if verdict[0] in CLAIMS}
    doubts = [seed for seed, verdict in verdicts.items() if verdict[0] == "undecided"]
    assert len(claims) <= len(verdicts) // MANY, claims
    assert len(doubts) <= max(1, len(verdicts) // 10), doubts
