"""Prints a random sample of documentation comments and messages, for readers to judge.

    python3 tests/words/sample.py [SEED]

100 documentation comments with the line that they document, and 60 messages (string literals
that begin with an error number, and help texts of the command line), from all Rust files but
tests. A message that consists of placeholders alone shows nothing to judge and is left out. The
language of release 0.2.0 is judged by the seeds 4501 and, after what failed there was mended
everywhere, 4502; each was committed before its sample was looked at. Each reader marks every
entry as understood at first reading or not, and as useful or not.
"""

import pathlib
import random
import re
import sys

COMMENTS, MESSAGES, SEED = 100, 60, 4502
ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGES = ["firmware", "hal-sim", "host-tool", "tests"]


def sources():
    """Rust files that are not tests, in the order of their paths."""
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.rs")):
            parts = path.relative_to(ROOT).parts
            if not {"tests", "target"} & set(parts[1:]) and path.name != "tests.rs":
                yield path


def comments(path):
    """Documentation comments of a file with the first line of their item."""
    lines = path.read_text(encoding="utf-8").split("\n")
    index = 0
    while index < len(lines):
        start = index
        text = []
        while index < len(lines) and lines[index].strip().startswith("///"):
            text.append(lines[index].strip()[3:].strip())
            index += 1
        if not text:
            index += 1
            continue
        while index < len(lines) and lines[index].strip().startswith("#["):
            index += 1
        item = lines[index].strip() if index < len(lines) else ""
        yield f"{path.relative_to(ROOT)}:{start + 1}", " ".join(text), item


def messages(path):
    """String literals of a file that begin with an error number."""
    text = path.read_text(encoding="utf-8")
    for match in re.finditer(r'"(E\d{3} (?:[^"\\]|\\.)*)"', text, re.S):
        line = text.count("\n", 0, match.start()) + 1
        message = re.sub(r"\\\n\s*", "", match[1])
        words = re.sub(r"\{[^}]*\}", " ", message[5:]).split()
        if len(words) < 2:
            continue
        yield f"{path.relative_to(ROOT)}:{line}", message


def main():
    """Prints the sample of the seed."""
    generator = random.Random(int(sys.argv[1]) if len(sys.argv) > 1 else SEED)
    files = list(sources())
    documented = [entry for path in files for entry in comments(path)]
    shown = [entry for path in files for entry in messages(path)]
    for place, text, item in generator.sample(documented, COMMENTS):
        print(f"{place}\n  {text}\n  -> {item}")
    for place, text in generator.sample(shown, MESSAGES):
        print(f"{place}\n  {text}")


if __name__ == "__main__":
    main()
