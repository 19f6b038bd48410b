"""The sensor effects in the order in which a signal passes them."""

from __future__ import annotations

from hdfast.sensors.contract import SensorEffect
from hdfast.sensors.effects.aliasing import Aliasing
from hdfast.sensors.effects.clock_skew import ClockSkew
from hdfast.sensors.effects.encoder_eccentricity import EncoderEccentricity
from hdfast.sensors.effects.encoder_interpolation_error import EncoderInterpolationError
from hdfast.sensors.effects.quantisation import Quantisation
from hdfast.sensors.effects.ratio_error import RatioError
from hdfast.sensors.effects.sampling_jitter import SamplingJitter
from hdfast.sensors.effects.sensor_averaging import SensorAveraging
from hdfast.sensors.effects.sensor_delay import SensorDelay
from hdfast.sensors.effects.sensor_lowpass import SensorLowpass
from hdfast.sensors.effects.sensor_noise import SensorNoise
from hdfast.sensors.effects.sensor_offset_drift import SensorOffsetDrift

EFFECTS: dict[str, SensorEffect] = {
    effect.info.id: effect
    for effect in (
        EncoderEccentricity(),
        EncoderInterpolationError(),
        RatioError(),
        SensorLowpass(),
        ClockSkew(),
        Aliasing(),
        SamplingJitter(),
        SensorDelay(),
        SensorAveraging(),
        SensorOffsetDrift(),
        SensorNoise(),
        Quantisation(),
    )
}
