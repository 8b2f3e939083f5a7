#!/bin/bash
# What the program prints on a terminal, into a file and into nothing. A test double stands in for COLMAP.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"

python=/usr/bin/python3
[[ -x $python ]] || { echo "SKIPPED: no $python"; exit 77; }

fake=$build/tests/fake_colmap
"$build/tests/make_synthetic_database" "$work/untouched.db" 4 10
unset NO_COLOR
export TERM=xterm-256color TMPDIR=$work
escape=$'\033'
log_line='^[IWE][0-9]{8} [0-9:]{8}\.[0-9]{6} [0-9]+ graphmatch_matcher\] .'

# on_terminal EXPECTED_CODE COLUMNS NAME [--interrupt] [OPTION...]
on_terminal() {
  local expected=$1 columns=$2 name=$3 code=0 interrupt=()
  shift 3
  [[ ${1:-} != --interrupt ]] || { interrupt=(--interrupt); shift; }
  cp "$work/untouched.db" "$work/$name.db"
  "$python" "$root/tests/support/run_in_terminal.py" "$columns" "$work/$name" "${interrupt[@]}" \
    "$matcher" --database_path "$work/$name.db" --colmap_path "$fake" "$@" || code=$?
  [[ $code == "$expected" ]] || { cat "$work/$name.final"; fail "$name: exit code $code, not $expected"; }
}

# expect_count NUMBER PATTERN FILE
expect_count() {
  local found
  found=$(grep -c -E -- "$2" "$3" || true)
  [[ $found == "$1" ]] || { cat "$3"; fail "$3 has $found lines with $2, not $1"; }
}

echo "== A block that fits, is there once, and goes"
for columns in 60 200; do
  FAKE_COLMAP_DELAY_MS=2 on_terminal 0 "$columns" "wide$columns"
  frames=$work/wide$columns.frames
  num_frames=$(grep -c $'\f' "$frames")
  for field in '^(sampling|likeliest) [0-9]+ \[=*>? *\] +[0-9]+ % .* left' 'pairs tested ' 'pairs/s ' ' edges' \
    'efficiency [0-9.-]+ now, [0-9.-]+ overall' ' components' 'largest [0-9]+ images' 'images alone'; do
    expect_count "$num_frames" "$field" "$frames"
  done
  expect_count 0 'pairs tested|images alone' "$work/wide$columns.final"
  expect_count 1 '^Pairs tested' "$work/wide$columns.stdout"
  grep -q "$escape\\[32m" "$work/wide$columns.raw" || fail "no colour"
done

echo "== A terminal that is too narrow for a field"
for columns in 30 46; do
  FAKE_COLMAP_DELAY_MS=2 on_terminal 0 "$columns" "narrow$columns"
  # The lines of the log are wrapped, somewhere, since numbers of processes differ in length; none is overwritten.
  tr -d ' \n' <"$work/narrow$columns.final" | grep -q 'Learntavocabularyof.*Described40imagesby' ||
    { cat "$work/narrow$columns.final"; fail "the block is in the log"; }
  expect_count 0 'images alone' "$work/narrow$columns.final"
done

echo "== In another process group the terminal is left alone, and the progress is logged"
cp "$work/untouched.db" "$work/group.db"
FAKE_COLMAP_DELAY_MS=20 "$python" "$root/tests/support/run_in_terminal.py" 200 "$work/group" \
  "$BASH" -c 'timeout 300 "$@"; exit $?' bash "$matcher" --database_path "$work/group.db" --colmap_path "$fake"
expect_count 0 'images alone$' "$work/group.frames"
grep -q -E '^I.*: [0-9]+ pairs tested' "$work/group.final" || fail "no progress without a block"

echo "== A warning comes above the block"
FAKE_COLMAP_FAULT=crash FAKE_COLMAP_FAULT_PAIR='1 2' FAKE_COLMAP_DELAY_MS=2 on_terminal 0 200 warning
expect_count 1 '^W[0-9].* COLMAP failed on the pair' "$work/warning.final"
expect_count 0 'images alone' "$work/warning.final"
awk -v RS='\f\n' '/COLMAP failed on/ { ++num; if ($0 !~ /COLMAP failed on.*pairs tested/) exit 1 }
  END { exit num == 0 }' "$work/warning.frames" || fail "a warning without the block below it"

echo "== Without colours"
for how in 'NO_COLOR=1' '--log_color 0'; do
  if [[ $how == NO_COLOR=1 ]]; then
    NO_COLOR=1 on_terminal 0 80 colourless
  else
    on_terminal 0 80 colourless --log_color 0
  fi
  if grep -q -E "$escape\\[[0-9;]*m" "$work/colourless.raw"; then fail "$how: colours"; fi
  grep -q 'pairs tested' "$work/colourless.frames" || fail "$how: no block"
done
NO_COLOR='' on_terminal 0 80 empty
grep -q "$escape\\[32m" "$work/empty.raw" || fail "an empty NO_COLOR is none"

echo "== Ctrl-C"
FAKE_COLMAP_DELAY_MS=20 on_terminal 130 80 interrupted --interrupt
expect_count 1 '^I[0-9].*Stopped as asked' "$work/interrupted.final"
expect_count 0 'images alone' "$work/interrupted.final"
expect_count 1 '^Pairs tested' "$work/interrupted.stdout"

echo "== An error"
FAKE_COLMAP_FAULT=exit FAKE_COLMAP_FAULT_PAIR=all on_terminal 4 200 error
expect_count 1 '^E[0-9].*COLMAP fails on every pair' "$work/error.final"
expect_count 0 'images alone' "$work/error.final"

echo "== Plain lines on a dumb terminal, and where there is none"
TERM=dumb on_terminal 0 500 dumb --log_level 3
if grep -q "$escape" "$work/dumb.raw"; then fail "orders to a dumb terminal"; fi
expect_count 1 'sampling 1 ended: [0-9]+ pairs tested, [0-9]+ edges' "$work/dumb.final"
cp "$work/untouched.db" "$work/plain.db"
"$matcher" --database_path "$work/plain.db" --colmap_path "$fake" --log_level 3 >"$work/plain.stdout" 2>"$work/plain.txt"
grep -v -E "$log_line" "$work/plain.txt" && fail "a line that is none of the log"
expect_count 1 'sampling 1 ended: [0-9]+ pairs tested, [0-9]+ edges' "$work/plain.txt"

echo "== Severities, and quiet"
cp "$work/untouched.db" "$work/severe.db"
FAKE_COLMAP_FAULT=crash FAKE_COLMAP_FAULT_PAIR='1 2' "$matcher" --database_path "$work/severe.db" \
  --colmap_path "$fake" --log_severity 1 >"$work/severe.stdout" 2>"$work/severe.txt"
expect_count 0 '^I' "$work/severe.txt"
expect_count 1 '^W' "$work/severe.txt"
expect_count 1 '^Pairs tested' "$work/severe.stdout"
on_terminal 0 80 quiet --GraphMatching.quiet 1
[[ ! -s $work/quiet.raw && ! -s $work/quiet.stdout ]] || fail "quiet prints: $(cat "$work/quiet.raw" "$work/quiet.stdout")"
FAKE_COLMAP_FAULT=crash FAKE_COLMAP_FAULT_PAIR='1 2' on_terminal 0 200 quiet --GraphMatching.quiet 1
expect_count 1 '^W' "$work/quiet.final"
expect_count 0 '^I' "$work/quiet.final"

echo "== A log file"
mkdir "$work/logs"
for target in stderr_and_file file; do
  cp "$work/untouched.db" "$work/logged.db"
  rm -f "$work/logged.db.graphmatch"
  "$matcher" --database_path "$work/logged.db" --colmap_path "$fake" --log_target $target --log_path "$work/logs" \
    >"$work/logged.stdout" 2>"$work/logged.txt"
  if [[ $target == file ]]; then
    [[ ! -s $work/logged.txt ]] || fail "a log on the standard error output, too"
  else
    cmp "$work/logged.txt" "$work/logs/graphmatch_matcher.log" || fail "the file has another log"
  fi
done
expect_count 2 'Learnt a vocabulary' "$work/logs/graphmatch_matcher.log"
expect_exit 2 'There is no database' "$matcher" --database_path "$work/none.db" --log_target file \
  --log_path "$work/logs/errors.log"
expect_count 1 '^E.*There is no database' "$work/logs/errors.log"
expect_exit 5 'Cannot write /nowhere/a.log: No such file or directory' \
  "$matcher" --database_path "$work/logged.db" --log_path /nowhere/a.log
