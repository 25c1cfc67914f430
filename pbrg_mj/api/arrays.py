"""Arrays by name, as attributes and as a mapping."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np


class Arrays(Mapping[str, np.ndarray]):
    """Read-only arrays: `arrays.q_true_m`, or `arrays["lambda"]` where the name is a word of Python's."""

    def __init__(self, arrays: Mapping[str, np.ndarray]):
        self._arrays = dict(arrays)

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the array of that name. Raises KeyError."""
        return self._arrays[name]

    def __getattr__(self, name: str) -> np.ndarray:
        """Return the array of that name. Raises AttributeError."""
        if not name.startswith("_") and name in self._arrays:
            return self._arrays[name]
        raise AttributeError(f"there is no array {name!r}; there are: {', '.join(self._arrays)}")

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self._arrays)

    def __len__(self) -> int:
        """Return how many arrays there are."""
        return len(self._arrays)

    def __dir__(self) -> list[str]:
        """List the arrays with the attributes, for completion."""
        return [*super().__dir__(), *self._arrays]

    def __repr__(self) -> str:
        """List names, types and shapes."""
        return "\n".join(f"{name}: {one.dtype} {one.shape}" for name, one in self._arrays.items())
