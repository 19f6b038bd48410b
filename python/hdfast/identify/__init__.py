"""Identification of a drive from recordings: spring, kinematic error, friction, starting torque, coast-down."""

from hdfast.identify.coastdown import coastdown
from hdfast.identify.estimate import Estimate, Estimates
from hdfast.identify.fit import Fit
from hdfast.identify.friction import friction
from hdfast.identify.kinematic_error import kinematic_error
from hdfast.identify.starting_torque import starting_torque
from hdfast.identify.stiffness import stiffness

__all__ = ["Estimate", "Estimates", "Fit", "coastdown", "friction", "kinematic_error", "starting_torque", "stiffness"]
