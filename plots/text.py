"""A report as a list of blocks, written as Markdown or as one HTML page."""

import html
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from plots.statistics import Interval, Moments


def number(x: float | None, sign: str = "") -> str:
    """Four significant digits without exponents, as `option2vec summary` prints them; "-" for
    what is not known. sign: "+" to show it always."""
    if x is None or math.isnan(x):
        return "-"
    size = abs(x)
    if 0 < size < 1e-3:
        return f"{x:{sign}.2g}"
    return f"{x:{sign}.{3 if size < 10 else 2 if size < 100 else 1 if size < 1000 else 0}f}"


def interval(i: Interval, sign: str = "") -> str:
    return "-" if math.isnan(i[0]) else f"[{number(i[0], sign)}, {number(i[1], sign)}]"


def moments(m: Moments | None) -> str:
    """mean +- std (n); of one run there is no deviation."""
    if m is None:
        return "-"
    return f"{number(m.mean)} ± {number(m.std) if m.n > 1 else '-'} ({m.n})"


def p_value(p: float) -> str:
    return "-" if math.isnan(p) else "< 0.0001" if p < 1e-4 else f"{p:.2g}"


def p_clause(p: float) -> str:
    """p_value in a sentence."""
    text = p_value(p)
    return f"p {text}" if text.startswith("<") else f"p = {text}"


def ranges(numbers: Sequence[int]) -> str:
    """0, 1, 2, 5 as "0-2, 5"."""
    parts: list[list[int]] = []
    for n in sorted(numbers):
        if parts and n == parts[-1][-1] + 1:
            parts[-1].append(n)
        else:
            parts.append([n])
    return ", ".join(f"{p[0]}-{p[-1]}" if len(p) > 1 else str(p[0]) for p in parts)


@dataclass(frozen=True)
class Heading:
    text: str
    level: int = 2


@dataclass(frozen=True)
class Paragraph:
    text: str  # `code` and **bold**


@dataclass(frozen=True)
class Items:
    items: Sequence[str]


@dataclass(frozen=True)
class Table:
    header: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Picture:
    """name: of <name>.svg; svg: an element for a page."""
    name: str
    caption: str
    svg: str


Block = Heading | Paragraph | Items | Table | Picture


def to_markdown(title: str, blocks: Sequence[Block], figures: str) -> str:
    """Pictures are links into the folder `figures`."""
    parts = [f"# {title}"]
    for block in blocks:
        match block:
            case Heading(text, level):
                parts.append(f"{'#' * level} {text}")
            case Paragraph(text):
                parts.append(text)
            case Items(items):
                parts.append("\n".join(f"- {item}" for item in items))
            case Table(header, rows):
                lines = [header, ["---"] * len(header), *rows]
                parts.append("\n".join("| " + " | ".join(c.replace("|", "\\|") for c in line) + " |"
                                       for line in lines))
            case Picture(name, caption):
                parts.append(f"![{caption}]({figures}/{name}.svg)\n\n{caption}")
    return "\n\n".join(parts) + "\n"


STYLE = """
:root { --ink: #1a1a1a; --paper: #ffffff; --soft: #f2f2ef; --line: #d5d5d0; --good: #0b6b4b;
  --bad: #a83200; --open: #6b6b6b; color-scheme: light dark; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e8e8e4; --paper: #161616; --soft: #232323; --line: #444444; --good: #4cc79b;
    --bad: #ff8f5c; --open: #a5a5a5; } }
body { margin: 0 auto; max-width: 72rem; padding: 0 1rem 4rem; color: var(--ink);
  background: var(--paper); font: 1rem/1.5 system-ui, sans-serif; overflow-wrap: anywhere; }
h1, h2, h3 { line-height: 1.2; margin: 2rem 0 .6rem; }
a { color: inherit; }
nav { display: flex; flex-wrap: wrap; gap: .2rem 1rem; padding: 0; margin: 1rem 0; }
.wide { overflow-x: auto; margin: 1rem 0; }
table { border-collapse: collapse; font-size: .85rem; overflow-wrap: normal; }
th, td { text-align: left; vertical-align: top; padding: .25rem .6rem;
  border-bottom: 1px solid var(--line); }
td { min-width: 9rem; }
td.short { white-space: nowrap; min-width: 0; }
thead th { background: var(--soft); }
tbody td:first-child { position: sticky; left: 0; background: var(--paper); }
@media (max-width: 40rem) {
  tbody td:first-child { white-space: normal; min-width: 6rem; max-width: 7.5rem;
    overflow-wrap: anywhere; } }
code { background: var(--soft); padding: 0 .2em; border-radius: .2em; }
.holds { color: var(--good); }
.fails { color: var(--bad); }
.open { color: var(--open); }
figure { margin: 1.5rem 0; }
figure svg { width: 100%; min-width: 44rem; height: auto; }
figcaption { font-size: .9rem; }
""".strip()

SHORT = 36  # characters of a cell that stay on one line
CLASSES = {"holds": "holds", "does not hold": "fails", "undecided": "open", "not measured": "open"}


def to_html(title: str, blocks: Sequence[Block]) -> str:
    """One page that needs no other file."""
    body, places = [], []
    for block in blocks:
        match block:
            case Heading(text, level):
                place = ""
                if level == 2:
                    name = re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")
                    place = f' id="{name}"'
                    places.append(f'<a href="#{name}">{_inline(text)}</a>')
                body.append(f"<h{level}{place}>{_inline(text)}</h{level}>")
            case Paragraph(text):
                body.append(f"<p>{_inline(text)}</p>")
            case Items(items):
                body.append("<ul>" + "".join(f"<li>{_inline(i)}</li>" for i in items) + "</ul>")
            case Table(header, rows):
                head = "".join(f"<th>{_inline(cell)}</th>" for cell in header)
                lines = "\n".join("<tr>" + "".join(_cell(cell) for cell in row) + "</tr>"
                                  for row in rows)
                body.append(f'<div class="wide"><table><thead><tr>{head}</tr></thead>\n<tbody>'
                            f"{lines}</tbody></table></div>")
            case Picture(_, caption, svg):
                svg = svg.replace("<svg", f'<svg role="img" aria-label="{html.escape(caption)}"', 1)
                body.append(f'<figure><div class="wide">{svg}</div>\n'
                            f"<figcaption>{_inline(caption)}</figcaption></figure>")
    return (f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            f"<title>{html.escape(title)}</title>\n<style>\n{STYLE}\n</style>\n</head>\n<body>\n"
            f"<h1>{html.escape(title)}</h1>\n<nav>{' '.join(places)}</nav>\n"
            + "\n".join(body) + "\n</body>\n</html>\n")


def _inline(text: str) -> str:
    text = re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(text, quote=False))
    return re.sub(r"\*\*([^*]+)\*\*", r"<strong>\1</strong>", text)


def _cell(text: str) -> str:
    for verdict, name in CLASSES.items():
        if text.startswith(verdict):
            rest = _inline(text.removeprefix(verdict))
            return f'<td><strong class="{name}">{verdict}</strong>{rest}</td>'
    kind = ' class="short"' if len(text) <= SHORT else ""
    return f"<td{kind}>{_inline(text)}</td>"
