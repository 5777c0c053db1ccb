#!/usr/bin/env bash
# Submits the runs of a sweep that are not done yet as a job array, and a report when all have ended:
#     scripts/slurm/submit.sh SWEEP.toml OUT [options of sbatch, for example --partition=long --array=0-8%4]
# From the root of the checkout, on a file system that the nodes share, after `cargo build --release --bins`.
set -euo pipefail

if [ $# -lt 2 ]; then
    echo "usage: scripts/slurm/submit.sh SWEEP.toml OUT [options of sbatch]" >&2
    exit 2
fi
sweep=$1 out=$2
shift 2
if target/release/sweep "$sweep" --list 2>&1 > /dev/null | grep -q 'a search'; then
    echo "$sweep is a search: its rounds follow from each other; sweep FILE on one machine does them" >&2
    exit 2
fi
waiting=$(target/release/sweep "$sweep" --out "$out" --list | awk 'NR > 1 && $5 != "done" { print $1 }' | paste -sd,)
if [ -z "$waiting" ]; then
    echo "every run of $sweep is done in $out" >&2
    exit 0
fi
mkdir -p "$out"
# The report is a job under the same account and in the same partition, but no array, and waits for the array alone.
options=() skip=
for option; do
    case $option in
        --array=* | -a?* | --dependency=* | -d?*) ;;
        --array | -a | --dependency | -d) skip=1 ;;
        *) [ -n "$skip" ] || options+=("$option"); skip= ;;
    esac
done
array=$(sbatch --parsable --array="$waiting" --output="$out/slurm-%A_%a.log" "$@" "$(dirname "$0")/sweep.sbatch" "$sweep" "$out")
array=${array%%;*} # Of several clusters its name follows.
echo "runs: job $array ($waiting), in $out"
report=$(sbatch --parsable --dependency="afterany:$array" --output="$out/slurm-report-%j.log" "${options[@]}" \
    --wrap "target/release/report '$out'")
echo "report: job $report"
