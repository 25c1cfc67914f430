"""Libraries of machine code: one for each kernel that Python calls, none for the functions that go into it.

Written against numba's inside, like `compiler`.
"""

# pyright: reportPrivateImportUsage=false, reportIncompatibleMethodOverride=false, reportAttributeAccessIssue=false

from __future__ import annotations

from typing import Any

from llvmlite.binding import Linkage
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import lookup_environment

ENVIRONMENT = "_ZN08NumbaEnv"  # prefix of the pointers to what functions need at run time


class LinkedLibrary(JITCodeLibrary):
    """A function that is only linked into others: neither optimised nor turned into machine code."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        """End what is added to it."""
        self._raise_if_finalized()
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return a null pointer."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> Any:
        """What numba hands pointers to."""
        return _NoPointers

    def _get_module_for_linking(self) -> Any:
        """Return it with all it calls: what a library of numba's own needs."""
        whole = super()._get_module_for_linking().clone()
        for library in _linked_into(self):
            whole.link_in(library._get_module_for_linking(), preserve=True)
        return whole

    def alone(self) -> Any:
        """Return it without what it calls."""
        return super()._get_module_for_linking()


class _NoPointers:
    """There is no machine code yet whose pointers could be set."""

    @staticmethod
    def set_env(name: str, environment: Any) -> None:
        """Do nothing: `EntryLibrary` sets the pointer."""


class EntryLibrary(JITCodeLibrary):
    """A kernel that Python calls, with all that it calls."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        """Optimise it and turn it into machine code."""
        self._linking_libraries = _linked_into(self)
        super().finalize()

    def _optimize_final_module(self) -> None:
        """Optimise it, knowing that nobody else calls what it calls: arguments in no use are not handed over at all."""
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.linkonce_odr:
                function.linkage = Linkage.internal
        super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        super()._finalize_final_module()
        for variable in self._final_module.global_variables:
            if variable.name.startswith(ENVIRONMENT):
                environment = lookup_environment(variable.name)
                if environment is not None:
                    self._codegen.set_env(variable.name, environment)


def _linked_into(library: Any) -> list[Any]:
    """Return all libraries that go into one, each once, callees after their callers."""
    found: dict[Any, Any] = {}

    def add(one: Any) -> None:
        for called in one._linking_libraries:
            if called not in found:
                found[called] = called
                if isinstance(called, LinkedLibrary):
                    found[called] = _Alone(called)
                    add(called)

    add(library)
    return list(found.values())


class _Alone:
    """A library to link without what it calls, which is linked as well."""

    def __init__(self, library: LinkedLibrary):
        self._reload_init = library._reload_init
        self._get_module_for_linking = library.alone
