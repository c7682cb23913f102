"""Machine code from LLVM's intermediate language, made in memory by llvmlite; nothing is written or kept on disk."""

from __future__ import annotations

import ctypes
import os
from ctypes.util import find_library
from functools import lru_cache
from typing import Any

MOST_KEPT = 16
"""How many modules stay compiled in a process."""


class Machine:
    """A compiled module; its functions take whole numbers and addresses, and return nothing."""

    def __init__(self, engine: Any) -> None:
        self._engine = engine
        self._functions: dict[str, Any] = {}

    def call(self, name: str, poses: int, *arrays: Any) -> None:
        """Call a function by name with a number and arrays of NumPy, contiguous."""
        function = self._functions.get(name)
        if function is None:
            types = [ctypes.c_int64, *(ctypes.c_void_p for _ in arrays)]
            function = ctypes.CFUNCTYPE(None, *types)(self._engine.get_function_address(name))
            self._functions[name] = function
        function(poses, *map(_address, arrays))


def _address(array: Any) -> int:
    """Return where the numbers of an array are; asking NumPy takes four times as long."""
    try:
        return ctypes.addressof(ctypes.c_char.from_buffer(array))
    except (TypeError, ValueError):  # of an array that is read only, or empty
        return int(array.ctypes.data)


def can_compile() -> bool:
    """Whether there is something to compile with, and SOFTNLP_COMPILE is not 0."""
    return not why_interpreted()


def why_interpreted() -> str:
    """Return why nothing is compiled, "" where it is."""
    if os.environ.get("SOFTNLP_COMPILE") == "0":
        return "SOFTNLP_COMPILE is 0"
    try:
        import llvmlite.binding  # noqa: F401
    except ImportError:
        return "llvmlite is not installed"
    except OSError as error:  # a wheel that does not load
        return f"llvmlite cannot be loaded: {error}"
    return ""


@lru_cache(maxsize=MOST_KEPT)
def compiled(text: str, library: tuple[str, ...]) -> Machine:
    """Return the machine code of a module for this processor, from before where the text is the same.

    library : functions of the mathematical library that it calls.
    """
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    mathematics = ctypes.CDLL("ucrtbase" if os.name == "nt" else find_library("m"))
    for name in library:
        llvm.add_symbol(name, ctypes.cast(getattr(mathematics, name), ctypes.c_void_p).value)
    machine = llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=llvm.get_host_cpu_features().flatten(), opt=1
    )
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(text), machine)
    engine.finalize_object()
    return Machine(engine)
