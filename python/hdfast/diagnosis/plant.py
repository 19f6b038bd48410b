"""The drive as the diagnosis simulates it, replayed on every recording at once."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.band import Band
from hdfast.diagnosis.lag import behind
from hdfast.diagnosis.prepare import Unit
from hdfast.diagnosis.structure import NUISANCE, REVERSAL, TORQUE_LEAD, TORQUE_SCALE, Structure
from hdfast.diagnosis.wound import wound_up
from hdfast.errors import Interrupted, RowError
from hdfast.model import Model
from hdfast.params import layout
from hdfast.request import Progress
from hdfast.result import SweepResult
from hdfast.sensors import SensorStage
from hdfast.sweep import sweep
from hdfast.terms import terms

SIGNALS = {"te": "te", "output_torque": "gear_torque"}
TORQUE = "motor_torque"
#: What makes another torque of the one that the drive is asked for.
DRIVING = frozenset({
    "actuator_lag", "cogging", "delay", "input_compliance", "torque_gain", "torque_ripple", "torque_saturation",
})  # fmt: skip
RTOL = 1e-6
MOST_STEPS, STEPS_PER_SECOND = 100_000, 5_000
#: What no signal of a drive reaches [N m, rad]: filters of it overflow.
ABSURD = 1e60


@dataclass(frozen=True, eq=False)
class Plant:
    """Recordings to be replayed.

    Attributes:
        units: the recordings at the working rate.
        channels: what is compared where a recording holds it.
        band: the low-pass that measured and simulated signals pass.
        threads: threads of the engine.
        progress: told of every simulation how far it is; may raise to end it.
    """

    units: Sequence[Unit]
    channels: Sequence[str]
    band: Band
    threads: int | None = None
    progress: Progress | None = None

    @cached_property
    def torque_spread(self) -> float:
        """Standard deviation of the recorded motor torque, median over the recordings [N m]."""
        return float(np.median([np.std(unit.measured[TORQUE]) for unit in self.units]))

    @property
    def torque_level(self) -> float:
        """Largest recorded motor torque [N m]."""
        return max(float(np.max(np.abs(unit.measured[TORQUE]))) for unit in self.units)

    @property
    def load_side(self) -> bool:
        """Whether a signal of the load side is compared."""
        return any(channel != TORQUE for channel in self.channels)

    @property
    def loaded(self) -> bool:
        """Whether a load torque is recorded."""
        return any(bool(np.any(unit.load_torque != 0.0)) for unit in self.units)

    @property
    def warm(self) -> bool:
        """Whether temperatures are recorded."""
        return all(unit.temperature is not None for unit in self.units)

    @cached_property
    def _asked(self) -> list[Floats]:
        """Torque that each unit's actuator is asked for, as simulated signals are seen [N m], per unit (n,)."""
        return [self.band.simulated(np.interp(unit.fine, unit.t, unit.command), unit.density) for unit in self.units]

    def mismatch(self, structure: Structure, coordinates: Floats) -> list[dict[str, Floats]]:
        """Measured minus simulated, per unit and channel (M, n); NaN where a row could not be simulated.

        What an actuator changes is computed on the units' command, which carries none of the recording's noise, in the
        unit of the recorded torque, and added to it; what a torque sensor changes, on the quiet part of the torque
        where it is fitted. A filter must not win by quieting noise; one that is given changes all of the torque.

        Args:
            structure: the equations.
            coordinates: (M, P) values of the free parameters.
        """
        values = structure.values(coordinates)
        given = [pair for pair in structure.sensors if pair[1] == TORQUE and not structure.fits(*pair)]
        stage, whole = (
            SensorStage([pair for pair in structure.sensors if (pair in given) == alone], rate=self.band.rate)
            for alone in (False, True)
        )
        ones = np.ones(len(coordinates))
        scale = values.get(TORQUE_SCALE, ones)[:, None]
        lead = values.get(TORQUE_LEAD, 0.0 * ones)[:, None]
        impulse = values.get(REVERSAL, 0.0 * ones)[:, None]
        every: dict[str, Floats | float] = {**structure.fixed, **values}
        of_given = tuple(f"{channel}_{effect}_" for effect, channel in given)
        known = {name: every[name] for name in structure.sensed if given and name.startswith(of_given)}
        sensed = {name: every[name] for name in structure.sensed if name not in known}
        lag = _lag(every) * ones
        left = {*NUISANCE, *structure.sensed}
        driving = bool(DRIVING & set(structure.model.terms))
        if TORQUE_SCALE in values:
            values |= {name: every[name] / scale[:, 0] for name in _actuator_torques(structure.model, every)}
        signals = ["tau_m", *(SIGNALS[one] for one in self.channels if one != TORQUE)]
        result = self._simulate(
            structure.model,
            {name: value for name, value in structure.fixed.items() if name not in (*left, *values)},
            {name: column for name, column in values.items() if name not in left},
            lag,
            [*signals, "tau_drive"] if driving else signals,
        )
        found = []
        for index, unit in enumerate(self.units):
            rows, n = slice(index * len(coordinates), (index + 1) * len(coordinates)), len(unit.fine)
            told = {name: sample[rows, :n] for name, sample in result.samples.items()}
            sane = [np.all(np.abs(sample) < ABSURD, axis=1) for sample in told.values()]
            wrong = ~((result.status[rows] == 0) & np.all(sane, axis=0))[:, None]
            fine = {name: np.where(wrong, 0.0, sample) for name, sample in told.items()}
            shown = {
                name: unit.read(values, self.band)
                if name in SIGNALS.values()
                else self.band.simulated(values, unit.density)
                for name, values in fine.items()
            }
            needed = shown["tau_m"] / scale
            needed = needed + lead * np.gradient(self.band.slow(needed), 1.0 / self.band.rate, axis=1)
            needed = needed - impulse * unit.reversing
            changed = shown["tau_drive"] - self._asked[index] if driving else 0.0
            delivered = unit.measured["motor_torque"] + changed
            if given:
                needed = whole.apply(unit.t, {TORQUE: needed}, known)[TORQUE]
            needed = self._read(unit, needed, TORQUE, lag, stage, sensed)
            differences = {"motor_torque": delivered - needed}
            if "te" in unit.measured:
                differences["te"] = unit.measured["te"] - _te(unit, shown["te"], lag, stage, sensed)
            if "output_torque" in unit.measured:
                read = self._read(unit, shown["gear_torque"], "output_torque", lag, stage, sensed)
                differences["output_torque"] = unit.measured["output_torque"] - read
            found.append({channel: np.where(wrong, np.nan, own) for channel, own in differences.items()})
        return found

    def _read(
        self,
        unit: Unit,
        torque: Floats,
        channel: str,
        lag: Floats,
        stage: SensorStage,
        sensed: Mapping[str, Floats | float],
    ) -> Floats:
        """A torque (M, n) as its sensor shows it; what carries the angle's noise in its quiet part alone.

        The rest is behind the encoder's `lag` (M,), as the motion before it was made with.
        """
        if channel not in stage.channels and not lag.any():
            return torque
        noisy = channel == TORQUE or lag.any()
        quiet = self.band.quiet(torque) if noisy else torque
        read = stage.apply(unit.t, {channel: quiet}, sensed)[channel]
        return behind(unit.t, torque - quiet, lag) + read

    def needed(self, structure: Structure, coordinates: Floats) -> list[Floats]:
        """Motor torque that each recorded motion takes, in the recorded unit, per unit (n,); coordinates (P,)."""
        values = {name: float(value) for name, value in structure.values(coordinates).items()}
        left = {*NUISANCE, *structure.sensed}
        every = {**structure.fixed, **values}
        fixed = {name: value for name, value in every.items() if name not in left}
        result = self._simulate(structure.model, fixed, {}, np.array([_lag(every)]), ["tau_m"])
        scale = values.get(TORQUE_SCALE, 1.0)
        return [
            np.asarray(self.band.simulated(result.samples["tau_m"][index, : len(unit.fine)], unit.density) / scale)
            for index, unit in enumerate(self.units)
        ]

    def refused(self, structure: Structure) -> str:
        """The parameter at the start of a structure that the engine refuses, as it says so; empty when it is none."""
        start = {**structure.fixed, **structure.values(structure.start[None])}
        drive = {name: value for name, value in start.items() if name in layout(structure.model)}
        try:
            sweep(drive, model=structure.model, scenario=self.units[0].ahead(0.0), metrics=[], max_steps=1, strict=True)
        except RowError as error:
            return str(error).removeprefix(f"row {error.row}: ")
        return ""

    def _simulate(
        self,
        model: Model,
        fixed: Mapping[str, float],
        values: Mapping[str, Floats],
        lag: Floats,
        signals: Sequence[str],
    ) -> SweepResult:
        """Signals of rows recording by recording, parameter set by set (M,): lanes side by side share a motion.

        The motion of each is the recorded one before the encoder's `lag` [s], shape (M,).
        """
        units, count = len(self.units), len(lag)
        lags, place = np.unique(lag, return_inverse=True)
        which = np.repeat(np.arange(units), count)
        columns: dict[str, Floats | float] = dict(fixed)
        columns |= {name: np.tile(column, units) for name, column in values.items()}
        columns["te_scale"] = columns.get("te_scale", 1.0) * np.ones(count * units)
        if "thermal_viscous" in model.terms:
            warmth = [unit.temperature for unit in self.units]
            known = [float(np.mean(own)) for own in warmth if own is not None]
            if len(known) == units:
                columns["thermal_viscous_ambient_temperature"] = np.repeat(known, count)
        try:
            return sweep(
                columns,
                model=model,
                scenario=[unit.ahead(own) for unit in self.units for own in lags.tolist()],
                scenario_index=which * len(lags) + np.tile(place, units),
                initial_state=wound_up(self.units, model, columns, which, self.threads),
                t_eval=[unit.fine for unit in self.units],
                t_eval_index=which,
                signals=list(signals),
                metrics=[],
                method="tsit5",
                rtol=RTOL,
                max_steps=max(MOST_STEPS, round(STEPS_PER_SECOND * max(unit.t[-1] for unit in self.units))),
                threads=self.threads,
                progress=self.progress or False,
            )
        except Interrupted:
            raise KeyboardInterrupt from None  # whoever asked for a diagnosis knows of no rows


def _actuator_torques(model: Model, names: Container[str]) -> list[str]:
    """Those of the names that are torques [N m] of an actuator."""
    found = [
        (parameter.name, f"{term}_{parameter.name}")
        for term in model.terms
        if term in DRIVING
        for parameter in terms()[term].parameters
        if parameter.unit == "N m"
    ]
    return [name for both in found for name in both if name in names]


def _lag(values: Mapping[str, Floats | float]) -> Floats | float:
    """Time constant of the motor encoder's low-pass [s]."""
    return values.get("motor_angle_sensor_lowpass_tau_s", 0.0)


def _te(unit: Unit, error: Floats, lag: Floats, stage: SensorStage, sensed: Mapping[str, Floats | float]) -> Floats:
    """Transmission error (M, n) as the sensors show it, the motor's with a lag (M,) behind the motion."""
    ahead = lag[:, None] * unit.speed / unit.ratio
    if "load_angle" not in stage.channels:
        return error - ahead
    load = unit.turned + ahead - error
    read: Floats = stage.apply(unit.t, {"load_angle": load}, sensed)["load_angle"]
    return unit.turned - read
