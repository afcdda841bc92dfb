"""Kernels as other kernels call them: bitcode, which each caller takes in, optimizes and makes machine code of.

Numba makes machine code of every kernel, and two ways in from Python and C. A kernel takes in whatever it calls, so
that nobody runs those of what is called by kernels only: a quarter of the time of a first start. How Numba keeps and
links code is its own affair, so that this is written for the versions that the project names.
"""

from __future__ import annotations

from typing import Any

from llvmlite import binding
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, CompileResult, DefaultPassBuilder


class Bitcode(JITCodeLibrary):
    """What is compiled of a function, to be linked into what calls it."""

    @classmethod
    def read(cls, codegen: Any, kept: tuple[str, str, bytes]) -> Bitcode:
        """Return what `serialize_using_object_code` made something of."""
        name, _, bitcode = kept
        library = cls(codegen, name)
        library._final_module = binding.parse_bitcode(bitcode)
        library._finalize_final_module()
        return library

    def serialize_using_object_code(self) -> tuple[str, str, bytes]:
        """Return what is kept: there is no object code."""
        return self.name, "bitcode", self._get_module_for_linking().as_bitcode()

    def get_pointer_to_function(self, _: str) -> int:
        """Return that nothing here can be run."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> Bitcode:
        """Who is asked to set the environments of what can be run."""
        return self

    def set_env(self, *_: object) -> None:
        """Do nothing: whoever links this sets them."""

    def _optimize_final_module(self) -> None:
        """Leave it to the callers, which do it again anyway."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


class CalleeCompiler(CompilerBase):
    """Compiles to `Bitcode`, as otherwise to machine code."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes that Numba goes through."""
        state = self.state
        state.library = Bitcode(state.targetctx.codegen(), state.func_id.func_qualname)
        return [DefaultPassBuilder.define_nopython_pipeline(state)]


class _Reader:
    """Stands in for a target context where Numba puts together what was kept of a callee."""

    def __init__(self, context: Any) -> None:
        self.typing_context, self.get_executable, self._codegen = (
            context.typing_context,
            context.get_executable,
            context.codegen(),
        )

    def codegen(self) -> _Reader:
        return self

    def unserialize_library(self, kept: tuple[str, str, bytes]) -> Bitcode:
        return Bitcode.read(self._codegen, kept)


def put_together(context: Any, *parts: Any) -> Any:
    """Return what was taken apart of a callee, as Numba's `CompileResult._rebuild`."""
    return CompileResult._rebuild(_Reader(context), *parts)._replace(target_context=context)


def set_environments(compiled: Any) -> None:
    """Set the environments of the callees that a kernel took in, which have none of their own."""
    for environment in compiled._find_referenced_environments():
        compiled.library.codegen.set_env(environment.env_name, environment)
