#!/usr/bin/env bash
# Runs one line of `option2vec jobs`, its output marked with the run's folder; then, when GRID holds the
# arguments of `option2vec progress`, says how far the whole grid has come.
# A diverged run (exit code 3) is a result, not a failure.
set -uo pipefail

label=${1##* --out }
label=${label% --resume}
# The program ends on a signal by itself, with a checkpoint; what marks its last lines waits for it.
eval "$1" 2>&1 | (trap '' INT TERM; exec sed -u "s|^|$label: |")
status=$?
# GRID is a list of words.
# shellcheck disable=SC2086
[ -z "${GRID:-}" ] || "${1%% *}" progress $GRID
[ "$status" -eq 3 ] || exit "$status"
