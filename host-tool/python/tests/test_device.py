"""The life of a device on the simulator."""

import csv
from pathlib import Path

import flexor
import numpy as np
import pytest
from helpers import (
    ROOT,
    TRAIN,
    assert_equal_tables,
    assert_same_samples,
    last,
    playing,
    prepared,
    running,
    table,
    without_prediction,
)


def test_ten_lines_to_a_session(tmp_path: Path) -> None:
    """The example of the package: states, readings, pulses and the record on disk."""
    with flexor.connect("sim:", record=tmp_path / "out", title="ten lines") as dev:
        assert (dev.state, dev.time_s, dev.record, dev.info) == ("idle", 0, None, None)
        dev.channel(1, TRAIN, limit_ma=12)
        readings = dev.arm()
        assert dev.state == "armed"
        assert list(readings) == [1]
        assert readings[1].current_ma == pytest.approx(readings[1].applied, rel=0.02)
        dev.start()
        assert dev.state == "running"
        dev.set(ma={1: 8})
        assert dev.wait(2) == pytest.approx(2, abs=0.002)
        assert dev.time_s >= 2
        assert last(dev, "amplitude_1_ma") == 8
        record = dev.stop()
        assert dev.state == "idle"
    assert dev.state == "closed"
    assert record is not None
    assert record.simulated
    assert record.pulses == pytest.approx(60, abs=2)
    assert record.error is None
    assert repr(record).startswith("<simulated trial 'ten lines'")
    assert_same_samples(record, table(tmp_path / "out", "samples.csv"))
    (loaded,) = flexor.Record.load(tmp_path / "out")
    assert (loaded.simulated, loaded.error) == (True, None)


def test_an_armed_device_outputs_no_pulse() -> None:
    """Setting up, arming and starting leave the amplitudes at zero."""
    with prepared(all_edges=True) as dev:
        dev.arm()
        dev.start()
        dev.wait(1)
        record = dev.stop()
    assert record is not None
    assert record.pulses == 0
    assert record.silent is not None
    assert len(record.edges) == 0


def test_wait_returns_device_time(dev: flexor.Device) -> None:
    """Waits add up, and none is shorter than asked for."""
    times = [dev.wait(0.1) for _ in range(10)]
    assert times == sorted(times)
    assert 1.0 <= times[-1] < 1.02
    assert dev.wait(0) == times[-1] == pytest.approx(dev.time_s, abs=1e-3)
    assert list(dev.steps(0.5, 0.1))[-1] == pytest.approx(times[-1] + 0.5, abs=0.01)


def test_wait_until_does_not_add_up(dev: flexor.Device) -> None:
    """The time of other calls is part of the wait; a time that has passed is no wait."""
    for turn in range(1, 11):
        dev.set(ma={1: 4})
        assert dev.wait_until(0.05 * turn) == pytest.approx(0.05 * turn, abs=0.002)
    now = dev.time_s
    assert dev.wait_until(0.1) == pytest.approx(now, abs=0.002)
    for t_s in (-1, float("nan"), 86_401):
        with pytest.raises(ValueError, match="between 0 and 86400 s"):
            dev.wait_until(t_s)


def test_two_trials_on_one_device(tmp_path: Path) -> None:
    """The second trial has its own time and record; both are on disk."""
    with prepared(record=tmp_path / "out") as dev:
        records = []
        for amplitude in (4, 6):
            dev.arm()
            dev.start()
            assert dev.time_s < 0.01
            dev.set(ma={1: amplitude})
            dev.wait(1)
            records.append(dev.stop())
    assert [np.nanmax(r.samples["amplitude_1_ma"]) for r in records if r] == [4, 6]
    loaded = flexor.Record.load(tmp_path / "out")
    assert len(loaded) == 2
    for kept, returned in zip(loaded, records, strict=True):
        assert returned is not None
        assert_equal_tables(kept.samples, returned.samples)
        assert kept.pulses == returned.pulses


def test_the_setup_may_change_between_trials() -> None:
    """A channel that is set up anew counts from the next arming on."""
    with prepared() as dev:
        dev.arm()
        dev.stop()
        dev.channel(1, flexor.Train(rate_hz=60, width_us=300), limit_ma=5)
        dev.channel(2, TRAIN, limit_ma=3)
        assert list(dev.arm()) == [1, 2]
        dev.start()
        with pytest.raises(flexor.Refused, match="5 mA"):
            dev.set(ma={1: 8})
        dev.set(ma={1: 4})
        dev.wait(1)
        record = dev.stop()
    assert record is not None
    assert record.pulses == pytest.approx(60, abs=3)
    assert "width_us = 300" in record.session_text


def test_duty_cycles_ramp_on_and_off() -> None:
    """Two channels alternate: the amplitude columns show pauses, ramps and plateaus."""
    with flexor.connect("sim:", all_edges=True) as dev:
        for number in (1, 2):
            dev.channel(number, TRAIN, limit_ma=12)
        dev.duty(1, on_s=2, off_s=2, ramp_s=0.5)
        dev.duty([2], on_s=2, off_s=2, ramp_s=0.5, delay_s=2)
        dev.arm()
        dev.start()
        dev.set(ma={1: 8, 2: 6})
        dev.wait(12)
        record = dev.stop()
    assert record is not None
    t, one, two = (record.samples[n] for n in ("t_s", "amplitude_1_ma", "amplitude_2_ma"))
    for at_s in (0, 4, 8):
        assert set(one[(t > at_s + 0.6) & (t < at_s + 1.5)]) == {8}
        # A blank is a channel without an amplitude.
        assert np.all(np.isnan(one[(t > at_s + 2.1) & (t < at_s + 3.9)]))
        up = one[(t > at_s + 0.1) & (t < at_s + 0.5)]
        assert np.all(np.diff(up) >= 0)
        assert np.median(up) == pytest.approx(4.5, abs=0.5)
        down = one[(t > at_s + 1.6) & (t < at_s + 1.9)]
        assert np.all(np.diff(down) <= 0)
        assert np.median(down) == pytest.approx(4, abs=0.5)
    assert set(two[(t > 2.6) & (t < 3.5)]) == {6}
    assert np.all(np.isnan(two[t < 1.9]))
    edges = record.edges
    for number, pause in ((1, (2.1, 3.9)), (2, (0, 1.9))):
        at_s = edges["t_us"][edges["channel"] == number] / 1e6
        assert not np.any((at_s > pause[0]) & (at_s < pause[1]))
        assert len(at_s) > 100


def test_a_duty_cycle_changes_while_it_plays(dev: flexor.Device) -> None:
    """A new amplitude holds for the present and the later cycles; zero ends them."""
    dev.stop()
    dev.duty(1, on_s=2, off_s=1, ramp_s=0.5)
    dev.arm()
    dev.start()
    dev.set(ma={1: 4})
    dev.wait(1)
    assert last(dev, "amplitude_1_ma") == 4
    dev.set(ma={1: 7})
    dev.wait(0.4)
    assert last(dev, "amplitude_1_ma") == 7
    dev.wait(1.2)
    assert np.isnan(last(dev, "amplitude_1_ma"))
    dev.set(ma={1: 0})
    dev.wait(1.5)
    assert np.isnan(last(dev, "amplitude_1_ma"))
    with pytest.raises(flexor.Refused, match="12 mA"):
        dev.set(ma={1: 13})


def test_a_stream_has_every_sample(dev: flexor.Device) -> None:
    """Rows of a stream are the rows of the record."""
    dev.set(ma={1: 8})
    rows = list(dev.stream(0.5))
    assert len(rows) == pytest.approx(50, abs=1)
    record = dev.stop()
    assert record is not None
    names = record.samples.dtype.names or ()
    assert rows[0].dtype.names == names
    times = [row["t_s"] for row in rows]
    begin = list(record.samples["t_s"]).index(times[0])
    kept = record.samples[begin : begin + len(rows)]
    for name in names:
        np.testing.assert_array_equal([row[name] for row in rows], kept[name], err_msg=name)


def test_the_time_between_samples() -> None:
    """Telemetry comes as often as `telemetry_ms` says."""
    with running(telemetry_ms=50) as dev:
        dev.wait(1)
        record = dev.record
    assert record is not None
    np.testing.assert_allclose(np.diff(record.samples["t_s"]), 0.05, atol=1e-6)


def test_marks_are_on_disk(tmp_path: Path) -> None:
    """A mark has its time, and its text as it was given."""
    texts = ["begin", 'a, "b"\nc', "naïve µ"]
    with running(record=tmp_path / "out") as dev:
        for text in texts:
            dev.wait(0.1)
            dev.mark(text)
        dev.stop()
    with table(tmp_path / "out", "markers.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    column = next(name for name in rows[0] if rows[0][name] == "begin")
    assert [row[column] for row in rows] == texts
    times = [float(row["t_s"]) for row in rows]
    assert times == pytest.approx([0.1, 0.2, 0.3], abs=0.01)


def test_events_say_that_the_program_stopped(dev: flexor.Device) -> None:
    """Events are those of the record."""
    dev.wait(0.1)
    assert list(dev.events()) == []
    record = dev.stop()
    assert record is not None
    assert [event.text for event in record.events] == ["stopping: Request", "stopped: Request"]
    assert record.events[0].t_s == pytest.approx(0.1, abs=0.01)


def test_a_trigger_plays_the_trains() -> None:
    """Nothing plays before the trigger; then each channel plays its ten pulses."""
    with playing("trigger", all_edges=True) as dev:
        dev.set(ma={1: 5, 2: 5})
        dev.wait(0.5)
        dev.trigger()
        dev.wait(0.5)
        record = dev.stop()
    assert record is not None
    assert record.pulses == 20
    assert record.edges["t_us"].min() >= 500_000


def test_reset_gives_a_rested_wearer() -> None:
    """After a reset the same calls give the same record; without one the time goes on."""

    def trial(dev: flexor.Device) -> flexor.Record:
        dev.arm()
        dev.start()
        dev.set(angle_deg=30)
        dev.wait(1)
        record = dev.stop()
        assert record is not None
        return record

    with flexor.connect(
        "sim:", session=without_prediction("hamana_exp4_two_point_finger"), seed=5
    ) as dev:
        first = trial(dev)
        second = trial(dev)
        dev.reset(5)
        third = trial(dev)
        dev.reset(6)
        fourth = trial(dev)
    assert_equal_tables(first.samples, third.samples)
    assert not np.array_equal(first.samples["measured_deg"], second.samples["measured_deg"])
    assert not np.array_equal(first.samples["measured_deg"], fourth.samples["measured_deg"])


def test_another_body_needs_a_reset() -> None:
    """The wearer goes on from trial to trial, so it cannot be another one."""
    with prepared() as dev:
        dev.arm()
        dev.stop()
        dev.body(kind="still", load_ohm=500)
        with pytest.raises(flexor.Refused, match="E777 .*reset"):
            dev.arm()
        dev.reset()
        dev.arm()
        assert dev.state == "armed"


def test_a_snapshot_goes_on_alone() -> None:
    """Copy and original take different amplitudes from the same state."""
    with playing("open_finger") as dev:
        dev.set(v={1: 28})
        dev.wait(0.5)
        with dev.snapshot() as copy:
            assert copy.state == "running"
            assert copy.time_s == dev.time_s
            dev.set(v={1: 0})
            dev.wait(0.5)
            assert copy.time_s == pytest.approx(0.5, abs=0.01)
            copy.wait(0.5)
            assert last(copy, "amplitude_1_v") == 28
            assert np.isnan(last(dev, "amplitude_1_v"))
            assert last(copy, "true_deg") != last(dev, "true_deg")
        assert (copy.state, dev.state) == ("closed", "running")


def test_a_snapshot_plays_as_its_original() -> None:
    """The same calls after the copy give the same samples."""
    with playing(without_prediction("hamana_exp4_two_point_finger"), seed=3) as dev:
        dev.set(angle_deg=20)
        dev.wait(0.5)
        copy = dev.snapshot()
        ends = []
        for each in (dev, copy):
            each.set(angle_deg=40)
            each.wait(0.5)
            ends.append(each.stop())
    assert ends[0] is not None
    assert ends[1] is not None
    assert_equal_tables(ends[0].samples, ends[1].samples)


def test_the_same_calls_give_the_same_bytes(tmp_path: Path) -> None:
    """A record depends on nothing but the calls and the seed."""

    def record(folder: Path) -> list[bytes]:
        session = without_prediction("hamana_exp4_two_point_finger")
        with flexor.connect("sim:", session=session, seed=9, record=folder) as dev:
            dev.arm()
            dev.start()
            for angle in (10, 30, 20):
                dev.set(angle_deg=angle)
                dev.wait(0.33)
                dev.mark(f"{angle}")
            dev.stop()
        names = ("samples.csv", "markers.csv", "edges.csv")
        return [table(folder, name).read_bytes() for name in names]

    assert record(tmp_path / "a") == record(tmp_path / "b")


def test_a_limit_of_the_wearer_file() -> None:
    """A channel takes its limit and name from the wearer file."""
    with flexor.connect("sim:", wearer="K01") as dev:
        dev.channel(1, flexor.Train(rate_hz=30, width_us=400))
        assert "wrist extensors" in dev.session_text
        dev.arm()
        dev.start()
        dev.set(ma={1: 12})
        with pytest.raises(flexor.Refused, match="12 mA"):
            dev.set(ma={1: 12.5})


def test_limits_of_the_call_are_kept() -> None:
    """A channel above the wearer's limit is refused when it is set up."""
    with flexor.connect("sim:", limits=flexor.Limits(max_current_ma=5)) as dev:
        with pytest.raises(flexor.Refused, match="at most 5 mA") as caught:
            dev.channel(1, TRAIN, limit_ma=12)
        assert (caught.value.number, caught.value.field) == (450, "channel.limit")
        dev.channel(1, TRAIN, limit_ma=5)
        dev.arm()


def test_the_session_text_sets_up_the_same(idle: flexor.Device, tmp_path: Path) -> None:
    """The text is a session file that the package reads again."""
    path = tmp_path / "mine.toml"
    path.write_text(idle.session_text)
    with flexor.connect("sim:", session=path) as again:
        assert again.session_text == idle.session_text
        assert list(again.arm()) == [1]


@pytest.mark.parametrize("session", ["endpoint_arm", "own/mine.toml"])
def test_the_wearer_file_of_a_session(
    session: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is relative to the session's folder, and its limits hold for new channels."""
    shipped = ROOT / "host-tool"
    text = (shipped / "sessions/endpoint_arm.toml").read_text()
    (tmp_path / "own").mkdir()
    (tmp_path / "own/mine.toml").write_text(text.replace("../wearers/arm-1", "w"))
    (tmp_path / "own/w.toml").write_text((shipped / "wearers/arm-1.toml").read_text())
    monkeypatch.chdir(tmp_path)
    with flexor.connect("sim:", session=session) as dev:
        dev.channel(1, flexor.Train(rate_hz=40, width_us=200, gap_us=50), full_scale_ma=50)
        assert 'name = "biceps"' in dev.session_text
        assert len(dev.arm()) == 9
