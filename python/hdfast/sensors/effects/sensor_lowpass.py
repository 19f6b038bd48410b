"""A filter of first order between sensor and converter."""

import numpy as np

from hdfast.sensors.channels import ANY
from hdfast.sensors.contract import CHANNEL_UNIT, Filter, SensorParameter, Values, sensor_term
from hdfast.sensors.curve import Course, Curve
from hdfast.sensors.dual import Number, recurrence, select, take
from hdfast.sensors.ripple import Ripple


class SensorLowpass(Filter):
    """See `info`."""

    info = sensor_term(
        "sensor_lowpass",
        description="Filter of first order before sampling: high frequencies missing, edges late.",
        equation="tau_s dy/dt + y = x",
        source="exact solution for a cubic spline as input; corner frequency 1/(2 pi tau_s)",
        parameters=(SensorParameter("tau_s", "tau_s", "s", 5e-3, 1e-3, 2e-2, "time constant", (0.0, 1e3)),),
        channels=ANY,
        states=(("y", CHANNEL_UNIT),),
    )

    def response(self, curve: Curve, p: Values) -> Number:
        """Settled on the motion before the first sample; the exact step of the filter from knot to knot."""
        tau = p["tau_s"]
        step = np.diff(curve.t)
        z = step / select(tau > 0.0, tau, 1.0)
        powers = enumerate(zip(curve.coefficients(), _moments(z), strict=True))
        first, *others = [c * step**j * moment for j, (c, moment) in powers]
        drive = sum(others, start=first)
        y = recurrence(curve.x[..., :1] - tau * curve.start_rate, np.exp(-z), drive)
        return select(tau > 0.0, y, curve.x - tau * curve.rates)

    def remainder(self, ripple: Ripple, p: Values) -> Course:
        """Settled on the speed before the first sample."""
        return _Remainder(ripple, p["tau_s"])


class _Remainder(Course):
    """In each piece of a ripple the response to its sine, and what the change of speed before left, dying out."""

    def __init__(self, ripple: Ripple, tau: Number) -> None:
        self._ripple, self._tau = ripple, tau
        settled = self._settled(ripple.phase[..., :-1], ripple.rate)
        fading = self._fading(ripple.lengths)
        drive = self._settled(ripple.phase[..., 1:], ripple.rate) - fading * settled
        y = recurrence(settled[..., :1], fading, drive)
        self._left = y[..., :-1] - settled

    def at(self, s: Number) -> Number:
        """Values at the times s [s], shape (M, K)."""
        place, since = self._ripple.find(s)
        rate, left = take(self._ripple.rate, place), take(self._left, place)
        settled = self._settled(take(self._ripple.phase, place) + rate * since, rate)
        return settled + self._fading(select(place > 0, since, 0.0)) * left

    def area(self, s: Number) -> Number:
        """By the filter's equation, y = x - tau_s dy/dt."""
        return self._ripple.area(s) - self._tau * self.at(s)

    def _settled(self, phase: Number, rate: Number) -> Number:
        lag = rate * self._tau
        return self._ripple.amplitude * (np.sin(phase) - lag * np.cos(phase)) / (1.0 + lag * lag)

    def _fading(self, since: Number) -> Number:
        filtered = self._tau > 0.0
        return select(filtered, np.exp(-since / select(filtered, self._tau, 1.0)), 0.0)


def _moments(z: Number) -> list[Number]:
    """The factor z times the integral of exp(-z (1 - s)) s^j over [0, 1], for j of 0 to 3."""
    upward = [-np.expm1(-z)]
    for j in range(1, 4):
        upward.append(1.0 - j / z * upward[-1])
    small = z < 1.0
    if not small.any():
        return upward
    series = []
    for j in range(4):
        term = total = z / (j + 1.0)
        for m in range(1, 18):
            term = -term * z / (j + 1.0 + m)
            total = total + term
        series.append(total)
    return [select(small, a, b) for a, b in zip(series, upward, strict=True)]
