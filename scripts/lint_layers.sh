#!/bin/sh
# Checks that a file of src/ includes only its own folder and the layers below it, and that headers of
# third parties appear only where they may.
set -eu
cd "$(dirname "$0")/.."

find src -name '*.cc' -o -name '*.h' | sort | xargs awk '
  BEGIN {
    # What a folder may include besides itself.
    may["base"] = " "
    may["nn"] = may["dist"] = may["env"] = " base "
    may["rollout"] = " base nn dist env "
    may["algo"] = may["rollout"] "rollout "
    may["run"] = may["algo"] "algo embedded build_info.h "
    may["report"] = may["run"] "run "
    may["render"] = " base env "
    may["cli"] = may["report"] "report render "
    may["env"] = may["env"] "embedded "
    # Where third-party headers may appear; Eigen and the standard library may appear anywhere.
    home["mujoco"] = "^src/(env|render)/"
    home["toml++"] = "^src/run/config\\.cc$"
    home["nlohmann"] = "^src/(run/(manifest|checkpoint|record)|report/interpret|cli/list)\\.cc$"
    home["CLI"] = "^src/cli/"
  }
  /^[ \t]*#[ \t]*include[ \t]*"/ {
    split(FILENAME, path, "/")
    header = $0; sub(/^[^"]*"/, "", header); sub(/".*/, "", header)
    split(header, part, "/")
    if (part[1] != path[2] && !index(may[path[2]], " " part[1] " ")) {
      print FILENAME ":" FNR ": " path[2] "/ must not include " header; bad = 1
    }
  }
  /^[ \t]*#[ \t]*include[ \t]*</ {
    header = $0; sub(/^[^<]*</, "", header); sub(/>.*/, "", header)
    split(header, part, "/")
    if (part[1] in home && FILENAME !~ home[part[1]]) {
      print FILENAME ":" FNR ": " header " is confined to " home[part[1]]; bad = 1
    }
  }
  END { exit bad }
'
