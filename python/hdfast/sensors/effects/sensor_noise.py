"""White noise of a sensor."""

from hdfast.sensors.channels import ANY
from hdfast.sensors.contract import CHANNEL_UNIT, Draw, Instants, Readout, SensorParameter, Values, sensor_term
from hdfast.sensors.dual import Number


class SensorNoise(Readout):
    """See `info`."""

    info = sensor_term(
        "sensor_noise",
        description="Independent normal noise in every reading, before rounding.",
        equation="y_k = x_k + n_k, n_k normal with standard deviation sigma_y",
        source="encoder and torque cell data sheets",
        parameters=(
            SensorParameter(
                "noise",
                "sigma_y",
                CHANNEL_UNIT,
                1e-6,
                1e-7,
                1e-5,
                "standard deviation",
                (0.0, 1e9),
                on_torque=(0.05, 2e-3, 0.5),
            ),
        ),
        channels=ANY,
    )

    def readout(self, y: Number, instants: Instants, p: Values, draw: Draw) -> Number:
        """One number per reading; a held reading keeps its noise."""
        return y + p["noise"] * draw(instants.index)
