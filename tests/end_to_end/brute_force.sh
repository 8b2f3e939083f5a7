#!/bin/bash
# brute_force.sh BUILD_DIR WORK_DIR COLMAP: the matches of the exact matcher and those of the brute-force
# matcher of a COLMAP of 3.12 or later, for all pairs of some photos, row by row.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"
colmap4=${3:?the path of a COLMAP with --SiftMatching.cpu_brute_force_matcher}

photos=${GRAPHMATCH_PHOTOS:-$root/../shared/photos}
mkdir "$work/images"
if [[ -f $photos/dev.scenes.tsv ]]; then
  awk -F '\t' '$2 ~ /^(entry|fountain)$/ { print $1 }' "$photos/dev.scenes.tsv" |
    while read -r name; do cp "$photos/dev/$name" "$work/images/"; done
else
  "$build/scripts/photo_renderer/render_photos" --output_path "$work/rendered" >/dev/null
  find "$work/rendered" -name '*.jpg' | sort | head -n 20 | xargs -I {} cp {} "$work/images/"
fi
extract "$work/exact.db" "$work/images" 1500 3200
cp "$work/exact.db" "$work/brute_force.db"

"$matcher" --database_path "$work/exact.db" --GraphMatching.strategy exhaustive \
  --GraphMatching.matcher exact
"$colmap4" exhaustive_matcher --database_path "$work/brute_force.db" --FeatureMatching.use_gpu 0 \
  --SiftMatching.cpu_brute_force_matcher 1 >"$work/brute_force.log" 2>&1 ||
  { tail -n 5 "$work/brute_force.log"; fail "$colmap4 exhaustive_matcher"; }

matches() { sqlite3 "$1" 'SELECT pair_id, rows, hex(data) FROM matches ORDER BY 1'; }
matches "$work/exact.db" >"$work/exact.txt"
matches "$work/brute_force.db" >"$work/brute_force.txt"
echo "$(sqlite3 "$work/exact.db" 'SELECT count(*), sum(rows) FROM matches') pairs, matches here;" \
  "$(sqlite3 "$work/brute_force.db" 'SELECT count(*), sum(rows) FROM matches') by COLMAP's brute force"
cmp "$work/exact.txt" "$work/brute_force.txt" || fail "the matches differ"
echo "The same, row by row."
