"""Derivatives of the trajectory of one row."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.model import Model
from hdfast.sweep import sweep


def jacobian(
    row: Any = None,
    *,
    wrt: Sequence[str],
    t_eval: Any,
    signals: Sequence[str] | None = None,
    model: Model | None = None,
    scenario: Any = None,
    **options: Any,
) -> Floats:
    """Derivatives of one drive's signals over time with respect to parameters and initial states.

    Args:
        row: parameters that differ from the defaults, as in `hdfast.simulate`.
        wrt: names of parameters, scenario columns or initial states (`initial_omega_m`), as `sensitivities` of
            `hdfast.sweep`.
        t_eval: times [s], shape (T,).
        signals: names of the signals; default te, omega_m, omega_l.
        model: the equations; default `Model()`.
        scenario: the inputs over time; default `Scenario.start_stop()`.
        options: initial_state, method, rtol, atol, max_steps and max_step as in `hdfast.sweep`.

    Returns:
        Array (T, signals, wrt) in the signal's unit over the parameter's unit; NaN beyond the end of a row that failed.

    Raises:
        InputError: the call cannot mean anything; naming argument, value and what is allowed.
        RowError: the row cannot be simulated.
    """
    parameters = {} if row is None else row
    options = {"metrics": [], "threads": 1, "strict": True, **options}
    result = sweep(
        parameters, model=model, scenario=scenario, t_eval=t_eval, signals=signals, sensitivities=wrt, **options
    )
    if len(result) != 1:
        raise InputError(f"row holds {len(result)} rows (allowed: 1; use hdfast.sweep for many)")
    return np.stack([values[0] for values in result.sample_sensitivities.values()], axis=1)
