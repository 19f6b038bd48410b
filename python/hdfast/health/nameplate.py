"""What the campaign file itself leaves open or contradicts."""

from __future__ import annotations

from hdfast.health.finding import NOTE, WARNING, Finding
from hdfast.recordings import Campaign

NAME = "drive"
DRAG = ("B_m", "B_ml")


def check(campaign: Campaign) -> list[Finding]:
    """Name what the default drive stands in for, what is exact by mistake, and a ratio that the teeth contradict."""
    found = []
    filled = [name for name, prior in campaign.priors.items() if not prior.stated and prior.sigma > 0.0]
    if "ratio" not in campaign.drive.values:
        sentence = f"[drive] does not state ratio; {campaign.priors['ratio'].value:g} is taken, exactly"
        found.append(Finding(NAME, WARNING, sentence, value=campaign.priors["ratio"].value))
    if filled:
        sentence = f"[drive] does not state {', '.join(filled)}; the default drive stands in with a wide prior"
        found.append(Finding(NAME, NOTE, sentence, value=len(filled)))
    drive = campaign.drive
    exact = [name for name in drive.sigma if drive.values.get(name) == 0.0 and not name.startswith("te_")]
    if exact:
        sentence = (
            f"{', '.join(exact)} = 0 has a relative sigma, which is 0 as well: it is taken as exactly 0; state the "
            "value that is expected, or leave it out"
        )
        found.append(Finding(NAME, WARNING, sentence, value=len(exact)))
    if all(drive.values.get(name) == 0.0 for name in DRAG) and not set(DRAG) <= set(exact):
        sentence = (
            f"{' and '.join(DRAG)} = 0 are taken as exactly 0: drag in proportion to the motor's speed has no name of "
            "its own, and what there is of it would get that of another effect; state the value that is expected of "
            "one, or leave it out"
        )
        found.append(Finding(NAME, WARNING, sentence, value=len(DRAG)))
    if drive.teeth_disagree:
        stated, expected = drive.values["ratio"], drive.ratio_by_teeth
        sentence = f"ratio = {stated:g}, the teeth give {expected:g}; mend ratio, the teeth or the fixed member"
        found.append(Finding(NAME, WARNING, sentence, value=stated, limit=expected))
    return found
