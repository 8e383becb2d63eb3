"""Calibration, check and search with an operator in Python, beside the program."""

import asyncio
import json
import subprocess
import threading
import time
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import flexor
import pytest
from flexor import CalibrationView, aio
from helpers import ROOT
from test_tcp import served

PLAN: dict[str, Any] = {
    "wearer": "W01",
    "electrode": [{"channel": 1, "place": "flexor of the fingers", "ceiling": 20}],
}
ONE_SEARCH: dict[str, Any] = {
    "kind": "threshold",
    "channel": 1,
    "start": 16.0,
    "step": 4.0,
    "limit": 28.0,
}


class Answering:
    """An operator who follows the simulated instrument, written by hand as a user would."""

    def __init__(self) -> None:
        """Begin without a view."""
        self.views = 0
        self.last: CalibrationView | None = None

    def __call__(self, view: CalibrationView) -> Any:
        """Return the order for a view."""
        self.views += 1
        self.last = view
        if view.complains and view.given > 0:
            return "too-much"
        if view.question is not None:
            if view.step == "points":
                return list(view.moving)
            is_no = view.step in ("placement", "threshold") and not view.moved
            return "no" if is_no else "yes"
        if view.phase != "ready" or not view.is_rested:
            return None
        is_chosen = view.step in ("minimum", "maximum", "points")
        if view.again is not None and (is_chosen or view.confirms):
            return "again"
        return "skip" if view.raise_to is None else "raise"


def plan_file(folder: Path) -> Path:
    """Return the path of the plan as a file."""
    path = folder / "plan.toml"
    path.write_text(
        'wearer = "W01"\n'
        '[[electrode]]\nchannel = 1\nplace = "flexor of the fingers"\nceiling = 20\n'
    )
    return path


def test_the_file_of_the_program(program: Path, tmp_path: Path) -> None:
    """An operator in Python who decides as the program does writes the same wearer file."""
    plan = plan_file(tmp_path)
    there, here = tmp_path / "there.toml", tmp_path / "here.toml"
    command = [program, "calibrate", "--electrodes", plan, "--out", there, "--auto", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    printed = json.loads(done.stdout)
    operator = Answering()
    result = flexor.calibrate(plan, here, operator=operator)
    assert here.read_bytes() == there.read_bytes()
    assert operator.views > 1000
    assert (result.path, result.simulated, result.checks) == (here, True, ())
    assert result.presentations == printed["presentations"]
    assert list(result.electrodes) == printed["found"]
    assert tomllib.loads(here.read_text())["evidence"] == "simulated"


def test_the_instrument_answers(tmp_path: Path) -> None:
    """Without an operator the simulated instrument answers; the file can be used and checked."""
    entries: list[Mapping[str, Any]] = []
    result = flexor.calibrate(PLAN, tmp_path / "W01.toml", listener=entries.append)
    (electrode,) = result.electrodes
    assert electrode["threshold"] < electrode["limit"] <= 20
    assert any("entry" in entry for entry in entries)
    checked = flexor.check_thresholds(result.path)
    (check,) = checked.checks
    assert (check["channel"], check["unit"], check["accepted"]) == (1, "mA", True)
    assert "[[check]]" in result.path.read_text()
    with flexor.connect("sim:", wearer=result.path) as dev:
        dev.channel(1, flexor.Train(rate_hz=32, width_us=400))
        with pytest.raises(flexor.Refused):
            dev.channel(1, flexor.Train(rate_hz=32, width_us=400), limit_ma=20)
        dev.arm()


def test_a_drifted_threshold_is_refused(tmp_path: Path) -> None:
    """The check of a wearer whose muscle no longer moves raises an error that lists the channel."""
    result = flexor.calibrate(PLAN, tmp_path / "W01.toml")
    with pytest.raises(flexor.FlexorError) as caught:
        flexor.check_thresholds(result.path, wearer="still")
    assert caught.value.number == 682
    assert "channel 1" in str(caught.value)


def test_an_end_can_be_resumed(tmp_path: Path) -> None:
    """The operator ends the calibration; it goes on only when asked to, and gives the same file."""
    operator, out = Answering(), tmp_path / "W01.toml"

    def ends(view: CalibrationView) -> Any:
        return "abort" if view.step == "comfort" else operator(view)

    with pytest.raises(flexor.FlexorError) as caught:
        flexor.calibrate(PLAN, out, operator=ends)
    assert caught.value.number == 683
    assert "resume=True" in str(caught.value)
    with pytest.raises(flexor.Refused) as refused:
        flexor.calibrate(PLAN, out, operator=operator)
    assert refused.value.number == 672
    assert "--" not in str(refused.value)
    resumed = flexor.calibrate(PLAN, out, operator=operator, resume=True)
    (electrode,) = resumed.electrodes
    assert electrode["threshold"] < electrode["limit"]


def test_orders_that_are_none(tmp_path: Path) -> None:
    """Something else than an order, and an exception, end the calibration and reach the caller."""

    def explodes(view: CalibrationView) -> Any:
        raise ZeroDivisionError(view.step)

    wrong: list[tuple[Any, type[Exception]]] = [
        (lambda view: "up", TypeError),
        (lambda view: 1, TypeError),
        (explodes, ZeroDivisionError),
    ]
    for number, (operator, kind) in enumerate(wrong):
        with pytest.raises(kind):
            flexor.calibrate(PLAN, tmp_path / f"{number}.toml", operator=operator)
        assert not (tmp_path / f"{number}.toml").exists()


def test_an_order_at_the_wrong_time_is_reported(tmp_path: Path) -> None:
    """An order that is not possible now changes nothing, and the listener hears why."""
    messages: list[Mapping[str, Any]] = []
    operator = Answering()

    def hasty(view: CalibrationView) -> Any:
        return "raise" if view.phase == "rest" else operator(view)

    flexor.calibrate(PLAN, tmp_path / "W01.toml", operator=hasty, listener=messages.append)
    refused = [message["refused"] for message in messages if "refused" in message]
    assert refused and all(text.startswith("E671") for text in refused)


def test_bad_arguments_are_refused(tmp_path: Path) -> None:
    """Plans with mistakes, unknown names and a missing operator are refused by name."""
    out = tmp_path / "W01.toml"
    plan = {"wearer": "a b", "electrode": [{"channel": 11, "place": "", "ceiling": 200}]}
    with pytest.raises(flexor.Refused) as caught:
        flexor.calibrate(plan, out)
    assert caught.value.number == 670
    assert len(str(caught.value).splitlines()) >= 3  # all mistakes at once
    with pytest.raises(ValueError, match="array, wrist, still"):
        flexor.calibrate(PLAN, out, wearer="elbow")  # type: ignore[arg-type]
    for call in (
        lambda: flexor.calibrate(PLAN, out, address="tcp:127.0.0.1:1"),
        lambda: flexor.search("finger", address="tcp:127.0.0.1:1"),
    ):
        with pytest.raises(ValueError, match="needs operator="):
            call()
    with pytest.raises(ValueError, match="not an address"):
        flexor.search("finger", address="native")
    with pytest.raises(flexor.ConnectionLost):
        flexor.calibrate(PLAN, out, address="tcp:127.0.0.1:1", operator=Answering())
    with pytest.raises(ValueError, match="tolerance"):
        flexor.check_thresholds(out, tolerance=0)
    with pytest.raises(flexor.Refused):
        flexor.check_thresholds(tmp_path / "absent.toml")
    checked = flexor.calibrate(PLAN, tmp_path / "checked.toml").path
    before = checked.read_bytes()
    with pytest.raises(flexor.FlexorError) as unnamed:
        flexor.check_thresholds(checked, name="")
    assert unnamed.value.number == 670  # before anything is stimulated
    assert checked.read_bytes() == before
    assert not out.exists()


def test_the_findings_of_the_program(program: Path) -> None:
    """A search gives what the program prints."""
    command = [program, "search", "finger", "--seed", "4", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    wanted = json.loads(done.stdout)["searches"]
    findings = flexor.search("finger", seed=4)
    assert [vars(finding) for finding in findings] == wanted
    path = ROOT / "host-tool/searches/finger.toml"
    assert flexor.search(path, seed=4) == findings


def test_a_search_from_fields() -> None:
    """A search can be given as fields; mistakes are listed."""
    fields = {"session": "hamana_exp4_two_point_finger", "search": [ONE_SEARCH]}
    (finding,) = flexor.search(fields)
    assert (finding.kind, finding.channels, finding.unit) == ("threshold", [1], "V")
    assert finding.low < (finding.high or 0)
    wrong = {**ONE_SEARCH, "channel": 12, "step": -1}
    with pytest.raises(flexor.Refused) as caught:
        flexor.search({**fields, "search": [wrong]})
    assert caught.value.number == 527
    assert "channel" in str(caught.value) and "step" in str(caught.value)


def test_a_board_asks_before_each_raise(program: Path) -> None:
    """Behind a port each level needs a yes; a no ends the search and keeps what was found."""
    session = "hamana_exp4_two_point_finger"
    search = {**ONE_SEARCH, "observer": "eye", "rest_s": 1.0, "settle_ms": 100, "windows": 3}
    asked: list[tuple[str, float, float | None]] = []

    def operator(question: str, level: float, before: float | None) -> bool | None:
        if not asked or asked[-1] != (question, level, before):
            asked.append((question, level, before))
            return None  # an operator needs time to think
        return level < 20 if question == "raise" else False

    with served(program, session) as (address, _), pytest.raises(flexor.Refused) as caught:
        fields = {"session": session, "search": [search]}
        flexor.search(fields, address=address, operator=operator)
    assert caught.value.number == 536
    (finding,) = caught.value.findings
    assert (finding.ended, finding.low, finding.presentations) == ("refused", 16.0, 1)
    assert asked == [("raise", 16.0, 0.0), ("moved", 16.0, None), ("raise", 20.0, 16.0)]


@pytest.mark.parametrize("rating", [5.9, "3", -1, 11, True])
def test_a_rating_that_is_none(program: Path, rating: Any) -> None:
    """A rating is a whole number from 0 to 10; anything else ends the search."""
    session = "hamana_exp4_two_point_finger"
    search = {**ONE_SEARCH, "kind": "comfort", "rating": 5, "rest_s": 0.5, "settle_ms": 100}

    def operator(question: str, level: float, before: float | None) -> Any:
        return True if question == "raise" else rating

    with served(program, session) as (address, _), pytest.raises((TypeError, ValueError)):
        fields = {"session": session, "search": [search]}
        flexor.search(fields, address=address, operator=operator)


def test_an_operator_who_hangs_stops_the_device(program: Path, tmp_path: Path) -> None:
    """A callable that does not return keeps no device alive."""
    operator = Answering()

    def hangs(view: CalibrationView) -> Any:
        if view.phase == "on":
            time.sleep(1.5)
        return operator(view)

    with served(program, waits=False) as (address, _), pytest.raises(flexor.FlexorError) as caught:
        flexor.calibrate(PLAN, tmp_path / "W01.toml", address=address, operator=hangs)
    assert caught.value.number in (677, 697), str(caught.value)


def test_a_cancelled_calibration_has_ended(tmp_path: Path) -> None:
    """A cancelled call of asyncio ends the calibration before the cancellation goes on."""
    out = tmp_path / "W01.toml"
    before = threading.active_count()

    async def main() -> None:
        calibration = aio.calibrate(PLAN, out, address="sim:realtime", operator=Answering())
        await asyncio.wait_for(calibration, 0.5)

    with pytest.raises(TimeoutError):
        asyncio.run(main())
    assert threading.active_count() == before
    journal = Path(f"{out}.journal").read_text().splitlines()
    assert json.loads(journal[-1])["entry"].keys() == {"ended"}


def test_asyncio_gives_the_same(tmp_path: Path) -> None:
    """Procedures of asyncio return what the others return."""

    async def main() -> tuple[flexor.Calibration, list[flexor.Finding]]:
        calibration = await aio.calibrate(PLAN, tmp_path / "a.toml")
        await aio.check_thresholds(calibration.path)
        return calibration, await aio.search("finger", seed=4)

    calibration, findings = asyncio.run(main())
    assert findings == flexor.search("finger", seed=4)
    other = flexor.calibrate(PLAN, tmp_path / "b.toml")
    assert calibration.electrodes == other.electrodes
