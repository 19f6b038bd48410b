"""The article's page is executed, so that it cannot rot."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from test_studies_claims import verdicts

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"


@pytest.mark.long
def test_exact_article_runs_and_its_claims_are_current(tmp_path):
    subprocess.run([sys.executable, str(ROOT / "tools" / "article.py"), str(tmp_path)], check=True, timeout=300)
    pictures = re.findall(r"\]\((images/[^)]+)\)", (DOCS / "article.md").read_text())
    assert len(pictures) >= 14
    for path in pictures:
        assert (tmp_path / path).stat().st_size > 10_000, path
        assert (DOCS / path).exists(), path
    assert verdicts((tmp_path / "claims.md").read_text()) == verdicts((DOCS / "claims.md").read_text())
