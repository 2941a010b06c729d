#!/bin/bash
# Submits a whole suite: submit.sh SUITE OUT [DATA]
set -euo pipefail
suite=$1 out=$2 data=${3:-}
here=$(cd "$(dirname "$0")" && pwd)
args=("$suite" "$out" ${data:+"$data"})
cells=$(lagrangegs bench "$suite" --out "$out" --list | tail -n +2)
all=$(wc -l <<<"$cells")
sources=$(awk '$3 == "own"' <<<"$cells" | wc -l)
after=$(sbatch --parsable --array="0-$((sources - 1))" "$here/bench.sbatch" "${args[@]}")
if ((all > sources)); then
    # `afterany`: a cell whose source failed says so, and the others run.
    after=$(sbatch --parsable --dependency="afterany:$after" --array="$sources-$((all - 1))" "$here/bench.sbatch" "${args[@]}")
fi
sbatch --dependency="afterany:$after" --job-name=lagrangegs-tables \
    --wrap "lagrangegs bench $(printf %q "$suite") --out $(printf %q "$out") --tables"
