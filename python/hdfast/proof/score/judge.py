"""What one answer is worth against its label."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hdfast.proof.score.answer import CLAIMS, Answer

UNDECIDABLE_COSINE = 0.98
MOST_BESIDE = 1  # ids beside the class that an answer may hold possible
NAMED_FROM, MISSED_FROM = 1.5, 3.0
LINE, ORDER_TOLERANCE = "te_harmonic", 0.02  # the one effect that may be claimed several times
RIGHT, RIGHT_CLASS, PARTLY, ABSTAINED, MISSED, WRONG = "right", "right_class", "partly", "abstained", "missed", "wrong"


@dataclass(frozen=True)
class Case:
    """A label and its answer.

    Attributes:
        name: folder of the case.
        label: certificate.
        answer: what the tool said.
        outcome: one of the words above; "wrong" holds faults and every name that is not in the label.
        utility: +1 right where something is left out, 0 abstained or right class, -3 wrong, -1 missed at three
            detectable amplitudes or more; the share of named effects where several are to be found.
    """

    name: str
    label: dict[str, Any]
    answer: Answer
    outcome: str
    utility: float

    @property
    def stratum(self) -> str:
        """Stratum of the case."""
        return str(self.label["kind"][0])

    @property
    def ids(self) -> list[str]:
        """Ids in the label."""
        return [e["id"] for e in self.label["effects"]]

    @property
    def strength(self) -> float:
        """Largest amplitude in detectable amplitudes, 0 without effect."""
        return max((float(e["amplitude_over_mda"]) for e in self.label["effects"]), default=0.0)

    @property
    def twins(self) -> set[str]:
        """Rivals that, by the certificate, these recordings cannot tell apart from the effect."""
        return {r["id"] for r in self.label["rivals"] if r["abs_cos"] > UNDECIDABLE_COSINE}

    @property
    def tells_class(self) -> bool:
        """Whether the answer holds the effect and a twin possible, and hardly anything else."""
        considered, ids = self.answer.considered, set(self.ids)
        return (
            self.stratum != "set"
            and self.answer.kind in ("undecided", "found", "sensor")
            and bool(considered & ids)
            and bool(considered & self.twins)
            and len(considered - ids - self.twins) <= MOST_BESIDE
            and set(self.wrong_names) <= self.twins
        )

    @property
    def claimed(self) -> bool:
        """True when the answer claims anything at all, or is none."""
        return bool(self.answer.fault) or self.answer.kind in CLAIMS

    @property
    def unnamed(self) -> list[str]:
        """Ids in the label that are large enough to be named and are not."""
        large = [e["id"] for e in self.label["effects"] if float(e["amplitude_over_mda"]) >= NAMED_FROM]
        return [i for i in large if i not in self.right_names]

    @property
    def fails(self) -> bool:
        """Whether the answer is wrong or leaves unnamed what is large enough to be named."""
        return self.outcome == WRONG or (self.outcome in (MISSED, ABSTAINED, PARTLY) and bool(self.unnamed))

    @property
    def depends_rightly(self) -> bool:
        """Whether the answer is a dependence on the right variable, with the right memory."""
        where = self.answer.verdict.get("where") or {}
        right = bool(set(where.get("depends_on") or []) & set(self.label["depends_on"]))
        return self.answer.kind == "depends_on" and right and where.get("memory") == self.label["memory"]

    @property
    def right_names(self) -> list[str]:
        """Claimed ids that are in the label, a line of the kinematic error once and at its order."""
        return [i for i, right in self._compared(self.answer.claims) if right]

    @property
    def wrong_names(self) -> list[str]:
        """Claimed ids that are not."""
        return [i for i, right in self._compared(self.answer.claims) if not right]

    @property
    def leads_rightly(self) -> bool:
        """Whether the most probable effect of the answer, claimed or not, is in the label."""
        return any(right for _, right in self._compared(self.answer.listed[:1]))

    def _compared(self, entries: Sequence[dict[str, Any]]) -> list[tuple[str, bool]]:
        """Ids of an answer's effects, and whether each is in the label."""
        lines = [e for e in self.label["effects"] if e["id"] == LINE]
        found = []
        for entry in entries:
            line = next((one for one in lines if _same_order(entry, one)), None)
            if line is not None:
                lines.remove(line)
            name = entry["effect"]
            found.append((name, name in self.ids if name != LINE else line is not None))
        return found


def judge(name: str, label: dict[str, Any], answer: Answer) -> Case:
    """Judge one answer."""
    bare = Case(name, label, answer, "", 0.0)
    outcome = _outcome(bare)
    share = len(set(bare.right_names)) / max(len(bare.ids), 1)
    utility = {RIGHT: 1.0, RIGHT_CLASS: 0.0, PARTLY: share, ABSTAINED: 0.0, MISSED: -1.0, WRONG: -3.0}[outcome]
    return Case(name, label, answer, outcome, utility if bare.ids or outcome == WRONG else 0.0)


def _same_order(entry: dict[str, Any], line: dict[str, Any]) -> bool:
    """Whether a claimed line is at the order of a line in the label; one that states no order may be any."""
    parameter = (entry.get("parameters") or {}).get("order")
    stated = parameter.get("value") if isinstance(parameter, dict) else None
    true = line["true_parameters"].get("order")
    same = stated is None or true is None or abs(float(stated) / float(true) - 1.0) <= ORDER_TOLERANCE
    return bool(entry["effect"] == LINE and same)


def _outcome(case: Case) -> str:
    answer, ids = case.answer, set(case.ids)
    if answer.fault:
        return WRONG
    if case.stratum == "null":
        return WRONG if case.claimed else RIGHT
    if case.stratum == "outside":
        if answer.named:
            return WRONG
        return RIGHT if case.depends_rightly else _silence(case)
    if case.tells_class:
        return RIGHT if set(answer.named) == ids else RIGHT_CLASS
    if case.wrong_names:
        return WRONG
    if answer.named:
        return RIGHT if set(answer.named) == ids else PARTLY
    return _silence(case)


def _silence(case: Case) -> str:
    return MISSED if case.strength >= MISSED_FROM else ABSTAINED
