"""One picture per term: the manoeuvre in which its effect shows, computed by hdfast with and without it."""

from signatures.actuator import ACTUATOR
from signatures.friction import FRICTION
from signatures.load import LOAD
from signatures.mesh import MESH
from signatures.picture import Signature, draw
from signatures.sensor import SENSOR

SIGNATURES: dict[str, Signature] = {**ACTUATOR, **FRICTION, **MESH, **LOAD, **SENSOR}

__all__ = ["SIGNATURES", "Signature", "draw"]
