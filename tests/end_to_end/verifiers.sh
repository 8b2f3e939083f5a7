#!/bin/bash
# Hostile keypoints, cameras and stored matches with each verifier: an error that says where, or pairs that fail; other
# pairs get what they would get anyway. Then natively, without a COLMAP, what other tests try while COLMAP is at work:
# runs that are killed and interrupted, and databases that change meanwhile. A test double stands in for COLMAP, but at
# the end.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"

export TMPDIR=$work/tmp
mkdir -p "$TMPDIR"
fake=$build/tests/fake_colmap
database=$work/run.db
# Pairs of one place (of 12 images each) have 60 matches, others none. The double finds edges within tens of ids.
"$build/tests/make_synthetic_database" "$work/new.db" 2 12
# Every image has a camera of its own, whose focal length is known.
sqlite3 "$work/new.db" "
  INSERT INTO cameras SELECT 100 + image_id, model, width, height, params, 1 FROM images JOIN cameras USING(camera_id);
  UPDATE images SET camera_id = 100 + image_id"

# use VERIFIER: it makes `run` the command. Without COLMAP there is none to be found.
use() {
  verifier=$1
  echo "== $verifier"
  run=("$matcher" --database_path "$database" --GraphMatching.strategy exhaustive --GraphMatching.verifier "$1")
  if [[ $1 == native ]]; then run=(env PATH="$work/none" "${run[@]}"); else run+=(--colmap_path "$fake"); fi
}

# fresh FILE [SQL]: the database is a copy of the file with a change.
fresh() {
  rm -f "$database"*
  cp "$1" "$database"
  if [[ -e $1.graphmatch ]]; then cp "$1.graphmatch" "$database.graphmatch"; fi
  # What is not allowed in a table of COLMAP's may be there all the same.
  sqlite3 "$database" "PRAGMA foreign_keys = OFF; PRAGMA ignore_check_constraints = ON; ${2:-}"
}

query() { sqlite3 "$database" "$1"; }

# content [CONDITION]: everything that was found, of pairs of the images a and b.
content() {
  query "WITH pairs AS (SELECT *, pair_id / 2147483647 AS a, pair_id % 2147483647 AS b FROM two_view_geometries)
    SELECT pair_id, pairs.rows, hex(pairs.data), config, hex(F), hex(E), hex(H), matches.rows, hex(matches.data)
    FROM pairs LEFT JOIN matches USING(pair_id) WHERE ${1:-1} ORDER BY 1"
}

# count CONDITION: pairs of the images a and b.
count() {
  query "SELECT count(*) FROM (SELECT *, pair_id / 2147483647 AS a, pair_id % 2147483647 AS b
    FROM two_view_geometries) WHERE $1"
}

# expect NUMBER CONDITION
expect() { [[ $(count "$2") == "$1" ]] || fail "$verifier: $(count "$2") pairs, not $1: $2"; }

# The images that stay as they are; of the others each has a fault of its own.
healthy='NOT (a BETWEEN 4 AND 12 OR a > 19 OR b BETWEEN 4 AND 12 OR b > 19)'

# Of nine doubles of eight bytes, no exponent is that of NaN and infinity.
numbers() {
  local i conditions=1
  for i in {0..8}; do conditions+=" AND coalesce(substr(hex($1), 16 * $i + 13, 4) NOT GLOB 'F?[7F]F', 1)"; done
  echo "($conditions)"
}

# expect_whole: all pairs were tested, those of healthy images as ever, and nothing was half-written or is no number.
expect_whole() {
  check_integrity "$database"
  expect 276 1
  content "$healthy" | cmp - "$work/$verifier.healthy" || fail "$verifier: others have another result"
  expect 0 "NOT ($(numbers F) AND $(numbers E) AND $(numbers H))"
  expect 0 'length(data) <> 8 * rows OR rows > 0 AND data IS NULL'
  expect_empty "$TMPDIR"
}

# set_keypoints IMAGE HEX: SQL; 60 rows of x, y, scale and orientation, in single precision.
set_keypoints() { echo "UPDATE keypoints SET data = x'$2' WHERE image_id = $1;"; }
times() { printf "$2%.0s" $(seq "$1"); }
rest=0000803F00000000
nan=0000C07F
infinity=0000807F
of_image=$(sqlite3 "$work/new.db" 'SELECT hex(data) FROM keypoints WHERE image_id = 1')
collinear=
outside=
for ((at = 0; at < ${#of_image}; at += 32)); do
  x=${of_image:at:8}
  collinear+=$x$x$rest
  # Negative, on the other side of the image's left edge.
  outside+=${x:0:6}C${x:7:1}${of_image:at+8:24}
done
keypoints=$(
  set_keypoints 4 "$(times 60 $nan$nan$rest)"
  set_keypoints 5 "$(times 60 ${infinity}000080FF$rest)"
  set_keypoints 6 "$(times 60 CAF24971CAF249F1$rest)" # 1e30
  set_keypoints 7 "$(times 15 $nan$infinity$rest)${of_image:480}"
  set_keypoints 8 "$(times 60 0000484300004843$rest)"
  set_keypoints 9 "$collinear"
  set_keypoints 10 "$outside"
  set_keypoints 11 "${of_image:0:1888}$nan${nan}CAF24971$nan"
  set_keypoints 12 "$(times 60 00000000000000000000000000000000)"
)

# expect_said NUMBER FIRST: a warning of so many cameras that make no sense.
expect_said() {
  grep -q -F "$1 images have cameras that the fast fit cannot work with (the first is that of $2): " \
    "$work/output.txt" || { cat "$work/output.txt"; fail "$verifier: it does not say $2"; }
}

# set_camera IMAGE SQL
set_camera() { echo "UPDATE cameras SET $2 WHERE camera_id = 100 + $1;"; }
focal=0000000000208C40
others=0000000000007940 # The principal point is at 400, 300.
others+=0000000000C07240
cameras=$(
  set_camera 4 "params = zeroblob(8) || x'${others}0000000000000000'"
  set_camera 5 "params = x'000000000000F87F${others}0000000000000000'"
  set_camera 6 "params = x'0000000000208CC0${others}0000000000000000'"
  set_camera 7 "params = x'$focal${others}000000000000F07F'"
  set_camera 8 "params = x'$focal${others}00000000000000000000000000000000'"
  set_camera 9 "params = x'$focal$others'"
  set_camera 10 'model = 99'
  set_camera 11 'params = NULL'
  echo 'DELETE FROM cameras WHERE camera_id IN (112, 121);'
  set_camera 20 'width = 0, height = 0'
  set_camera 22 'model = -1'
  set_camera 23 "params = x'59F3F8C21F6EA501${others}0000000000000000'" # 1e-300
  set_camera 24 "params = x'9C7500883CE4377E${others}9C7500883CE4377E'" # 1e300
)

# Matches that were stored before: stored IMAGE1 IMAGE2 ROWS BLOB, as SQL.
good=
for feature in {0..39}; do good+=$(printf '%02x000000%02x000000' "$feature" "$feature"); done
stored() { echo "INSERT INTO matches VALUES(2147483647 * $1 + $2, $3, 2, $4);"; }

for one in ${GRAPHMATCH_VERIFIERS:-native screened colmap}; do
  use "$one"
  fresh "$work/new.db"
  expect_exit 0 'Pairs tested       276 of 276' "${run[@]}"
  content "$healthy" >"$work/$verifier.healthy"
  content >"$work/$verifier.all"
  content 'NOT (a = 2 AND b = 3 OR a = 1 AND b = 11 OR a = 3 AND b = 12)' >"$work/$verifier.others"
  (($(wc -l <"$work/$verifier.healthy") == 45)) || fail 'not the pairs of 10 images'
  # Every pair of a place is an edge: of the double, of a place and a ten.
  [[ $verifier == native ]] || expect 70 'rows = 20'
  [[ $verifier != native ]] || expect 132 'rows = 60'
  expect_whole

  fresh "$work/new.db" "$keypoints"
  rm -f "$work/colmap.log"
  FAKE_COLMAP_LOG=$work/colmap.log expect_exit 0 'Pairs tested       276 of 276' "${run[@]}"
  expect_whole
  if [[ $verifier != colmap ]]; then
    expect 0 'rows > 0 AND (a BETWEEN 4 AND 6 OR b BETWEEN 4 AND 6)'
  fi
  if [[ $verifier == native ]]; then
    expect 3 'a < 4 AND b = 7 AND rows = 45'
    expect 3 'a < 4 AND b = 10 AND rows = 60'
    expect 3 'a < 4 AND b = 11 AND rows = 59'
  elif [[ $verifier == screened ]]; then
    # COLMAP gets the matches of what are numbers alone.
    grep -q -x 'given 3 7: 45' "$work/colmap.log" || fail 'not the matches that fit'
    grep -q -x 'given 3 11: 59' "$work/colmap.log" || fail 'not the matches that fit'
    ! grep -q 'given 3 [456]:' "$work/colmap.log" || fail 'COLMAP got a pair that cannot be an edge'
  fi

  fresh "$work/new.db" "$cameras"
  expect_exit 0 'Pairs tested       276 of 276' "${run[@]}"
  [[ $verifier == colmap ]] ||
    expect_said 11 '"place0/photo 3.jpg": a focal length is not above 0'
  expect_whole
  # Without a focal length they are edges all the same, also if neither image has a size.
  [[ $verifier == native ]] || expect 70 'rows = 20'
  [[ $verifier != native ]] || expect 132 'rows = 60 AND config = 6'
  if [[ $verifier == native ]]; then
    fresh "$work/new.db" 'DELETE FROM cameras WHERE camera_id = 103'
    expect_exit 0 'Pairs tested       276 of 276' "${run[@]}"
    expect_said 1 '"place0/photo 2.jpg": it is missing'
  fi

  # Matches that were stored before are taken as they are.
  same=$(times 40 0500000005000000)
  fresh "$work/new.db" "$(stored 2 3 40 "x'$good'") $(stored 1 11 40 "x'$same'") $(stored 3 12 0 NULL)
    $(stored 3 500 40 "x'$good'") $(stored 9 5 1 "'?'")"
  expect_exit 0 'Pairs tested       276 of 276' "${run[@]}"
  check_integrity "$database"
  # Those of one pair are all the same: COLMAP counts them as often as they are there, too.
  [[ $verifier != native ]] || expect 2 '(a = 2 AND b = 3 OR a = 1 AND b = 11) AND rows = 40'
  expect 1 'a = 3 AND b = 12 AND rows = 0'
  content 'NOT (a = 2 AND b = 3 OR a = 1 AND b = 11 OR a = 3 AND b = 12)' | cmp - "$work/$verifier.others" ||
    fail "$verifier: others have another result"

  # Those that cannot be are an error, which costs nothing that was verified before.
  fresh "$work/new.db"
  expect_exit 0 'max_pairs = 100' "${run[@]}" --GraphMatching.max_pairs 100
  query 'PRAGMA wal_checkpoint(TRUNCATE)' >/dev/null
  mv "$database" "$work/part.db"
  mv "$database.graphmatch" "$work/part.db.graphmatch"
  pair=$(sqlite3 "$work/part.db" 'SELECT a.image_id || " " || b.image_id FROM images a JOIN images b
    ON a.image_id < b.image_id AND b.image_id <= 12 WHERE NOT EXISTS
    (SELECT 1 FROM two_view_geometries WHERE pair_id = 2147483647 * a.image_id + b.image_id) LIMIT 1')
  damaged=(41 "x'${good}000000003C000000'" 40 "x'${good}00'" 40 NULL 2305843009213693992 "x'$good'")
  # (They are read as for native.)
  [[ $verifier != screened ]] || damaged=("${damaged[@]:0:2}")
  for ((i = 0; i < ${#damaged[@]}; i += 2)); do
    fresh "$work/part.db" "$(stored "${pair% *}" "${pair#* }" "${damaged[@]:i:2}")"
    content >"$work/before"
    expect_exit 2 "for the images with ids ${pair/ / and } contain a" "${run[@]}"
    check_integrity "$database"
    [[ -z $(content | comm -23 "$work/before" -) ]] || fail "$verifier: pairs were lost"
    expect_empty "$TMPDIR"
  done
  # The error says how to go on.
  advice=$(grep -o '"DELETE FROM matches [^"]*"' "$work/output.txt") || fail 'no advice'
  query "${advice//\"/}"
  expect_exit 0 'more were known' "${run[@]}"
  content | cmp - "$work/$verifier.all" || fail "$verifier: another result"
done

echo "== Natively: a run in the middle"
"$build/tests/make_synthetic_database" "$work/new.db" 4 10
# With such names the log of a third of the pairs is more than a pipe holds: whoever writes one waits for its reader.
sqlite3 "$work/new.db" "UPDATE images SET name = name || hex(zeroblob(400))"

wait_for() {
  local _
  for _ in {1..600}; do
    ! "$@" || return 0
    sleep 0.05
  done
  cat "$work/running.txt"
  fail "in vain: $*"
}
has_begun() { (($(count_tested "$database") > 0)); }

# It cannot end otherwise, as long as nobody reads.
stops() { ! kill -0 "$pid" 2>/dev/null || grep -q 'Stopping' "$work/running.txt"; }

# begin OPTION...: starts a run that stops before its end, until go_on.
begin() {
  run=(env PATH="$work/none" "$matcher" --database_path "$database" --GraphMatching.verifier native "$@")
  fresh "$work/new.db"
  # A new one: what was killed has left something in the last.
  rm -f "$work/pipe"
  mkfifo "$work/pipe"
  exec 4<>"$work/pipe"
  "${run[@]}" --GraphMatching.pair_log "$work/pipe" >"$work/running.txt" 2>&1 &
  pid=$!
  wait_for has_begun
}
# go_on CODE TEXT: what comes of it.
go_on() {
  local code=0
  cat <&4 >/dev/null &
  local reader=$!
  wait "$pid" || code=$?
  kill "$reader"
  wait "$reader" || true
  [[ $code == "$1" ]] || { cat "$work/running.txt"; fail "exit code $code, not $1"; }
  grep -q -F -- "$2" "$work/running.txt" || { cat "$work/running.txt"; fail "no '$2'"; }
}
# expect_rest: the same command goes on to the same end.
expect_rest() {
  check_integrity "$database"
  local before
  before=$(count_tested "$database")
  ((before > 0 && before < $(wc -l <"$work/expected"))) || fail "$before pairs: it was not in the middle"
  expect_exit 0 'more were known' "${run[@]}"
  check_integrity "$database"
  content | cmp - "$work/expected" || fail 'another result'
  expect_empty "$TMPDIR"
}

run=(env PATH="$work/none" "$matcher" --database_path "$database" --GraphMatching.verifier native)
fresh "$work/new.db"
expect_exit 0 'Pairs tested' "${run[@]}"
content >"$work/expected"

begin
# Another one waits for it.
expect_exit 3 'Another graphmatch_matcher works on this database' "${run[@]}" --GraphMatching.lock_timeout 0.1
kill -KILL "$pid"
wait "$pid" 2>/dev/null || true
expect_rest

begin
kill -INT "$pid"
wait_for stops
go_on 130 'run the same command again'
expect_rest

# Features change, of an image that most pairs are still to come of.
begin --GraphMatching.strategy exhaustive
before=$(sqlite3 "$database" '.timeout 10000' "BEGIN IMMEDIATE; UPDATE descriptors SET data =
  (SELECT data FROM descriptors WHERE image_id = 8) WHERE image_id = 40;
  SELECT count(*) FROM two_view_geometries WHERE pair_id % 2147483647 = 40; COMMIT")
go_on 2 'place3/photo 9.jpg'
grep -q 'changed during the run' "$work/running.txt" || fail 'not why'
check_integrity "$database"
((before < 39)) || fail 'no pair was to come'
expect "$before" 'b = 40'

begin
cp "$work/new.db" "$work/copy.db"
mv "$work/copy.db" "$database"
go_on 2 'replaced by another file during the run'
exec 4>&-
expect_empty "$TMPDIR"

if command -v colmap >/dev/null; then
  echo "== The installed COLMAP, which aborts"
  "$build/tests/make_synthetic_database" "$work/new.db" 1 3
  sqlite3 "$work/new.db" 'INSERT INTO cameras SELECT 2, model, width, height, params, 0 FROM cameras;
    UPDATE images SET camera_id = 2 WHERE image_id = 3'
  for verifier in screened colmap; do
    fault='DELETE FROM cameras WHERE camera_id = 2'
    [[ $verifier == screened ]] || fault=$(set_keypoints 3 "$(times 60 "0000484300004843$nan$nan")")
    fresh "$work/new.db" "$fault"
    expect_exit 0 'COLMAP failed on the pair "place0/photo 0.jpg" and "place0/photo 2.jpg"' "$matcher" \
      --database_path "$database" --GraphMatching.verifier $verifier --SiftMatching.use_gpu 0
    check_integrity "$database"
    expect 0 'a = 3 OR b = 3'
    expect 1 'rows = 60'
    expect_empty "$TMPDIR"
  done
else
  echo "SKIPPED: COLMAP is not installed."
fi
