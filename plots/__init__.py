"""Statistics, report, figures, from results/ only; from the root: python3 -m plots.report."""
