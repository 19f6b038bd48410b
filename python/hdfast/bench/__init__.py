"""Virtual benches: recordings of a known drive through its sensors."""

from hdfast.bench.friction import FrictionLaw, coastdown, friction
from hdfast.bench.hysteresis import SlipLoop
from hdfast.bench.kinematic_error import kinematic_error
from hdfast.bench.rig import record, rig
from hdfast.bench.starting_torque import starting_torque
from hdfast.bench.startstop import startstop
from hdfast.bench.stiffness import stiffness

__all__ = [
    "FrictionLaw",
    "SlipLoop",
    "coastdown",
    "friction",
    "kinematic_error",
    "record",
    "rig",
    "starting_torque",
    "startstop",
    "stiffness",
]
