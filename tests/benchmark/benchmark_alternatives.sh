#!/bin/bash
# benchmark_alternatives.sh BUILD_DIR FEATURES PHOTOS NUM_IMAGES NUM_WORDS [COLMAP...]: whole runs of each COLMAP
# (default: the installed one), one after the other, on copies of the database FEATURES of the directory PHOTOS: this
# program with that COLMAP, its exhaustive matcher, and its vocabulary tree (NUM_WORDS visual words learnt from these
# photos, NUM_IMAGES images tested with each). Then its mapper runs on what each found. Prints a row each: seconds by
# the clock, seconds of CPU time, pairs tested, edges, images in a model. COLMAP matches on the CPU.
set -euo pipefail

matcher=$1/colmap_graphmatch/graphmatch_matcher
features=$2
photos=$(realpath "$3")  # A COLMAP in a root of its own has another working directory.
num_images=$4
num_words=$5
colmaps=("${@:6}")
((${#colmaps[@]} > 0)) || colmaps=(colmap)
scripts=$(cd "$(dirname "$0")/../../scripts" && pwd)
work=$(mktemp -d "${TMPDIR:-/tmp}/benchmark-XXXXXX")
trap 'rm -rf "$work"' EXIT
export QT_QPA_PLATFORM=offscreen
TIMEFORMAT='%R %U %S'
exec 4>&2

# seconds COMMAND...: seconds by the clock and of CPU time, of the command and all that it starts.
seconds() {
  { time "$@" >"$work/log.txt" 2>&1 || { tail -n 20 "$work/log.txt" >&4; exit 1; }; } 2>&1 |
    awk '{ printf "%.1f %.1f\n", $1, $2 + $3 }'
}

count() { # DATABASE CONDITION: pairs
  sqlite3 "$1" "SELECT COUNT(*) FROM two_view_geometries WHERE $2"
}

registered() { # DIRECTORY: images in a model
  PYTHONPATH=$scripts /usr/bin/python3 -c '
import pathlib, sys
from evaluation.reconstruction import read_models
print(len(set().union(*read_models(pathlib.Path(sys.argv[1])))))' "$1"
}

# row NAME SECONDS...: what a system took, in one or more commands, and what is in its database.
row() {
  local name=$1 taken images mapper_options=()
  taken=$(awk '{ wall += $1; cpu += $2 } END { printf "%.0f | %.0f", wall, cpu }' <<<"$2")
  mkdir "$work/sparse"
  # COLMAP 4.2.1 crashes in it on some photos.
  local fallback=--Mapper.structure_less_registration_fallback
  [[ $("$colmap" mapper -h 2>&1) != *"$fallback"* ]] || mapper_options=("$fallback" 0)
  "$colmap" mapper --database_path "$work/copy.db" --image_path "$photos" --output_path "$work/sparse" \
    "${mapper_options[@]}" >"$work/log.txt" 2>&1 || { tail -n 20 "$work/log.txt" >&4; exit 1; }
  images=$(registered "$work/sparse")
  echo "| $name | $taken | $(count "$work/copy.db" TRUE) | $(count "$work/copy.db" 'rows > 0') | $images |"
  rm -r "$work/sparse"
}

clean_copy() {
  rm -f "$work/copy.db"*
  cp "$features" "$work/copy.db"
  sqlite3 "$work/copy.db" 'DELETE FROM matches; DELETE FROM two_view_geometries'
}

echo "| | wall clock s | CPU s | pairs tested | edges | registered images |"
for colmap in "${colmaps[@]}"; do
  help=$("$colmap" help)
  version=$(grep -o -m 1 -E '[0-9]+\.[0-9]+(\.[0-9]+)?' <<<"$help")
  options=$("$colmap" exhaustive_matcher -h 2>&1)
  group=SiftMatching
  [[ $options != *--FeatureMatching.use_gpu* ]] || group=FeatureMatching

  clean_copy
  row "ours, with COLMAP $version" "$(seconds "$matcher" --database_path "$work/copy.db" --colmap_path "$colmap")"

  clean_copy
  row "exhaustive_matcher $version" "$(seconds "$colmap" exhaustive_matcher --database_path "$work/copy.db" \
    "--$group.use_gpu" 0)"

  clean_copy
  learning=$(seconds "$colmap" vocab_tree_builder --database_path "$work/copy.db" --vocab_tree_path "$work/tree.bin" \
    --num_visual_words "$num_words")
  matching=$(seconds "$colmap" vocab_tree_matcher --database_path "$work/copy.db" "--$group.use_gpu" 0 \
    --VocabTreeMatching.vocab_tree_path "$work/tree.bin" --VocabTreeMatching.num_images "$num_images")
  row "vocab_tree_matcher $version ($learning to learn the tree)" "$learning"$'\n'"$matching"
done
