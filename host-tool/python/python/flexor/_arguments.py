"""Checks of arguments, for messages that name the argument and its unit."""

from __future__ import annotations

import operator
from collections.abc import Mapping
from typing import Any

import numpy as np

_LARGEST_SEED = 2**64 - 1


def by_channel(name: str, values: Any) -> dict[Any, Any] | None:
    """Return the values of a setpoint argument as a dictionary; None if it was left out."""
    if values is None:
        return None
    if not isinstance(values, Mapping):
        raise TypeError(
            f"{name} must be a dictionary from channel to value, such as {name}={{1: 8}}, "
            f"not {values!r}"
        )
    return dict(values)


def whole(value: Any) -> Any:
    """Return numpy's whole numbers as `int`, and everything else as it is."""
    if isinstance(value, bool | np.bool_) or not hasattr(value, "__index__"):
        return value
    try:
        return operator.index(value)
    except TypeError:  # an array with several elements
        return value


def channels(given: Any) -> list[Any]:
    """Return the numbers of a channel or of several channels."""
    one = whole(given)
    numbers = [one] if isinstance(one, int | float | str) else [whole(item) for item in given]
    if not numbers or any(isinstance(number, bool) for number in numbers):
        raise TypeError(f"channel must be a number from 1 to 10 or several of them, not {given!r}")
    return numbers


def seed(value: Any) -> int:
    """Return a seed, from 0 to 2^64 - 1."""
    number = whole(value)
    if isinstance(number, bool) or not isinstance(number, int):
        raise TypeError(f"seed must be a whole number, not {value!r}")
    if not 0 <= number <= _LARGEST_SEED:
        raise ValueError(f"seed must be between 0 and {_LARGEST_SEED}, not {number}")
    return number


def seconds(name: str, value: Any) -> float:
    """Return a time in s. Its range is checked where it is used."""
    if isinstance(value, bool | np.bool_ | str | bytes):
        raise TypeError(f"{name} must be a number of seconds, not {value!r}")
    try:
        return float(value)
    except TypeError:
        raise TypeError(f"{name} must be a number of seconds, not {value!r}") from None
