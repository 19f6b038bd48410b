from __future__ import annotations

import math
import re
from pathlib import Path

import hdfast
import numpy as np
import pytest
from hdfast import config
from hdfast.segments import COLUMN
from hdfast.tolerance.distributions import Tolerance
from hdfast.tolerance.intervals import clopper_pearson
from hdfast.tolerance.limits import judge
from hdfast.tolerance.reading import read_tolerance
from hdfast.tolerance.simulation import simulate_rows
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

EXAMPLE = Path(__file__).parents[2] / "examples" / "shf-25-120.toml"


def test_exact_example_is_the_default_drive():
    example = config.load(EXAMPLE)
    for parameter in hdfast.params():
        assert example.nominal()[parameter.name] == pytest.approx(parameter.default, rel=1e-3, abs=1e-12), (
            parameter.name
        )
    assert example.run.rows == 10_000
    assert example.scenario.t_end == 6
    assert example.text == EXAMPLE.read_text()
    assert set(example.specs) == {"te_pp", "rise_time", "peak_windup"}


def test_exact_example_names_a_source_for_every_drive_value():
    section = EXAMPLE.read_text().split("[drive]")[1].split("[kinematic_error]")[0]
    values = [line for line in section.splitlines() if "=" in line and not line.startswith("#")]
    for line in values:
        explained = "#" in line or line.split("=")[0].strip() in ("spring", "k1", "k3", "k5")
        assert explained, line


def test_exact_cosine_and_sine_coefficients():
    parsed = config.parse(
        '[kinematic_error]\norders = [2, "120/121"]\ncos = [1e-5, 2e-5]\nsin = [3e-5, 4e-5]\nscale = 2\n'
    )
    assert parsed.drive == {
        "te_scale": 2,
        "te_cos_2": 1e-5,
        "te_sin_2": 3e-5,
        "te_cos_120/121": 2e-5,
        "te_sin_120/121": 4e-5,
    }


def test_exact_scenario_kinds():
    assert config.parse("[scenario]\nstop = 'none'\nt_end = 2\n").scenario.t_off == 2
    assert config.parse("[scenario]\nload = [[0, 1], [0, 5]]\n").scenario.segments[-1, COLUMN["load"]] > 0
    profile = config.parse("[scenario]\nkind = 'speed_profile'\nt = [0, 1, 2]\nrelative = [0, 1, 0]\n").scenario
    assert profile.name == "speed_profile"
    assert config.parse("[drive]\ntau_load = 2\n[scenario]\nload = [[0, 1], [0, 5]]\n").nominal()["tau_load"] == 2
    assert config.parse("[scenario]\nstop = 'brake'\ntau_max = inf\n").scenario.values["tau_max"] == math.inf


@pytest.mark.parametrize(
    "speed", ["stop = 'brake'", "start = 'speed_ramp'", "kind = 'speed_profile'\nt = [0, 1]\nrelative = [0, 1]"]
)
def test_exact_gains_and_start_angle_vary_where_they_have_a_meaning(speed):
    tolerances = "[tolerance.{}]\ndistribution = 'uniform'\nlower = 0.1\nupper = 0.2\n"
    text = f"[drive]\nK_i = 0.3\n[scenario]\n{speed}\n" + "".join(map(tolerances.format, ("K_p", "theta_m0")))
    assert list(config.parse(text).tolerances) == ["K_p", "theta_m0"]


def test_exact_a_torque_limit_of_the_drive_may_be_infinite():
    driven = "[drive]\n{}\n[scenario]\nstart = 'speed_ramp'\nt_end = 0.5\n"
    for stated in ("tau_max = inf", "tau_max = { value = inf }"):
        parsed = config.parse(driven.format(stated))
        assert parsed.drive == {"tau_max": math.inf}
        assert simulate_rows(parsed, rows=1).finished.all()
    for name, value in (("tau_max", "-inf"), ("tau_max", "0"), ("K_p", "inf"), ("J_l", "inf")):
        with pytest.raises(hdfast.ConfigError, match=f"line 2: {name} = "):
            config.parse(driven.format(f"{name} = {value}"))


def test_exact_piecewise_drive():
    parsed = config.parse("[drive]\nspring = 'piecewise'\nK1 = 2.5e4\n")
    assert parsed.model.spring == "piecewise"
    assert parsed.nominal()["K1"] == 2.5e4


WRONG = [
    ("[driv]\nJ_l = 1\n", 1, "unknown key 'driv'; did you mean 'drive'"),
    ("\n[drive]\nJ_m = 1e-4\nJ_L = 0.5\n", 4, r"\[drive\] unknown key 'J_L'; did you mean 'J_l'"),
    ("[drive]\nJ_l = 'heavy'\n", 2, "J_l = 'heavy' is not a number"),
    ("[drive]\nJ_l = nan\n", 2, "J_l = nan is out of range"),
    ("[drive]\nteeth_flexspline = 100\nteeth_circular = 102\n", 2, "the teeth give ratio = 51, .* states none"),
    ("[drive]\nratio = 121\nteeth_flexspline = 100\nteeth_circular = 102\n", 3, "give ratio = 51, .* states 121"),
    ("[drive]\nspring = 'steel'\n", 2, "spring = 'steel'"),
    ("[drive]\nJ_l = 1\nJ_l = 2\n", None, "line 3"),
    ("drive = 3\n", 1, "not a section"),
    ("[kinematic_error]\norders = [0]\n", 2, "order 0"),
    ("[kinematic_error]\norders = [1, 2]\ncos = [1]\nsin = [1, 2]\n", 3, "cos has 1 numbers, orders has 2"),
    ("[kinematic_error]\norders = [1]\ncos = [1]\n", 1, "cos and sin together"),
    ("[kinematic_error]\norders = [1]\ncos = [1]\nphase = [1]\n", 1, "either cos and sin or amplitude and phase"),
    ("[kinematic_error]\norders = [1]\ncos = ['a']\nsin = [1]\n", 3, r"cos\[0\]"),
    ("[[terms]]\neffect = 'coulomb_fricton'\n", 2, "no term 'coulomb_fricton' exists"),
    ("[[terms]]\nefect = 'x'\n", 2, "did you mean 'effect'"),
    ("[[terms]]\n", 1, "needs the key 'effect'"),
    ("[[terms]]\neffect = 'unknown'\nchannel = 'load_angle'\n", 3, "unknown acts on the drive and has no channel"),
    ("[drive]\nte_cos_1 = 1e-5\n[kinematic_error]\norders = [1]\ncos = [0]\nsin = [0]\n", 2, "te_cos_1 is stated here"),
    ("[drive]\nte_scale = 2\n[kinematic_error]\nscale = 3\n", 2, "te_scale is stated here"),
    ("[kinematic_error]\norders = [1]\nsigma = 0.1\n", 3, "sigma needs cos and sin"),
    ('[spec.order_2]\nupper = 1\n[spec."order_4/2"]\nupper = 2\n', 3, "one section per metric"),
    ("[scenario]\nkind = 'torque_profile'\nt = [0, 1]\ntorque = [0, 1]\nhold = 'no'\n", 5, "hold = 'no'"),
    ("terms = 1\n", 1, "not a list"),
    ("[scenario]\nt_end = -1\n", 2, "t_end = -1 s is out of range"),
    ("[scenario]\nt_of = 1\n", 2, "did you mean 't_off'"),
    ("[scenario]\nstart = true\n", 2, "start = True"),
    ("[scenario]\nkind = 'recorded'\n", 2, "kind = 'recorded'"),
    ("[scenario]\nkind = 'torque_profile'\nt = [0, 1]\n", 1, "needs the key 'torque'"),
    ("[scenario]\nkind = 'torque_profile'\nt = [0, 1]\ntorque = [0]\n", 4, "torque has 1 samples"),
    ("[tolerance.J_x]\ndistribution = 'normal'\n", 1, "unknown key 'J_x'"),
    ("[tolerance.J_l]\nsigma = 1\n", 1, "needs the key 'distribution'"),
    ("[tolerance.J_l]\ndistribution = 'gauss'\n", 1, "distribution = 'gauss'"),
    ("[tolerance.J_l]\ndistribution = 'normal'\n", 1, "needs the key 'sigma'"),
    ("[tolerance.J_l]\ndistribution = 'normal'\nsigma = -1\n", 1, "sigma"),
    ("[tolerance.J_l]\ndistribution = 'normal'\nsigma = 1\nsgima = 2\n", 4, "did you mean 'sigma'"),
    ("[tolerance.J_l]\ndistribution = 'uniform'\nlower = 2\nupper = 1\n", 1, "not below upper"),
    ("[tolerance.J_l]\ndistribution = 'triangular'\nlower = 1\nmode = 5\nupper = 2\n", 1, "mode"),
    ("[tolerance.J_l]\ndistribution = 'uniform'\nrelative = 1\nlower = 1\nupper = 2\n", 1, "relative"),
    ("[tolerance.k2]\ndistribution = 'uniform'\nrelative = true\nlower = 1\nupper = 2\n", 1, "nominal value is 0"),
    ("[tolerance.k2]\ndistribution = 'lognormal'\nsigma_log = 0.1\n", 1, "median"),
    (
        "[drive]\nte_scale = -20\n[tolerance.te_scale]\ndistribution = 'lognormal'\nsigma_log = 0.1\n",
        3,
        r"\[tolerance.te_scale\] is lognormal: the nominal te_scale .*, its median, = -20 must be greater than 0",
    ),
    ("tolerance.J_l = 3\n", 1, "not a section"),
    ("[drive]\nJ_l = 1\nK_p = 0.3\n", 3, r"K_p has no meaning in start_stop\(torque_step, coast\), which has no speed"),
    (
        "[tolerance.tau_max]\ndistribution = 'uniform'\nlower = 1\nupper = 2\n"
        "[scenario]\nkind = 'torque_profile'\nt = [0, 1]\ntorque = [0, 1]\n",
        1,
        r"tau_max has no meaning in torque_profile, which .* \(allowed: left out of \[tolerance\]\)",
    ),
    ("[drive]\ntheta_m0 = 1\n[scenario]\ninitial = 'zero_angle'\n", 2, "theta_m0 has no meaning with initial = 'zero"),
    (
        "[scenario]\ninitial = 'zero_angle'\n[tolerance.theta_m0]\ndistribution = 'normal'\nsigma = 1\n",
        3,
        r"theta_m0 has no meaning with initial = 'zero_angle' \(allowed: left out of \[tolerance\]\)",
    ),
    (
        "[drive]\nomega_set = 3\n[scenario]\nspeed_rpm = 300\n",
        2,
        r"omega_set is stated here and by speed_rpm of \[scenario\]; keep one",
    ),
    ("[drive]\nJ_l = 1\ntau_load = 1\n[scenario]\nload = 2\n", 3, "tau_load is stated here and by load of"),
    ("[drive]\nK_p = 1\n[scenario]\nstop = 'brake'\nK_p = 1\n", 2, "K_p is stated here and by K_p of"),
    ("[drive]\nspring = 'piecewise'\nk1 = 3e4\n", 3, r"k1 belongs to Model\(spring='polynomial'\)"),
    ("[tolerance.T_c]\ndistribution = 'normal'\n", 1, "T_c belongs to the terms coulomb_friction, "),
    ("[spec.te_p]\nupper = 1\n", 1, "did you mean 'te_pp'"),
    ("[spec.te_pp]\nuper = 1\n", 2, "did you mean 'upper'"),
    ("[spec.te_pp]\n", 1, "needs lower, upper or both"),
    ("[spec.te_pp]\nlower = 2\nupper = 1\n", 1, "not below"),
    ("[spec.te_pp]\nupper = 1\nmin_yield = 95\n", 1, "min_yield"),
    ("[run]\nrows = 0\n", 2, "rows = 0"),
    ("[run]\nrtol = 1\n", 2, "rtol"),
    ("[run]\nmethod = 'euler'\n", 2, "method"),
    ("[run]\nmetrics = ['te_p']\n", 2, "metrics"),
    ("[run]\nsede = 1\n", 2, "did you mean 'seed'"),
    ("title = 3\n", 1, "title"),
    ("[scenario]\nload = [\n  [0, 1],\n  [0, 5]\n]\nspeed = 3\n", 6, "unknown key 'speed'"),
    ("[drive]\nJ_l = 1\n[scenario]\nload = [ # ]\n  [0, 1],\n  [0, 5] ]\nt_end = 0\n", 7, "t_end = 0"),
    ('title = """\n[run]\nrows = 1\n\\""""\n[run] # [\nrows = 0\n', 6, "rows = 0"),
    ("title = '''\n[run]\nrows = 1\n'''\n[run]\nrows = 0\n", 6, "rows = 0"),
    ('title = "a \\" [" # "[\n[run]\nseed = 1\nrows = 0\n', 4, "rows = 0"),
    ("x = [\n", None, "Invalid|Unclosed|Expected"),
    ("[drive]\nratio = 80\nJ_l = -1\n", 3, "J_l = -1 kg m\\^2 cannot be simulated .allowed: finite, above 0"),
    ('[drive]\nspring = "piecewise"\nT1 = 48\nT2 = 14\n', 4, "T2 = 14 N m cannot be simulated .*above T1"),
    ('[[terms]]\neffect = "coulomb_friction"\nparameters = { T_c = -1 }\n', 3, "T_c = -1 N m cannot be simulated"),
]


@pytest.mark.parametrize(("text", "line", "message"), WRONG)
def test_exact_wrong_files_name_the_line(text, line, message):
    with pytest.raises(hdfast.ConfigError, match=message) as caught:
        config.parse(text, "drive.toml")
    assert caught.value.line == line
    assert str(caught.value).startswith(f"drive.toml, line {line}: " if line else "drive.toml: ")


def test_exact_teeth_that_give_the_ratio_are_welcome():
    text = "[drive]\nratio = {}\nteeth_flexspline = 240\nteeth_circular = 242\nfixed = '{}'\n"
    for ratio, fixed in ((121, "flexspline"), (-120, "circular")):
        assert config.parse(text.format(ratio, fixed)).nominal()["ratio"] == ratio


def test_exact_unreadable_files(tmp_path):
    with pytest.raises(hdfast.ConfigError, match="no such file"):
        config.load(tmp_path / "missing.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(hdfast.ConfigError, match="UTF-8"):
        config.load(tmp_path / "binary.toml")
    (tmp_path / "empty").mkdir()
    with pytest.raises(hdfast.ConfigError, match=r"empty: a folder, not a file \(it holds no TOML file\)"):
        config.load(tmp_path / "empty")
    with pytest.raises(hdfast.ConfigError, match=r"a folder, not a file \(it holds binary\.toml\)"):
        config.load(tmp_path)


WHOLE = """title = "x"
[drive]
ratio = 121
spring = "polynomial"
J_l = 0.6
[kinematic_error]
orders = [1, "120/121"]
cos = [1e-5, 0.0]
sin = [1e-5, 2e-5]
[[terms]]
effect = "coulomb_friction"
parameters = { T_c = 0.03 }
[sensors]
load_angle = { resolution = 1e-5 }
[scenario]
kind = "start_stop"
speed_rpm = 100
load = [[0, 1], [0, 5]]
stop = "coast"
t_off = 1.0
t_end = 2.0
[tolerance.J_l]
distribution = "uniform"
relative = true
lower = 0.9
upper = 1.1
[tolerance.B_m]
distribution = "lognormal"
sigma_log = 0.2
[correlation]
pairs = [["J_l", "B_m", 0.5]]
[batches]
size = 10
[spec.te_pp]
upper = 3e-4
min_yield = 0.9
[trajectories]
signals = ["te"]
step = 0.01
[run]
rows = 100
sampling = "monte_carlo"
metrics = ["te_rms"]
"""
TOKENS = re.findall(r"\w+|[^\w\s]|\s", WHOLE)
OTHERS = ("", "nan", "inf", "-1", "0", '"x"', "true", "[]", "{}", "[[terms]]", "1979-05-27", "\n", "=", "J_l", "1e9")


@settings(max_examples=150, deadline=None)
@given(place=st.integers(0, len(TOKENS) - 1), other=st.sampled_from(OTHERS), twice=st.booleans())
def test_exact_any_file_is_read_or_refused(place, other, twice):
    text = "".join([*TOKENS[:place], TOKENS[place] if twice else "", other, *TOKENS[place + 1 :]])
    try:
        found = config.parse(text, "drive.toml")
    except hdfast.ConfigError as error:
        found, told, line = None, str(error), error.line
    if found is None:
        assert told.startswith("drive.toml")
        assert line is None or 1 <= line <= text.count("\n") + 1
        return
    assert set(found.table.names) <= set(found.nominal())
    drawn = found.plan().draw(0, 3)
    assert {name: values.shape for name, values in drawn.items()} == dict.fromkeys(found.tolerances, (3,))


def tolerance(entry, nominal=2.0):
    return read_tolerance("J_l", entry, nominal, lambda found, allowed: None)


LAWS = [
    ({"distribution": "normal", "sigma": 0.1}, stats.norm(2, 0.1)),
    ({"distribution": "normal", "sigma": 0.1, "relative": True, "mean": 1.5}, stats.norm(3, 0.2)),
    ({"distribution": "truncated_normal", "sigma": 1, "lower": 1, "upper": 2.5}, stats.truncnorm(-1, 0.5, 2, 1)),
    ({"distribution": "uniform", "lower": 0.9, "upper": 1.1, "relative": True}, stats.uniform(1.8, 0.4)),
    ({"distribution": "triangular", "lower": 1, "upper": 4}, stats.triang(1 / 3, 1, 3)),
    ({"distribution": "lognormal", "sigma_log": 0.3}, stats.lognorm(0.3, scale=2)),
]


@pytest.mark.parametrize(
    ("entry", "law"), LAWS, ids=lambda value: value.get("distribution") if isinstance(value, dict) else ""
)
def test_against_scipy_distributions(entry, law):
    values = tolerance(entry).sample(20_000, 7)
    assert stats.kstest(values, law.cdf).pvalue > 1e-3
    assert tolerance(entry).describe()


def test_exact_bounded_lognormal_stays_inside():
    values = tolerance({"distribution": "lognormal", "sigma_log": 1, "lower": 1.5, "upper": 2.2}).sample(5000, 1)
    assert 1.5 <= values.min() < 1.52
    assert 2.18 < values.max() <= 2.2


def test_exact_streams_depend_on_seed_and_name_only():
    text = "[tolerance.J_l]\ndistribution = 'normal'\nsigma = 0.01\n"
    more = "[tolerance.B_l]\ndistribution = 'normal'\nsigma = 0.01\n" + text
    first, second = config.parse(text).plan(3).draw(0, 50), config.parse(more).plan(3).draw(0, 50)
    assert np.array_equal(first["J_l"], second["J_l"])
    assert not np.array_equal(second["J_l"] - 0.5, second["B_l"] - 0.5)
    assert not np.array_equal(first["J_l"], config.parse(text).plan(4).draw(0, 50)["J_l"])
    assert np.array_equal(first["J_l"][:20], config.parse(text).plan(3).draw(0, 20)["J_l"])


def test_exact_sigma_of_a_negative_nominal_is_positive():
    relative = tolerance({"distribution": "normal", "sigma": 0.1, "relative": True, "lower": 0.5}, nominal=-2.0)
    assert relative.width == pytest.approx(0.2)
    assert (relative.lower, relative.upper) == (-math.inf, -1.0)


def test_exact_verdict_counts_failed_rows_as_not_met():
    parsed = config.parse("[spec.te_pp]\nupper = 1\nmin_yield = 0.6\n[scenario]\nt_end = 0.4\n[run]\nrows = 4\n")
    rows = {"J_l": [0.5, 0.5, -1.0, 0.5]}
    result = hdfast.sweep(rows, scenario=parsed.scenario, metrics=["te_pp"], threads=1)
    [verdict] = judge(parsed.specs, result)
    assert (verdict.within, verdict.rows, verdict.yield_, verdict.met) == (3, 4, 0.75, True)
    assert verdict.interval[0] < 0.75 < verdict.interval[1]


def test_against_scipy_confidence_interval():
    expected = stats.binomtest(37, 40).proportion_ci(0.95, method="exact")
    assert clopper_pearson(37, 40) == pytest.approx((expected.low, expected.high))
    assert clopper_pearson(40, 40)[1] == 1


def test_exact_tolerances_without_variation_give_equal_rows():
    parsed = config.parse("[scenario]\nt_end = 0.4\n[run]\nrows = 3\n")
    result = simulate_rows(parsed, threads=1)
    assert len(set(result["te_pp"].tolist())) == 1
    assert len(result) == 3


def test_exact_describe_names_bounds():
    assert "within 1 to 3" in Tolerance("J_l", "normal", 2.0, 0.1, 1.0, 3.0).describe()
