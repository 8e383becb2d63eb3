"""Whole sessions on the simulator."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _arguments, _native
from ._record import Record, edge_table

Session = str | Path | Mapping[str, Any]
"""A session: a path, the name of a shipped one (`sessions`), or the fields of a session file."""


def run(
    session: Session,
    *,
    seed: int = 1,
    out: str | Path | None = None,
    all_edges: bool = False,
) -> Record:
    """Run a session on the simulator, as ``flexor run`` does.

    Args:
        session: Path, name of a shipped session, or fields.
        seed: Seed of the simulated wearer's noise, 0 to 2⁶⁴ − 1. The same seed gives the same
            bytes.
        out: Folder for the record, absent or empty; None keeps it in memory.
        all_edges: Whether the record keeps all edges, not only one period of them.

    Returns:
        The record. `Record.error` says why if the device ended the session.

    Raises:
        Refused: The session has mistakes; all of them are listed.
        FlexorError: The folder of the record holds something else.
    """
    folder = None if out is None else Path(out)
    return Record(_native.run(argument(session), _arguments.seed(seed), folder, all_edges))


def run_many(session: Session, seeds: Iterable[int]) -> list[Record]:
    """Run a session once per seed, on all cores. Each record equals that of `run`.

    Args:
        session: Path, name of a shipped session, or fields.
        seeds: Seeds of the simulated wearer's noise, 0 to 2⁶⁴ − 1.

    Returns:
        One record per seed, in the order of the seeds, in memory.

    Raises:
        Refused: The session has mistakes; all of them are listed.
    """
    numbers = [_arguments.seed(seed) for seed in seeds]
    return [Record(data) for data in _native.run_many(argument(session), numbers)]


def edges(session: Session, seconds: float, *, seed: int = 1) -> npt.NDArray[np.void]:
    """Return the edges of the first seconds of a session, as ``flexor edges`` writes them.

    Args:
        session: Path, name of a shipped session, or fields.
        seconds: Length in s, 0.001 to 3600.
        seed: Seed of the simulated wearer's noise.

    Returns:
        Structured array: t_us, channel, state (isolated, anodic, cathodic, grounded), dac_code.

    Raises:
        Refused: The session has mistakes.
        ValueError: The length is out of range.
    """
    seconds = _arguments.seconds("seconds", seconds)
    if not 0.001 <= seconds <= 3600:
        raise ValueError(f"seconds must be between 0.001 and 3600, not {seconds}")
    return edge_table(*_native.edges(argument(session), seconds, _arguments.seed(seed)))


def sessions() -> list[str]:
    """Return the names of the shipped sessions."""
    return _native.sessions()


def wearers() -> list[str]:
    """Return the names of the shipped wearers."""
    return _native.wearers()


def cite() -> str:
    """Return how to cite Flexor, as BibTeX, with the version."""
    from . import __version__

    return (
        "@software{flexor,\n"
        "  title = {Flexor: an open ten-channel wearable muscle stimulator},\n"
        "  author = {{The Flexor contributors}},\n"
        f"  version = {{{__version__}}},\n"
        "  year = {2026},\n"
        "}"
    )


def argument(session: Session) -> Path | dict[str, Any]:
    """Return a session as the extension takes it."""
    return dict(session) if isinstance(session, Mapping) else Path(session)
