"""Virtual benches: recordings of a known drive through a sensor chain."""

from hdfast.bench.friction import FrictionLaw, coastdown, friction
from hdfast.bench.hysteresis import SlipLoop
from hdfast.bench.kinematic_error import kinematic_error
from hdfast.bench.sensors import Sensor, SensorChain, encoder
from hdfast.bench.startstop import startstop
from hdfast.bench.stiffness import stiffness

__all__ = [
    "FrictionLaw",
    "Sensor",
    "SensorChain",
    "SlipLoop",
    "coastdown",
    "encoder",
    "friction",
    "kinematic_error",
    "startstop",
    "stiffness",
]
