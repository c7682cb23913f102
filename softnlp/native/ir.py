"""What is done to many poses as a module of LLVM's intermediate language: loops over poses, intervals and passes."""

from __future__ import annotations

from collections.abc import Iterable

import casadi as ca

from softnlp.native.ir_functions import CALLED, LANES, LIBRARY, VECTOR, lane_by_lane, number, splat, vector_function
from softnlp.native.kernels import B_ENDS, B_MIDDLE, WIDTH, Kernels, Newton, Step

# Rows of vectors: combined, and moved between the arrays of all poses (rows, poses) and those of a few side by side.
_HEAD = f"""
declare {VECTOR} @llvm.sqrt.v4f64({VECTOR})
declare {VECTOR} @llvm.fabs.v4f64({VECTOR})
declare {VECTOR} @llvm.floor.v4f64({VECTOR})
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
    return f"  %{word}_at = getelementptr {VECTOR}, ptr %{array}, i64 %i\n"


def _read(*arrays: str) -> str:
    return "".join(_at(a, a) + f"  %{a}_i = load {VECTOR}, ptr %{a}_at\n" for a in arrays)


def _write(value: str, array: str) -> str:
    return _at(array, array) + f"  store {VECTOR} %{value}, ptr %{array}_at\n"


_PLACE = """  %down = mul i64 %i, %poses
  %across = add i64 %down, %first
  %there = getelementptr double, ptr %all, i64 %across
"""
_MOVES = "".join(
    [
        _rows("copy", "ptr %a, ptr %to", _read("a") + _write("a_i", "to")),
        _rows(
            "moved",
            f"ptr %x, {VECTOR} %step, ptr %k, ptr %to",
            _read("x", "k")
            + f"  %far = fmul {VECTOR} %step, %k_i\n  %sum = fadd {VECTOR} %x_i, %far\n"
            + _write("sum", "to"),
        ),
        _rows(
            "weighed",
            f"ptr %x, {VECTOR} %h, ptr %a, ptr %b, ptr %c, ptr %d, ptr %to",
            _read("x", "a", "b", "c", "d")
            + f"  %wa = fmul {VECTOR} {splat(B_ENDS)}, %a_i\n  %wb = fmul {VECTOR} {splat(B_MIDDLE)}, %b_i\n"
            + f"  %wc = fmul {VECTOR} {splat(B_MIDDLE)}, %c_i\n  %wd = fmul {VECTOR} {splat(B_ENDS)}, %d_i\n"
            + f"  %ab = fadd {VECTOR} %wa, %wb\n  %abc = fadd {VECTOR} %ab, %wc\n  %all = fadd {VECTOR} %abc, %wd\n"
            + f"  %far = fmul {VECTOR} %h, %all\n  %sum = fadd {VECTOR} %x_i, %far\n"
            + _write("sum", "to"),
        ),
        _rows(
            "taken",
            "i64 %poses, i64 %first, ptr %all, ptr %to",
            _PLACE + f"  %v = load {VECTOR}, ptr %there, align 8\n" + _write("v", "to"),
        ),
        _rows(
            "one",
            "ptr %a, ptr %all",
            _read("a")
            + f"  %v = extractelement {VECTOR} %a_i, i32 0\n  %there = getelementptr double, ptr %all, i64 %i\n"
            + "  store double %v, ptr %there",
        ),
        _rows(
            "given",
            "i64 %poses, i64 %first, ptr %a, ptr %all",
            _PLACE + _read("a") + f"  store {VECTOR} %a_i, ptr %there, align 8",
        ),
    ]
)


def llvm_text(kernels: Kernels) -> str | None:
    """Return a module with shoot_NAME(poses, intervals, data, state) for steps and apply_NAME(poses, given, found).

    poses is a multiple of `WIDTH`, intervals has an entry for each group of them, arrays are (rows, poses) of doubles.
    A step that is solved has solve_NAME(poses, intervals, data, base, end, state, path, passes) too, for one pose in
    all `LANES`: path (intervals, rows kept) are the states behind each interval, passes is 0 where none is found.
    None where a function holds an operation that has no translation.
    """
    parts: list[str | None] = [_HEAD, _MOVES, *(lane_by_lane(name) for name in LIBRARY)]
    every = [f for step in kernels.steps.values() for f in step.functions.values()] + list(kernels.maps.values())
    called = {f.name(): f for function in every for f in function.find_functions()}
    called |= {f.name(): f for function in list(called.values()) for f in function.find_functions()}
    parts += [vector_function(CALLED + name, function, alone=True) for name, function in called.items()]
    for name, step in kernels.steps.items():
        for part, function in step.functions.items():
            parts.append(vector_function(f"{name}_{part}", function))
        parts.append(_shoot(name, step))
        if name in kernels.solved:
            parts.append(_shoot(name, step, kept=kernels.solved[name].kept))
    for name, function in kernels.maps.items():
        parts += [vector_function(name, function), _apply(name, function)]
    for name, newton in kernels.solved.items():
        parts.append(_solve(name, kernels.steps[name], newton, kernels.maps[newton.update]))
    made = [part for part in parts if part is not None]
    return "".join(made) if len(made) == len(parts) else None


def _room(sizes: dict[str, int]) -> str:
    """Return arrays of vectors on the stack."""
    return "\n".join(f"  %{name} = alloca [{size} x {VECTOR}], align 32" for name, size in sizes.items())


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
        f"  %{word}_0 = insertelement {VECTOR} poison, double %{value}, i32 0",
        f"  %{word} = shufflevector {VECTOR} %{word}_0, {VECTOR} poison, <{LANES} x i32> zeroinitializer",
    ]


def _solve(name: str, step: Step, newton: Newton, update: ca.Function) -> str:
    """Return the passes of Newton's method for entries of the state at the base."""
    m, ends, count = step.state, update.size1_in(0) - step.state, update.size1_out(0) - 1
    changes = []
    for j in range(count):
        changes += [
            f"  %to{j} = getelementptr {VECTOR}, ptr %at_base, i64 {newton.first + j}",
            f"  %by{j} = getelementptr {VECTOR}, ptr %found, i64 {1 + j}",
            f"  %old{j} = load {VECTOR}, ptr %to{j}",
            f"  %change{j} = load {VECTOR}, ptr %by{j}",
            f"  %new{j} = fadd {VECTOR} %old{j}, %change{j}",
            f"  store {VECTOR} %new{j}, ptr %to{j}",
        ]
    given = "ptr %in, ptr %base, ptr %end, ptr %state, ptr %path, ptr %passes"
    lines = [
        f"define void @solve_{name}(i64 %poses, ptr %intervals, {given}) {{",
        "entry:",
        _room({"at_base": m, "seen": m + ends, "found": 1 + count}),
        f"  %after = getelementptr {VECTOR}, ptr %seen, i64 {m}",
        f"  call void @taken(i64 {m}, i64 {LANES}, i64 0, ptr %base, ptr %at_base)",
        f"  call void @taken(i64 {ends}, i64 {LANES}, i64 0, ptr %end, ptr %after)",
        "  br label %pass",
        "pass:",
        "  %k = phi i64 [1, %entry], [%k_next, %onward]",
        f"  call void @given(i64 {m}, i64 {LANES}, i64 0, ptr %at_base, ptr %state)",
        f"  call void @trace_{name}(i64 {LANES}, ptr %intervals, ptr %in, ptr %state, ptr %path)",
        f"  call void @taken(i64 {m}, i64 {LANES}, i64 0, ptr %state, ptr %seen)",
        f"  call void @{newton.update}(ptr %seen, ptr %found)",
        "  %size = load double, ptr %found",
        f"  %near = fcmp ole double %size, {number(newton.converged)}",
        "  br i1 %near, label %done, label %far",
        "far:",
        f"  %wild = fcmp uge double %size, {number(newton.hopeless)}",
        f"  %last = icmp eq i64 %k, {newton.most}",
        "  %stop = or i1 %wild, %last",
        "  br i1 %stop, label %done, label %onward",
        "onward:",
        *changes,
        "  %k_next = add i64 %k, 1",
        "  br label %pass",
        "done:",
        "  %spent = phi i64 [%k, %pass], [0, %far]",
        "  store i64 %spent, ptr %passes",
        f"  call void @given(i64 {m}, i64 {LANES}, i64 0, ptr %at_base, ptr %base)",
        "  ret void",
        "}",
        "",
    ]
    return "\n".join(lines)


def _shoot(name: str, step: Step, *, kept: int = 0) -> str:
    """Return the loop over poses and intervals of a step.

    kept : so many entries of the first pose's state are kept behind each interval.
    """
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
        return f"  call void @moved(i64 {n}, ptr %x, {VECTOR} %{by}, ptr %{k}, ptr %stage)"

    head = f"define void @shoot_{name}(i64 %poses, ptr %intervals, ptr %in, ptr %state) {{\nentry:\n"
    if kept:
        head = f"define void @trace_{name}(i64 %poses, ptr %intervals, ptr %in, ptr %state, ptr %path) {{\nentry:\n"
        ends += [
            f"  %block = mul i64 %k, {kept}",
            "  %kept = getelementptr double, ptr %path, i64 %block",
            f"  call void @one(i64 {kept}, ptr %here, ptr %kept)",
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
                f"  %half = fmul {VECTOR} {splat(0.5)}, %h",
                f"  store {VECTOR} %h, ptr %long",
                f"  call void @taken(i64 {step.data}, i64 %poses, i64 %first, ptr %in, ptr %data)",
                f"  call void @taken(i64 {m}, i64 %poses, i64 %first, ptr %state, ptr %here)",
                "  br label %interval",
                "interval:",
                "  %k = phi i64 [0, %some], [%k_next, %interval]",
                "  %k_real = sitofp i64 %k to double",
                "  %s_one = fmul double %k_real, %one",
                *_all("s", "s_one"),
                f"  %s_half = fadd {VECTOR} %s, %half",
                f"  %s_far = fadd {VECTOR} %s, %h",
                f"  store {VECTOR} %s, ptr %at",
                f"  store {VECTOR} %s_half, ptr %middle",
                f"  store {VECTOR} %s_far, ptr %far",
                begin,
                rates("x", "at", "k1"),
                moved("half", "k1"),
                rates("stage", "middle", "k2"),
                moved("half", "k2"),
                rates("stage", "middle", "k3"),
                moved("h", "k3"),
                rates("stage", "far", "k4"),
                f"  call void @weighed(i64 {n}, ptr %x, {VECTOR} %h, ptr %k1, ptr %k2, ptr %k3, ptr %k4, ptr %reached)",
                *ends,
                "  %k_next = add i64 %k, 1",
                "  %under_way = icmp slt i64 %k_next, %K",
                "  br i1 %under_way, label %interval, label %arrived",
                "arrived:",
                f"  call void @given(i64 {m}, i64 %poses, i64 %first, ptr %here, ptr %state)",
            ]
        )
    )
