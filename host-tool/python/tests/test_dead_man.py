"""A few runs of the dead man's campaign (campaigns/dead_man.py)."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve()
CAMPAIGN = HERE.parents[1] / "campaigns/dead_man.py"
PROGRAM = HERE.parents[3] / "target/debug/flexor"


@pytest.mark.skipif(sys.platform != "linux", reason="the campaign halts processes by ptrace")
@pytest.mark.skipif(not PROGRAM.exists(), reason="needs `cargo build -p host-tool`")
def test_a_client_that_fails_does_not_stimulate(tmp_path: Path) -> None:
    """Two runs of each way; a run that was early because the computer is busy proves nothing."""
    out = tmp_path / "out"
    command = [sys.executable, CAMPAIGN, "--runs", "2", "--seed", "7", "--out", out]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    result = json.loads((out / "result.json").read_text())
    assert result["simulated"] is True
    assert len(result["rows"]) == 10
    assert not [row for row in result["rows"] if row["violations"]]
    assert [row for row in result["rows"] if not row["early"]]
    assert max(len(line) for line in (out / "table.txt").read_text().splitlines()) <= 80
