"""Procedures with an operator: calibration, check of thresholds, and search."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from . import _arguments, _native
from ._errors import FlexorError

WATCH: ContextVar[Callable[[], None] | None] = ContextVar("WATCH", default=None)
"""Function that is called while a procedure runs, and ends it by an exception (`flexor.aio`)."""

Order = Literal["raise", "lower", "again", "yes", "no", "too-much", "enough", "skip", "abort"]
"""An order of a calibration's operator (docs/guides/calibrate.md). "abort" ends it."""


@dataclass(frozen=True)
class CalibrationView:
    """State of a calibration as an operator sees it. Levels are in `unit`.

    Attributes:
        electrode: Number of the present electrode in the plan, from 1.
        of: Number of electrodes in the plan.
        channel: Channel of the present electrode, from 1.
        place: Where the electrode is.
        unit: "mA" or "V".
        step: "placement", "threshold", "comfort", "minimum", "maximum" or "points".
        phase: "ready" (a level may be given unless a question is open), "on", "rest" or "done".
        left_s: Time until this phase ends in s; 0 if it does not end by itself.
        level: Level that was given last, or from which the step starts.
        given: Level that is given at this moment; 0 if there is none.
        raise_to: Level that "raise" would give; None if it is not possible.
        again: Level that "again" would give; None if it is not possible.
        top: Highest level that may be given at this electrode at present.
        orders: Orders that are possible now, besides "lower", "too-much", "skip" and "abort";
            "moves" stands for a list of names.
        question: Question that must be answered; None if none is open.
        confirms: Whether a movement was seen once, so that the same level must be given again.
        results: Results of the steps at this electrode so far, by name.
        reading_n: Reading of a simulated instrument in N; None without one.
        is_rested: Whether a simulated instrument was read long enough since the last level.
        moved: The simulated instrument's verdict on the last level; None if there is none.
        moving: What moved in the last presentation, if the wearer is simulated.
        complains: Whether a simulated wearer says that the level is too much.
        t_s: Device time since it was opened, s.
    """

    electrode: int
    of: int
    channel: int
    place: str
    unit: str
    step: str
    phase: str
    left_s: float
    level: float
    given: float
    raise_to: float | None
    again: float | None
    top: float
    orders: Sequence[str]
    question: str | None
    confirms: bool
    results: Mapping[str, Any]
    reading_n: float | None
    is_rested: bool
    moved: bool | None
    moving: Sequence[str]
    complains: bool
    t_s: float


CalibrationOperator = Callable[[CalibrationView], "Order | Sequence[str] | None"]
"""Operator of a calibration. It is called every 5 ms of device time, on a thread of its own, and
must return at once: an order, a list of names as the answer to what moved, or None."""

SearchOperator = Callable[[str, float, "float | None"], "int | bool | None"]
"""Operator of a search: a callable of the question, the level, and the level before. The question
is "raise" (may the level be given?), "moved" (did the joint move?) or "rating" (0 to 10). It is
called again and again, on a thread of its own, until it returns an answer instead of None."""


@dataclass(frozen=True)
class Calibration:
    """Result of a calibration or of a check.

    Attributes:
        path: The wearer file.
        simulated: Whether the wearer was simulated.
        device_s: Device time that was needed, s.
        presentations: Number of levels that were given.
        electrodes: For each electrode of the plan, its results by name: placement, threshold,
            limit, minimum, maximum, moves and is_skipped. Empty after a check.
        checks: For each electrode of the wearer file: channel, unit, frequency_hz, expected, found
            and accepted. Empty after a calibration.
    """

    path: Path
    simulated: bool
    device_s: float
    presentations: int
    electrodes: tuple[Mapping[str, Any], ...]
    checks: tuple[Mapping[str, Any], ...]


@dataclass(frozen=True)
class Finding:
    """Result of a search. Levels are in `unit`.

    Attributes:
        kind: "threshold", "visible", "ratio", "comfort" or "maximum".
        channels: Stimulated channels, from 1.
        unit: "mA", "V" or "of max".
        value: Middle of the interval; None if nothing was found.
        low: Highest level with a negative answer.
        high: Lowest level with a confirmed positive answer; None if there is none.
        set: Level to set; None if nothing was found.
        ended: "found", "limit", "refused" or "failed".
        presentations: Number of levels that were given.
        pulses: Number of pulses.
        false_alarm: Calculated probability that a movement is found where there is none.
        trail: For each presentation: level, repeat, pulses, positive and answer.
    """

    kind: str
    channels: Sequence[int]
    unit: str
    value: float | None
    low: float
    high: float | None
    set: float | None
    ended: str
    presentations: int
    pulses: int
    false_alarm: float
    trail: Sequence[Mapping[str, Any]]


def calibrate(
    plan: str | Path | Mapping[str, Any],
    out: str | Path,
    *,
    address: str = "sim:",
    operator: CalibrationOperator | None = None,
    listener: Callable[[Mapping[str, Any]], None] | None = None,
    name: str = "operator",
    wearer: Literal["array", "wrist", "still"] = "array",
    seed: int = 1,
    resume: bool = False,
    acknowledge: bool = False,
) -> Calibration:
    """Find thresholds, limits and motor points of electrodes, and write a wearer file.

    The procedure is that of ``flexor calibrate`` (docs/guides/calibrate.md): every raise needs an
    order of its own, a presentation ends by itself, and no level exceeds the ceiling of the plan,
    the wearer's limits or a level that was too much. If the operator takes longer than 0.2 s to
    return, the device hears no host and stops.

    Args:
        plan: Path of a plan (TOML), or its fields.
        out: Wearer file to write; its journal is written beside it.
        address: Address as for `connect`. "sim:" runs as fast as possible.
        operator: Gives the orders; None lets the simulated instrument answer, on simulators only.
        listener: Called with each entry of the journal (``entry``) and each order that was not
            carried out (``refused``).
        name: Pseudonym of the operator, for the files.
        wearer: Simulated wearer: a forearm under ten electrodes, a wrist on channel 1, or dummy
            loads. A device behind a port ignores it.
        seed: Seed of the simulated wearer.
        resume: Whether to continue at the end of the journal beside `out`.
        acknowledge: Whether a latched fault is acknowledged first, after you have found its cause.

    Returns:
        The results, which the wearer file also has.

    Raises:
        Refused: The plan has mistakes, or a file is in the way.
        DeviceFault: The device ended stimulation. `resume` continues.
        ConnectionLost: The device cannot be opened, or is lost.
        FlexorError: The operator ended the calibration, or a file cannot be written.
    """
    done = _native.calibrate(
        dict(plan) if isinstance(plan, Mapping) else Path(plan),
        Path(out),
        address=address,
        operator=None if operator is None else _orders_of(operator),
        listener=_lines_to(listener),
        name=name,
        wearer=wearer,
        seed=_arguments.seed(seed),
        resumes=resume,
        acknowledges=acknowledge,
        watch=WATCH.get(),
    )
    return _calibration(done)


def check_thresholds(
    file: str | Path,
    *,
    tolerance: float = 1.0,
    address: str = "sim:",
    operator: CalibrationOperator | None = None,
    listener: Callable[[Mapping[str, Any]], None] | None = None,
    name: str = "operator",
    wearer: Literal["array", "wrist", "still"] = "array",
    seed: int = 1,
    acknowledge: bool = False,
) -> Calibration:
    """Check whether the thresholds of a wearer file are still right, and add the result to it.

    Args:
        file: Wearer file.
        tolerance: Largest accepted change of a threshold in mA or V, 0.001 to 100.
        address: As for `calibrate`; likewise the other arguments.
        operator: Gives the orders.
        listener: Is called with entries and refused orders.
        name: Pseudonym of the operator.
        wearer: Simulated wearer.
        seed: Seed of the simulated wearer.
        acknowledge: Whether a latched fault is acknowledged first.

    Returns:
        The checks.

    Raises:
        Refused: The file has mistakes, or belongs to another kind of wearer.
        FlexorError: Thresholds have drifted (E682), or the check ended early.
    """
    done = _native.check_thresholds(
        Path(file),
        tolerance=_arguments.number("tolerance", tolerance),
        address=address,
        operator=None if operator is None else _orders_of(operator),
        listener=_lines_to(listener),
        name=name,
        wearer=wearer,
        seed=_arguments.seed(seed),
        acknowledges=acknowledge,
        watch=WATCH.get(),
    )
    return _calibration(done)


def search(
    file: str | Path | Mapping[str, Any],
    *,
    address: str = "sim:",
    operator: SearchOperator | None = None,
    seed: int = 1,
) -> list[Finding]:
    """Search a wearer's threshold, visible movement, ratio, comfort or maximum by a staircase.

    The procedure is that of ``flexor search`` (docs/guides/search.md).

    Args:
        file: Path of a search file, the name of a shipped one ("finger"), or its fields; a session
            in fields is relative to the present folder, or the name of a shipped one.
        address: Address as for `connect`. "sim:" runs as fast as possible.
        operator: Allows each raise and answers; required for a device behind a port. A simulator
            allows raises and answers by itself, and never calls the operator.
        seed: Seed of the simulated wearer's noise.

    Returns:
        A finding for each search of the file.

    Raises:
        Refused: The file has mistakes, or the operator did not allow a level (E536).
        DeviceFault: The device ended the search.
        ConnectionLost: The device cannot be opened, or is lost.

        The attribute `FlexorError.findings` of the exception has the results so far.
    """
    found, error = _native.run_searches(
        dict(file) if isinstance(file, Mapping) else Path(file),
        address=address,
        operator=None if operator is None else _answers_of(operator),
        seed=_arguments.seed(seed),
        watch=WATCH.get(),
    )
    findings = [Finding(**entry) for entry in json.loads(found)]
    if error is not None:
        if isinstance(error, FlexorError):
            error.findings = findings
        raise error
    return findings


def _calibration(text: str) -> Calibration:
    done = json.loads(text)
    return Calibration(
        path=Path(done["file"]),
        simulated=done["simulated"],
        device_s=done["device_s"],
        presentations=done["presentations"],
        electrodes=tuple(done.get("found", ())),
        checks=tuple(done.get("checks", ())),
    )


def _orders_of(operator: CalibrationOperator) -> Callable[[str], str | None]:
    def order(view: str) -> str | None:
        fields = json.loads(view)
        judged = fields.pop("judged")
        fields["moved"] = None if judged is None else judged["moved"]
        fields["raise_to"] = fields.pop("raise")
        fields["results"] = fields.pop("found")
        given = operator(CalibrationView(**fields))
        if given is None:
            return None
        if isinstance(given, str):
            return json.dumps({"order": given})
        if not isinstance(given, list | tuple):
            raise TypeError(
                f"the operator returned {given!r}; give an order such as 'raise', a list of names, "
                "or None"
            )
        return json.dumps({"order": "moves", "moves": list(given)})

    return order


def _answers_of(operator: SearchOperator) -> SearchOperator:
    def answer(question: str, level: float, before: float | None) -> int | None:
        given = operator(question, level, before)
        if given is None:
            return None
        is_yes_or_no = isinstance(given, bool | np.bool_)
        if question == "rating":
            return _arguments.whole_number("a rating", given, 10)
        if not is_yes_or_no:
            raise TypeError(f"the answer to {question!r} is True, False or None, not {given!r}")
        return int(given)

    return answer


def _lines_to(
    listener: Callable[[Mapping[str, Any]], None] | None,
) -> Callable[[str], None] | None:
    if listener is None:
        return None
    return lambda line: listener(json.loads(line))
