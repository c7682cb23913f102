"""CasADi functions of scalars as LLVM's intermediate language, four poses to an instruction.

The instructions are those of the function, in its order and without contraction, so that compiled numbers are the
interpreted ones to the last bit.
"""

from __future__ import annotations

import struct

import casadi as ca

LANES = 4
"""Poses to an instruction."""
VECTOR = f"<{LANES} x double>"
CALLED = "called_"
REFINES, ENOUGH = "refine", 1e-6
"""A function that brings its last entries nearer to a solution, and their last change below which it is left out."""
_LIBRARY = {
    ca.OP_EXP: "exp",
    ca.OP_EXPM1: "expm1",
    ca.OP_LOG: "log",
    ca.OP_LOG1P: "log1p",
    ca.OP_SIN: "sin",
    ca.OP_COS: "cos",
    ca.OP_TAN: "tan",
    ca.OP_ASIN: "asin",
    ca.OP_ACOS: "acos",
    ca.OP_ATAN: "atan",
    ca.OP_SINH: "sinh",
    ca.OP_COSH: "cosh",
    ca.OP_TANH: "tanh",
    ca.OP_ASINH: "asinh",
    ca.OP_ACOSH: "acosh",
    ca.OP_ATANH: "atanh",
    ca.OP_ERF: "erf",
    ca.OP_POW: "pow",
    ca.OP_CONSTPOW: "pow",
}
LIBRARY = tuple(sorted(set(_LIBRARY.values())))
"""Functions of the mathematical library that the text may call, one pose at a time."""


def number(value: float) -> str:
    """Return a constant to its last bit."""
    bits = struct.unpack("<Q", struct.pack("<d", value))[0]
    return f"0x{bits:016X}"


def splat(value: float) -> str:
    """Return a vector constant."""
    return f"<{', '.join([f'double {number(value)}'] * LANES)}>"


_ZERO, _ONE = splat(0.0), splat(1.0)
_OPERATIONS = {
    ca.OP_ADD: "fadd {V} {0}, {1}",
    ca.OP_SUB: "fsub {V} {0}, {1}",
    ca.OP_MUL: "fmul {V} {0}, {1}",
    ca.OP_DIV: "fdiv {V} {0}, {1}",
    ca.OP_NEG: "fneg {V} {0}",
    ca.OP_SQ: "fmul {V} {0}, {0}",
    ca.OP_TWICE: "fadd {V} {0}, {0}",
    ca.OP_INV: f"fdiv {{V}} {_ONE}, {{0}}",
    ca.OP_SQRT: "call {V} @llvm.sqrt.v4f64({V} {0})",
    ca.OP_FABS: "call {V} @llvm.fabs.v4f64({V} {0})",
    ca.OP_FLOOR: "call {V} @llvm.floor.v4f64({V} {0})",
    **{
        operation: f"call {{V}} @all_{name}({{V}} {{0}}{', {V} {1}' if name == 'pow' else ''})"
        for operation, name in _LIBRARY.items()
    },
}
# A comparison, and what is chosen where it holds and where not.
_CHOICES = {
    ca.OP_LT: ("olt", "{0}, {1}", _ONE, _ZERO),
    ca.OP_LE: ("ole", "{0}, {1}", _ONE, _ZERO),
    ca.OP_EQ: ("oeq", "{0}, {1}", _ONE, _ZERO),
    ca.OP_NE: ("une", "{0}, {1}", _ONE, _ZERO),
    ca.OP_NOT: ("oeq", f"{{0}}, {_ZERO}", _ONE, _ZERO),
    ca.OP_IF_ELSE_ZERO: ("une", f"{{0}}, {_ZERO}", "{1}", _ZERO),
    ca.OP_FMIN: ("olt", "{0}, {1}", "{0}", "{1}"),
    ca.OP_FMAX: ("ogt", "{0}, {1}", "{0}", "{1}"),
}


def lane_by_lane(name: str) -> str:
    """Return a function of the mathematical library for a vector."""
    takes = ("a", "b") if name == "pow" else ("a",)
    lines = [f"declare double @{name}({', '.join('double' for _ in takes)})"]
    lines.append(f"define internal {VECTOR} @all_{name}({', '.join(f'{VECTOR} %{t}' for t in takes)}) {{")
    before = "poison"
    for k in range(LANES):
        lines += [f"  %{t}{k} = extractelement {VECTOR} %{t}, i32 {k}" for t in takes]
        lines.append(f"  %r{k} = call double @{name}({', '.join(f'double %{t}{k}' for t in takes)})")
        lines.append(f"  %v{k} = insertelement {VECTOR} {before}, double %r{k}, i32 {k}")
        before = f"%v{k}"
    return "\n".join([*lines, f"  ret {VECTOR} {before}", "}", ""])


def vector_function(name: str, function: ca.Function, *, alone: bool = False) -> str | None:
    """Return a function of scalars as one of vectors, (inputs, output) being arrays of them; None where it cannot.

    alone : whether it is called where it is needed and not made a part of what calls it.
    """
    operations = [function.instruction_id(k) for k in range(function.n_instructions())]
    arrays = "".join(f"ptr %x{k}, " for k in range(function.n_in()))
    lines = [f"define internal void @{name}({arrays}ptr %y) {'noinline ' if alone else ''}{{"]
    nodes = function.instructions_sx() if function.find_functions() else None
    calls = [] if nodes is None else [k for k in range(len(operations)) if operations[k] == ca.OP_CALL]
    for k in calls:
        rooms = (("in", function.instruction_input(k)), ("out", function.instruction_output(k)))
        lines += [f"  %{way}{k} = alloca [{len(rows)} x {VECTOR}], align 32" for way, rows in rooms]
    registers: dict[int, str] = {}
    for k, operation in enumerate(operations):
        takes, gives = function.instruction_input(k), function.instruction_output(k)
        words = [registers.get(i, "") for i in takes]
        if operation == ca.OP_INPUT:
            lines.append(f"  %p{k} = getelementptr {VECTOR}, ptr %x{takes[0]}, i64 {takes[1]}")
            lines.append(f"  %v{k} = load {VECTOR}, ptr %p{k}")
        elif operation == ca.OP_OUTPUT:
            lines.append(f"  %p{k} = getelementptr {VECTOR}, ptr %y, i64 {gives[1]}")
            lines.append(f"  store {VECTOR} {words[0]}, ptr %p{k}")
            continue
        elif operation == ca.OP_CONST:
            registers[gives[0]] = splat(float(function.instruction_constant(k)))
            continue
        elif operation == ca.OP_ASSIGN:
            registers[gives[0]] = words[0]
            continue
        elif operation == ca.OP_CALL and nodes is not None:
            if nodes[k].which_function().n_in() != 1:  # a derivative, which nothing here has
                return None
            lines += _call(k, nodes[k].which_function(), words, gives, registers)
            continue
        elif operation in _CHOICES:
            how, compared, yes, no = (part.format(*words) for part in _CHOICES[operation])
            lines.append(f"  %c{k} = fcmp {how} {VECTOR} {compared}")
            lines.append(f"  %v{k} = select <{LANES} x i1> %c{k}, {VECTOR} {yes}, {VECTOR} {no}")
        elif operation in _OPERATIONS:
            text = _OPERATIONS[operation].format(*words, V=VECTOR)
            if alone and text[0] == "f":  # only a start is found by it: it need not be the same to the last bit
                text = text.replace(" ", " contract ", 1)
            lines.append(f"  %v{k} = {text}")
        else:
            return None
        registers[gives[0]] = f"%v{k}"
    return "\n".join([*lines, "  ret void", "}", ""])


def _call(k: int, callee: ca.Function, words: list[str], gives: list[int], registers: dict[int, str]) -> list[str]:
    """Return the call of a function of one column at instruction k; its results are registers from then on.

    A function that refines is left out where the last entry of its column is below `ENOUGH` for all poses: its results
    are then those entries that stand at the end of the column.
    """
    lines = []
    for i, word in enumerate(words):
        lines.append(f"  %i{k}_{i} = getelementptr {VECTOR}, ptr %in{k}, i64 {i}")
        lines.append(f"  store {VECTOR} {word}, ptr %i{k}_{i}")
    call = f"  call void @{CALLED}{callee.name()}(ptr %in{k}, ptr %out{k})"
    places = [f"  %o{k}_{i} = getelementptr {VECTOR}, ptr %out{k}, i64 {i}" for i in range(len(gives))]
    if callee.name() == REFINES:
        kept = words[-len(gives) :]
        lines += places
        lines += [f"  store {VECTOR} {word}, ptr %o{k}_{i}" for i, word in enumerate(kept)]
        lines += [
            f"  %near{k} = fcmp olt {VECTOR} {kept[-1]}, {splat(ENOUGH)}",
            f"  %bits{k} = bitcast <{LANES} x i1> %near{k} to i{LANES}",
            f"  %all{k} = icmp eq i{LANES} %bits{k}, -1",
            f"  br i1 %all{k}, label %past{k}, label %more{k}",
            f"more{k}:",
            call,
            f"  br label %past{k}",
            f"past{k}:",
        ]
    else:
        lines += [call, *places]
    for i, register in enumerate(gives):
        lines.append(f"  %v{k}_{i} = load {VECTOR}, ptr %o{k}_{i}")
        registers[register] = f"%v{k}_{i}"
    return lines
