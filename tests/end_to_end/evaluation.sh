#!/bin/bash
# evaluation.sh BUILD_DIR WORK_DIR: the commands that compare systems, sweep parameters and replay the paper's scenes.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"
python=/usr/bin/python3
"$python" -c 'import numpy, matplotlib' 2>/dev/null ||
  { echo "python3-numpy and python3-matplotlib are not installed."; exit 77; }

"$python" "$root/tests/evaluation_test.py" || fail "evaluation_test.py"

# column FILE SYSTEM COLUMN: a cell of the table.
column() {
  "$python" -c 'import csv, sys
for row in csv.DictReader(open(sys.argv[1])):
    if row["system"] == sys.argv[2]: print(row[sys.argv[3]])' "$@"
}

features=$work/"my features.db"
"$build/tests/make_synthetic_database" "$features" 8 6
benchmark=("$root/scripts/benchmark" --matcher "$matcher" --database_path "$features" --num_threads 2)

# Without a truth all pairs are matched first (by the test double of COLMAP: 8 places of 6 photos).
out=$work/"the output"
expect_exit 0 'Wrote' "${benchmark[@]}" --output_path "$out" --colmap "$build/tests/fake_colmap"
[[ $(column "$out/table.csv" Exhaustive tested) == 1128 ]] || fail "not all pairs were tested"
[[ $(column "$out/table.csv" Exhaustive recall) == 1.0 ]] || fail "the truth does not agree with itself"
[[ $(column "$out/table.csv" 'GraphMatch (Fisher)' recall) == 1.0 ]] || fail "GraphMatch found less"
for figure in recall_over_tests edges_over_tests edges_over_time stages roc scores graph_distance; do
  [[ -s $out/figures/$figure.png ]] || fail "no figure $figure"
done
grep -q 'data:image/png;base64' "$out/index.html" || fail "the page has no figures"
[[ $(sqlite3 "$features" 'SELECT count(*) FROM two_view_geometries') == 0 ]] || fail "the database was written to"

# What is done is not done again.
touch -d '1 hour ago' "$out"/systems/*.csv
before=$(stat -c %Y.%s "$out"/systems/*.csv)
expect_exit 0 'Wrote' "${benchmark[@]}" --output_path "$out" --colmap "$build/tests/fake_colmap"
[[ $(stat -c %Y.%s "$out"/systems/*.csv) == "$before" ]] || fail "systems were replayed again"

# The ranked lists of another program, and its vectors.
cp "$out/vectors/fisher.npy" "$work/Fisher.npy"
cp "$out/vectors/fisher.txt" "$work/Fisher.txt"
vectors=$work/Fisher.npy
expect_exit 0 'Wrote' "${benchmark[@]}" --output_path "$work/given" --truth_path "$out/truth.tsv" --vectors_path "$vectors"
# (The file's name is Fisher, too.)
mapfile -t tested < <(column "$work/given/table.csv" 'GraphMatch (Fisher)' tested)
[[ ${#tested[@]} == 2 && ${tested[0]} == "${tested[1]}" ]] || fail "vectors that were written and read are other ones"

# What is wrong is said.
expect_exit 1 'There is no database' "${benchmark[@]}" --output_path "$work/wrong" --database_path "$work/none.db"
expect_exit 1 'There is no truth' "${benchmark[@]}" --output_path "$work/wrong" --truth_path "$work/none.tsv"
echo 'x y' >"$work/wrong.tsv"
expect_exit 1 'has no edge' "${benchmark[@]}" --output_path "$work/wrong" --truth_path "$work/wrong.tsv"
expect_exit 1 'Cannot find the program' "${benchmark[@]}" --output_path "$work/wrong" --matcher "$work/none"

expect_exit 0 'Wrote' "$root/scripts/sweep" --matcher "$matcher" --output_path "$work/sweep" --num_threads 2 \
  --collection "places=$features,$out/truth.tsv"
[[ $(grep -c '^| num_components' "$work/sweep/sweep.md") == 6 ]] || fail "the sweep is not complete"
expect_exit 1 'is not NAME=' "$root/scripts/sweep" --matcher "$matcher" --output_path "$work/sweep" --collection x

command -v colmap >/dev/null || { echo "COLMAP is not installed."; exit 77; }
expect_exit 0 '| NYC Library | 2,550 | 15,241 |' "$root/scripts/paper_scenes" --matcher "$matcher" --num_threads 2 \
  --output_path "$work/scenes" --scenes 'NYC' --dim 1100
expect_exit 1 'No scene begins with' "$root/scripts/paper_scenes" --matcher "$matcher" --output_path "$work/scenes" \
  --scenes Nowhere
