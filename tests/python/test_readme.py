"""The documentation is executed, so that it cannot rot."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()


def test_exact_python_example_runs(tmp_path, monkeypatch, capsys):
    [example] = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    statements = [line for line in example.splitlines() if line and not line.startswith("import")]
    assert len(statements) <= 10
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "README.md", "exec"), {})
    assert "te_pp" in capsys.readouterr().out
    assert (tmp_path / "start.svg").stat().st_size > 10_000


def test_exact_pictures_and_files_exist():
    for path in re.findall(r"\]\(([^)#]+)\)", README) + re.findall(r"`((?:examples|docs)/[^`]+|[A-Z]+\.md)`", README):
        assert (ROOT / path).exists(), path


@pytest.mark.parametrize("target", ["setup", "demo", "test", "bench", "clean"])
def test_exact_make_targets_exist(target):
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE)


def test_exact_ci_runs_the_tests():
    lines = (ROOT / ".ci" / "run").read_text().splitlines()
    assert [line for line in lines if line.startswith("make")] == ["make test"]
