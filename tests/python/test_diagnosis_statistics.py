"""The linear algebra and the statistics behind a diagnosis, against dense formulas and counted errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hdfast.diagnosis.accept import convinces, repeats, strained, too_uneven
from hdfast.diagnosis.changes import attentive
from hdfast.diagnosis.evidence import Layout, Weights
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.left_out import folds_near, left_out
from hdfast.diagnosis.lines import Line, snapped
from hdfast.diagnosis.metric import Metric
from hdfast.diagnosis.projector import Projector
from hdfast.diagnosis.score import Gain, nrmse, weights_of
from hdfast.diagnosis.statistics import statistics
from hdfast.diagnosis.stir import Stir, told
from hdfast.diagnosis.structure import Free, Structure
from hdfast.diagnosis.whiten import Whitener, whiten
from hdfast.model import Model
from scipy.linalg import toeplitz
from scipy.signal import lfilter
from scipy.stats import multivariate_normal


def linear(
    samples: int, blocks: int, parameters: int, rng: np.random.Generator, sigma: float = 1e3
) -> tuple[Layout, Fit]:
    """A linear model fitted to white noise: N samples of one channel in B blocks, P parameters with wide priors."""
    zeros = np.zeros(samples, dtype=np.int64)
    block = np.arange(samples) * blocks // samples
    layout = Layout(
        ("motor_torque",), zeros, zeros, block, np.arange(samples), ((0, "motor_torque", slice(0, samples)),),
        np.ones(samples), np.ones(1),
    )  # fmt: skip
    free = tuple(Free(f"p{j}", 0.0, sigma, False, "1") for j in range(parameters))
    slopes = rng.standard_normal((samples, parameters))
    y = rng.standard_normal(samples)
    estimate = np.linalg.solve(slopes.T @ slopes + np.eye(parameters) / sigma**2, slopes.T @ y)
    weights = Weights(np.ones(1), 1.0)
    return layout, Fit(
        Structure(Model(), {}, free),
        estimate,
        y - slopes @ estimate,
        slopes,
        np.zeros_like(slopes),
        weights,
        Whitener({"motor_torque": np.ones((1, 1))}),
        Stir.none(slopes),
    )


def test_exact_projection_removes_what_a_refit_absorbs() -> None:
    rng = np.random.default_rng(1)
    layout, fit = linear(400, 20, 7, rng)
    left = Projector(fit, layout).left(fit.slopes)
    assert np.abs(left).max() < 1e-6


def test_exact_leverage_correction_is_the_inverse_root_of_each_block() -> None:
    rng = np.random.default_rng(2)
    layout, fit = linear(60, 4, 9, rng)
    corrected = Projector(fit, layout).levered(fit.mismatch)
    A = fit.slopes
    hat = A @ np.linalg.inv(A.T @ A + np.eye(9) / 1e6) @ A.T
    for block in range(4):
        rows = np.flatnonzero(layout.block == block)
        values, vectors = np.linalg.eigh(np.eye(len(rows)) - hat[np.ix_(rows, rows)])
        expected = vectors @ ((vectors.T @ fit.mismatch[rows]) / np.sqrt(values))
        np.testing.assert_allclose(corrected[rows], expected, rtol=1e-8, atol=1e-10)


def test_exact_whitening_predicts_from_the_samples_since_a_gap() -> None:
    rng = np.random.default_rng(4)
    samples, short = 6000, 9
    wave = autoregressive(samples, rng)
    numbers = np.arange(samples) + 5 * (np.arange(samples) >= 3000)
    layout = Layout(
        ("motor_torque",), np.zeros(samples, dtype=np.int64), (np.arange(samples) >= short).astype(np.int64),
        np.arange(samples) // 50, numbers,
        ((0, "motor_torque", slice(0, short)), (1, "motor_torque", slice(short, samples))),
        np.ones(samples), np.ones(2),
    )  # fmt: skip
    white = whiten(layout, wave, np.zeros(1))
    filtered, taps = white(layout, wave), white.taps["motor_torque"]
    assert len(taps) > short
    covariance = np.array([correlation(lag) for lag in range(len(taps))])
    for begin in (0, short, 3000):
        for since in (0, 1, 2, 5):
            ahead = np.linalg.solve(toeplitz(covariance[:since]), covariance[1 : since + 1]) if since else np.zeros(0)
            left = np.sqrt(covariance[0] - ahead @ covariance[1 : since + 1])
            expected = (wave[begin + since] - ahead @ wave[begin : begin + since][::-1]) / left
            assert filtered[begin + since] == pytest.approx(expected, abs=0.15)


@pytest.mark.parametrize("columns", [(), (1,), (5,)])
@pytest.mark.parametrize("samples", [8, 16, 17, 200])
@pytest.mark.parametrize("order", [0, 5, 16])
def test_against_scipy_a_whitening_filter_begins_with_the_samples_there_are(
    order: int, samples: int, columns: tuple[int, ...]
) -> None:
    rng = np.random.default_rng([order, samples])
    layout, _ = linear(samples, 2, 1, rng)
    taps = rng.standard_normal(order + 1)
    white = Whitener({"motor_torque": np.tril(np.tile(taps, (order + 1, 1)))})
    stacked = rng.standard_normal((samples, *columns))
    np.testing.assert_allclose(white(layout, stacked), lfilter(taps, [1.0], stacked, axis=0), rtol=1e-12, atol=1e-12)


def test_exact_of_a_mean_counts_what_is_certain_of_it() -> None:
    numbers = np.arange(40)
    pieces = ((0, "motor_torque", slice(0, 20)), (0, "te", slice(20, 40)))
    layout = Layout(
        ("motor_torque", "te"), numbers // 20, np.zeros_like(numbers), numbers // 20, numbers % 20, pieces,
        np.ones(40), np.array([0.1, 0.0]),
    )  # fmt: skip
    wave = np.sin(2.0 * np.pi * np.arange(20) / 20.0)
    stacked = layout.stack([{"motor_torque": (wave + 3.0)[None], "te": (wave - 7.0)[None]}])
    np.testing.assert_allclose(stacked[0], np.concatenate([wave + 0.3, wave]), atol=1e-12)


def test_exact_left_out_mismatch_is_that_of_a_refit() -> None:
    rng = np.random.default_rng(3)
    layout, fit = linear(200, 10, 4, rng)
    folds = layout.block // 2
    y = fit.mismatch + fit.slopes @ fit.coordinates
    found = left_out(fit, fit.white, layout, folds).mismatch
    for fold in np.unique(folds):
        inside = folds == fold
        A = fit.slopes[~inside]
        refit = np.linalg.solve(A.T @ A + np.eye(4) / 1e6, A.T @ y[~inside])
        np.testing.assert_allclose(found[inside], y[inside] - fit.slopes[inside] @ refit, rtol=1e-9, atol=1e-12)


def test_against_scipy_left_out_density_is_the_normal_one_that_the_rest_predicts() -> None:
    """A few samples of great weight in one block: without it hardly anything is known of what they show."""
    rng = np.random.default_rng(4)
    layout, fit = linear(60, 6, 3, rng)
    heavy = np.where(layout.block == 2, 30.0, 1.0)
    slopes = fit.slopes * np.column_stack([heavy, np.ones(60), np.ones(60)])
    y = 0.3 * rng.standard_normal(60)
    estimate = np.linalg.solve(slopes.T @ slopes + np.eye(3) / 1e6, slopes.T @ y)
    fit = replace(fit, slopes=slopes, coordinates=estimate, mismatch=y - slopes @ estimate)
    found = left_out(fit, fit.white, layout, layout.block)
    density = layout.sums(-found.surprise(found.filtered) - found.vagueness)
    for block in range(6):
        inside = layout.block == block
        rest, own = slopes[~inside], slopes[inside]
        covariance = np.linalg.inv(rest.T @ rest + np.eye(3) / 1e6)
        mean, spread = own @ covariance @ rest.T @ y[~inside], np.eye(10) + own @ covariance @ own.T
        expected = multivariate_normal(mean, spread).logpdf(y[inside]) + 5.0 * np.log(2.0 * np.pi)
        assert density[block] == pytest.approx(expected, abs=1e-3)


def test_exact_what_noise_feigns_leaves_half_of_the_information_in_every_direction() -> None:
    """Units do not matter: coordinates in radians beside logarithms put twenty decades between the entries."""
    rng = np.random.default_rng(8)
    ways = np.linalg.qr(rng.standard_normal((4, 4)))[0]
    root = np.diag([1e7, 1.0, 1e-2, 1e3]) @ ways
    whole = root @ root.T
    less = told(whole, (root * [1.1, 0.9, 0.3, 0.0]) @ root.T)
    np.testing.assert_allclose(less, (root * [0.5, 0.5, 0.7, 1.0]) @ root.T, rtol=1e-9)


def test_exact_a_refit_is_held_where_noise_feigns_more_than_the_slopes_tell() -> None:
    """What one left-out fold changes then goes no farther than a few times what it would without that noise."""
    rng = np.random.default_rng(9)
    layout, fit = linear(600, 30, 3, rng)
    stirred = np.zeros_like(fit.slopes)
    stirred[:, 0] = 1.05 * rng.permutation(fit.slopes[:, 0])
    shaken = replace(fit, stir=Stir(rng.permutation(fit.mismatch), stirred, np.ones(3)))
    moved, calm = (left_out(one, one.white, layout, layout.block).mismatch - one.mismatch for one in (shaken, fit))
    assert np.std(moved) < 10.0 * np.std(calm)


def test_exact_noise_that_shakes_beyond_any_limit_costs_no_less_than_none() -> None:
    """A mismatch of the same size is limited: less the whole of the noise it would cost less than nothing."""
    rng = np.random.default_rng(10)
    layout, fit = linear(600, 30, 3, rng)
    metric = Metric(fit.weights, fit.white, np.zeros(1))

    def cost(size: float) -> float:
        mismatch, noise = size * rng.standard_normal((2, 600))
        stir = Stir(noise, np.zeros_like(fit.slopes), np.ones(3))
        return metric.cost(layout, fit.structure, fit.structure.start, mismatch, stir)

    assert all(abs(cost(size)) < 0.3 * size * 600 for size in (1.0, 10.0, 100.0))


def test_exact_near_the_noise_an_effect_in_two_blocks_of_thirty_predicts_one_from_the_other() -> None:
    """Wherever the two stand: with folds of several blocks they may fall into one."""
    rng = np.random.default_rng(5)
    layout, fit = linear(600, 30, 3, rng)
    replay = SimpleNamespace(layout=layout)
    for first, second in ((3, 9), (3, 10), (12, 24)):
        signature = rng.standard_normal(600) * np.isin(layout.block, (first, second))
        slopes = np.column_stack([fit.slopes[:, :2], signature])
        hidden = replace(fit, slopes=slopes, mismatch=fit.mismatch + 2.0 * signature)
        found = left_out(hidden, fit.white, layout, folds_near(replay, 1.0, 1.0)).mismatch
        for block in (first, second):
            own = layout.block == block
            assert np.std(found[own]) < 0.8 * np.std(hidden.mismatch[own])


@pytest.mark.parametrize(
    ("blocks", "p", "enough"),
    [
        ([2.0] * 20, 1.0, True),
        ([6.0, 4.5, *[0.3, -0.3] * 9], 0.001, True),
        ([6.0, 4.5, *[0.3, -0.3] * 9], 0.002, False),
        ([6.0, 5.0, 4.5, *[0.7, -0.7] * 9], 0.002, False),
        ([60.0, 1.0, 1.0, *[0.7, -0.7] * 9], 0.001, False),
    ],
)
def test_exact_a_gain_in_few_blocks_convinces_where_the_screen_singles_it_out(
    blocks: list[float], p: float, enough: bool
) -> None:
    assert convinces(Gain(np.array(blocks), (1.0, 1.0)), p) == enough


@pytest.mark.parametrize(
    ("effect", "blocks", "uneven"),
    [
        ("backlash", [10.0, 10.0, *[0.0] * 58], False),
        ("backlash", [10.0, *[0.0] * 59], True),
        ("load_compliance", [*[10.0] * 3, *[0.0] * 57], True),
        ("load_compliance", [*[10.0] * 5, *[0.0] * 55], False),
    ],
)
def test_exact_what_stands_in_one_block_is_no_effect_and_what_is_linear_in_few(effect, blocks, uneven) -> None:
    assert too_uneven(SimpleNamespace(effect=effect), Gain(np.array(blocks), (1.0, 1.0))) == uneven


@pytest.mark.parametrize(
    ("own", "other", "gained", "names"),
    [
        (3.1, 0.5, 400.0, []),
        (3.1, 0.5, 90.0, ["skew"]),
        (7.0, 0.5, 400.0, ["skew"]),
        (2.9, 0.5, 1.0, []),
        (1.0, 4.0, 90.0, []),
        (1.0, 4.0, 30.0, ["J_l"]),
    ],
)
def test_exact_parameters_far_from_what_is_known_have_to_be_paid_for(own, other, gained, names):
    """With a twentieth of the gain where they are the effect's own, with a fifth where it pulls others there."""
    current = SimpleNamespace(structure=SimpleNamespace(names=["J_l"]), pulls=np.array([0.5]))
    joint = SimpleNamespace(structure=SimpleNamespace(names=["J_l", "skew"]), pulls=np.array([other, own]))
    assert strained(joint, current, Gain(np.full(100, gained / 100.0), (1.0, 1.0))) == names


@pytest.mark.parametrize(
    ("blocks", "p", "enough"),
    [
        ([2.0] * 16, 1.0, True),
        ([6.0, 5.0, 4.0, 5.0, *[0.0] * 12], 0.0001, False),
        ([4.0] * 4 + [2.0, 2.0, 1.0, 1.0, 1.0, 1.0, *[0.0] * 6], 0.0001, True),
        ([4.0] * 4 + [2.0, 2.0, 1.0, 1.0, 1.0, 1.0, *[0.0] * 6], 0.002, False),
        ([2.25] * 4 + [1.25] * 4 + [0.75] * 4 + [0.25] * 4, 1.0, False),
        ([2.0] * 4 + [1.5] * 4 + [1.25] * 4 + [1.0] * 4, 1.0, True),
    ],
)
def test_exact_what_is_slow_convinces_recording_by_recording_unless_it_is_certain(
    blocks: list[float], p: float, enough: bool
) -> None:
    recordings = np.repeat(np.arange(4), 4)
    assert repeats(Gain(np.array(blocks), (1.0, 1.0)), p, recordings) == enough


def everywhere(rng: np.random.Generator) -> np.ndarray:
    return rng.standard_normal((600, 1))


def in_two_blocks_of_thirty(rng: np.random.Generator) -> np.ndarray:
    signature = np.zeros((600, 1))
    for block in rng.choice(30, 2, replace=False):
        signature[20 * block : 20 * block + 20] = rng.standard_normal((20, 1))
    return signature


def of_every_kind(rng: np.random.Generator) -> np.ndarray:
    return everywhere(rng) if rng.random() < 0.5 else in_two_blocks_of_thirty(rng)


@pytest.mark.parametrize("kind", [everywhere, in_two_blocks_of_thirty, of_every_kind])
def test_exact_size_of_the_screen_on_linear_nulls(
    kind: Callable[[np.random.Generator], np.ndarray], monkeypatch: pytest.MonkeyPatch, long: bool
) -> None:
    """Nulls with 40 candidates, 18 fitted parameters, 30 blocks; the bounds leave two standard errors and a half."""
    monkeypatch.setattr("hdfast.diagnosis.statistics.DRAWS", 999)
    rng = np.random.default_rng(4)
    nulls = 150 if long else 100
    smallest = []
    for _ in range(nulls):
        layout, fit = linear(600, 30, 18, rng)
        projector = Projector(fit, layout)
        left = [projector.left(kind(rng)) for _ in range(40)]
        smallest.append(statistics(layout, projector, left, rng).p.min())
    for size in (0.05, 0.01):
        assert np.mean(np.array(smallest) <= size) <= size + 2.5 * np.sqrt(size * (1.0 - size) / nulls)


def test_exact_an_effect_in_two_blocks_of_thirty_is_noticed() -> None:
    """Seven noise deviations long among 40 candidates: signs of two blocks alone could not tell it."""
    rng = np.random.default_rng(14)
    seen = 0
    for _ in range(20):
        layout, fit = linear(600, 30, 18, rng)
        projector = Projector(fit, layout)
        left = [projector.left(in_two_blocks_of_thirty(rng)) for _ in range(40)]
        added = 7.0 * left[0][:, 0] / np.linalg.norm(left[0])
        shown = Projector(replace(fit, mismatch=fit.mismatch + added), layout)
        seen += bool(statistics(layout, shown, left, rng).p[0] <= 0.01)
    assert seen >= 15


def test_exact_an_effect_far_beyond_the_noise_of_single_samples_counts_whole() -> None:
    """A pulse of ten samples, each ten noise deviations high; an outlier beside it counts for four deviations."""
    layout, fit = linear(600, 30, 4, np.random.default_rng(15))
    pulse = np.zeros((600, 1))
    pulse[300:310] = 1.0
    outlier = 100.0 * (np.arange(600) == 450)
    projector = Projector(replace(fit, mismatch=fit.mismatch + 10.0 * pulse[:, 0] + outlier), layout)
    left = projector.left(pulse)
    unit = left / np.linalg.norm(left)
    assert unit[:, 0] @ projector.residual < 15.0
    about = projector.residual_about(unit)
    assert unit[:, 0] @ about == pytest.approx(10.0 * np.sqrt(10.0), abs=4.0)
    assert about[450] < 5.0


def test_exact_weights_of_equal_structures_are_equal() -> None:
    rng = np.random.default_rng(5)
    gain = Gain(rng.standard_normal(30), (1.0, 1.0))
    np.testing.assert_allclose(weights_of([gain, gain], rng), [0.5, 0.5])


def test_exact_nrmse_of_a_known_share() -> None:
    layout, _ = linear(100, 5, 2, np.random.default_rng(6))
    assert nrmse(layout, np.full(100, 0.3)) == pytest.approx(0.3, rel=1e-12)


def test_exact_a_line_snaps_to_an_expected_order_within_its_resolution() -> None:
    assert snapped(Line(1.985, 50.0, 0.02), [1.0, 1.9835, 2.0]) == 1.9835
    assert snapped(Line(3.4, 50.0, 0.02), [1.0, 2.0, 4.0]) == 3.4


def autoregressive(samples: int, rng: np.random.Generator) -> np.ndarray:
    """A resonance of order two in white noise."""
    noise, found = rng.standard_normal(samples + 200), np.zeros(samples + 200)
    for k in range(2, samples + 200):
        found[k] = 1.5 * found[k - 1] - 0.7 * found[k - 2] + 0.01 * noise[k]
    return found[200:]


def correlation(lag: int) -> float:
    """Of `autoregressive`, by the Yule-Walker equations."""
    first = 1.5 / 1.7
    power = 1e-4 / (1.0 - 1.5 * first + 0.7 * (1.5 * first - 0.7))
    found = [power, first * power]
    while len(found) <= lag:
        found.append(1.5 * found[-1] - 0.7 * found[-2])
    return found[lag]


def test_exact_whitening_leaves_independent_samples_of_unit_variance() -> None:
    rng = np.random.default_rng(7)
    layout, _ = linear(20_000, 40, 2, rng)
    coloured = autoregressive(20_000, rng)
    kept = whiten(layout, coloured, np.zeros(1))(layout, coloured)
    assert np.std(kept) == pytest.approx(1.0, abs=0.05)
    assert abs(np.corrcoef(kept[1:], kept[:-1])[0, 1]) < 0.03


def test_exact_more_changes_than_samples_leave_a_mismatch_at_unit_variance() -> None:
    """What they explain of it is noise: a filter of what they leave would make gains of thousands of nats."""
    rng = np.random.default_rng(8)
    layout, fit = linear(68, 7, 2, rng)
    replay = SimpleNamespace(layout=layout, floor=np.zeros(1))
    heard = attentive(replay, fit, [rng.standard_normal((68, 5)) for _ in range(20)])
    assert np.std(heard.white(layout, fit.mismatch)) == pytest.approx(1.0, abs=0.3)
