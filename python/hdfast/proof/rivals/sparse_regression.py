"""Sparse regression on smoothed derivatives: pysindy's bagged thresholded least squares over the same terms.

The recorded motion with its smoothed derivatives is imposed; what each term then adds to torque, transmission error and
output torque is a column of the regression, its best shape for each effect. What a refit of the known model absorbs is
taken out of columns and target, so that the threshold meets the unknown part alone. An effect is accepted by its
inclusion probability. Threshold and ridge are the best of eleven settings on twenty open cases that name anything more
than once: a lower threshold names something everywhere, and without a ridge the columns of late actuators, late sensors
and filters cancel each other. Columns that resemble each other share a coefficient, and are named or dropped together.

U. Fasel, J. N. Kutz, B. W. Brunton, S. L. Brunton, Proceedings of the Royal Society A 478 (2022) 20210904.
"""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from hdfast.checks import Floats
from hdfast.diagnosis.changes import changes
from hdfast.diagnosis.fit import fit
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.projector import Projector
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.screen import Signature, signatures
from hdfast.diagnosis.session import Setup, candidates
from hdfast.diagnosis.whiten import Whitener
from hdfast.errors import require_package
from hdfast.proof.rivals.forward_bic import fits_in, started
from hdfast.proof.rivals.said import Named, Said, finding

THRESHOLD = 0.2
RIDGE = 0.1
MODELS = 20
INCLUDED = 0.75


def answer(setup: Setup, calibrated: Fit) -> Said:
    """Name every effect whose column is kept in most resampled regressions.

    Raises:
        MissingPackageError: pysindy is not installed.
    """
    replay = setup.replay
    plain = replace(calibrated, white=unfiltered(replay, calibrated))
    pool = [one for one in candidates(replay, plain, plain.value("ratio")) if fits_in(one, [], plain)]
    found = best_shapes(signatures(replay, plain, changes(replay, plain, pool)))
    if not found:
        return Said("no_evidence", calibrated)
    target = Projector(plain, replay.layout).left(plain.white(replay.layout, plain.mismatch))
    kept = inclusion(np.concatenate([one.left for one in found], axis=1), target)
    owner = np.repeat(np.arange(len(found)), [one.left.shape[1] for one in found])
    shares = [float(kept[owner == k].max()) for k in range(len(found))]
    chosen = [(one, share) for one, share in zip(found, shares, strict=True) if share >= INCLUDED]
    named = [Named(one.candidate, share) for one, share in chosen]
    return finding(refitted(replay, calibrated, [one for one, _ in chosen]), named)


def unfiltered(replay: Replay, fitted: Fit) -> Whitener:
    """Channels in units of their mismatch, sample by sample."""
    return Whitener(
        {name: np.array([[1.0 / fitted.weights.scale[k]]]) for k, name in enumerate(replay.layout.channels)}
    )


def best_shapes(found: list[Signature]) -> list[Signature]:
    """One shape of each effect: the one that explains most."""
    best: dict[str, Signature] = {}
    for one in sorted(found, key=lambda one: -one.gain):
        best.setdefault(one.candidate.effect, one)
    return list(best.values())


def inclusion(columns: Floats, target: Floats, seed: int = 0) -> Floats:
    """Share of the resampled regressions that keep each column (N, d) for a target (N,), shape (d,)."""
    require_package("pysindy", "proof")
    from pysindy.optimizers import STLSQ, EnsembleOptimizer

    size = np.sqrt(np.mean(columns**2, axis=0))
    scaled = columns / np.maximum(size, 1e-300)
    np.random.seed(seed)  # noqa: NPY002 - the package draws its resamples from the global generator
    bagged = EnsembleOptimizer(STLSQ(threshold=THRESHOLD, alpha=RIDGE * len(target)), bagging=True, n_models=MODELS)
    with threadpool_limits(1), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Sparsity parameter is too big")
        bagged.fit(scaled, (target / max(float(np.std(target)), 1e-300))[:, None])
    return np.asarray(np.mean([np.ravel(one) != 0.0 for one in bagged.coef_list], axis=0), dtype=np.float64)


def refitted(replay: Replay, calibrated: Fit, chosen: list[Signature]) -> Fit:
    """The model with all of them that it has room for, fitted once where it runs.

    Special cases go with their generalisation.
    """
    general = {effect for one in chosen for effect in one.candidate.contains}
    kept: list[Signature] = []
    structure = calibrated.structure
    for one in chosen:
        if one.candidate.effect not in general and one.candidate.fits_into(structure):
            kept, structure = [*kept, one], one.candidate.added_to(structure)
    start = started(calibrated, [one.candidate.started(one.shares) for one in kept])
    runs = bool(np.isfinite(replay.mismatch(structure, start[None])).all())
    return fit(replay, structure, start) if kept and runs else calibrated
