"""An angle off by a factor."""

from hdfast.sensors.contract import Geometry, SensorParameter, Values, sensor_term
from hdfast.sensors.dual import Number


class RatioError(Geometry):
    """See `info`."""

    info = sensor_term(
        "ratio_error",
        description="Angle off by a factor: wrong ratio, lines per revolution or unit; grows with the angle.",
        equation="y = (1 + eps) x",
        source="bookkeeping; 120 written for 121 is eps = 8.3e-3",
        parameters=(
            SensorParameter("ratio_error", "eps", "1", 1e-4, -0.01, 0.01, "relative error of the scale", (-0.9, 100.0)),
        ),
    )

    def reading(self, x: Number, p: Values) -> Number:
        """The scaled angle."""
        return (1.0 + p["ratio_error"]) * x
