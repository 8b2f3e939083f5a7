#!/bin/bash
# The nth thread, process or file that the system refuses, for every n: the run goes on with fewer and finds the same, or
# ends soon with an error that names the limit; the database is whole, and nothing is left behind. The table of what
# became of each n is printed. A test double stands in for COLMAP.
# shellcheck source-path=SCRIPTDIR disable=SC2016  # $ is for another shell.
source "$(dirname "$0")/common.sh"

fake=$build/tests/fake_colmap
refuse=$build/tests/libsystem_limits.so
export TMPDIR=$work/tmp
mkdir -p "$TMPDIR"
"$build/tests/make_synthetic_database" "$work/new.db" 2 6
content() {
  sqlite3 "$1" 'SELECT pair_id, rows, hex(data) FROM matches ORDER BY 1;
    SELECT pair_id, rows, hex(data), config, hex(F) FROM two_view_geometries ORDER BY 1'
}
cp "$work/new.db" "$work/undisturbed.db"
options=(--colmap_path "$fake" --SiftMatching.num_threads 4)
expect_exit 0 'Pairs tested' "$matcher" --database_path "$work/undisturbed.db" "${options[@]}"
content "$work/undisturbed.db" >"$work/expected"

# attempt TEXT...: runs the command that is set in `run` on a fresh database and puts what became of it into `outcome`:
# "as ever", or the exit code; an error has to contain one of the texts.
attempt() {
  local code=0 text is_explained=no
  rm -f "$work/run.db"*
  cp "$work/new.db" "$work/run.db"
  timeout --signal=KILL 120 "${run[@]}" --database_path "$work/run.db" "${options[@]}" >"$work/output.txt" 2>&1 ||
    code=$?
  check_integrity "$work/run.db"
  expect_empty "$TMPDIR"
  if ((code == 0)); then
    content "$work/run.db" | cmp - "$work/expected" || fail "other results"
    outcome='as ever'
    return
  fi
  outcome="exit code $code"
  ((code < 128)) || { cat "$work/output.txt"; fail "it was killed or hung: $code"; }
  for text; do ! grep -q -F -- "$text" "$work/output.txt" || is_explained=yes; done
  [[ $is_explained == yes ]] || { cat "$work/output.txt"; fail "n = ${n:-}: exit code $code, and no word of the limit"; }
}

# table WHAT LAST: prints n and outcome, equal ones in one line.
rows=()
table() {
  printf '%s: refused from the nth on\n' "$1"
  printf '  n = %s and following: %s\n' "${rows[@]}"
  rows=()
}
last_outcome=
note() {
  [[ $outcome == "$last_outcome" ]] || rows+=("$1" "$outcome")
  last_outcome=$outcome
}

for kind in thread process; do
  last_outcome=
  for n in {1..40}; do
    run=(env "LD_PRELOAD=$refuse" "GRAPHMATCH_TEST_REFUSE=$kind" "GRAPHMATCH_TEST_FROM=$n" "$matcher")
    attempt 'ulimit -u'
    [[ $kind == process || $outcome == 'as ever' ]] || fail "$n threads are not enough"
    note "$n"
    # A process that is refused once, and not again, costs nothing.
    if [[ $kind == process && $outcome != 'as ever' ]]; then
      run=(env GRAPHMATCH_TEST_ONCE=1 "${run[@]:1}")
      attempt
      [[ $outcome == 'as ever' ]] || fail "the ${n}th process, refused once: $outcome"
      outcome=$last_outcome
    fi
    # The first one guards the working directory: a run can do without it.
    [[ $kind == thread || $outcome != 'as ever' || $n == 1 ]] || break
  done
  [[ $outcome == 'as ever' ]] || fail "$kind: $outcome for every n"
  table "$kind"
done

# Files: fewer than the loader needs to start the program are not its own.
last_outcome=
for n in {40..5}; do
  run=(bash -c 'ulimit -n "$1"; shift; exec "$@"' bash "$n" "$matcher")
  attempt 'open more files' 'Too many open files' 'error while loading shared libraries'
  note "$n"
done
table 'file (n + 1)'

# As a user meets it: a limit on processes that root is not bound by.
chmod 777 "$work" "$TMPDIR"
as_other_user=(setpriv --reuid 65533 --regid 65533 --clear-groups)
if ((EUID == 0)) && "${as_other_user[@]}" test -x "$matcher" -a -x "$fake" -a -w "$TMPDIR"; then
  chmod 666 "$work/new.db"
  last_outcome=
  for n in 1 2 3 4 5 6 8 10 12 16 20; do
    rm -f "$work/run.db"*
    cp "$work/new.db" "$work/run.db"
    chmod 666 "$work/run.db"
    code=0
    (
      ulimit -u "$n"
      exec timeout --signal=KILL 120 "${as_other_user[@]}" "$matcher" --database_path "$work/run.db" --colmap_path \
        "$fake" --SiftMatching.num_threads 8
    ) >"$work/output.txt" 2>&1 || code=$?
    case $code in
      0) content "$work/run.db" | cmp - "$work/expected" || fail "other results under ulimit -u $n" ;;
      5) grep -q 'ulimit -u' "$work/output.txt" || { cat "$work/output.txt"; fail 'no word of the limit'; } ;;
      126 | 127) ;; # timeout itself cannot start it.
      *) cat "$work/output.txt"; fail "ulimit -u $n: exit code $code" ;;
    esac
    expect_empty "$TMPDIR"
    outcome="exit code $code"
    note "$n"
  done
  table 'process or thread of a user (ulimit -u, n + 1)'
else
  echo "SKIPPED: ulimit -u (it takes root, and a directory that other users may look into)"
fi
