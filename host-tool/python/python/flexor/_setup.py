"""The setup of a device as the fields of a session."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from . import _arguments, _native
from ._errors import Refused
from ._train import Limits, Muscle, Train, to_fields

_DAY_S = 86_400
_FULL_SCALE_MA = 100.0
_FULL_SCALE_V = 150.0
_LOAD_OHM = 2000.0
_SMALLEST = 0.05

# Setpoints of a complete session. They are not played, but a session without them is refused.
_KEEP_ALIVE = {"kind": "keep-alive", "rate_hz": 1000}
_NOTHING_HELD = {"kind": "held", "rate_hz": 60, "points": [{"at_s": 0.0, "held": False}]}
# Kinds of setpoints that decide how the device is set up.
_KINDS_WITH_SETUP = ("held", "endpoint-force")


class Setup:
    """Channels, joints and the other parts of a setup. A mistake leaves the setup as it was."""

    def __init__(
        self,
        session: str | Path | Mapping[str, Any] | None,
        wearer: str | Path | None,
        limits: Limits | None,
        title: str,
    ) -> None:
        """Begin with the fields of a session; see `flexor.connect` for the arguments."""
        self._fields = _session_fields(session, title)
        self._wearer: dict[str, Any] = {}
        self._duties: dict[int, dict[str, Any]] = {}
        if wearer is None:
            wearer = self._fields.get("wearer", {}).get("file")
        if wearer is not None or limits is not None:
            self._set_wearer(wearer, limits)

    def channel(
        self,
        number: int,
        train: Train,
        *,
        limit_ma: float | None = None,
        limit_v: float | None = None,
        name: str | None = None,
        start_ma: float | None = None,
        start_v: float | None = None,
        full_scale_ma: float | None = None,
        full_scale_v: float | None = None,
        load_ohm: float | None = None,
        area_mm2: float | None = None,
        muscle: Muscle | None = None,
        force: Mapping[str, Any] | None = None,
    ) -> None:
        """Set up a channel, or set it up anew. Nothing may be armed.

        Args:
            number: Number of the channel on the board, 1 to 10.
            train: Its pulses.
            limit_ma: Largest amplitude of a current stage in mA, 0.001 to 100. Required unless the
                wearer file has a limit for the channel, which this one cannot exceed.
            limit_v: Largest amplitude of a voltage stage in V, 0.001 to 150, likewise.
            name: Name of the muscle or place; by default the wearer file's, or the number.
            start_ma: Largest amplitude in mA that is reached at once, without the wearer's rise;
                by default the wearer file's, or 0.
            start_v: The same in V.
            full_scale_ma: Output of a current stage at its full code, 1 to 100 mA; by default what
                the board says, or 100 mA.
            full_scale_v: The same of a voltage stage, 1 to 150 V; by default what the board says,
                or 150 V.
            load_ohm: Load for which volts are judged against current limits, 200 to 100 000 Ω; by
                default 2000 Ω.
            area_mm2: Area of the active electrode, 10 to 20 000 mm²; by default the wearer file's,
                or 800 mm².
            muscle: Muscle whose force the device predicts.
            force: Force control on the device; fields of `[channel.force]`
                (docs/reference/sessions.md).

        Raises:
            Refused: With all mistakes of the channel. The setup stays as it was.
            TypeError: Limits of both kinds are given, or `train` is not a `Train`.
        """
        if limit_ma is not None and limit_v is not None:
            raise TypeError("give limit_ma for a current stage or limit_v for a voltage stage")
        if not isinstance(train, Train):
            raise TypeError(
                f"train must be a Train, such as Train(rate_hz=30, width_us=200), not {train!r}"
            )
        number = _arguments.whole(number)
        electrode = self._electrode(number)
        is_voltage = (
            limit_v is not None
            or full_scale_v is not None
            or (limit_ma is None and electrode.get("stage") == "voltage")
        )
        others = {"start_ma": start_ma, "full_scale_ma": full_scale_ma}
        if not is_voltage:
            others = {"start_v": start_v, "full_scale_v": full_scale_v, "load_ohm": load_ohm}
        if wrong := [name for name, value in others.items() if value is not None]:
            kind = "voltage" if is_voltage else "current"
            raise Refused(f"channel {number} has a {kind} stage, which has no {wrong[0]}")
        known = self._known_stage(number)
        stage: dict[str, Any]
        if is_voltage:
            stage = {
                "kind": "voltage",
                "full_scale_v": _first(full_scale_v, known.get("full_scale_v"), _FULL_SCALE_V),
                "load_ohm": _first(load_ohm, known.get("load_ohm"), _LOAD_OHM),
            }
        else:
            stage = {
                "kind": "current",
                "full_scale_ma": _first(full_scale_ma, known.get("full_scale_ma"), _FULL_SCALE_MA),
            }
        entry = {
            "number": number,
            "name": _first(name, electrode.get("place"), f"channel {number}"),
            "stage": stage,
            "limit": limit_v if is_voltage else limit_ma,
            "start": start_v if is_voltage else start_ma,
            "area_mm2": area_mm2,
            "train": train.to_fields(),
            "muscle": None if muscle is None else to_fields(muscle),
            "force": None if force is None else dict(force),
        }
        if entry["limit"] is None and "limit" not in electrode:
            raise Refused(
                f"channel {number} has no limit: give limit_ma=, or wearer= with a wearer file "
                "that has an electrode for the channel"
            )
        channels = [c for c in self._fields.get("channel", []) if c["number"] != number]
        self._try({"channel": [*channels, entry]})

    def duty(
        self,
        channel: int | Sequence[int],
        *,
        on_s: float,
        off_s: float,
        ramp_s: float | None = None,
        ramp_up_s: float | None = None,
        ramp_down_s: float | None = None,
        delay_s: float = 0.0,
    ) -> None:
        """Play channels in a duty cycle, from the start of the trains on.

        The amplitude while on is the one that `set` gives. A change of it takes up to 0.1 s. Call
        again to replace the cycle of a channel.

        Args:
            channel: A channel or several, which then play at the same time.
            on_s: Time from the start of the ramp up to the end of the ramp down, s, above 0.
            off_s: Pause, s, at least one period of the train.
            ramp_s: Length of both ramps, s; together at most `on_s`. None is the shortest that the
                wearer's rise allows (`Limits.rise_ms`, by default 0.5 s) upwards, and 0 downwards.
            ramp_up_s: Length of the ramp up, s, in place of `ramp_s`.
            ramp_down_s: Length of the ramp down, s, in place of `ramp_s`.
            delay_s: Time from the start of the trains to the first cycle, s.

        Raises:
            Refused: The cycle is not possible with the channel's train.
        """
        numbers = _arguments.channels(channel)
        cycle = {
            "kind": "on-off",
            "on_s": on_s,
            "off_s": off_s,
            "ramp_up_s": ramp_s if ramp_up_s is None else ramp_up_s,
            "ramp_down_s": ramp_s if ramp_down_s is None else ramp_down_s,
            "delay_s": delay_s,
        }
        duties = {**self._duties, **dict.fromkeys(numbers, cycle)}
        # A small amplitude: what the ramps need at the real one is checked when it is set.
        self._check({"program": self._programs(duties, dict.fromkeys(duties, _SMALLEST))})
        self._duties = duties

    def group(self, channels: Sequence[int], partner: Literal["conducted", "isolated"]) -> None:
        """Join channels of one muscle.

        Args:
            channels: Two channels or more; a channel is in one group at most.
            partner: State of the other channels while one of them pulses: "conducted" grounds
                them, "isolated" disconnects them.

        Raises:
            Refused: The channels cannot be a group.
        """
        groups = [*self._fields.get("group", []), {"channels": list(channels), "partner": partner}]
        self._try({"group": groups})

    def sync(self, channel: int) -> None:
        """Choose the channel whose first phases drive the sync output.

        Raises:
            Refused: The channel is not set up.
        """
        self._try({"sync": {"channel": channel}})

    def joint(self, **fields: Any) -> None:
        """Set up the joint whose angle the device controls; fields as `[joint]` of a session.

        The device then drives the channels of the joint, and `Device.set` refuses amplitudes for
        them. Set up its channels first.

        Raises:
            Refused: With all mistakes.
        """
        self._try({"joint": fields})

    def remove(self, part: Literal["joint", "wall", "endpoint", "modulation", "program"]) -> None:
        """Remove a part of the setup, for example the joint of a session, to control it yourself.

        Args:
            part: The part; of modulations and programs, all.

        Raises:
            Refused: Without the part the setup is not complete.
            ValueError: The setup has no such part.
        """
        key = "setpoints" if part == "endpoint" else part
        if key not in self._fields:
            raise ValueError(f"the setup has no {part}")
        self._ensure_idle("remove")
        rest = {name: value for name, value in self._fields.items() if name != key}
        _native.check(self._complete(rest))
        self._fields = rest

    def wall(self, **fields: Any) -> None:
        """Set up the virtual wall; fields as `[wall]` of a session.

        Raises:
            Refused: With all mistakes.
        """
        self._try({"wall": fields})

    def endpoint(self, **fields: Any) -> None:
        """Set up the force at the hand that `set(endpoint_n=...)` gives.

        The wearer file describes the arm. Fields are those of ``[setpoints]`` of kind
        ``endpoint-force`` (docs/reference/sessions.md), without ``points``: `rate_hz` (200) and
        `posture_deg`, or `stale_after_ms` if you `measure` the nine angles.

        Raises:
            Refused: With all mistakes.
        """
        rest = {"at_s": 0.0, "force_n": [0, 0, 0]}
        own = {"kind": "endpoint-force", "rate_hz": 200, "points": [rest], **fields}
        self._try({"setpoints": own})

    def modulation(self, **fields: Any) -> None:
        """Add a joint whose angle modulates its muscles; fields as `[[modulation]]` of a session.

        Raises:
            Refused: With all mistakes.
        """
        self._try({"modulation": [*self._fields.get("modulation", []), fields]})

    def program(self, **fields: Any) -> None:
        """Add amplitudes over time for channels; fields as `[[program]]` of a session.

        Raises:
            Refused: With all mistakes.
        """
        self._try({"program": [*self._fields.get("program", []), fields]})

    def body(self, **fields: Any) -> None:
        """Choose the simulated wearer; fields as `[body]` of a session. A board ignores it.

        Set up its channels first.

        Raises:
            Refused: With all mistakes.
        """
        self._try({"body": fields})

    @property
    def session_text(self) -> str:
        """Present setup as a session file.

        Raises:
            Refused: The setup is not complete.
        """
        return _native.check(self._complete(self._fields))[0]

    def _set_wearer(self, wearer: str | Path | None, limits: Limits | None) -> None:
        table: dict[str, Any] = dict(self._fields.get("wearer", {}))
        if wearer is not None:
            text = _native.wearer_text(str(wearer))
            self._wearer = tomllib.loads(text)
            table["file"] = str(wearer)
        if limits is not None:
            table.update(to_fields(limits))
        self._fields["wearer"] = table

    def _electrode(self, number: int) -> dict[str, Any]:
        for electrode in self._wearer.get("electrode", []):
            if electrode.get("channel") == number:
                return dict(electrode)
        return {}

    def _known_stage(self, number: int) -> dict[str, Any]:
        """Return fields of the channel's output stage, as far as the device has told them."""
        return {}

    def _complete(self, fields: dict[str, Any]) -> dict[str, Any]:
        longest = self._wearer.get("limits", {}).get("max_session_s", _DAY_S)
        own = fields.get("wearer", {}).get("max_session_s")
        default: dict[str, Any] = _NOTHING_HELD if fields.get("modulation") else _KEEP_ALIVE
        bounds = self._bounds(fields)
        if bounds:
            default = {**default, "bounds": bounds}
        return {
            **fields,
            "duration_s": min(longest, own if own is not None else longest),
            "setpoints": fields.get("setpoints", default),
        }

    def _bounds(self, fields: dict[str, Any]) -> list[dict[str, Any]]:
        """Return what may be set on channels with a muscle, from which its model is chosen."""
        bounds = []
        driven = _driven_channels(fields)
        for channel in fields.get("channel", []):
            limit = channel.get("limit") or self._electrode(channel["number"]).get("limit")
            is_free = channel.get("force") is None and channel["number"] not in driven
            if channel.get("muscle") is not None and is_free and limit:
                bounds.append({"channel": channel["number"], "least": 0, "most": limit})
        return bounds

    def _check(self, change: dict[str, Any]) -> None:
        _native.check(self._complete({**self._fields, **change}))

    def _ensure_idle(self, call: str) -> None:
        """Refuse a change that would not take effect until the device is armed again."""

    def _try(self, change: dict[str, Any]) -> None:
        self._ensure_idle(next(iter(change)))
        change = copy.deepcopy(change)
        self._check(change)
        self._fields.update(change)

    def _programs(
        self, duties: dict[int, dict[str, Any]], amplitudes: dict[int, float]
    ) -> list[dict[str, Any]]:
        own: list[dict[str, Any]] = list(self._fields.get("program", []))
        played = [
            {**cycle, "channels": [channel], "value": amplitudes[channel]}
            for channel, cycle in duties.items()
            if amplitudes.get(channel, 0) > 0
        ]
        return own + played


def _driven_channels(fields: dict[str, Any]) -> list[Any]:
    """Return the channels that a controller or a program drives, which take no amplitudes."""
    wall = fields.get("wall", {})
    entries = [wall, wall.get("co_contraction")]
    for joint in [fields.get("joint", {}), *fields.get("modulation", [])]:
        entries += [*joint.get("flexors", []), joint.get("flexor"), joint.get("extensor")]
    # A list, because a channel that is not yet checked may be anything.
    driven = [entry.get("channel") for entry in entries if isinstance(entry, Mapping)]
    for program in fields.get("program", []):
        driven += program.get("channels", [])
    return driven


def _first(*values: Any) -> Any:
    return next(value for value in values if value is not None)


def _session_fields(session: str | Path | Mapping[str, Any] | None, title: str) -> dict[str, Any]:
    if session is None:
        return {"title": title}
    if isinstance(session, Mapping):
        fields = copy.deepcopy(dict(session))
    else:
        fields = tomllib.loads(_native.session_text(str(session)))
        # The setup has no folder of its own, to which the wearer file would be relative.
        own = fields.get("wearer", {})
        if "file" in own and (path := Path(session).parent / own["file"]).exists():
            own["file"] = str(path)
    fields.setdefault("title", title)
    for unused in ("duration_s", "measure"):
        fields.pop(unused, None)
    if fields.get("setpoints", {}).get("kind") not in _KINDS_WITH_SETUP:
        fields.pop("setpoints", None)
    return fields
