"""Compilation of a kernel that other kernels call as LLVM IR, without machine code of its own.

Numba by itself optimises such a function, turns it into machine code, and does both again inside each of its callers.
As a part it is linked into the function that Python calls, once, and is optimised there.

Numba's classes used here are not public: `bem._support.jit` tries them on a small kernel first, and where they fail, as
with another version of Numba they might, kernels are compiled as Numba does by itself, which takes twice as long.
"""

from typing import Any

from llvmlite import binding, ir
from numba import types
from numba.core.codegen import CodeLibrary, JITCodeLibrary
from numba.core.compiler import DefaultPassBuilder, lookup_environment
from numba.core.compiler_machinery import LoweringPass, PassManager, register_pass
from numba.core.typed_passes import AnnotateTypes, NativeLowering


class _Part(JITCodeLibrary):
    """The IR of a function, and the libraries of those that it calls."""

    def finalize(self) -> None:
        self._raise_if_finalized()
        self._finalize_dynamic_globals()
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage.name == "external":
                function.linkage = "linkonce_odr"  # one of several copies is kept
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        return self._final_module

    def get_pointer_to_function(self, name: str) -> int:  # noqa: ARG002
        self._ensure_finalized()
        return 0  # none, as of a function without a wrapper

    @property
    def codegen(self) -> "_Part":
        return self  # asked for `set_env` only

    def set_env(self, name: str, environment: Any) -> None:
        """Left to the kernel that this is a part of."""


class _Whole(JITCodeLibrary):
    """The machine code of a function, into which its parts and their parts are linked."""

    def add_linking_library(self, library: CodeLibrary) -> None:
        if library not in self._linking_libraries:
            super().add_linking_library(library)
            for nested in library._linking_libraries if isinstance(library, _Part) else ():
                self._reload_init.update(nested._reload_init)
                self.add_linking_library(nested)

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage.name == "linkonce_odr":
                function.linkage = "internal"  # so that one that is called once is inlined
        super()._optimize_final_module()
        counting = binding.parse_assembly(str(_reference_counting()))
        counting.data_layout, counting.triple = self._final_module.data_layout, self._final_module.triple
        self._final_module.link_in(counting)
        for name in _COUNTING:
            self._final_module.get_function(name).linkage = "internal"
        passes, builder = self._codegen._module_pass_manager(loop_vectorize=False, slp_vectorize=False, opt=1)
        passes.run(self._final_module, builder)  # which inlines them


_COUNTING = "NRT_incref", "NRT_decref"


def _reference_counting() -> ir.Module:
    """Numba's functions that count the references to an array, without its atomic operations.

    Counting takes half of the samples of a kernel, for tuples of many arrays go from function to function. A kernel
    makes the counts of all of its arrays itself, also of those that Python gives it, and runs in one thread.
    """
    module, nothing, word = ir.Module(), ir.VoidType(), ir.IntType(types.intp.bitwidth)
    of_pointer = ir.FunctionType(nothing, [ir.IntType(8).as_pointer()])
    release = ir.Function(module, of_pointer, "NRT_MemInfo_call_dtor")
    for name, change in zip(_COUNTING, (1, -1), strict=True):
        function = ir.Function(module, of_pointer, name)
        function.attributes.add("alwaysinline")
        builder = ir.IRBuilder(function.append_basic_block())
        (counted,) = function.args
        with builder.if_then(builder.icmp_unsigned("!=", counted, counted.type(None)), likely=True):
            count = builder.bitcast(counted, word.as_pointer())
            new = builder.add(builder.load(count), word(change))
            builder.store(new, count)
            if change < 0:
                with builder.if_then(builder.icmp_unsigned("==", new, word(0)), likely=False):
                    builder.call(release, [counted])
        builder.ret_void()
    return module


def _library_pass(library_class: type[JITCodeLibrary]) -> type[LoweringPass]:
    @register_pass(mutates_CFG=False, analysis_only=False)
    class SetLibrary(LoweringPass):
        _name = f"bem_library{library_class.__name__}"

        def __init__(self) -> None:
            LoweringPass.__init__(self)

        def run_pass(self, state: Any) -> bool:
            state.library = library_class(state.targetctx.codegen(), state.func_id.func_qualname)
            state.library.enable_object_caching()
            return False

    return SetLibrary


@register_pass(mutates_CFG=False, analysis_only=False)
class _SetEnvironments(LoweringPass):
    _name = "bem_set_environments"

    def __init__(self) -> None:
        LoweringPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        for variable in state.library._final_module.global_variables:
            if variable.name.startswith("_ZN08NumbaEnv") and (environment := lookup_environment(variable.name)):
                state.targetctx.codegen().set_env(variable.name, environment)
        return False


_AS_PART, _AS_WHOLE = _library_pass(_Part), _library_pass(_Whole)


def part_pipeline(state: Any) -> PassManager:
    """The passes that compile a function as a part."""
    passes = DefaultPassBuilder.define_nopython_pipeline(state)
    passes.add_pass_after(_AS_PART, AnnotateTypes)
    passes.finalize()
    return passes


def whole_pipeline(state: Any) -> PassManager:
    """The passes that compile a function which Python calls, with its parts."""
    passes = DefaultPassBuilder.define_nopython_pipeline(state)
    passes.add_pass_after(_AS_WHOLE, AnnotateTypes)
    passes.add_pass_after(_SetEnvironments, NativeLowering)
    passes.finalize()
    return passes
