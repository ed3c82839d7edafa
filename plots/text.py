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


def slug(text: str) -> str:
    """Anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-")


# In texts: `code`, **bold**, [text](#anchor).


@dataclass(frozen=True)
class Heading:
    text: str
    level: int = 2
    short: str = ""  # in the table of contents


@dataclass(frozen=True)
class Paragraph:
    text: str
    lead: bool = False  # the page begins with it


@dataclass(frozen=True)
class Items:
    items: Sequence[str]


@dataclass(frozen=True)
class Table:
    header: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Lights:
    """A table of one word a cell. A row: its text, what stands small behind it, and by column the
    word and what stands small behind that; each word leads to the row's anchor."""
    header: Sequence[str]
    rows: Sequence[tuple[str, str, str, Sequence[tuple[str, str]]]]  # text, small, anchor, cells


@dataclass(frozen=True)
class Coverage:
    """Of each row and column, how many of `whole` are there, once for each of `kinds`."""
    text: str
    share: float  # of all
    kinds: Sequence[str]
    columns: Sequence[str]
    rows: Sequence[tuple[str, Sequence[Sequence[int]]]]  # name, [kind][column]
    whole: int


@dataclass(frozen=True)
class Picture:
    """name: of <name>.svg; svg: an element for a page."""
    name: str
    caption: str
    svg: str


@dataclass(frozen=True)
class Details:
    """Folded until asked for."""
    summary: str
    blocks: "Sequence[Block]"


@dataclass(frozen=True)
class Screen:
    """Beside each other where there is room."""
    left: "Sequence[Block]"
    right: "Sequence[Block]"


Block = (Heading | Paragraph | Items | Table | Lights | Coverage | Picture | Details | Screen)


def to_markdown(title: str, blocks: Sequence[Block], figures: str) -> str:
    """Pictures are links into the folder `figures`."""
    return f"# {title}\n\n" + _markdown(blocks, figures) + "\n"


def _markdown(blocks: Sequence[Block], figures: str) -> str:
    parts = []
    for block in blocks:
        match block:
            case Heading(text, level):
                parts.append(f"{'#' * level} {text}")
            case Paragraph(text):
                parts.append(text)
            case Items(items):
                parts.append("\n".join(f"- {item}" for item in items))
            case Table(header, rows):
                parts.append(_markdown_table(header, rows))
            case Lights(header, rows):
                parts.append(_markdown_table(header, [
                    [f"{text} ({small})" if small else text,
                     *(word if word == "-" else f"[{word}](#{anchor}) {count}".strip()
                       for word, count in cells)]
                    for text, small, anchor, cells in rows]))
            case Coverage(text, _, kinds, columns, rows, whole):
                table = _markdown_table(["task", *columns], [
                    [name, *(" / ".join(map(str, counts)) for counts in zip(*found))]
                    for name, found in rows])
                parts.append(f"{text}\n\n" + _folded(
                    f"Runs of {whole} by task and method: {' / '.join(kinds)}", table))
            case Picture(name, caption):
                parts.append(f"![{name}]({figures}/{name}.svg)\n\n{caption}")
            case Details(summary, inside):
                parts.append(_folded(summary, _markdown(inside, figures)))
            case Screen(left, right):
                parts.append(_markdown([*left, *right], figures))
    return "\n\n".join(parts)


def _folded(summary: str, text: str) -> str:
    return f"<details>\n<summary>{_inline(summary)}</summary>\n\n{text}\n\n</details>"


def _markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(c.replace("|", "\\|") for c in line) + " |"
                     for line in lines)


STYLE = """
:root { --ink: #1a1a1a; --paper: #ffffff; --soft: #f3f3f0; --line: #d9d9d4; --good: #0b6b4b;
  --bad: #a83200; --open: #6b6b6b; --fill: 0, 114, 178; color-scheme: light dark; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e8e8e4; --paper: #161616; --soft: #232323; --line: #444444; --good: #4cc79b;
    --bad: #ff8f5c; --open: #a5a5a5; --fill: 86, 180, 233; } }
html { scroll-padding-top: 3.2rem; }
body { margin: 0 auto; max-width: 77rem; padding: 0 1rem 4rem; color: var(--ink);
  background: var(--paper); font: 1rem/1.5 system-ui, sans-serif; overflow-wrap: anywhere; }
h1, h2, h3 { line-height: 1.2; margin: 1.6rem 0 .5rem; }
h3 { font-size: 1.05rem; margin: 1.1rem 0 .3rem; }
ul { margin: .3rem 0; }
h1 { font-size: 1.45rem; margin: .7rem 0 .4rem; }
h2 { border-top: 1px solid var(--line); padding-top: 1.2rem; }
h2 a, h3 a { text-decoration: none; }
h2 a:hover::after, h3 a:hover::after { content: " #"; color: var(--open); }
a { color: inherit; text-underline-offset: .15em; }
nav { position: sticky; top: 0; z-index: 3; display: flex; gap: 1.1rem; overflow-x: auto;
  margin: 0 -1rem; padding: .45rem 1rem; background: var(--paper);
  border-bottom: 1px solid var(--line); font-size: .85rem; white-space: nowrap; }
nav a { text-decoration: none; }
nav a:hover { text-decoration: underline; }
p { max-width: 62rem; }
.lead { margin: .25rem 0 .4rem; max-width: none; font-size: .88rem; line-height: 1.4; }
.screen { display: grid; grid-template-columns: minmax(0, 1fr); gap: 0 1.6rem; }
@media (min-width: 64rem) { .screen { grid-template-columns: minmax(0, 47.5rem) minmax(0, 1fr); } }
.screen p { font-size: .85rem; line-height: 1.4; margin: .5rem 0; }
.screen .lights { width: 100%; }
.wide { overflow-x: auto; margin: 1rem 0; scrollbar-width: thin;
  background: linear-gradient(90deg, var(--paper) 30%, transparent) 0 0 / 3rem 100% local,
    linear-gradient(270deg, var(--paper) 30%, transparent) 100% 0 / 3rem 100% local,
    linear-gradient(90deg, #0005, transparent) 0 0 / .9rem 100% scroll,
    linear-gradient(270deg, #0005, transparent) 100% 0 / .9rem 100% scroll;
  background-repeat: no-repeat; }
.screen .wide { margin: 0; }
.scrolls::before { content: "scrolls sideways \\2192"; position: sticky; left: 0; display: block;
  font-size: .75rem; color: var(--open); }
table { border-collapse: collapse; font-size: .85rem; overflow-wrap: normal; }
th, td { text-align: left; vertical-align: top; padding: .25rem .6rem;
  border-bottom: 1px solid var(--line); }
td { min-width: 9rem; }
td.short { white-space: nowrap; min-width: 0; }
thead th { background: var(--soft); }
tbody td:first-child { position: sticky; left: 0; background: var(--paper); }
.lights th, .lights td { padding: .15rem .4rem; line-height: 1.3; min-width: 0; }
.lights td:first-child { width: 99%; }
.lights td:not(:first-child) { white-space: nowrap; }
.lights small, .coverage small { color: var(--open); font-size: .75rem; }
.lights a { font-weight: 600; }
.coverage table { font-size: .7rem; line-height: 1; }
.coverage th, .coverage td { padding: .12rem 0; min-width: 1.05rem; text-align: center;
  border: 0; font-weight: normal; background: none; }
.coverage tbody th, .coverage tbody td:first-child { text-align: left; padding-right: .4rem; }
.coverage thead th { vertical-align: bottom; }
.coverage thead th span { writing-mode: vertical-rl; transform: rotate(180deg);
  white-space: nowrap; }
.coverage tbody th { white-space: nowrap; }
.coverage td.gap { border-left: .35rem solid var(--paper); background-clip: padding-box; }
.bar { height: .55rem; background: var(--soft); border: 1px solid var(--line); margin: .3rem 0; }
.bar div { height: 100%; background: rgb(var(--fill)); }
@media (max-width: 40rem) {
  tbody td:first-child { white-space: normal; min-width: 6rem; max-width: 9.5rem; }
  .lights { font-size: .74rem; }
  .lights th, .lights td { padding: .17rem .2rem; }
  .lights tbody td:first-child { min-width: 0; max-width: none; }
  .lights td small { display: block; }
  .coverage table { font-size: .6rem; }
  .coverage th, .coverage td { min-width: .8rem; }
  html { scroll-padding-top: 5.5rem; }
  nav { flex-wrap: wrap; gap: .1rem .8rem; font-size: .8rem; } }
code { background: var(--soft); padding: 0 .2em; border-radius: .2em; }
.holds { color: var(--good); }
.fails { color: var(--bad); }
.open { color: var(--open); }
figure { margin: 1.2rem 0; }
figure svg { width: 100%; min-width: 44rem; height: auto; display: block; }
figcaption { font-size: .85rem; max-width: 62rem; }
details { margin: .3rem 0; }
summary { cursor: pointer; color: var(--ink); padding: .2rem 0; }
summary::marker { color: var(--open); }
details[open] > summary { font-weight: 600; }
details > :not(summary) { margin-left: .9rem; }
@media print { nav { position: static; } }
""".strip()

# A link into a folded part opens it, also where the browser does not.
SCRIPT = """
addEventListener("hashchange", unfold);
addEventListener("DOMContentLoaded", unfold);
function unfold() {
  const place = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  for (let x = place; x; x = x.parentElement) if (x.tagName === "DETAILS") x.open = true;
  if (place) place.scrollIntoView();
}
for (const wide of document.querySelectorAll(".wide"))
  new ResizeObserver(() =>
    wide.classList.toggle("scrolls", wide.scrollWidth > wide.clientWidth + 2)).observe(wide);
""".strip()

FULL_WIDTH = 600  # [pt] of a figure; narrower ones do not fill the page
SHORT = 36  # characters of a cell that stay on one line
CLASSES = {"holds": "holds", "yes": "holds", "fails": "fails", "no": "fails", "undecided": "open",
           "not measured": "open", "-": "open"}


def to_html(title: str, blocks: Sequence[Block]) -> str:
    """One page that needs no other file."""
    places = " ".join(f'<a href="#{slug(b.text)}">{_inline(b.short or b.text)}</a>'
                      for b in blocks if isinstance(b, Heading) and b.level == 2)
    return (f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            f"<title>{html.escape(title)}</title>\n<style>\n{STYLE}\n</style>\n</head>\n<body>\n"
            f'<nav aria-label="Contents">{places}</nav>\n'
            f'<h1 id="{slug(title)}">{html.escape(title)}</h1>\n'
            f"{_html(blocks)}\n<script>\n{SCRIPT}\n</script>\n</body>\n</html>\n")


def _html(blocks: Sequence[Block]) -> str:
    body = []
    for block in blocks:
        match block:
            case Heading(text, level):
                name = slug(text)
                link = f'<a href="#{name}">{_inline(text)}</a>'
                body.append(f'<h{level} id="{name}">{link}</h{level}>')
            case Paragraph(text, lead):
                kind = ' class="lead"' if lead else ""
                body.append(f"<p{kind}>{_inline(text)}</p>")
            case Items(items):
                body.append("<ul>" + "".join(f"<li>{_inline(i)}</li>" for i in items) + "</ul>")
            case Table(header, rows):
                lines = "\n".join("<tr>" + "".join(_cell(cell) for cell in row) + "</tr>"
                                  for row in rows)
                body.append(_html_table(header, lines))
            case Lights(header, rows):
                lines = "\n".join(
                    f"<tr><td>{_inline(text)} <small>{_inline(small)}</small></td>"
                    + "".join(_light(word, count, anchor) for word, count in cells) + "</tr>"
                    for text, small, anchor, cells in rows)
                body.append(_html_table(header, lines, "lights"))
            case Coverage():
                body.append(_coverage(block))
            case Picture(name, caption, svg):
                width = float(re.search(r'viewBox="0 0 ([\d.]+)', svg)[1])  # [pt]
                label = f'role="img" aria-label="{html.escape(caption)}"'
                if width < FULL_WIDTH:
                    label += f' style="max-width: {1.7 * width:.0f}px; min-width: 0"'
                svg = svg.replace("<svg", f"<svg {label}", 1)
                body.append(f'<figure id="fig-{name}"><div class="wide" tabindex="0">{svg}</div>\n'
                            f"<figcaption>{_inline(caption)}</figcaption></figure>")
            case Details(summary, inside):
                body.append(f"<details><summary>{_inline(summary)}</summary>\n{_html(inside)}"
                            "</details>")
            case Screen(left, right):
                body.append(f'<div class="screen"><div>{_html(left)}</div>\n'
                            f"<div>{_html(right)}</div></div>")
    return "\n".join(body)


def _html_table(header: Sequence[str], lines: str, kind: str = "") -> str:
    head = "".join(f"<th>{_inline(cell)}</th>" for cell in header)
    of_kind = f' class="{kind}"' if kind else ""
    return (f'<div class="wide" tabindex="0"><table{of_kind}><thead><tr>{head}</tr></thead>\n'
            f"<tbody>{lines}</tbody></table></div>")


def _light(word: str, count: str, anchor: str) -> str:
    if word == "-":
        return '<td class="open">-</td>'
    small = f" <small>{html.escape(count)}</small>" if count else ""
    return f'<td><a class="{CLASSES[word]}" href="#{anchor}">{word}</a>{small}</td>'


def _coverage(c: Coverage) -> str:
    head = "".join(f'<th class="gap" colspan="{len(c.columns)}">{_inline(kind)}</th>'
                   for kind in c.kinds)
    names = "".join(f"<th><span>{html.escape(x)}</span></th>" for x in c.columns) * len(c.kinds)
    rows = []
    for name, found in c.rows:
        cells = "".join(
            f'<td{" class=gap" if not column else ""} title="{html.escape(name)}, '
            f'{html.escape(c.columns[column])}, {html.escape(kind.strip("`"))}: {n} of {c.whole}" '
            f'style="background: rgba(var(--fill), {0.75 * n / c.whole:.2g})">{n or "·"}</td>'
            for kind, counts in zip(c.kinds, found) for column, n in enumerate(counts))
        rows.append(f"<tr><th>{html.escape(name)}</th>{cells}</tr>")
    bar = f'<div class="bar"><div style="width: {100 * c.share:.3g}%"></div></div>'
    return (f'<div class="coverage"><p>{_inline(c.text)}</p>{bar}<div class="wide" tabindex="0">'
            f"<table><thead><tr><th></th>{head}</tr><tr><th></th>{names}</tr></thead>\n<tbody>"
            + "\n".join(rows) + "</tbody></table></div></div>")


def _inline(text: str) -> str:
    text = re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(text, quote=False))
    text = re.sub(r"\[([^\]]+)\]\(([^)\s]+)\)", r'<a href="\2">\1</a>', text)
    return re.sub(r"\*\*([^*]+)\*\*", r"<strong>\1</strong>", text)


def _cell(text: str) -> str:
    for verdict, name in CLASSES.items():
        if len(verdict) > 3 and text.startswith(verdict):
            rest = _inline(text.removeprefix(verdict))
            return f'<td><strong class="{name}">{verdict}</strong>{rest}</td>'
    kind = ' class="short"' if len(text) <= SHORT else ""
    return f"<td{kind}>{_inline(text)}</td>"
