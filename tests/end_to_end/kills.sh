#!/bin/bash
# Runs that are killed with -9 at random moments, again and again until one gets through: the database is never
# damaged, nothing is left behind, and in the end it has what an undisturbed run would have found. First with the test
# double of COLMAP, then, where the demo's photos can be rendered, with the installed COLMAP.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"

export TMPDIR=$work/tmp
mkdir -p "$TMPDIR"
fake=$build/tests/fake_colmap
RANDOM=20171010

# Everything that was found: matches, inliers and matrices.
content() {
  sqlite3 "$1" 'SELECT pair_id, rows, hex(data) FROM matches ORDER BY 1;
    SELECT pair_id, rows, hex(data), config, hex(F), hex(E), hex(H) FROM two_view_geometries ORDER BY 1'
}

total=0

# kill_until_done NAME START WANTED LONGEST COMMAND...: from copies of the database START (and of its state file), runs
# the command with --database_path, killed at random moments of at most LONGEST milliseconds, until there were WANTED
# kills.
kill_until_done() {
  local name=$1 start=$2 wanted=$3 longest=$4
  shift 4
  local database=$work/$name.run.db kills=0 rounds=0 pid code
  fresh() {
    rm -f "$database"*
    cp "$start" "$database"
    if [[ -e $start.graphmatch ]]; then cp "$start.graphmatch" "$database.graphmatch"; fi
  }
  fresh
  "$@" --database_path "$database" >"$work/output.txt" 2>&1 || { cat "$work/output.txt"; fail "$name"; }
  content "$database" >"$work/$name.expected"
  while ((kills < wanted)); do
    rounds=$((rounds + 1))
    fresh
    while true; do
      "$@" --database_path "$database" >"$work/output.txt" 2>&1 &
      pid=$!
      sleep "$(printf '0.%03d' $((RANDOM % longest)))"
      # A run that may live longer gets through at some time.
      longest=$((longest < 990 ? longest + 5 : 990))
      if ((kills >= wanted)); then wait "$pid" || true; break; fi
      kill -KILL "$pid" 2>/dev/null || true
      code=0
      wait "$pid" 2>/dev/null || code=$?
      if ((code == 0)); then break; fi
      [[ $code == 137 ]] || { cat "$work/output.txt"; fail "$name: exit code $code"; }
      kills=$((kills + 1))
      check_integrity "$database"
    done
    # Whatever state the kills left, the next run goes on to the end.
    "$@" --database_path "$database" >"$work/output.txt" 2>&1 || { cat "$work/output.txt"; fail "$name"; }
    check_integrity "$database"
    content "$database" | cmp - "$work/$name.expected" || fail "$name: another result after kills"
  done
  total=$((total + kills))
  echo "$name: $kills kills in $rounds rounds, always the same $(wc -l <"$work/$name.expected") rows"
}

echo "== With the test double"
"$build/tests/make_synthetic_database" "$work/new.db" 4 10
export FAKE_COLMAP_DELAY_MS=2
kill_until_done new "$work/new.db" 20 900 "$matcher" --colmap_path "$fake"

# Pairs of another matcher: of images in sequence.
cp "$work/new.db" "$work/others.db"
sqlite3 "$work/others.db" "
  INSERT INTO matches SELECT 2147483647 * a.image_id + b.image_id, 0, 2, NULL FROM images a JOIN images b
    ON b.image_id BETWEEN a.image_id + 1 AND a.image_id + 5;
  INSERT INTO two_view_geometries(pair_id, rows, cols, config)
    SELECT pair_id, 0, 2, 0 FROM matches"
kill_until_done after_another_matcher "$work/others.db" 15 900 "$matcher" --colmap_path "$fake"

# Five images come to the other 35, which have been matched.
cp "$work/new.db" "$work/grown.db"
sqlite3 "$work/grown.db" "PRAGMA foreign_keys = ON; DELETE FROM images WHERE image_id % 8 = 3"
"$matcher" --database_path "$work/grown.db" --colmap_path "$fake" >"$work/output.txt" 2>&1
sqlite3 "$work/grown.db" "ATTACH '$work/new.db' AS new;
  INSERT INTO images SELECT * FROM new.images WHERE image_id % 8 = 3;
  INSERT INTO keypoints SELECT * FROM new.keypoints WHERE image_id % 8 = 3;
  INSERT INTO descriptors SELECT * FROM new.descriptors WHERE image_id % 8 = 3"
kill_until_done grown "$work/grown.db" 15 700 "$matcher" --colmap_path "$fake"
unset FAKE_COLMAP_DELAY_MS

if [[ -x $build/scripts/photo_renderer/render_photos ]] && command -v colmap >/dev/null; then
  echo "== With the installed COLMAP"
  "$build/scripts/photo_renderer/render_photos" --output_path "$work/rendered" >"$work/render.log"
  extract "$work/real.db" "$work/rendered" 1024 640
  kill_until_done real "$work/real.db" 12 990 "$matcher"
else
  echo "SKIPPED: the installed COLMAP; this build has no renderer of photos, or COLMAP is not installed."
fi

((total >= 50)) || fail "$total kills"
echo "$total kills survived"

echo "== Nothing is left behind"
expect_empty "$TMPDIR"
