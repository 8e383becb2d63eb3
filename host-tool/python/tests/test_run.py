"""flexor.run and flexor.edges equal the program."""

import csv
import os
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import flexor
import numpy as np
import pytest
from helpers import assert_equal_tables, assert_same_samples, table

SEED = 7
RECORDED = ["reciprocal", "hamana_exp4_two_point_finger", "trigger", "lift", "ten_forces"]


@pytest.fixture(scope="module")
def outputs(program: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder with one record of the program per session."""
    folder = tmp_path_factory.mktemp("program")

    def run(name: str) -> subprocess.CompletedProcess[str]:
        out = folder / name
        out.parent.mkdir(parents=True, exist_ok=True)
        command = [program, "run", name, "--seed", str(SEED), "--out", out]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for done in pool.map(run, flexor.sessions()):
            assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.mark.parametrize("name", flexor.sessions())
def test_samples_equal_the_program_s(outputs: Path, name: str) -> None:
    """Every column is the float of the file's text."""
    record = flexor.run(name, seed=SEED)
    assert record.error is None
    assert_same_samples(record, table(outputs / name, "samples.csv"))


@pytest.mark.parametrize("name", RECORDED)
def test_a_record_on_disk_equals_the_program_s(outputs: Path, tmp_path: Path, name: str) -> None:
    """The three tables of a record have the same bytes."""
    record = flexor.run(name, seed=SEED, out=tmp_path / "out")
    assert record.path == tmp_path / "out"
    for file in ("samples.csv", "markers.csv", "edges.csv"):
        mine, theirs = table(tmp_path / "out", file), table(outputs / name, file)
        assert mine.read_bytes() == theirs.read_bytes(), file


def test_the_program_reruns_a_record(program: Path, tmp_path: Path) -> None:
    """`flexor rerun` accepts the record and finds the same result."""
    flexor.run("reciprocal", seed=SEED, out=tmp_path / "out")
    again = [program, "rerun", tmp_path / "out", "--out", tmp_path / "again"]
    done = subprocess.run(again, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    mine, theirs = (table(tmp_path / name, "samples.csv") for name in ("out", "again"))
    assert mine.read_bytes() == theirs.read_bytes()


@pytest.mark.parametrize("name", ["reciprocal", "trigger", "hamana_exp4_two_point"])
def test_edges_equal_the_program_s(program: Path, tmp_path: Path, name: str) -> None:
    """Each row of the array is a row of the file."""
    path = tmp_path / "edges.csv"
    command = [program, "edges", name, "--seconds", "1.5", "--seed", str(SEED), "--csv", path]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    edges = flexor.edges(name, 1.5, seed=SEED)
    assert list(edges.dtype.names or ()) == header
    assert len(edges) > 0
    assert [[str(value) for value in edge] for edge in edges.tolist()] == rows


def test_run_many_equals_run() -> None:
    """Records do not depend on whether other seeds run beside them."""
    seeds = [3, 1, 2]
    for seed, record in zip(seeds, flexor.run_many("open_finger", seeds), strict=True):
        alone = flexor.run("open_finger", seed=seed)
        assert_equal_tables(record.samples, alone.samples)
        assert_equal_tables(record.edges, alone.edges)
        assert record.counters == alone.counters
        assert record.events == alone.events
        assert record.pulses == alone.pulses
    assert flexor.run_many("open_finger", []) == []


def test_seeds_may_be_numpy_s() -> None:
    """A range of numpy is a list of seeds."""
    first, second = flexor.run_many("open_finger", np.arange(2))
    assert_equal_tables(first.samples, flexor.run("open_finger", seed=0).samples)
    assert_equal_tables(second.samples, flexor.run("open_finger", seed=1).samples)


def test_noise_depends_on_the_seed() -> None:
    """Another seed gives another measured angle, the same seed the same."""
    runs = [flexor.run("hamana_exp4_two_point_finger", seed=seed) for seed in (1, 2, 1)]
    measured = [run.samples["measured_deg"] for run in runs]
    assert not np.array_equal(measured[0], measured[1], equal_nan=True)
    np.testing.assert_array_equal(measured[0], measured[2])


def test_fields_path_and_name_are_the_same_session(tmp_path: Path) -> None:
    """A session may be a name, a path or a dictionary."""
    import tomllib

    root = Path(__file__).resolve().parents[2] / "sessions/open_finger.toml"
    path = tmp_path / "mine.toml"
    path.write_text(root.read_text())
    named = flexor.run("open_finger")
    for session in (path, str(path), tomllib.loads(root.read_text())):
        assert_equal_tables(named.samples, flexor.run(session).samples)


def test_all_edges_contain_the_one_period() -> None:
    """The default keeps one period of edges out of all."""
    few = flexor.run("open_finger", seed=1)
    many = flexor.run("open_finger", seed=1, all_edges=True)
    assert 0 < len(few.edges) < len(many.edges)
    levels = ["channel", "state", "dac_code"]
    assert set(few.edges[levels].tolist()) <= set(many.edges[levels].tolist())
    assert few.edges["t_us"].max() < 50_000
    assert_equal_tables(few.samples, many.samples)


def test_a_record_loads_as_it_was(tmp_path: Path) -> None:
    """What is on disk is what was returned."""
    record = flexor.run("reciprocal", seed=SEED, out=tmp_path / "out")
    (loaded,) = flexor.Record.load(tmp_path / "out")
    assert_equal_tables(loaded.samples, record.samples)
    assert (loaded.title, loaded.pulses, loaded.simulated) == (record.title, record.pulses, True)
    assert loaded.events == record.events
    assert loaded.electrodes == record.electrodes
    assert loaded.counters == record.counters
    assert loaded.duration_s == record.duration_s == 30
    assert loaded.path == tmp_path / "out"
    assert loaded.error is None


def test_pandas_has_the_same_columns() -> None:
    """`to_pandas` gives the columns of samples.csv."""
    pytest.importorskip("pandas")
    record = flexor.run("open_finger")
    frame = record.to_pandas()
    assert list(frame.columns) == list(record.samples.dtype.names or ())
    assert len(frame) == len(record)
    np.testing.assert_array_equal(frame["t_s"].to_numpy(), record.samples["t_s"])


def test_the_edges_of_less_than_a_session() -> None:
    """Edges end before the length that was asked for."""
    edges = flexor.edges("reciprocal", 0.5)
    assert edges["t_us"].max() < 500_000
    assert set(edges["state"]) <= {"isolated", "anodic", "cathodic", "grounded"}
    assert set(edges["channel"]) <= set(range(1, 11))


@pytest.mark.parametrize("seconds", [0, -1, 3601, float("nan"), float("inf")])
def test_a_length_of_edges_out_of_range(seconds: float) -> None:
    """The message names the range."""
    with pytest.raises(ValueError, match="between 0.001 and 3600"):
        flexor.edges("reciprocal", seconds)


def test_a_session_with_mistakes_lists_all() -> None:
    """One exception names every missing field."""
    with pytest.raises(flexor.Refused) as caught:
        flexor.run({})
    fields = [mistake.field for mistake in caught.value.mistakes]
    assert fields == ["title", "duration_s", "channel", "setpoints"]
    assert {mistake.number for mistake in caught.value.mistakes} == {404}
    assert len(str(caught.value).splitlines()) == 4


def test_a_session_that_does_not_exist() -> None:
    """The message names the file."""
    with pytest.raises(flexor.Refused, match="E400 .*nonesuch") as caught:
        flexor.run("nonesuch")
    assert caught.value.number == 400


def test_a_folder_that_is_not_empty(tmp_path: Path) -> None:
    """Nothing is overwritten."""
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(flexor.FlexorError, match="E590 .*not empty: it contains notes.txt"):
        flexor.run("reciprocal", out=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("folder", [".", "nonesuch"])
def test_a_folder_that_is_no_record(tmp_path: Path, folder: str) -> None:
    """The message says what the folder lacks."""
    with pytest.raises(flexor.FlexorError, match="E593 .*no run.json"):
        flexor.Record.load(tmp_path / folder)
