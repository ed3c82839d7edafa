#!/bin/sh
# clang-tidy (.clang-tidy) on the sources that differ from a commit, new ones included.
set -eu
cd "$(dirname "$0")/.."

{
  git diff --name-only --diff-filter=d "$1" -- 'src/*.cc' 'tests/*.cc' 'bench/*.cc'
  git ls-files --others --exclude-standard -- 'src/*.cc' 'tests/*.cc' 'bench/*.cc'
} | sort -u | xargs -r clang-tidy --quiet -p build/release --extra-arg=-Wno-unknown-warning-option
