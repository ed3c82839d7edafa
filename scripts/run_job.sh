#!/usr/bin/env bash
# Runs one line of `option2vec jobs` and marks its output with the run's folder. When GRID holds the
# arguments of `option2vec progress`, it then prints the progress of the whole grid.
# A diverged run (exit code 3) is a result, not a failure. A run that has ended is left alone.
set -uo pipefail

label=${1##* --out }
label=${label% --resume}
# On a signal the program writes a checkpoint and ends by itself; the loop waits for its last lines.
eval "$1" 2>&1 | (
  trap '' INT TERM
  while IFS= read -r line || [ -n "$line" ]; do printf '%s: %s\n' "$label" "$line"; done
)
status=$?
if [ -n "${GRID:-}" ]; then
  # The program is the first word of the line, quoted for a shell. GRID is a list of words.
  eval "program=${1%% train --config *}"
  # shellcheck disable=SC2086,SC2154
  "$program" progress $GRID
fi
[ "$status" -eq 3 ] || exit "$status"
