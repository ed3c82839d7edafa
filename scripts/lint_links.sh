#!/bin/sh
# Checks README.md and the pages of docs/: every link names a file of the repository and, after '#', a
# heading of it; every path in `code` exists; the README has at most 150 lines, a page at most 200 (but
# the two specifications).
set -eu
cd "$(dirname "$0")/.."

exec python3 -B - README.md docs/*.md <<'PY'
import re
import sys
from pathlib import Path

CODE_PATH = r"`((?:src|tests|plots|scripts|bench|cmake|paper_configs|docs)/[\w./-]+)`"
SPECIFICATIONS = {"docs/algorithms.md", "docs/environments.md"}
bad = 0


def complain(where, what):
    global bad
    bad = 1
    print(f"{where}: {what}")


def lines_of(path):
    """Number and text of the lines outside of code."""
    fenced = False
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if line.startswith("```"):
            fenced = not fenced
        elif not fenced and not line.startswith("    "):
            yield number, line


def anchors_of(path):
    """As the web page of the repository makes them: lower case, hyphens, numbered when repeated."""
    anchors = []
    for _, line in lines_of(path):
        if heading := re.match(r"#{1,6} +(.*)", line):
            text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading[1]).strip().lower()
            text = re.sub(r"[^\w\- ]", "", text).replace(" ", "-")
            again = sum(a == text for a, _ in anchors)
            anchors.append((text, f"{text}-{again}" if again else text))
        anchors += [(a, a) for a in re.findall(r'<a (?:id|name)="([^"]+)"', line)]
    return {anchor for _, anchor in anchors}


for name in sys.argv[1:]:
    page = Path(name)
    length = len(page.read_text(encoding="utf-8").splitlines())
    most = 150 if name == "README.md" else 200
    if name not in SPECIFICATIONS and length > most:
        complain(name, f"{length} lines, more than {most}")
    for number, line in lines_of(page):
        for path in re.findall(CODE_PATH, line):
            if not Path(path).exists():
                complain(f"{name}:{number}", f"no file {path}")
        for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`]*`", "", line)):
            if re.match(r"[a-z]+:", target):
                continue
            file, _, anchor = target.partition("#")
            path = page.parent / file if file else page
            if not path.exists():
                complain(f"{name}:{number}", f"no file {target}")
            elif anchor and anchor not in anchors_of(path):
                complain(f"{name}:{number}", f"no heading {target}")
sys.exit(bad)
PY
