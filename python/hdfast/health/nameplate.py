"""What the campaign file itself leaves open or contradicts."""

from __future__ import annotations

from hdfast.drive_file import DriveFile
from hdfast.health.finding import NOTE, WARNING, Finding
from hdfast.recordings import Campaign

NAME = "drive"
DRAG = ("B_m", "B_ml")
#: Relative standard deviations beyond which one is an absolute one by mistake.
SMALLEST, LARGEST = 1e-4, 10.0


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
    exact = drive.exact_by_mistake
    if exact:
        sentence = (
            f"{', '.join(exact)} = 0 has a relative sigma, which is 0 as well: it is taken as exactly 0; state the "
            "value that is expected, or leave it out"
        )
        found.append(Finding(NAME, WARNING, sentence, value=len(exact)))
    found += _unlikely(drive)
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


def _unlikely(drive: DriveFile) -> list[Finding]:
    """Standard deviations that are stated in the unit of their parameters, by their size."""
    shares = {name: sigma / abs(drive.values[name]) for name, sigma in drive.sigma.items() if drive.values[name] != 0.0}
    unlikely = {name: share for name, share in shares.items() if share > LARGEST or 0.0 < share < SMALLEST}
    if not unlikely:
        return []
    stated = ", ".join(f"{name} ({share:.4g})" for name, share in unlikely.items())
    sentence = f"sigma of {stated}: it is a share of the value, 0.1 for 10 %, and no number in its unit"
    return [Finding(NAME, WARNING, sentence, value=next(iter(unlikely.values())), limit=LARGEST)]
