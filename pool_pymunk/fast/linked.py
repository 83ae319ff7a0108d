"""Functions that compiled shots call are optimized and made machine code of once, in their caller.

numba optimizes each function with all that it calls, and makes machine code of it, again for every
function above it: two thirds of the time that compilation took. Nobody calls these functions from
Python, so here they are only linked into the function at the root. That needs private parts of
numba, so :func:`~pool_pymunk.fast.compiled.can_link` tries them first.
"""

from __future__ import annotations

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering

from pool_pymunk.fast.compiled import is_inlined


class NoEnvironment:
    """A function without machine code has no environment that could be set."""

    def set_env(self, name: str, environment: object) -> None:
        """Do nothing."""


class LinkedLibrary(JITCodeLibrary):
    """A linked library holds one function as numba has lowered it, for those that call it."""

    @property
    def codegen(self) -> NoEnvironment:
        return NoEnvironment()

    def get_pointer_to_function(self, name: str) -> int:
        return 0

    def _optimize_final_module(self) -> None:
        """Leave that to the root's library."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class LoweringToLink(NativeLowering):
    """This pass lowers a function into a linked library.

    All functions are typed with the same flags, because numba compiles a function again for each
    caller with other flags. So two flags are set only here.
    """

    _name = "pool_pymunk_lowering_to_link"

    def run_pass(self, state: Any) -> bool:
        state.flags.no_cpython_wrapper = True
        state.flags.forceinline = is_inlined(state.func_id.func)
        state.library = LinkedLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        return bool(super().run_pass(state))


class LinkedCompiler(CompilerBase):
    """This is numba's own compiler with another last pass."""

    def define_pipelines(self) -> list[Any]:
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.passes = [
            (LoweringToLink if each is NativeLowering else each, why) for each, why in passes.passes
        ]
        passes.finalize()
        return [passes]


def doubled(x: float) -> float:
    """Return a number twice; nobody needs it but the trial."""
    return x + x


def trial(x: float) -> float:
    """Call a function that is linked: this shows whether numba can still do so."""
    return doubled(x) + 1.0
