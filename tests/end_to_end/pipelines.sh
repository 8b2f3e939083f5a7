#!/bin/bash
# pipelines.sh BUILD_DIR WORK_DIR: what docs/pipelines.md says, on rendered photos: plain COLMAP, global mappers, lists of
# pairs for hloc and COLMAP, and a program that calls `colmap` by name. What is not installed (GLOMAP, COLMAP 4's global
# mapper, nerfstudio, hloc) is stood in for by tests/stand_ins, which check what they are given.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"

command -v colmap >/dev/null || { echo "COLMAP is not installed."; exit 77; }
stand_ins=$root/tests/stand_ins
images=$work/images
database=$work/database.db
mapped=$work/mapped.db

# Enough photos of one monument for a model, and a few of another, which are not.
"$build/scripts/photo_renderer/render_photos" --output_path "$work/rendered" --truth_path "$work/cameras.tsv"
mkdir -p "$images"
wanted=(11 3 0)
while IFS=$'\t' read -r name monument _; do
  ((wanted[monument]-- > 0)) || continue
  cp "$work/rendered/$name" "$images"
done < <(tail -n +3 "$work/cameras.tsv")
extract "$database" "$images" 1024 800

bin=$(realpath "$work")/bin
mkdir -p "$bin"
ln -s "$(realpath "$matcher")" "$bin/graphmatch_matcher"
command -v glomap >/dev/null || ln -s "$stand_ins/glomap" "$bin/glomap"
command -v ns-process-data >/dev/null || ln -s "$stand_ins/ns-process-data" "$bin/ns-process-data"
help=$(colmap help 2>&1)
grep -q -w global_mapper <<<"$help" || ln -s "$stand_ins/colmap" "$bin/colmap"
/usr/bin/python3 -c 'import hloc' 2>/dev/null || export PYTHONPATH=$stand_ins
export PATH=$bin:$PATH

edges() {
  sqlite3 "$1" 'SELECT count(*) FROM two_view_geometries WHERE rows >= 15 AND config BETWEEN 2 AND 6'
}

registered() {
  colmap model_analyzer --path "$1" 2>&1 | sed -n -E 's/.*Registered images: ([0-9]+).*/\1/p'
}

# check_list FILE COUNT: so many lines of two different names of images, no pair twice.
check_list() {
  local lines
  lines=$(wc -l <"$1")
  [[ $lines == "$2" ]] || fail "$1 has $lines lines, not $2"
  awk -F ' ' -v directory="$images" '
    NF != 2 || $1 == $2 { print "line " NR " is no pair: " $0; bad = 1 }
    ($1, $2) in seen || ($2, $1) in seen { print "line " NR " comes twice: " $0; bad = 1 }
    { seen[$1, $2] = 1
      for (i = 1; i <= 2; ++i) if ((getline line < (directory "/" $i)) < 0) { print "no image " $i; bad = 1 } }
    END { exit bad }' "$1" || fail "$1 is not as hloc wants it"
}

echo "== COLMAP"
cp "$database" "$mapped"
expect_exit 0 'Matching graph' graphmatch_matcher --database_path "$mapped" \
  --GraphMatching.export_pairs "$work/verified.txt"
mkdir "$work/sparse"
expect_exit 0 '' colmap mapper --database_path "$mapped" --image_path "$images" --output_path "$work/sparse"
[[ $(registered "$work/sparse/0") == 11 ]] || fail "$(registered "$work/sparse/0") of 11 photos are registered"

echo "== Global mappers"
expect_exit 0 '' glomap mapper --database_path "$mapped" --image_path "$images" --output_path "$work/glomap"
[[ ! -e $bin/glomap ]] || grep -q ", $(edges "$mapped") verified pairs" "$work/output.txt" || fail "$(cat "$work/output.txt")"
expect_exit 0 '' colmap global_mapper --database_path "$mapped" --image_path "$images" --output_path "$work/global"
[[ ! -e $bin/colmap ]] || grep -q ", $(edges "$mapped") verified pairs" "$work/output.txt" || fail "$(cat "$work/output.txt")"
# They say so if there is nothing to map.
[[ ! -e $bin/glomap ]] || expect_exit 1 'no verified pair' glomap mapper --database_path "$database" \
  --image_path "$images" --output_path "$work/none"

echo "== Lists of pairs"
cp "$database" "$work/listed.db"
before=$(sha256sum <"$work/listed.db")
expect_exit 0 '' graphmatch_matcher --database_path "$work/listed.db" --GraphMatching.dry_run 1 \
  --GraphMatching.export_pairs "$work/candidates.txt" --colmap_path "$work/no-colmap"
[[ $(sha256sum <"$work/listed.db") == "$before" ]] || fail "a dry run has changed the database"
num_candidates=$(wc -l <"$work/candidates.txt")
((num_candidates >= 13)) || fail "$num_candidates candidates for 14 images"
check_list "$work/candidates.txt" "$num_candidates"
check_list "$work/verified.txt" "$(edges "$mapped")"
for list in candidates verified; do
  expect_exit 0 '' /usr/bin/python3 -m hloc.match_features --pairs "$work/$list.txt" --export_dir "$work/hloc" \
    --features feats-superpoint-n4096-r1024 --conf superglue
done

# COLMAP tests each pair of the list, and no other.
expect_exit 0 '' colmap matches_importer --database_path "$work/listed.db" --match_list_path "$work/candidates.txt" \
  --match_type pairs "$(spelling matches_importer use_gpu)" 0
[[ $(count_tested "$work/listed.db") == "$num_candidates" ]] ||
  fail "COLMAP has tested $(count_tested "$work/listed.db") of $num_candidates listed pairs"
# So does this program.
cp "$database" "$work/relisted.db"
expect_exit 0 '' graphmatch_matcher --database_path "$work/relisted.db" \
  --GraphMatching.match_list_path "$work/candidates.txt"
[[ $(count_tested "$work/relisted.db") == "$num_candidates" ]] || fail "the list and what was tested differ"

echo "== A program that calls colmap by name"
mkdir -p "$work/wrapper"
ln -s "$root/scripts/colmap" "$work/wrapper/colmap"
(
  PATH=$(realpath "$work/wrapper"):$PATH
  expect_exit 0 'Matching graph' ns-process-data images --data "$images" --output-dir "$work/processed" \
    --matching-method vocab_tree --no-gpu
)
[[ $(registered "$work/processed/colmap/sparse/0") == 11 ]] || fail "not all images are registered"
# The real COLMAP would have asked for the tree, which is not there.
[[ ! -e $work/processed/colmap/vocab_tree.fbow ]] || fail "there is a tree"
echo "All pipelines work."
