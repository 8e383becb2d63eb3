"""Exceptions of the package, and how the extension makes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Mistake:
    """One reason for which something was refused.

    Attributes:
        message: Number, what is wrong and what to do, in one line.
        number: Number of the error; ``flexor explain E407`` explains it. None without a number.
        field: Argument or field of a session that is concerned; empty if none is.
        value: Value that was given, as text; None if the message does not name one.
        allowed: Allowed values, as text; None if the mistake is of another kind.
        remedy: What to do; None if the message says so.
    """

    message: str
    number: int | None = None
    field: str | None = None
    value: str | None = None
    allowed: str | None = None
    remedy: str | None = None


class FlexorError(Exception):
    """Base of all exceptions of this package.

    `str` gives all messages, one per line. `number`, `field`, `value`, `allowed` and `remedy` are
    those of the first mistake. Errors can be pickled. By itself, this class is raised for a call in
    the wrong order, a closed device, or a record that cannot be written.

    Attributes:
        mistakes: All reasons, at least one.
        findings: Results so far of `search` when it ended early; otherwise empty.
    """

    mistakes: tuple[Mistake, ...]
    findings: Sequence[Any] = ()

    def __init__(self, *mistakes: Mistake | str) -> None:
        """Create the exception from its mistakes; a text becomes a mistake without a field."""
        known = [m if isinstance(m, Mistake) else Mistake(m) for m in mistakes]
        self.mistakes = tuple(known) or (Mistake(type(self).__name__),)
        super().__init__(*self.mistakes)

    def __str__(self) -> str:
        """Return all messages, one per line."""
        return "\n".join(mistake.message for mistake in self.mistakes)

    def __reduce__(self) -> tuple[type[FlexorError], tuple[Mistake, ...]]:
        """Return what pickle needs."""
        return type(self), self.mistakes

    @property
    def number(self) -> int | None:
        """Number of the first mistake; None if it has none."""
        return self.mistakes[0].number

    @property
    def field(self) -> str | None:
        """Field or argument of the first mistake; None if it concerns none."""
        return self.mistakes[0].field or None

    @property
    def value(self) -> str | None:
        """Value of the first mistake, as text."""
        return self.mistakes[0].value

    @property
    def allowed(self) -> str | None:
        """Allowed values of the first mistake, as text."""
        return self.mistakes[0].allowed

    @property
    def remedy(self) -> str | None:
        """What to do about the first mistake."""
        return self.mistakes[0].remedy


class Refused(FlexorError, ValueError):
    """A value, a setup or a request was refused; stimulation goes on as before.

    It is also a `ValueError`. A value of the wrong type raises `TypeError`.
    """


class ArmRefused(FlexorError):
    """The device did not arm: an electrode, an input, its stages or its state is in the way.

    `field` says which, and `remedy` what to do. Nothing was stimulated above the test pulse.
    """


class DeviceFault(FlexorError):
    """The device ended stimulation by itself, for example because an electrode fell off.

    The record so far is kept: `Device.record`.
    """


class LeaseExpired(FlexorError):
    """No call came for the time of the lease, so stimulation was stopped.

    The next call raises it. Use ``dev.wait(5)`` instead of ``time.sleep(5)``.
    """


class ConnectionLost(FlexorError, ConnectionError):
    """The device cannot be opened, does not answer, or is gone.

    It is also a `ConnectionError`. A device that hears no host stops by itself after the host
    timeout.
    """


CLASSES: dict[str, type[FlexorError]] = {
    "refused": Refused,
    "arm": ArmRefused,
    "fault": DeviceFault,
    "lease": LeaseExpired,
    "lost": ConnectionLost,
    "error": FlexorError,
}


def build(kind: str, mistakes: list[dict[str, Any]]) -> FlexorError:
    """Return the exception that the extension asks for.

    Names of session fields and options of the command line become those of this package.
    """
    return CLASSES[kind](*(Mistake(**_renamed(entry)) for entry in mistakes))


_NAMES = (
    ("train.frequency_hz", "train.rate_hz"),
    (", or replace a record with --overwrite if the command has that option", ""),
    (", so --overwrite does not replace it", ""),
    (", or replace it with --overwrite", ""),
    ("(flexor run --acknowledge)", "(acknowledge())"),
    ("then run again with --acknowledge", "then call acknowledge()"),
    ("`program.ramp_", "`ramp_"),
    ("`wearer.rise_ms`", "`Limits.rise_ms`"),
    ("with --resume", "with resume=True"),
    ("with --acknowledge", "with acknowledge=True"),
    ("another --out", "another path"),
    ("another --device", "another address"),
    ("give --out of", "give the path of"),
    ("the same --device, --body and --seed", "the same address, wearer and seed"),
    ("--tolerance", "tolerance"),
)


def reworded(text: str) -> str:
    """Return a message with the names of this package."""
    for old, new in _NAMES:
        text = text.replace(old, new)
    return text


def _renamed(entry: dict[str, Any]) -> dict[str, Any]:
    texts = ("message", "field", "remedy")
    return {
        key: reworded(value) if key in texts and isinstance(value, str) else value
        for key, value in entry.items()
    }
