#!/bin/bash
# benchmark_matching.sh BUILD_DIR DATABASE PAIRS [RUNS [COLMAP...]]: CPU seconds for matching the same pairs here and
# by COLMAP (default: the installed one), in turn. DATABASE has features; PAIRS is a list of pairs as
# `colmap matches_importer` takes it. What matching takes is, for both, the time for all less COLMAP's time for
# verifying the matches that were found here: reading, starting and writing count as matching.
set -euo pipefail

matcher=$1/colmap_graphmatch/graphmatch_matcher
database=$2
runs=${4:-5}
colmaps=("${@:5}")
((${#colmaps[@]} > 0)) || colmaps=(colmap)
work=$(mktemp -d "${TMPDIR:-/tmp}/benchmark-XXXXXX")
trap 'rm -rf "$work"' EXIT
pairs=$work/pairs.txt
cp "$3" "$pairs"
TIMEFORMAT='%U %S'

exec 4>&2

# cpu COMMAND...: the user and system seconds of the command and all that it starts.
cpu() {
  { time "$@" >"$work/log.txt" 2>&1 || { cat "$work/log.txt" >&4; exit 1; }; } 2>&1 | awk '{ print $1 + $2 }'
}

clean_copy() {
  cp "$database" "$work/$1.db"
  sqlite3 "$work/$1.db" 'DELETE FROM matches; DELETE FROM two_view_geometries'
}

"$1/tests/benchmark/benchmark_targets" "$database" "$pairs" "$runs"
for colmap in "${colmaps[@]}"; do
  help=$("$colmap" help)
  version=${help%%$'\n'*}
  options=$("$colmap" matches_importer -h 2>&1)
  group=SiftMatching
  [[ $options != *--FeatureMatching.use_gpu* ]] || group=FeatureMatching
  import=("$colmap" matches_importer --match_list_path "$pairs" --match_type pairs "--$group.use_gpu" 0)
  echo "$version, $(grep -c . "$pairs") pairs"
  echo "all, here | by COLMAP | verification | matching, here | by COLMAP | ratio: matching | all"
  for ((run = 0; run < runs; ++run)); do
    clean_copy exact
    all=$(cpu "$matcher" --database_path "$work/exact.db" --GraphMatching.match_list_path "$pairs" \
      --GraphMatching.matcher exact --colmap_path "$colmap")
    clean_copy colmap
    colmap_all=$(cpu "${import[@]}" --database_path "$work/colmap.db")
    sqlite3 "$work/exact.db" 'DELETE FROM two_view_geometries'
    verification=$(cpu "${import[@]}" --database_path "$work/exact.db")
    echo "$all $colmap_all $verification" | awk '{
      printf "%.2f | %.2f | %.2f | %.2f | %.2f | %.1f | %.1f\n", $1, $2, $3, $1 - $3, $2 - $3,
             ($2 - $3) / ($1 - $3), $2 / $1 }'
  done | tee "$work/rows.txt"
  for column in 11 13; do
    awk -v c=$column '{ print $c }' "$work/rows.txt" | sort -n |
      awk -v n=$column '{ r[NR] = $1 } END { print "median ratio,", n == 11 ? "matching" : "all", r[int((NR + 1) / 2)] }'
  done
done
