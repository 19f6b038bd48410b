"""Kinematic error from slow runs at constant speed, in the order domain."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.identify import orders as domain
from hdfast.identify.angles import refuse_apart, refuse_wrapped
from hdfast.identify.estimate import Estimate, Estimates, amplitude, estimate
from hdfast.identify.fit import Fit
from hdfast.identify.least_squares import untold
from hdfast.identify.orders import Design, Run
from hdfast.identify.reading import gather
from hdfast.identify.selection import Selection, select
from hdfast.model import Model
from hdfast.recordings import Recording

Complexes = NDArray[np.complex128]
MOST_ORDERS, FOLDS = 20, 12
GAIN_PARAMETERS = ("J_l", "k1", "B_sp", "B_l")


def kinematic_error(
    recordings: Any,
    *,
    ratio: float,
    orders: Sequence[Any] | None = None,
    most: int = MOST_ORDERS,
    gain: Mapping[str, float] | None = None,
    columns: Mapping[str, Any] | None = None,
    base: Mapping[str, Any] | None = None,
    source: str = "",
) -> Fit:
    """Identify the series of the kinematic error; te = theta_m/ratio - theta_l against the measured motor angle.

    Args:
        recordings: slow runs at constant speed, best one in each direction; each needs t, motor_angle, load_angle.
        ratio: gear ratio; 121 for a 120 whose circular spline is the output.
        orders: list of orders, also fractional such as "240/121"; default 1 ... n with n from cross-validation.
        most: largest n tried.
        gain: J_l, k1, B_sp and B_l; the series is divided by the gain H of the load on its spring at the run's speed.
            None divides by nothing.
        columns, base, source: as in `stiffness`.

    Raises:
        InputError: a column is missing, a run is shorter than a revolution, its load does not follow its motor, an
            angle is wrapped, or an order is not usable.
    """
    i = checks.positive("ratio", ratio, 1e4)
    checks.whole("most", most, 1, 60)
    listed = gather(recordings, columns)
    wanted = None if orders is None else [Fraction(label) for label in Model(orders=orders).order_labels]
    if wanted == []:
        raise InputError("orders is empty (allowed: at least one order, or None)")
    highest = float(max([*(wanted or []), Fraction(most)]))
    runs = _runs(listed, i, highest)
    notes = [f"{item.name}: {note}" for item in listed for note in item.notes]
    slow = _output_orders(runs, i, wanted or [], notes)
    every = [float(order) for order in (*(Fraction(n) for n in range(1, most + 1)), *(wanted or []), *slow)]
    problem = domain.design(runs, every, FOLDS)
    selection = select(problem, most)
    chosen = [Fraction(n) for n in range(1, selection.suggested + 1)] if wanted is None else wanted
    found = _Solution(problem, [*chosen, *slow])
    h = _gains(gain, [*chosen, *slow], runs)
    estimates = _estimates(found, [*chosen, *slow], h)
    notes += _notes(runs, found, selection, gain)
    kept = _corrected(found, h)[: len(chosen)]
    section = {
        "orders": [int(order) if order.denominator == 1 else str(order) for order in chosen],
        "cos": [a for a, _ in kept],
        "sin": [b for _, b in kept],
    }
    return Fit(
        "kinematic_error",
        "Kinematic error from runs at constant speed",
        Estimates(estimates),
        {"drive": {"ratio": i}, "kinematic_error": section},
        notes,
        {
            "knee": selection.knee,
            "best_bic": selection.best_bic,
            "suggested": selection.suggested,
            "rmse": selection.rmse.tolist(),
            "held_out_rmse": selection.held_out.tolist(),
            "bic": selection.bic.tolist(),
            "residual_rms": found.rms,
            "orders": [str(order) for order in [*chosen, *slow]],
        },
        {},
        {"runs": runs, "selection": selection, "found": found, "orders": [*chosen, *slow]},
        {
            "motor_angle": ("rad", np.concatenate([run.angle for run in runs])),
            "transmission_error": ("rad", np.concatenate([run.error for run in runs])),
            "residual": ("rad", np.concatenate(found.residuals)),
        },
        base or {},
        source,
    )


class _Solution:
    """Coefficients of the series (2 per order), their standard deviations, residuals and nuisances."""

    def __init__(self, problem: Design, orders: list[Fraction]) -> None:
        values = [float(order) for order in orders]
        fixed, columns = len(problem.nuisances), problem.columns(values)
        whole = problem.by_run.solve(columns)
        self.residuals = problem.residuals(columns, whole)
        self.nuisances = dict(zip(problem.nuisances, whole[:fixed].tolist(), strict=True))
        self.coefficients: Floats = whole[fixed:]
        gram = problem.by_run.gram.sum(axis=0)[np.ix_(columns, columns)]
        _check_told(untold(gram)[fixed:], orders)
        inverse = np.linalg.pinv(gram, rcond=1e-12)
        spectra = domain.spectra(problem, columns, self.residuals, inverse)
        level = np.array([domain.density(spectra, value) for value in values])
        self.sigma: Floats = np.sqrt(np.repeat(level, 2) * np.diag(inverse)[fixed:])
        self.rms = float(np.sqrt(np.mean(np.concatenate(self.residuals) ** 2)))
        self.direction_difference = self._by_direction(problem, columns, fixed)

    @staticmethod
    def _by_direction(problem: Design, columns: domain.Columns, fixed: int) -> Floats:
        """Half the difference of the complex amplitudes forward and backward, (orders,), NaN with one direction."""
        found = {}
        for direction in (1.0, -1.0):
            others = [j for j, run in enumerate(problem.runs) if run.direction != direction]
            if len(others) == len(problem.runs):
                return np.full((len(columns) - fixed) // 2, np.nan)
            part = problem.by_run
            for j in others:
                part = part.without(j)
            whole = part.solve(columns)[fixed:]
            found[direction] = whole[0::2] + 1j * whole[1::2]
        return np.asarray(0.5 * np.abs(found[1.0] - found[-1.0]))


def _check_told(open_coefficients: NDArray[np.bool_], orders: list[Fraction]) -> None:
    lost = [str(order) for order, pair in zip(orders, open_coefficients.reshape(-1, 2), strict=True) if pair.any()]
    if lost:
        raise InputError(
            f"orders {', '.join(lost)[:200]} cannot be told in these recordings from each other or from an offset and "
            "a scale error (allowed: a run over several of their periods, not read at whole parts of them)"
        )


def _runs(recordings: list[Recording], ratio: float, highest: float) -> list[Run]:
    """Blocks of every recording; the errors share one zero, so that their offsets can be compared."""
    found, zero = [], None
    for recording in recordings:
        t, motor, load = recording.need("a transmission-error test", "t", "motor_angle", "load_angle")
        refuse_wrapped(recording, "motor_angle", "load_angle", ratio=ratio)
        turned = float(np.ptp(motor)) / domain.TURN
        if turned < 1.0:
            raise InputError(f"{recording.name}: {turned:.3g} motor revolutions (allowed: at least 1)")
        steps = np.diff(motor[:: max(1, len(motor) // 200)])
        if np.min(steps) < 0.0 < np.max(steps):
            raise InputError(f"{recording.name}: the motor turns back (allowed: one direction in each recording)")
        refuse_apart(recording, motor, load, ratio)
        error = motor / ratio - load
        zero = float(error[0]) if zero is None else zero
        found.append(domain.blocks(t, motor, error - zero, highest))
    return found


def _output_orders(runs: list[Run], ratio: float, chosen: list[Fraction], notes: list[str]) -> list[Fraction]:
    """1/i, 2/i and 2 (i-1)/i, which only whole output revolutions can tell from drift and from order 2."""
    if ratio != round(ratio):
        notes.append("orders of the output shaft are left out: the ratio is no whole number")
        return []
    if min(run.revolutions for run in runs) < ratio - 0.05:
        notes.append(f"orders of the output shaft need {ratio:g} motor revolutions in each run: left out")
        return []
    whole = round(ratio)
    slow = [Fraction(1, whole), Fraction(2, whole), Fraction(2 * (whole - 1), whole)]
    return [order for order in slow if order not in chosen]


def _gains(gain: Mapping[str, float] | None, orders: list[Fraction], runs: list[Run]) -> Complexes:
    """Gain H of the load on its spring at each order, ones without parameters.

    Backward the phase of H turns round; runs in both directions see the mean.
    """
    if gain is None:
        return np.ones(len(orders), dtype=np.complex128)
    missing = [name for name in GAIN_PARAMETERS if name not in gain]
    if missing:
        raise InputError(f"gain lacks {', '.join(missing)} (needs {', '.join(GAIN_PARAMETERS)})")
    n = np.array([float(order) for order in orders])
    total = np.zeros(len(orders), dtype=np.complex128)
    for run in runs:
        w = n * (run.angle[-1] - run.angle[0]) / (run.time[-1] - run.time[0])
        damper = 1j * w * gain["B_sp"]
        response = (gain["k1"] + damper) / (gain["k1"] - gain["J_l"] * w**2 + damper + 1j * w * gain["B_l"])
        total += response * len(run.angle)
    return np.asarray(total / sum(len(run.angle) for run in runs))


def _corrected(found: _Solution, gains: Complexes) -> list[tuple[float, float]]:
    """Cosine and sine coefficients [rad] with the gain divided out."""
    wave = (found.coefficients[0::2] - 1j * found.coefficients[1::2]) / gains
    return [(float(value.real), float(-value.imag)) for value in wave]


def _estimates(found: _Solution, orders: list[Fraction], gains: Complexes) -> list[Estimate]:
    listed = []
    for j, (order, (a, b)) in enumerate(zip(orders, _corrected(found, gains), strict=True)):
        sa, sb = found.sigma[2 * j : 2 * j + 2] / abs(gains[j])
        size = math.hypot(a, b)
        sigma = math.hypot(a * sa, b * sb) / size if size else math.hypot(sa, sb) / math.sqrt(2.0)
        name = str(order)
        listed.append(amplitude(f"te_{name}", size, "rad", sigma, meaning=f"amplitude of order {name}"))
        listed.append(estimate(f"te_cos_{name}", a, "rad", sa))
        listed.append(estimate(f"te_sin_{name}", b, "rad", sb))
    return listed


def _notes(runs: list[Run], found: _Solution, selection: Selection, gain: Mapping[str, float] | None) -> list[str]:
    both = len({run.direction for run in runs}) == 2
    scale = found.nuisances["scale_error"] / max(float(np.max(np.abs(run.angle))) for run in runs)
    noise = found.rms * 1e6
    judge = "cross-validation" if np.isfinite(selection.held_out).all() else "BIC, as no run has two revolutions"
    notes = [
        f"orders 1 ... {selection.suggested} suggested by {judge}, knee of the error curve at "
        f"{selection.knee}, BIC {selection.best_bic}; residual {noise:.3g} µrad rms "
        f"in means of {runs[0].samples} samples"
    ]
    if both:
        centred = [found.nuisances[f"offset_{i}"] for i in range(len(runs))]
        offsets = np.array([at - scale * np.mean(run.angle) for at, run in zip(centred, runs, strict=True)])
        forward = np.array([run.direction > 0.0 for run in runs])
        half = 0.5 * float(np.mean(offsets[forward]) - np.mean(offsets[~forward]))
        notes.append(
            f"half the difference of the offsets forward and backward: {half * 1e6:.3g} µrad, friction or hysteresis "
            "windup if all runs share one zero of the angles"
        )
        notes.append(
            "largest difference of an order between the directions: "
            f"{np.max(found.direction_difference) * 1e6:.3g} µrad"
        )
    else:
        notes.append("one direction only: friction windup cannot be told from the kinematic error, skew not from scale")
    notes.append(f"scale or ratio error: {scale:.3g} rad per motor radian (ratio 120 for 121 would give 6.9e-5)")
    notes.append(
        "amplitudes are divided by the gain of the load on its spring"
        if gain is not None
        else "amplitudes are as measured; give J_l, k1, B_sp and B_l (gain, or a drive as --model) to divide them by "
        "the gain of the load on its spring"
    )
    return notes
