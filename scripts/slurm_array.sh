#!/usr/bin/env bash
# Submits the lines that `option2vec jobs` prints as an array of Slurm jobs:
#
#   build/release/option2vec jobs single_task | scripts/slurm_array.sh --chunk 4 --time=24:00:00
#
# Task i runs line i. With --chunk N it runs N lines, up to line i N, one after the other: this keeps a
# long list below the site's limit (MaxArraySize of `scontrol show config`). All other arguments go to
# sbatch. The lines are submitted with the script, so that later lists do not change it.
# A run that has ended is left alone, so that a requeued task continues where it was. After a
# cancellation or a time limit, submit what `jobs` then prints: each run continues from its last
# checkpoint.
set -euo pipefail

chunk=1
if [ "${1:-}" = --chunk ]; then
  chunk=${2:-}
  shift 2 || true
fi
if ! [[ $chunk =~ ^0*[1-9][0-9]{0,8}$ ]]; then
  echo "slurm_array: --chunk takes a number of lines, not '$chunk'" >&2
  exit 2
fi
chunk=$((10#$chunk))
mapfile -t lines
if [ ${#lines[@]} -eq 0 ]; then
  echo "slurm_array: no lines, nothing to run" >&2
  exit 0
fi
run_job=$(cd "$(dirname "$0")" && pwd)/run_job.sh

# A run uses one processor. A task fails when one of its runs does.
sbatch --array="1-$(((${#lines[@]} + chunk - 1) / chunk))" "$@" <<EOF
#!/usr/bin/env bash
#SBATCH --job-name=option2vec
#SBATCH --cpus-per-task=1
#SBATCH --mem=1G
#SBATCH --requeue
mapfile -t lines <<'LINES'
$(printf '%s\n' "${lines[@]}")
LINES
status=0
for line in "\${lines[@]:(SLURM_ARRAY_TASK_ID - 1) * $chunk:$chunk}"; do
  $(printf %q "$run_job") "\$line" || status=1
done
exit \$status
EOF
