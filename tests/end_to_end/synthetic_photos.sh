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
"$build/scripts/photo_renderer/compare_cameras" --truth_path "$work/demo/cameras.tsv" "${models[@]}"

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

# All systems on these photos, COLMAP's vocabulary tree and mapper included.
/usr/bin/python3 -c 'import numpy, matplotlib' 2>/dev/null ||
  { echo "Not compared: python3-numpy and python3-matplotlib are not installed."; exit 0; }
features=$work/demo/database.db
tree=$work/tree.bin
colmap vocab_tree_builder --database_path "$features" --vocab_tree_path "$tree" --num_visual_words 512 --branching 8 \
  >"$work/tree.log" 2>&1 || { tail -n 5 "$work/tree.log"; fail "vocab_tree_builder"; }
evaluation=("$root/scripts/benchmark" --matcher "$matcher" --database_path "$features" --image_path "$work/demo/images"
  --vocab_tree_path "$tree" --output_path "$work/evaluation")
expect_exit 0 'Wrote' "${evaluation[@]}" --mapper graphmatch
/usr/bin/python3 - "$work/evaluation/table.csv" <<'END'
import csv, sys
rows = {row["system"]: row for row in csv.DictReader(open(sys.argv[1]))}
for system in ("Exhaustive", "Vocabulary tree, k = 120", "BRIAD on the tree, k = 40", "Retrieval (Fisher), k = 120",
               "BRIAD (Fisher), k = 40", "GraphMatch (Fisher)", "GraphMatch (VLAD, 16 centres)", "GraphMatch (GIST)"):
    assert float(rows[system]["recall"]) > 0.9, rows[system]
for system in ("Exhaustive", "GraphMatch (Fisher)"):
    assert rows[system]["registered"] == "42", rows[system]
assert float(rows["GraphMatch (Fisher)"]["camera distance median %"]) < 2, rows["GraphMatch (Fisher)"]
END
for figure in registered roc; do [[ -s $work/evaluation/figures/$figure.png ]] || fail "no figure $figure"; done
expect_exit 1 'there is no system nothing' "${evaluation[@]}" --mapper nothing
