#!/bin/bash
# Run as a user in a root with the package, by root.sh: what a user does with it, from photos to models, once with
# graphmatch_matcher and once with the wrapper for programs that call `colmap` by name.
set -euo pipefail

fail() {
  echo "FAILED: $*" >&2
  exit 1
}

# logged COMMAND...: its output is shown only if it fails.
logged() { "$@" >/trial/home/log.txt 2>&1 || { tail -n 20 /trial/home/log.txt; fail "$*"; }; }

# registered DIRECTORY: the images that the models in it have.
registered() {
  local model count sum=0
  for model in "$1"/*/; do
    count=$(colmap model_analyzer --path "$model" 2>&1 | sed -n -E 's/.*Registered images: ([0-9]+).*/\1/p')
    sum=$((sum + count))
  done
  echo "$sum"
}

cd /trial/home
export QT_QPA_PLATFORM=offscreen
graphmatch_matcher --version
help=$(graphmatch_matcher -h)
[[ $help == *--database_path*--help-all* ]] || fail "graphmatch_matcher -h: $help"
zcat /usr/share/man/man1/graphmatch_matcher.1.gz >page.1
grep -q '^\.TH GRAPHMATCH_MATCHER 1' page.1 || fail "the man page"
for file in bash-completion/completions/graphmatch_matcher zsh/vendor-completions/_graphmatch_matcher \
  doc/colmap-graphmatch/{README.md,copyright,changelog.Debian.gz,docs/options.md}; do
  [[ -s /usr/share/$file ]] || fail "no /usr/share/$file"
done

photos=$(find /trial/images -type f | wc -l)
logged colmap feature_extractor --database_path features.db --image_path /trial/images --SiftExtraction.use_gpu 0 \
  --SiftExtraction.max_num_features 1024 --ImageReader.single_camera 1 --ImageReader.camera_model PINHOLE \
  --ImageReader.camera_params "$(sed -n -E 's/^# PINHOLE\t([^\t]+).*/\1/p' /trial/cameras.tsv)"
cp features.db named.db
cp features.db wrapped.db

graphmatch_matcher --database_path named.db >named.txt 2>named.log || { cat named.log; fail "graphmatch_matcher"; }
grep -E '^(Images|Matching graph)' named.txt
mkdir named
logged colmap mapper --database_path named.db --image_path /trial/images --output_path named
count=$(registered named)
((count == photos)) || fail "$count of $photos photos are registered"
echo "graphmatch_matcher: $count of $photos photos registered"

export PATH=/usr/libexec/colmap-graphmatch:$PATH
[[ $(command -v colmap) == /usr/libexec/colmap-graphmatch/colmap ]] || fail "the wrapper is not first on PATH"
colmap vocab_tree_matcher --database_path wrapped.db --VocabTreeMatching.vocab_tree_path none \
  --SiftMatching.use_gpu 0 >wrapped.txt 2>wrapped.log || { cat wrapped.log; fail "colmap vocab_tree_matcher"; }
diff <(grep '^Matching graph' named.txt) <(grep '^Matching graph' wrapped.txt) || fail "the wrapper's graph is another"
mkdir wrapped
logged colmap mapper --database_path wrapped.db --image_path /trial/images --output_path wrapped
count=$(registered wrapped)
((count == photos)) || fail "$count of $photos photos are registered by way of the wrapper"
echo "The wrapper: $count of $photos photos registered"
