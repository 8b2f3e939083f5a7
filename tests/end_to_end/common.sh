# shellcheck shell=bash disable=SC2034  # What it defines is used by the tests.
# Sourced by the end-to-end tests: bash NAME.sh BUILD_DIR WORK_DIR.
set -euo pipefail

build=$1
work=$2
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
matcher=$build/colmap_graphmatch/graphmatch_matcher
# The COLMAP that spelling and extract ask: the installed one, unless a test has another for them.
colmap=colmap
rm -rf "$work"
mkdir -p "$work"

fail() {
  echo "FAILED: $*" >&2
  exit 1
}

# use_test_double: the database of four places of ten images each, which untouched.db is a copy of, and the command
# that matches it with the test double as COLMAP.
use_test_double() {
  fake=$build/tests/fake_colmap
  database="$work/photos of a place.db"
  "$build/tests/make_synthetic_database" "$database" 4 10
  cp "$database" "$work/untouched.db"
  export TMPDIR=$work/tmp
  mkdir -p "$TMPDIR"
  run=("$matcher" --database_path "$database" --colmap_path "$fake")
}

# expect_exit CODE TEXT COMMAND...: the command ends with the code, and its output contains the text.
expect_exit() {
  local expected=$1 text=$2 code=0
  shift 2
  "$@" >"$work/output.txt" 2>&1 || code=$?
  [[ $code == "$expected" ]] || { cat "$work/output.txt"; fail "exit code $code, not $expected: $*"; }
  grep -q -F -- "$text" "$work/output.txt" || { cat "$work/output.txt"; fail "no '$text': $*"; }
}

# spelling COMMAND OPTION: what COLMAP calls an option, e.g. --SiftMatching.use_gpu.
spelling() {
  local options
  options=$("$colmap" "$1" -h 2>&1)
  grep -o -m 1 -E -- "--[A-Za-z]+\.$2\b" <<<"$options"
}

# extract DATABASE IMAGES FEATURES SIZE [OPTION VALUE]...: features by COLMAP.
extract() {
  "$colmap" feature_extractor --database_path "$1" --image_path "$2" "$(spelling feature_extractor use_gpu)" 0 \
    "$(spelling feature_extractor max_num_features)" "$3" \
    "$(spelling feature_extractor max_image_size)" "$4" "${@:5}" >"$work/extraction.log" 2>&1 ||
    { tail -n 5 "$work/extraction.log"; fail "$colmap feature_extractor"; }
}

# The tested pairs of a database with their outcomes, one a line.
tested_pairs() {
  sqlite3 "$1" 'SELECT pair_id, rows > 0 FROM two_view_geometries ORDER BY pair_id'
}

count_tested() { sqlite3 "$1" 'SELECT count(*) FROM two_view_geometries'; }

check_integrity() {
  [[ $(sqlite3 "$1" 'PRAGMA integrity_check') == ok ]] || fail "$1 is damaged"
  local lonely
  lonely=$(sqlite3 "$1" 'SELECT count(*) FROM two_view_geometries WHERE pair_id NOT IN
                         (SELECT pair_id FROM matches)')
  [[ $lonely == 0 ]] || fail "$1 has $lonely geometries without matches"
}

# expect_empty DIRECTORY: the runs that used it have left nothing there. The guards of killed ones get a moment.
expect_empty() {
  local left
  for _ in {1..100}; do
    left=$(find "$1" -mindepth 1 -maxdepth 1)
    [[ -n $left ]] || return 0
    sleep 0.1
  done
  fail "left behind: $left"
}
