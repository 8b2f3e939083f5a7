#!/bin/bash
# Runs after one another, at once, on any number of threads, disturbed and interrupted: always the same pairs. A test
# double stands in for COLMAP.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"

use_test_double

echo "== A run, and another that finds nothing to do"
# shellcheck disable=SC2016
expect_exit 0 'Pairs tested' "${run[@]}" --VocabTreeMatching.vocab_tree_path tree.bin \
  --SiftMatching.use_gpu 0 --TwoViewGeometry.min_num_inliers 15
grep -q 'VocabTreeMatching.vocab_tree_path has no effect here: there is no vocabulary tree' "$work/output.txt" ||
  fail "an unused option was not mentioned"
check_integrity "$database"
tested_pairs "$database" >"$work/undisturbed.txt"
(($(count_tested "$database") > 100)) || fail "too few pairs"
expect_exit 0 'Pairs tested       0 of 780' "${run[@]}" --SiftMatching.use_gpu 0
tested_pairs "$database" | cmp - "$work/undisturbed.txt"

echo "== What a run keeps for the next one"
grep -q 'those of 40 images are from the last run' "$work/output.txt" || fail "the vectors were computed again"
grep -q 'is that of the last run' "$work/output.txt" || fail "the vocabulary was learnt again"
# Other features of an image: its vector alone is computed again.
cp "$database" "$work/kept.db"
cp "$database.graphmatch" "$work/kept.db.graphmatch"
sqlite3 "$work/kept.db" "UPDATE descriptors SET data = (SELECT data FROM descriptors WHERE image_id = 8)
  WHERE image_id = 7"
expect_exit 0 'those of 39 images are from the last run' "$matcher" --database_path "$work/kept.db" --colmap_path "$fake"
# Its pairs are not what they were: COLMAP keeps such pairs, and so does this, but not without a word.
grep -q 'other features than in the last run (1, the first is "place0/photo 6.jpg")' "$work/output.txt" ||
  fail "no warning that features have changed"
expect_exit 0 'Learnt a vocabulary' "$matcher" --database_path "$work/kept.db" --colmap_path "$fake" --random_seed 5
# Deleted or damaged, it costs nothing but time.
# shellcheck disable=SC2016
for damage in 'rm "$1"' 'dd if=/dev/urandom of="$1" bs=4096 seek=1 count=3 conv=notrunc status=none' 'truncate -s 5000 "$1"' \
  'truncate -s 0 "$1"'; do
  cp "$database" "$work/kept.db"
  cp "$database.graphmatch" "$work/kept.db.graphmatch"
  bash -c "$damage" bash "$work/kept.db.graphmatch"
  expect_exit 0 'Pairs tested       0 of 780' "$matcher" --database_path "$work/kept.db" --colmap_path "$fake"
  tested_pairs "$work/kept.db" | cmp - "$work/undisturbed.txt"
done
rm "$work/kept.db.graphmatch"
echo 'a letter' >"$work/kept.db.graphmatch"
expect_exit 0 'is in the way' "$matcher" --database_path "$work/kept.db" --colmap_path "$fake"
[[ $(cat "$work/kept.db.graphmatch") == 'a letter' ]] || fail "a file of the user was written to"

echo "== Two at once"
cp "$work/untouched.db" "$work/two.db"
ln -s two.db "$work/link.db"
FAKE_COLMAP_DELAY_MS=30 "$matcher" --database_path "$work/two.db" --colmap_path "$fake" >"$work/two.txt" 2>&1 &
pid=$!
while (($(count_tested "$work/two.db") == 0)); do sleep 0.05; done
expect_exit 3 "Another graphmatch_matcher works on this database: it holds $work/two.db.graphmatch (held by process $pid" \
  "$matcher" --database_path "$work/link.db" --colmap_path "$fake" --GraphMatching.lock_timeout 0.3
expect_exit 0 'Pairs tested       0 of 780' "$matcher" --database_path "$work/two.db" --colmap_path "$fake" \
  --GraphMatching.lock_timeout 600
grep -q 'waiting for it' "$work/output.txt" || fail "no word on the wait"
wait "$pid" || { cat "$work/two.txt"; fail "the first of two runs"; }
tested_pairs "$work/two.db" | cmp - "$work/undisturbed.txt"
check_integrity "$work/two.db"

echo "== The same pairs on any number of threads, and with another name for the same option"
for option in --SiftMatching.num_threads --FeatureMatching.num_threads; do
  cp "$work/untouched.db" "$work/threads.db"
  expect_exit 0 'Pairs tested' "$matcher" --database_path "$work/threads.db" --colmap_path "$fake" \
    "$option" 5
  tested_pairs "$work/threads.db" | cmp - "$work/undisturbed.txt"
done

echo "== Who matches makes no difference to what is tested, if both find the same"
cp "$work/untouched.db" "$work/matcher.db"
expect_exit 0 'Descriptors are matched by COLMAP' "$matcher" --database_path "$work/matcher.db" \
  --colmap_path "$fake" --GraphMatching.matcher colmap
(($(count_tested "$work/matcher.db") > 100)) || fail "too few pairs"
cp "$work/untouched.db" "$work/cache.db"
expect_exit 0 'Descriptors are matched exactly' "$matcher" --database_path "$work/cache.db" \
  --colmap_path "$fake" --GraphMatching.cache_gb 0.000001
tested_pairs "$work/cache.db" | cmp - "$work/undisturbed.txt"

echo "== A budget of pairs: run after run, until nothing is left, the same as without one"
cp "$work/untouched.db" "$work/budget.db"
expect_exit 0 'Stopped            after max_pairs = 150; about' "$matcher" --database_path "$work/budget.db" \
  --colmap_path "$fake" --GraphMatching.max_pairs 150
[[ $(count_tested "$work/budget.db") == 150 ]] || fail "$(count_tested "$work/budget.db") pairs, not 150"
for _ in 2 3; do
  "$matcher" --database_path "$work/budget.db" --colmap_path "$fake" --GraphMatching.max_pairs 150 >"$work/output.txt" 2>&1
done
! grep -q '^Stopped' "$work/output.txt" || fail "the third run did not come to the end"
tested_pairs "$work/budget.db" | cmp - "$work/undisturbed.txt"
cp "$work/untouched.db" "$work/budget.db"
# Pre-processing alone takes longer.
expect_exit 0 'Stopped            by max_minutes = 1e-05; before the first test' "$matcher" --database_path "$work/budget.db" \
  --colmap_path "$fake" --GraphMatching.max_minutes 0.00001
[[ $(count_tested "$work/budget.db") == 0 ]] || fail "pairs after the time was over"

echo "== One pair that COLMAP crashes on"
cp "$work/untouched.db" "$work/crash.db"
FAKE_COLMAP_FAULT=crash FAKE_COLMAP_FAULT_PAIR='1 2' \
  expect_exit 0 'COLMAP failed on the pair "place0/photo 0.jpg" and "place0/photo 1.jpg"' \
  "$matcher" --database_path "$work/crash.db" --colmap_path "$fake"
[[ $(sqlite3 "$work/crash.db" "SELECT count(*) FROM two_view_geometries
     WHERE pair_id = 2147483647 + 2") == 0 ]] || fail "the guilty pair is in the database"
(($(count_tested "$work/crash.db") > 100)) || fail "more than the guilty pair was lost"
# The next run tries it again; this COLMAP finds an edge there, which leads on to no more than a few pairs.
before=$(count_tested "$work/crash.db")
expect_exit 0 'Pairs tested' "$matcher" --database_path "$work/crash.db" --colmap_path "$fake"
(($(count_tested "$work/crash.db") <= before + 10)) || fail "the next run tested too much"

echo "== Asked to stop before the first pair"
cp "$work/untouched.db" "$work/early.db"
FAKE_COLMAP_HELP_DELAY_MS=5000 "$matcher" --database_path "$work/early.db" --colmap_path "$fake" \
  >"$work/early.txt" 2>&1 &
pid=$!
# When it has started COLMAP, it listens to signals.
until pgrep --parent "$pid" >/dev/null; do sleep 0.05; done
kill -INT "$pid"
code=0
wait "$pid" || code=$?
[[ $code == 130 ]] || { cat "$work/early.txt"; fail "exit code $code"; }

echo "== Ctrl-C, SIGTERM and kill -9 at any time; then the same command goes on"
wanted=20
for signal in INT TERM KILL INT KILL KILL HUP; do
  cp "$work/untouched.db" "$work/interrupted.db"
  # Slow enough to be hit. (Whoever started this test may have it ignore SIGHUP, as nohup does; the program would go on
  # with that.)
  env --default-signal=HUP FAKE_COLMAP_DELAY_MS=40 "$matcher" --database_path "$work/interrupted.db" \
    --colmap_path "$fake" >"$work/interrupted.txt" 2>&1 &
  pid=$!
  wanted=$((wanted + 18))
  while kill -0 "$pid" 2>/dev/null && (($(count_tested "$work/interrupted.db" || echo 0) < wanted)); do
    sleep 0.01
  done
  kill "-$signal" "$pid" 2>/dev/null || true
  code=0
  wait "$pid" || code=$?
  if [[ $signal == KILL ]]; then
    [[ $code == 137 ]] || fail "exit code $code after SIGKILL"
  else
    [[ $code == 130 ]] || fail "exit code $code after SIG$signal"
    grep -q 'run the same command again' "$work/interrupted.txt" || fail "no word on how to go on"
  fi
  check_integrity "$work/interrupted.db"
  before=$(count_tested "$work/interrupted.db")
  expect_exit 0 'Pairs tested' "$matcher" --database_path "$work/interrupted.db" --colmap_path "$fake"
  tested_pairs "$work/interrupted.db" | cmp - "$work/undisturbed.txt"
  echo "SIG$signal at $before of $(count_tested "$work/interrupted.db") pairs: went on"
done

echo "== Nothing is left behind, after kill -9 neither"
expect_empty "$TMPDIR"
