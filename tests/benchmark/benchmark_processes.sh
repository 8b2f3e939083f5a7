#!/bin/bash
# benchmark_processes.sh BUILD_DIR DATABASE [RUNS]: the same pairs verified by one COLMAP process with a thread for
# every core and by one single-threaded process for every core, in turn. DATABASE has features; a copy is matched.
set -euo pipefail

matcher=$1/colmap_graphmatch/graphmatch_matcher
database=$2
runs=${3:-5}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

measure() { # NUM_PROCESSES: seconds
  cp "$database" "$work/copy.db"
  sqlite3 "$work/copy.db" 'DELETE FROM matches; DELETE FROM two_view_geometries'
  local start end
  start=$(date +%s.%N)
  "$matcher" --database_path "$work/copy.db" --SiftMatching.use_gpu 0 \
    --GraphMatching.matcher colmap --GraphMatching.num_processes "$1" >"$work/log.txt" 2>&1
  end=$(date +%s.%N)
  awk -v a="$start" -v b="$end" 'BEGIN { printf "%.2f", b - a }'
}

cores=$(nproc)
echo "one process x $cores threads | $cores processes x 1 thread | ratio"
for ((run = 0; run < runs; ++run)); do
  one=$(measure 1)
  many=$(measure "$cores")
  echo "$one s $many s $(awk -v a="$many" -v b="$one" 'BEGIN { printf "%.3f", a / b }')"
done | tee "$work/rows.txt"
awk '{ print $5 }' "$work/rows.txt" | sort -n |
  awk '{ r[NR] = $1 } END { print "median ratio", r[int((NR + 1) / 2)] }'
