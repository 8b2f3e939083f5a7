#!/bin/bash
# The program as scripts see it: options, exit codes, messages. A test double stands in for COLMAP.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"

use_test_double

echo "== Options"
expect_exit 0 'graphmatch_matcher --help-all' "$matcher" -h
"$matcher" -h >"$work/short.txt"
"$matcher" --help | diff "$work/short.txt" - || fail '-h and --help differ'
lines=$(wc -l <"$work/short.txt")
((24 <= lines && lines <= 40)) || fail "-h has $lines lines"
[[ $(wc -L <"$work/short.txt") -le 100 ]] || fail '-h has longer lines than 100'
expect_exit 0 '--TwoViewGeometry.max_error' "$matcher" --help-all
expect_exit 0 'graphmatch_matcher 0.' "$matcher" --version
expect_exit 1 '--database_path is missing' "$matcher"
expect_exit 1 "unrecognised option '--no_such_option'" "${run[@]}" --no_such_option 1
expect_exit 1 'Did you mean --SiftMatching.max_ratio?' "${run[@]}" --SiftMatching.maxratio 0.8
expect_exit 1 'Did you mean --TwoViewGeometry.min_num_inliers?' "${run[@]}" --Mapper.min_num_inlier 20
expect_exit 1 '--GraphMatching.max_num_neighbors is "0"; it must be an integer of at least 1' \
  "${run[@]}" --GraphMatching.max_num_neighbors 0
expect_exit 1 '--SiftMatching.max_ratio is "zero"; it must be a number greater than 0' \
  "${run[@]}" --SiftMatching.max_ratio zero
expect_exit 1 'the same option with different values' "${run[@]}" --SiftMatching.max_error 4 \
  --TwoViewGeometry.max_error 5
expect_exit 1 'must be one of auto, colmap, exact' "${run[@]}" --GraphMatching.matcher gpu
expect_exit 1 'must be a number of at least 0' "${run[@]}" --GraphMatching.cache_gb -1
expect_exit 1 'must be a number greater than 0' "${run[@]}" --SiftMatching.max_ratio 0
expect_exit 1 'contradict each other' "${run[@]}" --GraphMatching.strategy exhaustive \
  --GraphMatching.match_list_path "$work/pairs.txt"
expect_exit 1 'must be an integer; below 1: all cores' "${run[@]}" --SiftMatching.num_threads all

echo "== A project file"
cat >"$work/project.ini" <<END
log_to_stderr=false
random_seed=0
database_path=$database
[SiftMatching]
max_ratio=0.8
max_error=4
num_threads=none
[TwoViewGeometry]
min_num_inliers=15
[VocabTreeMatching]
num_images=100
vocab_tree_path=
[Mapper]
min_num_matches=15
END
expect_exit 1 'it must be an integer; below 1' "$matcher" --project_path "$work/project.ini"
# The command line goes before it, in any spelling.
expect_exit 1 '--SiftMatching.max_distance is "0"; it must be a number greater than 0' "$matcher" --project_path "$work/project.ini" \
  --FeatureMatching.num_threads 2 --TwoViewGeometry.max_error 3 --SiftMatching.max_distance 0
expect_exit 2 'There is no database at' "$matcher" --project_path "$work/project.ini" \
  --database_path "$work/none.db" --SiftMatching.num_threads 2
expect_exit 1 'Cannot read the project file' "${run[@]}" --project_path "$work/none.ini"

echo "== Wrong databases, programs and directories"
expect_exit 2 'There is no database at' "$matcher" --database_path "$work/none.db"
echo "not a database, but long enough to be looked at as one" >"$work/text.db"
expect_exit 2 'is not a SQLite database' "$matcher" --database_path "$work/text.db"
expect_exit 4 'There is no program at /nowhere/colmap' \
  "$matcher" --database_path "$database" --colmap_path /nowhere/colmap
expect_exit 4 'is not COLMAP' "$matcher" --database_path "$database" --colmap_path /bin/echo
expect_exit 5 'Cannot make a working directory' "${run[@]}" --GraphMatching.work_path /nowhere
FAKE_COLMAP_FAULT=exit FAKE_COLMAP_FAULT_PAIR=all \
  expect_exit 4 'COLMAP fails on every pair' "${run[@]}"
(($(count_tested "$database") == 0)) || fail "a failed run left pairs"

echo "== A locked database"
# The writer keeps its lock for as long as its input stays open.
mkfifo "$work/hold"
sqlite3 "$database" <"$work/hold" &
exec 3>"$work/hold"
# It waits for the loop below, whose tries take the lock for a moment.
printf '%s\n' '.timeout 10000' 'BEGIN IMMEDIATE;' >&3
for _ in {1..100}; do
  sqlite3 "$database" 'BEGIN IMMEDIATE' 2>/dev/null || break
  sleep 0.05
done
expect_exit 3 'another process kept it locked for 0.3 s (held by process' \
  "${run[@]}" --GraphMatching.lock_timeout 0.3
exec 3>&-
wait

echo "== The paper's other systems"
for strategy in graphmatch sampling propagation retrieval briad; do
  cp "$work/untouched.db" "$work/$strategy.db"
  rm -f "$work/$strategy.db.graphmatch"
  expect_exit 0 'Pairs tested' "$matcher" --database_path "$work/$strategy.db" --colmap_path "$fake" \
    --GraphMatching.strategy "$strategy" --GraphMatching.num_retrieved_images 3 --GraphMatching.descriptor fisher
  echo "$strategy: $(grep -E 'sampling|propagation|retrieval|expansion|  all' "$work/output.txt" | tr -s ' \n' ' ')"
  check_integrity "$work/$strategy.db"
  expect_exit 0 'Nothing is left to test' "$matcher" --database_path "$work/$strategy.db" --colmap_path "$fake" \
    --GraphMatching.strategy "$strategy" --GraphMatching.num_retrieved_images 3 --GraphMatching.descriptor fisher
done
(($(count_tested "$work/briad.db") > $(count_tested "$work/retrieval.db"))) || fail "no query expansion"
(($(count_tested "$work/propagation.db") < $(count_tested "$work/graphmatch.db"))) || fail "more than one sampling"

echo "== Only the images of a list look for partners"
cp "$work/untouched.db" "$work/some.db"
printf 'place0/photo 3.jpg\n# a comment\n\n place2/photo 5.jpg\nno/photo.jpg\n' >"$work/images.txt"
expect_exit 0 'Pairs tested' "$matcher" --database_path "$work/some.db" --colmap_path "$fake" \
  --VocabTreeMatching.match_list_path "$work/images.txt"
grep -q '1 line(s) of .* skipped; the first is "no/photo.jpg"' "$work/output.txt" ||
  fail "a line that names no image was not mentioned"
(($(count_tested "$work/some.db") >= 10)) || fail "too few pairs"
strangers=$(sqlite3 "$work/some.db" "SELECT count(*) FROM two_view_geometries
  WHERE pair_id / 2147483647 NOT IN (4, 26) AND pair_id % 2147483647 NOT IN (4, 26)")
[[ $strangers == 0 ]] || fail "$strangers pairs of images that are not listed"

echo "== COLMAP's options of matching reach the matcher here"
# colmaps_pairs OPTION...: the pairs with enough matches, of the 180 within a place.
colmaps_pairs() {
  cp "$work/untouched.db" "$work/options.db"
  "$matcher" --database_path "$work/options.db" --colmap_path "$fake" \
    --GraphMatching.strategy exhaustive "$@" 2>/dev/null | sed -n -E 's/^COLMAP +([0-9]+) pairs.*/\1/p'
}
expect_pairs() {
  local expected=$1 found
  shift
  found=$(colmaps_pairs "$@")
  [[ $found == "$expected" ]] || fail "$found pairs, not $expected: $*"
}
expect_pairs 180
expect_pairs 0 --SiftMatching.max_distance 0.001
expect_pairs 0 --SiftMatching.max_ratio 0.01
expect_pairs 0 --FeatureMatching.max_num_matches 5
# Without the cross check and without limits every feature matches, in all pairs.
expect_pairs 780 --SiftMatching.cross_check 0 --SiftMatching.max_ratio 10 --SiftMatching.max_distance 4

echo "== All pairs, and those of a list"
cp "$work/untouched.db" "$work/exhaustive.db"
expect_exit 0 'Pairs tested       780 of 780' "$matcher" --database_path "$work/exhaustive.db" \
  --colmap_path "$fake" --GraphMatching.strategy exhaustive
check_integrity "$work/exhaustive.db"
expect_exit 0 'Pairs tested       0 of 780' "$matcher" --database_path "$work/exhaustive.db" \
  --colmap_path "$fake" --GraphMatching.strategy exhaustive
grep -q 'Nothing is left to test' "$work/output.txt" || fail "no word that nothing is left"
expect_exit 1 'is ""; it must be the path of a list of pairs' "${run[@]}" --GraphMatching.match_list_path ''
expect_exit 1 '"exhaustive" on the command line belongs to no option' \
  "${run[@]}" --GraphMatching.strategy graphmatch exhaustive
cp "$work/untouched.db" "$work/listed.db"
cat >"$work/pairs.txt" <<END
# two names a line
place0/photo 0.jpg place0/photo 1.jpg
place1/photo 3.jpg place0/photo 1.jpg
place1/photo 3.jpg no/photo.jpg
END
expect_exit 5 'Cannot read the list' "$matcher" --database_path "$work/listed.db" \
  --colmap_path "$fake" --GraphMatching.match_list_path "$work/none.txt"
expect_exit 0 'Pairs tested       2 of 780' "$matcher" --database_path "$work/listed.db" \
  --colmap_path "$fake" --GraphMatching.match_list_path "$work/pairs.txt"
grep -q '1 line(s) of .* skipped; the first is "place1/photo 3.jpg no/photo.jpg"' "$work/output.txt" ||
  fail "a line that names no pair was not mentioned"

echo "== A dry run, and lists and graphs for other programs"
cp "$work/untouched.db" "$work/dry.db"
sha256sum "$work/dry.db" >"$work/dry.sum"
expect_exit 0 'Candidates         ' "$matcher" --database_path "$work/dry.db" --colmap_path /nowhere \
  --GraphMatching.dry_run 1 --GraphMatching.export_pairs "$work/candidates.txt"
sha256sum --check --quiet "$work/dry.sum" || fail "a dry run wrote to the database"
num=$(sed -n 's/^Candidates  *\([0-9]*\) pairs.*/\1/p' "$work/output.txt")
[[ $(wc -l <"$work/candidates.txt") == "$num" ]] || fail "not $num candidates"
expect_exit 0 "Pairs tested       $num of" "$matcher" --database_path "$work/dry.db" --colmap_path "$fake" \
  --GraphMatching.match_list_path "$work/candidates.txt" --GraphMatching.export_pairs "$work/edges.txt" \
  --GraphMatching.export_graph "$work/graph.dot" --GraphMatching.report "$work/report.html"
grep -q '"graphmatch-report"' "$work/report.json" || fail "no report beside the page"
grep -q 'id="report-data"' "$work/report.html" || fail "the page has no data"
[[ $(wc -l <"$work/edges.txt") == "$(tested_pairs "$work/dry.db" | grep -c '|1$')" ]] || fail "not all edges"
[[ $(grep -c -e '--' "$work/graph.dot") == "$(wc -l <"$work/edges.txt")" ]] || fail "another graph"
expect_exit 1 'must end in .graphml' "$matcher" --database_path "$work/dry.db" --colmap_path "$fake" \
  --GraphMatching.export_graph "$work/graph.png"
expect_exit 1 'With --GraphMatching.dry_run nothing is tested' "$matcher" --database_path "$work/dry.db" \
  --GraphMatching.dry_run 1 --GraphMatching.report "$work/report.json"
expect_exit 5 'Cannot write' "$matcher" --database_path "$work/dry.db" --colmap_path "$fake" \
  --GraphMatching.export_pairs "$work/none/pairs.txt"

