"""The blind benchmark with the diagnosis itself, on few cases."""

from __future__ import annotations

import json

import pytest
from hdfast.proof import run

CASES, PATIENCE_S = 2, 900.0


@pytest.mark.long
def test_exact_every_sealed_case_is_answered_and_published(tmp_path):
    parts = {}
    proof = run.prove(
        tmp_path, cases=CASES, seed=3, workers=2, step=lambda part, done, _: parts.__setitem__(part, done),
        limit=PATIENCE_S,
    )  # fmt: skip
    assert parts == {"cases": CASES, "answers": CASES}
    assert len(proof["cases"]) == CASES
    for case in proof["cases"]:
        folder = tmp_path / "answers" / run.OWN / case["case"]
        assert json.loads((folder / "outcome.json").read_text())["fault"] == "", case
        assert (folder / "report.html").exists()
    table = (tmp_path / run.TABLE).read_text()
    assert f"{CASES} cases" in table
    assert all(failure["case"] in (tmp_path / run.PAGE).read_text() for failure in proof["failures"])
