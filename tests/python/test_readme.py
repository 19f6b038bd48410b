"""The documentation is executed, so that it cannot rot."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hdfast import config
from hdfast.cli import main
from hdfast.recordings import COLUMNS, load, load_campaign
from hdfast.tolerance.designs import DESIGNS
from hdfast.tolerance.laws import LAWS
from hdfast.tolerance.policy import POLICIES

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
CAMPAIGN = (ROOT / "docs" / "campaign.md").read_text()
EXAMPLE = ROOT / "examples" / "concealed-friction"


def test_exact_python_example_runs(tmp_path, monkeypatch, capsys):
    [example] = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    statements = [line for line in example.splitlines() if line and not line.startswith("import")]
    assert len(statements) <= 10
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "README.md", "exec"), {})
    assert "te_pp" in capsys.readouterr().out
    assert (tmp_path / "start.svg").stat().st_size > 10_000


def test_exact_sweep_file_to_copy_is_read_and_its_tables_are_whole():
    page = (ROOT / "docs" / "sweep-file.md").read_text()
    [example] = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    parsed = config.parse(example)
    assert (set(parsed.tolerances), set(parsed.specs)) == ({"J_l", "k1", "B_m", "B_ml"}, {"te_pp"})
    told = {*LAWS, *(key for law in LAWS.values() for key in law.keys), *config.RUN_KEYS, *DESIGNS, *POLICIES}
    assert not {word for word in told if word not in page}


def test_exact_campaign_file_to_copy_is_compared(tmp_path, monkeypatch, capsys):
    campaign, terms = re.findall(r"```toml\n(.*?)```", CAMPAIGN, re.DOTALL)
    given = {
        "time": ("t", 1.0),
        "pos_deg": ("motor_angle", 57.2958),
        "out_deg": ("load_angle", 57.2958),
        "current": ("motor_torque", 1.0 / 0.11),
    }
    for name, source in (("ladder", "ladder"), ("swing", "swing"), ("proof", "proof-load")):
        table = load(EXAMPLE / f"{source}.parquet")
        columns = {own: scale * table[standard] for own, (standard, scale) in given.items()}
        rows = "\n".join(",".join(f"{value:.9g}" for value in row) for row in zip(*columns.values(), strict=True))
        (tmp_path / f"{name}.csv").write_text(f"{','.join(columns)}\n{rows}\n")
    monkeypatch.chdir(tmp_path)
    Path("campaign.toml").write_text(campaign + terms)
    [example] = re.findall(r"```python\n(.*?)```", CAMPAIGN, re.DOTALL)
    exec(compile(example, "docs/campaign.md", "exec"), {})
    assert "3 of 3 recordings usable" in capsys.readouterr().out
    found = load_campaign("campaign.toml")
    assert found.model.terms == ("coulomb_friction", "cogging")
    assert found.priors["psi_1"].sigma == found.priors["psi_2"].sigma > 1.0
    assert found.priors["order"].sigma == 0.0
    Path("campaign.toml").write_text(campaign)
    assert main(["compare", "campaign.toml"]) == 0
    assert "proof.csv" in capsys.readouterr().out


def test_exact_campaign_page_lists_every_column():
    for name, (unit, meaning) in COLUMNS.items():
        assert f"| `{name}` | {unit} | {meaning} |" in CAMPAIGN


def test_exact_pictures_and_files_exist():
    for path in re.findall(r"\]\(([^)#]+)\)", README) + re.findall(r"`((?:examples|docs)/[^`]+|[A-Z]+\.md)`", README):
        assert (ROOT / path).exists(), path


@pytest.mark.parametrize("target", ["setup", "demo", "lint", "test", "test-whole", "proof-subset", "bench", "clean"])
def test_exact_make_targets_exist(target):
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE)


def test_exact_ci_runs_the_tests_and_the_small_proof():
    lines = (ROOT / ".ci" / "run").read_text().splitlines()
    assert [line for line in lines if line.startswith("make")] == ["make test", "make test-whole", "make proof-subset"]
