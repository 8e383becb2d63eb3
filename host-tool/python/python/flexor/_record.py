"""Records of trials as arrays."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _native
from ._errors import reworded

if TYPE_CHECKING:
    import pandas as pd

STATES = np.array(["isolated", "anodic", "cathodic", "grounded"])
_EDGE = np.dtype([("t_us", "u8"), ("channel", "u1"), ("state", "U8"), ("dac_code", "u2")])


class Event(NamedTuple):
    """Something that the device reported.

    Attributes:
        t_s: Device time since the start of the trains, s.
        text: Description.
    """

    t_s: float
    text: str


class Marker(NamedTuple):
    """A row of `markers.csv`.

    Attributes:
        t_s: Device time since the start of the trains, s.
        kind: "mark" for `Device.mark`, "trigger" or "sync" for an edge of a line; "pause",
            "resume", "raise", "lower" or "stop" for an action at the controls of `flexor run`.
        channel: Channel of "raise" and "lower", from 1; otherwise None.
        text: Text of the mark.
    """

    t_s: float
    kind: str
    channel: int | None
    text: str


class Reading(NamedTuple):
    """Reading of the electrode check before arming.

    Attributes:
        channel: Number of the channel, from 1.
        applied: Amplitude of the test pulse, in the channel's unit.
        current_ma: Current that flowed, mA.
        load_ohm: Resistance of electrodes and skin, Ω. None on a current stage, which does not
            measure its voltage: there the current shows only that the electrodes are connected.
    """

    channel: int
    applied: float
    current_ma: float
    load_ohm: float | None


class Record:
    """Data of one trial, from the start of its trains to its stop.

    `samples`, `edges`, `events` and the other attributes are computed when they are first used.
    Simulated data say so: `simulated` is then True, and `repr` begins with "simulated".
    """

    def __init__(self, data: _native.Record) -> None:
        """Wrap the data of the extension; programs get records from `run`, `load` or `stop`."""
        self._data = data

    @classmethod
    def load(cls, folder: str | Path) -> list[Record]:
        """Read the record in `folder`, which this package or the program wrote: one per trial.

        Raises:
            FlexorError: There is no record, or it is damaged.
        """
        return [cls(data) for data in _native.Record.load(Path(folder))]

    @functools.cached_property
    def samples(self) -> npt.NDArray[np.void]:
        """Telemetry as a structured array with the columns of `samples.csv`.

        Numbers are the floats of the file's texts, NaN where a field is empty; `state` is a text.
        """
        return table_of(self._data.columns())

    @functools.cached_property
    def edges(self) -> npt.NDArray[np.void]:
        """Edges of a simulated device as a structured array.

        Columns: t_us (µs), channel, state (isolated, anodic, cathodic, grounded) and dac_code (code
        of the converter). With `all_edges` all of them, with times since the start of the trains.
        Otherwise those of one period: the first of those in which the most channels pulse, with
        times since its begin. Empty before the trial ends, and for a device behind a port.
        """
        return edge_table(*self._data.edges())

    @property
    def events(self) -> list[Event]:
        """What the device reported, in order of time."""
        return [Event(*event) for event in self._data.events]

    @property
    def electrodes(self) -> list[Reading]:
        """Readings of the electrode check before arming, one per channel."""
        return [Reading(*reading) for reading in self._data.electrodes]

    @property
    def markers(self) -> list[Marker]:
        """Marks and edges of the trigger input and the sync output."""
        return [Marker(*marker) for marker in self._data.markers]

    @property
    def counters(self) -> dict[str, int]:
        """Counters of the device during the trial, by name."""
        return self._data.counters

    @property
    def pulses(self) -> int | None:
        """Number of pulses that were output; None if that is not known."""
        return self._data.pulses

    @property
    def silent(self) -> str | None:
        """Reason why no pulse was output; None if there were pulses."""
        return self._data.silent

    @property
    def duration_s(self) -> float:
        """Length of the trial, s."""
        return self._data.duration_s

    @property
    def title(self) -> str:
        """Title of the trial."""
        return self._data.title

    @property
    def session_text(self) -> str:
        """Session file with which the device was set up."""
        return self._data.session_text

    @property
    def simulated(self) -> bool:
        """Whether the wearer was simulated. Simulation is no evidence about people."""
        return self._data.simulated

    @property
    def path(self) -> Path | None:
        """Folder of the record on disk; None if it is only in memory."""
        path = self._data.path
        return None if path is None else Path(path)

    @property
    def error(self) -> str | None:
        """Reason why the trial ended early; None if it ran to its end."""
        error = self._data.error
        return None if error is None else reworded(error)

    def to_pandas(self) -> pd.DataFrame:
        """Return the samples as a DataFrame (needs the extra `flexor-stim[pandas]`)."""
        import pandas as pd

        return pd.DataFrame(self.samples)

    def __reduce__(self) -> Any:
        """Refuse to be pickled: the data can be large, and a folder keeps them better."""
        raise TypeError(
            "a Record cannot be pickled; pickle its samples, or write it with out= or record= "
            "and read it with Record.load"
        )

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self._data)

    def __repr__(self) -> str:
        """Describe the record in one line."""
        kind = "simulated" if self.simulated else "recorded"
        pulses = "unknown" if self.pulses is None else self.pulses
        return (
            f"<{kind} trial {self.title!r}: {self.duration_s:g} s, {len(self)} samples, "
            f"{pulses} pulses>"
        )


def table_of(columns: list[tuple[str, Any]]) -> npt.NDArray[np.void]:
    """Join the columns of samples to one structured array."""
    kind = [(name, "U11" if name == "state" else "f8") for name, _ in columns]
    table = np.empty(len(columns[0][1]), dtype=kind)
    for name, values in columns:
        table[name] = values
    return table


def edge_table(
    t_us: npt.NDArray[Any],
    channel: npt.NDArray[Any],
    state: npt.NDArray[Any],
    dac_code: npt.NDArray[Any],
) -> npt.NDArray[np.void]:
    """Join the four columns of edges to one structured array."""
    table = np.empty(len(t_us), dtype=_EDGE)
    table["t_us"], table["channel"], table["dac_code"] = t_us, channel, dac_code
    table["state"] = STATES[state]
    return table
