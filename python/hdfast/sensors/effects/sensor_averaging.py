"""A converter that integrates."""

from hdfast.sensors.channels import ANY
from hdfast.sensors.contract import Instants, Sampling, SensorParameter, Values, sensor_term
from hdfast.sensors.curve import Course
from hdfast.sensors.dual import Number


class SensorAveraging(Sampling):
    """See `info`."""

    info = sensor_term(
        "sensor_averaging",
        description="Mean over the usual time between readings, or a share of it, in place of a single look.",
        equation="y_k = (1/T) integral of x over [t_k - T, t_k], T = share of the usual sampling interval",
        source="integrating converters; gain sin(pi f T)/(pi f T), delay T/2",
        parameters=(
            SensorParameter("window_share", "share", "1", 1.0, 0.1, 4.0, "window per sampling interval", (0.0, 1e4)),
        ),
        channels=ANY,
    )

    def sample(self, course: Course, instants: Instants, p: Values) -> Number:
        """The exact mean."""
        return course.mean(instants.s, p["window_share"] * instants.interval)
