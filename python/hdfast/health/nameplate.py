"""What the campaign file itself leaves open or contradicts."""

from __future__ import annotations

from hdfast.health.finding import NOTE, WARNING, Finding
from hdfast.recordings import Campaign

NAME = "drive"
SAME = 1e-6


def check(campaign: Campaign) -> list[Finding]:
    """Name the parameters that the default drive stands in for, and a ratio that the teeth contradict."""
    found = []
    filled = [name for name, prior in campaign.priors.items() if not prior.stated and prior.sigma > 0.0]
    if "ratio" not in campaign.drive.values:
        sentence = f"[drive] does not state ratio; {campaign.priors['ratio'].value:g} is taken, exactly"
        found.append(Finding(NAME, WARNING, sentence, value=campaign.priors["ratio"].value))
    if filled:
        sentence = f"[drive] does not state {', '.join(filled)}; the default drive stands in with a wide prior"
        found.append(Finding(NAME, NOTE, sentence, value=len(filled)))
    expected = ratio_by_teeth(campaign)
    stated = campaign.drive.values.get("ratio")
    if expected is not None and stated is not None and abs(abs(stated) / expected - 1.0) > SAME:
        sentence = f"ratio = {stated:g}, the teeth give {expected:g}; mend ratio, the teeth or the fixed member"
        found.append(Finding(NAME, WARNING, sentence, value=stated, limit=expected))
    return found


def ratio_by_teeth(campaign: Campaign) -> float | None:
    """Gear ratio from the numbers of teeth, None when they are not stated."""
    teeth = campaign.drive.teeth
    flexspline, circular = teeth.get("teeth_flexspline"), teeth.get("teeth_circular")
    if not isinstance(flexspline, int) or not isinstance(circular, int) or circular <= flexspline:
        return None
    turning = circular if teeth.get("fixed", "flexspline") == "flexspline" else flexspline
    return turning / (circular - flexspline)
