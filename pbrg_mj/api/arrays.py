"""Arrays by name, as attributes and as a mapping."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np


class Arrays(Mapping[str, np.ndarray]):
    """Read-only arrays: `arrays.q_true_m`, or `arrays["lambda"]` where the name is a word of Python's.

    An array is taken from the mapping when it is first asked for, and held from then on.
    """

    def __init__(self, arrays: Mapping[str, np.ndarray]):
        self._arrays = arrays
        self._taken: dict[str, np.ndarray] = {}

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the array of that name. Raises KeyError."""
        if name not in self._taken:
            self._taken[name] = self._arrays[name]
        return self._taken[name]

    def __contains__(self, name: object) -> bool:
        """Tell whether there is an array of that name, which is not taken."""
        return name in self._arrays

    def __getattr__(self, name: str) -> np.ndarray:
        """Return the array of that name. Raises AttributeError."""
        if not name.startswith("_") and name in self._arrays:
            return self[name]
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
