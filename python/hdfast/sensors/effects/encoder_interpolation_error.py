"""The interpolation between the lines of an encoder is not straight."""

import numpy as np

from hdfast.sensors.contract import Graduation, SensorParameter, Values, phase, sensor_term
from hdfast.sensors.dual import Number


class EncoderInterpolationError(Graduation):
    """See `info`."""

    info = sensor_term(
        "encoder_interpolation_error",
        description="Error of the interpolation between encoder lines: so high an order that sampling folds it.",
        equation="y = x + a (2 pi / Z) sin(Z x + psi)",
        source="0.1 to 2 percent of a line pitch in encoder data sheets (offset, amplitude and phase of sine signals)",
        parameters=(
            SensorParameter("pitch_share", "a", "1", 0.01, 1e-3, 0.02, "amplitude per line pitch", (0.0, 0.5)),
            SensorParameter("lines", "Z", "1", 2048.0, 512.0, 9000.0, "lines per revolution", (1.0, 1e6)),
            phase("psi", "phase"),
        ),
    )

    def line(self, x: Number, p: Values) -> tuple[Number, Number]:
        """One line at order Z of the shaft."""
        lines = p["lines"]
        return p["pitch_share"] * (2.0 * np.pi / lines), lines * x + p["psi"]
