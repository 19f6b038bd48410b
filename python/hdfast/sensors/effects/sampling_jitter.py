"""The clock of a channel trembles."""

from dataclasses import replace

from hdfast.sensors.channels import ANY
from hdfast.sensors.contract import Clock, Draw, Instants, SensorParameter, Values, sensor_term


class SamplingJitter(Clock):
    """See `info`."""

    info = sensor_term(
        "sampling_jitter",
        description="Instants of sampling that scatter about their clock: noise that grows with the speed.",
        equation="y_k = x(t_k + delta_k), delta_k normal with standard deviation sigma_t",
        source="1 microsecond (hardware timer) to 100 microseconds (software loop)",
        parameters=(SensorParameter("jitter", "sigma_t", "s", 2e-5, 1e-6, 1e-4, "standard deviation", (0.0, 10.0)),),
        channels=ANY,
    )

    def instants(self, instants: Instants, p: Values, draw: Draw) -> Instants:
        """One deviation per reading."""
        return replace(instants, s=instants.s + p["jitter"] * draw(instants.index))
