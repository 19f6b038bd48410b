"""The zero of a sensor is off and moves."""

from hdfast.sensors.channels import ANY
from hdfast.sensors.contract import CHANNEL_UNIT, Draw, Instants, Readout, SensorParameter, Values, sensor_term
from hdfast.sensors.dual import Number


class SensorOffsetDrift(Readout):
    """See `info`."""

    info = sensor_term(
        "sensor_offset_drift",
        description="Zero of the sensor off and moving with time, at any speed and at standstill.",
        equation="y = x + b_0 + b_1 t",
        source="torque cells 0.1 to 1 percent of their range; angles 1 to 10 arcsec per hour",
        parameters=(
            SensorParameter(
                "offset",
                "b_0",
                CHANNEL_UNIT,
                1e-5,
                -1e-4,
                1e-4,
                "zero error at t = 0",
                on_torque=(0.1, -1.0, 1.0),
            ),
            SensorParameter(
                "drift",
                "b_1",
                f"{CHANNEL_UNIT} per s",
                5e-9,
                -1.4e-8,
                1.4e-8,
                "rate of the zero",
                on_torque=(1e-4, -1e-3, 1e-3),
            ),
        ),
        channels=ANY,
    )

    def readout(self, y: Number, instants: Instants, p: Values, draw: Draw) -> Number:
        """A straight line in time."""
        return y + p["offset"] + p["drift"] * instants.s
