"""Names of the parameters of a stage: as short as they can be told apart, and always understood in full."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Sequence
from dataclasses import replace

from hdfast.params import Parameter, ParameterTable
from hdfast.sensors.catalogue import EFFECTS
from hdfast.sensors.channels import CHANNELS
from hdfast.sensors.contract import CHANNEL_UNIT

Key = tuple[str, str, str]


def table(effects: Sequence[tuple[str, str]], taken: Container[str] = ()) -> tuple[ParameterTable, dict[str, Key]]:
    """Parameters of (effect, channel) pairs, and behind each name the channel, effect and parameter.

    A parameter is called by its own name, with the effect before it where two effects share the name or something else
    has `taken` it, and with the channel before that where one effect acts on two channels.
    """
    keys = [
        (channel, effect, parameter.name)
        for effect, channel in effects
        for parameter in EFFECTS[effect].info.parameters
    ]
    written = [(own, f"{effect}_{own}", f"{channel}_{effect}_{own}") for channel, effect, own in keys]
    counts = Counter(name for forms in written for name in set(forms))
    rows: list[Parameter] = []
    aliases: dict[str, str] = {}
    behind: dict[str, Key] = {}
    for key, forms in zip(keys, written, strict=True):
        usable = [name for name in forms[:-1] if counts[name] == 1 and name not in taken]
        name = usable[0] if usable else forms[-1]
        rows.append(replace(_row(*key), name=name))
        aliases |= {form: name for form in [*usable, forms[-1]] if form != name}
        behind[name] = key
    return ParameterTable(tuple(rows), aliases), behind


def _row(channel: str, effect: str, own: str) -> Parameter:
    info = EFFECTS[effect].info
    p = EFFECTS[effect].parameter(own)
    unit = CHANNELS[channel].unit
    default, low, high = (p.default, p.low, p.high) if unit == "rad" or p.on_torque is None else p.on_torque
    return Parameter(
        name=own,
        symbol=p.symbol,
        unit=p.unit.replace(CHANNEL_UNIT, unit),
        default=default,
        low=low,
        high=high,
        meaning=f"{p.meaning} ({channel})",
        source=info.source,
        group="sensor",
        allowed=p.allowed,
    )
