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
    return whole_number("seed", value, _LARGEST_SEED)


def number(name: str, value: Any, unit: str = "") -> float:
    """Return a number. Truth values, texts and complex numbers are refused."""
    if type(value) is float:
        return value
    kind = getattr(getattr(value, "dtype", None), "kind", "f")
    if not isinstance(value, bool | str | bytes) and kind in "iuf":
        try:
            return float(value)
        except (TypeError, ValueError, OverflowError):
            pass
    raise TypeError(f"{name} must be a number{unit}, not {value!r}")


def whole_number(name: str, value: Any, most: int) -> int:
    """Return a whole number from 0 to `most`. Truth values are refused."""
    found = whole(value)
    if isinstance(found, bool | np.bool_) or not isinstance(found, int):
        raise TypeError(f"{name} must be a whole number, not {value!r}")
    if not 0 <= found <= most:
        raise ValueError(f"{name} must be between 0 and {most}, not {found}")
    return found


def pulse(value: Any) -> tuple[float, int, int]:
    """Return a pulse of a list: amplitude, width in µs, and delay in µs."""
    if not isinstance(value, tuple | list) or len(value) != 3:
        raise TypeError(f"a pulse is a tuple of amplitude, width and delay, not {value!r}")
    amplitude, width_us, delay_us = value
    return (
        number("the amplitude of a pulse", amplitude),
        whole_number("the width of a pulse", width_us, 2**16 - 1),
        whole_number("the delay of a pulse", delay_us, 2**32 - 1),
    )


def seconds(name: str, value: Any) -> float:
    """Return a time in s. Its range is checked where it is used."""
    return number(name, value, " of seconds")
