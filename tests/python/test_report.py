from __future__ import annotations

import os
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from pathlib import Path

import hdfast
import matplotlib as mpl
import numpy as np
import pytest
from hdfast import config, files
from hdfast.bench import folder as bench_folder
from hdfast.calibration.calibrate import RESULTS as CALIBRATION
from hdfast.comparison.compare import RESULTS as COMPARISON
from hdfast.diagnosis.diagnose import RESULTS as DIAGNOSIS
from hdfast.errors import InputError
from hdfast.report import folder, html, identify_page, plots, tables
from hdfast.tolerance.limits import judge
from hdfast.tolerance.simulation import simulate_rows
from matplotlib.figure import Figure

TEXT = """title = "a <b> & c"
[scenario]
t_end = 4.0
t_off = 2.5
[tolerance.J_l]
distribution = "normal"
sigma = 0.05
[tolerance.k1]
distribution = "uniform"
relative = true
lower = 0.9
upper = 1.1
[spec.te_pp]
upper = 3e-4
[spec.mode_frequency_start]
lower = 10
upper = 1e4
"""


@pytest.fixture(scope="module")
def settings():
    return config.parse(TEXT)


@pytest.fixture(scope="module")
def result(settings):
    return simulate_rows(settings, rows=40)


@pytest.fixture(scope="module")
def nominal(settings):
    return hdfast.simulate(settings.drive, scenario=settings.scenario)


class Reader(HTMLParser):
    """Collects tags and references."""

    def __init__(self):
        super().__init__()
        self.tags = []
        self.references = []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.references += [value for name, value in attrs if name in ("src", "href", "xlink:href", "srcset")]


@pytest.fixture(scope="module")
def page(settings, result, nominal):
    return html.sweep_page(settings, result, judge(settings.specs, result), nominal, 1)


def test_exact_page_needs_nothing_else(page):
    reader = Reader()
    reader.feed(page)
    assert all(reference.startswith("#") for reference in reader.references)
    assert "script" not in reader.tags
    assert "link" not in reader.tags
    assert "@import" not in page
    assert reader.tags.count("svg") == 4
    assert reader.tags.count("h1") == 1


def test_exact_text_of_the_input_is_escaped(page):
    assert "<title>a &lt;b&gt; &amp; c</title>" in page
    assert "a <b> & c" not in page


def test_exact_page_has_every_metric_with_its_unit(page, result):
    for name, unit in result.units.items():
        assert f"<td>{name}</td><td>{unit}</td>" in page


def test_exact_references_inside_a_picture_exist(nominal):
    root = ET.fromstring(plots.svg(plots.speeds(nominal)))
    known = {element.get("id") for element in root.iter()}
    used = {element.get("{http://www.w3.org/1999/xlink}href") for element in root.iter()} - {None}
    assert used
    assert {name.removeprefix("#") for name in used} <= known


def test_exact_pictures_are_reproducible(nominal, result, settings):
    assert plots.svg(plots.speeds(nominal)) == plots.svg(plots.speeds(nominal))
    first, second = (plots.svg(plots.histograms(result, settings.specs)) for _ in range(2))
    assert first == second


def test_exact_every_axis_has_a_label_with_unit(nominal, result, settings):
    for figure in (plots.speeds(nominal), plots.transmission_error(nominal), plots.trajectory(nominal)):
        for axes in figure.axes:
            assert "[" in axes.get_ylabel()
    for axes in plots.histograms(result, settings.specs).axes:
        assert "[" in axes.get_xlabel()
        assert axes.get_ylabel() == "rows"


def test_exact_no_label_is_cut_where_the_room_decides_on_the_ticks():
    """Ticks every 2 leave the axes as high as ticks every 2.5 need, and the other way round."""
    with mpl.rc_context(plots.STYLE):
        figure = Figure(figsize=(10.4, 5.8), layout="constrained")
        for axes in figure.subplots(2, 2).flat:
            axes.plot([0.0, 1.0], [0.0, 1.0], label="one")
            axes.set(ylim=(-8.05, 8.05), xlabel="speed [r/min]", ylabel="torque [mN m]")
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper left")
        assert plots.svg(figure)
        taken, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
    assert min(taken.x0, taken.y0) >= 0.0
    assert taken.x1 <= width
    assert taken.y1 <= height


def test_exact_pictures_ignore_the_settings_of_the_user(nominal):
    plain = plots.svg(plots.speeds(nominal))
    with mpl.rc_context({"axes.facecolor": "black", "font.size": 30, "text.usetex": False}):
        assert plots.svg(plots.speeds(nominal)) == plain


def test_exact_histograms_survive_missing_and_constant_metrics(settings):
    bad = hdfast.sweep({"J_l": [-1.0, -2.0]}, scenario=settings.scenario)
    assert plots.svg(plots.histograms(bad, {}))
    same = hdfast.sweep({"J_l": [0.5, 0.5]}, scenario=settings.scenario, metrics=["te_pp"])
    assert plots.svg(plots.histograms(same, {}))
    none = hdfast.sweep({"J_l": [0.5, 0.5]}, scenario=settings.scenario, metrics=[])
    assert plots.svg(plots.histograms(none, {}))
    assert tables.metric_rows(bad)[0][2] == "-"


def test_exact_order_spectrum_of_a_known_signal():
    """Lines of a signal built from two orders, over whole revolutions of a speed that is not constant."""

    class Run:
        scenario = hdfast.Scenario.start_stop()
        t = np.linspace(0, 6, 60001)

        def __getitem__(self, name):
            angle = 30 * self.t + np.sin(self.t)
            return {"theta_m": angle, "te": 3e-5 * np.cos(2 * angle) + 1e-6 * np.sin(5 * angle), "theta_e": 0 * angle}[
                name
            ]

        def sampled(self, t, signals):
            finer = Run()
            finer.t = t
            return {name: finer[name] for name in signals}

    revolutions, te, _ = plots.whole_revolutions(Run())
    turns = round(revolutions[-1] - revolutions[0])
    lines = 2 / (len(te) - 1) * np.abs(np.fft.rfft(te[:-1]))
    assert turns == 3
    assert lines[2 * turns] == pytest.approx(3e-5, rel=1e-4)
    assert lines[5 * turns] == pytest.approx(1e-6, rel=1e-3)
    assert lines[3 * turns] < 1e-9


def test_exact_order_spectrum_of_a_fast_drive_has_no_order_of_the_sampling():
    """At 3000 r/min 1 kHz gives 20 samples a turn; the kinematic error has orders 2, 4, 6, ... of known amplitude."""
    run = hdfast.simulate(scenario=hdfast.Scenario.start_stop(speed_rpm=3000, t_end=2.0))
    revolutions, _, kinematic = plots.whole_revolutions(run)
    turns = round(revolutions[-1] - revolutions[0])
    lines = 2 / (len(kinematic) - 1) * np.abs(np.fft.rfft(kinematic[:-1]))
    for order in range(1, 21):
        value = sum(run.parameters.get(f"te_{part}_{order}", 0.0) ** 2 for part in ("cos", "sin")) ** 0.5
        assert lines[order * turns] == pytest.approx(value, rel=2e-3, abs=1e-9), order


def test_exact_short_run_has_no_revolution():
    short = hdfast.simulate(scenario=hdfast.Scenario.start_stop(t_end=0.2))
    assert plots.whole_revolutions(short)[0].size == 0
    assert plots.svg(plots.transmission_error(short))


def test_exact_prefixes():
    assert plots.scaled(np.array([2e-4]), "rad") == (pytest.approx(1e6), "µrad")
    assert plots.scaled(np.array([0.8]), "s") == (pytest.approx(1e3), "ms")
    assert plots.scaled(np.array([12.0]), "N m") == (1.0, "N m")
    assert plots.scaled(np.array([40.0]), "Hz") == (1.0, "Hz")
    assert plots.scaled(np.array([np.nan]), "rad") == (1.0, "rad")


def test_exact_files_appear_whole_or_not_at_all(tmp_path):
    path = tmp_path / "x.json"
    folder.write_atomically(path, lambda stream: stream.write(b"old"))

    def fail(stream):
        stream.write(b"half")
        raise RuntimeError("disk")

    with pytest.raises(RuntimeError):
        folder.write_atomically(path, fail)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("there", "result", "allowed"),
    [
        ("[drive]\nratio = 80\n", None, False),
        ("[drive]\nratio = 80\n", "verdict.json", True),
        ("[drive]\nratio = 80\n", "report.html", False),
        ("[drive]\nratio = 121\n", None, True),
        ("\ufeff[drive]\r\nratio = 121\r\n", None, True),
        (None, None, True),
    ],
)
def test_exact_results_replace_a_copy_of_a_campaign_and_no_other(there, result, allowed, tmp_path):
    if there is not None:
        (tmp_path / "campaign.toml").write_bytes(there.encode())
    if result is not None:
        (tmp_path / result).write_text("{}")
    if allowed:
        assert files.prepare_results(tmp_path, "[drive]\nratio = 121\n", DIAGNOSIS) == tmp_path
    else:
        with pytest.raises(InputError, match=r"holds another campaign\.toml"):
            files.prepare_results(tmp_path, "[drive]\nratio = 121\n", DIAGNOSIS)


def test_exact_a_campaign_beside_the_one_that_is_read_is_not_written_over(tmp_path):
    (tmp_path / "campaign.toml").write_text("[drive]\nratio = 80\n")
    (tmp_path / "verdict.json").write_text("{}")
    with pytest.raises(InputError, match=r"holds another campaign\.toml"):
        files.prepare_results(tmp_path, "[drive]\nratio = 121\n", DIAGNOSIS, tmp_path / ".")
    assert files.prepare_results(tmp_path, "[drive]\nratio = 121\n", DIAGNOSIS, tmp_path / "elsewhere") == tmp_path


OWN = {
    "compare": COMPARISON,
    "calibrate": CALIBRATION,
    "diagnose": DIAGNOSIS,
    "bench": bench_folder.RESULTS,
    "identify": identify_page.RESULTS,
    "study": (files.CLAIMS, files.PAGE),
    "sweep": files.SWEPT,
}


@pytest.mark.parametrize("command", OWN)
def test_exact_a_folder_holds_the_results_of_one_command(command, tmp_path):
    """The page or the copies of another would be lost."""
    own = OWN[command]
    assert set(own) & set(files.TELLING)
    for name in set(files.TELLING) - {*own, files.MANIFEST}:
        (tmp_path / name).write_text("{}")
        for prepare, content in ((files.prepare_results, [""]), (files.prepare_inputs, [{}]), (files.prepare_own, [])):
            with pytest.raises(
                InputError, match=f"holds {name}, as results of another command do: name another folder"
            ):
                prepare(tmp_path, *content, own)
        (tmp_path / name).unlink()
    assert files.prepare_results(tmp_path, "", own) == files.prepare_inputs(tmp_path, {}, own) == tmp_path


def test_exact_files_have_the_permissions_of_the_process(tmp_path):
    before = os.umask(0o027)
    try:
        folder.write_atomically(tmp_path / "x.json", lambda stream: stream.write(b"{}"))
    finally:
        os.umask(before)
    assert (tmp_path / "x.json").stat().st_mode & 0o777 == 0o640


PACKAGE = Path(hdfast.__file__).parent


def importers(module):
    """Files of the package that import a module of it, the module's own room left out."""
    room = module.removeprefix("hdfast.")
    pattern = re.compile(rf"(from|import) hdfast\.{room}\b|from hdfast import [^\n]*\b{room}\b")
    files = [file for file in PACKAGE.rglob("*.py") if file.relative_to(PACKAGE).parts[0] != room]
    return {file.relative_to(PACKAGE).as_posix() for file in files if pattern.search(file.read_text())}


def test_exact_dependencies_go_one_way():
    """Only commands and the `plot` and `report` of a result reach for the report, only four modules for the core."""
    callers = {file for file in importers("hdfast.report") if not file.endswith("command.py")}
    results = {
        "simulate.py",
        "tolerance/study.py",
        "identify/fit.py",
        "studies/study.py",
        "diagnosis/diagnose.py",
        "proof/run.py",
    }
    results |= {"calibration/calibrate.py", "comparison/compare.py"}
    assert callers == {"cli.py", *results}
    assert importers("hdfast._core") == {"catalogue.py", "params.py", "sweep.py", "terms.py"}
