"""CasADi functions of scalars as LLVM's intermediate language, four poses to an instruction.

The instructions are those of the function, in its order and without contraction, so that compiled numbers are the
interpreted ones to the last bit.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable

import casadi as ca

from softnlp.native.kernels import B_ENDS, B_MIDDLE, WIDTH, Kernels, Step

LANES = 4
"""Poses to an instruction."""
_V = f"<{LANES} x double>"
_CALLED = "called_"
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


def splat(value: float) -> str:
    """Return a vector constant."""
    bits = struct.unpack("<Q", struct.pack("<d", value))[0]
    return f"<{', '.join([f'double 0x{bits:016X}'] * LANES)}>"


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

# Rows of vectors: combined, and moved between the arrays of all poses (rows, poses) and those of a few side by side.
_HEAD = f"""
declare {_V} @llvm.sqrt.v4f64({_V})
declare {_V} @llvm.fabs.v4f64({_V})
declare {_V} @llvm.floor.v4f64({_V})
"""


def _rows(name: str, arguments: str, body: str) -> str:
    """Return a function that does something for each row i of n."""
    return f"""
define internal void @{name}(i64 %n, {arguments}) {{
entry:
  br label %row
row:
  %i = phi i64 [0, %entry], [%next, %row]
{body}
  %next = add i64 %i, 1
  %more = icmp slt i64 %next, %n
  br i1 %more, label %row, label %done
done:
  ret void
}}
"""


def _at(word: str, array: str) -> str:
    return f"  %{word}_at = getelementptr {_V}, ptr %{array}, i64 %i\n"


def _read(*arrays: str) -> str:
    return "".join(_at(a, a) + f"  %{a}_i = load {_V}, ptr %{a}_at\n" for a in arrays)


def _write(value: str, array: str) -> str:
    return _at(array, array) + f"  store {_V} %{value}, ptr %{array}_at\n"


_PLACE = """  %down = mul i64 %i, %poses
  %across = add i64 %down, %first
  %there = getelementptr double, ptr %all, i64 %across
"""
_MOVES = "".join(
    [
        _rows("copy", "ptr %a, ptr %to", _read("a") + _write("a_i", "to")),
        _rows(
            "moved",
            f"ptr %x, {_V} %step, ptr %k, ptr %to",
            _read("x", "k") + f"  %far = fmul {_V} %step, %k_i\n  %sum = fadd {_V} %x_i, %far\n" + _write("sum", "to"),
        ),
        _rows(
            "weighed",
            f"ptr %x, {_V} %h, ptr %a, ptr %b, ptr %c, ptr %d, ptr %to",
            _read("x", "a", "b", "c", "d")
            + f"  %wa = fmul {_V} {splat(B_ENDS)}, %a_i\n  %wb = fmul {_V} {splat(B_MIDDLE)}, %b_i\n"
            + f"  %wc = fmul {_V} {splat(B_MIDDLE)}, %c_i\n  %wd = fmul {_V} {splat(B_ENDS)}, %d_i\n"
            + f"  %ab = fadd {_V} %wa, %wb\n  %abc = fadd {_V} %ab, %wc\n  %all = fadd {_V} %abc, %wd\n"
            + f"  %far = fmul {_V} %h, %all\n  %sum = fadd {_V} %x_i, %far\n"
            + _write("sum", "to"),
        ),
        _rows(
            "taken",
            "i64 %poses, i64 %first, ptr %all, ptr %to",
            _PLACE + f"  %v = load {_V}, ptr %there, align 8\n" + _write("v", "to"),
        ),
        _rows(
            "given",
            "i64 %poses, i64 %first, ptr %a, ptr %all",
            _PLACE + _read("a") + f"  store {_V} %a_i, ptr %there, align 8",
        ),
    ]
)


def llvm_text(kernels: Kernels) -> str | None:
    """Return a module with shoot_NAME(poses, intervals, data, state) for steps and apply_NAME(poses, given, found).

    poses is a multiple of `WIDTH`, intervals has an entry for each group of them, arrays are (rows, poses) of doubles.
    A step that is traced has trace_NAME(poses, intervals, data, state, path) too, path (intervals, rows, poses).
    None where a function holds an operation that has no translation.
    """
    parts: list[str | None] = [_HEAD, _MOVES, *(_lane_by_lane(name) for name in LIBRARY)]
    every = [f for step in kernels.steps.values() for f in step.functions.values()] + list(kernels.maps.values())
    called = {f.name(): f for function in every for f in function.find_functions()}
    called |= {f.name(): f for function in list(called.values()) for f in function.find_functions()}
    parts += [_function(_CALLED + name, function, alone=True) for name, function in called.items()]
    for name, step in kernels.steps.items():
        for part, function in step.functions.items():
            parts.append(_function(f"{name}_{part}", function))
        parts.append(_shoot(name, step))
        if name in kernels.traced:
            parts.append(_shoot(name, step, traced=True))
    for name, function in kernels.maps.items():
        parts += [_function(name, function), _apply(name, function)]
    made = [part for part in parts if part is not None]
    return "".join(made) if len(made) == len(parts) else None


def _lane_by_lane(name: str) -> str:
    """Return a function of the mathematical library for a vector."""
    takes = ("a", "b") if name == "pow" else ("a",)
    lines = [f"declare double @{name}({', '.join('double' for _ in takes)})"]
    lines.append(f"define internal {_V} @all_{name}({', '.join(f'{_V} %{t}' for t in takes)}) {{")
    before = "poison"
    for k in range(LANES):
        lines += [f"  %{t}{k} = extractelement {_V} %{t}, i32 {k}" for t in takes]
        lines.append(f"  %r{k} = call double @{name}({', '.join(f'double %{t}{k}' for t in takes)})")
        lines.append(f"  %v{k} = insertelement {_V} {before}, double %r{k}, i32 {k}")
        before = f"%v{k}"
    return "\n".join([*lines, f"  ret {_V} {before}", "}", ""])


def _function(name: str, function: ca.Function, *, alone: bool = False) -> str | None:
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
        lines += [f"  %{way}{k} = alloca [{len(rows)} x {_V}], align 32" for way, rows in rooms]
    registers: dict[int, str] = {}
    for k, operation in enumerate(operations):
        takes, gives = function.instruction_input(k), function.instruction_output(k)
        words = [registers.get(i, "") for i in takes]
        if operation == ca.OP_INPUT:
            lines.append(f"  %p{k} = getelementptr {_V}, ptr %x{takes[0]}, i64 {takes[1]}")
            lines.append(f"  %v{k} = load {_V}, ptr %p{k}")
        elif operation == ca.OP_OUTPUT:
            lines.append(f"  %p{k} = getelementptr {_V}, ptr %y, i64 {gives[1]}")
            lines.append(f"  store {_V} {words[0]}, ptr %p{k}")
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
            lines.append(f"  %c{k} = fcmp {how} {_V} {compared}")
            lines.append(f"  %v{k} = select <{LANES} x i1> %c{k}, {_V} {yes}, {_V} {no}")
        elif operation in _OPERATIONS:
            text = _OPERATIONS[operation].format(*words, V=_V)
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
        lines.append(f"  %i{k}_{i} = getelementptr {_V}, ptr %in{k}, i64 {i}")
        lines.append(f"  store {_V} {word}, ptr %i{k}_{i}")
    call = f"  call void @{_CALLED}{callee.name()}(ptr %in{k}, ptr %out{k})"
    places = [f"  %o{k}_{i} = getelementptr {_V}, ptr %out{k}, i64 {i}" for i in range(len(gives))]
    if callee.name() == REFINES:
        kept = words[-len(gives) :]
        lines += places
        lines += [f"  store {_V} {word}, ptr %o{k}_{i}" for i, word in enumerate(kept)]
        lines += [
            f"  %near{k} = fcmp olt {_V} {kept[-1]}, {splat(ENOUGH)}",
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
        lines.append(f"  %v{k}_{i} = load {_V}, ptr %o{k}_{i}")
        registers[register] = f"%v{k}_{i}"
    return lines


def _room(sizes: dict[str, int]) -> str:
    """Return arrays of vectors on the stack."""
    return "\n".join(f"  %{name} = alloca [{size} x {_V}], align 32" for name, size in sizes.items())


def _loop(body: Iterable[str]) -> str:
    """Return a loop over the poses, `LANES` at a time; first is the number of the first of them."""
    return "\n".join(
        [
            "  br label %some",
            "some:",
            "  %first = phi i64 [0, %entry], [%onward, %last]",
            *body,
            "  br label %last",
            "last:",
            f"  %onward = add i64 %first, {LANES}",
            "  %left = icmp slt i64 %onward, %poses",
            "  br i1 %left, label %some, label %end",
            "end:",
            "  ret void",
            "}",
            "",
        ]
    )


def _apply(name: str, function: ca.Function) -> str:
    size_in, size_out = function.size1_in(0), function.size1_out(0)
    return (
        f"define void @apply_{name}(i64 %poses, ptr %in, ptr %out) {{\nentry:\n"
        + _room({"x": size_in, "y": size_out})
        + "\n"
        + _loop(
            [
                f"  call void @taken(i64 {size_in}, i64 %poses, i64 %first, ptr %in, ptr %x)",
                f"  call void @{name}(ptr %x, ptr %y)",
                f"  call void @given(i64 {size_out}, i64 %poses, i64 %first, ptr %y, ptr %out)",
            ]
        )
    )


def _all(word: str, value: str) -> list[str]:
    """Return a vector of one number."""
    return [
        f"  %{word}_0 = insertelement {_V} poison, double %{value}, i32 0",
        f"  %{word} = shufflevector {_V} %{word}_0, {_V} poison, <{LANES} x i32> zeroinitializer",
    ]


def _shoot(name: str, step: Step, *, traced: bool = False) -> str:
    """Return the loop over poses and intervals of a step. traced : the state behind each interval is kept."""
    n, m = step.integrated, step.state
    same = f"  call void @copy(i64 {m}, ptr %here, ptr %x)"
    begin = same if step.begin is None else f"  call void @{name}_begin(ptr %here, ptr %data, ptr %at, ptr %x)"
    ended = f"  call void @{name}_end(ptr %here, ptr %reached, ptr %data, ptr %at, ptr %long, ptr %after)"
    ends = [ended, f"  call void @copy(i64 {m}, ptr %after, ptr %here)"]
    if step.end is None:
        ends = [f"  call void @copy(i64 {m}, ptr %reached, ptr %here)"]

    def rates(x: str, at: str, k: str) -> str:
        return f"  call void @{name}_rates(ptr %{x}, ptr %data, ptr %{at}, ptr %{k})"

    def moved(by: str, k: str) -> str:
        return f"  call void @moved(i64 {n}, ptr %x, {_V} %{by}, ptr %{k}, ptr %stage)"

    head = f"define void @shoot_{name}(i64 %poses, ptr %intervals, ptr %in, ptr %state) {{\nentry:\n"
    if traced:
        head = f"define void @trace_{name}(i64 %poses, ptr %intervals, ptr %in, ptr %state, ptr %path) {{\nentry:\n"
        ends += [
            f"  %size = mul i64 %poses, {m}",
            "  %block = mul i64 %k, %size",
            "  %kept = getelementptr double, ptr %path, i64 %block",
            f"  call void @given(i64 {m}, i64 %poses, i64 %first, ptr %here, ptr %kept)",
        ]
    rooms = {"data": step.data, "here": m, "after": m, "at": 1, "middle": 1, "far": 1, "long": 1}
    rooms |= dict.fromkeys(("x", "stage", "reached", "k1", "k2", "k3", "k4"), n)
    return (
        head
        + _room(rooms)
        + "\n"
        + _loop(
            [
                f"  %group = sdiv i64 %first, {WIDTH}",
                "  %count_at = getelementptr i64, ptr %intervals, i64 %group",
                "  %K = load i64, ptr %count_at",
                "  %K_real = sitofp i64 %K to double",
                "  %one = fdiv double 1.0, %K_real",
                *_all("h", "one"),
                f"  %half = fmul {_V} {splat(0.5)}, %h",
                f"  store {_V} %h, ptr %long",
                f"  call void @taken(i64 {step.data}, i64 %poses, i64 %first, ptr %in, ptr %data)",
                f"  call void @taken(i64 {m}, i64 %poses, i64 %first, ptr %state, ptr %here)",
                "  br label %interval",
                "interval:",
                "  %k = phi i64 [0, %some], [%k_next, %interval]",
                "  %k_real = sitofp i64 %k to double",
                "  %s_one = fmul double %k_real, %one",
                *_all("s", "s_one"),
                f"  %s_half = fadd {_V} %s, %half",
                f"  %s_far = fadd {_V} %s, %h",
                f"  store {_V} %s, ptr %at",
                f"  store {_V} %s_half, ptr %middle",
                f"  store {_V} %s_far, ptr %far",
                begin,
                rates("x", "at", "k1"),
                moved("half", "k1"),
                rates("stage", "middle", "k2"),
                moved("half", "k2"),
                rates("stage", "middle", "k3"),
                moved("h", "k3"),
                rates("stage", "far", "k4"),
                f"  call void @weighed(i64 {n}, ptr %x, {_V} %h, ptr %k1, ptr %k2, ptr %k3, ptr %k4, ptr %reached)",
                *ends,
                "  %k_next = add i64 %k, 1",
                "  %under_way = icmp slt i64 %k_next, %K",
                "  br i1 %under_way, label %interval, label %arrived",
                "arrived:",
                f"  call void @given(i64 {m}, i64 %poses, i64 %first, ptr %here, ptr %state)",
            ]
        )
    )
