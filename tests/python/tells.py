"""What a case shows of itself without its signals: file, header and timing statistics, and whether they tell the label.

The classifier is ridge regression on standardised features and their ranks, judged by cross-validated accuracy of
its sign against that of shuffled labels (P. Golland, B. Fischl, Information Processing in Medical Imaging 2003, 330).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from hdfast.recordings import load_campaign

FOLDS, SPLITS = 5, 10
SHUFFLES = 399
RIDGE = 0.1


def statistics(case: Path) -> dict[str, float]:
    """Numbers of one case that its signals' values are no part of."""
    campaign = load_campaign(case / "campaign.toml")
    files = sorted(p for p in case.iterdir() if p.name != "campaign.toml")
    header = _numbers(campaign.data)
    clocks = [recording.columns["t"] for recording in campaign.recordings]
    counts = np.array([len(t) for t in clocks], dtype=float)
    seconds = np.array([np.ptp(t) for t in clocks])
    jitter = [np.std(np.diff(t)) / np.median(np.diff(t)) for t in clocks]
    sizes = np.array([p.stat().st_size for p in files], dtype=float)
    return {
        "files": float(len(files)),
        "bytes": float(np.mean(sizes)),
        "bytes per sample": float(sizes.sum() / counts.sum()),
        "header bytes": float((case / "campaign.toml").stat().st_size),
        "columns": float(len(campaign.recordings[0].columns)),
        "samples": float(np.mean(counts)),
        "seconds": float(np.mean(seconds)),
        "longest": float(np.max(seconds)),
        "rate": float(counts.sum() / seconds.sum()),
        "jitter": float(np.mean(jitter)),
        "gaps": float(np.mean([np.mean(np.diff(t) > 1.5 * np.median(np.diff(t))) for t in clocks])),
        "suffix": float(sum(files[0].suffix.encode())),
        "name": int(case.name, 16) / 2**32,
        "names": float(np.mean([int(p.stem, 16) / 2**32 for p in files])),
        **header,
    }


def _numbers(section: object, name: str = "") -> dict[str, float]:
    """Every number and every choice of a header, by its path; recordings are counted elsewhere."""
    if isinstance(section, bool | int | float):
        return {name: float(section)}
    if isinstance(section, str):
        return {f"{name} {section}": 1.0}
    if isinstance(section, list):
        return {f"{name} entries": float(len(section))}
    if isinstance(section, dict):
        found: dict[str, float] = {}
        for key, value in section.items():
            if key != "recording":
                found |= _numbers(value, f"{name} {key}".strip())
        return found
    return {}


def matrix(cases: list[dict[str, float]]) -> np.ndarray:
    """Features (n, d): values and ranks, standardised; what a case does not have counts as 0."""
    names = sorted({name for case in cases for name in case})
    raw = np.array([[case.get(name, 0.0) for name in names] for case in cases])
    ranks = np.argsort(np.argsort(raw, axis=0, kind="stable"), axis=0, kind="stable").astype(float)
    both = np.concatenate([raw, ranks], axis=1)
    spread = both.std(axis=0)
    return (both - both.mean(axis=0))[:, spread > 1e-12] / spread[spread > 1e-12]


def p_value(
    features: np.ndarray, truth: np.ndarray, rng: np.random.Generator, within: np.ndarray | None = None
) -> float:
    """How often shuffled labels are told as well as the true ones.

    Args:
        features: (n, d).
        truth: labels as 0 and 1, shape (n,).
        rng: of folds and shuffles.
        within: groups inside which labels are shuffled, shape (n,); default one group.
    """
    groups = np.zeros(len(truth), dtype=int) if within is None else within
    parts = [order % FOLDS == k for order in (rng.permutation(len(truth)) for _ in range(SPLITS)) for k in range(FOLDS)]
    hats = [_hat(features[~part], features[part]) for part in parts]

    def accuracy(labels: np.ndarray) -> np.ndarray:
        """Share told rightly, both labels counting the same, for labels (S, n): (S,)."""
        share = labels.mean(axis=1, keepdims=True)
        right = np.zeros(len(labels))
        for part, hat in zip(parts, hats, strict=True):
            known, asked = labels[:, ~part], labels[:, part]
            told = (known - known.mean(axis=1, keepdims=True)) @ hat.T > 0.0
            right += np.sum(np.where(asked > 0.5, told / share, ~told / (1.0 - share)), axis=1)
        return right / labels.shape[1] / 2.0 / SPLITS

    shuffled = np.tile(truth, (SHUFFLES, 1))
    for group in np.unique(groups):
        shuffled[:, groups == group] = rng.permuted(shuffled[:, groups == group], axis=1)
    as_good = accuracy(shuffled) >= accuracy(truth[None]) - 1e-12
    return (1.0 + float(as_good.sum())) / (SHUFFLES + 1.0)


def _hat(known: np.ndarray, asked: np.ndarray) -> np.ndarray:
    """Predictions of ridge regression at (m, d) as a matrix on the labels of (n, d): (m, n)."""
    gram = known @ known.T
    return asked @ known.T @ np.linalg.inv(gram + RIDGE * np.trace(gram) / len(gram) * np.eye(len(gram)))
