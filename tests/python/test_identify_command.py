"""The command `hdfast identify`: which recordings of a campaign it takes, and how a model joins the campaign's."""

from __future__ import annotations

import contextlib
import json

import pytest
from hdfast import config
from hdfast.bench import FrictionLaw, coastdown
from hdfast.cli import main
from hdfast.recordings import load_campaign, save

J = 3e-4 + 0.5 / 121.0**2
DRIVE = "[drive]\nratio = 121\nB_l = 0.2\nk1 = { value = 3.1e4, sigma = 0.1 }\n"


@pytest.fixture
def campaign(tmp_path):
    """Two coasts of one drive and one of another."""
    made = [*coastdown(FrictionLaw())[:2], coastdown(FrictionLaw(T_c=0.06))[0]]
    for number, recording in enumerate(made):
        save(recording, tmp_path / f"r{number}.parquet")

    def write(*roles):
        entries = [f'[[recording]]\nfile = "r{number}.parquet"\nrole = "{role}"\n' for number, role in enumerate(roles)]
        (tmp_path / "campaign.toml").write_text(DRIVE + "".join(entries))
        return str(tmp_path / "campaign.toml")

    return write


def coast(file, capsys, *options):
    assert main(["identify", "coastdown", file, "--inertia", str(J), "--json", *options]) == 0
    return json.loads(capsys.readouterr().out)


def test_exact_held_out_recordings_are_left_out_and_named(campaign, capsys):
    found = coast(campaign("fit", "fit", "heldout"), capsys)
    assert found["estimates"]["T_c"]["value"] == pytest.approx(0.03, rel=0.01)
    assert "r2.parquet: held out, not used" in found["notes"]
    every = coast(campaign("heldout", "heldout"), capsys)
    assert every["estimates"]["T_c"]["value"] == pytest.approx(0.03, rel=0.01)
    assert "every recording is held out: all are used" in every["notes"]


def test_exact_a_model_joins_the_drive_of_the_campaign_key_by_key(campaign, tmp_path, capsys):
    """With a byte order mark, as Windows writes it; its spring takes the place of the campaign's."""
    model = "[drive]\nB_ml = 3e-4\nK1 = 3e4\nK2 = 5e4\nK3 = 6e4\nT1 = 14\nT2 = 48\n"
    (tmp_path / "model.toml").write_text(model, encoding="utf-8-sig")
    out = tmp_path / "out"
    coast(campaign("fit", "fit"), capsys, "--model", str(tmp_path / "model.toml"), "--out", str(out))
    found = config.load(out / "model.toml")
    known = {"ratio": 121.0, "B_l": 0.2, "B_ml": 3e-4, "K1": 3e4}
    assert {name: found.drive[name] for name in known} == known
    assert found.drive["B_m"] == pytest.approx(1.2e-3 - 3e-4 - 0.2 / 121.0**2, rel=0.01)
    assert found.model.spring == "piecewise"


@pytest.mark.parametrize("cut", [False, True])
def test_regress_results_leave_nothing_of_earlier_ones(cut, campaign, tmp_path, capsys, monkeypatch):
    """Recordings alone have no input.toml; a run that is cut short has no fit.json."""
    out = tmp_path / "out"
    coast(campaign("fit", "fit"), capsys, "--out", str(out))
    assert (out / "input.toml").exists()
    if cut:
        monkeypatch.setattr("hdfast.report.identify_page.page", lambda fit: 1 // 0)
    with pytest.raises(ZeroDivisionError) if cut else contextlib.nullcontext():
        coast(str(tmp_path / "r2.parquet"), capsys, "--out", str(out))
    written = {"model.toml", "points.parquet"} | (set() if cut else {"index.html", "fit.json"})
    assert {file.name for file in out.iterdir()} == written


ORDERS = "[kinematic_error]\norders = [1, 2]\n"


@pytest.mark.parametrize(("drive", "error"), [("", ""), ("k3 = 1e9\n", ORDERS), ("", "[kinematic_error]\nscale = 2\n")])
def test_exact_the_model_file_means_the_drive_of_the_campaign(drive, error, campaign, tmp_path, capsys):
    """In a campaign what is left out of spring and kinematic error is 0, in the file of a sweep the default drive's."""
    file = campaign("fit", "fit")
    text = (tmp_path / "campaign.toml").read_text().replace(DRIVE, DRIVE + drive + error)
    (tmp_path / "campaign.toml").write_text(text)
    coast(file, capsys, "--out", str(tmp_path / "out"))
    meant, found = load_campaign(file), config.load(tmp_path / "out" / "model.toml")
    assert found.model.orders == meant.model.orders
    names = [name for name in meant.priors if name[0] == "k" or name.startswith(("te_cos", "te_sin"))]
    assert {name: found.nominal()[name] for name in names} == {name: meant.priors[name].value for name in names}
    sweep = tmp_path / "sweep.toml"
    sweep.write_text("[drive]\nB_ml = 3e-4\n")
    coast(file, capsys, "--out", str(tmp_path / "out"), "--model", str(sweep))
    known = config.load(tmp_path / "out" / "model.toml")
    assert known.nominal()["k5"] == 0.0
    assert known.model.orders == (meant if error else config.load(sweep)).model.orders


@pytest.mark.parametrize("given", ["campaign", "model"])
def test_regress_a_table_of_measured_values_is_found_from_the_copy(given, campaign, tmp_path, capsys, monkeypatch):
    (tmp_path / "parts.csv").write_text("J_m\n2.9e-4\n3.0e-4\n3.1e-4\n")
    stated = '[tolerance.J_m]\ndistribution = "empirical"\nfile = "parts.csv"\n'
    campaign("fit", "fit")
    options = ["--out", str(tmp_path / "elsewhere" / "out")]
    if given == "campaign":
        with (tmp_path / "campaign.toml").open("a") as stream:
            stream.write(stated)
    else:
        (tmp_path / "model.toml").write_text(DRIVE.replace("{ value = 3.1e4, sigma = 0.1 }", "3.1e4") + stated)
        options += ["--model", "model.toml"]
    monkeypatch.chdir(tmp_path)
    coast("campaign.toml", capsys, *options)
    assert config.load(tmp_path / "elsewhere" / "out" / "model.toml").tolerances["J_m"].points == (2.9e-4, 3e-4, 3.1e-4)
