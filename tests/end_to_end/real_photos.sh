#!/bin/bash
# Four places of real photos, with the installed COLMAP: what graphmatch_matcher finds is held against the
# edges of exhaustive matching at full size, COLMAP is killed while it works, and the run is interrupted.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"

photos=${GRAPHMATCH_PHOTOS:-}
if [[ -z $photos || ! -f $photos/dev.edges.tsv ]]; then
  echo "SKIPPED: no real photos at '$photos'. Set GRAPHMATCH_PHOTOS (see CONTRIBUTING.md)."
  exit 77
fi
command -v colmap >/dev/null || { echo "COLMAP is not installed."; exit 77; }

mkdir "$work/images"
awk -F '\t' '$2 ~ /^(entry|fountain|kermit|vggsfm_statue)$/ { print $1 "\t" $2 }' \
  "$photos/dev.scenes.tsv" >"$work/scenes.tsv"
cut -f 1 "$work/scenes.tsv" | while read -r name; do cp "$photos/dev/$name" "$work/images/"; done
echo "$(wc -l <"$work/scenes.tsv") photos"

extract "$work/features.db" "$work/images" 1024 800

"$build/tests/check_matching" "$work/features.db" 30

# recall DATABASE: the share of the strong true edges (50 inliers and more at full size) that it has, and a
# failure if it has an edge between places that share nothing.
recall() {
  sqlite3 -separator $'\t' "$1" "SELECT a.name, b.name FROM two_view_geometries t
    JOIN images a ON a.image_id = t.pair_id / 2147483647
    JOIN images b ON b.image_id = t.pair_id % 2147483647
    WHERE t.rows >= 15 AND t.config NOT IN (0, 1, 7)" >"$work/edges.tsv"
  awk -F '\t' '
    FILENAME ~ /scenes/ { place[$1] = $2; next }
    FILENAME ~ /dev.edges/ {
      if ($1 !~ /^#/ && $1 in place && $2 in place) {
        linked[place[$1], place[$2]] = linked[place[$2], place[$1]] = 1
        if ($3 >= 50) strong[$1, $2] = 1
      }
      next
    }
    {
      found[$1, $2] = found[$2, $1] = 1
      if (!((place[$1], place[$2]) in linked)) {
        print "an edge between places: " $0 > "/dev/stderr"; bad = 1
      }
    }
    END {
      if (bad) exit 1
      for (pair in strong) { total++; hit += (pair in found) }
      printf "%.4f\n", hit / total
    }' "$work/scenes.tsv" "$photos/dev.edges.tsv" "$work/edges.tsv"
}

# check DATABASE: nothing was lost, and nothing is left to do.
check() {
  check_integrity "$1"
  local found
  found=$(recall "$1")
  echo "$(count_tested "$1") pairs, recall of strong edges: $found"
  awk -v r="$found" 'BEGIN { exit !(r >= 0.97) }' || fail "recall $found"
  expect_exit 0 'Pairs tested       0 of 820' "$matcher" --database_path "$1"
}

echo "== An undisturbed run"
cp "$work/features.db" "$work/undisturbed.db"
"$matcher" --database_path "$work/undisturbed.db" | tee "$work/undisturbed.txt"
check "$work/undisturbed.db"

# All that was found: matches, inliers and matrices.
content() {
  sqlite3 "$1" 'SELECT pair_id, rows, hex(data) FROM matches ORDER BY 1;
    SELECT pair_id, rows, hex(data), config, hex(F), hex(E), hex(H) FROM two_view_geometries ORDER BY 1'
}

echo "== The same to the last bit on another number of threads, with a cache for two images"
content "$work/undisturbed.db" >"$work/undisturbed.content"
cp "$work/features.db" "$work/threads.db"
"$matcher" --database_path "$work/threads.db" --SiftMatching.num_threads 3 \
  --GraphMatching.cache_gb 0.0003 | grep 'Exact matching'
content "$work/threads.db" | cmp - "$work/undisturbed.content" || fail "another result"

echo "== Pairs with too few matches have the rows that COLMAP writes"
cp "$work/features.db" "$work/unmatched.db"
sqlite3 -separator ' ' "$work/undisturbed.db" "SELECT a.name, b.name FROM matches m
  JOIN images a ON a.image_id = m.pair_id / 2147483647
  JOIN images b ON b.image_id = m.pair_id % 2147483647
  WHERE m.rows = 0 ORDER BY m.pair_id LIMIT 20" >"$work/unmatched.txt"
colmap matches_importer --database_path "$work/unmatched.db" --match_list_path "$work/unmatched.txt" \
  --match_type pairs "$(spelling matches_importer use_gpu)" 0 >"$work/unmatched.log" 2>&1
rows() {
  for table in matches two_view_geometries; do
    columns=$(sqlite3 "$1" "SELECT group_concat('quote(' || name || ')', ', ') FROM pragma_table_info('$table')")
    sqlite3 "$1" "SELECT $columns FROM $table WHERE pair_id IN (SELECT pair_id FROM matches WHERE rows = 0)
      ORDER BY pair_id"
  done
}
rows "$work/unmatched.db" >"$work/colmap.rows"
(($(wc -l <"$work/colmap.rows") >= 30)) || fail "COLMAP matched what was not matched here"
rows "$work/undisturbed.db" | grep -F -x -f "$work/colmap.rows" | cmp - "$work/colmap.rows" ||
  fail "rows unlike COLMAP's"

# disturbing_colmap PATH KILLED INTERRUPTING: writes a COLMAP that is killed in the middle of the first attempt at the
# shards of these numbers, in the order in which they come, and that interrupts its caller after the shard of that number.
# (By numbers, for a signal after some time may come too late.)
disturbing_colmap() {
  cat >"$1" <<END
#!/bin/bash
[[ "\$*" == matches_importer*--match_list_path* ]] || exec colmap "\$@"
exec 9>>"$1.lock"
flock 9
list=\$(sed -E 's/.*--match_list_path ([^ ]+).*/\1/' <<<"\$*")
shard=\$(sha256sum <"\$list")
echo "\$shard" >>"$1.shards"
attempts=\$(grep -c -F "\$shard" "$1.shards")
number=\$(awk '!seen[\$0]++' "$1.shards" | grep -n -F "\$shard" | cut -d : -f 1)
exec 9>&-
if ((attempts == 1)) && [[ " $2 " == *" \$number "* ]]; then
  colmap "\$@" &
  sleep 0.1
  echo "\$number" >>"$1.killed"
  kill -KILL \$! \$\$
fi
colmap "\$@"
code=\$?
if ((number == $3 && attempts == 1)); then kill -INT \$PPID; fi
exit \$code
END
  chmod +x "$1"
}

# interrupted DATABASE COLMAP [OPTION VALUE]...: the run ends by the interruption, before it is through.
interrupted() {
  # On many cores all shards would be at work by then.
  expect_exit 130 'run the same command again' "$matcher" --database_path "$1" --colmap_path "$2" \
    --SiftMatching.num_threads 2 "${@:3}"
  check_integrity "$1"
  echo "interrupted at $(count_tested "$1") pairs"
}

echo "== COLMAP killed while it works, then Ctrl-C, then the same command again"
cp "$work/features.db" "$work/disturbed.db"
disturbing_colmap "$work/disturbing_colmap" '1 4' 6
interrupted "$work/disturbed.db" "$work/disturbing_colmap"
(($(wc -l <"$work/disturbing_colmap.killed") == 2)) || fail "COLMAP was not killed twice"
(($(count_tested "$work/disturbed.db") < $(count_tested "$work/undisturbed.db"))) || fail "the interruption came too late"
expect_exit 0 'Pairs tested' "$matcher" --database_path "$work/disturbed.db"
check "$work/disturbed.db"
content "$work/disturbed.db" | cmp - "$work/undisturbed.content" || fail "another result after a disturbance"

echo "== Five photos come to a matched database"
added='image_id % 8 = 5'
cp "$work/features.db" "$work/grown.db"
sqlite3 "$work/grown.db" "PRAGMA foreign_keys = ON; DELETE FROM images WHERE $added"
"$matcher" --database_path "$work/grown.db" >"$work/output.txt" 2>&1 || { cat "$work/output.txt"; fail "the first run"; }
before=$(count_tested "$work/grown.db")
sqlite3 "$work/grown.db" "ATTACH '$work/features.db' AS all_features;
  INSERT INTO images SELECT * FROM all_features.images WHERE $added;
  INSERT INTO keypoints SELECT * FROM all_features.keypoints WHERE $added;
  INSERT INTO descriptors SELECT * FROM all_features.descriptors WHERE $added"
expect_exit 0 'those of 36 images are from the last run' "$matcher" --database_path "$work/grown.db"
check "$work/grown.db"
of_old=$(sqlite3 "$work/grown.db" "SELECT count(*) FROM two_view_geometries
  WHERE pair_id / 2147483647 % 8 != 5 AND pair_id % 2147483647 % 8 != 5")
echo "$before pairs before, $(count_tested "$work/grown.db") after, $((of_old - before)) of the new ones of old photos alone"
((of_old - before <= 20)) || fail "$((of_old - before)) more pairs of photos that were matched already"

echo "== All pairs, interrupted: the same as undisturbed"
cp "$work/features.db" "$work/exhaustive.db"
"$matcher" --database_path "$work/exhaustive.db" --GraphMatching.strategy exhaustive >"$work/exhaustive.txt" 2>&1
content "$work/exhaustive.db" >"$work/exhaustive.content"
cp "$work/features.db" "$work/interrupted.db"
disturbing_colmap "$work/interrupting_colmap" '' 3
interrupted "$work/interrupted.db" "$work/interrupting_colmap" --GraphMatching.strategy exhaustive
(($(count_tested "$work/interrupted.db") < 820)) || fail "the interruption came too late"
expect_exit 0 'Pairs tested' "$matcher" --database_path "$work/interrupted.db" --GraphMatching.strategy exhaustive
content "$work/interrupted.db" | cmp - "$work/exhaustive.content" || fail "another result after an interruption"

echo "== The mapper"
mkdir "$work/sparse"
colmap mapper --database_path "$work/undisturbed.db" --image_path "$work/images" \
  --output_path "$work/sparse" >"$work/mapper.log" 2>&1
registered=0
for model in "$work"/sparse/*/; do
  count=$(colmap model_analyzer --path "$model" 2>&1 |
    sed -n -E 's/.*Registered images: ([0-9]+).*/\1/p' | head -n 1)
  echo "$model: $count"
  registered=$((registered + count))
done
((registered >= 30)) || fail "$registered of 41 images registered"
