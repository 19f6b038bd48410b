"""Draw docs/images/diagnosis.png, the picture of a diagnosis, from the example with concealed friction."""

from pathlib import Path

from hdfast import diagnose
from hdfast.report.diagnosis_plots import overview
from hdfast.report.diagnosis_views import traces

ROOT = Path(__file__).parent.parent
found = diagnose(ROOT / "examples" / "concealed-friction" / "campaign.toml", progress=True)
verdict = found.evidence
final = verdict.session.search.final
figure = overview(traces(verdict), "motor_speed", final.value("ratio"), final.value("J_l"))
figure.savefig(ROOT / "docs" / "images" / "diagnosis.png", dpi=110)
