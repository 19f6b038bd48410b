"""Draw docs/images/demo.png, the picture of the README, from the example."""

from pathlib import Path

from hdfast import config, simulate
from hdfast.report import plots
from hdfast.tolerance.simulation import simulate_rows

ROOT = Path(__file__).parent.parent
settings = config.load(ROOT / "examples" / "shf-25-120.toml")
nominal = simulate(settings.drive, model=settings.model, scenario=settings.scenario)
figure = plots.overview(simulate_rows(settings), nominal, settings.specs)
figure.savefig(ROOT / "docs" / "images" / "demo.png", dpi=110)
