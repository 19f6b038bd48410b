"""What `notes` of verdict.json adds to a verdict."""

from __future__ import annotations

from hdfast.diagnosis.baseline import unstated_of_resonance
from hdfast.diagnosis.masking import FAR, pulled
from hdfast.diagnosis.score import unexplained
from hdfast.diagnosis.structure import TORQUE_SCALE
from hdfast.diagnosis.verdict import Verdict
from hdfast.printing import enumerated, percent

LOUD = 3.0  # times the white noise, beyond which a note says so
MUCH = 0.5  # of the spread: more than most left-out physics takes


def remarks(verdict: Verdict) -> list[str]:
    """What weakens the proof or a size, what is left beyond the noise, recordings that cost the others their rate."""
    notes = list(verdict.session.warnings)
    proof = verdict.proof
    if verdict.extended is not None and proof is not None and proof.holds and not proof.shows:
        notes.append("the held-out recordings do not show it: it rests on stretches of the others that were left out")
    astray = unexplained(verdict.session.replay, verdict.session.search.final.mismatch)
    if astray:
        notes.append(
            f"of {enumerated(astray)} the model explains nothing: noise, or columns, scales or clocks that are off, "
            "or a load that is missing"
        )
    far = _far(verdict)
    if far:
        notes.append(
            f"with what was added the recordings drag {enumerated(far)} more than {FAR:.0f} standard deviations away "
            "from what is stated: sizes are as far off as these are, and a statement may be wrong"
        )
    rigid = _rigid_for_want_of(verdict)
    if rigid:
        notes.append(
            f"motor and load are taken for one inertia, as [drive] does not state {enumerated(rigid)}: beyond the "
            "load's resonance a line over the motor's angle has another size, and may have another name"
        )
    if any(one.confirmed for one in verdict.session.search.accepted):
        notes.append("the fitted recordings show it too faintly for a name: the held-out ones confirm it")
    if proof is not None and proof.extended > LOUD * proof.floor > 0.0:
        notes.append(
            f"what is left of the held-out recordings is {proof.extended / proof.floor:.2g} times the white noise of "
            f"the sensors: slower noise, or physics that nothing tried here describes{_much(proof.extended)}"
        )
    return notes


def _rigid_for_want_of(verdict: Verdict) -> list[str]:
    """What would have to be stated for a drive with windup, where lines over the motor's angle are named without it."""
    if all(one.trial.candidate.order is None for one in verdict.told):
        return []
    campaign, final = verdict.session.campaign, verdict.session.search.final
    if final.structure.model.base == "two_inertia" or campaign.drive.base is not None:
        return []
    return unstated_of_resonance(campaign)


def _far(verdict: Verdict) -> list[str]:
    """Parameters of the drive that the extended model drags away from their priors and the calibrated one does not."""
    if verdict.extended is None:
        return []
    before, after = verdict.session.baseline, verdict.extended
    known = set(before.structure.names) - set(pulled(before))
    scale = after.structure.names.index(TORQUE_SCALE)
    of_torque = ["the scale of motor_torque"] if after.pulls[scale] > FAR else []
    return [*(name for name in pulled(after) if name in known), *of_torque]


def _much(error: float) -> str:
    """What else may leave so large a share of the spread."""
    return f"; where {percent(error)} of the spread are left, also a scale or a clock" if error > MUCH else ""
