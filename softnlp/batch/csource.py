"""CasADi functions as C, eight poses to an instruction.

The statements are those of the function, in its order and without contraction, so that compiled numbers are the
interpreted ones to the last bit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

WIDTH = 8
"""Poses solved side by side."""

_HEAD = f"""\
#include <math.h>
#include <string.h>
#define WIDTH {WIDTH}
typedef double V __attribute__((vector_size(8 * WIDTH)));
#define LANES(expression) V r; for (int i = 0; i < WIDTH; ++i) r[i] = expression; return r;
static inline V all(double a) {{ LANES(a) }}
static inline V power(V a, V b) {{ LANES(pow(a[i], b[i])) }}
static inline V below(V a, V b) {{ LANES(a[i] < b[i]) }}
static inline V not(V a) {{ LANES(a[i] == 0) }}
static inline V where(V a, V b) {{ LANES(a[i] != 0 ? b[i] : 0) }}
static inline V least(V a, V b) {{ LANES(a[i] < b[i] ? a[i] : b[i]) }}
static inline V most(V a, V b) {{ LANES(a[i] > b[i] ? a[i] : b[i]) }}
"""

_SHOOT = """
void shoot_{name}(long long poses, const long long *intervals, const double *data, double *state) {{
  for (long long first = 0; first < poses; first += WIDTH) {{
    V given[{data}], here[{state}], next[{state}];
    long long K = intervals[first / WIDTH];
    V h = all(1.0 / K);
    for (int f = 0; f < {data}; ++f) memcpy(&given[f], data + f * poses + first, sizeof(V));
    for (int f = 0; f < {state}; ++f) memcpy(&here[f], state + f * poses + first, sizeof(V));
    for (long long k = 0; k < K; ++k) {{
      V s = all(k * (1.0 / K));
      {name}(here, given, &s, &h, next);
      memcpy(here, next, sizeof here);
    }}
    for (int f = 0; f < {state}; ++f) memcpy(state + f * poses + first, &here[f], sizeof(V));
  }}
}}
"""

_APPLY = """
void apply_{name}(long long poses, const double *given, double *found) {{
  for (long long first = 0; first < poses; first += WIDTH) {{
    V x[{size_in}], y[{size_out}];
    for (int f = 0; f < {size_in}; ++f) memcpy(&x[f], given + f * poses + first, sizeof(V));
    {name}(x, y);
    for (int f = 0; f < {size_out}; ++f) memcpy(found + f * poses + first, &y[f], sizeof(V));
  }}
}}
"""

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
    ca.OP_SQRT: "sqrt",
    ca.OP_FABS: "fabs",
}
_OPERATIONS = {
    ca.OP_ASSIGN: "{0}",
    ca.OP_ADD: "{0} + {1}",
    ca.OP_SUB: "{0} - {1}",
    ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}",
    ca.OP_NEG: "-{0}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "{0} + {0}",
    ca.OP_INV: "1.0 / {0}",
    ca.OP_LT: "below({0}, {1})",
    ca.OP_NOT: "not({0})",
    ca.OP_IF_ELSE_ZERO: "where({0}, {1})",
    ca.OP_FMIN: "least({0}, {1})",
    ca.OP_FMAX: "most({0}, {1})",
    ca.OP_POW: "power({0}, {1})",
    ca.OP_CONSTPOW: "power({0}, {1})",
    **{operation: f"all_{name}({{0}})" for operation, name in _LIBRARY.items()},
}


@dataclass(frozen=True, eq=False)
class Kernels:
    """What is done to many poses.

    steps : by name, functions (state, data, s, h) -> state a step h further. maps : functions of one column to another.
    """

    steps: Mapping[str, ca.Function]
    maps: Mapping[str, ca.Function]


def c_source(kernels: Kernels) -> str | None:
    """Return C with shoot_NAME(poses, intervals, data, state) for steps and apply_NAME(poses, given, found) for maps.

    poses is a multiple of `WIDTH`, intervals has an entry for each group of them, arrays are (fields, poses).
    None where a function holds an operation that has no translation.
    """
    parts = [_HEAD]
    parts += [f"static inline V all_{name}(V a) {{ LANES({name}(a[i])) }}\n" for name in _LIBRARY.values()]
    for name, function in {**kernels.steps, **kernels.maps}.items():
        body = _statements(function)
        if body is None:
            return None
        arguments = ", ".join(f"const V *x{k}" for k in range(function.n_in()))
        parts.append(f"static void {name}({arguments}, V *y) {{\n{body}}}\n")
    for name, step in kernels.steps.items():
        parts.append(_SHOOT.format(name=name, state=step.size1_in(0), data=step.size1_in(1)))
    for name, function in kernels.maps.items():
        parts.append(_APPLY.format(name=name, size_in=function.size1_in(0), size_out=function.size1_out(0)))
    return "".join(parts)


def _statements(function: ca.Function) -> str | None:
    """Return the instructions of a function of scalars as C statements, or None."""
    lines = [f"  V w{k};" for k in range(function.sz_w())]
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        takes, gives = function.instruction_input(k), function.instruction_output(k)
        if operation == ca.OP_INPUT:
            lines.append(f"  w{gives[0]} = x{takes[0]}[{takes[1]}];")
        elif operation == ca.OP_OUTPUT:
            lines.append(f"  y[{gives[1]}] = w{takes[0]};")
        elif operation == ca.OP_CONST:
            lines.append(f"  w{gives[0]} = all({float(function.instruction_constant(k)).hex()});")
        elif operation in _OPERATIONS:
            words = [f"w{i}" for i in takes]
            lines.append(f"  w{gives[0]} = {_OPERATIONS[operation].format(*words)};")
        else:
            return None
    return "\n".join(lines) + "\n"
