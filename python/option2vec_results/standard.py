"""What the place of a record says of its configuration; src/run/record.cc has the same rule."""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent  # with links to what the program is built with


def settings_of(folder: str) -> dict[str, Any]:
    """{"hidden": 8} of the folder paper-hidden=8. A value may hold a hyphen, a key does not."""
    parts = re.split(r"-(?=[^-=]+=)", folder)[1:]
    return {key: _value(text) for key, _, text in (part.partition("=") for part in parts)}


def standard(experiment: str, fidelity: str, task: str, algorithm: str, pair: bool
             ) -> dict[str, Any] | None:
    """Every switch and number of the method in an experiment of paper_configs/; None where there
    is none of that name. `task`: the id, or the name of the pair."""
    suite = _config(experiment)
    if "experiment" not in suite:
        return None
    names = ["dm" if pair or task.startswith("dm-") else "gym", *["transfer"] * pair, fidelity,
             algorithm, task]
    found = dict(_switches(fidelity))
    for layer in (_config(f"algo/{algorithm}"), suite):
        found |= _flatten(layer.get("switches", {}), names)
        found |= _flatten(layer.get("algo", {}).get(algorithm, {}), names)
    return found


def differences(config: Mapping[str, Any], wanted: Mapping[str, Any]) -> Iterator[str]:
    """Keys of a configuration's switches and numbers that are not as wanted."""
    for key, value in config.items():
        if key not in wanted:
            yield f"unknown key '{key}'"
        elif value != wanted[key]:
            yield f"{toml(key, value)}, not {toml(key, wanted[key])}"


def toml(key: str, value: Any) -> str:
    """A line of a configuration."""
    return f'{key} = "{value}"' if isinstance(value, str) else f"{key} = {value}"


@cache
def registry() -> dict[str, list[dict[str, Any]]]:
    """What the program knows, by `option2vec list --json`: tasks, pairs, algorithms, switches."""
    return json.loads((FOLDER / "registry.json").read_text(encoding="utf-8"))


@cache
def _config(name: str) -> dict[str, Any]:
    path = FOLDER / "paper_configs" / f"{name}.toml"
    return tomllib.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


@cache
def _switches(fidelity: str) -> dict[str, Any]:
    return {s["id"]: _value(s[fidelity]) for s in registry()["switches"]}


def _flatten(section: Mapping[str, Any], names: list[str]) -> dict[str, Any]:
    """The plain keys, then those of the tables in it that hold."""
    found = {key: value for key, value in section.items() if not isinstance(value, dict)}
    for name in names:
        if name in section:
            found |= _flatten(section[name], names)
    return found


def _value(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text
