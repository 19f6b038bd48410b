"""A reading is a whole number of steps."""

import numpy as np

from hdfast.sensors.channels import ANY
from hdfast.sensors.contract import CHANNEL_UNIT, Draw, Instants, Readout, SensorParameter, Values, sensor_term
from hdfast.sensors.dual import Number, value, with_slopes_of


class Quantisation(Readout):
    """See `info`."""

    info = sensor_term(
        "quantisation",
        description="Rounding to steps: staircase at standstill and in slow motion, noise in the derived speed.",
        equation="y = q round((x + s q) / q) - s q",
        source="17 bit: 4.8e-5 rad, 20 bit: 6.0e-6 rad; error floor q / sqrt(12) (Widrow, Kollar 2008)",
        parameters=(
            SensorParameter(
                "resolution",
                "q",
                CHANNEL_UNIT,
                4.8e-5,
                6e-6,
                4.8e-5,
                "step; 0 rounds nothing",
                (0.0, 1e9),
                on_torque=(0.01, 1e-4, 0.1),
            ),
            SensorParameter("step_share", "s", "1", 0.0, 0.0, 1.0, "where zero lies between two steps", (0.0, 1.0)),
        ),
        channels=ANY,
    )

    def readout(self, y: Number, instants: Instants, p: Values, draw: Draw) -> Number:
        """The nearest step, with the derivatives of the mean over all places where the steps may lie: those of y."""
        x, q = value(y), value(p["resolution"])
        step = np.where(q > 0.0, q, 1.0)
        shift = value(p["step_share"]) * q
        return with_slopes_of(y, np.where(q > 0.0, step * np.round((x + shift) / step) - shift, x))
