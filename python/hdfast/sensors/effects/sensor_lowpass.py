"""A filter of first order between sensor and converter."""

import numpy as np

from hdfast.sensors.channels import ANY
from hdfast.sensors.contract import CHANNEL_UNIT, Filter, SensorParameter, Values, sensor_term
from hdfast.sensors.curve import Curve
from hdfast.sensors.dual import Number, recurrence, select


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
