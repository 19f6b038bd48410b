"""A channel on a clock of its own."""

from dataclasses import replace

from hdfast.sensors.channels import ANY
from hdfast.sensors.contract import Clock, Draw, Instants, SensorParameter, Values, sensor_term


class ClockSkew(Clock):
    """See `info`."""

    info = sensor_term(
        "clock_skew",
        description="Channel sampled by a clock of its own, slow by a factor and started late.",
        equation="y(t) = x((1 + eps) t + t_0)",
        source="quartz oscillators: 10 to 100 parts per million",
        parameters=(
            SensorParameter("skew", "eps", "1", 5e-5, -1e-4, 1e-4, "how slow the clock is", (-0.5, 0.5)),
            SensorParameter("clock_offset", "t_0", "s", 0.0, -1e-2, 1e-2, "how late it is at t = 0", (-1e3, 1e3)),
        ),
        channels=ANY,
    )

    def instants(self, instants: Instants, p: Values, draw: Draw) -> Instants:
        """The other clock's time."""
        return replace(instants, s=(1.0 + p["skew"]) * instants.s + p["clock_offset"])
