"""The graduated disc of an encoder sits off the axis of its shaft."""

import numpy as np

from hdfast.sensors.contract import Geometry, SensorParameter, Values, phase, sensor_term
from hdfast.sensors.dual import Number


class EncoderEccentricity(Geometry):
    """See `info`."""

    info = sensor_term(
        "encoder_eccentricity",
        description="Encoder disc off the axis of its shaft: one cycle per turn of that shaft, in the angle alone.",
        equation="y = x + (2 e / D) sin(x + psi)",
        source="412.5 e[um]/D[mm] arcsec in encoder makers' notes on mounting; chord of a shifted circle",
        parameters=(
            SensorParameter("eccentricity", "e", "m", 5e-6, 1e-6, 2e-5, "offset of the disc", (0.0, 1e-2)),
            SensorParameter("disc_diameter", "D", "m", 0.05, 0.01, 0.2, "diameter of the graduation", (1e-4, 10.0)),
            phase("psi", "direction of the offset"),
        ),
    )

    def reading(self, x: Number, p: Values) -> Number:
        """One line at order 1 of the shaft."""
        return x + 2.0 * p["eccentricity"] / p["disc_diameter"] * np.sin(x + p["psi"])
