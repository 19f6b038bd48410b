"""A filter of first order between sensor and converter."""

import numpy as np

from hdfast.checks import Floats
from hdfast.sensors.channels import ANY
from hdfast.sensors.contract import CHANNEL_UNIT, Filter, SensorParameter, Values, sensor_term
from hdfast.sensors.curve import Curve


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

    def response(self, curve: Curve, p: Values) -> Floats:
        """Settled on the motion before the first sample; the exact step of the filter from knot to knot."""
        tau = p["tau_s"][:, 0]
        open_rows = tau == 0.0
        step = np.diff(curve.t)[:, None]
        z = step / np.where(open_rows, 1.0, tau)
        moments = _moments(z)
        drive = np.sum(
            [c.T * step**j * m for j, (c, m) in enumerate(zip(curve.pieces(), moments, strict=True))], axis=0
        )
        decay = np.exp(-z)
        y = np.empty((len(curve.t), len(curve.x)))
        y[0] = curve.x[:, 0] - tau * curve.start_slope
        for k in range(len(step)):
            y[k + 1] = decay[k] * y[k] + drive[k]
        return np.where(open_rows[:, None], curve.x, y.T)


def _moments(z: Floats) -> list[Floats]:
    """The factor z times the integral of exp(-z (1 - s)) s^j over [0, 1], for j of 0 to 3."""
    upward = [-np.expm1(-z)]
    for j in range(1, 4):
        upward.append(1.0 - j / z * upward[-1])
    small = z < 1.0
    if not small.any():
        return upward
    series = []
    for j in range(4):
        term = z / (j + 1.0)
        total = term.copy()
        for m in range(1, 18):
            term = -term * z / (j + 1.0 + m)
            total += term
        series.append(total)
    return [np.where(small, a, b) for a, b in zip(series, upward, strict=True)]
