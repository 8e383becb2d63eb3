"""Golden values of host-core's Shapiro-Wilk, Mauchly and Bonferroni.

Run by hand where a case is added; tests read the committed values only. In a virtual
environment, from the repository's root:

    pip install numpy==2.4.6 scipy==1.17.1 pingouin==0.7.0
    python tests/golden/make_normality.py > tests/golden/normality.json

Apart from make_statistics.py, whose draws must not move. SciPy takes normal quantiles of
seven digits (AS 111) for its weights, so that W and p agree to about seven.
"""

import json

import numpy as np
import pandas as pd
import pingouin
from scipy import stats

RNG = np.random.default_rng(2024)
CASES = []


def case(function, given, expected):
    CASES.append({"function": function, "given": given, "expected": expected})


for n in [3, 4, 5, 6, 8, 11, 12, 30, 200, 2000]:
    for kind in ["normal", "skew"]:
        x = RNG.normal(10.0, 2.0, n) if kind == "normal" else np.exp(RNG.normal(0, 1, n))
        x = np.round(x, 4)
        r = stats.shapiro(x)
        case("shapiro_wilk", x.tolist(), {"w": float(r.statistic), "p": float(r.pvalue)})

for n, k in [(8, 3), (5, 3), (12, 4), (30, 6), (8, 5)]:
    x = np.round(RNG.normal(0, 1, (n, k)) * np.linspace(1, 3, k) + RNG.normal(0, 2, (n, 1)), 4)
    r = pingouin.sphericity(pd.DataFrame(x), method="mauchly")
    expected = {"w": float(r.W), "chi_squared": float(r.chi2), "df": float(r.dof), "p": float(r.pval)}
    case("mauchly", x.tolist(), expected)

for m in [1, 3, 6]:
    p = np.round(RNG.uniform(0, 0.6, m), 4)
    case("bonferroni", p.tolist(), {"adjusted": pingouin.multicomp(p, method="bonf")[1].tolist()})

print("[\n" + ",\n".join(json.dumps(c, separators=(",", ":")) for c in CASES) + "\n]")
