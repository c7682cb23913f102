#!/usr/bin/env bash
# SciPy's SLSQP reads a gradient that is a column of a table as if its entries lay side by side: it takes the next entry
# of memory for the next component, ends far from the minimum, and says that it was successful. A copy of the same
# numbers leads to the minimum; so do the other methods of `minimize` with the column itself. Up to 1.15 SLSQP did too.
#
# Versions: SciPy 1.15.3 and 1.17.1, NumPy 2.4.6; Python 3.11.
# Seen:
#   1.15.3 SLSQP, a column of a table: x = 1.00, 2.00, success True
#   1.17.1 SLSQP, a column of a table: x = 0.00, 0.00, success True
#   1.17.1 SLSQP, its copy: x = 1.00, 2.00, success True
#   1.17.1 L-BFGS-B, a column of a table: x = 1.00, 2.00, success True
# The script ends with 1 when this is no longer so.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat > "$folder/program.py" <<'PYTHON'
import sys

import numpy as np
import scipy
from scipy.optimize import minimize


def objective(x):
    return (x[0] - 1) ** 2 + 10 * (x[1] - 2) ** 2


def column(x):
    table = np.full((2, 2), 7.0)
    table[:, 0] = 2 * (x[0] - 1), 20 * (x[1] - 2)
    return table[:, 0]


def copied(x):
    return column(x).copy()


for method, gradient in (("SLSQP", column), ("SLSQP", copied), ("L-BFGS-B", column))[: int(sys.argv[1])]:
    found = minimize(objective, [0.0, 0.0], jac=gradient, method=method)
    x = ", ".join(f"{abs(value):.2f}" for value in found.x)
    what = "a column of a table" if gradient is column else "its copy"
    print(f"{scipy.__version__} {method}, {what}: x = {x}, success {found.success}")
PYTHON
for version in 1.15.3:1 1.17.1:3; do
    python3 -m venv "$folder/${version%:*}"
    "$folder/${version%:*}/bin/pip" install --quiet --disable-pip-version-check "scipy==${version%:*}" numpy==2.4.6
    "$folder/${version%:*}/bin/python" "$folder/program.py" "${version#*:}" >> "$folder/seen.txt"
done
cat "$folder/seen.txt"
diff "$folder/seen.txt" - <<'SEEN' || exit 1
1.15.3 SLSQP, a column of a table: x = 1.00, 2.00, success True
1.17.1 SLSQP, a column of a table: x = 0.00, 0.00, success True
1.17.1 SLSQP, its copy: x = 1.00, 2.00, success True
1.17.1 L-BFGS-B, a column of a table: x = 1.00, 2.00, success True
SEEN
