"""Runs the examples of README.md as they are printed there."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

README = Path(__file__).parents[1] / "README.md"
TEXT = README.read_text(encoding="utf-8")
MAX_LINE = 100

# For each block its mark after ```python, its line, and its code. `run` is executed on the
# simulator in an empty folder; `board` needs a board and is only compiled.
BLOCKS = [
    (found[1], TEXT.count("\n", 0, found.start()) + 2, found[2])
    for found in re.finditer(r"^```python ?(.*)\n((?:.*\n)*?)```$", TEXT, re.MULTILINE)
]


def test_every_block_is_marked() -> None:
    """A block without a mark would not be tested."""
    assert {mark for mark, _, _ in BLOCKS} == {"run", "board"}
    assert TEXT.count("```") == 2 * len(BLOCKS)


def test_lines_are_short() -> None:
    """The document can be read in a terminal."""
    assert not [line for line in TEXT.splitlines() if len(line) > MAX_LINE]


@pytest.mark.parametrize(("mark", "line", "code"), BLOCKS, ids=[f"line{b[1]}" for b in BLOCKS])
def test_a_block_runs(
    mark: str, line: int, code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Code for the simulator ends without an exception; code for a board compiles."""
    compiled = compile("\n" * (line - 1) + code, str(README), "exec")
    if mark == "board":
        return
    if "to_pandas" in code:
        pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    exec(compiled, {"__name__": "__main__"})


def test_the_api_reference_is_built(tmp_path: Path) -> None:
    """Pdoc finds every public module, and warns about nothing."""
    for needed in ("pdoc", "gymnasium"):
        pytest.importorskip(needed)
    (command,) = re.findall(r"^    python (-m pdoc .*)$", TEXT, re.MULTILINE)
    words = [sys.executable, *command.split()]
    done = subprocess.run(
        words, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    pages = {path.stem for path in (tmp_path / "api").rglob("*.html")}
    assert pages >= {"flexor", "aio", "gym", "models", "statistics"}
