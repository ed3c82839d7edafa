"""What a report is made from, each thing read once."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path

from plots.records import FIDELITIES, Cell, Key, Rows, load_cells
from plots.samples import Samples, author_samples, our_samples
from plots.tables import Interpretation, read_bench, read_interpretations, read_rows, read_switches


class Inputs:
    """Records of `experiments` (default: all but quick and ci) and the tables of results/."""

    def __init__(self, results: Path, experiments: Sequence[str] | None = None):
        self.results, self.experiments = results, experiments

    @cached_property
    def cells(self) -> Mapping[Key, Cell]:
        return load_cells(self.results, self.experiments)

    @cached_property
    def sources(self) -> Mapping[str, Samples]:
        """By source: paper, released, authors."""
        ours = {fidelity: our_samples(self.cells, fidelity) for fidelity in FIDELITIES}
        return ours | {"authors": author_samples(self.results / "reference")}

    @cached_property
    def interpretations(self) -> Mapping[Path, Interpretation]:
        return read_interpretations(self.results, self.experiments)

    params: Rows = cached_property(lambda self: read_rows(self.results, "params"))
    gradcheck: Rows = cached_property(lambda self: read_rows(self.results, "gradcheck"))
    parity: Rows = cached_property(lambda self: read_rows(self.results, "parity"))
    theory: Rows = cached_property(lambda self: read_rows(self.results, "theory"))
    information: Rows = cached_property(lambda self: read_rows(self.results, "policies/options"))
    bench: Rows = cached_property(lambda self: read_bench(self.results))
    switches: Rows = cached_property(lambda self: read_switches(self.results))
