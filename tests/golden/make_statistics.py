"""Golden values of host-core's `statistics`, by SciPy and statsmodels.

Run by hand where a function or a case is added; tests read the committed values
only. In a virtual environment, from the repository's root:

    pip install numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 statsmodels==0.15.0
    python tests/golden/make_statistics.py > tests/golden/statistics.json

Python 3.11. What neither package has is computed here from its definition, with
the source beside it: the estimates of sphericity and Cohen's d.
"""

import json

import numpy as np
import pandas as pd
from scipy import special, stats
from scipy.spatial.transform import Rotation
from statsmodels.formula.api import ols
from statsmodels.stats.anova import AnovaRM, anova_lm
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.proportion import proportion_confint

RNG = np.random.default_rng(20221114)
CASES = []


def case(function, given, expected):
    """One call: positional arguments and the numbers it must give."""
    plain = lambda x: x.tolist() if isinstance(x, np.ndarray) else x
    number = lambda x: plain(x) if isinstance(x, (list, np.ndarray)) else float(x)
    CASES.append(
        {
            "function": function,
            "given": [plain(x) for x in given],
            "expected": {name: number(x) for name, x in expected.items()},
        }
    )


def sample(*shape, spread=2.0, digits=3):
    return np.round(RNG.normal(10.0, spread, shape), digits)


def distributions():
    for df in [1, 2, 3, 4.5, 24, 100, 5000]:
        for t in [0.01, 0.358, 2.0, -6.47, 40.0]:
            case("student_t_p", [t, df], {"p": 2 * stats.t.sf(abs(t), df)})
    for effect in [0.4, 1, 3.3, 20]:
        for error in [0.7, 2, 24, 1000, 5000]:
            for f in [1e-3, 0.9, 4.3, 60.0]:
                case("fisher_f_p", [f, effect, error], {"p": stats.f.sf(f, effect, error)})
    for df in [1, 2, 7, 100]:
        for x in [0.01, 2.0, 20.0, 200.0]:
            case("chi_squared_p", [x, df], {"p": stats.chi2.sf(x, df)})


def pairs():
    for n, spread in [(2, 1.0), (4, 3.0), (15, 0.2), (200, 2.0)]:
        a, b = sample(n), sample(n, spread=spread)
        r = stats.ttest_rel(a, b)
        mean = (a - b).mean()
        case("paired_t", [a, b], {"mean_difference": mean, "t": r.statistic, "df": r.df, "p": r.pvalue})
        # Lakens 2013, eq. 6 and eq. 1.
        case("cohens_d_paired", [a, b], {"d": mean / (a - b).std(ddof=1)})
        c = sample(n + 3)
        pooled = ((n - 1) * a.var(ddof=1) + (n + 2) * c.var(ddof=1)) / (2 * n + 1)
        case("cohens_d_pooled", [a, c], {"d": (a.mean() - c.mean()) / np.sqrt(pooled)})
    for p in [[0.04], [0.01, 0.04, 0.03, 0.005], [0.3, 0.001, 0.001, 0.9, 0.02, 0.6], list(np.round(RNG.uniform(size=14), 4))]:
        case("holm", [p], {"adjusted": multipletests(p, method="holm")[1]})


def ranks():
    for n, k, digits in [(3, 4, 3), (4, 3, 0), (12, 5, 0), (30, 14, 1), (2, 3, 3)]:
        x = sample(n, k, digits=digits)
        r = stats.friedmanchisquare(*x.T)
        case("friedman", [x], {"chi_squared": r.statistic, "df": k - 1, "p": r.pvalue})
    every = stats.PermutationMethod(n_resamples=np.inf)
    # Up to 50 exact; with ties SciPy counts all signs or all choices.
    for n, digits, method in [
        (5, 3, "exact"), (9, 3, "exact"), (30, 3, "exact"), (50, 6, "exact"),
        (6, 0, every), (12, 0, every), (16, 0, every), (10, 1, every),
        (51, 3, "asymptotic"), (80, 0, "asymptotic"), (300, 1, "asymptotic"),
    ]:
        a, b = sample(n, digits=digits), np.round(sample(n, digits=digits) + 0.5 * (n > 20), digits)
        d = np.round(a - b, 6)
        a, b = d, np.zeros(n)
        assert method != "exact" or len(set(abs(d)) - {0.0}) == n
        r = stats.wilcoxon(a, b, correction=True, method=method)
        ranked = stats.rankdata(np.abs(d[d != 0]))
        positive = ranked[d[d != 0] > 0].sum()
        expected = {"statistic": min(positive, ranked.sum() - positive), "positive": positive, "n": len(ranked), "p": r.pvalue}
        case("wilcoxon", [a, b], expected | {"exact": len(ranked) <= 50})
    for n1, n2, digits, method in [
        (1, 3, 3, "exact"), (4, 4, 3, "exact"), (5, 7, 3, "exact"), (20, 30, 6, "exact"),
        (4, 7, 0, every), (6, 9, 0, every), (3, 20, 0, every),
        (25, 26, 3, "asymptotic"), (40, 60, 0, "asymptotic"), (5, 300, 1, "asymptotic"),
    ]:
        a, b = sample(n1, digits=digits), np.round(sample(n2, digits=digits) + 1, digits)
        assert method != "exact" or len(set([*a, *b])) == n1 + n2
        r = stats.mannwhitneyu(a, b, method=method, use_continuity=True)
        case("mann_whitney", [a, b], {"u": r.statistic, "p": r.pvalue, "exact": n1 + n2 <= 50})


def sphericity(contrasts, n):
    """Greenhouse and Geisser 1959 from the eigenvalues of the covariance of
    orthonormal contrasts (Winer 1971, ch. 7.3); Huynh and Feldt 1976."""
    d = contrasts.shape[1]
    roots = np.linalg.eigvalsh(np.atleast_2d(np.cov(contrasts.T)))
    gg = roots.sum() ** 2 / (d * (roots**2).sum())
    below = d * (n - 1 - d * gg)
    hf = 1.0 if below <= 1e-12 else min(1.0, (n * d * gg - 2) / below)
    return gg, hf


def helmert(k):
    """Orthonormal contrasts, a column each."""
    rows = [[1.0] * (i + 1) + [-(i + 1.0)] + [0.0] * (k - i - 2) for i in range(k - 1)]
    return np.array([np.array(r) / np.linalg.norm(r) for r in rows]).T


def repeated(row, contrasts, n):
    """A row of AnovaRM's table with both corrections."""
    gg, hf = sphericity(contrasts, n)
    df, error, f = row["Num DF"], row["Den DF"], row["F Value"]
    corrected = lambda e: stats.f.sf(f, e * df, e * error)
    return {
        "f": f, "df": df, "error_df": error, "p": row["Pr > F"],
        "gg": gg, "gg_p": corrected(gg), "hf": hf, "hf_p": corrected(hf),
    }


def named(prefix, values):
    return {f"{prefix}.{name}": value for name, value in values.items()}


def variance():
    for n, k in [(2, 2), (3, 4), (4, 14), (12, 3), (40, 6)]:
        x = np.round(sample(n, k) + sample(n, 1) + np.linspace(0, 2, k) * RNG.normal(1, 0.5, (n, 1)), 3)
        long = pd.DataFrame([(s, c, x[s, c]) for s in range(n) for c in range(k)], columns=["s", "c", "y"])
        row = AnovaRM(long, "y", "s", within=["c"]).fit().anova_table.loc["c"]
        case("repeated_measures", [x], repeated(row, x @ helmert(k), n))
    for n, a, b in [(3, 2, 2), (5, 2, 3), (4, 3, 5), (24, 4, 3)]:
        x = np.round(sample(n, a, b) + sample(n, 1, 1) + np.linspace(0, 2, b) * RNG.normal(1, 0.5, (n, 1, 1)), 3)
        long = pd.DataFrame(
            [(s, i, j, x[s, i, j]) for s in range(n) for i in range(a) for j in range(b)], columns=["s", "a", "b", "y"]
        )
        table = AnovaRM(long, "y", "s", within=["a", "b"]).fit().anova_table
        expected = named("first", repeated(table.loc["a"], x.mean(2) @ helmert(a), n))
        expected |= named("second", repeated(table.loc["b"], x.mean(1) @ helmert(b), n))
        both = x.reshape(n, a * b) @ np.kron(helmert(a), helmert(b))
        expected |= named("interaction", repeated(table.loc["a:b"], both, n))
        case("two_way_repeated", [x], expected)
    for a, b, n in [(2, 2, 2), (2, 3, 5), (4, 3, 10)]:
        x = np.round(sample(a, b, n) + np.arange(b)[None, :, None], 3)
        long = pd.DataFrame(
            [(i, j, v) for i in range(a) for j in range(b) for v in x[i, j]], columns=["a", "b", "y"]
        )
        table = anova_lm(ols("y ~ C(a, Sum) * C(b, Sum)", long).fit(), typ=2)
        expected = {}
        for name, term in [("first", "C(a, Sum)"), ("second", "C(b, Sum)"), ("interaction", "C(a, Sum):C(b, Sum)")]:
            row, error = table.loc[term], table.loc["Residual"]
            values = {"sum_squares": row["sum_sq"], "df": row["df"], "f": row["F"], "p": row["PR(>F)"]}
            values |= {"error_sum_squares": error["sum_sq"], "error_df": error["df"]}
            expected |= named(name, values)
        case("two_way", [x], expected)


def split_mix(seed, count):
    """`hal_sim::random::Random`: SplitMix64, word by word."""
    with np.errstate(over="ignore"):
        z = np.uint64(seed) + np.arange(1, count + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return z ^ (z >> np.uint64(31))


class Drawn:
    """What SciPy takes for a bootstrap that was drawn elsewhere."""

    def __init__(self, distribution):
        self.bootstrap_distribution = distribution


def intervals():
    for successes, trials in [(0, 10), (1, 1), (7, 1000), (150, 200), (200, 200)]:
        for level in [0.95, 0.99]:
            low, high = proportion_confint(successes, trials, alpha=1 - level, method="wilson")
            case("share", [successes, trials, level], {"share": successes / trials, "low": low, "high": high})
    # Summed one by one, as Rust does: ties with the statistic must stay ties.
    mean = lambda x, axis=-1: np.cumsum(x, axis=axis).take(-1, axis=axis) / x.shape[axis]
    median = lambda x, axis=-1: np.median(x, axis=axis)
    for name, statistic in [("mean", mean), ("median", median)]:
        for n, resamples, level, seed in [(5, 2000, 0.95, 1), (15, 999, 0.9, 7), (40, 2000, 0.99, 11)]:
            x = np.round(np.exp(RNG.normal(0, 0.8, n)), 3)
            index = split_mix(seed, resamples * n) % np.uint64(n)
            drawn = statistic(x[index.astype(int)].reshape(resamples, n))
            r = stats.bootstrap(
                (x,), statistic, n_resamples=0, bootstrap_result=Drawn(drawn), confidence_level=level, method="BCa"
            ).confidence_interval
            if np.isfinite([r.low, r.high]).all():
                expected = {"value": statistic(x), "low": r.low, "high": r.high}
                case(f"bootstrap_bca.{name}", [x, resamples, level, seed], expected)


def alignments():
    for n, kind in [(3, "turned"), (8, "noisy"), (30, "noisy"), (5, "flat"), (8, "mirrored"), (6, "thin")]:
        a = np.round(RNG.normal(0, 1, (n, 3)), 3)
        if kind == "flat":
            a[:, 2] = 0.0
        if kind == "thin":
            a[:, 1:] = np.round(a[:, 1:] * 0.01, 4)
        noise = RNG.normal(0, 0.1 if kind == "noisy" else 0.001, (n, 3))
        b = Rotation.random(rng=RNG).apply(a * ([1, 1, -1] if kind == "mirrored" else 1))
        b = np.round(b + noise + [3.0, -2.0, 0.5], 4)
        centre_a, centre_b = a.mean(0), b.mean(0)
        turn, _ = Rotation.align_vectors(b - centre_b, a - centre_a)
        # Not its root sum of squares, which is a difference of large sums.
        left = turn.apply(a - centre_a) - (b - centre_b)
        expected = {"rotation": turn.as_matrix(), "rmsd": np.sqrt((left**2).sum() / n)}
        case("kabsch", [a, b], expected | {"translation": centre_b - turn.apply(centre_a)})


for part in [distributions, pairs, ranks, variance, intervals, alignments]:
    part()
print("[\n" + ",\n".join(json.dumps(c, separators=(",", ":")) for c in CASES) + "\n]")
