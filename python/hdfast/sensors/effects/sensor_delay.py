"""A channel that comes late."""

from dataclasses import replace

from hdfast.sensors.channels import ANY
from hdfast.sensors.contract import Clock, Draw, Instants, SensorParameter, Values, sensor_term


class SensorDelay(Clock):
    """See `info`."""

    info = sensor_term(
        "sensor_delay",
        description="Channel written down late: conversion, bus or driver; the error follows the speed.",
        equation="y(t) = x(t - tau_y)",
        source="omega_m tau_y / i in the transmission error: 8.7e-5 rad for 1 ms at 100 r/min",
        parameters=(
            SensorParameter("tau_y", "tau_y", "s", 1e-3, 5e-5, 5e-3, "dead time of the channel", (-10.0, 10.0)),
        ),
        channels=ANY,
    )

    def instants(self, instants: Instants, p: Values, draw: Draw) -> Instants:
        """Earlier by the dead time."""
        return replace(instants, s=instants.s - p["tau_y"])
