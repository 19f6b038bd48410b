"""Print what is named of every machine whose recordings are at hand, and the error of its held-out motor torque.

The table of docs/diagnosis.md: `PYTHONPATH=tests/python .venv/bin/python -m anchors`.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import hdfast
import pytest

from anchors.expected import EXPECTED


def main() -> None:
    for name, expected in EXPECTED.items():
        with TemporaryDirectory() as folder:
            try:
                file = expected.write(Path(folder))
            except pytest.skip.Exception as missing:
                print(f"{name:15s} {missing}")
                continue
            verdict = hdfast.diagnose(file).to_dict()
        named = ", ".join(effect["effect"] for effect in verdict["effects"]) or verdict["verdict"]
        channels = ((verdict["fit"] or {}).get("heldout") or {}).get("channels", {})
        errors = [
            f"{channel} {100.0 * error['baseline_nrmse']:.1f} -> {100.0 * error['extended_nrmse']:.1f} %"
            for channel, error in channels.items()
            if error["baseline_nrmse"] is not None
        ]
        print(f"{name:15s} {named}; {', '.join(errors)}", flush=True)


if __name__ == "__main__":
    main()
