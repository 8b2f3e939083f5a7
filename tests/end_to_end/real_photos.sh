#!/bin/bash
# Four places of real photos, with the installed COLMAP: what graphmatch_matcher finds is held against the
# edges of exhaustive matching at full size, COLMAP is killed while it works, and the run is interrupted.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"

photos=${GRAPHMATCH_PHOTOS:-}
if [[ -z $photos || ! -f $photos/dev.edges.tsv ]]; then
  echo "SKIPPED: no real photos at '$photos'. Set GRAPHMATCH_PHOTOS (see CONTRIBUTING.md)."
  exit 77
fi
command -v colmap >/dev/null || { echo "COLMAP is not installed."; exit 77; }

mkdir "$work/images"
awk -F '\t' '$2 ~ /^(entry|fountain|kermit|vggsfm_statue)$/ { print $1 "\t" $2 }' \
  "$photos/dev.scenes.tsv" >"$work/scenes.tsv"
cut -f 1 "$work/scenes.tsv" | while read -r name; do cp "$photos/dev/$name" "$work/images/"; done
echo "$(wc -l <"$work/scenes.tsv") photos"

options=$(colmap feature_extractor -h 2>&1)
spelling() { grep -o -m 1 -E -- "--[A-Za-z]+\.$1\b" <<<"$options"; }
colmap feature_extractor --database_path "$work/features.db" --image_path "$work/images" \
  "$(spelling use_gpu)" 0 "$(spelling max_num_features)" 1024 "$(spelling max_image_size)" 800 \
  >"$work/extraction.log" 2>&1

# recall DATABASE: the share of the strong true edges (50 inliers and more at full size) that it has, and a
# failure if it has an edge between places that share nothing.
recall() {
  sqlite3 -separator $'\t' "$1" "SELECT a.name, b.name FROM two_view_geometries t
    JOIN images a ON a.image_id = t.pair_id / 2147483647
    JOIN images b ON b.image_id = t.pair_id % 2147483647
    WHERE t.rows >= 15 AND t.config NOT IN (0, 1, 7)" >"$work/edges.tsv"
  awk -F '\t' '
    FILENAME ~ /scenes/ { place[$1] = $2; next }
    FILENAME ~ /dev.edges/ {
      if ($1 !~ /^#/ && $1 in place && $2 in place) {
        linked[place[$1], place[$2]] = linked[place[$2], place[$1]] = 1
        if ($3 >= 50) strong[$1, $2] = 1
      }
      next
    }
    {
      found[$1, $2] = found[$2, $1] = 1
      if (!((place[$1], place[$2]) in linked)) {
        print "an edge between places: " $0 > "/dev/stderr"; bad = 1
      }
    }
    END {
      if (bad) exit 1
      for (pair in strong) { total++; hit += (pair in found) }
      printf "%.4f\n", hit / total
    }' "$work/scenes.tsv" "$photos/dev.edges.tsv" "$work/edges.tsv"
}

# check DATABASE: nothing was lost, and nothing is left to do. Not the same pairs to the last: COLMAP's CPU
# matching is randomised.
check() {
  check_integrity "$1"
  local found
  found=$(recall "$1")
  echo "$(count_tested "$1") pairs, recall of strong edges: $found"
  awk -v r="$found" 'BEGIN { exit !(r >= 0.97) }' || fail "recall $found"
  expect_exit 0 'Pairs tested       0 of 820' "$matcher" --database_path "$1"
}

echo "== An undisturbed run"
cp "$work/features.db" "$work/undisturbed.db"
"$matcher" --database_path "$work/undisturbed.db" | tee "$work/undisturbed.txt"
check "$work/undisturbed.db"

echo "== COLMAP killed while it works, then Ctrl-C, then the same command again"
cp "$work/features.db" "$work/disturbed.db"
"$matcher" --database_path "$work/disturbed.db" >"$work/disturbed.txt" 2>&1 &
pid=$!
kills=0
next=0
while kill -0 "$pid" 2>/dev/null; do
  tested=$(count_tested "$work/disturbed.db")
  # Before the next kill, more shards are finished than can have been under way.
  if ((kills < 3 && tested >= next)) &&
    pkill -KILL --oldest --parent "$pid" --full matches_importer; then
    kills=$((kills + 1))
    next=$((tested + 8 * ($(nproc) + 1)))
  fi
  if ((kills == 3 && tested >= next)); then kill -INT "$pid" 2>/dev/null || true; fi
  sleep 0.2
done
code=0
wait "$pid" || code=$?
[[ $code == 130 ]] || { cat "$work/disturbed.txt"; fail "exit code $code after Ctrl-C"; }
((kills == 3)) || fail "COLMAP was killed $kills times"
check_integrity "$work/disturbed.db"
echo "interrupted at $(count_tested "$work/disturbed.db") pairs"
expect_exit 0 'Pairs tested' "$matcher" --database_path "$work/disturbed.db"
check "$work/disturbed.db"

echo "== The mapper"
mkdir "$work/sparse"
colmap mapper --database_path "$work/undisturbed.db" --image_path "$work/images" \
  --output_path "$work/sparse" >"$work/mapper.log" 2>&1
registered=0
for model in "$work"/sparse/*/; do
  count=$(colmap model_analyzer --path "$model" 2>&1 |
    sed -n -E 's/.*Registered images: ([0-9]+).*/\1/p' | head -n 1)
  echo "$model: $count"
  registered=$((registered + count))
done
((registered >= 30)) || fail "$registered of 41 images registered"
