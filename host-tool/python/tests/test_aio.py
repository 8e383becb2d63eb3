"""flexor.aio: the same calls without blocking, and a cancellation that stops first."""

import asyncio
from pathlib import Path

import flexor
import numpy as np
import pytest
from flexor import aio
from helpers import TRAIN, assert_equal_tables, running


def test_the_life_of_a_device(tmp_path: Path) -> None:
    """The record equals that of the calls that block."""

    async def main() -> flexor.Record | None:
        async with aio.connect("sim:", record=tmp_path / "out") as dev:
            dev.channel(1, TRAIN, limit_ma=12)
            readings = await dev.arm()
            assert list(readings) == [1]
            assert dev.state == "armed"
            await dev.start()
            await dev.set(ma={1: 8})
            assert await dev.wait(1) >= 1
            await dev.mark("here")
            assert dev.time_s >= 1
            return await dev.stop()

    record = asyncio.run(main())
    assert record is not None
    with running() as dev:
        dev.set(ma={1: 8})
        dev.wait(1)
        dev.mark("here")
        wanted = dev.stop()
    assert wanted is not None
    assert_equal_tables(record.samples, wanted.samples)
    (loaded,) = flexor.Record.load(tmp_path / "out")
    assert loaded.error is None


def test_a_stream() -> None:
    """`async for` gives the samples one by one."""

    async def main() -> list[float]:
        async with aio.connect("sim:") as dev:
            dev.channel(1, TRAIN, limit_ma=12)
            await dev.arm()
            await dev.start()
            return [row["t_s"] async for row in dev.stream(0.3)]

    times = asyncio.run(main())
    assert len(times) == pytest.approx(30, abs=1)
    np.testing.assert_allclose(np.diff(times), 0.01, atol=1e-6)


def test_the_event_loop_goes_on() -> None:
    """Another task runs while the device waits."""

    async def main() -> int:
        turns = 0

        async def count() -> None:
            nonlocal turns
            while True:
                turns += 1
                await asyncio.sleep(0)

        async with aio.connect("sim:realtime") as dev:
            dev.channel(1, TRAIN, limit_ma=12)
            await dev.arm()
            await dev.start()
            counting = asyncio.create_task(count())
            await dev.wait(0.2)
            counting.cancel()
        return turns

    assert asyncio.run(main()) > 10


@pytest.mark.parametrize("address", ["sim:", "sim:realtime"])
def test_a_cancelled_wait_stops_first(address: str) -> None:
    """The device is idle when the cancellation arrives."""

    async def main() -> tuple[str, bool, flexor.Record | None]:
        async with aio.connect(address) as dev:
            dev.channel(1, TRAIN, limit_ma=12)
            await dev.arm()
            await dev.start()
            await dev.set(ma={1: 8})
            task = asyncio.create_task(dev.wait(86_400))
            await asyncio.sleep(0.05)
            task.cancel()
            try:
                await task
            except asyncio.CancelledError:
                return dev.state, task.cancelled(), await dev.stop()
            raise AssertionError("the wait ended")

    state, is_cancelled, record = asyncio.run(main())
    assert (state, is_cancelled) == ("idle", True)
    assert record is not None
    assert record.events[-1].text == "stopped: Request"


def test_a_timeout_stops() -> None:
    """`asyncio.timeout` cancels, so it stops too."""

    async def main() -> str:
        async with aio.connect("sim:realtime") as dev:
            dev.channel(1, TRAIN, limit_ma=12)
            await dev.arm()
            await dev.start()
            with pytest.raises(TimeoutError):
                async with asyncio.timeout(0.05):
                    await dev.wait(60)
            return str(dev.state)

    assert asyncio.run(main()) == "idle"


def test_an_exception_leaves_the_block() -> None:
    """It is not replaced, and the device is closed."""
    error = KeyError("mine")
    device = aio.connect("sim:")

    async def main() -> None:
        async with device as dev:
            dev.channel(1, TRAIN, limit_ma=12)
            await dev.arm()
            await dev.start()
            raise error

    with pytest.raises(KeyError) as caught:
        asyncio.run(main())
    assert caught.value is error
    assert device.state == "closed"


def test_a_refused_value() -> None:
    """Errors are those of the calls that block; stimulation goes on."""

    async def main() -> None:
        async with aio.connect("sim:") as dev:
            with pytest.raises(flexor.Refused, match="no limit"):
                dev.channel(1, TRAIN)
            dev.channel(1, TRAIN, limit_ma=12)
            with pytest.raises(flexor.FlexorError, match=r"E772 .*call arm\(\) first"):
                await dev.set(ma={1: 8})
            await dev.arm()
            await dev.start()
            with pytest.raises(flexor.Refused, match="E793"):
                await dev.set(ma={1: 99})
            with pytest.raises(ValueError, match="86400 s"):
                await dev.wait(-1)
            assert dev.state == "running"

    asyncio.run(main())


def test_the_lease() -> None:
    """`asyncio.sleep` renews nothing."""

    async def main() -> None:
        async with aio.connect("sim:realtime", lease_s=0.05) as dev:
            dev.channel(1, TRAIN, limit_ma=12)
            await dev.arm()
            await dev.start()
            while dev.state == "running":
                await asyncio.sleep(0.02)
            with pytest.raises(flexor.LeaseExpired):
                await dev.wait(1)

    asyncio.run(main())


def test_without_the_block() -> None:
    """A device that was not entered says so."""
    dev = aio.connect("sim:")
    with pytest.raises(flexor.FlexorError, match="use `async with`"):
        dev.channel(1, TRAIN, limit_ma=12)
    with pytest.raises(flexor.FlexorError, match="use `async with`"):
        asyncio.run(dev.arm())
    asyncio.run(dev.close())


def test_a_wrong_address() -> None:
    """The block is not entered."""

    async def main() -> None:
        async with aio.connect("nowhere"):
            raise AssertionError("entered")

    with pytest.raises(ValueError, match="not an address"):
        asyncio.run(main())


def test_the_other_calls() -> None:
    """Trigger, reset, steps and snapshots are those of the calls that block."""

    async def main() -> None:
        async with aio.connect("sim:", session="trigger") as dev:
            await dev.arm()
            await dev.start()
            await dev.set(ma={1: 5, 2: 5})
            await dev.trigger()
            times = [t_s async for t_s in dev.steps(0.5, 0.1)]
            assert times == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.5], abs=0.01)
            copy = await dev.snapshot()
            assert await copy.wait(0.5) == pytest.approx(1, abs=0.01)
            await copy.close()
            assert (copy.state, dev.state) == ("closed", "running")
            record = await dev.stop()
            assert record is not None
            assert record.pulses == 20
            assert list(dev.events()) == record.events
            await dev.reset(2)
            assert dev.state == "idle"

    asyncio.run(main())


def test_every_name_of_the_device() -> None:
    """The module has the names of `flexor.Device`."""

    async def main() -> None:
        async with aio.connect("sim:") as dev:
            dev.channel(1, TRAIN, limit_ma=12)
            names = [name for name in dir(dev.sync_device) if not name.startswith("_")]
            assert [name for name in names if not hasattr(dev, name)] == []

    asyncio.run(main())
