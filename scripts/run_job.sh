#!/usr/bin/env bash
# Runs one line of `option2vec jobs`, its output marked with the run's folder; then, when GRID holds the
# arguments of `option2vec progress`, says how far the whole grid has come.
# A diverged run (exit code 3) is a result, not a failure; a run that had ended before is left as it is.
set -uo pipefail

label=${1##* --out }
label=${label% --resume}
# The program ends on a signal by itself, with a checkpoint; what marks its last lines waits for it.
eval "$1" 2>&1 | (
  trap '' INT TERM
  while IFS= read -r line || [ -n "$line" ]; do printf '%s: %s\n' "$label" "$line"; done
)
status=$?
if [ -n "${GRID:-}" ]; then
  # The first word of the line, quoted for a shell, and GRID, a list of words.
  eval "program=${1%% train --config *}"
  # shellcheck disable=SC2086,SC2154
  "$program" progress $GRID
fi
[ "$status" -eq 3 ] || exit "$status"
