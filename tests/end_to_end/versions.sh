#!/bin/bash
# versions.sh BUILD_DIR WORK_DIR SHARED_DIR MADE_BY TESTED: a database that one COLMAP (MADE_BY) made, matched by
# graphmatch_matcher with another (TESTED). Afterwards the database has to be what MADE_BY's own tools and the newer
# of the two expect, and their mappers have to register the images that they register after their own
# exhaustive_matcher. MADE_BY and TESTED are absolute paths. SHARED_DIR keeps what several pairs of versions need:
# photos, features and the results of exhaustive matching. WORK_DIR/row.tsv gets the pair's row of the table.
# shellcheck source-path=SCRIPTDIR
source "$(dirname "$0")/common.sh"
shared=${3:?a directory that the pairs of versions share}
made_by=${4:?the path of the COLMAP that makes the database}
tested=${5:?the path of the COLMAP that graphmatch_matcher uses}
mkdir -p "$shared"

# Where geometries of pairs have to be looked at closely: the values that stand for "not set". COLMAP before 4.0
# writes zeros (of either sign) and the identity, later ones and graphmatch_matcher NULL.
is_zero() { echo "trim(hex($1), '08') = ''"; }
is_identity="(substr(hex(qvec), 1, 16) = '000000000000F03F' AND trim(substr(hex(qvec), 17), '08') = ''
              AND $(is_zero tvec))"
edges="rows >= 15 AND config NOT IN (0, 1, 7)"

version_of() {
  local help
  help=$("$1" help)
  grep -o -m 1 -E '[0-9]+\.[0-9]+(\.[0-9]+)?' <<<"$help"
}

# at_least VERSION VERSION: the first is as new as the second, or newer.
at_least() { [[ $(printf '%s\n' "$1" "$2" | sort -V | sed -n '$p') == "$1" ]]; }

# expect_none DATABASE QUERY WHAT: the number that the query gives is 0.
expect_none() {
  local count
  count=$(sqlite3 "$1" "$2")
  [[ $count == 0 ]] || fail "$count $3"
}

columns_of() { sqlite3 "$1" "SELECT name FROM pragma_table_info('$2')"; }

# A table row by row, every value as SQL would spell it.
rows_of() {
  local quoted
  quoted=$(columns_of "$1" "$2" | sed 's/.*/quote(&)/' | paste -s -d ,)
  sqlite3 "$1" "SELECT $quoted FROM $2" | LC_ALL=C sort
}

# Everything that a matcher has no business with: schema, version, and all tables but two.
surroundings() {
  sqlite3 "$1" 'PRAGMA user_version; SELECT sql FROM sqlite_master ORDER BY type, name'
  local table
  for table in $(sqlite3 "$1" "SELECT name FROM sqlite_master WHERE type = 'table'
                               AND name NOT IN ('matches', 'two_view_geometries') ORDER BY name"); do
    echo "$table"
    rows_of "$1" "$table"
  done
}

# Of every pair with inliers: its configuration, and which of its matrices, poses and cameras are set.
patterns() {
  local column set=''
  for column in $(columns_of "$1" two_view_geometries); do
    case $column in
      pair_id | rows | cols | data | config) ;;
      qvec | tvec)
        set+=" || CASE WHEN qvec IS NULL OR $(is_zero qvec) OR $is_identity THEN '' ELSE ' $column' END" ;;
      *) set+=" || CASE WHEN $column IS NULL OR $(is_zero "$column") THEN '' ELSE ' $column' END" ;;
    esac
  done
  sqlite3 "$1" "SELECT pair_id, config $set FROM two_view_geometries WHERE rows > 0 ORDER BY pair_id"
}

# Of pairs without inliers: the configurations, for those with and without matches.
failures() {
  sqlite3 "$1" "SELECT DISTINCT CASE WHEN m.rows > 0 THEN 'matches' ELSE 'no matches' END || ' config ' || t.config
    FROM two_view_geometries t JOIN matches m USING(pair_id) WHERE t.rows = 0 ORDER BY 1"
}

# exhaustive COLMAP DATABASE: COLMAP's own matcher on all pairs.
exhaustive() {
  colmap=$1
  "$1" exhaustive_matcher --database_path "$2" "$(spelling exhaustive_matcher use_gpu)" 0 >"$2.log" 2>&1 ||
    { tail -n 5 "$2.log"; fail "$1 exhaustive_matcher on $2"; }
}

# registered COLMAP DATABASE: the names of the images that its mapper registers.
registered() {
  rm -rf "$2.sparse"
  mkdir "$2.sparse"
  "$1" mapper --database_path "$2" --image_path "$shared/images" --output_path "$2.sparse" >"$2.log" 2>&1 ||
    { tail -n 5 "$2.log" >&2; fail "$1 mapper on $2"; }
  local model
  for model in "$2.sparse"/*/; do
    "$1" model_converter --input_path "$model" --output_path "$model" --output_type TXT >"$2.log" 2>&1 ||
      { tail -n 5 "$2.log" >&2; fail "$1 model_converter on $model"; }
    # Two lines an image: the second has its points, and may be empty.
    awk '!/^#/ && ++line % 2 { print $10 }' "$model/images.txt"
  done | LC_ALL=C sort -u
}

# compare_mapper COLMAP VERSION: it registers the images that it registers after its own exhaustive matcher.
compare_mapper() {
  local reference=$shared/made-by-$old.exhaustive-$2
  if [[ ! -e $reference.registered ]]; then
    cp "$features" "$reference.db"
    exhaustive "$1" "$reference.db"
    cp "$reference.db" "$work/mapped.db"
    registered "$1" "$work/mapped.db" >"$work/registered.txt"
    mv "$work/registered.txt" "$reference.registered"
  fi
  num_exhaustive_edges=$(sqlite3 "$reference.db" "SELECT count(*) FROM two_view_geometries WHERE $edges")
  num_exhaustive_registered=$(wc -l <"$reference.registered")
  cp "$database" "$work/mapped.db"
  registered "$1" "$work/mapped.db" >"$work/registered.txt"
  num_registered=$(wc -l <"$work/registered.txt")
  mappers+=${mappers:+, }$2
  # Fewer would say nothing: the photos are such that every version can do it.
  ((num_exhaustive_registered >= 10)) ||
    fail "after its own exhaustive matching COLMAP $2 registers only $num_exhaustive_registered images"
  diff "$reference.registered" "$work/registered.txt" >"$work/difference.txt" ||
    { cat "$work/difference.txt"; fail "COLMAP $2 registers other images than after its own matcher"; }
  ((10 * num_edges >= 9 * num_exhaustive_edges)) ||
    fail "$num_edges edges, and $num_exhaustive_edges by COLMAP $2"
}

old=$(version_of "$made_by")
new=$(version_of "$tested")
num_tested=- num_edges=- num_exhaustive_edges=- num_registered=- num_exhaustive_registered=- mappers='' result=failed
write_row() {
  printf '%s\t' "$old" "$new" "$num_tested" "$num_edges ($num_exhaustive_edges)" \
    "$num_registered ($num_exhaustive_registered)" "${mappers:--}" >"$work/row.tsv"
  echo "$result" >>"$work/row.tsv"
}
trap write_row EXIT

# Photos of one place and three of another, which gives pairs without an edge. One camera for all: with an unknown
# focal length, as here in real photos, it makes COLMAP 4.2 fill camera1 and camera2.
if [[ ! -d $shared/images ]]; then
  mkdir "$work/images"
  echo --ImageReader.single_camera 1 >"$shared/camera.txt"
  photos=${GRAPHMATCH_PHOTOS:-$root/../shared/photos}
  if [[ -f $photos/dev.scenes.tsv ]]; then
    awk -F '\t' '$2 == "fountain" || $2 == "herzjesu" && n++ < 3 { print $1 }' "$photos/dev.scenes.tsv" |
      while read -r name; do cp "$photos/dev/$name" "$work/images/"; done
  else
    "$build/scripts/photo_renderer/render_photos" --output_path "$work/rendered" >/dev/null
    awk -F '\t' '$2 == "0" || $2 == "1" && n++ < 3 { print $1 }' "$work/cameras.tsv" |
      while read -r name; do cp "$work/rendered/$name" "$work/images/"; done
    echo --ImageReader.single_camera 1 --ImageReader.camera_model PINHOLE \
      --ImageReader.camera_params "$(awk -F '\t' '/^# PINHOLE/ { print $2 }' "$work/cameras.tsv")" >"$shared/camera.txt"
  fi
  mv "$work/images" "$shared/images"
fi
features=$shared/made-by-$old.db
if [[ ! -e $features ]]; then
  colmap=$made_by
  read -r -a camera_options <"$shared/camera.txt"
  extract "$work/features.db" "$shared/images" 1000 800 "${camera_options[@]}"
  mv "$work/features.db" "$features"
fi

database=$work/database.db
cp "$features" "$database"
"$matcher" --database_path "$database" --colmap_path "$tested" --SiftMatching.use_gpu 0 >"$work/output.txt" 2>&1 ||
  { cat "$work/output.txt"; fail "graphmatch_matcher with COLMAP $new on a database of COLMAP $old"; }
if grep -E '^W[0-9]{8} ' "$work/output.txt"; then fail "graphmatch_matcher warns"; fi

check_integrity "$database"
num_tested=$(count_tested "$database")
num_edges=$(sqlite3 "$database" "SELECT count(*) FROM two_view_geometries WHERE $edges")
((num_edges < num_tested)) || fail "every pair is an edge: rows of other pairs could not be checked"

surroundings "$features" >"$work/before.txt"
surroundings "$database" >"$work/after.txt"
cmp "$work/before.txt" "$work/after.txt" || fail "tables were touched that are not the matcher's"

# What stands for "not set" in databases of that version.
user_version=$(sqlite3 "$database" 'PRAGMA user_version')
for column in F E H qvec; do
  if ((user_version >= 3900)); then
    expect_none "$database" \
      "SELECT count(*) FROM two_view_geometries WHERE $column IS NOT NULL AND $(is_zero $column)" \
      "geometries have zeros as $column, which count as set"
  else
    expect_none "$database" "SELECT count(*) FROM two_view_geometries WHERE rows > 0 AND $column IS NULL" \
      "geometries with inliers have no $column"
  fi
done
expect_none "$database" 'SELECT count(*) FROM two_view_geometries WHERE (qvec IS NULL) != (tvec IS NULL)' \
  "geometries have half a pose"
# COLMAP 4 takes any pose for a known one, and does not mend databases of its own version.
if ((user_version >= 1000000)); then
  expect_none "$database" "SELECT count(*) FROM two_view_geometries WHERE $is_identity" \
    "geometries have the identity as pose, which counts as known to COLMAP 4"
fi
if [[ $(columns_of "$database" two_view_geometries) == *camera1* ]]; then
  # The blob begins with the id of the camera.
  for i in 1 2; do
    image=$([[ $i == 1 ]] && echo 'pair_id / 2147483647' || echo 'pair_id % 2147483647')
    expect_none "$database" "SELECT count(*) FROM two_view_geometries WHERE camera$i IS NOT NULL
      AND hex(substr(camera$i, 1, 4)) != (SELECT printf('%02X000000', camera_id) FROM images WHERE image_id = $image)" \
      "geometries have a camera$i that is not the image's"
  done
fi

# With one version only: each configuration has the columns set that COLMAP sets, for its own matches or these.
if [[ $made_by == "$tested" ]]; then
  cp "$features" "$work/own.db"
  exhaustive "$tested" "$work/own.db"
  cp "$database" "$work/verified.db"
  sqlite3 "$work/verified.db" 'DELETE FROM two_view_geometries'
  exhaustive "$tested" "$work/verified.db"
  for name in database own verified; do patterns "$work/$name.db" >"$work/$name.patterns"; done
  cut -d '|' -f 2 "$work/database.patterns" | LC_ALL=C sort | uniq -c | sed 's/^/  /'
  LC_ALL=C comm -23 <(cut -d '|' -f 2 "$work/database.patterns" | LC_ALL=C sort -u) \
    <(cut -d '|' -f 2 "$work/own.patterns" "$work/verified.patterns" | LC_ALL=C sort -u) >"$work/difference.txt"
  [[ ! -s $work/difference.txt ]] ||
    { cat "$work/difference.txt"; fail "COLMAP $new does not write this configuration with these columns set"; }
  differing=$(LC_ALL=C comm -3 <(LC_ALL=C sort "$work/database.patterns") <(LC_ALL=C sort "$work/verified.patterns") |
    tr -d '\t' | cut -d '|' -f 1 | sort -u | wc -l)
  echo "  $differing of $num_edges edges look different when COLMAP $new verifies all pairs at once"
  failures "$database" >"$work/database.failures"
  { failures "$work/own.db"; failures "$work/verified.db"; } | LC_ALL=C sort -u >"$work/own.failures"
  diff "$work/database.failures" "$work/own.failures" >"$work/difference.txt" || true
  sed -n -e 's/^</  not an edge, written by graphmatch_matcher only:/p' \
    -e 's/^>/  not an edge, written by COLMAP only:/p' "$work/difference.txt"

  # Options of 3.8's spelling reach every COLMAP under its own.
  cat >"$work/colmap-logged" <<END
#!/bin/bash
echo "\$*" >>$(printf %q "$work/commands.txt")
exec $(printf %q "$tested") "\$@"
END
  chmod +x "$work/colmap-logged"
  cp "$features" "$work/options.db"
  "$matcher" --database_path "$work/options.db" --colmap_path "$work/colmap-logged" --SiftMatching.use_gpu 0 \
    --SiftMatching.max_error 3 --SiftMatching.min_inlier_ratio 0.2 >"$work/output.txt" 2>&1 ||
    { cat "$work/output.txt"; fail "graphmatch_matcher with options"; }
  if grep -F 'does not have these options' "$work/output.txt"; then fail "an option was not translated"; fi
  colmap=$tested
  grep -F 'matches_importer --database_path' "$work/commands.txt" >"$work/importers.txt"
  for option in 'max_error 3' 'min_inlier_ratio 0.2'; do
    spelled="$(spelling matches_importer "${option% *}") ${option#* }"
    if grep -v -F -- "$spelled" "$work/importers.txt"; then fail "COLMAP $new was not told $spelled"; fi
  done
fi

# The tools of the version that made it take all pairs for tested, and leave them alone.
cp "$database" "$work/opened.db"
exhaustive "$made_by" "$work/opened.db"
for table in matches two_view_geometries; do
  rows_of "$database" $table >"$work/ours.txt"
  rows_of "$work/opened.db" $table >"$work/theirs.txt"
  LC_ALL=C comm -23 "$work/ours.txt" "$work/theirs.txt" >"$work/difference.txt"
  [[ ! -s $work/difference.txt ]] || fail "$(wc -l <"$work/difference.txt") rows in $table were changed by COLMAP $old"
done

compare_mapper "$made_by" "$old"
if [[ $new != "$old" ]] && at_least "$new" "$old"; then
  # Not every version can open the databases of older ones, whoever wrote them.
  opens=$shared/made-by-$old.opened-by-$new
  if [[ ! -e $opens.txt ]]; then
    cp "$features" "$opens.db"
    code=0
    # In a shell of its own, whose word about a crash belongs into the log.
    ("$tested" database_cleaner --type matches --database_path "$opens.db"; exit $?) >"$opens.log" 2>&1 || code=$?
    echo "$code" >"$opens.txt"
  fi
  if [[ $(cat "$opens.txt") == 0 ]]; then
    compare_mapper "$tested" "$new"
  else
    echo "  COLMAP $new cannot open a database of COLMAP $old, not even one that graphmatch_matcher never saw:"
    sed -n '/error/I{s/\x1b\[[0-9;]*m//g; s/^[WEF][0-9]\{8\} [^]]*\] //; s/^/    /; p; q}' "$opens.log"
    echo "  So its mapper is left out."
  fi
fi
result=ok
