"""The drive as the diagnosis simulates it: a structure with free parameters, replayed on every recording at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hdfast import catalogue
from hdfast.checks import Floats
from hdfast.diagnosis.prepare import Band, Unit
from hdfast.model import Model
from hdfast.sweep import sweep

SIGNALS = {"te": "te", "output_torque": "gear_torque"}
TORQUE_SCALE, TORQUE_OFFSET = "torque_scale", "torque_offset"
NUISANCE = (TORQUE_SCALE, TORQUE_OFFSET)
RTOL = 1e-5


@dataclass(frozen=True)
class Free:
    """A parameter that is fitted: `coordinate` is its logarithm where it must stay positive.

    Attributes:
        name: column of the model, or a nuisance of the recordings.
        value: prior centre.
        sigma: prior standard deviation of the coordinate.
        positive: fitted as a logarithm.
        low, high: bounds of the value.
        unit: SI unit.
    """

    name: str
    value: float
    sigma: float
    positive: bool
    unit: str
    low: float = -np.inf
    high: float = np.inf

    def coordinate(self, value: Floats | float) -> Floats:
        """Coordinates of values."""
        return np.asarray(np.log(value) if self.positive else value, dtype=np.float64)

    def from_coordinate(self, coordinate: Floats) -> Floats:
        """Values of coordinates, within the bounds."""
        return np.clip(np.exp(coordinate) if self.positive else coordinate, self.low, self.high)


@dataclass(frozen=True)
class Structure:
    """Equations and what is free in them.

    Attributes:
        model: base, spring, orders of the kinematic error, terms.
        fixed: values of parameters that are not fitted.
        free: the fitted parameters.
    """

    model: Model
    fixed: Mapping[str, float]
    free: tuple[Free, ...]

    @property
    def names(self) -> list[str]:
        """Names of the free parameters."""
        return [free.name for free in self.free]

    @property
    def start(self) -> Floats:
        """Prior centre in coordinates, shape (P,)."""
        return np.array([float(free.coordinate(free.value)) for free in self.free])

    @property
    def sigma(self) -> Floats:
        """Prior standard deviations in coordinates, shape (P,)."""
        return np.array([free.sigma for free in self.free])

    def values(self, coordinates: Floats) -> dict[str, Floats]:
        """Columns by name from coordinates (M, P)."""
        return {free.name: free.from_coordinate(coordinates[..., j]) for j, free in enumerate(self.free)}

    def with_terms(
        self, terms: Sequence[str], orders: Sequence[str], fixed: Mapping[str, float], free: Sequence[Free]
    ) -> Structure:
        """More terms, more orders of the kinematic error, and their parameters."""
        model = replace(
            self.model,
            terms=(*self.model.terms, *(term for term in terms if term not in self.model.terms)),
            orders=(*self.model.orders, *(order for order in orders if order not in self.model.orders)),
        )
        return Structure(model, {**self.fixed, **fixed}, (*self.free, *free))


@dataclass(frozen=True, eq=False)
class Plant:
    """Recordings to be replayed.

    Attributes:
        units: the recordings at the working rate.
        band: the low-pass that measured and simulated signals pass.
        threads: threads of the engine.
    """

    units: Sequence[Unit]
    band: Band
    threads: int | None = field(default=None)

    @property
    def channels(self) -> list[str]:
        """Channels of at least one recording."""
        return list(dict.fromkeys(channel for unit in self.units for channel in unit.measured))

    def mismatch(self, structure: Structure, coordinates: Floats) -> list[dict[str, Floats]]:
        """Measured minus simulated, per unit and channel (M, n); NaN where a row could not be simulated.

        Args:
            structure: the equations.
            coordinates: (M, P) values of the free parameters.
        """
        count, units = len(coordinates), len(self.units)
        values = structure.values(coordinates)
        columns: dict[str, Floats | float] = dict(structure.fixed)
        columns |= {name: np.repeat(column, units) for name, column in values.items() if name not in NUISANCE}
        which = np.tile(np.arange(units), count)
        if not any(np.ndim(column) for column in columns.values()):
            columns["te_scale"] = np.ones(count * units)
        channels = [channel for channel in self.channels if channel != "motor_torque"]
        shim = "tau_drive" in catalogue.signals()
        signals = ["tau_m", *(["tau_drive"] if shim else []), *(SIGNALS[channel] for channel in channels)]
        result = sweep(
            columns,
            model=structure.model,
            scenario=[unit.scenario for unit in self.units],
            scenario_index=which,
            t_eval=[unit.t for unit in self.units],
            t_eval_index=which,
            signals=signals,
            metrics=[],
            method="tsit5",
            rtol=RTOL,
            max_steps=100_000,
            threads=self.threads,
        )
        failed = result.status != 0
        scale = values.get(TORQUE_SCALE, np.ones(count))[:, None]
        offset = values.get(TORQUE_OFFSET, np.zeros(count))[:, None]
        found = []
        for index, unit in enumerate(self.units):
            rows, n = slice(index, None, units), len(unit.t)
            wrong = failed[rows]

            def sampled(name: str, rows: slice = rows, n: int = n, wrong: Floats = wrong) -> Floats:
                return np.where(wrong[:, None], np.nan, result.samples[name][rows, :n])

            delivered = sampled("tau_drive") if shim else unit.measured["motor_torque"]
            differences = {"motor_torque": (delivered - (sampled("tau_m") + offset) / scale) / _gain(delivered, unit)}
            for channel in channels:
                if channel in unit.measured:
                    differences[channel] = unit.measured[channel] - sampled(SIGNALS[channel])
            found.append(differences)
        return found


def _gain(delivered: Floats, unit: Unit) -> Floats:
    """Size of the delivered torque (M, n) against the recorded one (M, 1): a mismatch counts in the recorded unit."""
    recorded = float(np.sqrt(np.mean(unit.measured["motor_torque"] ** 2)))
    size: Floats = np.sqrt(np.mean(np.atleast_2d(delivered) ** 2, axis=1, keepdims=True))
    return np.maximum(size, 1e-300) / max(recorded, 1e-300)
