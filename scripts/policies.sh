#!/bin/sh
# Writes results/policies/<task>-<fidelity>.safetensors of the finished Option2Vec runs, seed 0, under
# a folder of results (default results), and their table policies.csv: `make policies`.
set -eu
cd "$(dirname "$0")/.."
program=$1
runs=${2:-results}
out=results/policies
mkdir -p "$out"

# The mean of 20 episodes, and their deviation: of "# mean 12.3 +- 4.5 (std, n 20)".
returns() {
  "$program" eval --checkpoint "$1" --task "$2" --episodes 20 --action "$3" |
    sed -n 's/^# mean \(.*\) +- \(.*\) (std.*/\1,\2/p'
}

for folder in "$runs"/*/*/*/option2vec/seed-000; do
  grep -q '"status": "done"' "$folder/manifest.json" 2>/dev/null || continue
  task=$(basename "$(dirname "$(dirname "$folder")")")
  fidelity=$(basename "$(dirname "$(dirname "$(dirname "$folder")")")")
  case $fidelity in *-*) continue ;; esac  # a switch is turned
  "$program" export --policy "$folder" --out "$out/$task-$fidelity.safetensors"
  echo "$out/$task-$fidelity.safetensors"
done

# A transfer run's networks are those that its second task left; both ends are evaluated.
{
  echo "policy,task,mean_action,mean_action_std,sampled,sampled_std"
  for file in "$out"/*.safetensors; do
    name=$(basename "$file" .safetensors)
    pair=$("$program" list tasks | awk -v name="${name%-*}" '$1 == name && NF == 3 { print $2, $3 }')
    for task in ${pair:-${name%-*}}; do
      mean=$(returns "$file" "$task" mean)
      sampled=$(returns "$file" "$task" sample)
      echo "$name,$task,$mean,$sampled"
    done
  done
} > "$out/policies.csv.new"
mv "$out/policies.csv.new" "$out/policies.csv"
