"""Statistical tests with which Flexor's own results are judged. They are checked against SciPy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from . import _native


class PairedT(NamedTuple):
    """Result of a paired t-test: mean difference, t, degrees of freedom, two-sided p."""

    mean_difference: float
    t: float
    df: int
    p: float


class Wilcoxon(NamedTuple):
    """Result of a Wilcoxon signed-rank test: statistic, pairs that differ, two-sided p."""

    statistic: float
    n: int
    p: float


class MannWhitney(NamedTuple):
    """Result of a Mann–Whitney test: U of the first sample, two-sided p."""

    u: float
    p: float


class Friedman(NamedTuple):
    """Result of a Friedman test: chi-squared, degrees of freedom, p."""

    chi_squared: float
    df: int
    p: float


class ShapiroWilk(NamedTuple):
    """Result of a Shapiro–Wilk test: W, p."""

    w: float
    p: float


class Share(NamedTuple):
    """A share with its interval, 0 to 1."""

    share: float
    low: float
    high: float


def paired_t(first: Sequence[float], second: Sequence[float]) -> PairedT:
    """Compare two conditions of the same subjects by a paired t-test.

    Raises:
        ValueError: The samples have different lengths, or too few values.
    """
    return PairedT(*_native.paired_t(list(first), list(second)))


def wilcoxon(first: Sequence[float], second: Sequence[float]) -> Wilcoxon:
    """Compare two conditions of the same subjects by Wilcoxon's signed-rank test.

    Raises:
        ValueError: The samples have different lengths, or all pairs are equal.
    """
    return Wilcoxon(*_native.wilcoxon(list(first), list(second)))


def mann_whitney(first: Sequence[float], second: Sequence[float]) -> MannWhitney:
    """Compare two independent samples by the Mann–Whitney test.

    Raises:
        ValueError: A sample is empty.
    """
    return MannWhitney(*_native.mann_whitney(list(first), list(second)))


def friedman(subjects: Sequence[Sequence[float]]) -> Friedman:
    """Compare several conditions of the same subjects, one row per subject.

    Raises:
        ValueError: Rows have different lengths, or there are too few.
    """
    return Friedman(*_native.friedman([list(row) for row in subjects]))


def shapiro_wilk(sample: Sequence[float]) -> ShapiroWilk:
    """Test a sample for normality.

    Raises:
        ValueError: The sample has too few or too many values, or all are equal.
    """
    return ShapiroWilk(*_native.shapiro_wilk(list(sample)))


def holm(p: Sequence[float]) -> list[float]:
    """Correct p-values of several tests by Holm's method.

    Raises:
        ValueError: A value is not between 0 and 1.
    """
    return _native.holm(list(p))


def wilson_share(successes: float, trials: int, level: float = 0.95) -> Share:
    """Return a share of successes with its Wilson interval.

    Args:
        successes: Number of successes, at most `trials`.
        trials: Number of trials, at least 1.
        level: Level of the interval, between 0 and 1.

    Raises:
        ValueError: A number is out of range.
    """
    return Share(*_native.wilson_share(successes, trials, level))
