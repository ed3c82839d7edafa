#!/bin/sh
# Checks that every "spec N.N" of code, configurations and pages is a section of docs/algorithms.md,
# every "spec E.N" one of docs/environments.md, and that a letter or an item named with it, as in
# "spec 4.6 (g)" or "spec 2.6 item 5", stands there. Lists as in "spec 2.2 to 2.6" or "spec 2.6, 7"
# are checked whole, across lines too.
set -eu
cd "$(dirname "$0")/.."

find README.md docs src tests bench paper_configs plots python -type f ! -path 'tests/data/*' \
    ! -path docs/algorithms.md ! -path docs/environments.md \
    \( -name '*.cc' -o -name '*.h' -o -name '*.inc' -o -name '*.toml' -o -name '*.py' \
       -o -name '*.txt' -o -name '*.md' \) |
  sort | xargs awk '
  # The two pages: headings name sections; lines that begin with a letter or number name their parts.
  FILENAME == "docs/algorithms.md" || FILENAME == "docs/environments.md" {
    if ($1 ~ /^#+$/) {
      section = $2; sub(/\.$/, "", section)
      known[section] = 1
    } else if ($1 ~ /^\([a-h]\)$/ || $1 ~ /^[0-9]+\.$/) {
      part = $1; sub(/\.$/, "", part)
      known[section " " part] = 1
    }
    next
  }

  function need(part, what) {
    if (part in known) return
    print FILENAME ":" FNR ": docs/ has no " what; bad = 1
  }

  # `want` is what the next word may be: "" nothing, "number" the first section, "more" the rest of a
  # list.
  function read_word(word,    bare, tail) {
    bare = word
    gsub(/^[("]+|[)"]+$/, "", bare)
    if (bare ~ /^[Ss]pec$/) { want = "number"; section = ""; item = 0; return }
    if (want == "") return
    if (want == "more" && word ~ /^\([a-h]\)/) {
      need(section " " substr(word, 1, 3), "section " section " " substr(word, 1, 3))
      tail = substr(word, 4)
    } else if (match(word, /^(E\.)?[0-9]+(\.[0-9]+)*/)) {
      bare = substr(word, 1, RLENGTH)
      tail = substr(word, RLENGTH + 1)
      if (item) {
        need(section " " bare, "section " section ", item " bare)
      } else {
        section = bare
        need(section, "section " section)
      }
      item = 0
    } else if (want == "more" && word ~ /^(items?|to|and|networks?)$/) {
      item = item || word ~ /^item/
    } else {
      want = ""; return
    }
    want = tail ~ /[.;:)"]/ ? "" : "more"
  }

  /spec\/[a-z]/ { print FILENAME ":" FNR ": cite a section, as spec N.N or spec E.N"; bad = 1 }
  FNR == 1 || $1 !~ /^(\/\/|#)/ { want = "" }  # only a comment continues in the next line
  { for (i = 1; i <= NF; ++i) if ($i !~ /^(\/\/+|#+)$/) read_word($i) }
  END { exit bad }
' docs/algorithms.md docs/environments.md
