"""What `hdfast diagnose` has to say of each anchor, written down before the first run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from anchors import article, bam, brfd, emps, heads, hej90, kinova, tx40, ur10e
from anchors.twin import twin

DRY = frozenset({"coulomb_friction", "stribeck_friction", "load_side_friction"})
ONE_SIDED = frozenset({"asymmetric_friction", "sensor_offset_drift"})
RIPPLE = frozenset({"te_harmonic", "cogging", "torque_ripple", "position_dependent_friction"})
GRAVITY = frozenset({"gravity_unbalance"})
LOADED = frozenset({"load_dependent_friction"})
HYSTERESIS = frozenset({"hysteresis"})
MEMORY = frozenset({"hysteresis", "presliding_friction"})
TORSION = frozenset({"backlash", "hysteresis", "soft_windup", "viscoelastic", "mesh_stiffness_variation"})
LATE = frozenset({"sensor_lowpass"})


@dataclass(frozen=True)
class Expected:
    """The verdict of one anchor.

    Attributes:
        write: writes the campaign of the anchor into a folder.
        control: writes its twin without the effects: (campaign.toml of the anchor, folder, seed); verdict no_evidence.
        must_name: of every set, at least one effect is named.
        must_not_name: none of these is named.
        verdicts: allowed verdicts.
        orders: lines in cycles per motor turn that are listed.
        frequencies_hz: a line between these is listed as fixed in frequency.
        heldout_percent: largest error of the motor torque on the recordings held out.
        dry_friction: friction torque T_c at the motor [N m], to be met within 15 %.
        not_showable: effects that the recordings cannot show and the verdict lists as such.
        health: what values are, as the health report has to say.
        memory: kind of memory found.
    """

    write: Callable[[Path], Path]
    control: Callable[[Path, Path, int], Path]
    must_name: tuple[frozenset[str], ...] = ()
    must_not_name: frozenset[str] = frozenset()
    verdicts: frozenset[str] = frozenset({"found"})
    orders: tuple[float, ...] = ()
    frequencies_hz: tuple[float, float] | None = None
    heldout_percent: float | None = None
    dry_friction: float | None = None
    not_showable: frozenset[str] = frozenset()
    health: str | None = None
    memory: str | None = None


def _twin(corner: float, spread: float = 0.0) -> Callable[[Path, Path, int], Path]:
    return partial(twin, corner=corner, spread=spread)


def _bench_without(_: Path, folder: Path, seed: int) -> Path:
    return article.write(folder, "none", late="none", seed=seed)


EXPECTED = {
    "emps": Expected(
        emps.write,
        _twin(60.0),
        must_name=(DRY, ONE_SIDED, RIPPLE),
        must_not_name=TORSION | GRAVITY | {"unknown", "load_dependent_friction", "thermal_viscous"},
        orders=(1.0, 2.0),
        heldout_percent=4.0,
        dry_friction=20.3935 * emps.ARM,
    ),
    "ur10e_j1": Expected(
        partial(ur10e.write, joint=1),
        _twin(10.0),
        must_name=(DRY, RIPPLE),
        must_not_name=GRAVITY | TORSION,
        orders=(2.0,),
        heldout_percent=8.3,
        not_showable=frozenset({"torque_gain"}),
    ),
    "ur10e_j2": Expected(
        partial(ur10e.write, joint=2),
        _twin(10.0),
        must_name=(DRY, GRAVITY),
        must_not_name=TORSION,
        heldout_percent=3.7,
    ),
    "ur10e_j4": Expected(
        partial(ur10e.write, joint=4),
        _twin(10.0),
        must_name=(DRY, GRAVITY, RIPPLE),
        must_not_name=TORSION,
        orders=(2.0,),
        heldout_percent=7.0,
    ),
    "kinova": Expected(
        kinova.write,
        _twin(20.0),
        must_name=(RIPPLE,),
        must_not_name=GRAVITY,
        orders=(2.0, 4.0),
        frequencies_hz=(5.0, 6.0),
    ),
    "bam": Expected(
        bam.write,
        _twin(8.0, spread=2.0),
        must_name=(GRAVITY, DRY | LOADED | {"presliding_friction"}),
        must_not_name=TORSION | {"unknown"},
    ),
    "bam_trajectory": Expected(
        partial(bam.write, held_out="sin_time_square"),
        _twin(8.0, spread=2.0),
        must_name=(GRAVITY, DRY | LOADED | {"presliding_friction"}),
        must_not_name=TORSION | {"unknown"},
    ),
    "brfd": Expected(
        brfd.write,
        _twin(20.0),
        must_name=(HYSTERESIS, frozenset({"backlash"})),
        must_not_name=frozenset({"coulomb_friction", "gravity_unbalance"}),
        memory="rate_independent",
    ),
    "heads": Expected(
        heads.write,
        _twin(1.0),
        must_name=(MEMORY,),
        must_not_name=GRAVITY,
        memory="rate_independent",
    ),
    "hej90": Expected(
        hej90.write,
        _twin(15.0),
        must_not_name=RIPPLE | GRAVITY | {"unknown", "hysteresis", "viscoelastic"},
        verdicts=frozenset({"sensor", "undecided", "no_evidence"}),
        health="held",
    ),
    "tx40": Expected(
        tx40.write,
        _twin(50.0),
        must_name=(DRY,),
        must_not_name=TORSION,
        not_showable=frozenset({"torque_gain"}),
    ),
    "article": Expected(
        article.write,
        _bench_without,
        must_name=(DRY, LATE),
        must_not_name=frozenset({"unknown", "load_dependent_friction", "gravity_unbalance"}),
    ),
    "article_output": Expected(
        partial(article.write, late="output"),
        _bench_without,
        must_name=(DRY, LATE),
        must_not_name=TORSION | {"unknown", "load_dependent_friction", "gravity_unbalance", "load_compliance"},
    ),
}
