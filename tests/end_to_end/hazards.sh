#!/bin/bash
# What must not be destroyed, hang or be told wrongly: files of users' that are in the way of outputs, a database that
# changes or goes during a run, signals while it waits, limits of the system. A test double stands in for COLMAP where
# COLMAP is not what is tried.
# shellcheck source-path=SCRIPTDIR disable=SC2016  # $ is for another shell.
source "$(dirname "$0")/common.sh"

fake=$build/tests/fake_colmap
export TMPDIR=$work/tmp
place=$work/place
mkdir -p "$TMPDIR" "$work/programs"
"$build/tests/make_synthetic_database" "$work/small.db" 2 6
"$build/tests/make_synthetic_database" "$work/big.db" 4 10

# fresh MASTER: a directory with nothing but a copy of it, in which the test goes on.
fresh() {
  rm -rf "$place"
  mkdir "$place"
  cd "$place"
  cp "$work/$1.db" database.db
  run=("$matcher" --database_path database.db --colmap_path "$fake")
}

# The content of a file, or of a database.
content() {
  if [[ $(head -c 15 "$1") == 'SQLite format 3' ]]; then
    cp "$1" "$work/look.db"
    [[ ! -f $1-wal ]] || cp "$1-wal" "$work/look.db-wal"
    sqlite3 "$work/look.db" 'PRAGMA integrity_check' .dump
    rm -f "$work/look.db"*
  else
    cat "$1"
  fi
}

# keeps FILE EXIT_CODE TEXT COMMAND...: the command leaves the content of the file as it is.
keeps() {
  local file=$1
  content "$file" >"$work/kept"
  expect_exit "${@:2}"
  content "$file" | cmp - "$work/kept" || fail "$file was changed: ${*:4}"
}

wait_for() {
  local _
  for _ in {1..400}; do
    ! "$@" || return 0
    sleep 0.05
  done
  fail "in vain: $*"
}

# handles PID: the program has its handlers of SIGINT and SIGTERM. (Before, it ignores the one, as all that a shell starts
# in the background does, and ends by the other.)
handles() {
  local caught
  caught=$(sed -n 's/^SigCgt:\t/0x/p' "/proc/$1/status")
  (((caught & 0x4002) == 0x4002))
}

echo "== Outputs and what is beside them"
export_vectors=(--GraphMatching.descriptor fisher --GraphMatching.export_vectors)
fresh small
cp database.db pairs.txt.partial
expect_exit 0 'Pairs tested' "$matcher" --database_path pairs.txt.partial --colmap_path "$fake" \
  --GraphMatching.export_pairs pairs.txt
(($(count_tested pairs.txt.partial) > 0)) || fail 'the database is gone'
check_integrity pairs.txt.partial
echo precious >victim
ln -s victim list.txt.partial
ln -s database.db other.txt.partial
keeps victim 0 'Dry run' "${run[@]}" --GraphMatching.dry_run 1 --GraphMatching.export_pairs list.txt
keeps database.db 0 'Dry run' "${run[@]}" --GraphMatching.dry_run 1 --GraphMatching.export_pairs other.txt
[[ -s list.txt && -s other.txt && -L list.txt.partial ]] || fail 'no lists'

fresh small
printf 'place0/photo 0.jpg\nplace0/photo 1.jpg\n' >images.txt
keeps images.txt 1 'are the same file' "${run[@]}" --VocabTreeMatching.match_list_path images.txt \
  "${export_vectors[@]}" images.npy
cp database.db vectors.txt
keeps vectors.txt 1 'are the same file' "$matcher" --database_path vectors.txt --colmap_path "$fake" \
  "${export_vectors[@]}" vectors.npy
expect_exit 1 'are the same file' "${run[@]}" --GraphMatching.export_pairs w.txt "${export_vectors[@]}" w.npy
keeps images.txt 5 'It may be another file of yours' "${run[@]}" "${export_vectors[@]}" images.npy
# A report of its own is not another file.
expect_exit 0 'Pairs tested' "${run[@]}" --GraphMatching.report own.json
expect_exit 0 'Pairs tested' "${run[@]}" --GraphMatching.report own.html
echo '{"mine": 1}' >run.json
keeps run.json 5 'It may be another file of yours' "${run[@]}" --GraphMatching.report run.html
expect_exit 0 'Pairs tested' "${run[@]}" "${export_vectors[@]}" v.npy --GraphMatching.report r.html
expect_exit 0 'Pairs tested' "${run[@]}" "${export_vectors[@]}" v.npy --GraphMatching.report r.html

fresh small
for suffix in -wal -shm -journal .graphmatch .graphmatch-journal; do
  expect_exit 1 'are the same file' "${run[@]}" --GraphMatching.export_pairs "database.db$suffix"
  expect_exit 1 'are the same file' "${run[@]}" --log_path "database.db$suffix"
  [[ ! -e database.db$suffix ]] || fail "database.db$suffix was made"
done
ln -s database.db link.db
expect_exit 1 'are the same file' "$matcher" --database_path link.db --GraphMatching.pair_log database.db-wal
cp database.db other.db
for output in export_pairs report pair_log; do
  keeps other.db 5 'it is a SQLite database' "${run[@]}" "--GraphMatching.$output" other.db
  expect_exit 5 'SQLite keeps there' "${run[@]}" "--GraphMatching.$output" other.db-wal
done
keeps other.db 5 'it is a SQLite database' "${run[@]}" --log_path other.db

echo "== Links, devices and pipes as outputs"
fresh small
mkdir elsewhere
echo old >elsewhere/pairs
ln -s elsewhere/pairs pairs
mkfifo pipe
cat pipe >received &
expect_exit 0 'Pairs tested' "${run[@]}" --GraphMatching.export_pairs pairs --GraphMatching.export_graph graph.dot \
  --GraphMatching.report /dev/null --GraphMatching.pair_log pipe
wait
[[ -L pairs && -p pipe && -c /dev/null ]] || fail 'a link, a pipe or a device was replaced'
[[ $(head -n 1 received) == test,* && $(wc -l <elsewhere/pairs) -gt 10 ]] || fail 'not what was to be written'
expect_exit 0 'Pairs tested' "${run[@]}" --GraphMatching.export_pairs /dev/stdout
"${run[@]}" --GraphMatching.pair_log /dev/stdout --GraphMatching.export_pairs /dev/stdout --GraphMatching.max_pairs 5 \
  --GraphMatching.strategy exhaustive >both 2>"$work/output.txt"
"${run[@]}" --GraphMatching.export_pairs /dev/stdout >>both 2>"$work/output.txt" || fail 'a file as the standard output'
[[ $(head -n 1 both) == test,* && $(grep -c '^Images ' both) == 2 ]] || fail 'what was printed was written over'
expect_exit 0 'Pairs tested' "${run[@]}" --GraphMatching.export_pairs /dev/stdout
grep -q -x $'place0/photo [0-9]*.jpg\tplace0/photo [0-9]*.jpg' "$work/output.txt" || fail 'no list on the standard output'
expect_exit 5 'no program reads from this pipe' timeout 60 "${run[@]}" --GraphMatching.export_pairs pipe
expect_exit 0 'Pairs tested' "${run[@]}" --GraphMatching.match_list_path <(cat elsewhere/pairs)

echo "== Paths that a database or a user names"
fresh small
printf 'the secret of another user' >"$work/secret.jpg"
mkdir photos
mkfifo photos/pipe.jpg
: >photos/great.jpg
truncate -s 3G photos/great.jpg
for name in "../../secret.jpg" "$work/secret.jpg" pipe.jpg great.jpg /dev/zero; do
  sqlite3 database.db "UPDATE images SET name = '$name' WHERE image_id = 1"
  expect_exit 5 "$name: " timeout 60 "${run[@]}" --GraphMatching.descriptor gist --image_path photos \
    --GraphMatching.strategy retrieval --SiftMatching.num_threads 1
done
mkfifo pipe
for option in --GraphMatching.match_list_path --VocabTreeMatching.match_list_path --GraphMatching.ranking_path \
  --GraphMatching.replay_path --project_path; do
  # Nobody writes into the pipe: it is waited for, until Ctrl-C.
  "${run[@]}" "$option" pipe >"$work/output.txt" 2>&1 &
  pid=$!
  wait_for handles "$pid"
  sleep 0.2
  kill -INT "$pid"
  ! wait "$pid" || fail "$option: a pipe without a writer"
  grep -q 'Stopped as asked' "$work/output.txt" || { cat "$work/output.txt"; fail "$option"; }
done
expect_exit 5 'it is a pipe' timeout 60 "${run[@]}" --GraphMatching.descriptor file --GraphMatching.vectors_path pipe
expect_exit 2 'it is a pipe' timeout 60 "$matcher" --database_path pipe --colmap_path "$fake"
mv database.db moved.db
mkfifo moved.db.graphmatch
expect_exit 0 'is in the way' timeout 60 "$matcher" --database_path moved.db --colmap_path "$fake"
rm moved.db.graphmatch
mkfifo moved.db-wal
expect_exit 2 'it is a pipe' timeout 60 "$matcher" --database_path moved.db --colmap_path "$fake"

echo "== COLMAP fails on all pairs, of however few images"
cat >"$work/programs/fails" <<END
#!/bin/bash
[[ \$1 != matches_importer || \$2 == -h ]] || exit 1
exec "$fake" "\$@"
END
chmod +x "$work/programs/fails"
for num_images in 2 3 4 7 10; do
  fresh small
  sqlite3 database.db "PRAGMA foreign_keys = ON; DELETE FROM images WHERE image_id > $num_images;
    DELETE FROM descriptors WHERE image_id > $num_images"
  expect_exit 4 'COLMAP fail' "$matcher" --database_path database.db --colmap_path "$work/programs/fails"
  (($(sqlite3 database.db 'SELECT count(*) FROM two_view_geometries WHERE rows > 0') == 0)) || fail 'edges'
done
# The rest is tested: that is a run that succeeded, with warnings.
fresh small
FAKE_COLMAP_FAULT=exit FAKE_COLMAP_FAULT_PAIR='1 2' expect_exit 0 'Failed             1 pairs' "${run[@]}"

echo "== A database that changes during the run"
# meanwhile NAME COMMAND: a COLMAP in whose third shard something else happens to the database.
meanwhile() {
  cat >"$work/programs/$1" <<END
#!/bin/bash
if [[ \$1 == matches_importer && \$2 != -h ]]; then
  echo >>"$work/shards"
  if ((\$(wc -l <"$work/shards") == 3)); then $2; fi
fi
exec "$fake" "\$@"
END
  chmod +x "$work/programs/$1"
  rm -f "$work/shards"
  fresh big
  run=("$matcher" --database_path database.db --colmap_path "$work/programs/$1" --SiftMatching.num_threads 1
    --GraphMatching.max_pairs_per_shard 4)
}
# Image 7 gets as many features as it had, others: no pair of it is written from then on.
change="cd '$place' && sqlite3 database.db '.timeout 10000' \"UPDATE descriptors SET data = (SELECT data FROM descriptors
  WHERE image_id = 8) WHERE image_id = 7\" && sqlite3 database.db 'SELECT pair_id FROM two_view_geometries' >before"
meanwhile changes "$change"
expect_exit 2 'changed during the run' "${run[@]}"
grep -q 'The features of image "place0/photo 6.jpg" (id 7)' "$work/output.txt" || fail 'the image is not named'
sqlite3 database.db "SELECT pair_id FROM two_view_geometries WHERE pair_id / 2147483647 = 7 OR pair_id % 2147483647 = 7" |
  sort | comm -23 - <(sort before) >"$work/stale"
[[ ! -s $work/stale ]] || fail 'pairs of the old features were written'
meanwhile replaces "cd '$place' && cp database.db copy.db && mv copy.db database.db"
expect_exit 2 'replaced by another file during the run' "${run[@]}"
meanwhile deletes "rm '$place/database.db'"
expect_exit 2 'replaced by another file during the run' "${run[@]}"
meanwhile tests "cd '$place' && sqlite3 database.db '.timeout 10000' \"INSERT OR IGNORE INTO two_view_geometries(pair_id, rows,
  cols, config) SELECT 2147483647 * a.image_id + b.image_id, 99, 2, 3 FROM images a JOIN images b WHERE a.image_id <
  b.image_id\" \"INSERT OR IGNORE INTO matches SELECT pair_id, 0, 2, NULL FROM two_view_geometries\""
expect_exit 0 'Pairs tested' "${run[@]}" --GraphMatching.export_pairs pairs.txt
# Of what another program tested meanwhile, the run tells what is in the database.
sqlite3 database.db "SELECT count(*) FROM two_view_geometries WHERE rows = 99" >"$work/num_theirs"
(($(cat "$work/num_theirs") > 100)) || fail 'nothing of the other program is left'
grep -q "Matching graph     $(wc -l <pairs.txt) edges" "$work/output.txt" || fail 'the list is not the graph'
while IFS=$'\t' read -r name1 name2; do
  echo "SELECT count(*) FROM two_view_geometries, images a, images b WHERE a.name = '$name1' AND b.name = '$name2' AND
    rows > 0 AND pair_id = 2147483647 * min(a.image_id, b.image_id) + max(a.image_id, b.image_id);"
done <pairs.txt | sqlite3 database.db | { ! grep -v -x 1; } || fail 'an edge that is not in the database'

echo "== A damaged page, which reading does not notice"
fresh small
expect_exit 0 'Pairs tested' "${run[@]}" --GraphMatching.max_pairs 40
sqlite3 database.db 'PRAGMA journal_mode = DELETE' >/dev/null
for table in matches two_view_geometries; do
  cp database.db damaged.db
  # A leaf of the table: what it says of where its rows begin is put behind them.
  page=$(sqlite3 damaged.db "SELECT max(pageno) FROM dbstat WHERE name = '$table' AND pagetype = 'leaf'" 2>/dev/null ||
    sqlite3 damaged.db "SELECT rootpage FROM sqlite_schema WHERE name = '$table'")
  printf '\x0f\xf0' | dd of=damaged.db bs=1 seek=$(((page - 1) * 4096 + 5)) conv=notrunc status=none
  cp damaged.db before.db
  expect_exit 2 "is damaged where $table is" "$matcher" --database_path damaged.db --colmap_path "$fake"
  cmp damaged.db before.db || fail 'a damaged database was written to'
done

echo "== Signals while it waits"
# hold FILE: locks it for half a minute at most.
hold() {
  { echo 'BEGIN EXCLUSIVE; SELECT 1;'; sleep 30; } | sqlite3 "$1" >"$work/held.txt" &
  holder=$!
  wait_for test -s "$work/held.txt"
}
fresh small
sqlite3 database.db 'PRAGMA journal_mode = DELETE' >/dev/null
hold database.db
for signal in INT TERM; do
  SECONDS=0
  "${run[@]}" --GraphMatching.lock_timeout 25 >"$work/output.txt" 2>&1 &
  pid=$!
  wait_for handles "$pid"
  sleep 1
  kill "-$signal" "$pid"
  code=0
  wait "$pid" || code=$?
  [[ $code == 130 ]] || { cat "$work/output.txt"; fail "SIG$signal while it waits for a lock: exit code $code"; }
  ((SECONDS < 10)) || fail "SIG$signal had no effect for $SECONDS s"
done
pkill -P "$holder" sleep || true
kill "$holder" 2>/dev/null || true
wait
# The lock comes while results are to be written: the second signal gives them up at once, one alone after some seconds.
for num_signals in 2 1; do
  fresh big
  sqlite3 database.db 'PRAGMA journal_mode = DELETE' >/dev/null
  FAKE_COLMAP_DELAY_MS=20 "${run[@]}" --GraphMatching.verifier colmap --GraphMatching.lock_timeout 25 \
    >"$work/output.txt" 2>&1 &
  pid=$!
  while (($(sqlite3 database.db '.timeout 5000' 'SELECT count(*) FROM two_view_geometries') == 0)); do sleep 0.05; done
  hold database.db
  sleep 1
  SECONDS=0
  for ((i = 0; i < num_signals; ++i)); do
    kill -INT "$pid"
    sleep 0.5
  done
  code=0
  wait "$pid" || code=$?
  [[ $code == 130 ]] || { cat "$work/output.txt"; fail "$num_signals signals while it writes: exit code $code"; }
  ((SECONDS < 10)) || fail "it took $SECONDS s"
  pkill -P "$holder" sleep || true
  wait
  check_integrity database.db
  expect_exit 0 'more were known' "${run[@]}"
done
# Before anything is computed.
fresh small
FAKE_COLMAP_HELP_DELAY_MS=20000 "${run[@]}" >"$work/output.txt" 2>&1 &
pid=$!
wait_for handles "$pid"
sleep 0.2
kill -TERM "$pid"
code=0
wait "$pid" || code=$?
[[ $code == 130 ]] || { cat "$work/output.txt"; fail "SIGTERM while COLMAP is asked for its version: exit code $code"; }
# Three of them end the program whatever it does: here it writes into a pipe that nobody empties.
fresh big
mkfifo pipe
exec 4<>pipe
# What it writes of all pairs is more than a pipe holds.
"${run[@]}" --GraphMatching.strategy exhaustive --GraphMatching.pair_log pipe --GraphMatching.export_pairs pipe \
  --GraphMatching.export_graph graph.dot --GraphMatching.report pipe >"$work/output.txt" 2>&1 &
pid=$!
wait_for grep -q 'Time   ' "$work/output.txt"
sleep 0.5
kill -0 "$pid" || fail 'it did not wait for the reader of the pipe'
for _ in 1 2 3; do kill -INT "$pid"; sleep 0.2; done
code=0
wait "$pid" || code=$?
exec 4>&-
((code >= 128)) || fail "three signals: exit code $code"
check_integrity database.db

echo "== A COLMAP that is killed while it is asked for its version or its options"
for command in help 'matches_importer -h' database_creator; do
  cat >"$work/programs/killed" <<END
#!/bin/bash
if [[ "\$1 \$2" == "$command"* && ! -e "$work/killed" ]]; then
  touch "$work/killed"
  kill -KILL \$\$
fi
exec "$fake" "\$@"
END
  chmod +x "$work/programs/killed"
  rm -f "$work/killed"
  fresh small
  expect_exit 0 'Pairs tested' "$matcher" --database_path database.db --colmap_path "$work/programs/killed"
  [[ -e $work/killed ]] || fail "$command was not killed"
done

echo "== Limits, streams and rights"
fresh small
# The database may not grow.
expect_exit 2 'ulimit -f' bash -c 'ulimit -f "$1"; shift; exec "$@"' bash \
  $(($(stat -c %s database.db) / 1024)) "${run[@]}"
check_integrity database.db
expect_exit 0 'Pairs tested' "${run[@]}"
fresh small
expect_exit 0 'The log /dev/full cannot be written any more: No space left on device' "${run[@]}" --log_path /dev/full
fresh small
expect_exit 0 'The log /dev/full cannot be written any more' "${run[@]}" --log_path /dev/full --log_to_stderr 0
fresh small
expect_exit 0 '' bash -c '"$@" >&-' bash "${run[@]}" --log_path log.txt
! grep -q 'Pairs tested' log.txt || fail 'the summary went into the log'
fresh small
bash -c '"$@" >&- 2>&- <&-' bash "${run[@]}" --log_path log.txt || fail 'all streams are closed'
grep -q 'Learnt a vocabulary' log.txt || fail 'no log'
check_integrity database.db
for mask in 777 277 077; do
  fresh small
  expect_exit 0 'Pairs tested' bash -c 'umask "$1"; shift; exec "$@"' bash "$mask" "${run[@]}" \
    --GraphMatching.export_pairs pairs.txt
  [[ -r pairs.txt && $(stat -c %a pairs.txt) == 600 ]] || fail "umask $mask: $(stat -c %a pairs.txt)"
  [[ -z $(ls -A "$TMPDIR") ]] || fail "umask $mask: left behind"
done
fresh small
chmod 600 database.db
expect_exit 0 'Pairs tested' "${run[@]}"
[[ $(stat -c %a database.db.graphmatch) == 600 ]] || fail 'others may read what a run keeps'
# The working directory goes: that is not the database's fault.
cat >"$work/programs/cleaner" <<END
#!/bin/bash
[[ \$1 != matches_importer || \$2 == -h ]] || rm -rf "$TMPDIR"/graphmatch-*
exec "$fake" "\$@"
END
chmod +x "$work/programs/cleaner"
fresh small
expect_exit 5 'The working directory' "$matcher" --database_path database.db --colmap_path "$work/programs/cleaner"
# Names that a list cannot hold.
fresh small
sqlite3 database.db "UPDATE images SET name = 'a' || char(10) || 'b.jpg' WHERE image_id = 2"
expect_exit 0 'have line ends or tabs' "${run[@]}" --GraphMatching.export_pairs pairs.txt
! grep -q 'b.jpg' pairs.txt || fail 'half a name is in the list'

if command -v colmap >/dev/null; then
  echo "== What COLMAP leaves when it aborts"
  fresh small
  sqlite3 database.db 'UPDATE cameras SET model = 17'
  expect_exit 4 'COLMAP fail' "$matcher" --database_path database.db --SiftMatching.use_gpu 0
  ls -A "$TMPDIR" >"$work/left"
  [[ ! -s $work/left ]] || { cat "$work/left"; fail 'left in the temporary directory'; }
else
  echo "SKIPPED: what COLMAP leaves when it aborts (COLMAP is not installed)"
fi
expect_empty "$TMPDIR"
