#!/usr/bin/env bash
# Runs one line of `option2vec jobs`, its output marked with the run's folder.
# A diverged run (exit code 3) is a result, not a failure.
set -uo pipefail

label=${1##* --out }
label=${label% --resume}
eval "$1" 2>&1 | sed -u "s|^|$label: |"
status=$?
[ "$status" -eq 3 ] || exit "$status"
