"""What is kept of a kernel: for other kernels that call it bitcode, for Python machine code, and never both.

Numba makes machine code of every kernel, and two ways in from Python and C. A kernel takes in whatever it calls, so
that nobody runs those of what is called by kernels only: a quarter of the time of a first start. And beside machine
code it keeps bitcode, which nobody links that takes in callees: to read it was a tenth of a later start. How Numba
keeps and links code is its own affair, so that this is written for the versions that the project names.
"""

from __future__ import annotations

from typing import Any

from llvmlite import binding
from numba.core.codegen import CPUCodegen, JITCodeLibrary
from numba.core.compiler import CompilerBase, CompileResult, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager
from numba.core.typed_passes import NopythonRewrites
from numba.core.untyped_passes import (
    FindLiterallyCalls,
    InlineClosureLikes,
    LiteralPropagationSubPipelinePass,
    LiteralUnroll,
    MakeFunctionToJitFunction,
    RewriteDynamicRaises,
    WithLifting,
)

# Passes for what kernels do not have: closures and comprehensions, contexts, literal values, errors, sums of arrays.
UNNEEDED = {
    FindLiterallyCalls,
    InlineClosureLikes,
    LiteralPropagationSubPipelinePass,
    LiteralUnroll,
    MakeFunctionToJitFunction,
    NopythonRewrites,
    RewriteDynamicRaises,
    WithLifting,
}

if not hasattr(CPUCodegen, "_pass_builder"):
    raise ImportError("Numba up to 0.61 lays passes out in another way")
OPTIMIZED = 1  # of LLVM's levels; kernels are no faster of the third, which takes a tenth more of a first start


class _Code(JITCodeLibrary):
    def _optimize_functions(self, module: Any) -> None:
        """Optimize each function by itself; the passes are laid out once, and not for each nor for what is declared."""
        module.data_layout = self._codegen._data_layout
        passes, builder = self._codegen._function_pass_manager(opt=OPTIMIZED)
        for function in module.functions:
            if not function.is_declaration:
                passes.run(function, builder)


class Bitcode(_Code):
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
    """Compiles to `Bitcode`."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes that Numba goes through."""
        state = self.state
        state.library = Bitcode(state.targetctx.codegen(), state.func_id.func_qualname)
        return [_needed_passes(state)]


class MachineCode(_Code):
    """What is compiled of a function that Python calls; nothing is linked into anything of what was kept of it."""

    @classmethod
    def read(cls, codegen: Any, kept: tuple[str, str, tuple[bytes, set[str]]]) -> MachineCode:
        """Return what `serialize_using_object_code` made something of, ready to run."""
        name, _, (code, symbols) = kept
        library = cls(codegen, name)
        library.enable_object_caching()
        library._set_compiled_object(code)
        library._finalize_final_module()
        codegen._engine._defined_symbols |= symbols
        return library

    def serialize_using_object_code(self) -> tuple[str, str, tuple[bytes, set[str]]]:
        """Return what is kept: the code, and the names of what is in it."""
        module = self._final_module
        symbols = {part.name for part in (*module.functions, *module.global_variables) if not part.is_declaration}
        return self.name, "object", (self._get_compiled_object(), symbols)

    def _optimize_final_module(self) -> None:
        """Bring counts of references together, which leave in pairs then, and optimize what is left, as Numba does."""
        together = {"loop_vectorize": False, "slp_vectorize": False, "opt": 0, "cost": "cheap"}
        for how in (together, {"opt": OPTIMIZED}):
            passes, builder = self._codegen._module_pass_manager(**how)
            passes.run(self._final_module, builder)


class KernelCompiler(CompilerBase):
    """Compiles to `MachineCode`."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes that Numba goes through."""
        state = self.state
        state.library = MachineCode(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return [_needed_passes(state)]


def _needed_passes(state: Any) -> PassManager:
    needed = PassManager("kernel")
    for each, why in DefaultPassBuilder.define_nopython_pipeline(state).passes:
        if each not in UNNEEDED:
            needed.add_pass(each, why)
    needed.finalize()
    return needed


class _Reader:
    """Stands in for a target context where Numba puts together what was kept of a kernel."""

    def __init__(self, context: Any, library: type[Bitcode | MachineCode]) -> None:
        self.typing_context, self.get_executable, self._codegen = (
            context.typing_context,
            context.get_executable,
            context.codegen(),
        )
        self._library = library

    def codegen(self) -> _Reader:
        return self

    def unserialize_library(self, kept: Any) -> Bitcode | MachineCode:
        return self._library.read(self._codegen, kept)


def put_together(context: Any, library: type[Bitcode | MachineCode], *parts: Any) -> Any:
    """Return what was taken apart of a kernel with such a library, as Numba's `CompileResult._rebuild`."""
    return CompileResult._rebuild(_Reader(context, library), *parts)._replace(target_context=context)


def set_environments(compiled: Any) -> None:
    """Set the environments of the callees that a kernel took in, which have none of their own."""
    for environment in compiled._find_referenced_environments():
        compiled.library.codegen.set_env(environment.env_name, environment)
