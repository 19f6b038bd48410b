"""A channel converted more slowly than it is written down, without a filter before."""

import numpy as np

from hdfast.sensors.channels import ANY
from hdfast.sensors.contract import Clock, Draw, Instants, SensorParameter, Values, sensor_term


class Aliasing(Clock):
    """See `info`."""

    info = sensor_term(
        "aliasing",
        description="Converted at a rate of its own without a filter and held until the next conversion: a line at f "
        "shows at abs(f - m f_s).",
        equation="y(t) = x(floor(t f_s) / f_s)",
        source="sampling theorem; acquisition at 20 to 100 Hz against a mode of 40 Hz and tooth lines of 60 to 400 Hz",
        parameters=(SensorParameter("f_s", "f_s", "Hz", 100.0, 20.0, 100.0, "rate of conversion", (1e-3, 1e9)),),
        channels=ANY,
    )

    def instants(self, instants: Instants, p: Values, draw: Draw) -> Instants:
        """The last conversion; a time within 1e-9 of an interval before one counts as that one."""
        index = np.floor(instants.s * p["f_s"] + 1e-9)
        return Instants(index / p["f_s"], index.astype(np.int64), 1.0 / p["f_s"])
