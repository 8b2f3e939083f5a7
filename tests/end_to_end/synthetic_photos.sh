#!/bin/bash
# The demo: rendered photos of three monuments through feature_extractor, graphmatch_matcher and mapper. Every
# photo has to be registered in the model of its own monument, where its camera really stood.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"

command -v colmap >/dev/null || { echo "COLMAP is not installed."; exit 77; }

"$root/scripts/demo" --build_path "$build" --output "$work/demo"
check_integrity "$work/demo/database.db"

"$build/tests/check_matching" "$work/demo/database.db" 12

models=()
for model in "$work"/demo/sparse/*/; do
  text=$work/text/$(basename "$model")
  mkdir -p "$text"
  colmap model_converter --input_path "$model" --output_path "$text" --output_type TXT >/dev/null 2>&1
  models+=(--model_path "$text")
done
"$build/tests/synthetic_photos/compare_cameras" --truth_path "$work/demo/cameras.tsv" "${models[@]}"

# Less than exhaustive matching, and no edge between monuments.
tested=$(count_tested "$work/demo/database.db")
echo "$tested of 861 pairs tested"
((tested < 600)) || fail "$tested pairs tested"
sqlite3 "$work/demo/database.db" "SELECT a.name, b.name FROM two_view_geometries t
  JOIN images a ON a.image_id = t.pair_id / 2147483647
  JOIN images b ON b.image_id = t.pair_id % 2147483647 WHERE t.rows >= 15" |
  awk -F '[\t|]' 'NR == FNR { if (FNR > 2) monument[$1] = $2; next }
                  monument[$1] != monument[$2] { print "edge between monuments: " $0; bad = 1 }
                  END { exit bad }' "$work/demo/cameras.tsv" -
