#!/bin/sh
# Writes results/policies/<task>-<fidelity>.safetensors of the finished Option2Vec runs, seed 0, under
# a folder of results (default results), and their table policies.csv: `make policies`. The task is
# the one that was trained on last.
set -eu
cd "$(dirname "$0")/.."
program=$1
runs=${2:-results}
out=results/policies
mkdir -p "$out"

# The tasks of the pair that has this name or task; or the task itself.
tasks_of() {
  "$program" list tasks |
    awk -v name="$1" 'NF == 3 && ($1 == name || $2 == name || $3 == name) { found = $2 " " $3 }
                      END { print found ? found : name }' | tr ' ' '\n'
}

# The mean of 20 episodes, and their deviation: of "# mean 12.3 +- 4.5 (std, n 20)".
returns() {
  "$program" eval --checkpoint "$1" --task "$2" --episodes 20 --action "$3" |
    sed -n 's/^# mean \(.*\) +- \(.*\) (std.*/\1,\2/p'
}

# Of a transfer run there are two: what the first task leaves, and the end.
for folder in "$runs"/*/*/*/option2vec/seed-000; do
  grep -q '"status": "done"' "$folder/manifest.json" 2>/dev/null || continue
  task=$(basename "$(dirname "$(dirname "$folder")")")
  fidelity=$(basename "$(dirname "$(dirname "$(dirname "$folder")")")")
  case $fidelity in *-*) continue ;; esac  # a switch is turned
  for file in "$folder"/*.safetensors "$folder/last.ckpt"; do
    [ -f "$file" ] || continue
    case $file in
      *.safetensors) last=$(basename "$file" .safetensors) ;;
      *) last=$(tasks_of "$task" | tail -n 1) ;;
    esac
    "$program" export --policy "$file" --out "$out/$last-$fidelity.safetensors"
    echo "$out/$last-$fidelity.safetensors"
  done
done

# A policy of a pair is evaluated on both of its tasks.
{
  echo "policy,task,mean_action,mean_action_std,sampled,sampled_std"
  for file in "$out"/*.safetensors; do
    name=$(basename "$file" .safetensors)
    for task in $(tasks_of "${name%-*}"); do
      mean=$(returns "$file" "$task" mean)
      sampled=$(returns "$file" "$task" sample)
      echo "$name,$task,$mean,$sampled"
    done
  done
} > "$out/policies.csv.new"
mv "$out/policies.csv.new" "$out/policies.csv"
