"""A search over keys, asked for points and told their values: Optuna's tree-structured Parzen estimator.

Bergstra, Bardenet, Bengio and Kegl, Algorithms for hyper-parameter optimization, NeurIPS 2011. It takes numbers, whole
numbers and choices alike, and needs no gradient. Points depend on seed and values alone, not on the order of runs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from typing import Any

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.families.schema import Distribution
from pbrg_mj.studies.document import StudyFile, plain

BOUNDED = ("uniform", "log_uniform", "integer", "choice")


class Optimizer:
    """Minimizes a number over values of keys."""

    def __init__(self, keys: Mapping[str, Distribution], seed: int):
        """Begin a search. Raises InputError without Optuna."""
        if find_spec("optuna") is None:
            raise InputError("a search needs Optuna: pip install optuna")
        import optuna

        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self._keys = dict(keys)
        self._study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed % 2**32))

    def ask(self, count: int) -> list[tuple[Any, dict[str, Any]]]:
        """Return points to try, each with a handle to tell its value by."""
        trials = [self._study.ask() for _ in range(count)]
        return [(trial, {key: _suggested(trial, key, one) for key, one in self._keys.items()}) for trial in trials]

    def tell(self, values: Sequence[tuple[Any, float]]) -> None:
        """Take the values of points, in the order in which they were asked for."""
        for trial, value in values:
            self._study.tell(trial, value)


def check_bounded(file: StudyFile[Any], keys: Mapping[str, Distribution]) -> None:
    """Raise InputError for a distribution without bounds, which no search covers."""
    for key, one in keys.items():
        if all(getattr(one, name) is None for name in BOUNDED) or one.per_robot:
            raise file.error(("keys", key), f"cannot be searched; allowed: one of {', '.join(BOUNDED)}, not per robot")


def _suggested(trial: Any, key: str, one: Distribution) -> Any:
    if one.choice is not None:
        return plain(one.choice)[trial.suggest_int(key, 0, len(one.choice) - 1)]
    if one.integer is not None:
        return trial.suggest_int(key, *one.integer)
    low, high = one.uniform or one.log_uniform or (0.0, 0.0)
    return float(f"{trial.suggest_float(key, low, high, log=one.uniform is None):.6g}")
