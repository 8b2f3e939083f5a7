#!/bin/bash
# What goes wrong for users, one case after the other: each ends with its exit code, says what happened, loses
# nothing and leaves nothing behind. docs/errors.md tells users the same; a table in it that says something else
# fails this test, and UPDATE=1 rewrites the tables. A test double stands in for COLMAP.
# shellcheck source-path=SCRIPTDIR disable=SC2016  # Backticks are Markdown, and $() must not be expanded.

# The test goes to other directories.
set -- "$(realpath "$1")" "$(realpath -m "$2")"

# Full and read-only disks are made by mounting, seen by nobody else: the whole test runs in a mount namespace of
# its own, if it may have one.
if [[ -z ${GRAPHMATCH_CAN_MOUNT:-} ]]; then
  script=$(realpath "$0")
  for options in '--mount' '--user --map-root-user --mount'; do
    # shellcheck disable=SC2086  # The options are several words.
    if unshare $options mount -t tmpfs none /tmp 2>/dev/null; then
      GRAPHMATCH_CAN_MOUNT=yes exec unshare $options bash "$script" "$@"
    fi
  done
  GRAPHMATCH_CAN_MOUNT=no
fi

source "$(dirname "$0")/common.sh"

fake=$build/tests/fake_colmap
document=$root/docs/errors.md
export TMPDIR=$work/tmp
place=$work/place     # The directory of the database.
here=$work/here       # Where the program is started; it has no business there.
disk=$work/disk       # Where disks are mounted.
mkdir -p "$TMPDIR" "$here" "$disk" "$work/programs" "$work/tables"
cd "$here"

# Every permission binds a program that is started so: root without its privileges, or a user as ever.
bound=()
((EUID != 0)) || bound=(setpriv --bounding-set=-all --inh-caps=-all)
touch "$work/protected"
chmod 000 "$work/protected"
permissions_bind=yes
if ! "${bound[@]}" true || "${bound[@]}" cat "$work/protected" 2>/dev/null; then permissions_bind=no; fi

# fresh [MASTER [NAME]]: a directory with nothing but a copy of small.db or big.db.
fresh() {
  rm -rf "$place"
  mkdir "$place"
  database=$place/${2:-database}.db
  cp "$work/${1:-small}.db" "$database"
  run=("$matcher" --database_path "$database" --colmap_path "$fake")
}

change() { sqlite3 "$database" "$1" >/dev/null; }

# contents DATABASE: what is in it, without touching it or its lock; its bytes if SQLite cannot read it.
contents() {
  rm -f "$work/look.db"*
  if [[ ! -f $1 || ! -r $1 ]]; then
    ls -d "$1" 2>&1 || true
    return
  fi
  cp "$1" "$work/look.db"
  [[ ! -f $1-wal ]] || cp "$1-wal" "$work/look.db-wal"
  sqlite3 "$work/look.db" 'PRAGMA integrity_check' .dump 2>/dev/null || sha256sum <"$1"
}

pairs_pattern='^INSERT INTO (matches|two_view_geometries) '

# snapshot NAME: what may not change, and the pairs, which may become more.
snapshot() {
  contents "$database" >"$work/contents.$1"
  grep -a -v -E "$pairs_pattern" "$work/contents.$1" >"$work/others.$1" || true
  grep -a -E "$pairs_pattern" "$work/contents.$1" | LC_ALL=C sort >"$work/pairs.$1" || true
  # SQLite's own files beside the database are part of it, and what a run keeps for the next one belongs there.
  { find "${database%/*}" "$disk" ! -name '*.graphmatch' 2>/dev/null || true; } |
    grep -a -v -E -e '-(wal|shm|journal)$' | LC_ALL=C sort >"$work/files.$1"
}

# The message of the last run, on one line, with words for what differs from run to run.
message() {
  local text
  text=$(sed -n '/^E[0-9]\{8\} /,$p' "$work/output.txt")
  # What COLMAP printed follows a warning that ends with a colon.
  [[ -n $text ]] || text=$(sed -n '/^W[0-9]\{8\} /{p;/:$/{n;p}}' "$work/output.txt")
  text=$(sed -E 's/^[EW][0-9]{8} [0-9:.]+ [0-9]+ graphmatch_matcher\] //' <<<"$text")
  text=${text//"$database"/DATABASE}
  text=${text//"$fake"//usr/bin/colmap}
  text=${text//"$work"//home/you}
  text=${text//$'\n'/ }
  text=${text//|/\\|}
  sed -E -e 's/graphmatch-[a-z0-9]{16}/graphmatch-XXXXXX/g' -e 's/held by process [0-9]+/held by process PID/' \
    -e 's/a made-up fault on the pair [0-9]+ [0-9]+/WHAT COLMAP PRINTED/' -e 's/x{300} \.\.\./WHAT COLMAP PRINTED/' \
    -e 's/images [0-9]+ and [0-9]+/images ID and ID/' -e 's/Image "[^"]*" \(id [0-9]+\)/Image NAME (id ID)/' \
    -e 's/within [0-9]\.[0-9] s/within 0.2 s/' \
    -e 's/within 60\.[0-9] s/within 60.0 s/' -e 's#/home/you/programs/[a-z-]+#PROGRAM#g' \
    -e 's#(^|`)/bin/(true|false)\b#\1PROGRAM#' -e 's#/home/you/none/[a-z]+\.[a-z]+#FILE#g' \
    -e 's#(working directory in) /home/you/[a-z/]+:#\1 DIRECTORY:#' \
    -e 's#(list of [a-z ]+) /(home/you|dev)/[a-z./]+:#\1 FILE:#' \
    -e 's/: ((No such|Is a|Not a|Permission|Exec|Read-only) [a-z ]+|it is a device, not a regular file)\./: REASON./' \
    -e 's/ +$//' <<<"${text:--}"
}

theme() {
  table=$work/tables/$1
  : >"$table"
  echo "== $1"
}

# skip WHAT WHY: what the document says of it stays as it is.
skip() {
  echo "SKIPPED: $1 ($2)"
  awk -F ' [|] ' -v what="$1" '
    /^No message, exit code 0:/ { if (index($0 ";", " " what ";") || index($0, " " what ".")) print what "\t0\t-" }
    { cases = substr($1, 3) }
    /^[|]/ && index("<br>" cases "<br>", "<br>" what "<br>") { sub(/ [|]$/, "", $3); print what "\t" $2 "\t" $3 }
  ' "$document" >"$work/skipped.txt"
  [[ -s $work/skipped.txt ]] || echo "(docs/errors.md does not name it)"
  cat "$work/skipped.txt" >>"$table"
  num_skipped=$((num_skipped + 1))
}
num_skipped=0
num_cases=0

# Nothing that was started for a shard still runs. (The brackets keep grep from finding itself.)
expect_no_processes() {
  local _
  for _ in {1..50}; do
    grep -q -s -a -z -- "$TMPDIR/[g]raphmatch-" /proc/[0-9]*/cmdline || return 0
    sleep 0.1
  done
  fail "$1: a COLMAP was left running"
}

# says CODE WHAT COMMAND...: runs it as the case WHAT and records what it says. Variables: piece, to record only that
# part of the message; advice, what to do where the message does not say it; partial=yes if pairs that were finished may
# be kept in spite of the error.
says() {
  local expected=$1 what=$2 code=0 text
  shift 2
  snapshot before
  timeout 300 "$@" >"$work/output.txt" 2>&1 </dev/null || code=$?
  snapshot after
  [[ $code == "$expected" ]] || { tail -n 20 "$work/output.txt"; fail "$what: exit code $code, not $expected"; }
  diff "$work/others.before" "$work/others.after" >&2 || fail "$what: the database has changed"
  diff "$work/files.before" "$work/files.after" >&2 || fail "$what: it left files, or took some away"
  [[ -z $(ls -A "$TMPDIR") && -z $(ls -A "$here") ]] || fail "$what: files in $TMPDIR or $here"
  expect_no_processes "$what"
  if [[ $code == 0 || ${partial:-} == yes ]]; then
    [[ -z $(comm -23 "$work/pairs.before" "$work/pairs.after") ]] || fail "$what: pairs were lost"
  else
    cmp "$work/pairs.before" "$work/pairs.after" || fail "$what: an error left pairs"
  fi
  text=$(message)
  if [[ -n ${piece:-} ]]; then
    grep -q -F -- "$piece" <<<"$text" || { cat "$work/output.txt"; fail "$what: no '$piece'"; }
    text="... $piece ..."
  fi
  ((code == 0)) || [[ $text != - ]] || fail "$what: exit code $code without a message"
  ((${#text} < 1000)) || fail "$what: the message has ${#text} letters"
  printf '%s\t%s\t%s\n' "$what" "$code" "${text//$'\t'/ }${advice:+ ($advice)}" >>"$table"
  num_cases=$((num_cases + 1))
}

# expect_results MASTER: all pairs of an undisturbed run, with the same matches and geometries, and no others.
expect_results() { cmp "$work/$1.pairs" "$work/pairs.after" || fail "the results differ from those of $1.db"; }

"$build/tests/make_synthetic_database" "$work/small.db" 2 6
"$build/tests/make_synthetic_database" "$work/big.db" 4 10
for master in small big; do
  fresh $master
  expect_exit 0 'Pairs tested' "${run[@]}"
  snapshot after
  cp "$work/pairs.after" "$work/$master.pairs"
  (($(wc -l <"$work/$master.pairs") >= 2 * 66)) || fail "too few pairs"
done

theme databases
fresh
says 2 'There is no file' "$matcher" --database_path "$place/none.db" --colmap_path "$fake"
fresh
rm "$database"
mkdir "$database"
says 2 'It is a directory' "${run[@]}"
fresh
: >"$database"
says 2 'The file is empty' "${run[@]}"
echo 'not a database, but long enough to be looked at as one' >"$database"
says 2 'It is not a SQLite file' "${run[@]}"
fresh
rm "$database"
change 'CREATE TABLE tracks(title TEXT); INSERT INTO tracks VALUES(1)'
says 2 'A SQLite file of another program' "${run[@]}"
fresh
change 'DROP TABLE two_view_geometries'
says 2 'A table is missing' "${run[@]}"
fresh
change 'ALTER TABLE two_view_geometries DROP COLUMN F'
advice='extract the features again, with a newer COLMAP' \
  says 2 'A column is missing: a COLMAP long before 3.8' "${run[@]}"
fresh
change 'ALTER TABLE two_view_geometries DROP COLUMN qvec; ALTER TABLE two_view_geometries DROP COLUMN tvec'
says 0 'Only the columns `qvec` and `tvec` are missing: a COLMAP shortly before 3.8' "${run[@]}"
[[ $(wc -l <"$work/pairs.after") == $(wc -l <"$work/small.pairs") ]] || fail 'pairs are missing'
fresh
change 'CREATE VIEW pose_priors AS SELECT image_id, x'"''"' AS position, 0 AS coordinate_system FROM images'
piece='The run goes on without positions of images.' says 0 'Positions of images (`pose_priors`) cannot be read' "${run[@]}"
expect_results small
fresh
truncate -s 70000 "$database"
piece='database disk image is malformed. The file is damaged: `sqlite3 FILE .recover` may save its contents.' \
  advice='copy it again' says 2 'The file is cut off, e.g. an incomplete copy' "${run[@]}"
fresh
# The first byte of a page says what it is; 255 is nothing.
page=$(sqlite3 "$database" "SELECT rootpage FROM sqlite_schema WHERE name = 'descriptors'")
printf '\xff' | dd of="$database" bs=1 seek=$(((page - 1) * 4096)) conv=notrunc status=none
piece='database disk image is malformed. The file is damaged: `sqlite3 FILE .recover` may save its contents.' \
  says 2 'The file is damaged inside' "${run[@]}"
fresh
"${run[@]}" --GraphMatching.verifier colmap --GraphMatching.max_pairs 40 >"$work/output.txt" 2>&1
change 'PRAGMA journal_mode = DELETE'
# Where the rows of a page begin, as its header says, is behind them.
page=$(sqlite3 "$database" "SELECT rootpage FROM sqlite_schema WHERE name = 'matches'")
while [[ $(dd if="$database" bs=1 skip=$(((page - 1) * 4096)) count=1 status=none | od -An -tu1) -ne 13 ]]; do
  page=$((page + 1))
done
printf '\x0f\xf0' | dd of="$database" bs=1 seek=$(((page - 1) * 4096 + 5)) conv=notrunc status=none
piece='and to write to it could destroy more. Nothing was written: `sqlite3 FILE .recover` may save its contents.' \
  says 2 'A table to write to is damaged in a way that reading does not notice' "${run[@]}"
fresh
rm "$database"
mkfifo "$database"
says 2 'It is a pipe, or another file that is none' "${run[@]}"
fresh
change 'DELETE FROM images; DELETE FROM keypoints; DELETE FROM descriptors'
says 2 'It has no images' "${run[@]}"
fresh
change 'DELETE FROM keypoints; DELETE FROM descriptors'
says 2 'No image has features' "${run[@]}"
fresh
change 'DELETE FROM images WHERE image_id > 1; DELETE FROM descriptors WHERE image_id > 1'
says 0 'It has one image' "${run[@]}"
fresh
change 'DELETE FROM images WHERE image_id > 2; DELETE FROM descriptors WHERE image_id > 1'
says 0 'It has two images, one of them without features' "${run[@]}"
fresh
change 'DELETE FROM descriptors WHERE image_id = 3'
says 0 'An image has no features' "${run[@]}"
fresh
change 'UPDATE descriptors SET data = zeroblob(60 * 512)'
advice='extract SIFT features into a new database' says 2 'Descriptors are floating-point numbers (ALIKED)' "${run[@]}"
fresh
change 'ALTER TABLE descriptors ADD COLUMN type INTEGER NOT NULL DEFAULT 0;
        UPDATE descriptors SET type = 1 WHERE image_id = 3'
advice='extract SIFT features into a new database' \
  says 2 'Some images have SIFT features, one has others' "${run[@]}"
fresh
change 'UPDATE descriptors SET data = zeroblob(777) WHERE image_id = 3'
says 2 'Descriptors of the wrong size' "${run[@]}"
fresh
change 'UPDATE descriptors SET cols = 64 WHERE image_id = 3'
says 2 'Descriptors that are not SIFT' "${run[@]}"
fresh
change 'UPDATE keypoints SET rows = 59, data = zeroblob(59 * 16) WHERE image_id = 3'
says 2 'More descriptors than keypoints' "${run[@]}"
fresh
# In the groups of ten in which the test double finds edges, as 1 to 12 are.
for table_of_ids in images keypoints descriptors; do
  change "PRAGMA foreign_keys = OFF;
          UPDATE $table_of_ids SET image_id = 2147483630 + image_id + 4 * (image_id = 12)"
done
[[ $(sqlite3 "$database" 'SELECT max(image_id) FROM images') == 2147483646 ]] || fail 'not the greatest id'
says 0 'The greatest ids that COLMAP allows (2147483646)' \
  "${run[@]}" --GraphMatching.strategy exhaustive
results='SELECT rows, quote(data), config FROM two_view_geometries ORDER BY pair_id'
[[ $(sqlite3 "$database" "$results") == $({
  fresh
  "${run[@]}" --GraphMatching.strategy exhaustive >/dev/null 2>&1
  sqlite3 "$database" "$results"
}) ]] || fail 'the greatest ids have other results'
fresh
change 'PRAGMA ignore_check_constraints = ON; UPDATE images SET image_id = 2147483647 WHERE image_id = 3'
says 2 'An id outside the range of COLMAP' "${run[@]}"

fresh
change 'UPDATE cameras SET model = 99'
says 0 'A camera that makes no sense' "${run[@]}"
fresh
change 'INSERT INTO matches VALUES(2147483647 + 2, 1, 2, zeroblob(7))'
partial=yes says 2 'Matches that were stored before are damaged' "${run[@]}"

theme names
# works WHAT: as if it had a plain name.
works() {
  says 0 "$1" "${run[@]}"
  expect_results small
}
fresh small ' two  words '
works 'A path with spaces'
fresh small 'Fotos für 東京'
works 'A path that is not ASCII'
fresh small $'\xff\xfe'
works 'A path that is not UTF-8'
fresh small "it's \"this\""
works 'A path with quotes'
fresh small '100%25?mode=ro#1&a=b'
works 'A path with `%`, `?`, `#`'
fresh small $'two\nlines'
works 'A path with a newline'
# name_images EXPRESSION: what all images are called, in SQL. A number and the place follow: as in the plain names, which
# number the images of each place, and tell the choice of pairs so.
name_images() {
  fresh
  change "UPDATE images SET name = $1 || ((image_id - 1) % 6) || char(97 + (image_id - 1) / 6)"
}
name_images "' my ' || char(39) || 'own' || char(39) || ' \"photo\"  '"
works 'Image names with spaces and quotes'
name_images "'first' || char(10) || char(13) || 'second' || char(10)"
works 'Image names with newlines'
name_images "'; touch bad; \$(touch bad) \`touch bad\` | touch bad &'"
works 'Image names with `;`, `$(...)` and backticks'
name_images "hex(zeroblob(2000))"
works 'Image names of 4,000 bytes'
name_images "'--help -h --database_path '"
works 'Image names that look like options'
name_images "CAST(x'2FFF80C0' AS TEXT)"
works 'Image names that are not UTF-8'
fresh
strange=$work/$'a %s "work" \'directory\'\n$(touch bad)'
mkdir "$strange"
says 0 'A directory for temporary files with any of this' "${run[@]}" --GraphMatching.work_path "$strange"
expect_results small
[[ -z $(ls -A "$strange") ]] || fail 'the work directory is not empty'

theme locks
# hold SQL: another program that executes it, keeps its lock, and goes on with its standard input, until let_go.
hold() {
  rm -f "$work/hold"
  mkfifo "$work/hold"
  sqlite3 "$database" <"$work/hold" >"$work/held.txt" &
  exec 3>"$work/hold"
  printf '%s\n' "$1" "SELECT 'held';" >&3
  wait_until_held
}
wait_until_held() {
  local _
  for _ in {1..200}; do
    ! grep -q -s held "$work/held.txt" || return 0
    sleep 0.05
  done
  fail 'nobody locks the database'
}
let_go() {
  exec 3>&-
  wait
  rm "$work/held.txt"
}
fresh
hold 'BEGIN IMMEDIATE;'
says 3 'Another program writes to the database for longer than `lock_timeout`' \
  "${run[@]}" --GraphMatching.lock_timeout 0.2
let_go
fresh
hold 'PRAGMA locking_mode = EXCLUSIVE; BEGIN IMMEDIATE;'
piece='another process kept it locked for 0.2 s (held by process PID (sqlite3)). Close that program' \
  says 3 'Another program has the database for itself' "${run[@]}" --GraphMatching.lock_timeout 0.2
let_go
fresh
change 'PRAGMA journal_mode = DELETE'
hold 'BEGIN EXCLUSIVE;'
piece='another process kept it locked for 0.2 s (held by process PID (sqlite3)). Close that program' \
  says 3 'The same, and the database is not in write-ahead mode' \
  "${run[@]}" --GraphMatching.lock_timeout 0.2
let_go
fresh
sqlite3 "$database" 'BEGIN IMMEDIATE' '.shell echo held' '.shell sleep 1.5' 'ROLLBACK' >"$work/held.txt" &
wait_until_held
works 'Another program writes to the database, but ends in time'
wait
rm "$work/held.txt"
fresh
# Its read lock lasts for the whole run.
hold 'BEGIN; SELECT count(*) FROM images;'
works 'Another program reads the database'
let_go
fresh
mkdir "$work/first"
TMPDIR=$work/first FAKE_COLMAP_HELP_DELAY_MS=60000 "${run[@]}" >"$work/first.txt" 2>&1 &
first=$!
for _ in {1..200}; do
  [[ ! -s $database.graphmatch ]] || break
  sleep 0.05
done
piece='Another graphmatch_matcher works on this database: it holds DATABASE.graphmatch (held by process PID' \
  says 3 'A second graphmatch_matcher works on the same database' \
  "${run[@]}" --GraphMatching.lock_timeout 0.2
kill -KILL "$first"
wait "$first" 2>/dev/null || true
works 'A second graphmatch_matcher was killed with -9'

theme rights
# bound_says CODE WHAT COMMAND...: says, with permissions that bind.
bound_says() {
  if [[ $permissions_bind == no ]]; then
    skip "$2" 'permissions do not bind here'
    return
  fi
  says "$1" "$2" "${bound[@]}" "${@:3}"
}
fresh
chmod 444 "$database"
bound_says 2 'You may not write to the database' "${run[@]}"
fresh
chmod 000 "$database"
bound_says 2 'You may not read the database' "${run[@]}"
chmod 644 "$database"
fresh
chmod 555 "$place"
piece='attempt to write a readonly database. SQLite needs to write to the file and to its directory' \
  bound_says 2 'You may not write to its directory' "${run[@]}"
chmod 755 "$place"
fresh
chmod 000 "$place"
bound_says 2 'You may not enter its directory' "${run[@]}"
chmod 755 "$place"
fresh
mkdir "$place/temporary"
chmod 555 "$place/temporary"
TMPDIR=$place/temporary bound_says 5 'You may not write to `$TMPDIR`' "${run[@]}"
bound_says 5 'You may not write to `work_path`' "${run[@]}" \
  --GraphMatching.work_path "$place/temporary"

theme disks
# mounted OPTIONS: an empty disk; a case that needs one is skipped where nothing can be mounted.
mounted() { mount -t tmpfs -o "$1" none "$disk"; }
# With a source, mount takes no options from /proc/self/mountinfo, some of which a user's namespace does not allow.
remounted() { mount -o "remount,$1" none "$disk"; }
fill() { dd if=/dev/zero of="$disk/filling" bs=4096 status=none 2>/dev/null || true; }
# on_disk: the database moves to the disk.
on_disk() {
  mv "$database" "$disk/database.db"
  database=$disk/database.db
  run=("$matcher" --database_path "$database" --colmap_path "$fake")
}
readonly_disk='The disk of the database is read-only'
full_disk='The disk of the database is full'
filling_disk='The disk of the database becomes full'
readonly_work='The disk of the work directory is read-only'
full_work='The disk of the work directory is full'
small_work='The disk of the work directory is too small'
filling_work='The disk of the work directory becomes full'
if [[ $GRAPHMATCH_CAN_MOUNT == no ]]; then
  for what in "$readonly_disk" "$full_disk" "$filling_disk" "$readonly_work" "$full_work" "$small_work" \
    "$filling_work"; do
    skip "$what" 'nothing can be mounted here'
  done
else
  fresh
  mounted size=8m
  on_disk
  remounted ro
  says 2 "$readonly_disk" "${run[@]}"
  umount "$disk"

  fresh
  mounted size=8m
  on_disk
  fill
  piece='the disk is full. Nothing half-written was kept; free some space and run the same command again to go on.' \
    says 2 "$full_disk" "${run[@]}"
  rm "$disk/filling"
  expect_exit 0 'Pairs tested' "${run[@]}"
  snapshot after
  expect_results small
  umount "$disk"

  fresh big
  size=$(stat -c %s "$database")
  mounted "size=$((size + 200000))"
  on_disk
  run+=(--GraphMatching.max_pairs_per_shard 4 --SiftMatching.num_threads 1)
  piece='the disk is full. Nothing half-written was kept; free some space and run the same command again to go on.' \
    partial=yes says 2 "$filling_disk" "${run[@]}"
  kept=$(wc -l <"$work/pairs.after")
  ((kept > 0 && kept < $(wc -l <"$work/big.pairs"))) || fail "$kept rows were kept"
  remounted size=16m
  expect_exit 0 'more were known' "${run[@]}"
  snapshot after
  expect_results big
  umount "$disk"

  fresh
  mounted size=64m,ro
  says 5 "$readonly_work" "${run[@]}" --GraphMatching.work_path "$disk"
  umount "$disk"

  fresh
  mounted size=1m
  fill
  says 5 "$full_work" "${run[@]}" --GraphMatching.work_path "$disk"
  # Enough for what COLMAP prints first, but not for anything else.
  rm "$disk/filling"
  says 5 "$small_work" "${run[@]}" --GraphMatching.work_path "$disk"
  remounted size=64m
  expect_exit 0 'Pairs tested' "${run[@]}" --GraphMatching.work_path "$disk"
  snapshot after
  expect_results small
  umount "$disk"

  # This COLMAP finds no room from its sixth shard on.
  cat >"$work/programs/filling" <<END
#!/bin/bash
if [[ \$1 == matches_importer && \$2 != -h ]]; then
  echo >>"$work/shards"
  if ((\$(wc -l <"$work/shards") > 5)); then
    dd if=/dev/zero of="$disk/filling" bs=4096 status=none
    exit 1
  fi
fi
exec "$fake" "\$@"
END
  chmod +x "$work/programs/filling"
  fresh big
  mounted size=64m
  : >"$disk/filling"
  options=(--GraphMatching.max_pairs_per_shard 4 --SiftMatching.num_threads 1 --GraphMatching.work_path "$disk")
  partial=yes says 5 "$filling_work" "$matcher" --database_path "$database" \
    --colmap_path "$work/programs/filling" "${options[@]}"
  kept=$(wc -l <"$work/pairs.after")
  ((kept > 0 && kept < $(wc -l <"$work/big.pairs"))) || fail "$kept rows were kept"
  rm "$disk/filling"
  expect_exit 0 'more were known' "${run[@]}" "${options[@]}"
  snapshot after
  expect_results big
  umount "$disk"
fi
fresh
TMPDIR=$work/none says 5 '`$TMPDIR` is missing' "${run[@]}"
says 5 '`work_path` is missing' "${run[@]}" --GraphMatching.work_path "$work/none"
says 5 '`work_path` is a file' "${run[@]}" --GraphMatching.work_path "$work/protected"

theme colmap
# program NAME: standard input as a program that is taken for COLMAP.
program() {
  cat >"$work/programs/$1"
  chmod +x "$work/programs/$1"
}
# with CODE WHAT NAME: a run with that program.
with() { says "$1" "$2" "$matcher" --database_path "$database" --colmap_path "$work/programs/$3"; }
fresh
with 4 'There is no such program' none
says 4 'There is no such program on the PATH' \
  "$matcher" --database_path "$database" --colmap_path no-such-colmap
fresh
says 0 'There is none on the PATH, and none was named' \
  env PATH="$work/none" "$matcher" --database_path "$database"
fresh
mkdir "$work/programs/directory"
with 4 'It is a directory' directory
program not-executable <<<'#!/bin/bash'
chmod 644 "$work/programs/not-executable"
with 4 'It may not be executed' not-executable
program no-program <<<'a text'
with 4 'It is no program' no-program
program no-interpreter <<<'#!/no/interpreter'
with 4 'What interprets it is missing' no-interpreter
says 4 'It does nothing (`/bin/true`)' \
  "$matcher" --database_path "$database" --colmap_path /bin/true
says 4 'It only fails (`/bin/false`)' \
  "$matcher" --database_path "$database" --colmap_path /bin/false
program rubbish <<'END'
#!/bin/bash
head -c 5000000 /dev/urandom
END
with 4 'It prints rubbish, megabytes of it' rubbish
program digits <<'END'
#!/bin/bash
echo "COLMAP $(head -c 3000000 /dev/zero | tr '\0' 1).8"
END
with 4 'It prints a version of a million digits' digits
program long-line <<'END'
#!/bin/bash
head -c 3000000 /dev/zero | tr '\0' x
exit 3
END
with 4 'It prints megabytes and fails' long-line
FAKE_COLMAP_VERSION='COLMAP 3.7' says 4 'It is too old' "${run[@]}"
program crash <<'END'
#!/bin/bash
kill -SEGV $$
END
with 4 'It crashes at once' crash
slow='It hangs at once, for longer than 60 s'
program hangs <<'END'
#!/bin/bash
exec sleep 1000
END
if [[ ${GRAPHMATCH_SLOW_TESTS:-} == 1 ]]; then
  with 4 "$slow" hangs
else
  skip "$slow" 'it takes a minute; GRAPHMATCH_SLOW_TESTS=1 runs it'
fi
program no-creator <<END
#!/bin/bash
[[ \$1 != database_creator ]] || exit 7
exec "$fake" "\$@"
END
with 4 'It makes no database for a shard' no-creator
export FAKE_COLMAP_FAULT_PAIR=all
FAKE_COLMAP_FAULT=crash partial=yes says 4 'It crashes on every pair' "${run[@]}"
fresh
FAKE_COLMAP_FAULT=exit partial=yes says 4 'It fails on every pair' "${run[@]}"
fresh
FAKE_COLMAP_FAULT=hang partial=yes advice='raise `timeout_per_pair` on a slow machine' \
  says 4 'It hangs on every pair, for longer than `timeout_per_pair`' \
  "${run[@]}" --GraphMatching.timeout_per_pair 0.1 --GraphMatching.max_pairs_per_shard 1
fresh
FAKE_COLMAP_FAULT=short partial=yes says 4 'It ends well, but writes no results' "${run[@]}"
fresh
FAKE_COLMAP_FAULT=nonsense partial=yes says 4 'It writes matches of features that there are not' "${run[@]}"
[[ $(sqlite3 "$database" 'SELECT count(*) FROM two_view_geometries WHERE rows > 0') == 0 ]] ||
  fail 'nonsense was kept'
unset FAKE_COLMAP_FAULT_PAIR
fresh
FAKE_COLMAP_FAULT=exit FAKE_COLMAP_FAULT_PAIR='1 2' advice='the next run tries it again' \
  says 0 'It fails on one pair' "${run[@]}"
fresh
change 'PRAGMA foreign_keys = ON; DELETE FROM images WHERE image_id > 4; DELETE FROM descriptors WHERE image_id > 4'
piece='COLMAP failed on all' FAKE_COLMAP_FAULT=exit FAKE_COLMAP_FAULT_PAIR=all \
  says 4 'It fails on every pair, of however few' "${run[@]}"
fresh
FAKE_COLMAP_FAULT=crash FAKE_COLMAP_FAULT_PAIR='1 2' FAKE_COLMAP_FAULT_TIMES=1 FAKE_COLMAP_LOG=$work/faults \
  works 'It is killed once in the middle'
grep -q -x fault "$work/faults" || fail 'it was not killed'
fresh
program loud <<END
#!/bin/bash
[[ \$1 == help ]] || [[ \$2 == -h ]] || head -c 5000000 /dev/zero | tr '\0' x
exec "$fake" "\$@"
END
run=("$matcher" --database_path "$database" --colmap_path "$work/programs/loud")
works 'It works, and prints megabytes'
fresh
program "wrapper of 'mine' \$(touch bad)" <<END
#!/bin/bash
exec "$fake" "\$@"
END
run=("$matcher" --database_path "$database" --colmap_path "$work/programs/wrapper of 'mine' \$(touch bad)")
works 'It is a script with spaces and quotes in its path'

theme options
fresh
piece="unrecognised option '--no_such_option'" says 1 'There is no such option' "${run[@]}" --no_such_option 1
says 1 'A word instead of a number' "${run[@]}" --SiftMatching.max_ratio zero
says 1 'A number outside its range' "${run[@]}" --GraphMatching.max_num_neighbors 0
says 1 'Two spellings of an option with different values' "${run[@]}" --SiftMatching.max_error 4 \
  --TwoViewGeometry.max_error 5
says 1 'A word that is none of those allowed' \
  "${run[@]}" --GraphMatching.matcher gpu
piece='contradict each other' says 1 'Two options contradict each other' "${run[@]}" \
  --GraphMatching.strategy exhaustive --GraphMatching.match_list_path "$work/protected"
piece='--SiftMatching.max_ratio' says 1 'The value of an option is missing' "${run[@]}" --SiftMatching.max_ratio
piece='belongs to no option' says 1 'A word that belongs to no option' "${run[@]}" pairs.txt
piece='--database_path' says 1 'There is no `--database_path`' "$matcher" --colmap_path "$fake"
piece='Cannot read the project file' says 1 'The project file is missing' \
  "${run[@]}" --project_path "$work/none.ini"
piece='Cannot read the project file' bound_says 1 'You may not read the project file' \
  "${run[@]}" --project_path "$work/protected"
printf '[SiftMatching]\nthis is no option\n' >"$work/wrong.ini"
piece='this is no option' says 1 'A line of the project file cannot be understood' \
  "${run[@]}" --project_path "$work/wrong.ini"
printf '[SiftMatching]\nmax_ratio=zero\n' >"$work/wrong.ini"
piece='it must be a number greater than 0' says 1 'A value in the project file is wrong' \
  "${run[@]}" --project_path "$work/wrong.ini"
list=(--GraphMatching.match_list_path "$work/pairs.txt")
says 5 'The list of pairs is missing' "${run[@]}" "${list[@]}"
: >"$work/pairs.txt"
says 5 'The list of pairs is empty' "${run[@]}" "${list[@]}"
says 5 'The list of pairs is a directory' "${run[@]}" --GraphMatching.match_list_path "$place"
bound_says 5 'You may not read the list of pairs' "${run[@]}" --GraphMatching.match_list_path "$work/protected"
echo 'a.jpg b.jpg' >"$work/pairs.txt"
says 5 'The list names no image of the database' "${run[@]}" "${list[@]}"
echo 'place0/photo 0.jpg place0/photo 1.jpg' >>"$work/pairs.txt"
says 0 'Some lines of the list name no image of the database' \
  "${run[@]}" "${list[@]}"
[[ $(wc -l <"$work/pairs.after") == 2 ]] || fail 'not one pair was tested'

says 5 'The list of images that look for partners is missing' "${run[@]}" \
  --VocabTreeMatching.match_list_path "$work/images.txt"
fresh
replay=(--GraphMatching.replay_path "$work/edges.tsv")
says 5 'The finished graph to be replayed is missing' "${run[@]}" "${replay[@]}"
printf 'a.jpg\tb.jpg\t20\n' >"$work/edges.tsv"
says 5 'The finished graph names no image of the database' "${run[@]}" "${replay[@]}"
echo 'a.jpg b.jpg' >>"$work/edges.tsv"
says 5 'A line of the finished graph cannot be understood' "${run[@]}" "${replay[@]}"
printf 'a.jpg\tb.jpg\n' >"$work/ranked.tsv"
says 5 'A line of the ranked lists cannot be understood' "${run[@]}" \
  --GraphMatching.ranking_path "$work/ranked.tsv"
vectors=(--GraphMatching.descriptor file --GraphMatching.vectors_path "$work/vectors.npy")
says 5 'The file of vectors is missing' "${run[@]}" "${vectors[@]}"
echo 'no array' >"$work/vectors.npy"
says 5 'The file of vectors is no NumPy array' "${run[@]}" "${vectors[@]}"
piece='belong together' says 1 'Vectors of a file are asked for, and no file is given' "${run[@]}" \
  --GraphMatching.descriptor file
piece='give --image_path' says 1 'GIST without the photos' "${run[@]}" --GraphMatching.descriptor gist
piece='Is --image_path' says 5 'A photo is missing, for GIST' "${run[@]}" \
  --GraphMatching.descriptor gist --image_path "$work"
says 5 'The log of pairs cannot be written' "${run[@]}" --GraphMatching.pair_log "$work/none/log.csv"
partial=yes says 5 'The report cannot be written' "${run[@]}" \
  --GraphMatching.report "$work/none/report.json"
says 5 'The list of edges cannot be written' "${run[@]}" \
  --GraphMatching.export_pairs "$work/none/pairs.txt"
says 5 'The graph cannot be written' "${run[@]}" --GraphMatching.export_graph "$work/none/graph.dot"
says 5 'The log cannot be written' "${run[@]}" --log_path "$work/none/log.txt"
says 5 'A list is a device' "${run[@]}" --GraphMatching.match_list_path /dev/zero
cp "$database" "$place/other.db"
says 5 'A file to write is another database' "${run[@]}" \
  --GraphMatching.export_pairs "$place/other.db"
rm "$place/other.db"
echo 'my own names' >"$place/vectors.txt"
says 5 'What is written beside a file would take the place of one of yours' "${run[@]}" \
  --GraphMatching.descriptor fisher --GraphMatching.export_vectors "$place/vectors.npy"
rm "$place/vectors.txt"
says 1 'A file to write belongs to the database' "${run[@]}" \
  --GraphMatching.export_pairs "$database-wal"
says 1 'A file to write is the database' "${run[@]}" --GraphMatching.export_pairs "$database"
says 1 'The log is the database' "${run[@]}" --log_path "$database"
says 1 'Two files to write are one' "${run[@]}" --GraphMatching.report "$place/run.html" \
  --GraphMatching.export_pairs "$place/run.json"
says 1 'There is no directory of photos' "${run[@]}" --image_path "$place/photos"

theme output
works_with() {
  fresh
  says 0 "$1" bash -c "$2" bash "${run[@]}"
  expect_results small
}
works_with 'Standard output and standard error are closed' '"$@" >&- 2>&-'
works_with 'All three of the standard streams are closed' '"$@" >&- 2>&- <&-'
works_with 'Standard output is closed' '"$@" >&-'
works_with 'Standard output goes to a full disk' '"$@" >/dev/full'
works_with 'Both go to a full disk' '"$@" >/dev/full 2>&1'
fresh
says 0 'The log goes to a full disk' "${run[@]}" --log_path /dev/full
works_with 'Nobody reads the output (a pipe to a program that ends)' '"$@" 2>&1 | true; exit "${PIPESTATUS[0]}"'
says 0 'The help goes to a full disk' bash -c '"$@" >/dev/full' bash "$matcher" -h

# print_table FILE: cases with the same message share a row; those without one and without an error follow in a line.
print_table() {
  awk -F '\t' '
    $2 == 0 && $3 == "-" { quiet = quiet (quiet == "" ? "" : "; ") $1; next }
    { key = $2 FS $3 }
    !(key in cases) { keys[++count] = key; cases[key] = $1; next }
    { cases[key] = cases[key] "<br>" $1 }
    END {
      if (count > 0) print "| What happened | Exit code | Message |\n|---|---|---|"
      for (i = 1; i <= count; ++i) {
        split(keys[i], said, FS)
        print "| " cases[keys[i]] " | " said[1] " | " said[2] " |"
      }
      if (quiet != "") print (count > 0 ? "\n" : "") "No message, exit code 0: " quiet "."
    }' "$1"
}

# The document with what this run saw in place of its own tables.
while IFS= read -r line; do
  [[ ${inside:-no} == no || $line == '<!-- end of table -->' ]] || continue
  inside=no
  echo "$line"
  if [[ $line =~ ^'<!-- table: '([a-z]+)' -->'$ ]]; then
    inside=yes
    table=$work/tables/${BASH_REMATCH[1]}
    print_table "$table"
    mv "$table" "$table.used"
  fi
done <"$document" >"$work/errors.md"
unused=$(find "$work/tables" -type f ! -name '*.used')
[[ -z $unused ]] || fail "docs/errors.md has no place for $unused"
if [[ ${UPDATE:-} == 1 ]]; then
  cp "$work/errors.md" "$document"
else
  diff -u "$document" "$work/errors.md" ||
    fail "docs/errors.md (-) does not say what happens (+); to rewrite it: UPDATE=1 bash $0 $build $work"
fi
echo "$num_cases cases, $num_skipped skipped"
