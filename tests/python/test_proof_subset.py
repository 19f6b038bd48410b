from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path

import pytest

TOOL = Path(__file__).parents[2] / "tools" / "check_proof.py"
GOOD = {
    "false alarms": 0.0,
    "selective accuracy": 1.0,
    "identification": 1.0,
    "outside the list: not named": 1.0,
}


@pytest.mark.parametrize(
    ("answer", "code"), [("found", 0), ("late", 1), ("crashed", 1), ("missing", 1), ("invalid", 1)]
)
def test_exact_a_case_without_a_valid_answer_fails_the_small_run(tmp_path, monkeypatch, answer, code):
    proof = {
        "scores": [{"name": name, "value": value} for name, value in GOOD.items()],
        "cases": [{"case": "0123abcd", "answer": answer}],
    }
    (tmp_path / "proof.json").write_text(json.dumps(proof))
    monkeypatch.setattr(sys, "argv", ["check_proof.py", str(tmp_path / "proof.json")])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(TOOL), run_name="__main__")
    assert ended.value.code == code
