"""Runs the notebooks from their first cell to their last, and checks a number of each."""

import json
import sys
from pathlib import Path
from typing import Any

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")
for needed in ("ipykernel", "ipywidgets", "matplotlib"):
    pytest.importorskip(needed)

FOLDER = Path(__file__).parents[1] / "notebooks"
MAX_CELLS = 20
CELL_TIMEOUT_S = 60

# For each notebook an expression that its cells leave behind, and the range of its value.
NUMBERS = {
    "1_first_session": ("peak_ma", 10.0, 10.0),
    "2_reciprocal_with_sliders": ("after_deg - before_deg", 10.0, 40.0),
    "3_calibrate_and_use": ("threshold_ma", 4.0, 12.0),
    "4_controller_beside_device": ("device_rmse_deg", 0.5, 1.5),
}


def read(name: str) -> Any:
    """Return the notebook of that name."""
    return nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)


@pytest.fixture
def kernel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return the name of a kernel of the running interpreter; nothing is written at home."""
    name = "flexor-tests"
    folder = tmp_path / "jupyter/kernels" / name
    folder.mkdir(parents=True)
    spec = {
        "argv": [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"],
        "display_name": name,
        "language": "python",
    }
    (folder / "kernel.json").write_text(json.dumps(spec), encoding="utf-8")
    monkeypatch.setenv("JUPYTER_PATH", str(tmp_path / "jupyter"))
    monkeypatch.setenv("JUPYTER_RUNTIME_DIR", str(tmp_path / "runtime"))
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    return name


def test_every_notebook_is_known() -> None:
    """A notebook without a checked number is a mistake."""
    assert sorted(path.stem for path in FOLDER.glob("*.ipynb")) == sorted(NUMBERS)


@pytest.mark.parametrize("name", NUMBERS)
def test_a_notebook_has_no_outputs_and_says_that_it_is_simulated(name: str) -> None:
    """Outputs would make the file differ from run to run."""
    notebook = read(name)
    nbformat.validate(notebook)
    assert len(notebook.cells) <= MAX_CELLS
    assert "**Everything here is simulated" in notebook.cells[0].source
    for cell in notebook.cells:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None


@pytest.mark.parametrize("name", NUMBERS)
def test_a_notebook_runs(name: str, kernel: str, tmp_path: Path) -> None:
    """Every cell ends without an exception, and the number is in its range."""
    notebook = read(name)
    expression, low, high = NUMBERS[name]
    notebook.cells.append(nbformat.v4.new_code_cell(f"print(float({expression}))"))
    client = nbclient.NotebookClient(
        notebook,
        kernel_name=kernel,
        timeout=CELL_TIMEOUT_S,
        resources={"metadata": {"path": str(tmp_path)}},
    )
    client.execute()
    (output,) = notebook.cells[-1].outputs
    assert low <= float(output.text) <= high
