"""What is known of a parameter before any recording is looked at."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from hdfast.drive_file import DriveFile
from hdfast.model import Model
from hdfast.params import Parameter, params
from hdfast.spring import COEFFICIENTS
from hdfast.terms import terms

INERTIA, STIFFNESS, DAMPING, FRICTION, TORQUE_SCALE = 0.10, 0.10, 0.5, 0.3, 0.05
KINEMATIC_ERROR = 0.3
NEVER_STATED = 1.0
NO_AMPLITUDE = 1e-4
ANY_PHASE = math.pi / math.sqrt(3.0)
OF_A_DRIVE = {
    **dict.fromkeys(("J_m", "J_l"), INERTIA),
    **dict.fromkeys(("B_m", "B_l", "B_ml", "B_sp"), DAMPING),
    **dict.fromkeys(("k1", "k2", "k3", "k4", "k5", "K1", "K2", "K3", "T1", "T2"), STIFFNESS),
    **dict.fromkeys(("ratio", "s", "phi_max", "te_scale"), 0.0),
}
OF_THE_SPRING = (*(name for names in COEFFICIENTS.values() for name in names), "B_sp")
POLYNOMIAL = COEFFICIENTS["polynomial"][:5]
EXACT = ("order", "pole_pairs", "teeth", "drag_power")
PHASE = "psi"


@dataclass(frozen=True)
class Prior:
    """Value and standard deviation of a parameter, both in its unit.

    Attributes:
        value: nominal value.
        sigma: standard deviation; 0 for a parameter that is not to be fitted.
        stated: the file states the value; otherwise the default drive's stands in.
    """

    value: float
    sigma: float
    stated: bool


def priors(drive: DriveFile, base: str) -> dict[str, Prior]:
    """Prior of every parameter of a drive and its terms, by column name.

    What the equations need and the file does not state comes from the default drive with a relative sigma of 1. What
    they do not need is left out: further spring coefficients beside a stated one, and the kinematic error. With the
    base "one_inertia" the spring and its damping have a sigma of 0.
    """
    orders = () if drive.orders is None else drive.orders
    table = params(Model(spring=drive.spring, orders=orders, terms=drive.terms))
    found = {row.name: _prior(row, drive) for row in table}
    if base == "one_inertia":
        found |= {name: replace(found[name], sigma=0.0) for name in OF_THE_SPRING if name in found}
    return found


def _prior(row: Parameter, drive: DriveFile) -> Prior:
    name = row.name
    error = name[:7] in ("te_cos_", "te_sin_")
    if name not in drive.values:
        if error:
            return Prior(0.0, NO_AMPLITUDE, stated=False)
        if name in POLYNOMIAL and any(key in drive.values for key in POLYNOMIAL):
            return Prior(0.0, 0.0, stated=False)
        own = _own_name(row, drive)
        exact = own in EXACT or OF_A_DRIVE.get(name, 1.0) == 0.0
        open_to = ANY_PHASE if own.startswith(PHASE) else NEVER_STATED * abs(row.default)
        return Prior(row.default, 0.0 if exact else open_to, stated=False)
    value = drive.values[name]
    if name in drive.sigma:
        return Prior(value, drive.sigma[name], stated=True)
    if error:
        other = drive.values[name.replace("te_cos_", "te_sin_") if "cos" in name else name.replace("sin", "cos")]
        return Prior(value, KINEMATIC_ERROR * math.hypot(value, other), stated=True)
    if name in OF_A_DRIVE:
        return Prior(value, OF_A_DRIVE[name] * abs(value), stated=True)
    return Prior(value, _of_a_term(row, drive, value), stated=True)


def _of_a_term(row: Parameter, drive: DriveFile, value: float) -> float:
    """Standard deviation of a term's parameter: phases anywhere, counts exact, the rest by what the unit measures."""
    own = _own_name(row, drive)
    if own.startswith(PHASE):
        return ANY_PHASE
    if own in EXACT:
        return 0.0
    if own == "gain_error":
        return TORQUE_SCALE
    by_unit = {"kg m^2": INERTIA, "N m/rad": STIFFNESS, "N m s/rad": DAMPING}
    return by_unit.get(row.unit, FRICTION) * abs(value)


def _own_name(row: Parameter, drive: DriveFile) -> str:
    """What a term of the drive calls its parameter; nothing for one that belongs to no term."""
    named = (
        parameter.name
        for term in drive.terms
        for parameter in terms()[term].parameters
        if row.name in (parameter.name, f"{term}_{parameter.name}")
    )
    return next(named, "")
