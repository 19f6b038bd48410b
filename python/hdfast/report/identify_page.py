"""The result folder of an identification: page, model file, JSON and the points it rests on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hdfast import catalogue
from hdfast.files import FIT, INPUT, PAGE, json_ready, prepare_inputs, remove, write_json, write_text
from hdfast.identify import estimate
from hdfast.identify.fit import Fit
from hdfast.printing import html_table
from hdfast.report import folder, html, identify_plots

MODEL, POINTS = "model.toml", "points.parquet"
RESULTS = (FIT, MODEL, POINTS, PAGE)


def summary(fit: Fit) -> dict[str, Any]:
    """The identification in numbers, ready for JSON; what is not finite becomes null."""
    numbers = {
        "kind": fit.kind,
        "version": catalogue.build_info()["version"],
        "estimates": {
            item.name: {
                "value": item.value,
                "unit": item.unit,
                "sigma": item.sigma,
                "interval_90": [item.low, item.high],
                "meaning": item.meaning,
            }
            for item in fit.estimates
        },
        "notes": fit.notes,
        **fit.numbers,
    }
    return dict(json_ready(numbers))


def page(fit: Fit) -> str:
    """The page of an identification."""
    parts = [item for item in fit.estimates if item.name.startswith(("te_cos_", "te_sin_"))]
    main = [item for item in fit.estimates if item not in parts]
    figures = [html.picture(draw(fit), caption) for draw, caption in identify_plots.FIGURES[fit.kind]]
    sections = [
        html.Section("What was identified", tables=[_table(main)]),
        html.Section("Pictures", figures=figures),
        html.Section("What it rests on, and what it cannot hold", texts=fit.notes),
    ]
    sections += [html.Section(name, tables=[html_table(*table)]) for name, table in fit.tables.items()]
    if parts:
        sections.append(html.Section("Coefficients", tables=[_table(parts)]))
    sections.append(html.Section("Model file", texts=[f"{MODEL} holds them, for simulate, sweep and tolerance."]))
    return html.render(fit.title, f"hdfast identify {fit.kind.replace('_', '-')}", [], sections, fit.source, None)


def _table(estimates: Sequence[estimate.Estimate]) -> str:
    return html_table(estimate.HEADER, estimate.rows(estimates), (1,))


def write(fit: Fit, out: str | Path) -> Path:
    """Write everything, the JSON last, and return the page."""
    import pyarrow as pa

    inputs = {INPUT: fit.source.encode()} if fit.source else {}
    target = prepare_inputs(out, inputs, RESULTS)
    if (target / FIT).exists():
        remove(target / name for name in (*RESULTS, INPUT))
    write_text(target / MODEL, fit.model_text())
    fields = [pa.field(name, pa.float64(), metadata={"unit": unit}) for name, (unit, _) in fit.points.items()]
    table = pa.Table.from_arrays([pa.array(values) for _, values in fit.points.values()], schema=pa.schema(fields))
    folder.write_table(target / POINTS, table, None, catalogue.build_info()["version"])
    write_text(target / PAGE, page(fit))
    folder.write_inputs(target, inputs)
    write_json(target / FIT, summary(fit))
    return target / PAGE
