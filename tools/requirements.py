"""Print the packages of this project and of the extras named on the command line, one per line."""

import sys
import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
lines = set(project["dependencies"])
for extra in sys.argv[1:]:
    lines.update(project["optional-dependencies"][extra])
print("\n".join(sorted(lines)))
